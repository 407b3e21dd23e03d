"""A balancing job and its results as one workbook, from which the job can be read back unchanged."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from pathlib import Path
from typing import Any

from rotorid.tables.job.job_as_written import JobSource, job_tables
from rotorid.tables.job.job_data import Job
from rotorid.tables.job.job_from_excel import job_in_sheets
from rotorid.tables.job.job_keys import JOB
from rotorid.tables.job.workbook_results import Results, result_sheets
from rotorid.tables.job.workbook_sheets import NAMES, job_sheets
from rotorid.tables.reader.excel_pages import Line, Page, book_bytes
from rotorid.tables.reader.grid import BadCell, Cell, clean
from rotorid.tables.reader.problems import InputError, Problems
from rotorid.tables.reader.settings_keys import take
from rotorid.tables.reader.toml_file import Section

_NAMED = 3


def job_workbook_bytes(
    job: Job,
    source: JobSource,
    target: Path,
    report: Results | None = None,
    provenance: Mapping[str, Any] | None = None,
) -> bytes:
    """A workbook with all that a job says, and with its results.

    The tables are taken from the files once more, as they are written; the settings are then read from the
    sheets as `read_job` would read them, and must be those of the files: nothing is left out silently.

    Parameters
    ----------
    job
        The job as it was read and balanced.
    source
        What it was read from, with what the command line says in place of the files.
    target
        Where the workbook will be: the rotor file is named from there.
    report
        The results; None for the job alone.
    provenance
        Program version, input files, date and options.

    Returns
    -------
    bytes
        Sheets runs, weights, planes, sensors, settings; influence, check, check_weights and slow_roll where
        the job has such tables; sheets whose names begin with "results", which no reader looks at.

    Raises
    ------
    ValueError
        If the workbook cannot say what the job says.
    InputError
        If a file of the job cannot be read any more.
    """
    tables = job_tables(source, job)
    sheets = job_sheets(tables, target, job.planes, job.trials.sensors)
    _prove(tables.written.settings, sheets, target)
    results = {} if report is None else result_sheets(report, provenance)
    pages = [Page(title, lines, names=NAMES) for title, lines in {**sheets, **results}.items()]
    return book_bytes(pages, "results" if results else "runs")


def _prove(settings: Mapping[str, Any], sheets: Mapping[str, list[Line]], target: Path) -> None:
    """Read the sheets as they will be read, and compare their settings with those of the files."""
    rows = {
        title: [(number, tuple(map(_as_read, line))) for number, line in enumerate(lines, start=1)]
        for title, lines in sheets.items()
    }
    problems = Problems()
    try:
        written = job_in_sheets(target, rows, problems)
        back = take(written.top(problems), JOB)
        problems.stop()
    except InputError as error:
        raise ValueError(
            f"{target}: this job cannot be kept in a workbook, which would be read like this: "
            f"{error.problems[0]} (a .csv file takes the corrections alone)"
        ) from error
    said = take(Section(str(target), settings, Problems()), JOB)
    unlike = list(_unlike(said, {**back, "rotor": None}))
    if unlike:
        more = f" and {len(unlike) - _NAMED} more" if len(unlike) > _NAMED else ""
        raise ValueError(
            f"{target}: this job cannot be kept in a workbook: {', '.join(unlike[:_NAMED])}{more} would not "
            "be the same when it is read back (names with ; or : or with blanks around them need a job file; "
            "a .csv file takes the corrections alone)"
        )


def _as_read(cell: Cell | None) -> Cell:
    """What a reader of workbooks finds in a cell."""
    if isinstance(cell, str):
        return clean(cell)
    if isinstance(cell, BadCell):
        return cell.value
    return "" if cell is None else cell


def _unlike(said: object, back: object, name: str = "") -> Iterator[str]:
    """Dotted names of the keys whose values differ."""
    if isinstance(said, Mapping) and isinstance(back, Mapping):
        for key in said:
            yield from _unlike(said[key], back.get(key), f"{name}.{key}".removeprefix("."))
    elif said != back:
        yield name
