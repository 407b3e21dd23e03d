"""What a workflow works on, read from files where it is given by them."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from fem import Rotor
    from rotorid.tables import Job


def rotor_source(given: Rotor | Path | str) -> tuple[Rotor, tuple[Path, ...]]:
    """A rotor, and the files that it was read from."""
    from rotorid.tables import read_rotor, rotor_files

    if not isinstance(given, Path | str):
        return given, ()
    return read_rotor(given), rotor_files(Path(given))


def job_source(given: Job | Path | str, phase: str | None = None, angles: str | None = None) -> Job:
    """A job; `phase` and `angles` in place of what its file says.

    Raises
    ------
    ValueError
        For these with a job that is read already.
    """
    from rotorid.tables import read_job

    if isinstance(given, Path | str):
        return read_job(given, phase=phase, angles=angles)
    if phase is not None or angles is not None:
        raise ValueError("the conventions of a job are stated where it is read")
    return given
