"""Jobs as they are written: a job file, or the sheets of a workbook; workbooks with results."""

from __future__ import annotations

import io
import json
import math
import re
import tomllib
import warnings
from collections.abc import Iterator, Mapping, Sequence
from contextlib import suppress
from dataclasses import dataclass, field
from decimal import Decimal
from pathlib import Path
from typing import Any

from rotorid.base.json import cell
from rotorid.base.suggestions import did_you_mean
from rotorid.base.tables import Column, Table, Value, excel
from rotorid.base.text import listing
from rotorid.files.cells import BadCell, Cell, Grid, Row, Shown, make_grid, read_bytes, show
from rotorid.files.columns import REMARKS, Source, sheet_source
from rotorid.files.decimal_numbers import parse_number
from rotorid.files.excel_pages import keep_cells
from rotorid.files.excel_workbook import is_workbook, read_workbook
from rotorid.files.job_models import READINGS, TABLES, JobSettings, Plane, Sensor
from rotorid.files.layout import rows_from_header
from rotorid.files.problems import Problems
from rotorid.files.settings import Settings, read_settings
from rotorid.files.toml_file import read_toml

NAMED: dict[str, tuple[str, type[Settings]]] = {"planes": ("plane", Plane), "sensors": ("sensor", Sensor)}
"""Sheets with a row for each plane or sensor: the column of its name, and keys that are columns."""
SETTINGS = (*NAMED, "settings")
RESULTS = "results"
"""Sheets whose names begin so hold what a command has computed: they are not read."""
OPTIONAL = "note (a blank value: not stated)"
"""A column of the sheet settings with this name lets values be blank, for forms to fill in."""
TEXT_COLUMNS = ("run", "sensor", "plane", "repeat", "key")
"""Columns of names, in which `1` is text."""
_BARE = re.compile(r"[A-Za-z0-9_-]+")


@dataclass(frozen=True, eq=False)
class WrittenJob:
    """A job as it is written: settings nested as in a job file, and the tables of a workbook.

    Attributes
    ----------
    path
        The job file or workbook, None without one.
    settings
        As a job file holds them.
    tables
        Tables that are there already, by `TABLES`: cells of sheets, or files.
    where
        Sheet, row and column of each setting, by its dotted key.
    """

    path: Path | None
    settings: dict[str, Any] = field(default_factory=dict)
    tables: dict[str, Source] = field(default_factory=dict)
    where: dict[str, tuple[str, int, str]] = field(default_factory=dict)

    @property
    def folder(self) -> Path:
        """From which files are named."""
        return Path() if self.path is None else self.path.parent

    def read(self, problems: Problems) -> JobSettings:
        """All settings; a file that is named in place of a sheet is a problem."""
        source = "" if self.path is None else str(self.path)
        if not self.tables and "runs" not in self.settings:
            problems.add(source, None, "runs", None, 'a job, which names the runs table, runs = "runs.csv"')
            problems.stop()
        settings = problems.need(read_settings(JobSettings, self.settings, source, problems, self.where))
        for key in TABLES if self.tables and self.path else ():
            if settings.has(key) and (key in self.tables or key in TABLES[:2]):
                expected = f"the table in the sheet {key!r} of this workbook, not a file"
                settings.complain(problems, key, expected)
        return settings


def open_job(path: Path, problems: Problems) -> WrittenJob:
    """A job file (`.toml`) or a workbook (`.xlsx`) as it is written.

    Raises
    ------
    InputError
        If there is nothing of a job in it.
    """
    if is_workbook(path):
        return job_in_sheets(path, problems.need(read_workbook(path, problems)), problems)
    if path.suffix.lower() != ".toml":
        expected = "a job: a .toml file, or an .xlsx workbook with sheets runs and weights"
        problems.add(str(path), None, None, None, expected)
        problems.stop()
    return WrittenJob(path, problems.need(read_toml(path, problems)))


def job_in_sheets(path: Path, sheets: Mapping[str, Sequence[Row]], problems: Problems) -> WrittenJob:
    """The job in the sheets of a workbook; `path` is where it is, or will be.

    Raises
    ------
    InputError
        If there are no runs; other problems are noted.
    """
    known = (*TABLES, *SETTINGS, RESULTS)
    titles = {
        title.strip().casefold(): title for title in reversed(list(sheets)) if _holds_cells(sheets[title])
    }
    for name, title in titles.items() if titles.keys() & {*known} else ():
        if name not in known and not name.startswith((RESULTS, *REMARKS)):
            expected = (
                f"a known sheet{did_you_mean(name, known)}; known are {listing(known, 'and')}, remarks go "
                "into 'notes' (hidden sheets count too)"
            )
            problems.add(str(path), None, None, title, expected)
    job = WrittenJob(path)
    for name in (*TABLES, *SETTINGS):
        if name not in titles:
            continue
        source, rows = sheet_source(path, titles[name]), sheets[titles[name]]
        if name in (*READINGS, "weights", "check_weights"):
            rows = rows_from_header(rows, {}, weights=name not in READINGS)
        may_be_empty = name in ("weights", "check_weights", *SETTINGS)
        grid = make_grid(source, rows, "", problems, may_be_empty=may_be_empty)
        if grid is not None and name in TABLES:
            job.tables[name] = grid
        elif grid is not None:
            _read_rows(grid, name, job, problems)
    if "runs" not in titles:
        shown = listing((repr(title) for title in sheets), "and")
        problems.add(str(path), None, None, None, f"a sheet 'runs' with readings; the sheets are {shown}")
    if "runs" not in job.tables:
        problems.stop()
    return job


def _holds_cells(rows: Sequence[Row]) -> bool:
    return any(show(cell) for _, cells in rows for cell in cells)


def _is_remark(name: str) -> bool:
    return not name or name.casefold().startswith(REMARKS)


def _value(key: str, cell: Cell) -> Cell | bool:
    """A cell as a job file has it: a logical one as that, a date as its text."""
    if isinstance(cell, BadCell):
        if cell.value in ("TRUE", "FALSE"):
            return cell.value == "TRUE"
        return cell.value.partition(" ")[0] if key == "date" else cell
    return cell


def _read_rows(grid: Grid, sheet: str, job: WrittenJob, problems: Problems) -> None:
    """Rows of a setting each, or of a plane or sensor with settings as columns; a blank cell states nothing.

    A dotted key stands for a table (`errors.phase_deg`).
    """
    named = sheet in NAMED
    first = NAMED[sheet][0] if named else "key"
    heads = [name if named else name.casefold() for name in grid.header]
    columns = {i: name for i, name in enumerate(heads) if name != first and not _is_remark(name)}
    if first not in heads or not (named or [*columns.values()] == ["value"]):
        found = listing(filter(None, grid.header), "and")
        expected = f"a column {first}; the columns are {found}" if named else "the columns key and value"
        problems.add(grid.source, grid.header_row, first, None, expected)
        return
    at = heads.index(first)
    for row, cells in grid.rows:
        key = show(cells[at])
        parts = [sheet, key] if named else key_parts(key)
        name = ".".join(parts)
        if isinstance(cells[at], BadCell) or not key or name in job.where:
            again = f"each {first} once (row {job.where[name][1]} has it too)" if name in job.where else ""
            expected = again or getattr(cells[at], "expected", f"the name of a {first}")
            problems.add(grid.source, row, grid.header[at], key, expected)
            continue
        if named:
            _put(job, parts, {}, (grid.source, row, first))
        for i, column in columns.items():
            at_column = [*parts, column] if named else parts
            value, place = _value(at_column[-1], cells[i]), (grid.source, row, grid.header[i])
            if isinstance(value, BadCell):
                problems.add(*place, value.value, value.expected)
            elif value != "" and not _put(job, at_column, value, place):
                expected = f"no parts of {name.rpartition('.')[0]}, which has a value of its own"
                problems.add(grid.source, row, grid.header[at], key, expected)


def key_parts(key: str) -> list[str]:
    """Parts of a dotted key; as in a job file, one in quotes may hold points itself."""
    parts = key.split(".")
    if '"' in key or "'" in key:
        with suppress(tomllib.TOMLDecodeError):
            inner: Any = tomllib.loads(f"{key} = 0")
            parts = []
            while isinstance(inner, dict) and len(inner) == 1:
                [(part, inner)] = inner.items()
                parts.append(part)
    return parts


def _put(job: WrittenJob, parts: Sequence[str], value: object, place: tuple[str, int, str]) -> bool:
    """Store a value under its dotted key; false where a part of the key holds a value already."""
    inner: Any = job.settings
    for depth, part in enumerate(parts[:-1], start=1):
        job.where.setdefault(".".join(parts[:depth]), place)
        inner = inner.setdefault(part, {})
        if not isinstance(inner, dict):
            return False
    job.where[".".join(parts)] = place
    inner[parts[-1]] = value
    return True


def number_cell(cell: Cell, separator: str, *, comma: bool) -> Cell:
    """A number with the digits in which it is written; NotANumber for a text that is none."""
    if not isinstance(cell, str) or not cell:
        return cell
    value = parse_number(cell, comma=comma, separator=separator)
    text = cell.replace(",", ".").rstrip(".")
    if text != show(value) and (value or "e" not in text.lower()):
        return Shown(value, text)  # 12.50 keeps its digits
    whole = value.is_integer() and abs(value) < 1e15 and (value != 0 or math.copysign(1.0, value) > 0)
    return int(value) if whole else value


def dotted_key(parts: Sequence[str]) -> str:
    """A dotted key; where a part could be misread, parts stand in quotes, as in a job file."""
    if all(part and part == part.strip() and not re.search(r"[.\"'\\#]", part) for part in parts):
        return ".".join(parts)
    return ".".join(part if _BARE.fullmatch(part) else json.dumps(part, ensure_ascii=False) for part in parts)


def setting_cell(column: str, value: Any) -> Cell:  # noqa: ANN401
    """A value of a job file as one cell, under a heading or beside a key."""
    if isinstance(value, bool):
        return "yes" if value else "no"
    if isinstance(value, Mapping):
        return "; ".join(f"{name}: {_plain(entry)}" for name, entry in value.items())
    if not isinstance(value, list):
        return value if isinstance(value, (int, float, str)) else str(value)
    if column == "forbidden_deg":
        pairs = value if value and isinstance(value[0], list) else [value]
        return "; ".join(" to ".join(map(_plain, pair)) for pair in pairs)
    return "; ".join(map(_plain, value))


def _plain(value: object) -> str:
    """A number without an exponent."""
    return format(Decimal(repr(value)), "f") if isinstance(value, float) else str(value)


def template_bytes() -> bytes:
    """An empty workbook for a balancing job.

    Returns
    -------
    bytes
        Sheets runs, weights, planes, sensors and settings to fill in, with comments on their headers and
        lists of allowed values; a sheet notes with all explanations and an example.
    """
    return Path(__file__).with_name("template.xlsx").read_bytes()


def job_workbook_bytes(files: Sequence[Path], results: Any, provenance: Mapping[str, Any]) -> bytes:  # noqa: ANN401
    """A workbook with the results of a job, for reading; its sheets of results are not read back.

    Parameters
    ----------
    files
        What the job was read from: of a workbook all sheets but those of older results are kept, with their
        formats and formulas, without pictures and charts.
    results
        What `rotorid balance` has found: its `influence`, and `to_dict`, the document of `--json`.
    provenance
        Program version, input files, date and options.

    Raises
    ------
    InputError
        If the workbook of the job cannot be read any more.
    """
    from rotorid.files.influence import influence_frame

    book = None
    if len(files) == 1 and is_workbook(files[0]):
        import openpyxl

        problems = Problems()
        data = problems.need(read_bytes(files[0], problems))
        with warnings.catch_warnings():
            warnings.simplefilter("ignore")  # about parts that are not kept
            book = openpyxl.load_workbook(io.BytesIO(data))
        for title in book.sheetnames:
            if title.strip().casefold().startswith(RESULTS):
                del book[title]
        keep_cells(book)
    sheets: dict[str, list[dict[str, Any]]] = {}
    document = results.to_dict()
    single = [*_single({**document, "provenance": provenance}, (), sheets)]
    frame = influence_frame(results.influence)
    tables: dict[str, Any] = {
        "": sheets.pop("corrections"),
        "summary": single,
        **sheets,
        "influence": frame.to_dict("records"),
    }
    warned = "".join(f"\nwarning: {text}" for text in document.get("warnings", ()))
    return excel(*(_table(name, rows, "" if name else warned) for name, rows in tables.items()), book=book)


def _table(name: str, rows: Sequence[Mapping[str, Any]], more: str) -> Table:
    """Of lists, such as covariances, a sheet has nothing: they are left to `--json`."""
    heads = [head for head, value in rows[0].items() if not isinstance(value, (list, Mapping))]
    columns = (Column(head, [_cell(row.get(head)) for row in rows]) for head in heads)
    return Table(
        f"{RESULTS} {name}".strip(), tuple(columns), f"computed from the other sheets; not read back{more}"
    )


def _single(
    document: Mapping[str, Any], above: tuple[str, ...], sheets: dict[str, list[dict[str, Any]]]
) -> Iterator[dict[str, Any]]:
    """Single values of a document by their dotted names, and lists of words; its tables go to `sheets`."""
    for key, value in document.items():
        name = (*above, key)
        if isinstance(value, Mapping):
            yield from _single(value, name, sheets)
        elif not isinstance(value, list) or any(not isinstance(one, Mapping) for one in value):
            values = value if isinstance(value, list) else [value]
            yield from ({"result": ".".join(name), "value": one} for one in values if one is not None)
        elif value:
            sheets[" ".join(name).replace("_", " ")] = value


def _cell(value: Any) -> Value:  # noqa: ANN401  what a table or a document holds
    if isinstance(value, bool):
        return "yes" if value else "no"
    return str(value) if isinstance(value, (list, Mapping)) else cell(value)
