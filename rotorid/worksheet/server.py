"""The worksheet's server: one port of this computer, one token, one job."""

from __future__ import annotations

import logging
import secrets
import socket
from collections.abc import Callable
from pathlib import Path
from types import FrameType

HOST = "127.0.0.1"


def serve(job: Path, port: int, told: Callable[[str], object]) -> None:
    """Serve the page of a job until it is interrupted.

    Parameters
    ----------
    job
        A job, or a folder for one.
    port
        Of 127.0.0.1; 0: any that is free.
    told
        Gets the address as soon as it can be opened.

    Raises
    ------
    ValueError
        For what is no job, where the port is taken, and without the extra `rotorid[worksheet]`.
    """
    try:
        import tomlkit  # noqa: F401
        import uvicorn

        from rotorid.worksheet.app import application
    except ImportError as error:
        needed = "starlette uvicorn tomlkit"
        raise ValueError(f"the worksheet needs {error.name}: pip install {needed}") from error
    from rotorid.worksheet.job_files import JobFiles
    from rotorid.worksheet.session import Session

    session, token = Session(JobFiles(job)), secrets.token_urlsafe(24)

    class Server(uvicorn.Server):
        def handle_exit(self, sig: int, frame: FrameType | None) -> None:
            session.leave()
            super().handle_exit(sig, frame)

    with socket.socket() as listening:
        listening.setsockopt(socket.SOL_SOCKET, socket.SO_REUSEADDR, 1)
        try:
            listening.bind((HOST, port))
        except OSError as error:
            raise ValueError(f"port {port} of {HOST} cannot be used: {error.strerror}") from error
        listening.listen()
        own = f"{HOST}:{listening.getsockname()[1]}"
        app = application(session, token, own, lambda: told(f"http://{own}/#{token}"))
        # a worker that Ctrl+C finds half started may be reaped by two; the program ends it anyway
        logging.getLogger("asyncio").setLevel(logging.ERROR)
        config = uvicorn.Config(app, log_level="warning", access_log=False, timeout_graceful_shutdown=1)
        Server(config).run(sockets=[listening])
