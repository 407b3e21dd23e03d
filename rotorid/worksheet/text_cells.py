"""Tables whose single cells are changed: those in text files, of which all other bytes stay."""

from __future__ import annotations

import codecs
import csv
import re
from collections.abc import Callable, Mapping, Sequence
from difflib import SequenceMatcher
from functools import partial
from pathlib import Path

from rotorid.tables.job.job_keys import READINGS
from rotorid.tables.job.workbook_sheets import TEXT_COLUMNS
from rotorid.tables.reader.columns import REMARKS, column_of
from rotorid.tables.reader.decimal_numbers import decimal_comma, has_decimal_comma
from rotorid.tables.reader.grid import Grid, clean, show
from rotorid.tables.reader.problems import InputError, Problems
from rotorid.tables.reader.table_writing import guarded
from rotorid.tables.reader.text_file import SEP_LINE, decode_as, parse_text, text_from_header
from rotorid.tables.runs import runs_table, weights_table
from rotorid.tables.runs.column_headings import looks_like_header

_NUMBER = re.compile(r"[+-]?(?:[0-9]+[.,]?[0-9]*|[.,][0-9]+)(?:[eE][+-]?[0-9]+)?")
_MARKS = {"utf-16-le": codecs.BOM_UTF16_LE, "utf-16-be": codecs.BOM_UTF16_BE}
KEYS = ("runs", "weights", "check", "check_weights")
"""Tables that are shown."""
IS_HEADER = partial(looks_like_header, named={})


class Cells:
    """A table of a job, of which single cells can be changed.

    Attributes
    ----------
    name
        Of its file, for messages.
    header
        Names of its columns, empty if it cannot be read.
    rows
        Row number and cells, by place among `lines`; without comments and blank rows.
    lines
        What tells its rows, comments and blank ones too, apart.
    ids
        Of the lines.
    read_only
        Why it cannot be edited, else empty.
    """

    def __init__(self, name: str) -> None:
        self.name, self.read_only = name, ""
        self.header: tuple[str, ...] = ()
        self.rows: dict[int, tuple[int, list[str]]] = {}
        self.lines: list[str] = []
        self.ids: list[str] = []
        self.end = 0

    def fill(self, table: str, grid: Grid | None, problems: Problems, offset: int) -> None:
        """Take rows from what the reader has found; `offset` is the place of row 1."""
        if grid is None:
            self.read_only = str(InputError(problems))
            return
        self.header, self.end = grid.header, grid.header_row + offset - 1
        for number, cells in grid.rows:
            self.end = number + offset - 1
            self.rows[self.end] = (number, [getattr(cell, "text", show(cell)) for cell in cells])
        self.read_only = self.read_only or untidy(self.name, table, grid.header)

    def column(self, name: str) -> int:
        """The place of a column; ValueError if there is none."""
        if name not in self.header or not name:
            raise ValueError(f"{self.name} has no column {name!r}")
        return self.header.index(name)

    def cells(self, index: int) -> list[str]:
        """Cells of a line as they are now."""
        raise NotImplementedError

    def put(self, index: int, column: str, text: str) -> None:
        """Change one cell."""
        raise NotImplementedError

    def insert(self, after: int, cells: Mapping[str, str], row_id: str) -> None:
        """Insert a row below a line."""
        raise NotImplementedError

    def delete(self, index: int) -> None:
        """Delete a row."""
        raise NotImplementedError


def kept_ids(old: Cells | None, lines: Sequence[str], new_id: Callable[[], str]) -> list[str]:
    """Ids of lines: where another program has changed some, those of equal and of replaced lines stay."""
    ids = [""] * len(lines)
    before = [] if old is None else old.lines
    for kind, a, b, c, d in SequenceMatcher(None, before, lines, autojunk=False).get_opcodes():
        if old is not None and (kind == "equal" or b - a == d - c):
            ids[c:d] = old.ids[a:b]
    return [one or new_id() for one in ids]


def is_text(column: str) -> bool:
    """Whether a column holds names or remarks, in which nothing is a number."""
    return column in TEXT_COLUMNS or not column or column.casefold().startswith(REMARKS)


def untidy(name: str, table: str, header: Sequence[str]) -> str:
    """Why the columns of a table do not allow to edit it here; empty if they do."""
    columns = runs_table.COLUMNS if table in READINGS else weights_table.COLUMNS
    found = [column_of(one, columns) for one in header if not is_text(one) or one in TEXT_COLUMNS]
    stems = [column.stem for column in found if column is not None]
    needed = {column.stem for column in columns if column.required}
    if table not in READINGS and "unbalance" not in stems:
        needed.add("mass")
    if needed <= set(stems) and len(set(stems)) == len(stems):
        return ""
    form = "run, speed, sensor, amplitude, phase" if table in READINGS else "run, plane, mass_g, angle_deg"
    return f"{name} has other columns than {form}: it is read as it is, edit it where it comes from"


class TextCells(Cells):
    """A table in a text file.

    Parameters
    ----------
    path, data
        The file.
    table
        The key of a job that names it.
    """

    def __init__(self, path: Path, data: bytes, table: str) -> None:
        super().__init__(path.name)
        problems = Problems()
        text, self._encoding = decode_as(path.name, data, problems) or ("", "utf-8")
        parts = re.split(r"(\r\n|\n|\r)", text)
        self.lines, self._ends = parts[::2], [*parts[1::2], ""]
        sep = SEP_LINE.fullmatch(self.lines[0].strip(" \ufeff"))
        shaped = text_from_header(text, IS_HEADER) if table in READINGS else text
        grid = None if len(problems) else parse_text(path.name, shaped, problems, may_be_empty=True)
        self.fill(table, grid, problems, 1 if sep else 0)
        self.separator = "," if grid is None else grid.separator
        self._width = 0 if grid is None else len(self._split(grid.header_row + bool(sep) - 1))
        numbers = [
            c
            for _, row in self.rows.values()
            for n, c in zip(self.header, row, strict=True)
            if not is_text(n)
        ]
        self._sign = ""
        if self.separator == "," or any("." in number for number in numbers):
            self._sign = "."
        if decimal_comma(numbers, self.separator):
            self._sign = ","
        if not self.read_only and self.data() != data:
            self.read_only = f"{path.name} holds characters that would not stay as they are"

    def data(self) -> bytes:
        """The file as it is now.

        Raises
        ------
        ValueError
            Where its encoding has no such character.
        """
        text = "".join(line + end for line, end in zip(self.lines, self._ends, strict=True))
        try:
            data = _MARKS.get(self._encoding, b"") + text.encode(self._encoding)
        except UnicodeEncodeError as error:
            sign = text[error.start]
            raise ValueError(
                f"{self.name} is written in {self._encoding}, which has no {sign!r}: save the file as UTF-8"
            ) from None
        found = decode_as(self.name, data, Problems())
        if found is None or found[0] != text:
            raise ValueError(f"{self.name} would be read in another encoding then: save the file as UTF-8")
        return data

    def cells(self, index: int) -> list[str]:
        """Cells of a line as they are now."""
        cells = [clean(_value(raw)) for raw in self._split(index)]
        return (cells + [""] * len(self.header))[: len(self.header)]

    def put(self, index: int, column: str, text: str) -> None:
        """Change one cell; quotes and blanks around it stay."""
        place, raw = self.column(column), self._split(index)
        raw += [""] * (place + 1 - len(raw))
        old = raw[place]
        new = self._written(column, text, first=place == 0, quoted=old.startswith('"'))
        if old.strip() and not old.startswith('"') and not new.startswith('"'):
            before = old[: len(old) - len(old.lstrip())]
            new = (before + new.lstrip() if before else new) + old[len(old.rstrip()) :]
        raw[place] = new
        self.lines[index] = self.separator.join(raw)

    def insert(self, after: int, cells: Mapping[str, str], row_id: str) -> None:
        """Insert a row below a line, with as many cells as the header."""
        raw = [""] * self._width
        for column, text in cells.items():
            place = self.column(column)
            raw[place] = self._written(column, text, first=place == 0)
        self.lines.insert(after + 1, self.separator.join(raw))
        self.ids.insert(after + 1, row_id)
        end = self._ends[after]
        self._ends[after] = end or next(filter(None, self._ends), "\n")
        self._ends.insert(after + 1, end)
        self.end += after <= self.end

    def delete(self, index: int) -> None:
        """Delete a row; a file without a newline at its end stays so."""
        if not self._ends[index] and index:
            self._ends[index - 1] = ""
        del self.lines[index], self._ends[index], self.ids[index]
        self.end -= index <= self.end

    def _split(self, index: int) -> list[str]:
        """Cells of a line as they are written, with their quotes."""
        line, sep = self.lines[index], re.escape(self.separator)
        if '"' not in line:
            return line.split(self.separator)
        return [m[1] for m in re.finditer(rf'(?:^|{sep})("(?:[^"]|"")*"|[^{sep}]*)', line)]

    def _written(self, column: str, text: str, *, first: bool, quoted: bool = False) -> str:
        """A cell as the file writes it."""
        text = clean(text)
        text = self._number(text) if _NUMBER.fullmatch(text) and not is_text(column) else guarded(text)
        if quoted or self.separator in text or '"' in text or (first and text.startswith("#")):
            return '"' + text.replace('"', '""') + '"'
        return text

    def _number(self, text: str) -> str:
        """With the decimal sign of the file; 1,350 and 1.350 stay where they may mean thousands."""
        if not decimal_comma([text.replace(".", ",")], "\t"):
            return text
        sign = "," if has_decimal_comma(text) else "."
        self._sign = self._sign or sign
        return text.replace(sign, self._sign)


def _value(raw: str) -> str:
    return next(csv.reader([raw]), [""])[0] if raw.startswith('"') else raw
