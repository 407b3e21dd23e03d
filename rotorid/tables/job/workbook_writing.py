"""Results of a balancing job as a workbook: a copy of the user's own with sheets of results, or these alone.

The sheets of results are for reading and are not read back.
"""

from __future__ import annotations

import io
import math
import warnings
from collections.abc import Iterator, Mapping
from pathlib import Path
from typing import TYPE_CHECKING, Any, Protocol

from balancing import Influence
from rotorid.files.cells import Cell, read_bytes
from rotorid.files.excel_pages import Line, Page, book_bytes
from rotorid.files.excel_workbook import is_workbook
from rotorid.files.influence import influence_frame
from rotorid.files.problems import Problems
from rotorid.tables.job.job_as_written import JobSource
from rotorid.tables.job.job_data import Job
from rotorid.tables.job.job_from_excel import RESULTS

if TYPE_CHECKING:
    import pandas as pd

_NOT_READ = "computed from the other sheets; not read back"


class Framed(Protocol):
    """A result that is a table."""

    def to_frame(self) -> pd.DataFrame:
        """Its table."""


class Results(Protocol):
    """What `rotorid balance` has found."""

    @property
    def result(self) -> Framed:
        """The corrections."""

    @property
    def mounted(self) -> Framed | None:
        """What goes into which hole, where that was asked for."""

    @property
    def influence(self) -> Influence:
        """The influence coefficients."""

    def to_dict(self) -> dict[str, Any]:
        """The document of `--json`, without its provenance."""


def job_workbook_bytes(
    job: Job,
    source: JobSource,
    target: Path,
    report: Results,
    provenance: Mapping[str, Any] | None = None,
) -> bytes:
    """A workbook with the results of a job.

    Parameters
    ----------
    job, target
        The job as it was read and balanced, and where the workbook will be; they change nothing.
    source
        What the job was read from: of a workbook all sheets but those of older results are kept, with their
        formats and formulas, without pictures and charts.
    report
        The results.
    provenance
        Program version, input files, date and options.

    Raises
    ------
    InputError
        If the workbook of the job cannot be read any more.
    """
    own = None
    if len(source.files) == 1 and is_workbook(source.files[0]):
        import openpyxl

        problems = Problems()
        data = problems.need(read_bytes(source.files[0], problems))
        with warnings.catch_warnings():
            warnings.simplefilter("ignore")  # about parts that are not kept
            own = openpyxl.load_workbook(io.BytesIO(data))
        for title in own.sheetnames:
            if title.strip().casefold().startswith(RESULTS):
                del own[title]
    pages = [Page(title, lines) for title, lines in result_sheets(report, provenance).items()]
    return book_bytes(pages, RESULTS, own)


def result_sheets(results: Results, provenance: Mapping[str, Any] | None) -> dict[str, list[Line]]:
    """Sheets of results, by name.

    Parameters
    ----------
    results
        Of the job.
    provenance
        Program version, date, input files and options, or None.
    """
    document = results.to_dict()
    warnings = [(f"# warning: {text}",) for text in document.get("warnings", ())]
    warnings += [(f"# {text}",) for text in document.get("assumptions", ())]
    head: list[Line] = [(f"# {_NOT_READ}",)]
    sheets = {RESULTS: [*head, *warnings, *_frame(results.result.to_frame())]}
    rows = [*_summary(document, ()), *(() if provenance is None else _summary(provenance, ("provenance",)))]
    sheets[f"{RESULTS} summary"] = [*head, ("result", "value"), *rows]
    sheets[f"{RESULTS} residuals"] = [*head, *_records(document.get("residuals", ()))]
    for name, keys in {
        "other readings": ("other_readings",),
        "add to mounted": ("add_to_mounted",),
        "mounted residuals": ("mounting", "residuals"),
        "check": ("check", "readings"),
        "verdict": ("verdict", "rows"),
    }.items():
        found: Any = document
        for key in keys:
            found = None if found is None else found.get(key)
        if found:
            sheets[f"{RESULTS} {name}"] = [*head, *_records(found)]
    if results.mounted is not None:
        sheets[f"{RESULTS} holes"] = [*head, *_frame(results.mounted.to_frame())]
    sheets[f"{RESULTS} influence"] = [*head, *_frame(influence_frame(results.influence))]
    return sheets


def _frame(frame: pd.DataFrame) -> list[Line]:
    plain = frame.astype(object).where(frame.notna(), None)
    header: Line = tuple(str(name) for name in frame.columns)
    return [header, *(tuple(_cell(value) for value in row) for row in plain.itertuples(index=False))]


def _records(rows: Any) -> list[Line]:  # noqa: ANN401  a part of a JSON document
    """Rows of numbers and words; lists in them, such as covariances, are left to `--json`."""
    columns = (
        [key for key, value in rows[0].items() if not isinstance(value, (list, Mapping))] if rows else []
    )
    return [tuple(columns), *(tuple(_cell(row[key]) for key in columns) for row in rows)]


def _summary(document: Mapping[str, Any], above: tuple[str, ...]) -> Iterator[Line]:
    """Single values of a document by their dotted names, and lists of words."""
    for key, value in document.items():
        name = (*above, key)
        if isinstance(value, Mapping):
            yield from _summary(value, name)
        elif value is None:
            continue
        elif not isinstance(value, list):
            yield ".".join(name), _cell(value)
        elif all(isinstance(entry, str) for entry in value):
            yield from ((".".join(name), entry) for entry in value)
        elif above[:1] == ("provenance",):
            yield from ((".".join(name), ", ".join(map(str, entry.values()))) for entry in value)


def _cell(value: Any) -> Cell:  # noqa: ANN401  what a table or a document holds
    item = getattr(value, "item", None)
    if callable(item):
        value = item()
    if value is None:
        return ""
    if isinstance(value, bool):
        return "yes" if value else "no"
    return value if isinstance(value, (int, float)) and math.isfinite(value) else str(value)
