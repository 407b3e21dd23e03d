"""Columns with names and units: cells become numbers in SI and names, or problems."""

from __future__ import annotations

import math
from collections.abc import Collection, Hashable, Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from functools import lru_cache, partial
from itertools import chain
from pathlib import Path
from typing import Any, SupportsIndex

import numpy as np

from rotorid.base.arrays import BoolArray, FloatArray
from rotorid.base.choices import suggest
from rotorid.base.text import listing
from rotorid.files.cells import (
    SPREADSHEET_ERROR,
    BadCell,
    Cell,
    Finder,
    Grid,
    NotANumber,
    Shown,
    check_size,
    decimal_comma,
    decode,
    header_place,
    make_grid,
    parse_number,
    parse_text,
    show,
    thousands_or_decimals,
)
from rotorid.files.disk import file_content, is_workbook
from rotorid.files.input_problems import Problems
from rotorid.files.units import Unit, UnitError, UnitReader

REMARKS = ("note", "comment")
TOP = 10_000
"""Bytes of a file in which its headings stand."""
LATEST = 10_000
"""Cells of a column whose values are kept: a long one says most of its numbers again."""
_SURE = 15
"""A float shows so many digits truly; more, as in 0.30000000000000004, are those of a computation."""
TEXT, UNCLEAR = Unit("", "text"), Unit("?", "unclear")
"""Of a column of names, and of one whose unit is none."""
OUTWARDS = "a finite number, 0 or more; what pushes outwards, or drives, is a [[seal]], not a [[bearing]]"
FULL_TURN = 2.0 * np.pi * (1.0 + 1e-12)
Source = str | Path | Grid | tuple[Path, ...]
"""A table: a file, the cells of a sheet, or files: of runs with one run each, of weights that add."""


@dataclass(frozen=True)
class Column:
    """A column that a table may have.

    Attributes
    ----------
    stem
        The name without its unit.
    unit
        Reads the unit's name; None for a column of text.
    examples
        Full names for messages, the usual one first.
    required
        Whether the table is unusable without it.
    blank
        Whether a cell may be empty: NaN or `""` then, and the reader of the table decides.
    lenient
        Whether the reader of the table decides about every cell that cannot be read.
    """

    stem: str
    unit: UnitReader | None = None
    examples: tuple[str, ...] = ()
    required: bool = True
    blank: bool = False
    lenient: bool = False

    @property
    def names(self) -> tuple[str, ...]:
        """Names for messages and suggestions."""
        return self.examples or (self.stem,)


@dataclass(frozen=True, eq=False)
class Field:
    """A column that a table has: its name and unit there, and its values (NaN or `""` where unusable).

    `names` has the column of the file that each cell is from.
    """

    name: str
    unit: Unit
    cells: Any
    values: Any
    names: tuple[str, ...]


@dataclass(frozen=True, eq=False)
class Table:
    """A table with meaning, that still knows where everything stood.

    Attributes
    ----------
    grid
        Its cells, and where they are from.
    rows
        Row numbers in the file.
    fields
        By stem of the column's name.
    problems
        Collects the complaints.
    misspelt
        Stems that unknown columns were probably meant to have; they have been reported, with that suggestion.
    """

    grid: Grid
    rows: tuple[int, ...]
    fields: Mapping[str, Field]
    problems: Problems
    misspelt: frozenset[str]

    def __len__(self) -> int:
        return len(self.rows)

    def __contains__(self, stem: str) -> bool:
        return stem in self.fields

    def numbers(self, stem: str, missing: float = math.nan) -> FloatArray:
        """Values in SI, shape (rows,); `missing` everywhere if the table has no such column."""
        return self.fields[stem].values if stem in self else np.full(len(self), missing)

    def steps(self, stem: str) -> FloatArray:
        """Steps in SI in which the numbers of a column without problems are written, shape (rows,).

        98 is written in 1, 0.3 in 0.1, 1.2e-3 in 1e-4. Spreadsheets drop zeros at the end: beside 12.75 a
        cell with 13 means 13.00. With D the most decimals and m the most significant digits of any number of
        the column, a number whose first digit stands at 10^e and that has d decimals counts as written with
        max(d, min(D, m − 1 − e)) of them, 0 with D. So columns with a fixed number of decimals and columns
        with a fixed number of significant digits both come out right as soon as one number shows all its
        digits, and a step is never smaller than that of the instrument. Zeros at the end of whole numbers are
        not counted as significant. A number with more than 15 digits comes from a computation, and counts as
        it is to 12. Cells of a workbook have the digits that their format shows, or as many as they need.
        """
        cells = self.fields[stem].cells
        texts = ((cell.text if isinstance(cell, Shown) else show(cell)).replace(",", ".") for cell in cells)
        digits = np.fromiter(chain.from_iterable(map(_digits, texts)), int)
        decimals, significant, first = digits.reshape(-1, 3).T
        most = decimals.max(initial=-99)
        fixed = np.minimum(most, significant.max(initial=0) - 1 - first)
        written = np.where(significant > 0, np.maximum(decimals, fixed), most)
        return np.asarray(10.0**-written * self.unit(stem).to_si(1.0))

    def texts(self, stem: str) -> tuple[str, ...]:
        """Values of a text column; blanks if the table has no such column."""
        return tuple(self.fields[stem].values) if stem in self else ("",) * len(self)

    def unit(self, stem: str) -> Unit:
        """The unit of a column."""
        return self.fields[stem].unit

    def shown(self, stem: str, index: SupportsIndex) -> str:
        """A cell as it stood in the file."""
        return show(self.fields[stem].cells[index])

    def is_blank(self, stem: str) -> BoolArray:
        """Which cells of a column are empty, shape (rows,); none if the table has no such column."""
        cells = self.fields[stem].cells if stem in self else self.rows
        return np.fromiter((cell == "" for cell in cells), bool)

    def complain(self, index: SupportsIndex, stem: str, expected: str) -> None:
        """Note a problem with one cell."""
        name = self.fields[stem].names[index]
        self.problems.add(expected, self.grid.source, self.rows[index], name, self.shown(stem, index))

    def complain_where(self, wrong: BoolArray, stem: str, expected: str) -> None:
        """Note a problem with each of these cells; a comparison is false of NaN, which has been reported."""
        for index in np.flatnonzero(wrong):
            self.complain(index, stem, expected)

    def in_header(self, column: str | None, expected: str) -> None:
        """Note a problem with the header: a column that it lacks, or has too much."""
        self.as_whole(column, expected, self.grid.header_row)

    def as_whole(self, column: str | None, expected: str, row: int | None = None) -> None:
        """Note a problem of no single row with a column, by its stem or any other name."""
        field = self.fields.get(column or "")
        self.problems.add(expected, self.grid.source, row, field.name if field else column)

    def only(self, stems: Sequence[str], usual: str, expected: str) -> str:
        """The one column that there is of several (`usual`: the name of one); else raises all problems."""
        present = [stem for stem in stems if stem in self]
        if len(present) != 1:
            if present or self.misspelt.isdisjoint(stems):
                self.in_header(present[1] if present else usual, expected)
            self.problems.stop()
        return present[0]

    def once(self, stem: str, values: Iterable[Hashable], expected: str) -> None:
        """Complain about each row of a value that stood before; `expected` has {} for the row of the first.

        Values None and "" do not count.
        """
        for index, first in repeated(values):
            self.complain(index, stem, expected.format(self.rows[first]))


def repeated(values: Iterable[Hashable]) -> Iterator[tuple[int, int]]:
    """Where a value stands again, and where it stood first; None and "" do not count."""
    first: dict[Hashable, int] = {}
    for index, value in enumerate(values):
        if value not in (None, "") and first.setdefault(value, index) != index:
            yield index, first[value]


def read_table(
    source: Source,
    sheet: str,
    columns: Sequence[Column],
    problems: Problems,
) -> Table:
    """Read a table from a text file or a workbook.

    Parameters
    ----------
    source
        A file, of which `.xlsx` is a workbook and everything else text, or the cells of a sheet.
    sheet
        Name of the sheet in a workbook; where none has it, the first one is read.
    columns
        What the table may contain; every other column is a problem.
    problems
        Collects the complaints.

    Returns
    -------
    Table
        Unusable cells hold NaN or `""`.

    Raises
    ------
    InputError
        Where not even the columns are clear.
    """
    grid = read_grid(source, sheet, problems, first=True)
    return problems.need(make_table(grid, columns, problems))


def read_grid(
    source: Source,
    sheet: str,
    problems: Problems,
    *,
    first: bool = False,
    may_be_empty: bool = False,
    find: Finder | None = None,
    top: bool = False,
) -> Grid:
    """The cells of a text file or of a sheet: those from the header on that `find` finds, or only the top.

    Raises
    ------
    InputError
        Where there is nothing to read; other problems are collected.
    """
    if isinstance(source, Grid):
        return source
    path = Path(str(source))
    if is_workbook(path):
        from rotorid.files.excel_workbook import pick_sheet, read_workbook

        title, rows = pick_sheet(path, read_workbook(path, problems), sheet, first=first)
        name, place = f"{path} (sheet {title!r})", header_place(rows, find)
        return make_grid(name, rows, "", problems, place=place, may_be_empty=may_be_empty)
    text = decode(str(path), file_content(path)[: TOP if top else None])
    return parse_text(str(path), text, problems, may_be_empty=may_be_empty, find=find)


def source_name(source: Source) -> str:
    """How messages name a table."""
    if isinstance(source, tuple):
        return listing(map(str, source), "and")
    return source.source if isinstance(source, Grid) else str(source)


def make_table(grid: Grid, columns: Sequence[Column], problems: Problems) -> Table | None:
    """Give the columns of a grid their meaning; every complaint goes to `problems`."""
    names = {
        k: name for k, name in enumerate(grid.header) if name and not name.casefold().startswith(REMARKS)
    }
    meant = {k: column_of(name, columns) for k, name in names.items()}
    usual = [example for column in columns for example in column.names]
    near = {k: suggest(names[k], usual) for k, column in meant.items() if column is None}
    misspelt = frozenset(one.stem for name in near.values() if name and (one := column_of(name, columns)))
    stems = misspelt.union(column.stem for column in meant.values() if column is not None)
    missing = [column for column in columns if column.required and column.stem not in stems]
    unknown = [names[k] for k, name in near.items() if name is None]
    strange = missing or unknown or not stems
    if strange and not _has_columns(grid, columns, stems, missing, unknown, problems):
        return None
    places: dict[str, tuple[int, Unit, Column]] = {}
    for k, column in meant.items():
        wrong = ""
        if column is None:
            wrong = f"a known column (did you mean {near[k]!r}?)" if near[k] else ""
        elif column.stem in places:
            wrong = f"the column once, not also {grid.header[places[column.stem][0]]}"
        else:
            try:
                unit = column.unit(names[k][len(column.stem) + 1 :]) if column.unit else TEXT
            except UnitError as error:
                wrong, unit = str(error), UNCLEAR
            places[column.stem] = k, unit, column
        if wrong:
            name = grid.named[0][k] if grid.named else names[k]
            problems.add(wrong, grid.source, grid.header_row, name, name)
    of_numbers = [k for k, unit, _ in places.values() if unit is not TEXT]
    commas = (cell for k in of_numbers for cell in grid.columns[k] if isinstance(cell, str))
    comma = decimal_comma(commas, grid.separator)
    fields = {stem: _field(grid, *place, problems, comma=comma) for stem, place in places.items()}
    if any(column.required and column.stem not in places for column in columns):
        return None
    return Table(grid, grid.numbers, fields, problems, misspelt)


def column_of(name: str, columns: Sequence[Column]) -> Column | None:
    """The column that a heading names."""
    fitting = [
        column
        for column in columns
        if name == column.stem or (column.unit is not None and name.startswith(f"{column.stem}_"))
    ]
    return max(fitting, key=lambda column: len(column.stem), default=None)


def _has_columns(
    grid: Grid,
    columns: Sequence[Column],
    stems: Collection[str],
    missing: Sequence[Column],
    unknown: Sequence[str],
    problems: Problems,
) -> bool:
    """Whether it may be a table of this kind; at most one problem of unknown and missing columns."""
    possible = listing([example for column in columns for example in column.names], "and")
    there = [*dict.fromkeys(name for row in grid.named or (grid.header,) for name in row if name)]
    present, others, alone = listing(there, "and"), listing(unknown, "and"), len(unknown) == 1
    place = grid.source, grid.header_row
    if not stems or (len(missing) > 1 and unknown) or len(unknown) > max(2, len(stems)):
        names = f"; there are {present}" if stems else ""  # else it may be no table, but a secret
        expected = f"a header row with the names of columns, separated by , or ; or tabs: {possible}{names}"
        # that rows are longer than a title is no news
        problems[:] = [problem for problem in problems if problem.file != grid.source]
        problems.add(expected, *place, unknown[0] if stems else None)
        return False
    if missing and all(problem.file != grid.source for problem in problems):
        needed = listing([one.names[0] for one in missing], "and")
        what = f"columns {needed}" if len(missing) > 1 else f"a column {listing(missing[0].names)}"
        expected = f"{what}; the columns are {present}"
        problems.add(expected, *place, missing[0].names[0], others or None)
    elif unknown and not missing:
        expected = f"{'a known column' if alone else 'known columns'}: {possible}; remarks go into 'note'"
        problems.add(expected, *place, others if alone else None, others)
    return True


def _field(grid: Grid, index: int, unit: Unit, column: Column, problems: Problems, *, comma: bool) -> Field:
    cells, header = grid.columns[index], grid.header[index]
    names = tuple(row[index] for row in grid.named) or (header,) * len(grid.numbers)
    doubtful = set()
    if unit is not TEXT and not comma and grid.separator in (";", "\t"):
        doubtful = thousands_or_decimals((c for c in cells if isinstance(c, str)), header)
    value = lru_cache(LATEST)(partial(_value, unit, grid.separator, doubtful, comma))
    values = list[Any]()
    for place, cell in enumerate(cells):
        one = "" if unit is TEXT else math.nan
        try:
            if cell != "" or not column.blank:
                one = value(cell)
        except NotANumber as error:
            if not column.lenient:
                problems.add(str(error), grid.source, grid.numbers[place], names[place], show(cell))
        values.append(one)
    name = names[0] if len(set(names)) == 1 else header
    return Field(name, unit, cells, values if unit is TEXT else np.array(values, dtype=float), names)


def _value(unit: Unit, separator: str, doubtful: set[str], comma: bool, cell: Cell) -> str | float:
    """A name, or a number in SI; NotANumber says what is expected."""
    if isinstance(cell, BadCell):
        raise NotANumber(cell.expected)
    if unit is TEXT:
        text = show(cell)
        if not text:
            raise NotANumber("a name")
        if (
            text[0] in "=@"
            or not text.isprintable()
            or SPREADSHEET_ERROR.fullmatch(text)
            or not text.strip("#")
        ):
            raise NotANumber(
                "a name, not an error of the spreadsheet, hidden characters or a formula, with = or @ first"
            )
        return text
    if cell in doubtful:
        raise NotANumber(
            "a number whose point is surely no thousands separator: 1350 or, with decimal commas "
            "in the whole file, 1,350"
        )
    written = parse_number(cell, comma=comma, separator=separator) if isinstance(cell, str) else float(cell)
    check_size(written)
    value = math.nan if unit is UNCLEAR else unit.to_si(written)
    if unit.kind == "angle" and abs(value) > FULL_TURN:
        raise NotANumber("an angle from -360 to 360 degrees")
    return value


@lru_cache(LATEST)
def _digits(text: str) -> tuple[int, int, int]:
    """Decimals, significant digits (none of 0), and at which power of ten the first one stands."""
    mantissa, _, exponent = text.lower().partition("e")
    whole, _, fraction = mantissa.partition(".")
    digits, decimals = (whole + fraction).lstrip("+-0"), len(fraction) - int(exponent or 0)
    if float(text) == 0:  # also 1e-999
        return len(fraction), 0, 0
    if len(digits) > _SURE:
        return _digits(f"{float(text):.12g}")
    return decimals, len(digits if decimals > 0 else digits.rstrip("0")), len(digits) - 1 - decimals
