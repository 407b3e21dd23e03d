"""A file as rows of cells, of text and workbooks alike, and the numbers in them; columns have no meaning yet.

Text is read as people and spreadsheets write it: any encoding, separator and decimal sign; a line at a time.
Numbers are read strictly: what is not plainly a number is refused with the reason.
"""

from __future__ import annotations

import csv
import math
import re
import unicodedata
import warnings
from collections.abc import Callable, Iterable, Iterator, Sequence
from contextlib import suppress
from dataclasses import dataclass
from itertools import islice
from typing import Any

from rotorid.files.input_problems import Problems, TableWarning, refusal

MOST_ABOVE = 60
"""Rows among which a header stands that is known by its columns."""
LONGEST_LINE = 10_000
"""Of a header that is not the first line."""
BLOCK = 64
"""Rows whose cells of a column are kept together."""
MOST_CELLS = 5_000_000
"""Of a file."""
SMALLEST, LARGEST = 1e-30, 1e30
"""Sizes outside occur in no table of this project, but squares of them overflow."""
LARGEST_STATED = 1e12
"""Of an option."""
SEP_LINE = re.compile(r'"?sep=(.)"?[;,\t]*', re.IGNORECASE | re.DOTALL)
SPREADSHEET_ERROR = re.compile(r"#(?:N/A|N/D|NV|Н/Д|[A-ZА-Я]+(?:/0)?[!?])\s*(?:[,;\t].*)?", re.DOTALL)
"""#N/A, #DIV/0!, #ИМЯ?, alone or at the beginning of a line."""
_AROUND = '#"; ,\t'
"""Around the text of a comment."""
_VERSION = re.compile(r"schema_version\s*=\s*(\d{1,9})")
_SPACES = dict.fromkeys(map(ord, "\u00a0\u202f\u2007\u2009"), " ") | {0xFEFF: None}
_WORD = re.compile(rb"[A-Za-z\xa8\xb8\xc0-\xff]+")
_CONTROL = re.compile(r"[\x00-\x08\x0b\x0e-\x1f\x7f-\x84\x86-\x9f\ufffe\uffff]")
_MARKS = {b"\xff\xfe": "utf-16-le", b"\xfe\xff": "utf-16-be", b"\xef\xbb\xbf": "utf-8"}
_OTHERS = {
    b"PK\x03\x04": "a text file; this is a workbook or an archive: name it .xlsx, or save it as CSV",
    b"\xd0\xcf\x11\xe0": "a text file or .xlsx; this is an old workbook (.xls): save it as .xlsx or CSV",
    b"": "a text file (CSV) or a workbook (.xlsx); this one is neither",
}
_POINT = re.compile(r"[+-]?(?:[0-9]+(?:\.[0-9]*)?|\.[0-9]+)(?:[eE][+-]?[0-9]+)?")
_COMMA = re.compile(r"[+-]?(?:[0-9]+,[0-9]*|,[0-9]+)(?:[eE][+-]?[0-9]+)?")
_POINT_THOUSANDS = re.compile(r"[+-]?[1-9][0-9]{0,2}(?:\.[0-9]{3})+")
_MAYBE_THOUSANDS = re.compile(r"[+-]?[1-9][0-9]{0,2},[0-9]{3}")
_REASONS = {
    r"(?i:[+-]?(?:nan|inf|infinity|ind|1\.#(?:qnan|inf|ind)))": "a finite number",
    r"[+-]?[0-9]{1,3}(?:[ ,.'’][0-9]{3})+(?:[.,][0-9]*)?": "a number without thousands separators",
    r".*[\u2212\u2013].*": "a number with the minus sign written as -",
    r"[+-]?[0-9][0-9.,]*(?:[eE][+-]?[0-9]+)?\s*(?:[^\W\d_]|[°%µμ]).*": (
        "a number alone; write the unit in the header"
    ),
    r"(?s:.*)": "a number",
}
"""What is expected instead of a text of this pattern."""
_NO_COMMA = {
    ",": (
        "a number with a decimal point: in a comma-separated file a comma is not a decimal sign "
        "(separate by ;)"
    ),
    "\t": "a number with a decimal point: this comma may separate thousands (or separate columns by ;)",
    "": "a number; the cell holds text, whose comma may separate thousands",
}
"""Why a comma is no decimal sign, by what separates the columns."""


@dataclass(frozen=True)
class BadCell:
    """A cell of a workbook that holds neither text nor a number."""

    value: str
    expected: str


class Shown(float):
    """A number of a workbook with the digits that its format shows, such as 12.50."""

    text: str

    def __new__(cls, value: float, text: str) -> Shown:
        """The number of this text."""
        self = super().__new__(cls, value)
        self.text = text
        return self


Cell = str | int | float | BadCell
Row = tuple[int, tuple[Cell, ...]]
Finder = Callable[[Sequence[Sequence[str]]], tuple[int, int, Sequence[str]] | None]
"""Finds where a header surely stands: its first and last row among some, and its names; None: nowhere."""


class Cells:
    """Cells of a column of a text file, `BLOCK` of them as one text: alone each takes five times as much."""

    def __init__(self, cells: Sequence[str]) -> None:
        self.blocks = ["\0".join(cells[k : k + BLOCK]) for k in range(0, len(cells), BLOCK)]

    def __getitem__(self, index: int) -> str:
        return self.blocks[index // BLOCK].split("\0")[index % BLOCK]

    def __iter__(self) -> Iterator[str]:
        return (cell for block in self.blocks for cell in block.split("\0"))


@dataclass(frozen=True)
class Grid:
    """A header and rows of cells.

    Attributes
    ----------
    source
        The file, and the sheet of a workbook, for messages.
    header_row
        Row number of the header.
    header
        Names, `""` where a column has none (and then no cell either).
    numbers
        Row numbers.
    columns
        Cells of each column of the header: tuples, or `Cells`.
    separator
        Between the columns of a text file; empty for a sheet.
    complete
        False where a line could not be split into cells, so that nothing can be said about missing rows.
    named
        Where the columns are not those of the file: the name of the column there of each cell of each row.
    """

    source: str
    header_row: int
    header: tuple[str, ...]
    numbers: tuple[int, ...]
    columns: Sequence[Any]
    separator: str = ""
    complete: bool = True
    named: tuple[tuple[str, ...], ...] = ()


def clean(text: str) -> str:
    """Text without what spreadsheets leave around it: blanks of all kinds, byte-order marks."""
    if text.isascii():
        return text.strip()
    return unicodedata.normalize("NFC", text.translate(_SPACES).strip())


def show(cell: Cell) -> str:
    """A cell as text: 1.0 of a workbook is 1."""
    if isinstance(cell, str):
        return cell
    if isinstance(cell, float) and cell.is_integer() and abs(cell) < 1e15:
        return str(int(cell))
    return cell.value if isinstance(cell, BadCell) else repr(cell)


def is_comment(line: str) -> bool:
    """Whether a line, or the first cell of a row, begins as a comment and is no error of a spreadsheet."""
    return line.startswith("#") and not SPREADSHEET_ERROR.fullmatch(line)


def decode(source: str, data: bytes) -> str:
    """Text of a file in any encoding that Excel writes; InputError for other files.

    An encoding that had to be guessed (cp1251, cp1252) is named in a `TableWarning`.
    """
    marked = [name for mark, name in _MARKS.items() if data.startswith(mark)]
    for encoding in marked or ("utf-8", "cp"):
        if encoding == "cp":
            # Cyrillic words consist of letters above 127 only; western ones have them among ASCII letters
            words = _WORD.findall(data)
            whole = sum(len(word) > 1 and min(word) > 127 for word in words)
            encoding = "cp1251" if whole > sum(min(w) < 128 <= max(w) for w in words) else "cp1252"
        with suppress(UnicodeDecodeError):
            text = data.decode(encoding).removeprefix("\ufeff")
            if not _CONTROL.search(text):
                if encoding.startswith("cp"):
                    message = f"{source}: not UTF-8, read as {encoding}; check the names in it"
                    warnings.warn(message, TableWarning, stacklevel=2)
                return text
    expected = next(words for mark, words in _OTHERS.items() if data.startswith(mark))
    raise refusal(source, expected)


def parse_text(
    source: str, text: str, problems: Problems, *, may_be_empty: bool, find: Finder | None
) -> Grid:
    """Rows of cells of a text table; `may_be_empty` as in `make_grid`.

    With `find`, what stands above the header that it finds is comment.
    """
    lines = re.split(r"\r\n|\n|\r", text)
    # A spreadsheet takes `sep=;` as an instruction and does not show it: rows count from the next.
    declared = SEP_LINE.fullmatch(lines[0].strip(" \ufeff"))
    if declared:
        del lines[0]
        if declared[1] not in ";,\t":
            raise refusal(source, "sep=; or sep=, or a tab", 1, None, f"sep={declared[1]}")
    start, names = header_place(_first_rows(lines), find)
    start = start or len(lines)
    separator = declared[1] if declared else _separator(lines[start - 1])
    if len(lines) + text.count(separator) > MOST_CELLS:
        raise refusal(source, f"a table of at most {MOST_CELLS:,} cells")
    rows, complete = list[Row](), True
    for number, line in enumerate(lines, start=1):
        try:
            comment = number < start or (separator not in line and is_comment(clean(line)))
            # in a comment quotes may stay open
            rows.append((number, (clean(line),) if comment else _cells(line, separator)))
        except csv.Error as error:
            rule = "quotes that are closed on the same line (a cell cannot hold a line break)"
            problems.add(f"{rule}: {error}", source, number)
            complete = False
    return make_grid(
        source,
        rows,
        separator,
        problems,
        place=(start, names),
        complete=complete,
        may_be_empty=may_be_empty,
    )


def _first_rows(lines: Iterable[str]) -> Iterator[Row]:
    """Lines as rows, each by its own separator; one that cannot be a header is one cell."""
    for number, line in enumerate(lines, start=1):
        cells: tuple[str, ...] = (clean(line).lstrip('"')[:1],)
        with suppress(csv.Error):
            if len(line) < LONGEST_LINE:
                cells = _cells(line, _separator(line))
        yield number, cells


def _cells(line: str, separator: str) -> tuple[str, ...]:
    if '"' not in line:  # a line at a time: an open quote must not swallow the rest of the file
        return tuple(map(clean, line.split(separator))) if line else ()
    return tuple(map(clean, next(csv.reader([line], delimiter=separator, strict=True), [])))


def _separator(line: str) -> str:
    """What separates the columns of a header, outside quotes."""
    outside = re.sub(r'"[^"]*"', "", line)
    return next((sign for sign in ("\t", ";", ",") if sign in outside), ",")


def header_place(rows: Iterable[Row], find: Finder | None) -> tuple[int, tuple[str, ...]]:
    """Number of the row with the header, 0 without one, and its names where it has two rows.

    It is the first row that is neither blank nor a comment, unless `find` finds it among the others.
    """
    texts = ((number, [*map(show, cells)]) for number, cells in rows)
    filled = [*islice((row for row in texts if not is_comment(next(filter(None, row[1]), "#"))), MOST_ABOVE)]
    place = find([cells for _, cells in filled]) if find else None
    if place is None:
        return filled[0][0] if filled else 0, ()
    first, last, names = place
    return filled[last][0], () if first == last else tuple(names)


def _without_comments(rows: Iterable[Row], start: int, names: tuple[str, ...]) -> tuple[list[str], list[Row]]:
    """Comments, and the rows that hold something, from the header on, which may have other names.

    Below the header a comment stands alone in its row: labels such as "#12 coupling" begin with `#`, too.
    """
    comments, filled = list[str](), list[Row]()
    for number, cells in rows:
        first = str(cells[0]) if cells else ""
        if number < start or (is_comment(first) and (not filled or len(cells) == 1)):
            comments += filter(None, [" ".join(filter(None, map(show, cells))).strip(_AROUND)])
        elif any(cell != "" for cell in cells):
            filled.append((number, (number == start and names) or cells))
    return comments, filled


def make_grid(
    source: str,
    rows: Iterable[Row],
    separator: str,
    problems: Problems,
    *,
    place: tuple[int, tuple[str, ...]],
    complete: bool = True,
    may_be_empty: bool = False,
) -> Grid:
    """Find the header, drop comments, blank lines and empty trailing columns; complain about the rest.

    Parameters
    ----------
    source, rows, separator, complete
        As in `Grid`; comments stand among the rows.
    problems
        Collects the complaints.
    place
        As `header_place` gives it: what stands above the header is comment.
    may_be_empty
        Whether a header without rows says something (a weights table: nothing was mounted).

    Raises
    ------
    InputError
        If there is nothing to read.
    """
    comments, filled = _without_comments(rows, *place)
    for version in filter(None, map(_VERSION.fullmatch, comments)):
        problems.refuse_newer(source, int(version[1]))
    if len(filled) < (1 if may_be_empty else 2):
        if not complete:
            problems.stop()
        expected = "a table with a header row; the file is empty"
        expected = "rows below the header; there are none" if filled else expected
        raise refusal(source, expected, filled[0][0] if filled else None)
    (header_row, names), *body = filled
    header = [*map(show, names)]
    while not header[-1]:
        header.pop()
    width = len(header)
    if "" in header or any(len(cells) != width for _, cells in body):
        for number, cells in body:
            headings = header + [""] * (len(cells) - width)
            lost = [k for k, cell in enumerate(cells) if cell != "" and not headings[k]]
            if lost:
                expected = f"a name for column {lost[-1] + 1} in the header (row {header_row}), or no value"
                if lost[-1] >= width and separator == ",":
                    expected += (
                        "; numbers with a decimal comma need ; between the columns, comments have no ,"
                    )
                problems.add(expected, source, number, None, show(cells[lost[-1]]))
        body = [(number, (cells + ("",) * width)[:width]) for number, cells in body]
    each = ((number, *cells) for number, cells in body)
    numbers, *columns = zip(*each, strict=True) if body else [()] * (width + 1)
    kept = [Cells(cells) for cells in columns] if separator else columns
    return Grid(source, header_row, tuple(header), numbers, kept, separator, complete)


class NotANumber(ValueError):
    """The message says what was expected instead."""


def decimal_comma(cells: Iterable[str], separator: str) -> bool:
    """Whether the numbers of a file have decimal commas.

    Between semicolons a comma can be nothing else. Between tabs and in a sheet it may also separate
    thousands: there at least one number must show that it does not (1,5 or 1500,000).
    """
    if separator == ",":
        return False
    return any(
        _COMMA.fullmatch(cell) and (separator == ";" or not _MAYBE_THOUSANDS.fullmatch(cell))
        for cell in cells
    )


def thousands_or_decimals(cells: Iterable[str], name: str) -> set[str]:
    """Cells of a column without decimal commas whose points may separate thousands, as in 1.350 beside 720.

    A European spreadsheet writes 1350 so where no number of the column has decimals. The column is doubtful
    if it has whole numbers without a point too, or holds revolutions per minute, and no other decimals.
    """
    filled = {cell for cell in cells if cell}
    doubtful = {cell for cell in filled if _POINT_THOUSANDS.fullmatch(cell)}
    others = filled - doubtful
    whole = any(cell.lstrip("+-").isdecimal() and cell.strip("+-0") for cell in others)
    decimals = any("." in cell for cell in others)
    return doubtful if not decimals and (whole or name.casefold().endswith("_rpm")) else set()


def check_size(value: float, largest: float = LARGEST) -> None:
    """Refuse a number that no instrument shows.

    Raises
    ------
    NotANumber
        For one that is not finite, or not zero and outside 1e-30 … `largest`.
    """
    if not math.isfinite(value):
        raise NotANumber("a finite number")
    if value and not SMALLEST <= abs(value) <= largest:
        raise NotANumber(f"0 or a number between {SMALLEST:g} and {largest:g} in size")


def parse_number(text: str, *, comma: bool = False, separator: str = "") -> float:
    """The number a cell holds.

    Parameters
    ----------
    text
        Without surrounding blanks.
    comma
        Whether the numbers of this file have decimal commas.
    separator
        What separates the columns of the file, for the explanation.

    Raises
    ------
    NotANumber
        For everything that is not plainly a number; nothing is guessed.
    """
    written_with_comma = _COMMA.fullmatch(text) is not None
    if written_with_comma and not comma:
        raise NotANumber(_NO_COMMA.get(separator, _NO_COMMA[""]))
    if not written_with_comma and _POINT.fullmatch(text) is None:
        raise NotANumber(next(reason for form, reason in _REASONS.items() if re.fullmatch(form, text)))
    if comma and "." in text:
        raise NotANumber(
            "a number with a decimal comma, as elsewhere in this file (a point could separate thousands)"
        )
    return float(text.replace(",", "."))
