"""Runs and weights tables in any layout, brought by their headings into long rows of one form.

A runs table has a row for each run, speed and sensor, a weights table one for each run and plane. Columns for
each sensor or plane, two heading rows, units rows, units in cells, two quantities in one cell (`6.93 @ 98°`)
and one file a run all become that. Numbers stay as they are written; what has two readings is asked about.
"""

from __future__ import annotations

import math
import re
import warnings
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from dataclasses import replace
from functools import partial
from pathlib import Path
from typing import NamedTuple

from rotorid.base.text import listing
from rotorid.files.cells import Cell, Grid, Row, below_title, show
from rotorid.files.columns import REMARKS, Source, read_grid
from rotorid.files.conventions import PHASES, Conventions, Phase, as_phase
from rotorid.files.headings import (
    DEVIATION,
    LONGEST,
    READING,
    Heading,
    find_header,
    read_headings,
    read_unit,
    readable,
)
from rotorid.files.problems import Problems
from rotorid.files.units import UnitError, spelt

NUMBER = r"[+-]?[0-9][0-9.,]*(?:[eE][+-]?[0-9]+)?"
_PLAIN = re.compile(NUMBER)
_PEAK, _SEVERITY = re.compile("peak|pk", re.IGNORECASE), re.compile("velocity|severity", re.IGNORECASE)
"""Of a heading: mm/s alone are rms where it says severity, and where the job has limits in rms."""
_WITH_UNIT = re.compile(rf"({NUMBER})\s*([^\s0-9].*)")
_AT = rf"\bat\b(?=\s*{NUMBER}\s*(?:°|º|deg|degrees?)?$)"  # not `10 g at 90° in P1`
_VECTOR = re.compile(rf"({NUMBER}[^@<∠]*?)\s*(?:[@<∠/]|{_AT}|(?<=\s)L(?=[0-9]))\s*({NUMBER}[^@<∠/]*)")
_DECIMAL = re.compile(r"[+-]?[0-9]+(?:\.[0-9]*)?")
_WEIGHT = re.compile("weight|mass|correct", re.IGNORECASE)
_BOTH_UNITS = re.compile(r"(.*?)\s*[/@<∠,;&]?\s*((?:°|deg|rad).*)", re.IGNORECASE)
WEIGHT = ("mass", "angle")
NUMBERS = ("speed", *READING, "mass")
"""Quantities whose cells are numbers, maybe with a unit; an angle of a weight may have other forms."""


class Unclear(ValueError):
    """What has no reading, or several: the message says what is expected."""

    def __init__(self, expected: str, heading: Heading, row: int | None = None, cell: Cell = "") -> None:
        super().__init__(expected)
        self.column, self.row = heading.name, row
        self.value = heading.name if row is None else show(cell)


class _Column(NamedTuple):
    """A column of a runs or weights table, with its heading in the file; `unit` may be as written there."""

    heading: Heading
    stem: str
    unit: str
    cells: Sequence[Cell]


def rows_from_header(rows: Sequence[Row], *, weights: bool = False) -> list[Row]:
    """Rows of a sheet with the header of the table in one row; those above it become comments."""
    return below_title(rows, partial(find_header, weights=weights))


def files_of_runs(source: object) -> tuple[Path, ...]:
    """The files of a folder with one file a run, step2 before step10; none for anything else."""
    if not isinstance(source, (str, Path)) or not Path(source).is_dir():
        return ()
    files = [file for file in Path(source).iterdir() if file.suffix.lower() in (".csv", ".txt", ".xlsx")]
    return tuple(sorted(files, key=lambda file: (len(file.stem), file.stem)))


def read_runs_grid(
    source: Source, conventions: Conventions, problems: Problems, *, first: bool = False
) -> Grid | None:
    """The cells of a runs table, whatever its form in the file; None and problems.

    Parameters
    ----------
    source
        A file, a folder or a tuple with one file a run, or the cells of a sheet.
    conventions
        What phases mean, whether columns are exchanged, and the speed where no column has it.
    problems
        Collects the complaints.
    first
        Whether the first sheet of a workbook will do where none is called runs.
    """
    grids = read_runs_grids(source, conventions, problems, first=first)
    return None if grids is None else joined(grids, problems)


def read_runs_grids(
    source: Source, conventions: Conventions, problems: Problems, *, first: bool = False
) -> list[Grid] | None:
    """The same of each file; a file of several without a column of runs is one run, named as the file."""
    files = source if isinstance(source, tuple) else files_of_runs(source)
    grids = list[Grid]()
    for file in files or (source,):
        grid = read_grid(file, "runs", problems, first=first, find=find_header)
        if grid is None:
            continue
        with explained(grid, problems):
            grid = _runs_form(grid, conventions)
            if isinstance(file, Path) and files and "run" not in grid.header:
                rows = tuple((number, (file.stem, *cells)) for number, cells in grid.rows)
                names = tuple(("run", *row) for row in grid.named)
                grid = replace(grid, header=("run", *grid.header), rows=rows, named=names)
            grids.append(grid)
    return grids if len(grids) == len(files or (source,)) else None


@contextmanager
def explained(grid: Grid, problems: Problems) -> Iterator[None]:
    """What is unclear in a table becomes a problem of it."""
    try:
        yield
    except Unclear as reason:
        problems.add(grid.source, reason.row or grid.header_row, reason.column, reason.value, str(reason))


def stated_phase(source: Source) -> Phase | None:
    """Whether the headings of a runs table say that phases lag or lead; None where none or both are said."""
    words = set[str]()
    for file in source if isinstance(source, tuple) else files_of_runs(source) or (source,):
        with warnings.catch_warnings():
            warnings.simplefilter("ignore")  # of a file that is read once more
            grid = read_grid(file, "runs", Problems(), first=True, find=find_header, top=True)
        for heading in read_headings(grid.header) if grid else ():
            if heading.stem == "phase" and readable("phase", heading.unit):
                words |= {*PHASES} & {read_unit("phase", heading.unit)[1]}
    return as_phase(words.pop()) if len(words) == 1 else None


def joined(grids: Sequence[Grid], problems: Problems) -> Grid | None:
    """One runs table of several, with the columns of the first, or None and problems."""
    first, rows = grids[0], list[Row]()
    if len(grids) == 1:
        return first
    for grid in grids:
        if sorted(grid.header) != sorted(first.header):
            expected = f"the columns {listing(first.header, 'and')}, as {first.source} has"
            problems.add(grid.source, grid.header_row, None, listing(grid.header, "and"), expected)
            return None
        places = [grid.header.index(name) for name in first.header]
        rows += [(number, tuple(cells[k] for k in places)) for number, cells in grid.rows]
    source = listing([grid.source for grid in grids], "and")
    return replace(first, source=source, rows=tuple(rows), named=())


def _runs_form(grid: Grid, conventions: Conventions) -> Grid:
    headings = read_headings(grid.header)
    for heading in headings:
        if heading.stem.endswith("X"):
            other = "delete the column, or begin its name with note (if it is a probe: with P)"
            raise Unclear(f"readings at the running speed (1X) alone: {other}", heading)
    return long_rows(grid, headings, READING, "sensor", conventions)


def long_rows(
    grid: Grid, headings: Sequence[Heading], pair: tuple[str, str], key: str, conventions: Conventions
) -> Grid:
    """A table with one row for each row of the file and each sensor or plane that has columns of its own.

    Parameters
    ----------
    grid, headings
        The table and what its headings say.
    pair, key
        `READING` of a `sensor`, or `WEIGHT` of a `plane`.
    conventions
        What phases mean, and the speed where no column has it.

    Raises
    ------
    Unclear
        Where something has no reading, or several.
    """
    phase = conventions.labels.phase if key == "sensor" else ""
    rows, columns = grid.rows, list[_Column]()
    for h in headings:
        cells = [cells[h.index] for _, cells in rows]
        for column in _halves(_Column(h, h.stem, h.unit, cells), headings, rows, pair):
            if column.stem in (*NUMBERS, *pair):
                column = _with_unit(column, rows, phase, rms=conventions.rms)
            columns.append(column)
    sensors = _by_name(columns, pair, key)
    common = [column for column in columns if column.stem not in pair]
    stems = {column.stem for column in common}
    if key == "sensor" and "speed" not in stems and conventions.speed is not None:
        unit, speed = conventions.speed
        common.append(_Column(Heading(0, grid.header[0], tidy=True), "speed", unit, [speed] * len(rows)))
    if [*sensors] == [""] and key == "sensor" not in stems and len(sensors[""]) == 2 and _once(common):
        sensors = {"1": sensors[""]}
    wide, groups = "" not in sensors, [[own[s] for s in pair if s in own] for own in sensors.values()]
    names = [*map(_name, groups[0])]
    for column, name in ((c, name) for own in groups for c, name in zip(own, names, strict=True)):
        if _name(column) != name:
            raise Unclear(f"the unit of all {key}s, {name}", column.heading)
    header = [_name(column, k) for k, column in enumerate(common)]
    if key == "sensor" and conventions.exchanged:
        groups = [
            [c._replace(heading=o.heading, cells=o.cells) for c, o in zip(own, own[::-1], strict=True)]
            for own in groups
        ]
    long: list[Row] = []
    taken = [tuple(c.heading.name for c in (*common, *own[:wide], *own)) for own in groups]
    for k, (number, _) in enumerate(rows):
        start = tuple(c.cells[k] for c in common)
        for name, own in zip(sensors, groups, strict=True):
            long.append((number, (*start, *((name,) if wide else ()), *(c.cells[k] for c in own))))
    return replace(
        grid,
        header=(*header, *((key,) if wide else ()), *names),
        rows=tuple(long),
        named=tuple(taken) * len(rows),
    )


def _halves(
    column: _Column, headings: Sequence[Heading], rows: Sequence[Row], pair: tuple[str, str]
) -> list[_Column]:
    """A column of vectors as one of amplitudes and one of phases; any other as it is."""
    heading, stem, unit, cells = column
    vectors = {cell: vector_in(cell) for cell in dict.fromkeys(cells) if cell != ""}
    some, every = any(vectors.values()), bool(vectors) and all(vectors.values())
    if stem == "" and some and all(re.fullmatch("[0-9.,/ ]+", str(cell)) for cell in vectors):
        return [column]  # fractions or dates: no word and no sign says what they are
    if stem == "" and _WEIGHT.search(heading.name) and pair == READING:
        words = not some and not any(_PLAIN.fullmatch(show(cell)) for cell in vectors)
        return [column._replace(stem="note") if words else column]  # what was mounted
    if stem == "sensor" and every:
        heading, stem = replace(heading, stem="", sensor=heading.name), ""
    paired = any(h.stem == pair[1] and h.sensor == heading.sensor for h in headings)
    if not (
        stem == "vector" or (some and (stem == pair[0] or (pair == READING and not stem)) and not paired)
    ):
        return [column]
    for cell, vector in vectors.items():
        if vector is None:
            row = rows[cells.index(cell)][0]
            raise Unclear("amplitude and phase, unmistakable as 6.93 @ 98°", heading, row, cell)
    both = _BOTH_UNITS.fullmatch(unit)
    units = both.groups() if both else (unit, "")
    halves = [vectors.get(cell) or ("", "") for cell in cells]
    return [_Column(heading, pair[k], units[k], [half[k] for half in halves]) for k in (0, 1)]


def vector_in(cell: Cell) -> tuple[str, str] | None:
    """Size and angle of a cell such as `6.93 um @ 98°`."""
    match = _VECTOR.fullmatch(cell) if isinstance(cell, str) and len(cell) <= LONGEST else None
    return None if match is None else (match[1].strip(), match[2])


def _unit(column: _Column, text: str, phase: str, row: int | None = None, cell: Cell = "") -> str:
    """The unit that a text means; a direction in it must be that of the job."""
    try:
        unit, direction = read_unit(column.stem, text)
    except UnitError as error:
        raise Unclear(str(error), column.heading, row, cell) from None
    if phase and direction not in ("", phase):
        remedy = 'state phase = "lag" or "lead" in the job, as the instrument shows it, without words here'
        raise Unclear(
            f"phases that {phase}, as the job says or is assumed: {remedy}", column.heading, row, cell
        )
    return unit


def _with_unit(column: _Column, rows: Sequence[Row], phase: str, *, rms: bool) -> _Column:
    """Numbers and their one unit, which the heading states, or every cell."""
    heading, stem, unit, cells = column
    stated: dict[str, tuple[int | None, Cell]] = {}
    if unit:
        stated[spelt(unit) if heading.tidy and stem != "mass" else _unit(column, unit, phase)] = (
            None,
            heading.name,
        )
    whole, numbers = bool(stated), dict[Cell, Cell]()
    for cell in dict.fromkeys(cells) if stem in NUMBERS else ():
        match = None if not isinstance(cell, str) or _PLAIN.fullmatch(cell) else _WITH_UNIT.fullmatch(cell)
        fits, here = match is not None and readable(stem, match[2]), ""
        if match and fits:
            numbers[cell] = match[1]  # what is left as it is, the table explains
            here = _unit(column, match[2], phase, rows[cells.index(cell)][0], cell)
        if here or (cell != "" and not whole):
            stated.setdefault(here, (rows[cells.index(cell)][0], cell))
    if len(stated) > 1:
        (one, (at, _)), (_, (row, cell)) = list(stated.items())[:2]
        unit, place = f"in {one}" if one else "without a unit", f"row {at}" if at else "the heading"
        raise Unclear(f"a number {unit}, as {place} says", heading, row, cell)
    unit = next(iter(stated), "")
    cells = [numbers.get(cell, cell) for cell in cells] if numbers else cells
    if stem in ("phase", "angle") and not unit:
        texts = (text for cell in cells if _DECIMAL.fullmatch(text := show(cell).replace(",", ".")))
        plain = [abs(float(text)) for text in texts]
        if max(plain, default=0.0) > math.tau or (stem == "angle" and not any(plain)):
            unit = "deg"
        elif stem == "angle" or not heading.tidy:
            example = f"'{stem.capitalize()} (deg)' or 98°"
            raise Unclear(f"its unit, as in {example}: {stem}s so small may be radians", heading)
    if unit == "mm_s" and not heading.tidy and (rms or _SEVERITY.search(heading.name)):
        unit = "mm_s" if _PEAK.search(heading.name) else "mm_s_rms"
    return _Column(heading, stem, unit, cells)


def _by_name(columns: Sequence[_Column], pair: tuple[str, str], key: str) -> dict[str, dict[str, _Column]]:
    """Both columns of each sensor or plane; the name is empty where a column has the names."""
    sensors: dict[str, dict[str, _Column]] = {}
    common: dict[str, _Column] = {}
    listed = any(column.stem == key for column in columns)
    for column in columns:
        heading, stem = column.heading, column.stem
        if stem in ("", "note"):
            continue
        sensor = heading.sensor if stem in pair and not (listed and heading.stem in ("", "vector")) else ""
        if sensor and listed:
            words = f"as another column has the {key}s: leave {sensor!r} out, or begin the name with note"
            raise Unclear(f"the {stem} alone, {words}", heading)
        other = (sensors.setdefault(sensor, {}) if sensor else common).setdefault(stem, column)
        if other is not column:
            words = f"and {other.heading.name!r} could be it too: begin the name of one with note"
            raise Unclear(f"one column of the {stem}, {words}", heading)
    loose = {stem: column for stem, column in common.items() if stem in pair}
    if not sensors:
        return {"": loose}
    _pair_by_number(sensors)
    if len(sensors) == 1 and len(loose) == 1 and not loose.keys() & next(iter(sensors.values())).keys():
        next(iter(sensors.values())).update(loose)  # one sensor, named in one of its headings
        loose = {}
    for own in (loose, *sensors.values()):
        if own and (own is loose or len(own) < 2):
            one = next(iter(sensors))
            words = f"in columns such as '{one} {pair[0]}' and '{one} {pair[1]}'"
            heading = next(iter(own.values())).heading
            raise Unclear(f"{pair[0]} and {pair[1]} of each {key}, {words}", heading)
    return sensors


def _pair_by_number(sensors: dict[str, dict[str, _Column]]) -> None:
    """Join `A1 (mm/s)` and `P1 (deg)`, which are no two sensors, as 1."""
    halves = {name: next(iter(own)) for name, own in sensors.items() if len(own) == 1}
    numbers = {name: re.sub(r"^[^\W\d_]{1,3}(?=[0-9]+$)", "", name) for name in halves}
    for number in dict.fromkeys(numbers.values()):
        pair = [name for name in halves if numbers[name] == number]
        if number.isdecimal() and len(pair) == 2 == len({halves[name] for name in pair}):
            sensors[number] = {stem: column for name in pair for stem, column in sensors.pop(name).items()}


def _name(column: _Column, place: int = 0) -> str:
    """The name that a column has in a runs or weights table; that of a remark is of no other column."""
    name, stem = column.heading.name, column.stem
    if stem == "note":
        known = name == "time_s" or name.casefold().startswith(REMARKS) or DEVIATION.match(name)
        return name if known else f"note {place} {name}"
    if stem == "speed" and not column.unit and not column.heading.tidy:
        raise Unclear(f"its unit too, such as '{name} (rpm)'", column.heading)
    return f"{stem}_{column.unit}" if stem and column.unit else stem or name


def _once(common: Sequence[_Column]) -> bool:
    """Whether no run has two readings of one speed, so that there can be one sensor only."""
    keys = (map(show, column.cells) for column in common if column.stem in ("run", "speed", "repeat"))
    rows = [*zip(*keys, strict=True)]
    return len(set(rows)) == len(rows)
