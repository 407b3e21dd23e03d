"""A file as rows of cells, of text and workbooks alike, before columns get a meaning.

Text is read as people and spreadsheets write it: any encoding, separator and decimal sign; a line at a time.
"""

from __future__ import annotations

import codecs
import csv
import re
import unicodedata
import warnings
from collections.abc import Callable, Iterable, Sequence
from contextlib import suppress
from dataclasses import dataclass
from pathlib import Path

from rotorid.base.choices import did_you_mean
from rotorid.base.text import counted
from rotorid.files.input_file import file_content
from rotorid.files.problems import Problems, TableWarning

MOST_ABOVE = 60
"""Rows among which a header stands that is known by its columns."""
LONGEST_LINE = 10_000
"""Of a header that is not the first line."""
MOST_CELLS = 5_000_000
"""Of a file."""
SEP_LINE = re.compile(r'"?sep=(.)"?[;,\t]*', re.IGNORECASE | re.DOTALL)
_SPREADSHEET_ERROR = re.compile(r"#(?:N/A|N/D|NV|Н/Д|[A-ZА-Я]+(?:/0)?[!?])")
"""#N/A, #DIV/0!, #ИМЯ?"""
_AROUND = '#"; ,\t'
"""Around the text of a comment."""
_VERSION = re.compile(r"schema_version\s*=\s*(\d{1,9})")
_SPACES = dict.fromkeys(map(ord, "\u00a0\u202f\u2007\u2009"), " ") | {0xFEFF: None}
_WORD = re.compile(rb"[A-Za-z\xa8\xb8\xc0-\xff]+")
_CONTROL = re.compile(r"[\x00-\x08\x0b\x0e-\x1f\x7f-\x84\x86-\x9f\ufffe\uffff]")
EMPTY = "a table with a header row; the file is empty"
_MARKS = {
    codecs.BOM_UTF16_LE: "utf-16-le",
    codecs.BOM_UTF16_BE: "utf-16-be",
    codecs.BOM_UTF8: "utf-8-sig",
}
_OTHERS = {
    b"PK\x03\x04": "a text file; this is a workbook or an archive: name it .xlsx, or save it as CSV",
    b"\xd0\xcf\x11\xe0": "a text file or .xlsx; this is an old workbook (.xls): save it as .xlsx or CSV",
}


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


def is_comment(cells: Sequence[Cell], *, below_header: bool) -> bool:
    """Whether a row is a comment: it begins with `#`, not with an error of a spreadsheet.

    Below the header a comment stands alone in its row: labels such as "#12 coupling" begin with `#`, too.
    """
    first = cells[0] if cells else ""
    if not isinstance(first, str) or not first.startswith("#"):
        return False
    if is_spreadsheet_error(re.split("[,;\t]", first)[0].strip()):
        return False
    return not below_header or all(cell == "" for cell in cells[1:])


def is_spreadsheet_error(cell: str) -> bool:
    """Whether a cell holds what a spreadsheet shows for an error, in English or another language."""
    return _SPREADSHEET_ERROR.fullmatch(cell) is not None


def below_title(rows: Sequence[Row], find: Finder) -> list[Row]:
    """Rows with the header in one row, where that is found; those above it become comments."""
    texts = {k: [show(cell) for cell in cells] for k, (_, cells) in enumerate(rows[: 2 * MOST_ABOVE])}
    filled = [k for k, text in texts.items() if any(text) and not text[0].startswith("#")]
    header = find([texts[k] for k in filled])
    if header is None:
        return list(rows)
    last = filled[header[1]]
    above = [(rows[k][0], (f"# {' '.join(filter(None, texts[k])).lstrip('# ')}",)) for k in range(last)]
    return [
        *above,
        (rows[last][0], tuple(header[2])) if header[0] != header[1] else rows[last],
        *rows[last + 1 :],
    ]


def make_grid(
    source: str,
    rows: Iterable[Row],
    separator: str,
    problems: Problems,
    *,
    comments: Iterable[str] = (),
    complete: bool = True,
    may_be_empty: bool = False,
) -> Grid | None:
    """Find the header, drop comments, blank lines and empty trailing columns; complain about the rest.

    Parameters
    ----------
    source, rows, separator, comments, complete
        As in `Grid`; of a sheet the comments stand among the rows.
    problems
        Collects the complaints.
    may_be_empty
        Whether a header without rows says something (a weights table: nothing was mounted).

    Returns
    -------
    Grid or None
        None if there is nothing to read; the problems say why.
    """
    texts, filled = [*comments], list[Row]()
    for number, cells in rows:
        if not separator and is_comment(cells, below_header=bool(filled)):
            texts.append(" ".join(map(show, cells)).strip(_AROUND))
        elif not all(cell == "" for cell in cells):
            filled.append((number, cells))
    for version in filter(None, map(_VERSION.fullmatch, texts)):
        problems.refuse_newer(source, int(version[1]))
    header_row, header = filled[0][0] if filled else None, [*map(show, filled[0][1])] if filled else []
    while header and not header[-1]:
        header.pop()
    if header_row is None or (len(filled) < 2 and not may_be_empty):
        if complete:
            expected = "rows below the header; there are none" if filled else EMPTY
            problems.add(source, header_row, None, None, expected)
        return None
    body, width = filled[1:], len(header)
    if "" in header or any(len(cells) != width for _, cells in body):
        body = [_fit(source, header_row, header, row, separator, problems) for row in body]
    return Grid(source, header_row, tuple(header), tuple(body), separator, tuple(texts), complete)


def _fit(
    source: str, header_row: int, header: Sequence[str], row: Row, separator: str, problems: Problems
) -> Row:
    """Bring a row to the header's width; a spreadsheet may leave blanks out at the end, or add some."""
    number, cells = row
    width = len(header)
    more = [k for k, cell in enumerate(cells[width:], width + 1) if show(cell)]
    if more:
        hint = "; numbers with a decimal comma need ; between the columns" if separator == "," else ""
        if show(cells[0]).startswith("#"):
            hint = f"; a comment below the header begins with # and has no {separator} in it"
        expected = f"{counted(width, 'cell')}, as in the header{hint}"
        problems.add(source, number, None, counted(more[-1], "cell"), expected)
    if len(cells) != width:
        cells = (cells + ("",) * width)[:width]
    for k, cell in enumerate(cells) if "" in header else ():
        if not header[k] and show(cell):
            expected = f"a name for column {k + 1} in the header (row {header_row}), or no value"
            problems.add(source, number, None, show(cell), expected)
    return number, cells


def read_bytes(path: Path, problems: Problems) -> bytes | None:
    """The content of a file, or None and a problem."""
    try:
        return file_content(path)
    except (OSError, ValueError) as error:
        problems.add(str(path), None, None, None, readable(path, error))
    return None


def readable(path: Path, error: OSError | ValueError) -> str:
    """What is expected of a file that could not be read."""
    if isinstance(error, FileNotFoundError):
        names = []
        with suppress(OSError):
            names = [entry.name for entry in path.parent.iterdir()]
        return f"a file that exists{did_you_mean(path.name, names)}"
    if isinstance(error, IsADirectoryError):
        return "a file, not a folder"
    return f"a file that can be read ({getattr(error, 'strerror', None) or error})"


def decode(source: str, data: bytes, problems: Problems) -> str | None:
    """Text of a file in any encoding that Excel writes, or None and a problem.

    An encoding that had to be guessed (cp1251, cp1252) is named in a `TableWarning`.
    """
    text, encoding = decode_as(source, data, problems) or (None, "")
    if encoding.startswith("cp"):
        message = f"{source}: not UTF-8, read as {encoding}; check the names in it"
        warnings.warn(message, TableWarning, stacklevel=2)
    return text


def decode_as(source: str, data: bytes, problems: Problems) -> tuple[str, str] | None:
    """Text of a file and the encoding; a file in UTF-16 or utf-8-sig begins with a byte-order mark."""
    expected = next((words for mark, words in _OTHERS.items() if data.startswith(mark)), "")
    expected = expected if data.strip() else EMPTY
    encodings = [name for mark, name in _MARKS.items() if data.startswith(mark)]
    for encoding in () if expected else encodings or ("utf-8", "cp"):
        if encoding == "cp":
            # Cyrillic words consist of letters above 127 only; western ones have them among ASCII letters
            words = _WORD.findall(data)
            whole = sum(len(word) > 1 and min(word) > 127 for word in words)
            encoding = "cp1251" if whole > sum(min(w) < 128 <= max(w) for w in words) else "cp1252"
        with suppress(UnicodeDecodeError):
            text = data.decode(encoding).removeprefix("\ufeff")
            if not _CONTROL.search(text):
                return text, encoding
    expected = expected or "a text file (CSV) or a workbook (.xlsx); this one is neither"
    problems.add(source, None, None, None, expected)
    return None


def parse_text(
    source: str, text: str, problems: Problems, *, may_be_empty: bool = False, find: Finder | None = None
) -> Grid | None:
    """Rows of cells of a text table, or None and problems; `may_be_empty` as in `make_grid`.

    With `find`, what stands above the header that it finds is comment.
    """
    lines = re.split(r"\r\n|\n|\r", text)
    # A spreadsheet takes `sep=;` as an instruction and does not show it: rows count from the next.
    declared = SEP_LINE.fullmatch(lines[0].strip(" \ufeff"))
    if declared:
        lines = lines[1:]
        if declared.group(1) not in ";,\t":
            problems.add(source, 1, None, f"sep={declared.group(1)}", "sep=; or sep=, or a tab")
            return None
    plain = ((k, line.strip(';,\t" \xa0\ufeff\r\n')) for k, line in enumerate(lines))
    top = [k for k, line in plain if line and not line.startswith("#")][:MOST_ABOVE]
    header = None if find is None else _header(lines, top, find)
    start, names = header or (top[0] if top else 0, None)
    header_line = lines[start] if top else "".join(line for line in lines if line[:1] != "#")
    separator = declared.group(1) if declared else _separator(header_line)
    if len(lines) + text.count(separator) > MOST_CELLS:
        problems.add(source, None, None, None, f"a table of at most {MOST_CELLS:,} cells")
        return None
    rows, comments, complete = list[Row](), list[str](), True
    for k, line in enumerate(lines):
        stripped = clean(line)
        comment = k < start or (stripped[:1] == "#" and is_comment((stripped,), below_header=False))
        if comment and not (k > start and separator in line):
            comments += filter(None, [stripped.strip(_AROUND)])
            continue
        try:
            cells = tuple(names) if names is not None and k == start else _cells(line, separator)
        except csv.Error as error:
            rule = "quotes that are closed on the same line (a cell cannot hold a line break)"
            problems.add(source, k + 1, None, None, f"{rule}: {error}")
            complete = False
            continue
        rows.append((k + 1, cells))
    return make_grid(
        source, rows, separator, problems, comments=comments, complete=complete, may_be_empty=may_be_empty
    )


def _header(
    lines: Sequence[str], top: Sequence[int], find: Finder
) -> tuple[int, Sequence[str] | None] | None:
    """The line of the header, and its names where it has two rows; None where it is not sure."""
    cells: dict[int, tuple[str, ...]] = {}
    for k in top:
        with suppress(csv.Error):
            cells[k] = _cells(lines[k], _separator(lines[k])) if len(lines[k]) < LONGEST_LINE else ()
    found = find([*cells.values()])
    return None if found is None else ([*cells][found[1]], found[2] if found[0] != found[1] else None)


def _cells(line: str, separator: str) -> tuple[str, ...]:
    if '"' not in line:  # a line at a time: an open quote must not swallow the rest of the file
        return tuple(map(clean, line.split(separator))) if line else ()
    return tuple(map(clean, next(csv.reader([line], delimiter=separator, strict=True), [])))


def _separator(line: str) -> str:
    """What separates the columns of a header, outside quotes."""
    outside = re.sub(r'"[^"]*"', "", line)
    return next((sign for sign in ("\t", ";", ",") if sign in outside), ",")
