"""A file as cells: what text files and workbooks have in common before columns get a meaning."""

from __future__ import annotations

import re
import unicodedata
from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass

from rotorid.base.text import counted
from rotorid.files.problems import Problems

LOOKED_AT = 10
"""A header that is not the first row stands among so many."""

MOST_ABOVE = 60
"""A header that is known by its columns stands among so many."""

MOST_CELLS = 5_000_000
"""Of a file."""

_SPREADSHEET_ERROR = re.compile(r"#(?:N/A|N/D|NV|Н/Д|[A-ZА-Я]+(?:/0)?[!?])")
"""#N/A, #DIV/0!, #ИМЯ?"""
_VERSION = re.compile(r"schema_version\s*=\s*(\d{1,9})")
_SPACES = dict.fromkeys(map(ord, "\u00a0\u202f\u2007\u2009"), " ") | {0xFEFF: None}


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


class CommentLine(str):
    """A line of a text file that is a comment."""

    __slots__ = ()


Cell = str | int | float | BadCell
Row = tuple[int, tuple[Cell, ...]]
Finder = Callable[[Sequence[Sequence[str]]], tuple[int, int, Sequence[str]] | None]
"""Finds where a header surely stands: its first and last row among some, and its names; None: nowhere."""


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
    rows
        Row number and cells, each as long as the header.
    separator
        Between the columns of a text file; empty for a sheet.
    comments
        Comment lines without `#`.
    complete
        False where a line could not be split into cells, so that nothing can be said about missing rows.
    first_rows
        The first rows as they stood, the header among them, to find a header that is not the first row.
    named
        Where the columns are not those of the file: the name of the column there of each cell of each row.
    """

    source: str
    header_row: int
    header: tuple[str, ...]
    rows: tuple[Row, ...]
    separator: str = ""
    comments: tuple[str, ...] = ()
    complete: bool = True
    first_rows: tuple[Row, ...] = ()
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


def is_comment(cells: tuple[Cell, ...], *, in_sheet: bool, below_header: bool) -> bool:
    """Whether a row is a comment; below the header of a sheet one stands alone in its row.

    A row of a text file is one if its reader has found so: labels such as "#12 coupling" begin with `#`, too.
    """
    first = cells[0] if cells else ""
    if not in_sheet or not isinstance(first, str):
        return isinstance(first, CommentLine)
    return begins_comment(first) and not (below_header and any(cell != "" for cell in cells[1:]))


def begins_comment(text: str) -> bool:
    """Whether text begins with `#`, not with an error of a spreadsheet."""
    return text.startswith("#") and not is_spreadsheet_error(re.split("[,;\t]", text)[0].strip())


def is_spreadsheet_error(cell: str) -> bool:
    """Whether a cell holds what a spreadsheet shows for an error, in English or another language."""
    return _SPREADSHEET_ERROR.fullmatch(cell) is not None


def below_title(rows: Sequence[Row], find: Finder) -> list[Row]:
    """Rows with the header in one row, where that is found; those above it become comments."""
    header = find([[show(cell) for cell in cells] for _, cells in rows[: MOST_ABOVE + 1]])
    if header is None:
        return list(rows)
    first, last, names = header
    above = [(n, (f"# {' '.join(filter(None, map(show, cells))).lstrip('# ')}",)) for n, cells in rows[:last]]
    changed = rows[last] if first == last else (rows[last][0], tuple(names))
    return [*above, changed, *rows[last + 1 :]]


def make_grid(
    source: str,
    rows: Iterable[Row],
    separator: str,
    problems: Problems,
    *,
    complete: bool = True,
    may_be_empty: bool = False,
) -> Grid | None:
    """Find the header, drop comments, blank lines and empty trailing columns; complain about the rest.

    Parameters
    ----------
    source, rows, separator, complete
        As in `Grid`.
    problems
        Collects the complaints.
    may_be_empty
        Whether a header without rows says something (a weights table: nothing was mounted).

    Returns
    -------
    Grid or None
        None if there is nothing to read; the problems say why.
    """
    comments: list[str] = []
    filled: list[Row] = []
    for number, cells in rows:
        if is_comment(cells, in_sheet=not separator, below_header=bool(filled)):
            comments.append(_comment(cells, separator))
        elif not all(cell == "" for cell in cells):
            filled.append((number, cells))
    for version in filter(None, map(_VERSION.fullmatch, comments)):
        problems.refuse_newer(source, int(version[1]))
    if not filled:
        if complete:
            problems.add(source, None, None, None, "a table with a header row; the file is empty")
        return None
    header_row, names = filled[0]
    header = [show(cell) for cell in names]
    while header and not header[-1]:
        header.pop()
    body = [_fit(source, header, row, separator, problems) for row in filled[1:]]
    if not body and not may_be_empty:
        if complete:
            problems.add(source, header_row, None, None, "rows below the header; there are none")
        return None
    _complain_about_nameless(source, header_row, header, body, problems)
    top = tuple(filled[:LOOKED_AT])
    return Grid(source, header_row, tuple(header), tuple(body), separator, tuple(comments), complete, top)


def _comment(cells: tuple[Cell, ...], separator: str) -> str:
    shown = [show(cell) for cell in cells]
    while len(shown) > 1 and not shown[-1]:
        shown.pop()
    return (separator or " ").join(shown).lstrip("# ").rstrip(" ;,\t")


def _fit(source: str, header: list[str], row: Row, separator: str, problems: Problems) -> Row:
    """Bring a row to the header's width; a spreadsheet may leave blanks out at the end, or add some."""
    number, cells = row
    width = len(header)
    if len(cells) == width:
        return row
    if any(show(cell) for cell in cells[width:]):
        hint = "; numbers with a decimal comma need ; between the columns" if separator == "," else ""
        found = len(cells)
        while not show(cells[found - 1]):
            found -= 1
        if show(cells[0]).startswith("#"):
            hint = f"; a comment below the header is a line that begins with # and has no {separator} in it"
        problems.add(
            source,
            number,
            None,
            counted(found, "cell"),
            f"{counted(width, 'cell')}, as in the header{hint}",
        )
    return number, (cells + ("",) * width)[:width]


def _complain_about_nameless(
    source: str, header_row: int, header: list[str], body: list[Row], problems: Problems
) -> None:
    for index, name in enumerate(header):
        if name:
            continue
        for number, cells in body:
            if show(cells[index]):
                expected = f"a name for column {index + 1} in the header (row {header_row}), or no value"
                problems.add(source, number, None, show(cells[index]), expected)
