"""A balancing job and its results as one workbook, from which the job can be read back unchanged."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import Any

from rotorid.tables.job.comparison import differences
from rotorid.tables.job.job_data import Job, Overrides
from rotorid.tables.job.job_reading import job_of
from rotorid.tables.job.source import JobSource, job_tables
from rotorid.tables.job.workbook_pages import Page, book_bytes
from rotorid.tables.job.workbook_reading import job_in_sheets
from rotorid.tables.job.workbook_results import Results, result_sheets
from rotorid.tables.job.workbook_sheets import Line, as_rows, job_sheets
from rotorid.tables.reader.grid import BadCell, clean
from rotorid.tables.reader.problems import InputError, Problems

_NAMED = 3


def job_workbook_bytes(
    job: Job,
    source: JobSource,
    target: Path,
    report: Results | None = None,
    provenance: Mapping[str, Any] | None = None,
) -> bytes:
    """A workbook with all that a job says, and with its results.

    The tables are taken from the files once more, as they are written; the sheets are then read as
    `read_job` would read them, and the job in them must be this one: nothing is left out silently.

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
    sheets = job_sheets(job_tables(source, job), target, job.planes, job.trials.sensors)
    _prove(job, sheets, target)
    results = {} if report is None else result_sheets(report, provenance)
    pages = [Page(title, lines) for title, lines in {**sheets, **results}.items()]
    return book_bytes(pages, "results" if results else "runs")


def _prove(job: Job, sheets: Mapping[str, list[Line]], target: Path) -> None:
    """Read the sheets as they will be read, and compare."""
    read = {
        title: as_rows(
            tuple(
                clean(cell) if isinstance(cell, str) else cell.value if isinstance(cell, BadCell) else cell
                for cell in line
            )
            for line in lines
        )
        for title, lines in sheets.items()
    }
    try:
        problems = Problems()
        written = job_in_sheets(target, read, problems)
        back = job_of(target, written.top(problems), written.tables, Overrides(), problems)
    except InputError as error:
        raise ValueError(
            f"{target}: this job cannot be kept in a workbook, which would be read like this: "
            f"{error.problems[0]} (a .csv file takes the corrections alone)"
        ) from error
    unlike = differences(job, back)
    if unlike:
        more = f" and {len(unlike) - _NAMED} more" if len(unlike) > _NAMED else ""
        raise ValueError(
            f"{target}: this job cannot be kept in a workbook: {', '.join(unlike[:_NAMED])}{more} would not "
            "be the same when it is read back (names with ; or : or with blanks around them need a job file; "
            "a .csv file takes the corrections alone)"
        )
