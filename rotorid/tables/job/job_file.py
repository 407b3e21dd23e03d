"""Jobs: the files of one balancing job, with its conventions and stated errors."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace
from pathlib import Path

from balancing.data.conventions import Labels
from rotorid.base.text import counted
from rotorid.tables.job.assumed import with_assumed
from rotorid.tables.job.completion import completed
from rotorid.tables.job.job_data import Job, Source, source_name
from rotorid.tables.job.job_model import collect, read_model
from rotorid.tables.job.keys import COLUMNS, read_plane, read_sensor
from rotorid.tables.job.settings import (
    Overrides,
    Settings,
    read_extra,
    read_settings,
    settle_conventions,
    source_of,
)
from rotorid.tables.job.workbook_reading import TABLES, read_job_book
from rotorid.tables.reader.grid import Grid, Row
from rotorid.tables.reader.problems import InputError, Problems
from rotorid.tables.reader.toml_file import Section, read_toml
from rotorid.tables.reader.workbook import is_workbook, read_workbook
from rotorid.tables.runs.influence_table import fit_to_readings, load_influence
from rotorid.tables.runs.trials import make_trials

__all__ = ["Job", "job_from_files", "read_job"]


def read_job(
    path: str | Path,
    *,
    phase: str | None = None,
    angles: str | None = None,
    amplitude_error_percent: float | None = None,
    phase_error_deg: float | None = None,
    run_error_percent: float | None = None,
) -> Job:
    """Read a job file (`.toml`) or a workbook (`.xlsx`, sheets runs, weights, planes, sensors, settings).

    Parameters
    ----------
    path
        The job; files that it names are found relative to it.
    phase, angles, amplitude_error_percent, phase_error_deg, run_error_percent
        Replace what the job says.

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
    problems = Problems()
    overrides = Overrides(phase, angles, amplitude_error_percent, phase_error_deg, run_error_percent)
    if is_workbook(path):
        sheets = read_workbook(path, problems)
        problems.stop()
        return job_from_sheets(path, sheets or {}, overrides)
    if path.suffix.lower() == ".toml":
        data = read_toml(path, problems)
        problems.stop()
        top = Section(str(path), data or {}, problems)
        if "runs" not in top:
            top.missing("runs", 'the runs table, runs = "runs.csv"')
        return _read(path, top, {}, overrides, problems)
    expected = "a job: a .toml file, or an .xlsx workbook with sheets runs and weights"
    problems.add(str(path), None, None, None, expected)
    problems.stop()
    raise AssertionError


def job_from_sheets(path: Path, sheets: Mapping[str, Sequence[Row]], overrides: Overrides) -> Job:
    """The job in the sheets of a workbook; `path` is where it is, or will be.

    Raises
    ------
    InputError
        With all problems.
    """
    problems = Problems()
    book = read_job_book(path, sheets, COLUMNS, problems)
    if book is None:
        problems.stop()
        raise AssertionError
    top = Section(str(path), book.settings, problems, where=book.where)
    for key in TABLES:
        if key in top and (key in book.tables or key in TABLES[:2]) and top.take(key) is not None:
            top.complain(key, f"the table in the sheet {key!r} of this workbook, not a file")
    return _read(path, top, book.tables, overrides, problems)


def _read(
    path: Path, top: Section, sheets: Mapping[str, Grid], overrides: Overrides, problems: Problems
) -> Job:
    """The job of these settings; its tables are files or sheets."""
    runs, weights, influence = (source_of(top, key, path, sheets) for key in TABLES[:3])
    extra = read_extra(top, path, sheets)
    stated = [key for key in ("weights", "influence", "rotor") if key in top]
    if weights is None and influence is None and not stated:
        top.missing("weights", "a weights table, or an influence table of stored coefficients, or a rotor")
    settings = read_settings(top, overrides, problems)
    unclear = len(problems) > 0
    planes = {name: read_plane(section) for name, section in top.named("planes").items()}
    sensors = {name: read_sensor(section) for name, section in top.named("sensors").items()}
    top.finish()
    if runs is None:
        problems.stop()
        raise AssertionError
    job = _read_tables(path, runs, weights, influence, settings, problems, unclear=unclear)
    labels = Labels() if job is None else job.conventions.labels
    model = read_model(extra.rotor, planes, sensors, labels, problems, named="rotor" in top)
    if job is not None:
        job = completed(job, model, extra, settings, top, planes, sensors, problems)
    problems.stop()
    assert job is not None
    return with_assumed(job)


def job_from_files(
    files: Sequence[str | Path],
    *,
    influence: str | Path | None = None,
    phase: str | None = None,
    angles: str | None = None,
    amplitude_error_percent: float | None = None,
    phase_error_deg: float | None = None,
    run_error_percent: float | None = None,
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
    problems = Problems()
    paths = [Path(file) for file in files]
    overrides = Overrides(phase, angles, amplitude_error_percent, phase_error_deg, run_error_percent)
    settings = overrides.settings()
    stored = None if influence is None else Path(influence)
    job = _assemble(None, paths[0], paths[1] if len(paths) == 2 else None, stored, settings, problems)
    problems.stop()
    assert job is not None
    return with_assumed(job)


def _read_tables(
    job: Path,
    runs: Source,
    weights: Source | None,
    stored: Source | None,
    settings: Settings,
    problems: Problems,
    *,
    unclear: bool,
) -> Job | None:
    """`_assemble`, also where planes or sensors have problems, unless the conventions are unclear."""
    own = problems if unclear else Problems()
    read = _assemble(job, runs, weights, stored, settings, own)
    try:
        if not unclear:
            own.stop()
    except InputError as error:
        collect(error, problems)
    return read


def _assemble(
    job: Path | None,
    runs: Source,
    weights: Source | None,
    stored: Source | None,
    settings: Settings,
    problems: Problems,
) -> Job | None:
    found, name = None, "" if stored is None else source_name(stored)
    if stored is not None:
        found = load_influence(stored, settings.phase, settings.angles, problems)
    conventions, notes = settle_conventions(settings, name, found)
    trials = make_trials(runs, weights, conventions, settings.errors, problems)
    influence = None
    if found is not None and trials is not None:
        tolerance = conventions.speed_tolerance_percent
        influence = fit_to_readings(found.influence, trials, tolerance, name, problems)
    if trials is None or len(problems):
        return None
    labels = conventions.on(trials.labels if influence is None else influence.labels)
    if influence is not None:
        influence = replace(influence, labels=labels)
    trials = replace(trials, labels=labels, warnings=notes + trials.warnings)
    read = (job, runs, weights, stored)
    files = tuple(file for file in read if isinstance(file, Path))
    planes = trials.planes if influence is None else influence.planes
    return Job(trials, influence, conventions, files, planes)
