"""Peers that go with no others, by packages or licence: each in an environment and a process of its own.

`make .venv-NAME/.peer` makes the environment; ROTORID_NAME_PYTHON names another Python that has the peer.
"""

from __future__ import annotations

import os
import subprocess
from pathlib import Path

ROOT = Path(__file__).resolve().parent.parent


def peer_python(name: str) -> Path:
    """The Python of a peer's environment.

    Raises
    ------
    FileNotFoundError
        Where there is none.
    """
    variable = f"ROTORID_{name.upper().replace('-', '_')}_PYTHON"
    path = Path(os.environ.get(variable, ROOT / f".venv-{name}" / "bin" / "python"))
    if not path.exists():
        raise FileNotFoundError(
            f"there is no Python with {name} at {path}: run `make .venv-{name}/.peer`, or name one in "
            f"{variable}"
        )
    return path


def run_peer(name: str, script: str | Path, file: Path) -> None:
    """Start a script in the peer's environment with the name of a file, one BLAS thread, and wait for it."""
    environment = {**os.environ, "OPENBLAS_NUM_THREADS": "1", "OMP_NUM_THREADS": "1"}
    command = [str(peer_python(name)), str(Path(script).resolve()), str(file)]
    subprocess.run(command, check=True, env=environment, stdout=subprocess.DEVNULL)
