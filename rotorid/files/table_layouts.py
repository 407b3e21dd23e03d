"""Runs and weights tables in any layout, brought by headings into long rows of one form, and conventions.

A runs table has a row for each run, speed and sensor, a weights table one for each run and plane. Columns for
each sensor or plane, two heading rows, units rows, units in cells, two quantities in one cell (`6.93 @ 98°`)
and one file a run all become that. Numbers stay as they are written; what has two readings is asked about.
"""

from __future__ import annotations

import math
import re
import warnings
from collections import defaultdict
from collections.abc import Mapping, Sequence
from contextlib import suppress
from dataclasses import dataclass, field, replace
from itertools import chain, combinations
from pathlib import Path
from typing import Any, NamedTuple, get_args

from balancing import Labels
from rotorid.base.text import SHORT_ANGLES, Angles, Phase, Rotation, listing
from rotorid.files.cells import Cell, Grid, show
from rotorid.files.columns import REMARKS, Source, read_grid
from rotorid.files.headings import (
    BOTH_UNITS,
    LONGEST,
    MEASURED,
    READING,
    Heading,
    find_header,
    read_headings,
    read_unit,
    readable,
)
from rotorid.files.input_problems import InputError, Problems, refusal
from rotorid.files.units import Quantity, UnitError, spelt

NUMBER = r"[+-]?[0-9][0-9.,]*(?:[eE][+-]?[0-9]+)?"
_PLAIN = re.compile(NUMBER)
_PEAK, _SEVERITY = re.compile("peak|pk", re.IGNORECASE), re.compile("velocity|severity", re.IGNORECASE)
"""Of a heading: mm/s alone are rms where it says severity, and where the job has limits in rms."""
_WITH_UNIT = re.compile(rf"({NUMBER})\s*([^\s0-9].*)")
_AT = rf"\bat\b(?=\s*{NUMBER}\s*(?:°|º|deg|degrees?)?$)"  # not `10 g at 90° in P1`
_VECTOR = re.compile(rf"({NUMBER}[^@<∠]*?)\s*(?:[@<∠/]|{_AT}|(?<=\s)L(?=[0-9]))\s*({NUMBER}[^@<∠/]*)")
_DECIMAL = re.compile(r"[+-]?[0-9]+(?:\.[0-9]*)?")
_BLANK = {"", "n.a.", "n/a", "na", "-", "--", "?", "none"}
"""Cells of a column of phases that nobody knows."""
MOUNTED = "note of weights: "
"""Begins the name of a column of weights, which belong into a weights table."""
_NOTES = (*REMARKS, "amplitude_std", "phase_std")


ROTATIONS: tuple[Rotation, ...] = get_args(Rotation)
DEFAULT_TOLERANCE = 0.5
LARGEST_TOLERANCE = 20.0


@dataclass(frozen=True)
class Conventions:
    """What the numbers of a job's tables mean.

    Attributes
    ----------
    labels
        How phases and angles count and how the rotor turns; the units are those of the tables, once read.
    speed_tolerance_percent
        Speeds of different runs that differ by less count as one.
    unstated
        Which of "phase" and "angles" neither the job nor the caller states.
    exchanged
        Whether amplitudes and phases stand in each other's columns of the runs tables; None: unstated.
    speed
        The only speed, for runs tables without a column of speeds.
    holes
        Angle in degrees, as the job counts, of each hole by its name, for each plane that has holes.
    removed
        Planes in which material is taken away.
    rms
        Whether the job has limits in rms, so that mm/s alone are rms.
    run
        Name of the only run, for tables without a column of runs; empty: they need one.
    """

    labels: Labels = field(default_factory=Labels)
    speed_tolerance_percent: float = DEFAULT_TOLERANCE
    unstated: tuple[str, ...] = ()
    exchanged: bool | None = None
    speed: Quantity | None = None
    holes: Mapping[str, Mapping[str, float]] = field(default_factory=dict)
    removed: frozenset[str] = frozenset()
    rms: bool = False
    run: str = ""


def resolve_angles(stated: Any, rotation: str | None) -> Angles:  # noqa: ANN401  what `Labels` refuses too
    """With or against the rotation, of clockwise and short forms too; `rotation` is seen from the same end.

    None stays None.

    Raises
    ------
    ValueError
        For clockwise or counter-clockwise without a rotation.
    """
    if stated not in ROTATIONS:
        angles: Angles = SHORT_ANGLES.get(stated, stated)
        return angles
    if rotation is None:
        raise ValueError(
            f"angles that count {stated} need the direction of rotation seen from the same end: state "
            'rotation = "clockwise" or "counter-clockwise" in a job file, or angles with or against rotation'
        )
    return "with rotation" if stated == rotation else "against rotation"


class _Column(NamedTuple):
    """A column of a runs or weights table, with its heading in the file; `unit` may be as written there."""

    heading: Heading
    stem: str
    unit: str
    cells: Any

    def name(self, place: int) -> str:
        """The name that it has in such a table; that of a remark is of no other column."""
        name, stem = self.heading.name, self.stem
        if stem == "mounted":
            return f"{MOUNTED}{name}"
        if stem == "note" and name != "time_s" and not name.casefold().startswith(_NOTES):
            return f"note {place} {name}"
        if stem in ("", "note"):
            return name
        return f"{stem}_{self.unit}" if self.unit else stem


def _unclear(grid: Grid, column: _Column, expected: str, cell: Cell | None = None) -> InputError:
    """What has no reading or several: of a heading, or the first cell of a column that is such."""
    row, value = grid.header_row, column.heading.name
    if cell is not None:
        row, value = grid.numbers[[*column.cells].index(cell)], show(cell)
    return refusal(grid.source, expected, row, column.heading.name, value)


def files_of_runs(source: object) -> tuple[Path, ...]:
    """The files of a folder with one file a run, step2 before step10; none for anything else."""
    if not isinstance(source, (str, Path)) or not Path(source).is_dir():
        return ()
    files = [file for file in Path(source).iterdir() if file.suffix.lower() in (".csv", ".txt", ".xlsx")]
    return tuple(sorted(files, key=lambda file: (len(file.stem), file.stem)))


def stated_phase(source: Source) -> Phase | None:
    """Whether the headings of a runs table say that phases lag or lead; None where none or both are said."""
    directions = set[str]()
    for file in source if isinstance(source, tuple) else files_of_runs(source) or (source,):
        with warnings.catch_warnings(), suppress(InputError):
            warnings.simplefilter("ignore")  # of a file that is read once more
            grid = read_grid(file, "runs", Problems(), first=True, find=find_header, top=True)
            phases = [heading.unit for heading in read_headings(grid.header) if heading.stem == "phase"]
            directions |= {read_unit("phase", unit)[1] for unit in phases if readable("phase", unit)}
    return next((phase for phase in get_args(Phase) if directions - {""} == {phase}), None)


def read_runs_grids(
    source: Source, conventions: Conventions, problems: Problems, *, first: bool = False
) -> list[Grid]:
    """The cells of a runs table, whatever its form in the file, of one file a run each; none and problems.

    Parameters
    ----------
    source
        A file, a folder or a tuple with one file a run, which is named as the file where no column names it,
        or the cells of a sheet.
    conventions
        What phases mean, whether columns are exchanged, and the speed where no column has it.
    problems
        Collects the complaints.
    first
        Whether the first sheet of a workbook will do where none is called runs.
    """
    files = source if isinstance(source, tuple) else files_of_runs(source)
    grids = list[Grid]()
    for file in files or (source,):
        run = file.stem if isinstance(file, Path) and files else ""
        try:
            grid = read_grid(file, "runs", problems, first=first, find=find_header)
            grids.append(long_rows(grid, read_headings(grid.header), READING, "sensor", conventions, run))
        except InputError as error:
            problems.extend(error.problems)
    return grids if len(grids) == len(files or (source,)) else []


def without_phases(grids: Sequence[Grid]) -> tuple[Sequence[Grid], list[str]]:
    """Long runs tables without their column of phases, and what to say, where these are no phases.

    All are blank (or n.a.), or all 0 in three runs or more.
    """
    places = [
        next((k for k, name in enumerate(grid.header) if name.startswith("phase")), None) for grid in grids
    ]
    cells, runs = set[str](), set[str]()
    for grid, k in zip(grids, places, strict=True):
        cells |= {show(cell).strip().casefold() for cell in grid.columns[k]} if k is not None else {""}
        runs |= {*map(show, dict(zip(grid.header, grid.columns, strict=True)).get("run", ()))}
    zero = len(runs) > 2 and all(_DECIMAL.fullmatch(cell) and float(cell) == 0 for cell in cells)
    if not (zero or cells <= _BLANK) or all(k is None for k in places):
        return grids, []
    cut = []
    for grid, k in zip(grids, places, strict=True):
        keep = [j for j in range(len(grid.header)) if j != k and not grid.header[j].startswith("phase_std")]
        named = tuple(tuple(names[j] for j in keep) for names in grid.named)
        header, columns = zip(*((grid.header[j], grid.columns[j]) for j in keep), strict=True)
        cut.append(replace(grid, header=header, columns=columns, named=named))
    words = "all phases are 0: they are taken as not known, and the amplitudes alone are used"
    return cut, [words] if zero else []


def joined(grids: Sequence[Grid], problems: Problems) -> list[Grid]:
    """One runs table of several, with the columns of the first, or none and problems."""
    first = grids[0]
    for grid in grids:
        if {*grid.header} != {*first.header}:
            expected = f"the columns {listing(first.header, 'and')}, as {first.source} has"
            problems.add(expected, grid.source, grid.header_row, None, listing(grid.header, "and"))
            return []
    source = listing([grid.source for grid in grids], "and")
    numbers = tuple(chain.from_iterable(grid.numbers for grid in grids))
    columns = [
        [cell for grid in grids for cell in grid.columns[grid.header.index(name)]] for name in first.header
    ]
    return [replace(first, source=source, numbers=numbers, columns=columns, named=())]


def long_rows(
    grid: Grid,
    headings: Sequence[Heading],
    pair: tuple[str, str],
    key: str,
    conventions: Conventions,
    run: str = "",
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
    run
        The only run, where no column has its name.

    Raises
    ------
    InputError
        Where something has no reading, or several.
    """
    columns = [column for h in headings for column in _columns(grid, h, headings, pair, conventions)]
    sensors = _by_name(grid, columns, pair, key)
    common = [column for column in columns if column.stem not in pair]
    stems, n, run = {column.stem for column in common}, len(grid.numbers), run or conventions.run
    if run and "run" not in stems:
        common.insert(0, _Column(Heading(0, "run"), "run", "", [run] * n))
    if key == "sensor" and "speed" not in stems and conventions.speed is not None:
        speed = conventions.speed
        common.append(_Column(Heading(0, grid.header[0]), "speed", speed.unit.name, [speed.value] * n))
    if key == "sensor" and "sensor" not in stems and len(sensors.get("", ())) == 2:
        readings = [
            *zip(*(map(show, c.cells) for c in common if c.stem in ("run", "speed", "repeat")), strict=True)
        ]
        if len({*readings}) == len(readings):  # no run has two readings of one speed
            sensors = {"1": sensors[""]}
    groups = []
    for name, by_stem in sensors.items():
        both = [by_stem[stem] for stem in pair if stem in by_stem]
        named = [_Column(both[0].heading, key, "", [name] * n)] if name else []
        if conventions.exchanged and key == "sensor":
            turned = zip(both, both[::-1], strict=True)
            both = [one._replace(heading=other.heading, cells=other.cells) for one, other in turned]
        groups.append([*common, *named, *both])
    header = [column.name(k) for k, column in enumerate(groups[0])]
    for column, k in ((column, k) for group in groups for k, column in enumerate(group)):
        if column.name(k) != header[k]:
            raise _unclear(grid, column, f"the unit of all {key}s, {header[k]}")
    cells, *more = [[column.cells for column in group] for group in groups]
    if more:
        each = zip(cells, *more, strict=True)
        cells = [[*chain.from_iterable(zip(*parts, strict=True))] for parts in each]
    return replace(
        grid,
        header=tuple(header),
        numbers=tuple(number for number in grid.numbers for _ in groups),
        columns=cells,
        named=tuple(tuple(column.heading.name for column in group) for group in groups) * n,
    )


def _columns(
    grid: Grid, heading: Heading, headings: Sequence[Heading], pair: tuple[str, str], conventions: Conventions
) -> list[_Column]:
    """A column of the file, as one of amplitudes and one of phases where its cells hold both."""
    stem, cells = heading.stem, grid.columns[heading.index]
    column = _Column(heading, stem, heading.unit, cells)
    if stem.endswith("X"):
        other = "delete the column, or begin its name with note (if it is a probe: with P)"
        raise _unclear(grid, column, f"readings at the running speed (1X) alone: {other}")
    maybe = stem in ("vector", pair[0]) or (pair == READING and stem in ("", "sensor"))
    vectors = {cell: vector_in(cell) for cell in dict.fromkeys(cells) if cell != ""} if maybe else {}
    some, every = any(vectors.values()), bool(vectors) and all(vectors.values())
    dates = stem == "" and all(re.fullmatch("[0-9.,/ ]+", str(cell)) for cell in vectors)  # or fractions
    if stem == "sensor" and every:
        heading, stem = replace(heading, stem="", sensor=heading.name), ""
    paired = any(h.stem == pair[1] and h.sensor == heading.sensor for h in headings)
    if stem == "vector" or (some and stem != "sensor" and not paired and not dates):
        for cell in (cell for cell, vector in vectors.items() if vector is None):
            raise _unclear(grid, column, "amplitude and phase, unmistakable as 6.93 @ 98°", cell)
        both = BOTH_UNITS.fullmatch(heading.unit)
        units = both.groups() if both else (heading.unit, "")
        halves = [vectors.get(cell) or ("", "") for cell in cells]
        parts = [_Column(heading, pair[k], units[k], [half[k] for half in halves]) for k in (0, 1)]
        return [_with_unit(grid, part, conventions) for part in parts]
    return [_with_unit(grid, column, conventions) if stem in (*MEASURED, *pair) else column]


def vector_in(cell: Cell) -> tuple[str, str] | None:
    """Size and angle of a cell such as `6.93 um @ 98°`."""
    match = _VECTOR.fullmatch(cell) if isinstance(cell, str) and len(cell) <= LONGEST else None
    return match and (match[1].strip(), match[2])


def _with_unit(grid: Grid, column: _Column, conventions: Conventions) -> _Column:
    """Numbers in one unit, with what may be assumed of one that is not written."""
    unit, cells = _one_unit(grid, column, conventions)
    heading, stem, name = column.heading, column.stem, column.heading.name
    if stem in ("phase", "angle") and not unit:
        texts = (text for cell in cells if _DECIMAL.fullmatch(text := show(cell).replace(",", ".")))
        plain = [abs(float(text)) for text in texts]
        if max(plain, default=0.0) > math.tau or (stem == "angle" and not any(plain)):
            unit = "deg"
        elif stem == "angle" or not heading.tidy:
            example = f"'{stem.capitalize()} (deg)' or 98°"
            raise _unclear(grid, column, f"its unit, as in {example}: {stem}s so small may be radians")
    if stem == "speed" and not unit and not heading.tidy:
        raise _unclear(grid, column, f"its unit too, such as '{name} (rpm)'")
    if unit == "mm_s" and not heading.tidy and (conventions.rms or _SEVERITY.search(name)):
        unit = "mm_s" if _PEAK.search(name) else "mm_s_rms"
    return _Column(heading, stem, unit, cells)


def _one_unit(grid: Grid, column: _Column, conventions: Conventions) -> tuple[str, Sequence[Cell]]:
    """The one unit that the heading states, or every cell; and the cells without it."""
    heading, stem, unit, cells = column
    written: dict[str, Cell | None] = {unit: None} if unit else {}
    numbers = dict[Cell, Cell]()
    for cell in dict.fromkeys(cells) if stem in MEASURED else ():
        match = None if not isinstance(cell, str) or _PLAIN.fullmatch(cell) else _WITH_UNIT.fullmatch(cell)
        if match and readable(stem, match[2]):
            numbers[cell] = match[1]  # what is left as it is, the table explains
            written.setdefault(match[2], cell)
        elif cell != "" and not unit:
            written.setdefault("", cell)
    stated = dict[str, Cell | None]()
    for text, at in written.items():
        name, direction = spelt(text), ""
        if at is not None or not heading.tidy or stem == "mass":
            try:
                name, direction = read_unit(stem, text)
            except UnitError as error:
                raise _unclear(grid, column, str(error), at) from None
        if direction not in ("", conventions.labels.phase):
            words = f"phases that {conventions.labels.phase}, as the job says or is assumed: state phase = "
            words += '"lag" or "lead" in the job, as the instrument shows it, without words here'
            raise _unclear(grid, column, words, at)
        if name or not unit:
            stated.setdefault(name, at)
    if len(stated) > 1:
        (one, first), (_, other) = [*stated.items()][:2]
        place = "the heading" if first is None else f"row {grid.numbers[[*cells].index(first)]}"
        words = f"a number {f'in {one}' if one else 'without a unit'}, as {place} says"
        raise _unclear(grid, column, words, other)
    return next(iter(stated), ""), [numbers.get(cell, cell) for cell in cells] if numbers else cells


def _by_name(
    grid: Grid, columns: Sequence[_Column], pair: tuple[str, str], key: str
) -> dict[str, dict[str, _Column]]:
    """Both columns of each sensor or plane; the name is empty where a column has the names."""
    sensors: dict[str, dict[str, _Column]] = defaultdict(dict)
    listed = any(column.stem == key for column in columns)
    for column in (column for column in columns if column.stem not in ("", "note", "mounted")):
        heading, stem = column.heading, column.stem
        sensor = heading.sensor if stem in pair and not (listed and heading.stem in ("", "vector")) else ""
        if sensor and listed:
            words = f"as another column has the {key}s: leave {sensor!r} out, or begin the name with note"
            raise _unclear(grid, column, f"the {stem} alone, {words}")
        other = sensors[sensor].setdefault(stem, column)
        if other is not column:
            words = f"and {other.heading.name!r} could be it too: begin the name of one with note"
            raise _unclear(grid, column, f"one column of the {stem} for every {key}, {words}")
    loose = {stem: column for stem, column in sensors.pop("", {}).items() if stem in pair}
    if not sensors:
        return {"": loose}
    for names in combinations([*sensors], 2):  # `A1 (mm/s)` and `P1 (deg)` are no two sensors, but 1
        numbers = {re.sub(r"^[^\W\d_]{1,3}(?=[0-9]+$)", "", name) for name in names}
        halves = [sensors[name] for name in names if len(sensors.get(name, {})) == 1]
        if len(numbers) == 1 and len(halves) == 2 and len({**halves[0], **halves[1]}) == 2:
            for name in names:
                del sensors[name]
            sensors[numbers.pop()] = {**halves[0], **halves[1]}
    if len(sensors) == 1 and len(loose) == 1 and not loose.keys() & next(iter(sensors.values())).keys():
        next(iter(sensors.values())).update(loose)  # one sensor, named in one of its headings
        loose = {}
    lone = pair == READING and not any(column.stem == "phase" for column in columns)
    for by_stem in (loose, *sensors.values()):
        if by_stem and (by_stem is loose or len(by_stem) < 2) and not (lone and "amplitude" in by_stem):
            one = next(iter(sensors))
            words = f"in columns such as '{one} {pair[0]}' and '{one} {pair[1]}'"
            raise _unclear(
                grid, next(iter(by_stem.values())), f"{pair[0]} and {pair[1]} of each {key}, {words}"
            )
    return sensors
