"""The worksheet's server: one port of this computer, one token, one job."""

from __future__ import annotations

import hashlib
import hmac
import os
import secrets
import signal
import socket
from collections.abc import Callable
from contextlib import suppress
from pathlib import Path

HOST = "127.0.0.1"
FIRST_PORT, PORTS = 49152, 16384
"""Ports that nobody else has claimed: each job has one of its own, where it is free."""


def serve(job: Path, show: Callable[[str], object]) -> None:
    """Serve the page of a job, or of a folder for one, until it is interrupted.

    The port of 127.0.0.1 is that of the job, or any where that is taken. `show` gets the address. ValueError
    for what is no job, and without the extra `rotorid[worksheet]`.
    """
    try:
        import tomlkit  # noqa: F401
        import uvicorn

        from rotorid.worksheet.app import Worksheet
    except ImportError as error:
        raise ValueError(
            f"the worksheet needs {error.name}: pip install starlette uvicorn tomlkit"
        ) from error
    from rotorid.worksheet.job_files import JobFiles

    if hasattr(signal, "SIGPIPE"):  # a process that was ended reads no more; Windows has none
        signal.signal(signal.SIGPIPE, signal.SIG_IGN)
    files = JobFiles(job)
    digest = hmac.new(_secret(), str(files.job).encode(), hashlib.sha256)
    token = digest.hexdigest()[:32]
    usual = FIRST_PORT + int.from_bytes(digest.digest()[16:20]) % PORTS

    with socket.socket() as listening:
        if os.name == "posix":  # elsewhere it would let two programs have one port
            listening.setsockopt(socket.SOL_SOCKET, socket.SO_REUSEADDR, 1)
        try:
            listening.bind((HOST, usual))
        except OSError:
            listening.bind((HOST, 0))
        listening.listen()
        address = f"{HOST}:{listening.getsockname()[1]}"
        app = Worksheet(files, token, address)
        config = uvicorn.Config(
            app, log_level="warning", lifespan="off", ws="none", timeout_graceful_shutdown=2
        )
        show(f"http://{address}/#{token}")  # who opens it now waits for an answer
        try:
            uvicorn.Server(config).run(sockets=[listening])
        finally:
            app.stop()


def _secret() -> bytes:
    """What the keys of addresses are made of: drawn once for each user, so that they survive a restart."""
    state = os.environ.get("XDG_STATE_HOME") or Path.home() / ".local" / "state"
    path, new = Path(state) / "rotorid" / "worksheet_key", secrets.token_bytes(32)
    with suppress(OSError):
        path.parent.mkdir(parents=True, exist_ok=True)
        with suppress(FileExistsError):
            path.touch(0o600, exist_ok=False)
            path.write_bytes(new)
        kept = path.read_bytes()
        if len(kept) == len(new):
            return kept
    return new
