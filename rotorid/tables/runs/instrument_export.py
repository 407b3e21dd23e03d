"""Exports of instruments and people's spreadsheets, brought into the form of a runs table, grid to grid.

Units rows, units in cells, vectors in one cell (`6.93 @ 98°`), columns for each sensor, other names. Numbers
stay as they are written; what has two readings that differ is refused. A runs table stays as it is.
"""

from __future__ import annotations

import math
import re
from collections.abc import Mapping, Sequence
from dataclasses import replace
from functools import partial
from typing import NamedTuple

from rotorid.base.suggestions import did_you_mean
from rotorid.base.text import listing
from rotorid.tables.reader.columns import Source, read_grid
from rotorid.tables.reader.grid import Cell, Grid, Row, show
from rotorid.tables.reader.problems import Problems
from rotorid.tables.reader.units import UnitError, spelt
from rotorid.tables.runs.column_headings import (
    LONGEST,
    MEASURED,
    READING,
    Heading,
    looks_like_header,
    read_headings,
    read_unit,
    readable,
)
from rotorid.tables.runs.stated_conventions import Conventions

_NUMBER = r"[+-]?[0-9][0-9.,]*(?:[eE][+-]?[0-9]+)?"
_PLAIN = re.compile(_NUMBER)
_WITH_UNIT = re.compile(rf"({_NUMBER})\s*([^\s0-9].*)")
_VECTOR = re.compile(rf"({_NUMBER}[^@<∠]*?)\s*([@<∠/])\s*({_NUMBER}[^@<∠/]*)")
_DECIMAL = re.compile(r"[+-]?[0-9]+(?:\.[0-9]*)?")
_WEIGHT = re.compile("weight|mass|correct", re.IGNORECASE)
_BOTH_UNITS = re.compile(r"(.*?)\s*[/@<∠,;&]?\s*((?:°|deg|rad).*)", re.IGNORECASE)


class _Unclear(ValueError):
    """What has no reading, or several: the message says what is expected."""

    def __init__(self, expected: str, heading: Heading, row: int | None = None, cell: Cell = "") -> None:
        super().__init__(expected)
        self.column, self.row = heading.name, row
        self.value = heading.name if row is None else show(cell)


class _Column(NamedTuple):
    """A column of a runs table, with the heading of its cells in the file; `unit` may be as written there."""

    heading: Heading
    stem: str
    unit: str
    cells: Sequence[Cell]


def read_runs_grid(source: Source, conventions: Conventions, problems: Problems) -> Grid | None:
    """The cells of a runs table, whatever its form in the file; None and problems.

    Parameters
    ----------
    source
        A file, or the cells of a sheet.
    conventions
        What phases mean, and how the job says that columns are named.
    problems
        Collects the complaints.
    """
    said = {} if conventions.columns is None else conventions.columns
    pairs = [(v, k) if isinstance(v, str) else (v.value, v.key) for k, v in said.items() if v is not None]
    named: dict[str, str] = dict(pairs)
    grid = read_grid(source, "runs", problems, is_header=partial(looks_like_header, named=named))
    if grid is None or not _are_there(named, grid, conventions):
        return None
    try:
        return _as_runs_table(grid, named, conventions.labels.phase)
    except _Unclear as found:
        problems.add(grid.source, found.row or grid.header_row, found.column, found.value, str(found))
        return None


def _are_there(named: Mapping[str, str], grid: Grid, conventions: Conventions) -> bool:
    """Whether the file has the columns that the job names; else a problem of the job."""
    if conventions.columns is None:
        return True
    section, there = conventions.columns.section, [name for name in grid.header if name]
    for name, key in named.items():
        if name not in there and key not in there and key not in section.refused:
            known = f"its columns are {listing(there, 'and')}"
            section.complain(key, f"a column of {grid.source}{did_you_mean(name, there)}; {known}")
    return not section.refused


def _as_runs_table(grid: Grid, named: Mapping[str, str], phase: str) -> Grid:
    headings = read_headings(grid.header, named)
    own = [heading for heading in headings if heading.tidy and heading.name not in named]
    if len({heading.stem for heading in own}) < len(own):
        return grid  # a column of a runs table stands there twice
    for heading in headings:
        if heading.stem.endswith("X"):
            other = "delete the column, or begin its name with note (if it is a probe: with P)"
            raise _Unclear(f"readings at the running speed (1X) alone: {other}", heading)
    below = _units_row(grid, headings)
    rows = grid.rows[1:] if below else grid.rows
    plain = not below and all(h in own or h.stem in ("", "note") for h in headings)
    measured = [h.index for h in own if h.stem in MEASURED]
    if plain and all(map(_PLAIN.fullmatch, {show(cells[k]) for _, cells in rows for k in measured})):
        return grid
    columns = [_Column(h, h.stem, h.unit, [cells[h.index] for _, cells in rows]) for h in headings]
    found = [
        _numbers(part, below.get(part.heading.index), rows, phase) if part.stem in MEASURED else part
        for column in columns
        for part in _halves(column, headings, rows)
    ]
    if found == columns and plain:
        return grid
    return _assembled(replace(grid, rows=rows), found)


def _units_row(grid: Grid, headings: Sequence[Heading]) -> dict[int, tuple[int, str]]:
    """Units in the row below the header, by place; empty where that row holds something else."""
    found: dict[int, tuple[int, str]] = {}
    sure, (row, cells) = False, grid.rows[0] if len(grid.rows) > 1 else (0, ())
    for heading, cell in zip(headings, cells, strict=False):
        text, stem = show(cell).strip("()[] "), heading.stem
        if text in ("", "-") or stem == "note":
            continue
        quantity = "amplitude" if stem in ("", "vector") else stem
        known = quantity in MEASURED and readable(quantity, text)
        if _PLAIN.fullmatch(text) or not (known or stem in MEASURED):
            return {}
        found[heading.index] = (row, text)
        sure = sure or known
    return found if sure else {}


def _halves(column: _Column, headings: Sequence[Heading], rows: Sequence[Row]) -> list[_Column]:
    """A column of vectors as one of amplitudes and one of phases; any other as it is."""
    heading, stem, unit, cells = column
    if stem not in ("", "amplitude", "vector") or not _holds_vectors(heading, headings, cells):
        return [column]
    ordered = stem == "vector" and "vector" not in heading.name.casefold()
    halves: list[tuple[str, str]] = []
    for (row, _), cell in zip(rows, cells, strict=True):
        found = _vector(cell)
        if cell != "" and (found is None or not (found[2] or ordered)):
            raise _Unclear("amplitude and phase, unmistakable as 6.93 @ 98°", heading, row, cell)
        halves.append(("", "") if found is None else found[:2])
    both = _BOTH_UNITS.fullmatch(unit)
    units = both.groups() if both else (unit, "")
    return [_Column(heading, READING[k], units[k], [half[k] for half in halves]) for k in (0, 1)]


def _holds_vectors(heading: Heading, headings: Sequence[Heading], cells: Sequence[Cell]) -> bool:
    """Whether a column holds amplitude and phase in one cell."""
    others = [one for one in headings if one.stem in READING and one is not heading]
    paired = any(one.stem == "phase" and one.sensor == heading.sensor for one in others)
    if (heading.stem and paired) or _WEIGHT.search(heading.name):
        return False
    found = [vector for cell in cells if (vector := _vector(cell)) is not None]
    return heading.stem == "vector" or any(sure for *_, sure in found) or (bool(found) and not others)


def _vector(cell: Cell) -> tuple[str, str, bool] | None:
    """Amplitude and phase of a cell such as `6.93 um @ 98°`, and whether it can be nothing else."""
    found = _VECTOR.fullmatch(cell) if isinstance(cell, str) and len(cell) <= LONGEST else None
    if found is None:
        return None
    return found[1], found[3], found[2] != "/" or _PLAIN.fullmatch(found[3]) is None


def _unit(column: _Column, text: str, phase: str, row: int | None = None, cell: Cell = "") -> str:
    """The unit that a text means; a direction in it must be that of the job."""
    try:
        unit, direction = read_unit(column.stem, text)
    except UnitError as error:
        raise _Unclear(str(error), column.heading, row, cell) from None
    if direction not in ("", phase):
        remedy = 'state phase = "lag" or "lead" in the job, as the instrument shows it, without words here'
        raise _Unclear(
            f"phases that {phase}, as the job says or is assumed: {remedy}", column.heading, row, cell
        )
    return unit


def _numbers(column: _Column, below: tuple[int, str] | None, rows: Sequence[Row], phase: str) -> _Column:
    """Numbers without their unit, which the heading states, the row below it, or every cell."""
    heading, stem, unit, cells = column
    if not heading.tidy:
        unit = _unit(column, unit, phase)
    if below is not None and (stem != "phase" or heading.stem == "phase"):
        under = _unit(column, below[1], phase, *below)
        if unit and under not in ("", spelt(unit)):
            raise _Unclear(f"{unit}, as in the heading, or nothing", heading, *below)
        unit = unit or under
    out: list[Cell] = []
    first: dict[str, tuple[int, Cell]] = {}
    for (row, _), cell in zip(rows, cells, strict=True):
        found = None if not isinstance(cell, str) or _PLAIN.fullmatch(cell) else _WITH_UNIT.fullmatch(cell)
        own = _unit(column, found[2], phase, row, cell) if found and readable(stem, found[2]) else None
        fits = own is not None and not (unit and own and own != spelt(unit))
        if own and not fits and not heading.tidy:
            raise _Unclear(f"a number in {unit}, as the heading of the column says", heading, row, cell)
        out.append(found[1] if found and fits else cell)  # what is left as it is, the table explains
        if cell != "" and not unit:
            first.setdefault(own or "", (row, cell))
    if len(first) > 1:
        (row, cell), (at, other) = list(first.values())[:2]
        expected = f"the same unit in all cells of the column (row {row} has {show(cell)}), or in its heading"
        raise _Unclear(expected, heading, at, other)
    unit = unit or next(iter(first), "")
    if stem == "phase" and heading.stem != "phase" and not unit:
        plain = [text for cell in out if _DECIMAL.fullmatch(text := show(cell).replace(",", "."))]
        if not any(abs(float(text)) > math.tau for text in plain):
            raise _Unclear("the sign of degrees, as in 6.93 @ 98°: phases so small may be radians", heading)
        unit = "deg"
    return _Column(heading, stem, unit, out)


def _by_sensor(columns: Sequence[_Column]) -> dict[str, dict[str, _Column]]:
    """Amplitude and phase of each sensor; the name is empty where a column has the names."""
    found: dict[str, dict[str, _Column]] = {"": {}}
    listed = any(column.stem == "sensor" for column in columns)
    for column in columns:
        heading, stem = column.heading, column.stem
        if stem in ("", "note"):
            continue
        sensor = heading.sensor if stem in READING and not (listed and heading.stem in ("", "vector")) else ""
        if sensor and listed:
            words = f"as another column has the sensors: leave {sensor!r} out, or begin the name with note"
            raise _Unclear(f"the {stem} alone, {words}", heading)
        other = found.setdefault(sensor, {}).setdefault(stem, column)
        if other is not column:
            words = f"and {other.heading.name!r} could be it too: begin the name of one with note"
            raise _Unclear(f"one column of the {stem}, {words}", heading)
    common = found.pop("")
    if not found:
        return {"": common}
    if loose := [common[stem] for stem in READING if stem in common]:
        raise _Unclear("a name with that of its sensor, as the other columns have", loose[0].heading)
    for sensor, own in found.items():
        if len(own) < len(READING):
            [lacking] = set(READING) - set(own)
            words = f"the {lacking} of this sensor too, in a column such as '{sensor} {lacking}'"
            raise _Unclear(words, next(iter(own.values())).heading)
    return found


def _name(column: _Column) -> str:
    """The name that a column has in a runs table."""
    if column.stem not in MEASURED:
        return column.stem if column.stem not in ("", "note") else column.heading.name
    if not column.unit and column.stem != "amplitude" and not column.heading.tidy:
        usual = "rpm" if column.stem == "speed" else "deg"
        raise _Unclear(f"its unit too, such as '{column.heading.name} ({usual})'", column.heading)
    return f"{column.stem}_{column.unit}" if column.unit else column.stem


def _assembled(grid: Grid, columns: Sequence[_Column]) -> Grid:
    """A runs table of these columns: one row for each row of the file and sensor with columns of its own."""
    common = [column for column in columns if column.stem not in READING]
    sensors = {
        name: [own[stem] for stem in READING if stem in own] for name, own in _by_sensor(columns).items()
    }
    wide, first = "" not in sensors, next(iter(sensors.values()))
    names = [*map(_name, first)]
    for own in sensors.values():
        for column, name in zip(own, names, strict=True):
            if _name(column) != name:
                raise _Unclear(f"the unit of all sensors, {name}", column.heading)
    rows = [
        (number, (*(c.cells[k] for c in common), *((name,) if wide else ()), *(c.cells[k] for c in own)))
        for k, (number, _) in enumerate(grid.rows)
        for name, own in sensors.items()
    ]
    taken = [
        tuple(column.heading.index for column in (*common, *own[:wide], *own)) for own in sensors.values()
    ]
    header = (*map(_name, common), *(("sensor",) if wide else ()), *names)
    return replace(
        grid, header=header, rows=tuple(rows), named=grid.header, taken=tuple(taken * len(grid.rows))
    )
