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
from rotorid.tables.reader import units
from rotorid.tables.reader.columns import Source, read_grid
from rotorid.tables.reader.grid import Cell, Grid, Row, show
from rotorid.tables.reader.problems import Problems
from rotorid.tables.reader.settings_keys import Quantity
from rotorid.tables.reader.units import UnitError
from rotorid.tables.runs.column_headings import (
    MEASURED,
    READING,
    Heading,
    looks_like_header,
    read_headings,
    read_unit,
    readable,
)
from rotorid.tables.runs.stated_conventions import Conventions

_NUMBER = r"[+-]?(?:[0-9][0-9.,]*|[.,][0-9]+)(?:[eE][+-]?[0-9]+)?"
_PLAIN = re.compile(_NUMBER)
_DECIMAL = re.compile(r"[+-]?[0-9]+(?:\.[0-9]+)?")
_WITH_UNIT = re.compile(rf"({_NUMBER})\s*([^\s0-9].*)")
_VECTOR = re.compile(rf"({_NUMBER})\s*([^@<∠]*?)\s*([@<∠/])\s*({_NUMBER})\s*(.*)")
_BOTH_UNITS = re.compile(r"(.*?)\s*[/@<∠,;&]?\s*((?:°|deg|rad).*)", re.IGNORECASE)


class _Unclear(ValueError):
    """What has no reading, or several: the message says what is expected."""

    def __init__(self, expected: str, heading: Heading, at: tuple[int, Cell] | None = None) -> None:
        super().__init__(expected)
        self.column, self.at = heading.name, at


class _Part(NamedTuple):
    """A number as it is written, what follows it, and whether a vector can be nothing else."""

    number: Cell
    rest: str = ""
    sure: bool = True


class _Column(NamedTuple):
    """A column of a runs table, with the heading that its cells stood below in the file."""

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
    named = {v.value if isinstance(v, Quantity) else v: _key(k, v) for k, v in said.items() if v is not None}
    grid = read_grid(source, "runs", problems, is_header=partial(looks_like_header, named=named))
    if grid is None or not _are_there(named, grid, conventions):
        return None
    try:
        return _as_runs_table(grid, read_headings(grid.header, named), named, conventions.labels.phase)
    except _Unclear as found:
        row, cell = found.at or (grid.header_row, found.column)
        problems.add(grid.source, row, found.column, show(cell), str(found))
        return None


def _key(key: str, value: object) -> str:
    return value.key if isinstance(value, Quantity) else key


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


def _as_runs_table(grid: Grid, headings: list[Heading], named: Mapping[str, str], phase: str) -> Grid:
    own = [heading.stem for heading in headings if heading.tidy and heading.name not in named]
    if len(set(own)) < len(own):
        return grid  # a column of a runs table stands there twice
    for heading in headings:
        if heading.stem.endswith("X"):
            expected = (
                "readings at the running speed (1X) alone: delete the column, or let its name begin with "
                f"note (a probe of this name: P{heading.stem})"
            )
            raise _Unclear(expected, heading)
    below = _units_row(grid, headings)
    rows = grid.rows[1:] if below else grid.rows
    columns = [
        column
        for heading in headings
        for column in _columns(heading, headings, rows, below.get(heading.index, ""), phase)
    ]
    if not below and all(
        (own or column.stem in ("", "note")) and column.cells == _cells(column.heading, rows)
        for column in columns
        for own in [column.heading.tidy and column.heading.name not in named]
    ):
        return grid
    return _assembled(replace(grid, rows=rows), columns)


def _cells(heading: Heading, rows: Sequence[Row]) -> list[Cell]:
    return [cells[heading.index] for _, cells in rows]


def _units_row(grid: Grid, headings: Sequence[Heading]) -> dict[int, str]:
    """Units in the row below the header, by place; empty where that row holds something else."""
    found: dict[int, str] = {}
    sure = False
    for heading, cell in zip(headings, grid.rows[0][1] if grid.rows else (), strict=False):
        text = show(cell).strip("()[] ")
        if text in ("", "-") or heading.stem == "note":
            continue
        stem = heading.stem if heading.stem in MEASURED else "amplitude"
        own = heading.stem in MEASURED or readable(stem, text)
        if not own or heading.stem in ("run", "sensor", "repeat") or _PLAIN.fullmatch(text):
            return {}
        found[heading.index] = text
        sure = sure or readable(stem, text)
    return found if sure else {}


def _unit(stem: str, text: str, heading: Heading, row: int | None, phase: str) -> str:
    """The unit that a heading, a row of units or a cell states; the direction must be that of the job."""
    try:
        unit, direction = read_unit(stem, text)
    except UnitError as error:
        raise _Unclear(str(error), heading, None if row is None else (row, text)) from None
    if direction not in ("", phase):
        expected = (
            f"phases that {phase}, as the job says or, where it says nothing, is assumed: state phase = "
            '"lag" or "lead" in the job as the instrument shows it, and leave the word out here'
        )
        raise _Unclear(expected, heading, None if row is None else (row, text))
    return unit


def _columns(
    heading: Heading, headings: Sequence[Heading], rows: Sequence[Row], below: str, phase: str
) -> list[_Column]:
    """The columns of a runs table in one of the file: amplitude and phase, where it holds vectors."""
    cells = _cells(heading, rows)
    units_row = (below, rows[0][0] - 1)
    if not _holds_vectors(heading, headings, cells):
        if heading.stem not in MEASURED:
            return [_Column(heading, heading.stem, "", cells)]
        stated = [(heading.unit, None), units_row]
        return [
            _numbers(heading, heading.stem, stated, [_number(heading.stem, c) for c in cells], rows, phase)
        ]
    ordered = heading.stem == "vector" and "vector" not in heading.name.casefold()
    parts: tuple[list[_Part | None], list[_Part | None]] = ([], [])
    for (row, _), cell in zip(rows, cells, strict=True):
        found = _vector(cell)
        if found is None or not (found[1].sure or ordered):
            raise _Unclear(
                "an amplitude and a phase that can be nothing else, such as 6.93 @ 98°", heading, (row, cell)
            )
        parts[0].append(found[0])
        parts[1].append(found[1])
    both = _BOTH_UNITS.fullmatch(heading.unit)
    of_amplitude, of_phase = both.groups() if both else (heading.unit, "")
    amplitude = _numbers(heading, "amplitude", [(of_amplitude, None), units_row], parts[0], rows, phase)
    angle = _numbers(heading, "phase", [(of_phase, None)], parts[1], rows, phase)
    if not angle.unit:
        angle = angle._replace(unit=_degrees(angle))
    return [amplitude, angle]


def _degrees(column: _Column) -> str:
    """Degrees, where phases without a sign are too large for radians."""
    plain = [show(cell).replace(",", ".") for cell in column.cells]
    if not any(abs(float(text)) > math.tau for text in plain if _DECIMAL.fullmatch(text)):
        expected = "the sign of degrees, as in 6.93 @ 98°: phases that are all so small may be radians"
        raise _Unclear(expected, column.heading)
    return "deg"


def _holds_vectors(heading: Heading, headings: Sequence[Heading], cells: Sequence[Cell]) -> bool:
    """Whether a column holds amplitude and phase in one cell."""
    if heading.stem not in ("", "amplitude"):
        return heading.stem == "vector"
    others = [one for one in headings if one.stem in READING and one is not heading]
    if heading.stem and any(one.stem == "phase" and one.sensor == heading.sensor for one in others):
        return False
    found = [pair for cell in cells if cell != "" and (pair := _vector(cell)) is not None]
    return any(phase.sure for _, phase in found) or (bool(found) and not others)


def _vector(cell: Cell) -> tuple[_Part, _Part] | None:
    """Amplitude and phase of a cell such as `6.93 um @ 98°`; None for anything else."""
    if cell == "":
        return _Part(""), _Part("")
    found = _VECTOR.fullmatch(cell) if isinstance(cell, str) else None
    if found is None or not readable("amplitude", found[2]) or not readable("phase", found[5]):
        return None
    sure = found[3] != "/" or bool(read_unit("phase", found[5])[0])
    return _Part(found[1], found[2]), _Part(found[4], found[5], sure)


def _number(stem: str, cell: Cell) -> _Part | None:
    """A number, perhaps with its unit; None for anything else."""
    if not isinstance(cell, str) or not cell or _PLAIN.fullmatch(cell):
        return _Part(cell)
    found = _WITH_UNIT.fullmatch(cell)
    return _Part(found[1], found[2]) if found and readable(stem, found[2]) else None


def _numbers(
    heading: Heading,
    stem: str,
    stated: Sequence[tuple[str, int | None]],
    parts: Sequence[_Part | None],
    rows: Sequence[Row],
    phase: str,
) -> _Column:
    """A column of numbers in one unit, which the heading states, the row below it, or every cell."""
    unit = ""
    for text, row in stated:
        own = units.spelt(text) if heading.tidy and row is None else _unit(stem, text, heading, row, phase)
        if own and unit not in ("", own):
            raise _Unclear(f"{unit}, as in the heading, or nothing", heading, (row or 0, text))
        unit = unit or own
    out: list[Cell] = []
    first: dict[str, tuple[int, Cell]] = {}
    for (row, cells), part in zip(rows, parts, strict=True):
        cell = cells[heading.index]
        own = _unit(stem, part.rest, heading, row, phase) if part and part.rest else ""
        if own and unit not in ("", own) and not heading.tidy:
            raise _Unclear(f"an {stem} in {unit}, as the heading says", heading, (row, cell))
        kept = part is None or (unit and own not in ("", unit))  # what it should be is said by the table
        out.append(cell if part is None or kept else part.number)
        if not kept and cell != "":
            first.setdefault(own, (row, cell))
    if not unit and len(first) > 1:
        (row, cell), at = list(first.values())[:2]
        expected = f"the same unit in all cells of the column (row {row} has {show(cell)}), or in its heading"
        raise _Unclear(expected, heading, at)
    return _Column(heading, stem, unit or next(iter(first), ""), out)


def _by_sensor(columns: Sequence[_Column]) -> dict[str, dict[str, _Column]]:
    """Amplitude and phase of each sensor; the name is empty where a column has the names."""
    found: dict[str, dict[str, _Column]] = {}
    others: dict[str, _Column] = {}
    listed = any(column.stem == "sensor" for column in columns)
    for column in columns:
        heading, stem = column.heading, column.stem
        if stem in ("", "note"):
            continue
        sensor = "" if listed and heading.stem in ("", "vector") else heading.sensor
        place = found.setdefault(sensor, {}) if stem in READING else others
        if place.setdefault(stem, column) is not column:
            other = place[stem].heading.name
            expected = (
                f"one column of the {stem}, and {other!r} could be it too: begin the name of one with note"
            )
            raise _Unclear(expected, heading)
    for sensor, own in found.items():
        heading = next(iter(own.values())).heading
        if sensor and listed:
            raise _Unclear("either a column of the sensors' names, or columns for each sensor", heading)
        if not sensor and len(found) > 1:
            raise _Unclear("a name with that of its sensor, as the other columns have", heading)
        if sensor and len(own) < len(READING):
            [lacking] = set(READING) - set(own)
            raise _Unclear(
                f"the {lacking} of this sensor too, in a column such as '{sensor} {lacking}'", heading
            )
    return found or {"": {}}


def _name(column: _Column) -> str:
    """The name that a column has in a runs table."""
    if column.stem not in MEASURED:
        return column.heading.name if column.stem in ("", "note") else column.stem
    if not column.unit and column.stem != "amplitude" and not column.heading.tidy:
        usual = "rpm" if column.stem == "speed" else "deg"
        raise _Unclear(f"its unit too, such as '{column.heading.name} ({usual})'", column.heading)
    return f"{column.stem}_{column.unit}" if column.unit else column.stem


def _assembled(grid: Grid, columns: Sequence[_Column]) -> Grid:
    """A runs table of these columns: one row for each row of the file and sensor with columns of its own."""
    sensors = _by_sensor(columns)
    common = [column for column in columns if column.stem not in READING]
    readings = {name: [own[stem] for stem in READING if stem in own] for name, own in sensors.items()}
    first = next(iter(readings.values()))
    for own in readings.values():
        for column, one in zip(own, first, strict=True):
            if column.unit != one.unit:
                units = (
                    f"{one.unit or 'no unit'}, as {one.heading.name!r} has, not {column.unit or 'no unit'}"
                )
                raise _Unclear(f"one unit for all sensors: {units}", column.heading)
    wide = [] if "" in readings else ["sensor"]
    header = (*map(_name, common), *wide, *map(_name, first))
    rows: list[Row] = []
    taken: list[tuple[int, ...]] = []
    for own in readings.values():
        of = (*common, *(own[:1] if wide else ()), *own)
        taken.append(tuple(column.heading.index for column in of))
    for k, (number, _) in enumerate(grid.rows):
        for sensor, own in readings.items():
            cells = [column.cells[k] for column in (*common, *own)]
            cells[len(common) : len(common)] = [sensor] if wide else []
            rows.append((number, tuple(cells)))
    return replace(
        grid, header=header, rows=tuple(rows), named=grid.header, taken=tuple(taken) * len(grid.rows)
    )
