"""What a workflow works on, read from files where it is given by them."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import asdict
from pathlib import Path
from typing import TYPE_CHECKING, TypeAlias

if TYPE_CHECKING:
    from fem import Rotor
    from rotorid.tables import Job
    from rotorid.tables.job.source import JobSource

JobGiven: TypeAlias = "Job | Path | str | Sequence[Path | str]"
"""A job, its file, or a runs table and a weights table."""


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
    return read_source(job_files(given, phase=phase, angles=angles))


def job_files(
    given: JobGiven,
    influence: Path | str | None = None,
    *,
    phase: str | None = None,
    angles: str | None = None,
    amplitude_error_percent: float | None = None,
    phase_error_deg: float | None = None,
    run_error_percent: float | None = None,
) -> Job | JobSource:
    """A job that has been read, or what is to be read, with what is said in place of it.

    Parameters
    ----------
    given
        The job, or its files.
    influence
        Stored coefficients, beside tables.
    phase, angles, amplitude_error_percent, phase_error_deg, run_error_percent
        As `read_job` takes them.

    Raises
    ------
    ValueError
        For any of these with a job that is read already.
    """
    from rotorid.tables.job.source import JobSource

    said = (phase, angles, amplitude_error_percent, phase_error_deg, run_error_percent)
    stored = None if influence is None else Path(influence)
    if isinstance(given, Path | str):
        given = [given]
    if isinstance(given, Sequence):
        return JobSource(tuple(Path(file) for file in given), stored, *said)
    if any(value is not None for value in (stored, *said)):
        raise ValueError("the conventions of a job, its errors and coefficients are stated where it is read")
    return given


def read_source(source: Job | JobSource) -> Job:
    """The job."""
    from rotorid.tables import job_from_files, read_job
    from rotorid.tables.job.source import JobSource

    if not isinstance(source, JobSource):
        return source
    files, said = source.files, asdict(source.overrides)
    if len(files) == 1 and source.influence is None and files[0].suffix.lower() in (".toml", ".xlsx"):
        return read_job(files[0], **said)
    return job_from_files(files, influence=source.influence, **said)
