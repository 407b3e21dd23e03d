"""Runs tables in any layout that people have, brought into the form of such a table, grid to grid.

Two heading rows, units rows, units in cells, vectors in one cell (`6.93 @ 98°`), columns for each sensor, one
file a run, other names. Numbers stay as they are written; what has two readings that differ is asked about.
A table that has its form already stays as it is.
"""

from __future__ import annotations

import csv
import io
import math
import re
import warnings
from collections.abc import Mapping, Sequence
from contextlib import suppress
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING, NamedTuple

from rotorid.base.suggestions import did_you_mean
from rotorid.base.text import listing
from rotorid.files.columns import REMARKS, Source, sheet_source, source_name
from rotorid.files.conventions import PHASES, Conventions, Phase, as_phase
from rotorid.files.excel_workbook import is_workbook, pick_sheet, read_workbook
from rotorid.files.grid import MOST_ABOVE, Cell, Grid, Row, make_grid, show
from rotorid.files.headings import (
    DEVIATION,
    LONGEST,
    MEASURED,
    READING,
    Heading,
    find_header,
    read_headings,
    read_unit,
    readable,
)
from rotorid.files.input_file import STANDARD_INPUT
from rotorid.files.problems import Problems
from rotorid.files.text_file import cells_of_line, decode, parse_text, read_bytes
from rotorid.files.units import UnitError, spelt

if TYPE_CHECKING:
    from rotorid.files.job_models import Columns

NUMBER = r"[+-]?[0-9][0-9.,]*(?:[eE][+-]?[0-9]+)?"
_PLAIN = re.compile(NUMBER)
_WITH_UNIT = re.compile(rf"({NUMBER})\s*([^\s0-9].*)")
_AT = rf"\bat\b(?=\s*{NUMBER}\s*(?:°|º|deg|degrees?)?$)"  # not `10 g at 90° in P1`
_VECTOR = re.compile(rf"({NUMBER}[^@<∠]*?)\s*([@<∠/]|{_AT}|(?<=\s)L(?=[0-9]))\s*({NUMBER}[^@<∠/]*)")
_DECIMAL = re.compile(r"[+-]?[0-9]+(?:\.[0-9]*)?")
_WEIGHT = re.compile("weight|mass|correct", re.IGNORECASE)
_BOTH_UNITS = re.compile(r"(.*?)\s*[/@<∠,;&]?\s*((?:°|deg|rad).*)", re.IGNORECASE)


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


def rows_from_header(rows: Sequence[Row], named: Mapping[str, str], *, weights: bool = False) -> list[Row]:
    """Rows of a sheet with the header of the table in one row; those above it become comments."""
    top = [[show(cell) for cell in cells] for _, cells in rows[: MOST_ABOVE + 1]]
    header = find_header(top, named, weights=weights)
    if header is None:
        return list(rows)
    first, last, names = header
    above = [(n, ("# " + " ".join(filter(None, map(show, cells))).lstrip("# "),)) for n, cells in rows[:last]]
    changed = rows[last] if first == last else (rows[last][0], tuple(names))
    return [*above, changed, *rows[last + 1 :]]


def text_from_header(text: str, named: Mapping[str, str], *, weights: bool = False) -> str:
    """The same of a text table."""
    parts = re.split(r"(\r\n|\n|\r)", text, maxsplit=MOST_ABOVE)
    lines, ends = parts[::2], [*parts[1::2], ""]
    rows: dict[int, tuple[tuple[str, ...], str]] = {}
    for at, line in enumerate(lines):
        plain = line.strip(';,\t" \xa0\ufeff\r\n').casefold()
        if plain and not plain.startswith(("#", "sep=")) and len(line) < LONGEST * LONGEST:
            with suppress(csv.Error):
                rows[at] = cells_of_line(line)
    header = find_header([cells for cells, _ in rows.values()], named, weights=weights)
    if header is None:
        return text
    first, last, names = header
    at = list(rows)[last]
    for k in list(rows)[:last]:
        lines[k] = f"# {lines[k]}"
    if first != last:
        out = io.StringIO()
        csv.writer(out, delimiter=rows[at][1], lineterminator="").writerow(names)
        lines[at] = out.getvalue()
    return "".join(line + end for line, end in zip(lines, ends, strict=True))


def open_table(
    source: Source,
    named: Mapping[str, str],
    problems: Problems,
    *,
    first: bool = False,
    weights: bool = False,
) -> Grid | None:
    """The cells of a runs table, or of a weights table, from its header on."""
    if isinstance(source, Grid):
        return source
    path, sheet = Path(source_name(source)), "weights" if weights else "runs"
    if is_workbook(path):
        sheets = read_workbook(path, problems)
        chosen = None if sheets is None else pick_sheet(path, sheets, sheet, problems, first=first)
        if chosen is None:
            return None
        rows = rows_from_header(chosen[1], named, weights=weights)
        return make_grid(sheet_source(path, chosen[0]), rows, "", problems, may_be_empty=weights)
    data = read_bytes(path, problems)
    text = None if data is None else decode(str(path), data, problems)
    if text is None:
        return None
    shaped = text_from_header(text, named, weights=weights)
    return parse_text(str(path), shaped, problems, may_be_empty=weights)


def files_of_runs(source: object) -> tuple[Path, ...]:
    """The files of a folder with one file a run, in the order of their numbers; none for anything else."""
    if not isinstance(source, (str, Path)) or not Path(source).is_dir():
        return ()
    files = [file for file in Path(source).iterdir() if file.suffix.lower() in (".csv", ".txt", ".xlsx")]
    return tuple(
        sorted(
            files, key=lambda file: [int(p) if p.isdigit() else p for p in re.split("([0-9]+)", file.name)]
        )
    )


def read_runs_grid(
    source: Source, conventions: Conventions, problems: Problems, *, first: bool = False
) -> Grid | None:
    """The cells of a runs table, whatever its form in the file; None and problems.

    Parameters
    ----------
    source
        A file, a folder or a tuple with one file a run, or the cells of a sheet.
    conventions
        What phases mean, how the job says that columns are named, and the speed where no column has it.
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
    grids = [_read_one(file, conventions, problems, first=first) for file in files or (source,)]
    if files:
        for k, (file, grid) in enumerate(zip(files, grids, strict=True)):
            if grid is not None and "run" not in grid.header:
                rows = tuple((number, (file.stem, *cells)) for number, cells in grid.rows)
                taken = tuple((0, *places) for places in grid.taken)
                grids[k] = replace(grid, header=("run", *grid.header), rows=rows, taken=taken)
    known = [grid for grid in grids if grid is not None]
    return known if len(known) == len(grids) else None


def stated_phase(source: Source, columns: Columns | None = None) -> Phase | None:
    """Whether the headings of a runs table say that phases lag or lead; None where none or both are said."""
    named, words = _names_of(columns), set[str]()
    for file in source if isinstance(source, tuple) else files_of_runs(source) or (source,):
        if not isinstance(file, Grid) and not is_workbook(path := Path(source_name(file))):
            data = b"" if str(path) == STANDARD_INPUT else read_bytes(path, Problems()) or b""
            if not re.search(b"lag|lead", data[: LONGEST * LONGEST], re.IGNORECASE):
                continue
        with warnings.catch_warnings():
            warnings.simplefilter("ignore")  # of a file that is read once more
            grid = open_table(file, named, Problems(), first=True)
        units_ = [h.unit for h in read_headings(grid.header, named) if h.stem == "phase"] if grid else []
        words |= {read_unit("phase", unit)[1] for unit in units_ if readable("phase", unit)}
    words -= {""}
    return as_phase(words.pop()) if len(words) == 1 and words <= {*PHASES} else None


def joined(grids: Sequence[Grid], problems: Problems) -> Grid | None:
    """One runs table of several, with the columns of the first, or None and problems."""
    first, rows = grids[0], list(grids[0].rows)
    for grid in grids[1:]:
        if sorted(grid.header) != sorted(first.header):
            expected = f"the columns {listing(first.header, 'and')}, as {first.source} has"
            problems.add(grid.source, grid.header_row, None, listing(grid.header, "and"), expected)
            return None
        places = [grid.header.index(name) for name in first.header]
        rows += [(number, tuple(cells[k] for k in places)) for number, cells in grid.rows]
    if len(grids) == 1:
        return first
    name = listing([grid.source for grid in grids], "and")
    return replace(first, source=name, rows=tuple(rows), named=(), taken=())


def _read_one(source: Source, conventions: Conventions, problems: Problems, *, first: bool) -> Grid | None:
    named = _names_of(conventions.columns)
    grid = open_table(source, named, problems, first=first)
    if grid is None or not _are_there(conventions.columns, grid, problems):
        return None
    try:
        return _as_runs_table(grid, named, conventions)
    except Unclear as reason:
        problems.add(grid.source, reason.row or grid.header_row, reason.column, reason.value, str(reason))
        return None


def _names_of(columns: Columns | None) -> dict[str, str]:
    """Names of a runs table by the names that the job says its file has."""
    stated = {} if columns is None else columns.in_file()
    return {name: columns.written(field) for name, field in stated.items() if columns is not None}


def _are_there(columns: Columns | None, grid: Grid, problems: Problems) -> bool:
    """Whether the file has the columns that the job names; else a problem of the job."""
    there, before = [name for name in grid.header if name], len(problems)
    for name, field in columns.in_file().items() if columns else ():
        if columns and name not in there and columns.written(field) not in there:
            known = f"its columns are {listing(there, 'and')}"
            expected = f"a column of {grid.source}{did_you_mean(name, there)}; {known}"
            columns.complain(problems, field, expected)
    return len(problems) == before


def _as_runs_table(grid: Grid, named: Mapping[str, str], conventions: Conventions) -> Grid:
    headings = read_headings(grid.header, named)
    tidy = [heading for heading in headings if heading.tidy and heading.name not in named]
    if len({heading.stem for heading in tidy}) < len(tidy):
        return grid  # a column of a runs table stands there twice
    for heading in headings:
        if heading.stem.endswith("X"):
            other = "delete the column, or begin its name with note (if it is a probe: with P)"
            raise Unclear(f"readings at the running speed (1X) alone: {other}", heading)
    below = _units_row(grid, headings)
    rows = grid.rows[1:] if below else grid.rows
    plain = not below and all(h in tidy or h.stem == "" or _is_kept(h.name) for h in headings)
    measured = [h.index for h in tidy if h.stem in MEASURED]
    whole = {"run", "speed", "sensor", *READING} <= {h.stem for h in tidy if h.unit or h.stem != "phase"}
    if plain and whole and all(map(_PLAIN.fullmatch, {show(row[k]) for _, row in rows for k in measured})):
        return grid
    columns = [_Column(h, h.stem, h.unit, [cells[h.index] for _, cells in rows]) for h in headings]
    columns = [
        _numbers(part, below.get(part.heading.index), rows, conventions.labels.phase)
        if part.stem in MEASURED
        else part
        for column in columns
        for part in _halves(column, headings, rows)
    ]
    return _assembled(replace(grid, rows=rows), columns, conventions.speed)


def _units_row(grid: Grid, headings: Sequence[Heading]) -> dict[int, tuple[int, str]]:
    """Units in the row below the header, by place; empty where that row holds something else."""
    units: dict[int, tuple[int, str]] = {}
    sure, (row, cells) = False, grid.rows[0] if len(grid.rows) > 1 else (0, ())
    for heading, cell in zip(headings, cells, strict=False):
        text, stem = show(cell).strip("()[] "), heading.stem
        if text in ("", "-") or stem == "note":
            continue
        quantity = "amplitude" if stem in ("", "vector") else stem
        known = quantity in MEASURED and readable(quantity, text)
        if _PLAIN.fullmatch(text) or not (known or stem in MEASURED):
            return {}
        units[heading.index] = (row, text)
        sure = sure or known
    return units if sure else {}


def _halves(column: _Column, headings: Sequence[Heading], rows: Sequence[Row]) -> list[_Column]:
    """A column of vectors as one of amplitudes and one of phases; any other as it is."""
    heading, stem, unit, cells = column
    words = not any(vector_in(cell) or _PLAIN.fullmatch(show(cell)) for cell in cells)
    if words and stem == "" and _WEIGHT.search(heading.name):
        return [column._replace(stem="note")]  # what was mounted
    if stem == "sensor" and len(cells) and all(map(vector_in, cells)):
        heading, stem = replace(heading, stem="", sensor=heading.name), ""
    if stem not in ("", "amplitude", "vector") or not _holds_vectors(heading, headings, cells):
        return [column]
    ordered = stem == "vector" and "vector" not in heading.name.casefold()
    halves: list[tuple[str, str]] = []
    for (row, _), cell in zip(rows, cells, strict=True):
        vector = vector_in(cell)
        if cell != "" and (vector is None or not (vector[2] or ordered)):
            raise Unclear("amplitude and phase, unmistakable as 6.93 @ 98°", heading, row, cell)
        halves.append(("", "") if vector is None else vector[:2])
    both = _BOTH_UNITS.fullmatch(unit)
    units = both.groups() if both else (unit, "")
    return [_Column(heading, READING[k], units[k], [half[k] for half in halves]) for k in (0, 1)]


def _holds_vectors(heading: Heading, headings: Sequence[Heading], cells: Sequence[Cell]) -> bool:
    """Whether a column holds amplitude and phase in one cell."""
    others = [one for one in headings if one.stem in READING and one.index != heading.index]
    paired = any(one.stem == "phase" and one.sensor == heading.sensor for one in others)
    if (heading.stem and paired) or _WEIGHT.search(heading.name):
        return False
    vectors = [vector for cell in cells if (vector := vector_in(cell)) is not None]
    return heading.stem == "vector" or any(sure for *_, sure in vectors) or (bool(vectors) and not others)


def vector_in(cell: Cell) -> tuple[str, str, bool] | None:
    """Size and angle of a cell such as `6.93 um @ 98°`, and whether it can be nothing else."""
    match = _VECTOR.fullmatch(cell) if isinstance(cell, str) and len(cell) <= LONGEST else None
    if match is None:
        return None
    return match[1], match[3], match[2] != "/" or _PLAIN.fullmatch(match[3]) is None


def _unit(column: _Column, text: str, phase: str, row: int | None = None, cell: Cell = "") -> str:
    """The unit that a text means; a direction in it must be that of the job."""
    try:
        unit, direction = read_unit(column.stem, text)
    except UnitError as error:
        raise Unclear(str(error), column.heading, row, cell) from None
    if direction not in ("", phase):
        remedy = 'state phase = "lag" or "lead" in the job, as the instrument shows it, without words here'
        raise Unclear(
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
            raise Unclear(f"{unit}, as in the heading, or nothing", heading, *below)
        unit = unit or under
    out: list[Cell] = []
    first: dict[str, tuple[int, Cell]] = {}
    for (row, _), cell in zip(rows, cells, strict=True):
        match = None if not isinstance(cell, str) or _PLAIN.fullmatch(cell) else _WITH_UNIT.fullmatch(cell)
        own = _unit(column, match[2], phase, row, cell) if match and readable(stem, match[2]) else None
        fits = own is not None and not (unit and own and own != spelt(unit))
        if own and not fits and not heading.tidy:
            raise Unclear(f"a number in {unit}, as the heading of the column says", heading, row, cell)
        out.append(match[1] if match and fits else cell)  # what is left as it is, the table explains
        if cell != "" and not unit:
            first.setdefault(own or "", (row, cell))
    if len(first) > 1:
        (row, cell), (at, other) = list(first.values())[:2]
        expected = f"the same unit in all cells of the column (row {row} has {show(cell)}), or in its heading"
        raise Unclear(expected, heading, at, other)
    unit = unit or next(iter(first), "")
    if stem == "phase" and not unit:
        plain = [text for cell in out if _DECIMAL.fullmatch(text := show(cell).replace(",", "."))]
        if any(abs(float(text)) > math.tau for text in plain):
            unit = "deg"
        elif heading.stem != "phase":
            raise Unclear("the sign of degrees, as in 6.93 @ 98°: phases so small may be radians", heading)
    if stem == "amplitude" and unit == "mm_s" and is_severity(heading.name):
        unit = "mm_s_rms"
    return _Column(heading, stem, unit, out)


def is_severity(name: str) -> bool:
    """Whether a heading says that mm/s alone are rms, as of a vibration severity."""
    return bool(re.search("velocity|severity", name, re.IGNORECASE)) and not re.search("peak|pk", name)


def _by_sensor(columns: Sequence[_Column]) -> dict[str, dict[str, _Column]]:
    """Amplitude and phase of each sensor; the name is empty where a column has the names."""
    sensors: dict[str, dict[str, _Column]] = {"": {}}
    listed = any(column.stem == "sensor" for column in columns)
    for column in columns:
        heading, stem = column.heading, column.stem
        if stem in ("", "note"):
            continue
        sensor = heading.sensor if stem in READING and not (listed and heading.stem in ("", "vector")) else ""
        if sensor and listed:
            words = f"as another column has the sensors: leave {sensor!r} out, or begin the name with note"
            raise Unclear(f"the {stem} alone, {words}", heading)
        other = sensors.setdefault(sensor, {}).setdefault(stem, column)
        if other is not column:
            words = f"and {other.heading.name!r} could be it too: begin the name of one with note"
            raise Unclear(f"one column of the {stem}, {words}", heading)
    common = sensors.pop("")
    if not sensors:
        return {"": common}
    _pair_by_number(sensors)
    loose = [common[stem] for stem in READING if stem in common]
    if len(sensors) == 1 and len(loose) == 1 and len(next(iter(sensors.values()))) == 1:
        [(sensor, own)] = sensors.items()  # one sensor, named in one of its headings
        own |= {column.stem: column for column in loose if column.stem not in own}
        return {sensor: own}
    if loose:
        raise Unclear("a name with that of its sensor, as the other columns have", loose[0].heading)
    for sensor, own in sensors.items():
        if len(own) < len(READING):
            [lacking] = set(READING) - set(own)
            words = f"the {lacking} of this sensor too, in a column such as '{sensor} {lacking}'"
            raise Unclear(words, next(iter(own.values())).heading)
    return sensors


def _pair_by_number(sensors: dict[str, dict[str, _Column]]) -> None:
    """Join `A1 (mm/s)` and `P1 (deg)`, which are no two sensors, as 1."""
    halves = {name: next(iter(own)) for name, own in sensors.items() if len(own) == 1}
    numbers = {name: re.sub(r"^[^\W\d_]{1,3}(?=[0-9]+$)", "", name) for name in halves}
    for number in dict.fromkeys(numbers.values()):
        pair = [name for name in halves if numbers[name] == number]
        if number.isdecimal() and sorted(halves[name] for name in pair) == sorted(READING):
            sensors[number] = {stem: column for name in pair for stem, column in sensors.pop(name).items()}


def _name(column: _Column) -> str:
    """The name that a column has in a runs table."""
    if column.stem not in MEASURED:
        return column.stem if column.stem not in ("", "note") else column.heading.name
    if not column.unit and column.stem != "amplitude" and not column.heading.tidy:
        usual = "rpm" if column.stem == "speed" else "deg"
        raise Unclear(f"its unit too, such as '{column.heading.name} ({usual})'", column.heading)
    return f"{column.stem}_{column.unit}" if column.unit else column.stem


def _assembled(grid: Grid, columns: Sequence[_Column], speed: tuple[str, float] | None) -> Grid:
    """A runs table of these columns: one row for each row of the file and sensor with columns of its own."""
    common = [column for column in columns if column.stem not in READING]
    common = [c._replace(heading=replace(c.heading, name=_remark(c, k))) for k, c in enumerate(common)]
    stems = {column.stem for column in common}
    sensors = {
        name: [own[stem] for stem in READING if stem in own] for name, own in _by_sensor(columns).items()
    }
    if "speed" not in stems and speed is not None:
        heading = Heading(0, grid.header[0])
        common.append(_Column(replace(heading, tidy=True), "speed", speed[0], [speed[1]] * len(grid.rows)))
    if "" in sensors and "sensor" not in stems and len(sensors[""]) == len(READING) and _once(common):
        sensors = {"1": sensors[""]}
    wide, first = "" not in sensors, next(iter(sensors.values()))
    names = [*map(_name, first)]
    for own in sensors.values():
        for column, name in zip(own, names, strict=True):
            if _name(column) != name:
                raise Unclear(f"the unit of all sensors, {name}", column.heading)
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


def _remark(column: _Column, k: int) -> str:
    """A name for a column that stays as it is; remarks have names that no column of a table has."""
    name = column.heading.name
    return f"note {k} {name}" if column.stem == "note" and not _is_kept(name) else name


def _is_kept(name: str) -> bool:
    """Whether the reader of a runs table knows the name of a column without a reading."""
    return name == "time_s" or name.casefold().startswith(REMARKS) or bool(DEVIATION.match(name))


def _once(common: Sequence[_Column]) -> bool:
    """Whether no run has two readings of one speed, so that there can be one sensor only."""
    keys = [column.cells for column in common if column.stem in ("run", "speed", "repeat")]
    rows = [tuple(map(show, row)) for row in zip(*keys, strict=True)]
    return len(set(rows)) == len(rows)
