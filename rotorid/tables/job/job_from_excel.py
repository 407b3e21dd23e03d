"""Jobs from Excel workbooks and job files, as written: sheets of tables, planes, sensors, settings."""

from __future__ import annotations

import re
import tomllib
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

from rotorid.base.suggestions import did_you_mean
from rotorid.base.text import listing
from rotorid.files.cells import BadCell, Cell, Grid, Row, is_comment, make_grid, show
from rotorid.files.columns import REMARKS, sheet_source
from rotorid.files.decimal_numbers import NotANumber, decimal_comma, parse_number
from rotorid.files.excel_workbook import is_workbook, read_workbook
from rotorid.files.layout import rows_from_header
from rotorid.files.problems import Problems
from rotorid.files.toml_file import Section, read_toml
from rotorid.tables.job.job_keys import CELLS, PLANE, READINGS, SENSOR, TABLES

NAMED = {"planes": ("plane", PLANE), "sensors": ("sensor", SENSOR)}
"""Sheets with a row for each plane or sensor: the column of its name, and keys that are columns."""
SETTINGS = (*NAMED, "settings")
RESULTS = "results"
"""Sheets whose names begin so hold what a command has computed: they are not read."""
OPTIONAL = "note (a blank value: not stated)"
"""A column of the sheet settings with this name lets values be blank, for forms to fill in."""
_NUMBER_LIKE = re.compile(r"[+-]?[0-9.,][0-9.,' ’]*(?:[eE][+-]?[0-9]+)?")

Place = tuple[str, int, str]


@dataclass(frozen=True, eq=False)
class WrittenJob:
    """A job as it is written: settings nested as in a job file, and the tables of a workbook.

    Attributes
    ----------
    path
        The job file or workbook.
    settings
        As a job file holds them.
    tables
        Cells of the sheets of `TABLES` that are there.
    where
        Sheet, row and column of each setting, by its dotted key.
    """

    path: Path
    settings: dict[str, Any] = field(default_factory=dict)
    tables: dict[str, Grid] = field(default_factory=dict)
    where: dict[str, Place] = field(default_factory=dict)

    def top(self, problems: Problems) -> Section:
        """All settings; a file that is named in place of a sheet is a problem."""
        top = Section(str(self.path), self.settings, problems, where=self.where)
        if not self.tables and "runs" not in top:
            top.missing("runs", 'the runs table, runs = "runs.csv"')
        for key in TABLES if self.tables else ():
            if key in top and (key in self.tables or key in TABLES[:2]):
                top.complain(key, f"the table in the sheet {key!r} of this workbook, not a file")
        return top


def open_job(path: Path, problems: Problems) -> WrittenJob:
    """A job file (`.toml`) or a workbook (`.xlsx`) as it is written.

    Raises
    ------
    InputError
        If there is nothing of a job in it.
    """
    if is_workbook(path):
        sheets = read_workbook(path, problems)
        problems.stop()
        return job_in_sheets(path, sheets or {}, problems)
    if path.suffix.lower() == ".toml":
        data = read_toml(path, problems)
        problems.stop()
        return WrittenJob(path, data or {})
    expected = "a job: a .toml file, or an .xlsx workbook with sheets runs and weights"
    problems.add(str(path), None, None, None, expected)
    problems.stop()
    raise AssertionError


def job_in_sheets(path: Path, sheets: Mapping[str, Sequence[Row]], problems: Problems) -> WrittenJob:
    """The job in the sheets of a workbook; `path` is where it is, or will be.

    Raises
    ------
    InputError
        If there are no runs; other problems are noted.
    """
    _complain_about_sheets(path, sheets, problems)
    titles = {title.strip().casefold(): title for title in reversed(list(sheets))}
    grids: dict[str, Grid] = {}
    for name in (*TABLES, *SETTINGS):
        title = titles.get(name)
        # Beside runs and weights a sheet that was only prepared may stay empty, or hold its header alone.
        if title is None or not (name in TABLES[:2] or _holds_cells(sheets[title])):
            continue
        source, rows = sheet_source(path, title), sheets[title]
        if name in (*READINGS, "weights", "check_weights"):
            rows = rows_from_header(rows, {}, weights=name not in READINGS)
        if name == "runs" and _is_a_form(rows):
            expected = "readings below the header, one row per run, speed and sensor: none are filled in yet"
            problems.add(source, None, None, None, expected)
            problems.stop()
        may_be_empty = name in ("weights", "check_weights", *SETTINGS)
        grid = make_grid(source, rows, "", problems, may_be_empty=may_be_empty)
        if grid is not None:
            grids[name] = grid
    job = WrittenJob(path)
    job.tables.update({name: grid for name, grid in grids.items() if name in TABLES})
    if "settings" in grids:
        _read_settings(grids["settings"], job, problems)
    for name in NAMED:
        if name in grids:
            _read_named(grids[name], name, job, problems)
            _check_prepared(grids[name], name, problems)
    if "runs" not in titles:
        shown = listing((repr(title) for title in sheets), "and")
        problems.add(str(path), None, None, None, f"a sheet 'runs'; the sheets are {shown}")
    if "runs" not in grids:
        problems.stop()
    return job


def is_notes(title: str) -> bool:
    """Whether a sheet of this title is for remarks."""
    return title.strip().casefold().startswith(REMARKS)


def _is_remark(name: str) -> bool:
    return name.casefold().startswith(REMARKS)


def _holds_cells(rows: Sequence[Row]) -> bool:
    return any(show(cell) for _, cells in rows for cell in cells)


def _is_a_form(rows: Sequence[Row]) -> bool:
    """Whether nothing is filled in below the header of the sheet runs."""
    filled = [cells for _, cells in rows if any(show(cell) for cell in cells)]
    while filled and is_comment(filled[0], in_sheet=True, below_header=False):
        filled = filled[1:]
    below = [cells for cells in filled[1:] if not is_comment(cells, in_sheet=True, below_header=True)]
    return not below and bool(filled) and "run" in map(show, filled[0])


def _check_prepared(grid: Grid, sheet: str, problems: Problems) -> None:
    """Where there are no rows, whose settings would be checked, check the header itself."""
    column, keys = NAMED[sheet]
    if grid.rows or column not in grid.header:
        return
    known = (column, *(name for key in keys for name in key.names))
    for name in grid.header:
        if name and name != column and not _is_remark(name) and not any(key.accepts(name) for key in keys):
            expected = f"a known column{did_you_mean(name, known)}; known are {listing(known, 'and')}"
            problems.add(grid.source, grid.header_row, name, name, expected)


def _complain_about_sheets(path: Path, sheets: Mapping[str, Sequence[Row]], problems: Problems) -> None:
    known = (*TABLES, *SETTINGS, RESULTS)
    for title, rows in sheets.items():
        name = title.strip().casefold()
        if name in known or name.startswith(RESULTS) or is_notes(title) or not _holds_cells(rows):
            continue
        expected = (
            f"a known sheet{did_you_mean(name, known)}; known are {listing(known, 'and')}, remarks go into "
            "'notes' (hidden sheets count too)"
        )
        problems.add(str(path), None, None, title, expected)


def _read_settings(grid: Grid, job: WrittenJob, problems: Problems) -> None:
    """Rows of key and value; a dotted key stands for a table (`errors.phase_deg`)."""
    names = [name for name in grid.header if name]
    plain = [name.casefold() for name in names if not _is_remark(name)]
    if plain not in (["key", "value"], ["setting", "value"]):
        found = listing(names, "and")
        problems.add(grid.source, grid.header_row, None, found, "the columns key and value")
        return
    at, to = (i for i, name in enumerate(grid.header) if name.casefold() in ("key", "setting", "value"))
    comma = _comma(grid, [to])
    for row, cells in grid.rows:
        key = show(cells[at])
        parts = key_parts(key)
        name, place = ".".join(parts), (grid.source, row, grid.header[to])
        value = _value(parts[-1], cells[to], comma=comma)
        wrong, expected = at, ""
        if isinstance(cells[at], BadCell) or not key:
            expected = getattr(cells[at], "expected", "the name of a setting")
        elif value == "" and OPTIONAL in grid.header:
            continue
        elif isinstance(value, BadCell) or value == "":
            wrong, expected = to, getattr(value, "expected", f"a value for {key}")
        elif name in job.where:
            expected = f"each setting once (row {job.where[name][1]} has it too)"
        else:
            job.where[name] = place
            if not _put(job, parts, value, place):
                expected = f"no parts of {name.rpartition('.')[0]}, which has a value of its own"
        if expected:
            problems.add(grid.source, row, grid.header[wrong], show(cells[wrong]), expected)


def key_parts(key: str) -> list[str]:
    """Parts of a dotted key; as in a job file, one in quotes may hold points itself."""
    if '"' in key or "'" in key:
        try:
            inner: Any = tomllib.loads(f"{key} = 0")
        except tomllib.TOMLDecodeError:
            return key.split(".")
        parts = []
        while isinstance(inner, dict) and len(inner) == 1:
            [(part, inner)] = inner.items()
            parts.append(part)
        return parts
    return key.split(".")


def _comma(grid: Grid, places: Sequence[int]) -> bool:
    """Whether the texts in these columns that look like numbers have decimal commas."""
    texts = (cells[i] for _, cells in grid.rows for i in places)
    numbers = (text for text in texts if isinstance(text, str) and _NUMBER_LIKE.fullmatch(text))
    return decimal_comma(numbers, "")


def _value(key: str, cell: Cell, *, comma: bool) -> Cell | bool:
    """A logical cell, or yes or no, as a truth value; text that is one number as that; else as it is."""
    kind = CELLS.get(key)
    if kind == "flag":
        word = show(cell).casefold()
        return word in ("true", "yes") if word in ("true", "yes", "false", "no") else cell
    if kind == "date" and isinstance(cell, BadCell):  # a spreadsheet makes a cell with a date of its text
        return cell.value.partition(" ")[0]
    if kind == "name" or not isinstance(cell, str) or not _NUMBER_LIKE.fullmatch(cell):
        return cell
    try:
        return parse_number(cell, comma=comma)
    except NotANumber as error:
        return BadCell(cell, str(error))


def _put(job: WrittenJob, parts: Sequence[str], value: object, place: Place) -> bool:
    """Store a value under its dotted key; false where a part of the key holds a value already."""
    inner: Any = job.settings
    for depth, part in enumerate(parts[:-1], start=1):
        job.where.setdefault(".".join(parts[:depth]), place)
        inner = inner.setdefault(part, {})
        if not isinstance(inner, dict):
            return False
    inner[parts[-1]] = value
    return True


def _read_named(grid: Grid, sheet: str, job: WrittenJob, problems: Problems) -> None:
    """Rows of one plane or sensor each; a blank cell leaves the setting out."""
    key = NAMED[sheet][0]
    if key not in grid.header:
        expected = f"a column {key}; the columns are {listing([n for n in grid.header if n], 'and')}"
        problems.add(grid.source, grid.header_row, key, None, expected)
        return
    at = grid.header.index(key)
    columns = [i for i, name in enumerate(grid.header) if name and i != at and not _is_remark(name)]
    comma = _comma(grid, columns)
    for row, cells in grid.rows:
        item, expected = show(cells[at]), ""
        name = f"{sheet}.{item}"
        if isinstance(cells[at], BadCell) or not item:
            expected = getattr(cells[at], "expected", f"the name of a {key}")
        elif name in job.where:
            expected = f"each {key} once (row {job.where[name][1]} has it too)"
        if expected:
            problems.add(grid.source, row, key, item, expected)
            continue
        job.where[name] = (grid.source, row, key)
        named = job.settings.setdefault(sheet, {})
        if not isinstance(named, dict):  # a setting of this name; the job refuses it
            return
        section = named.setdefault(item, {})
        for i in columns:
            column, cell = grid.header[i], cells[i]
            if cell == "":
                continue
            job.where[f"{name}.{column}"] = (grid.source, row, column)
            value = _value(column, cell, comma=comma)
            if isinstance(value, BadCell):
                problems.add(grid.source, row, column, value.value, value.expected)
            else:
                section[column] = value
