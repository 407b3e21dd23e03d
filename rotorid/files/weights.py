"""Weights tables: what was mounted in which plane during which run.

The unit of a weight stands in the heading (`mass_g`, `Weight [oz·in]`), in a column `unit` or in every cell.
Its angle is one in degrees (`270°`), a hole, blade or position of the job's plane by its name, or a clock:
12 is the mark and the hours run as the job's angles count, 30° each. What is removed acts 180° away. A `?` is
a mass or place that nobody knows: all of a plane are one weight at one place, for which 1 and 0 stand in.
"""

from __future__ import annotations

import re
from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import partial
from itertools import compress

import numpy as np

from balancing import TRIAL_WEIGHTS, Relative
from rotorid.base.arrays import ComplexArray, FloatArray
from rotorid.base.choices import did_you_mean
from rotorid.base.text import listing
from rotorid.files import units
from rotorid.files.cells import Grid, NotANumber, parse_number, show
from rotorid.files.columns import FULL_TURN, UNCLEAR, Column, Source, Table, make_table, read_grid
from rotorid.files.headings import WEIGHT, find_header, read_headings
from rotorid.files.input_problems import InputError, Problems
from rotorid.files.table_layouts import NUMBER, Conventions, long_rows
from rotorid.files.units import Unit, one_of

MASSES = ("mass_g", "mass_kg", "mass_mg", "mass_oz", "mass_lb", "unbalance_g_mm", "unbalance_oz_in")
COLUMNS = (
    Column("run"),
    Column("plane"),
    Column("mass", units.weight, MASSES),
    Column("angle", one_of(units.ANGLE), ("angle_deg",), lenient=True),
)
_PLACES = ("angle", "hole", "blade", "clock")
"""Columns that say where a weight is; the first that is filled in counts."""
_BESIDE = (*_PLACES[1:], "action", "unit", "pieces")
_ANGLE = re.compile(rf"({NUMBER})\s*(?:°|º|deg|degrees?)", re.IGNORECASE)
_CLOCK = re.compile(r"(1[0-2]|0?[0-9])(?::([0-5][0-9])(?::00)?)?(?:\s*(?:o['’]?clock|h))?", re.IGNORECASE)
_HOLE = re.compile(r"(?:hole|blade|vane|position|pos\.?|no\.|#)\s*(\S+)", re.IGNORECASE)

_Unknown = set[tuple[int, str, str]]
"""Row, plane (empty where a column has it) and quantity of each `?`."""


@dataclass(frozen=True, eq=False)
class Weights:
    """Complex weights of each run and plane, kg or kg·m, shape (R, P); rows: run, plane, weight, pieces."""

    planes: tuple[str, ...]
    weights: ComplexArray
    unit: Unit
    rows: tuple[tuple[str, str, complex, str], ...] = ()
    relative: Relative | None = None


def read_weights(
    source: Source, runs: tuple[str, ...] | None, conventions: Conventions, problems: Problems
) -> Weights | None:
    """Read a weights table, or None and problems.

    Parameters
    ----------
    source
        A file, the cells of a sheet, or several files whose weights add.
    runs
        Names of the runs; None if they could not be read, so that nothing is said about them.
    conventions
        What angles mean, and the holes of the planes.
    problems
        Collects the complaints.
    """
    if not isinstance(source, tuple):
        return _read_table(source, runs, conventions, problems)
    read = [_read_table(one, runs, conventions, problems) for one in source]
    tables = [one for one in read if one is not None]
    if len(tables) < len(read):
        return None
    first, rows = tables[0], tuple(row for one in tables for row in one.rows)
    for file, one in zip(source, tables, strict=True):
        if one.unit.kind != first.unit.kind:
            problems.add(
                f"weights that add to those of {source[0]}, in {first.unit.name}",
                file,
                None,
                "weight",
                one.unit.name,
            )
    planes = tuple(dict.fromkeys(plane for one in tables for plane in one.planes))
    total = np.zeros((len(first.weights), len(planes)), dtype=complex)
    for one in tables:
        total[:, [planes.index(plane) for plane in one.planes]] += one.weights
    return replace(first, planes=planes, weights=total, rows=rows)


def _read_table(
    source: Source, runs: tuple[str, ...] | None, conventions: Conventions, problems: Problems
) -> Weights | None:
    """Of one table."""
    find, before = partial(find_header, weights=True), len(problems)
    try:
        grid, unknown = _without_marks(read_grid(source, "weights", problems, may_be_empty=True, find=find))
        grid = _one_weight_a_row(grid, conventions)
    except InputError as error:
        problems.extend(error.problems)
    if len(problems) > before:
        return None
    there = {name.partition("_")[0] for name in grid.header}
    columns = (
        replace(COLUMNS[0], required=runs is None or len(runs) > 1),  # the only run need not be named
        *COLUMNS[1:3],
        replace(COLUMNS[3], required=there.isdisjoint(_PLACES)),
        *(Column(stem, required=False, blank=True, lenient=True) for stem in _BESIDE if stem in there),
    )
    table = make_table(grid, columns, problems)
    if table is None:
        return None
    size, plane, stem = table.numbers("mass"), table.texts("plane"), "run" if "run" in table else "plane"
    table.complain_where(
        size <= 0,
        "mass",
        "a weight above 0 (a run without weights has no row here; what was removed is one 180° away)",
    )
    names = table.texts("run") if "run" in table else (runs or ("",)) * len(table)
    run_names = runs or ()
    folded = {name.casefold(): name for name in run_names}
    run = [name if name in run_names else folded.get(name.casefold(), name) for name in names]
    values = conventions.labels.weight_from(size, _angles(table, conventions)).tolist()
    rows: dict[tuple[str, str, complex, str], int] = {}
    for i, row in enumerate(zip(run, plane, values, table.texts("pieces"), strict=True)):
        if runs is not None and run[i] and run[i] not in runs:
            hint = f"{did_you_mean(run[i], runs)}; its runs are {listing(runs, 'and')}"
            table.complain(i, "run", f"a run of the runs table{hint}")
        elif rows.setdefault(row, i) != i and all(row[:3]):
            table.complain(i, stem, f"each weight once (row {table.rows[rows[row]]} says the same)")
    planes = tuple(dict.fromkeys(filter(None, plane)))
    total = np.zeros((len(run_names), len(planes)), dtype=complex)
    for name, its, value, _ in rows if runs and len(problems) == before else ():
        total[run_names.index(name), planes.index(its)] += value
    made = Weights(planes, total, table.unit("mass"), tuple(rows))
    if not unknown or len(problems) > before:
        return made
    total, relative = _relative_weights(table, unknown, run, run_names, total)
    return replace(made, weights=total, unit=Unit(TRIAL_WEIGHTS, "multiple"), relative=relative)


def _one_weight_a_row(grid: Grid, conventions: Conventions) -> Grid:
    """The table with one row a weight and its columns by their own names; blank rows say nothing."""
    headings = read_headings(grid.header, weights=True)
    at = {heading.stem: heading.index for heading in headings}
    wide = "plane" not in at and len({h.sensor for h in headings if h.sensor and h.stem in WEIGHT}) > 1
    if {"unit", "mass"} <= at.keys():
        k, unit, columns = at["mass"], at["unit"], grid.columns
        each = zip(columns[k], columns[unit], strict=True)
        masses = [" ".join(map(show, cells)).strip() for cells in each]
        grid = replace(grid, columns=(*columns[:k], masses, *columns[k + 1 :]))
    headings = headings if wide else [replace(heading, sensor="") for heading in headings]
    grid = long_rows(grid, headings, WEIGHT, "plane", conventions)
    filled = ("mass", *_PLACES, *(() if wide else ("plane",)))
    places = [k for k, name in enumerate(grid.header) if name.partition("_")[0] in filled]
    kept = [any(map(show, cells)) for cells in zip(*(grid.columns[k] for k in places), strict=True)]
    return replace(
        grid,
        numbers=tuple(compress(grid.numbers, kept)),
        columns=[[*compress(column, kept)] for column in grid.columns],
        named=tuple(compress(grid.named, kept)),
    )


def _angles(table: Table, conventions: Conventions) -> FloatArray:
    """Angle of each weight, rad; NaN and a problem where there is none."""
    places = [stem for stem in _PLACES if stem in table]
    degree, angle = units.ANGLE["deg"], table.numbers("angle").copy()
    clear = "angle" not in table or table.unit("angle") != UNCLEAR
    for i in np.flatnonzero(np.isnan(angle)).tolist() if clear else ():
        stem = next((stem for stem in places if table.shown(stem, i)), places[0])
        try:
            angle[i] = degree.to_si(_by_name(table, i, stem, conventions))
        except NotANumber as error:
            table.complain(i, stem, str(error))
    table.complain_where(abs(angle) > FULL_TURN, places[0], "an angle from -360 to 360 degrees")
    for i, action in enumerate(table.texts("action")):
        if action.casefold() in ("remove", "removed"):
            angle[i] = degree.to_si((angle[i] * degree.scale + 180.0) % 360.0)
        elif action.casefold() not in ("", "add", "added"):
            table.complain(i, "action", "add or remove")
    return angle


def _by_name(table: Table, i: int, stem: str, conventions: Conventions) -> float:
    """The angle in degrees of 90°, a clock, a hole, a blade or a position."""
    written = table.shown(stem, i)
    clock, match = _CLOCK.fullmatch(written), _HOLE.fullmatch(written)
    if angle := _ANGLE.fullmatch(written):
        return parse_number(angle[1].replace(",", "."))
    if clock and (stem == "clock" or ":" in written or not written[-1:].isdigit()):
        return (30.0 * int(clock[1]) + int(clock[2] or 0) / 2.0) % 360.0
    if stem == "clock" and written:
        raise NotANumber("a time of the clock face, such as 10:20")
    if not written or (stem not in _PLACES[1:3] and match is None):
        raise NotANumber("an angle from -360 to 360 degrees, a hole or a clock, such as 10:20")
    if stem == "hole" and table.texts("blade")[i]:
        raise NotANumber("nothing here, or no blade beside it")
    hole, plane = match[1] if match else written, table.texts("plane")[i]
    holes = conventions.holes.get(plane, {})
    if not holes:
        raise NotANumber(
            f"an angle, or the holes of the plane in the job, [planes.{plane}] holes = 12 or "
            "holes_deg = [0, 30, 75]"
        )
    if hole not in holes:
        hint = f"{did_you_mean(hole, holes)}; it has {listing(holes, 'and')}"
        raise NotANumber(f"a hole of plane {plane!r}{hint}")
    if plane in conventions.removed and "action" not in table:
        raise NotANumber(f"a column action with add or remove: material is taken away from plane {plane!r}")
    return holes[hole]


def _without_marks(grid: Grid) -> tuple[Grid, _Unknown]:
    """A weights table with numbers in place of `?`, and where these stood."""
    headings = [h for h in read_headings(grid.header, weights=True) if h.stem in WEIGHT]
    columns, unknown = [*grid.columns], _Unknown()
    for heading in headings:
        cells = [*columns[heading.index]]
        for k, cell in enumerate(cells):
            if show(cell) == "?":
                unknown.add((grid.numbers[k], heading.sensor, heading.stem))
                cells[k] = "1" if heading.stem == "mass" else "0"
        columns[heading.index] = cells
    return replace(grid, columns=columns), unknown


def _relative_weights(
    table: Table, unknown: _Unknown, run_of: Sequence[str], runs: Sequence[str], total: ComplexArray
) -> tuple[ComplexArray, Relative]:
    """Weights (R, P) as multiples of the trial weight of their plane; problems where these are none.

    `run_of` are the runs of the rows of the table, `runs` those of the weights.
    """
    plane_of, unit, sizes = table.texts("plane"), table.unit("mass"), dict[str, float]()
    turned, multiples = any(stem == "angle" for *_, stem in unknown), total.copy()

    def marked(row: int, stem: str) -> bool:
        return not unknown.isdisjoint((table.rows[row], name, stem) for name in ("", plane_of[row]))

    for p, plane in enumerate(dict.fromkeys(plane_of)):
        rows = [row for row, name in enumerate(plane_of) if name == plane]
        stems = [stem for stem in WEIGHT if any(marked(row, stem) for row in rows)]
        alike: dict[tuple[complex, ...], str] = {}
        for row in rows if stems else ():
            for stem in stems:
                if not marked(row, stem):
                    table.complain(row, stem, f"? too: other weights of plane {plane!r} have it")
            weights = total[runs.index(run_of[row])].copy()
            weights[p] *= "angle" not in stems
            first = alike.setdefault(tuple(weights.tolist()), run_of[row])
            if first != run_of[row]:
                words = (
                    f"one run of an unknown weight in plane {plane!r}, which stood in {first!r}: two are not "
                    "determined; the same one read again is a repeat of that run"
                )
                table.problems.add(words, table.grid.source, table.rows[row], stems[-1], "?")
        size = next(filter(None, total[:, p].tolist()), 1.0)
        sizes[plane] = np.nan if "mass" in stems else abs(size) * unit.scale
        turn = size / abs(size) if turned and "angle" not in stems else 1.0
        multiples[:, p] /= turn * (unit.to_si(1.0) if "mass" in stems else abs(size))
    return multiples, Relative(turned, sizes, unit.name)
