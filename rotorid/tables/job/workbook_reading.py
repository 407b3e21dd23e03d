"""Jobs as one workbook: sheets of tables, and sheets planes, sensors and settings."""

from __future__ import annotations

import re
import tomllib
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

from rotorid.base.suggestions import did_you_mean
from rotorid.base.text import listing
from rotorid.tables.job.keys import Columns
from rotorid.tables.reader.columns import REMARKS, sheet_source
from rotorid.tables.reader.grid import BadCell, Cell, Grid, Row, is_comment, make_grid, show
from rotorid.tables.reader.number import NotANumber, decimal_comma, parse_number
from rotorid.tables.reader.problems import Problems

TABLES = ("runs", "weights", "influence", "check", "check_weights", "slow_roll")
"""Sheets that are tables, by the key of a job file that names such a table."""
SETTINGS = ("planes", "sensors", "settings")
SHEETS = (*TABLES[:2], *SETTINGS)
"""What every workbook may hold; the other tables are for a few."""
RESULTS = "results"
"""Sheets whose names begin so hold what a command has computed: they are not read."""
FLAGS = ("use", "remove")
"""The settings that are true or false."""
_WORDS = ("phase", "angles", "rotation", "view", "rotor")
TEXTS = ("station", "hole_names", "forbidden_deg", "taken", *_WORDS, *TABLES)
"""The settings that are text even where it looks like a number."""
OPTIONAL = "note (a blank value: not stated)"
"""A column of the sheet settings with this name lets values be blank, for forms to fill in."""
_NUMBER_LIKE = re.compile(r"[+-]?[0-9.,][0-9.,' ’]*(?:[eE][+-]?[0-9]+)?")

Place = tuple[str, int, str]
Remarks = dict[tuple[str, str], dict[str, Cell]]


@dataclass(frozen=True, eq=False)
class JobBook:
    """A job's workbook: tables, and settings nested as in a job file.

    Attributes
    ----------
    tables
        Cells of the sheets of `TABLES` that are there.
    settings
        As a job file holds them.
    where
        Sheet, row and column of each setting, by its dotted key.
    remarks
        Cells of columns for remarks, by sheet and plane, sensor or setting.
    comments
        Comment lines of the sheets `SETTINGS`.
    """

    tables: Mapping[str, Grid]
    settings: Mapping[str, Any]
    where: Mapping[str, Place]
    remarks: Mapping[tuple[str, str], Mapping[str, Cell]] = field(default_factory=dict)
    comments: Mapping[str, tuple[str, ...]] = field(default_factory=dict)


def read_job_book(
    path: Path, sheets: Mapping[str, Sequence[Row]], columns: Mapping[str, Columns], problems: Problems
) -> JobBook | None:
    """The job in the sheets of a workbook, or None and problems.

    Parameters
    ----------
    path
        The workbook, for messages.
    sheets
        Its sheets.
    columns
        Further columns that the sheets planes and sensors may have.
    problems
        Collects the complaints.
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
        if name == "runs" and _is_a_form(rows):
            expected = "readings below the header, one row per run, speed and sensor: none are filled in yet"
            problems.add(source, None, None, None, expected)
            return None
        may_be_empty = name in ("weights", "check_weights", *SETTINGS)
        grid = make_grid(source, rows, "", problems, may_be_empty=may_be_empty)
        if grid is not None:
            grids[name] = grid
    settings: dict[str, Any] = {}
    where: dict[str, Place] = {}
    remarks: Remarks = {}
    if "settings" in grids:
        _read_settings(grids["settings"], settings, where, remarks, problems)
    for name, key in (("planes", "plane"), ("sensors", "sensor")):
        if name in grids:
            _read_named(grids[name], name, key, settings, where, remarks, problems)
            _check_prepared(grids[name], key, columns[name], problems)
    if "runs" not in titles:
        shown = listing((repr(title) for title in sheets), "and")
        problems.add(str(path), None, None, None, f"a sheet 'runs'; the sheets are {shown}")
    if "runs" not in grids:
        return None
    tables = {name: grids[name] for name in TABLES if name in grids}
    comments = {name: grids[name].comments for name in SETTINGS if name in grids}
    return JobBook(tables, settings, where, remarks, comments)


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


def _check_prepared(grid: Grid, key: str, columns: Columns, problems: Problems) -> None:
    """Where there are no rows, whose settings would be checked, check the header itself."""
    if grid.rows or key not in grid.header:
        return
    known = (key, *columns.usual)
    for name in grid.header:
        if name and name not in known and name not in columns.more and not _is_remark(name):
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


def _read_settings(
    grid: Grid, settings: dict[str, Any], where: dict[str, Place], remarks: Remarks, problems: Problems
) -> None:
    """Rows of key and value; a dotted key stands for a table (`errors.phase_deg`)."""
    names = [name for name in grid.header if name]
    if [name.casefold() for name in names if not _is_remark(name)] not in (
        ["key", "value"],
        ["setting", "value"],
    ):
        found = listing(names, "and")
        problems.add(grid.source, grid.header_row, None, found, "the columns key and value")
        return
    at = [i for i, name in enumerate(grid.header) if name.casefold() in ("key", "setting", "value")]
    may_be_blank = OPTIONAL in grid.header
    comma = _comma(grid, [at[1]])
    for row, cells in grid.rows:
        first = cells[at[0]]
        key = show(first)
        parts = key_parts(key)
        name = ".".join(parts)
        value = _value(parts[-1], cells[at[1]], comma=comma)
        if isinstance(first, BadCell):
            problems.add(grid.source, row, grid.header[at[0]], key, first.expected)
        elif not key:
            problems.add(grid.source, row, grid.header[at[0]], "", "the name of a setting")
        elif value == "" and may_be_blank:
            continue
        elif isinstance(value, BadCell) or value == "":
            expected = value.expected if isinstance(value, BadCell) else f"a value for {key}"
            problems.add(grid.source, row, grid.header[at[1]], show(cells[at[1]]), expected)
        elif name in where:
            expected = f"each setting once (row {where[name][1]} has it too)"
            problems.add(grid.source, row, grid.header[at[0]], key, expected)
        else:
            where[name] = (grid.source, row, grid.header[at[1]])
            _note(grid, cells, ("settings", name), remarks)
            if not _put(settings, parts, value, where[name], where):
                expected = f"no parts of {name.rpartition('.')[0]}, which has a value of its own"
                problems.add(grid.source, row, grid.header[at[0]], key, expected)


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
    if key in FLAGS:
        word = show(cell).casefold()
        return word in ("true", "yes") if word in ("true", "yes", "false", "no") else cell
    if key in TEXTS or not isinstance(cell, str) or not _NUMBER_LIKE.fullmatch(cell):
        return cell
    try:
        return parse_number(cell, comma=comma)
    except NotANumber as error:
        return BadCell(cell, str(error))


def _note(grid: Grid, cells: Sequence[Cell], item: tuple[str, str], remarks: Remarks) -> None:
    for name, cell in zip(grid.header, cells, strict=True):
        if _is_remark(name) and cell != "":
            remarks.setdefault(item, {})[name] = cell


def _put(
    settings: dict[str, Any], parts: Sequence[str], value: object, place: Place, where: dict[str, Place]
) -> bool:
    """Store a value under its dotted key; false where a part of the key holds a value already."""
    inner: Any = settings
    for depth, part in enumerate(parts[:-1], start=1):
        where.setdefault(".".join(parts[:depth]), place)
        inner = inner.setdefault(part, {})
        if not isinstance(inner, dict):
            return False
    inner[parts[-1]] = value
    return True


def _read_named(
    grid: Grid,
    name: str,
    key: str,
    settings: dict[str, Any],
    where: dict[str, Place],
    remarks: Remarks,
    problems: Problems,
) -> None:
    """Rows of one plane or sensor each; a blank cell leaves the setting out."""
    if key not in grid.header:
        expected = f"a column {key}; the columns are {listing([n for n in grid.header if n], 'and')}"
        problems.add(grid.source, grid.header_row, key, None, expected)
        return
    at = grid.header.index(key)
    comma = _comma(grid, [i for i, n in enumerate(grid.header) if i != at and not _is_remark(n)])
    for row, cells in grid.rows:
        first = cells[at]
        item = show(first)
        if isinstance(first, BadCell):
            problems.add(grid.source, row, key, item, first.expected)
            continue
        if not item:
            problems.add(grid.source, row, key, "", f"the name of a {key}")
            continue
        if f"{name}.{item}" in where:
            expected = f"each {key} once (row {where[f'{name}.{item}'][1]} has it too)"
            problems.add(grid.source, row, key, item, expected)
            continue
        where[f"{name}.{item}"] = (grid.source, row, key)
        named = settings.setdefault(name, {})
        if not isinstance(named, dict):  # a setting of this name; the job refuses it
            return
        section = named.setdefault(item, {})
        _note(grid, cells, (name, item), remarks)
        for column, cell in zip(grid.header, cells, strict=True):
            if not column or column == key or _is_remark(column) or cell == "":
                continue
            where[f"{name}.{item}.{column}"] = (grid.source, row, column)
            value = _value(column, cell, comma=comma)
            if isinstance(value, BadCell):
                problems.add(grid.source, row, column, value.value, value.expected)
            else:
                section[column] = value
