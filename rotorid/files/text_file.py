"""Text files (.csv and the like) as people write them: encoding, separator, decimal comma, rows of cells."""

from __future__ import annotations

import codecs
import csv
import re
import warnings
from collections.abc import Sequence
from contextlib import suppress
from pathlib import Path

from rotorid.base.suggestions import did_you_mean
from rotorid.files.grid import (
    MOST_ABOVE,
    MOST_CELLS,
    CommentLine,
    Finder,
    Grid,
    Row,
    begins_comment,
    clean,
    make_grid,
)
from rotorid.files.input_file import file_content
from rotorid.files.problems import Problems, TableWarning

SEP_LINE = re.compile(r'"?sep=(.)"?[;,\t]*', re.IGNORECASE | re.DOTALL)
_BLANK = ';,\t" \xa0\ufeff\r\n'
_WORD = re.compile(rb"[A-Za-z\xa8\xb8\xc0-\xff]+")
_WIDE = {codecs.BOM_UTF16_LE: "utf-16-le", codecs.BOM_UTF16_BE: "utf-16-be"}
MOST_BYTES_ABOVE = 10_000
"""Of a line that may be a header."""


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
        return f"a file that exists{_neighbour(path)}"
    if isinstance(error, IsADirectoryError):
        return "a file, not a folder"
    return f"a file that can be read ({getattr(error, 'strerror', None) or error})"


def decode(source: str, data: bytes, problems: Problems) -> str | None:
    """Text of a file in any encoding that Excel writes, or None and a problem.

    An encoding that had to be guessed (cp1251, cp1252) is named in a `TableWarning`.
    """
    found = decode_as(source, data, problems)
    if found is None:
        return None
    text, encoding = found
    if encoding.startswith("cp"):
        message = f"{source}: not UTF-8, read as {encoding}; check the names in it"
        warnings.warn(message, TableWarning, stacklevel=2)
    return text


def decode_as(source: str, data: bytes, problems: Problems) -> tuple[str, str] | None:
    """Text of a file and the encoding; a file in UTF-16 or utf-8-sig begins with a byte-order mark."""
    if not data.strip():
        problems.add(source, None, None, None, "a table with a header row; the file is empty")
        return None
    found = _decode(source, data, problems)
    if found is not None and re.search(r"[\x00-\x08\x0b\x0e-\x1f\x7f-\x84\x86-\x9f\ufffe\uffff]", found[0]):
        problems.add(source, None, None, None, "a text file (CSV) or a workbook (.xlsx); this one is binary")
        return None
    return found


def _decode(source: str, data: bytes, problems: Problems) -> tuple[str, str] | None:
    if data.startswith(b"PK\x03\x04"):
        expected = "a text file; this is a workbook or an archive: name it .xlsx, or save it as CSV"
    elif data.startswith(b"\xd0\xcf\x11\xe0"):
        expected = "a text file or .xlsx; this is an old Excel workbook (.xls): save it as .xlsx or CSV"
    else:
        expected = "a text file (CSV) or a workbook (.xlsx); this one is neither"
        try:
            for mark, encoding in _WIDE.items():
                if data.startswith(mark):
                    return data[len(mark) :].decode(encoding), encoding
            if b"\x00" not in data:
                return _decode_bytes(data)
        except UnicodeDecodeError:
            pass
    problems.add(source, None, None, None, expected)
    return None


def _decode_bytes(data: bytes) -> tuple[str, str]:
    with suppress(UnicodeDecodeError):
        return data.decode("utf-8-sig"), "utf-8-sig" if data.startswith(codecs.BOM_UTF8) else "utf-8"
    for encoding in ["cp1251", "cp1252"] if _looks_cyrillic(data) else ["cp1252", "cp1251"]:
        with suppress(UnicodeDecodeError):
            return data.decode(encoding), encoding
    return data.decode("utf-8"), "utf-8"


def _looks_cyrillic(data: bytes) -> bool:
    """Cyrillic words consist of letters above 127 only; western ones have them among ASCII letters."""
    votes = 0
    for word in _WORD.findall(data):
        high = sum(byte > 127 for byte in word)
        if high == len(word) and high > 1:
            votes += 1
        elif 0 < high < len(word):
            votes -= 1
    return votes > 0


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
    start, names, separator = _header(lines, find)
    separator = declared.group(1) if declared else separator
    if len(lines) + text.count(separator) > MOST_CELLS:
        problems.add(source, None, None, None, f"a table of at most {MOST_CELLS:,} cells")
        return None
    rows: list[Row] = []
    complete, below_header = True, False
    for number, line in enumerate(lines, start=1):
        stripped = clean(line)
        above = number <= start and bool(stripped)
        if above or (begins_comment(stripped) and not (below_header and separator in line)):
            rows.append((number, (CommentLine(stripped if stripped[:1] == "#" else f"# {stripped}"),)))
            continue
        try:
            cells = _cells(line, separator)
        except csv.Error as error:
            rule = "quotes that are closed on the same line (a cell cannot hold a line break)"
            problems.add(source, number, None, None, f"{rule}: {error}")
            complete = False
            continue
        if number == start + 1 and names is not None:
            cells = tuple(names)
        if not below_header and cells and begins_comment(cells[0]) and not any(cells[1:]):
            cells = (CommentLine(cells[0]),)  # a comment with a separator in it, as a spreadsheet saves it
        else:
            below_header = below_header or any(cells)
        rows.append((number, cells))
    return make_grid(source, rows, separator, problems, complete=complete, may_be_empty=may_be_empty)


def _header(lines: Sequence[str], find: Finder | None) -> tuple[int, Sequence[str] | None, str]:
    """How many lines stand above the header, its names where it has two rows, and what separates columns."""
    top: dict[int, tuple[tuple[str, ...], str]] = {}
    for at, line in enumerate(lines[:MOST_ABOVE] if find is not None else ()):
        plain = line.strip(_BLANK)
        if plain and not plain.startswith("#") and len(line) < MOST_BYTES_ABOVE:
            with suppress(csv.Error):
                separator = _separator([line])
                top[at] = _cells(line, separator), separator
    header = None if find is None else find([cells for cells, _ in top.values()])
    if header is None:
        return 0, None, _separator(lines)
    first, last, names = header
    at = [*top][last]
    return at, names if first != last else None, top[at][1]


def _cells(line: str, separator: str) -> tuple[str, ...]:
    if '"' not in line:  # a line at a time: an open quote must not swallow the rest of the file
        return tuple(map(clean, line.split(separator))) if line else ()
    return tuple(map(clean, next(csv.reader([line], delimiter=separator, strict=True), [])))


def _separator(lines: Sequence[str]) -> str:
    """What separates the columns of the header, outside quotes."""
    for line in lines:
        if line.strip(';,\t" \xa0\ufeff') and not line.strip().startswith(("#", '"#')):
            outside = re.sub(r'"[^"]*"', "", line)
            return _first_sign(outside)
    return _first_sign("".join(line for line in lines if not line.strip().startswith("#")))


def _first_sign(text: str) -> str:
    return next((sign for sign in ("\t", ";", ",") if sign in text), ",")


def _neighbour(path: Path) -> str:
    try:
        names = [entry.name for entry in path.parent.iterdir()]
    except OSError:
        return ""
    return did_you_mean(path.name, names)
