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
from functools import partial
from typing import NamedTuple

import numpy as np

from rotorid.base.arrays import ComplexArray
from rotorid.base.suggestions import did_you_mean
from rotorid.base.text import listing
from rotorid.files import units
from rotorid.files.columns import Column, Source, make_table, read_grid
from rotorid.files.conventions import FULL_TURN, Conventions
from rotorid.files.grid import Cell, Grid, show
from rotorid.files.headings import Heading, find_header, read_headings
from rotorid.files.layout import NUMBER, WEIGHT, Explained, Unclear, long_rows
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
ANGLES = ("angle", "hole", "clock")
"""Columns that say where a weight is; the first that is filled in counts."""
_NUMBER = re.compile(r"[+-]?[0-9]+(?:[.,][0-9]*)?")
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
    find = partial(find_header, weights=True)
    grid = read_grid(source, "weights", problems, may_be_empty=True, find=find)
    if grid is None:
        return None
    before = len(problems)
    with Explained(grid, problems):
        grid = _tidied(grid, runs, conventions)
    if len(problems) > before:
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
    headings = read_headings(grid.header, weights=True)
    stems = [heading.stem for heading in headings if heading.stem not in ("", "note")]
    sizes = {"mass", "unbalance"} & {*stems}
    wide = "plane" not in stems and len({h.sensor for h in headings if h.sensor and h.stem in WEIGHT}) > 1
    if len(sizes) != 1 or not (wide or ("plane" in stems and len({*stems}) == len(stems))):
        return grid  # the table explains
    [size] = sizes
    headings = [replace(h, stem="mass" if h.stem == size else h.stem) for h in headings]
    if not wide:
        headings = [replace(h, sensor="") for h in headings]
        grid = _with_units(grid, {h.stem: h.index for h in headings})
    grid = long_rows(grid, headings, WEIGHT, "plane", conventions)
    header = [_size_name(name, size) for name in grid.header]
    at = {name.partition("_")[0]: k for k, name in enumerate(header)}
    filled = [at[s] for s in ("plane", size, *ANGLES) if s in at and not (wide and s == "plane")]
    kept = [k for k, (_, row) in enumerate(grid.rows) if any(show(row[place]) for place in filled)]
    rows, named = [grid.rows[k] for k in kept], [grid.named[k] for k in kept]
    columns = {
        name: [(names[k], row[k]) for (_, row), names in zip(rows, named, strict=True)]
        for k, name in enumerate(header)
        if name.partition("_")[0] not in (*ANGLES, "action", "unit", "pieces")
    }
    if "run" in at:
        folded = {name.casefold(): name for name in runs or ()} | {name: name for name in runs or ()}
        columns["run"] = [
            (name, folded.get(show(cell), folded.get(show(cell).casefold(), cell)))
            for name, cell in columns["run"]
        ]
    elif runs is not None and len(runs) == 1:
        columns["run"] = [("run", runs[0]) for _ in rows]
    if any(stem in at for stem in ANGLES):
        unit = next((name.partition("_")[2] for name in header if name.startswith("angle_")), "")
        angles = [
            _angle(_Place(number, row, names, at), conventions, unit, grid.separator)
            for (number, row), names in zip(rows, named, strict=True)
        ]
        plain = [abs(value) for _, value, by_name in angles if isinstance(value, float) and not by_name]
        if not unit and any(plain) and max(plain) <= math.tau:
            heading = Heading(0, grid.named[0][at["angle"]])
            raise Unclear(f"its unit too, such as '{heading.name} (deg)'", heading)
        columns[f"angle_{unit or 'deg'}"] = [(name, value) for name, value, _ in angles]
    return replace(
        grid,
        header=tuple(columns),
        rows=tuple((n, tuple(c[k][1] for c in columns.values())) for k, (n, _) in enumerate(rows)),
        named=tuple(tuple(c[k][0] for c in columns.values()) for k in range(len(rows))),
    )


def _with_units(grid: Grid, at: Mapping[str, int]) -> Grid:
    """The table with the units of a column `unit` behind its weights."""
    if "unit" not in at:
        return grid
    rows = []
    for number, row in grid.rows:
        cell = f"{show(row[at['mass']])} {show(row[at['unit']])}".strip()
        rows.append((number, (*row[: at["mass"]], cell, *row[at["mass"] + 1 :])))
    return replace(grid, rows=tuple(rows))


def _size_name(name: str, size: str) -> str:
    """The name of the column of weights: mass or unbalance, as its unit says."""
    stem, _, unit = name.partition("_")
    if stem != "mass":
        return name
    kind = units.WEIGHT[unit].kind if unit in units.WEIGHT else size
    return f"{kind}_{unit}" if unit else kind


class _Place(NamedTuple):
    """A row of the table: its number, cells, the names of its columns in the file, places by stem."""

    number: int
    row: Sequence[Cell]
    names: Sequence[str]
    at: Mapping[str, int]

    def cell(self, stem: str) -> str:
        """A cell as text; nothing where there is no such column."""
        return show(self.row[self.at[stem]]) if stem in self.at else ""

    def unclear(self, stem: str, expected: str) -> Unclear:
        """What a cell should be."""
        return Unclear(expected, Heading(0, self.names[self.at[stem]]), self.number, self.cell(stem))


def _angle(place: _Place, conventions: Conventions, unit: str, separator: str) -> tuple[str, Cell, bool]:
    """Heading and angle of a weight, and whether it is no plain number; what is none the table explains."""
    stem = next((s for s in ANGLES if place.cell(s)), next(s for s in ANGLES if s in place.at))
    cell, written, turn = place.row[place.at[stem]], place.cell(stem), math.tau if unit == "rad" else 360.0
    degrees = _by_name(written, stem, place, conventions) if written else None
    by_name = degrees is not None
    if degrees is not None:
        cell = degrees * turn / 360.0
    elif _NUMBER.fullmatch(written) and not (separator == "," and "," in written):
        cell = float(written.replace(",", "."))
    action = place.cell("action").casefold()
    if action not in ("", "add", "added", "remove", "removed"):
        raise place.unclear("action", "add or remove")
    if action.startswith("remove") and isinstance(cell, float):
        cell = (cell + turn / 2) % turn
    return place.names[place.at[stem]], cell, by_name


def _by_name(written: str, stem: str, place: _Place, conventions: Conventions) -> float | None:
    """The angle in degrees of 90°, a clock, a hole, a blade or a position; None: a number of the angle."""
    if match := _ANGLE.fullmatch(written):
        return float(match[1].replace(",", ".")) if _NUMBER.fullmatch(match[1]) else None
    clock = _CLOCK.fullmatch(written)
    if clock and (stem == "clock" or ":" in written or not written[-1:].isdigit()):
        return (30.0 * int(clock[1]) + int(clock[2] or 0) / 2.0) % 360.0
    match = _HOLE.fullmatch(written)
    if stem == "clock":
        raise place.unclear(stem, "a time of the clock face, such as 10:20")
    if stem != "hole" and match is None:
        return None
    hole, plane = match[1] if match else written, place.cell("plane")
    holes = conventions.holes.get(plane, {})
    if not holes:
        keys = f"[planes.{plane}] holes = 12 or holes_deg = [0, 30, 75]"
        raise place.unclear(stem, f"an angle, or the holes of the plane in the job, {keys}")
    if hole not in holes:
        hint = f"{did_you_mean(hole, holes)}; it has {listing(holes, 'and')}"
        raise place.unclear(stem, f"a hole of plane {plane!r}{hint}")
    if plane in conventions.removed and "action" not in place.at:
        expected = f"a column action with add or remove: material is taken away from plane {plane!r}"
        raise place.unclear(stem, expected)
    return holes[hole]
