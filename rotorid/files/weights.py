"""Weights tables: what was mounted in which plane during which run.

The unit of a weight stands in the heading (`mass_g`, `Weight [oz·in]`), in a column `unit` or in every cell.
Its angle is one in degrees (`270°`), a hole, blade or position of the job's plane by its name, or a clock:
12 is the mark and the hours run as the job's angles count, 30° each. What is removed acts 180° away.
"""

from __future__ import annotations

import math
import re
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np

from rotorid.base.arrays import ComplexArray
from rotorid.base.suggestions import did_you_mean
from rotorid.base.text import listing
from rotorid.files import units
from rotorid.files.columns import REMARKS, Column, Source, make_table
from rotorid.files.conventions import FULL_TURN, Conventions
from rotorid.files.grid import Cell, Grid, show
from rotorid.files.headings import Heading, read_headings, read_unit, readable
from rotorid.files.layout import NUMBER, Unclear, open_table, vector_in
from rotorid.files.problems import Problems
from rotorid.files.units import Unit, one_of

COLUMNS = (
    Column("run"),
    Column("plane"),
    Column(
        "mass", one_of(units.MASS), ("mass_g", "mass_kg", "mass_mg", "mass_oz", "mass_lb"), required=False
    ),
    Column("unbalance", one_of(units.UNBALANCE), ("unbalance_g_mm", "unbalance_oz_in"), required=False),
    Column("angle", one_of(units.ANGLE), ("angle_deg",)),
)
_SIZE = re.compile(rf"({NUMBER})\s*([^\W\d_].*)?")
_ANGLE = re.compile(rf"({NUMBER})\s*(?:°|º|deg|degrees?)", re.IGNORECASE)
_CLOCK = re.compile(r"(1[0-2]|0?[0-9])(?::([0-5][0-9])(?::00)?)?(?:\s*(?:o['’]?clock|h))?", re.IGNORECASE)
_HOLE = re.compile(r"(?:hole|blade|vane|position|pos\.?|no\.|#)\s*(\S+)", re.IGNORECASE)


@dataclass(frozen=True, eq=False)
class Weights:
    """Complex weights of each run and plane, kg or kg·m, shape (R, P); each row: run, plane, weight."""

    planes: tuple[str, ...]
    weights: ComplexArray
    unit: Unit
    rows: tuple[tuple[str, str, complex], ...] = ()


def read_weights(
    source: Source, runs: tuple[str, ...] | None, conventions: Conventions, problems: Problems
) -> Weights | None:
    """Read a weights table, or None and problems.

    Parameters
    ----------
    source
        A file, or the cells of a sheet.
    runs
        Names of the runs; None if they could not be read, so that nothing is said about them.
    conventions
        What angles mean, and the holes of the planes.
    problems
        Collects the complaints.
    """
    grid = open_table(source, {}, problems, weights=True)
    if grid is None:
        return None
    try:
        grid = _tidied(grid, runs, conventions)
    except Unclear as reason:
        problems.add(grid.source, reason.row or grid.header_row, reason.column, reason.value, str(reason))
        return None
    table = make_table(grid, COLUMNS, problems)
    if table is None:
        return None
    missing = "one column of weights, mass_<unit> or unbalance_<unit>, such as mass_g or unbalance_g_mm"
    several = "one column of weights, mass_<unit> or unbalance_<unit>, not both"
    what = table.only(("mass", "unbalance"), "mass_g", missing, several)
    if what is None:
        return None
    size, angle = table.numbers(what), table.numbers("angle")
    table.must_be(
        what,
        size > 0,
        "a weight above 0 (a run without weights has no row here; what was removed is a weight 180° away)",
    )
    table.must_be("angle", np.abs(angle) <= FULL_TURN, "an angle from -360 to 360 degrees")
    run, plane = table.texts("run"), table.texts("plane")
    planes = tuple(dict.fromkeys(name for name in plane if name))
    values = conventions.labels.weight_from(size, angle)
    total = np.zeros((len(runs or ()), len(planes)), dtype=complex)
    seen: dict[tuple[str, str, complex], int] = {}
    for i in range(len(table)):
        if runs is not None and run[i] and run[i] not in runs:
            expected = (
                f"a run of the runs table{did_you_mean(run[i], runs)}; its runs are {listing(runs, 'and')}"
            )
            table.complain(i, "run", expected)
        elif run[i] and plane[i] and size[i] > 0 and np.isfinite(angle[i]):
            first = seen.setdefault((run[i], plane[i], complex(values[i])), i)
            if first != i:
                table.complain(i, "run", f"each weight once (row {table.rows[first]} says the same)")
            elif runs is not None:
                total[runs.index(run[i]), planes.index(plane[i])] += values[i]
    return Weights(planes, total, table.unit(what), tuple(seen))


def _tidied(grid: Grid, runs: Sequence[str] | None, conventions: Conventions) -> Grid:
    """The table with the columns run, plane, mass or unbalance with its unit, and angle_deg."""
    grid = _by_row(grid, read_headings(grid.header, weights=True))
    headings = read_headings(grid.header, weights=True)
    by = {heading.stem: heading for heading in headings if heading.stem not in ("", "note")}
    known = [heading for heading in headings if heading.stem not in ("", "note")]
    size = by.get("mass") or by.get("unbalance")
    if len(by) < len(known) or "plane" not in by or size is None or {"mass", "unbalance"} <= set(by):
        return grid
    columns: dict[str, tuple[Heading, list[Cell]]] = {}
    grid, size = _filled(grid, by, size)

    def cells(heading: Heading) -> list[Cell]:
        return [row[heading.index] for _, row in grid.rows]

    if "run" in by:
        folded = {name.casefold(): name for name in runs or ()}
        names = [show(cell) for cell in cells(by["run"])]
        columns["run"] = by["run"], [n if n in (runs or ()) else folded.get(n.casefold(), n) for n in names]
    elif runs is not None and len(runs) == 1:
        columns["run"] = by["plane"], [runs[0]] * len(grid.rows)
    columns["plane"] = by["plane"], cells(by["plane"])
    name, sizes, beside = _sizes(grid, size, by.get("unit"))
    columns[name] = size, sizes
    if {"angle", "hole", "clock"} & set(by) or any(beside):
        place = by.get("angle") or by.get("hole") or by.get("clock") or size
        unit, angles = _angles(grid, by, beside, conventions)
        columns[f"angle_{unit}" if unit else "angle"] = place, angles
    for heading in headings:
        if heading.stem in ("", "note") and heading.name:
            remark = heading.stem == "note" and not heading.name.casefold().startswith(REMARKS)
            columns[f"note {heading.name}" if remark else heading.name] = heading, cells(heading)
    places = [heading.index for heading, _ in columns.values()]
    rows, width = zip(*(column for _, column in columns.values()), strict=True), len(grid.header)
    return replace(
        grid,
        header=tuple(columns),
        rows=tuple((number, row) for (number, _), row in zip(grid.rows, rows, strict=True)),
        named=grid.named or grid.header,
        taken=tuple(tuple(row[k] for k in places) for row in grid.taken or [range(width)] * len(grid.rows)),
    )


def _by_row(grid: Grid, headings: Sequence[Heading]) -> Grid:
    """A table with columns for each plane, `P1 weight (g), P1 angle (deg), …`, as one row a weight."""
    planes: dict[str, dict[str, Heading]] = {}
    for heading in headings:
        if heading.stem in ("mass", "unbalance", "angle") and heading.sensor and heading.unit:
            planes.setdefault(heading.sensor, {})[heading.stem] = heading
    kinds = {tuple(sorted((stem, own.unit) for stem, own in each.items())) for each in planes.values()}
    if len(planes) < 2 or len(kinds) > 1 or "plane" in {heading.stem for heading in headings}:
        return grid
    used = {own.index for each in planes.values() for own in each.values()}
    others = [heading for heading in headings if heading.index not in used]
    [kind] = kinds
    rows, taken = [], []
    for number, cells in grid.rows:
        for plane, own in planes.items():
            places = [own[stem].index for stem, _ in kind]
            if any(show(cells[place]) for place in places):
                rows.append((number, (*(cells[h.index] for h in others), plane, *(cells[k] for k in places))))
                taken.append((*(h.index for h in others), places[0], *places))
    header = (*(h.name for h in others), "plane", *(f"{stem} ({unit})" for stem, unit in kind))
    return replace(grid, header=header, rows=tuple(rows), named=grid.header, taken=tuple(taken))


def _filled(grid: Grid, by: Mapping[str, Heading], size: Heading) -> tuple[Grid, Heading]:
    """The table without a row of units below the header, and without rows of runs that had no weight."""
    filled = [
        k for k, (_, row) in enumerate(grid.rows) if any(show(row[by[s].index]) for s in by if s != "run")
    ]
    top = grid.rows[filled[0]][1] if filled else ()
    unit = show(top[size.index]).strip("()[] ") if filled else ""
    named = any(show(top[by[stem].index]) for stem in ("run", "plane") if filled and stem in by)
    if unit and not named and not size.unit and readable("mass", unit):
        size, filled = replace(size, unit=unit, tidy=False), filled[1:]
    rows = tuple(grid.rows[k] for k in filled)
    return replace(grid, rows=rows, taken=tuple(grid.taken[k] for k in filled if grid.taken)), size


def _sizes(grid: Grid, size: Heading, unit_column: Heading | None) -> tuple[str, list[Cell], list[str]]:
    """The name of the column of weights, its numbers, and angles that stand in the same cells."""
    heading_unit = size.unit
    if not size.tidy and heading_unit:
        if not readable("mass", heading_unit):
            raise Unclear(f"a unit of weight ({listing(units.MASS)}, g_mm, oz_in …)", size)
        heading_unit = read_unit("mass", heading_unit)[0]
    out: list[Cell] = []
    angles: list[str] = []
    own: list[str] = []
    for _, row in grid.rows:
        cell = row[size.index]
        vector = vector_in(cell)
        text, angle = (vector[0].strip(), vector[1]) if vector and vector[2] else (cell, "")
        angles.append(angle)
        match = _SIZE.fullmatch(text) if isinstance(text, str) else None
        unit = "" if unit_column is None else show(row[unit_column.index])
        unit = (match[2] if match else None) or unit
        sure = bool(unit) and readable("mass", unit)
        out.append(match[1] if match and sure else text)
        own.append(read_unit("mass", unit)[0] if sure else "")
    usual = heading_unit or next(filter(None, own), "")
    for k, (number, row) in enumerate(grid.rows):
        if own[k] not in ("", usual):
            ours, theirs = units.weight(usual), units.weight(own[k])
            text = show(out[k]).replace(",", ".") if grid.separator != "," else show(out[k])
            if ours.kind != theirs.kind or not re.fullmatch(r"[0-9]+\.?[0-9]*", text):
                raise Unclear(
                    f"a weight in {usual}, as the others, or in a unit that converts to it",
                    size,
                    number,
                    row[size.index],
                )
            out[k] = theirs.to_si(float(text)) * ours.scale
        elif not own[k] and not heading_unit and usual and out[k] != "":
            raise Unclear(f"a weight with its unit, as {usual} in other cells", size, number, row[size.index])
    try:
        stem = units.weight(usual).kind if usual else size.stem
    except units.UnitError:
        stem = size.stem
    return (f"{stem}_{usual}" if usual else stem), out, angles


def _angles(
    grid: Grid, by: Mapping[str, Heading], beside: Sequence[str], conventions: Conventions
) -> tuple[str, list[Cell]]:
    """The unit of the angles, and their cells."""
    column = by.get("angle")
    unit = "" if column is None else column.unit
    if column is not None and not column.tidy and unit and readable("phase", unit):
        unit = read_unit("phase", unit)[0]
    out: list[Cell] = []
    plain, told = [], False
    for (number, row), text in zip(grid.rows, beside, strict=True):
        heading, cell = column, (row[column.index] if column is not None else text)
        angle: Cell | None = None
        if show(cell) == "":
            heading = next((by[stem] for stem in ("hole", "clock") if stem in by), column)
            cell = "" if heading is None else row[heading.index]
        written = show(cell)
        match = _ANGLE.fullmatch(written)
        if match:
            angle, told = match[1], True
        elif heading is not None and written:
            angle = _by_name(written, heading, row, by, conventions, number)
            told = told or angle is not None
        if angle is None:
            angle = cell
            plain.append(written.replace(",", "."))
        if "action" in by:
            angle = _turned(angle, row[by["action"].index], by["action"], number)
        out.append(angle)
    if not unit and (column is None or not column.tidy or told):
        numbers = [abs(float(text)) for text in plain if re.fullmatch(r"[+-]?[0-9]+\.?[0-9]*", text)]
        if any(number > math.tau for number in numbers) or not any(numbers):
            unit = "deg"
        elif column is not None:
            raise Unclear(f"its unit too, such as '{column.name} (deg)'", column)
    return unit or ("" if column is not None else "deg"), out


def _by_name(
    written: str,
    heading: Heading,
    row: Sequence[Cell],
    by: Mapping[str, Heading],
    conventions: Conventions,
    number: int,
) -> float | None:
    """The angle in degrees of a clock, a hole, a blade or a position; None: it is a number of the angle."""
    clock = _CLOCK.fullmatch(written)
    if clock and (heading.stem == "clock" or ":" in written or not written[-1:].isdigit()):
        return (30.0 * int(clock[1]) + int(clock[2] or 0) / 2.0) % 360.0
    match = _HOLE.fullmatch(written)
    if heading.stem == "clock":
        raise Unclear("a time of the clock face, such as 10:20", heading, number, written)
    if heading.stem != "hole" and match is None:
        return None
    hole, plane = match[1] if match else written, show(row[by["plane"].index])
    holes = conventions.holes.get(plane, {})
    if not holes:
        keys = f"[planes.{plane}] holes = 12 or holes_deg = [0, 30, 75]"
        raise Unclear(f"an angle, or the holes of the plane in the job, {keys}", heading, number, written)
    if hole not in holes:
        expected = f"a hole of plane {plane!r}{did_you_mean(hole, holes)}; it has {listing(holes, 'and')}"
        raise Unclear(expected, heading, number, written)
    if plane in conventions.removed and "action" not in by:
        expected = f"a column action with add or remove: material is taken away from plane {plane!r}"
        raise Unclear(expected, heading, number, written)
    return holes[hole]


def _turned(angle: Cell, action: Cell, heading: Heading, number: int) -> Cell:
    """An angle, 180° away where material was removed there."""
    word = show(action).casefold()
    if word in ("", "add", "added"):
        return angle
    if word not in ("remove", "removed"):
        raise Unclear("add or remove", heading, number, action)
    text = show(angle)
    return (float(text) + 180.0) % 360.0 if re.fullmatch(r"[+-]?[0-9]+\.?[0-9]*", text) else angle
