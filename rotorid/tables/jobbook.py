"""Jobs as one workbook: sheets runs, weights, planes, sensors and settings."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from rotorid.tables.columns import REMARKS, sheet_source
from rotorid.tables.grid import BadCell, Cell, Grid, Row, make_grid, show
from rotorid.tables.jobkeys import Columns
from rotorid.tables.problems import Problems, did_you_mean, listing
from rotorid.tables.sheet import find_sheet, read_workbook

SHEETS = ("runs", "weights", "planes", "sensors", "settings")
FLAGS = ("use", "remove")
"""The settings that are true or false."""


@dataclass(frozen=True)
class JobBook:
    """A job's workbook: two tables, and settings nested as in a job file.

    Attributes
    ----------
    runs, weights
        Cells of the sheets; weights None if there is no such sheet.
    settings
        As a job file holds them.
    where
        Sheet, row and column of each setting, by its dotted key.
    """

    runs: Grid
    weights: Grid | None
    settings: Mapping[str, Any]
    where: Mapping[str, tuple[str, int, str]]


def read_job_book(path: Path, columns: Mapping[str, Columns], problems: Problems) -> JobBook | None:
    """Read a job's workbook, or None and problems.

    Parameters
    ----------
    path
        The workbook.
    columns
        Further columns that the sheets planes and sensors may have.
    problems
        Collects the complaints.
    """
    sheets = read_workbook(path, problems)
    if sheets is None:
        return None
    _complain_about_sheets(path, sheets, problems)
    grids: dict[str, Grid | None] = {}
    for name in SHEETS:
        title = find_sheet(sheets, name)
        # Beside runs and weights a sheet that was only prepared may stay empty, or hold its header alone.
        if title is not None and (name in SHEETS[:2] or _holds_cells(sheets[title])):
            source, rows = sheet_source(path, title), sheets[title]
            grids[name] = make_grid(source, rows, "", problems, may_be_empty=name != "runs")
    settings: dict[str, Any] = {}
    where: dict[str, tuple[str, int, str]] = {}
    if grids.get("settings"):
        _read_settings(grids["settings"], settings, where, problems)
    for name, key in (("planes", "plane"), ("sensors", "sensor")):
        if grids.get(name):
            _read_named(grids[name], name, key, settings, where, problems)
            _check_prepared(grids[name], key, columns[name], problems)
    if "runs" not in grids:
        titles = listing((repr(title) for title in sheets), "and")
        problems.add(str(path), None, None, None, f"a sheet 'runs'; the sheets are {titles}")
    runs = grids.get("runs")
    return None if runs is None else JobBook(runs, grids.get("weights"), settings, where)


def _holds_cells(rows: list[Row]) -> bool:
    return any(show(cell) for _, cells in rows for cell in cells)


def _check_prepared(grid: Grid | None, key: str, columns: Columns, problems: Problems) -> None:
    """Where there are no rows, whose settings would be checked, check the header itself."""
    if grid is None or grid.rows or key not in grid.header:
        return
    known = (key, *columns.usual)
    for name in grid.header:
        if (
            name
            and name not in known
            and name not in columns.more
            and not name.casefold().startswith(REMARKS)
        ):
            expected = f"a known column{did_you_mean(name, known)}; known are {listing(known, 'and')}"
            problems.add(grid.source, grid.header_row, name, name, expected)


def _complain_about_sheets(path: Path, sheets: dict[str, list[Row]], problems: Problems) -> None:
    for title, rows in sheets.items():
        name = title.strip().casefold()
        filled = any(show(cell) for _, cells in rows for cell in cells)
        if filled and name not in SHEETS and not name.startswith(REMARKS):
            hint = did_you_mean(name, SHEETS)
            expected = f"a known sheet{hint}; known are {listing(SHEETS, 'and')}, remarks go into 'notes'"
            problems.add(str(path), None, None, title, expected)


def _read_settings(
    grid: Grid | None, settings: dict[str, Any], where: dict[str, tuple[str, int, str]], problems: Problems
) -> None:
    """Rows of key and value; a dotted key stands for a table (`errors.phase_deg`)."""
    if grid is None:
        return
    names = [name for name in grid.header if name]
    columns = [name.casefold() for name in names if not name.casefold().startswith(REMARKS)]
    if columns not in (["key", "value"], ["setting", "value"]):
        found = listing(names, "and")
        problems.add(grid.source, grid.header_row, None, found, "the columns key and value")
        return
    at = [i for i, name in enumerate(grid.header) if name.casefold() in ("key", "setting", "value")]
    for row, cells in grid.rows:
        key = show(cells[at[0]])
        value = _flag(cells[at[1]]) if key.rpartition(".")[2] in FLAGS else cells[at[1]]
        if not key:
            problems.add(grid.source, row, grid.header[at[0]], "", "the name of a setting")
        elif isinstance(value, BadCell) or value == "":
            expected = value.expected if isinstance(value, BadCell) else f"a value for {key}"
            problems.add(grid.source, row, grid.header[at[1]], show(value), expected)
        elif key in where:
            expected = f"each setting once (row {where[key][1]} has it too)"
            problems.add(grid.source, row, grid.header[at[0]], key, expected)
        else:
            where[key] = (grid.source, row, grid.header[at[1]])
            if not _put(settings, key.split("."), value, where[key], where):
                expected = f"no parts of {key.rpartition('.')[0]}, which has a value of its own"
                problems.add(grid.source, row, grid.header[at[0]], key, expected)


def _flag(cell: Cell) -> Cell | bool:
    """A logical cell, or `true`, `false`, `yes`, `no`, as a truth value; anything else as it is."""
    word = show(cell).casefold()
    return word in ("true", "yes") if word in ("true", "yes", "false", "no") else cell


def _put(
    settings: dict[str, Any],
    parts: list[str],
    value: object,
    place: tuple[str, int, str],
    where: dict[str, tuple[str, int, str]],
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
    grid: Grid | None,
    name: str,
    key: str,
    settings: dict[str, Any],
    where: dict[str, tuple[str, int, str]],
    problems: Problems,
) -> None:
    """Rows of one plane or sensor each; a blank cell leaves the setting out."""
    if grid is None:
        return
    if key not in grid.header:
        expected = f"a column {key}; the columns are {listing([n for n in grid.header if n], 'and')}"
        problems.add(grid.source, grid.header_row, key, None, expected)
        return
    at = grid.header.index(key)
    for row, cells in grid.rows:
        item = show(cells[at])
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
        for column, cell in zip(grid.header, cells, strict=True):
            if not column or column == key or column.casefold().startswith(REMARKS) or cell == "":
                continue
            where[f"{name}.{item}.{column}"] = (grid.source, row, column)
            value = _flag(cell) if column in FLAGS else cell
            if isinstance(value, BadCell):
                problems.add(grid.source, row, column, value.value, value.expected)
            else:
                section[column] = value
