"""Jobs: the files of one balancing job, with its conventions and stated errors."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

from rotorid.base.text import counted
from rotorid.files.conventions import resolve_angles
from rotorid.files.problems import Problems
from rotorid.files.toml_file import Section
from rotorid.tables.job.job_data import Job, Overrides
from rotorid.tables.job.job_from_excel import open_job
from rotorid.tables.job.job_reading import job_of

__all__ = ["Job", "job_from_files", "read_job"]


def read_job(
    path: str | Path,
    *,
    phase: str | None = None,
    angles: str | None = None,
    amplitude_error_percent: float | None = None,
    phase_error_deg: float | None = None,
    run_error_percent: float | None = None,
    waveforms: str | Path | None = None,
) -> Job:
    """Read a job file (`.toml`) or a workbook (`.xlsx`, sheets runs, weights, planes, sensors, settings).

    Parameters
    ----------
    path
        The job; files that it names are found relative to it.
    phase, angles, amplitude_error_percent, phase_error_deg, run_error_percent
        Replace what the job says.
    waveforms
        A waveforms file, in place of the runs table.

    Returns
    -------
    Job
        In SI, phase lead, angles with the rotation, and labels to print in.

    Raises
    ------
    InputError
        With all problems of all files of the job.
    ValueError
        If an argument is none of the allowed values.
    """
    path = Path(path)
    overrides = Overrides(
        phase, angles, amplitude_error_percent, phase_error_deg, run_error_percent, waveforms
    )
    problems = Problems()
    written = open_job(path, problems)
    return job_of(path, written.top(problems), written.tables, overrides, problems)


def job_from_files(
    files: Sequence[str | Path],
    *,
    influence: str | Path | None = None,
    phase: str | None = None,
    angles: str | None = None,
    amplitude_error_percent: float | None = None,
    phase_error_deg: float | None = None,
    run_error_percent: float | None = None,
    waveforms: str | Path | None = None,
) -> Job:
    """A job without a job file: a runs table with a weights table, or with stored coefficients.

    Parameters
    ----------
    files
        Runs and weights; with `influence` the weights (mounted during the runs) may be left out.
    influence
        Influence table.
    phase, angles, amplitude_error_percent, phase_error_deg, run_error_percent
        Conventions and stated errors; default: lead and with rotation, which the labels then call assumed;
        none stated.
    waveforms
        As of `read_job`.

    Returns
    -------
    Job
        As of `read_job`.

    Raises
    ------
    InputError
        With all problems of all files.
    ValueError
        If the files are too few or too many, or an argument is none of the allowed values.
    """
    if not 1 <= len(files) <= 2 or (len(files) == 1 and influence is None):
        raise ValueError(
            "give a job (.toml or .xlsx), or a runs table and a weights table, or a runs table and "
            f"--influence with an influence table; got {counted(len(files), 'file')}"
        )
    overrides = Overrides(
        phase, angles, amplitude_error_percent, phase_error_deg, run_error_percent, waveforms
    )
    if angles is not None:
        resolve_angles(angles, None)
    tables = {key: Path(file) for key, file in zip(("runs", "weights"), files, strict=False)}
    if influence is not None:
        tables["influence"] = Path(influence)
    problems = Problems()
    return job_of(None, Section("", {}, problems), tables, overrides, problems)
