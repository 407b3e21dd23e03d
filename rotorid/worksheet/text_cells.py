"""Tables whose single cells are changed: those in text files, of which all other bytes stay."""

from __future__ import annotations

import codecs
import csv
import re
from collections.abc import Iterable, Mapping, Sequence
from difflib import SequenceMatcher
from pathlib import Path

from rotorid.base.tables import guarded
from rotorid.files import runs as runs_table
from rotorid.files import weights as weights_table
from rotorid.files.cells import SEP_LINE, Grid, clean, decode_as, parse_text, show
from rotorid.files.columns import REMARKS, column_of
from rotorid.files.decimal_numbers import decimal_comma, has_decimal_comma
from rotorid.files.headings import find_header
from rotorid.files.job_excel import TEXT_COLUMNS
from rotorid.files.job_models import READINGS
from rotorid.files.problems import InputError, Problems

KEYS = ("runs", "weights", "check", "check_weights")
"""Tables that are shown."""
_NUMBER = re.compile(r"[+-]?(?:[0-9]+[.,]?[0-9]*|[.,][0-9]+)(?:[eE][+-]?[0-9]+)?")
_MARKS = {"utf-16-le": codecs.BOM_UTF16_LE, "utf-16-be": codecs.BOM_UTF16_BE}


class Cells:
    """A table of a job: as it is here, one that can only be shown; of others single cells can be changed.

    Attributes
    ----------
    name, read_only
        Of its file, for messages; why it cannot be edited, else empty.
    lines, ids
        What tells its rows, comments and blank ones too, apart, and the ids of all of them.
    header, rows
        Names of the columns; row number and cells by place among the lines, without comments and blank rows.
    """

    def __init__(self, name: str, read_only: str = "") -> None:
        self.name, self.read_only, self.end = name, read_only, 0
        self.lines: list[str] = []
        self.ids: list[str] = []
        self.header: tuple[str, ...] = ()
        self.rows: dict[int, tuple[int, list[str]]] = {}

    def fill(self, table: str, grid: Grid | None, problems: Problems, first: int) -> None:
        """Take what the reader has found; row 1 is the line at the place `first`."""
        if grid is None:
            self.read_only = str(InputError(problems))
            return
        self.header, self.end = grid.header, grid.header_row + first - 1
        for number, cells in grid.rows:
            self.end = number + first - 1
            self.rows[self.end] = (number, [getattr(cell, "text", show(cell)) for cell in cells])
        self.read_only = _untidy(self.name, table, grid.header)

    def column(self, name: str) -> int:
        """The place of a column; ValueError if there is none."""
        if not name or name not in self.header:
            raise ValueError(f"{self.name} has no column {name!r}")
        return self.header.index(name)

    def index(self, row_id: object) -> int | None:
        """The place of the line with this id, None if it is gone."""
        return self.ids.index(row_id) if isinstance(row_id, str) and row_id in self.ids else None

    def cells(self, index: int) -> list[str]:
        """Cells of a line as they are now, as many as the header has."""
        return self.rows[index][1] if index in self.rows else [""] * len(self.header)

    def put(self, index: int, column: str, text: str) -> None:
        """Change one cell; ValueError in a table that can only be shown."""
        raise ValueError(self.read_only or f"{self.name} cannot be changed here")

    def insert(self, after: int, cells: Mapping[str, str], row_id: str) -> None:
        """Insert a row below a line."""
        self.ids.insert(after + 1, row_id)
        self.end += after <= self.end
        for column, text in cells.items():
            self.put(after + 1, column, text)

    def delete(self, index: int) -> None:
        """Delete a row."""
        del self.lines[index], self.ids[index]
        self.end -= index <= self.end


def kept_ids(old: Cells | None, lines: Sequence[str], new_ids: Iterable[int]) -> list[str]:
    """Ids of lines that another program may have changed: those of equal and of replaced ones stay."""
    ids, before = [""] * len(lines), Cells("") if old is None else old
    if before.lines == lines:
        return list(before.ids)
    # thousands of equal blank rows, as Excel leaves them, would take the square of their number
    found = SequenceMatcher(lambda line: not line.strip("[]'\" ,;\t"), before.lines, lines, autojunk=False)
    for kind, a, b, c, d in found.get_opcodes():
        if kind == "equal" or b - a == d - c:
            ids[c:d] = before.ids[a:b]
    return [one or str(next(iter(new_ids))) for one in ids]


def is_text(column: str) -> bool:
    """Whether a column holds names or remarks, in which nothing is a number."""
    return column in TEXT_COLUMNS or column.casefold().startswith(REMARKS)


def _untidy(name: str, table: str, header: Sequence[str]) -> str:
    columns = runs_table.COLUMNS if table in READINGS else weights_table.COLUMNS
    stems = [found.stem for one in header if (found := column_of(one, columns)) is not None]
    needed = {column.stem for column in columns if column.required}
    if any(name.startswith("unbalance_") for name in header):
        needed.discard("mass")
    if needed <= set(stems) and len(set(stems)) == len(stems):
        return ""
    form = "run, speed, sensor, amplitude, phase" if table in READINGS else "run, plane, mass, angle"
    return f"{name} has other columns than {form}: it is read as it is, edit it where it comes from"


class TextCells(Cells):
    """A table in a text file, by the key `table` of the job."""

    def __init__(self, path: Path, data: bytes, table: str) -> None:
        super().__init__(path.name)
        problems = Problems()
        text, self._encoding = decode_as(path.name, data, problems) or ("", "utf-8")
        parts = re.split(r"(\r\n|\n|\r)", text)
        self.lines, self._ends = parts[::2], [*parts[1::2], ""]
        first = 1 if SEP_LINE.fullmatch(self.lines[0].strip(" \ufeff")) else 0
        find = find_header if table in READINGS else None
        grid = None if len(problems) else parse_text(path.name, text, problems, may_be_empty=True, find=find)
        self.separator = "," if grid is None else grid.separator
        self._width = 0 if grid is None else len(self._split(grid.header_row + first - 1))
        self.fill(table, grid, problems, first)
        names = [is_text(name) for name in self.header]
        numbers = [c for _, row in self.rows.values() for c, text in zip(row, names, strict=True) if not text]
        comma, points = decimal_comma(numbers, self.separator), any("." in number for number in numbers)
        self._sign = "," if comma else "." if points or self.separator == "," else ""
        if not self.read_only and self.data() != data:
            self.read_only = f"{path.name} holds characters that would not stay as they are"

    def data(self) -> bytes:
        """The file as it is now; ValueError where its encoding lacks a character."""
        text = "".join(line + end for line, end in zip(self.lines, self._ends, strict=True))
        try:
            data = _MARKS.get(self._encoding, b"") + text.encode(self._encoding)
        except UnicodeEncodeError as error:
            why = f"{self.name} is written in {self._encoding}, which has no {text[error.start]!r}"
            raise ValueError(f"{why}: save the file as UTF-8") from None
        if (decode_as(self.name, data, Problems()) or ("",))[0] != text:
            raise ValueError(f"{self.name} would be taken for another encoding then: save the file as UTF-8")
        return data

    def cells(self, index: int) -> list[str]:
        """Cells of a line as they are now."""
        raw = (self._split(index) + [""] * len(self.header))[: len(self.header)]
        return [clean(next(csv.reader([cell]))[0] if cell.startswith('"') else cell) for cell in raw]

    def put(self, index: int, column: str, text: str) -> None:
        """Change one cell; quotes and blanks around it stay."""
        place, raw = self.column(column), self._split(index)
        raw += [""] * (place + 1 - len(raw))
        old, new = raw[place], clean(text)
        new = self._number(new) if _NUMBER.fullmatch(new) and not is_text(column) else guarded(new)
        if old[:1] == '"' or self.separator in new or '"' in new or (place == 0 and new[:1] == "#"):
            new = '"' + new.replace('"', '""') + '"'
        elif old.strip():
            before = old[: len(old) - len(old.lstrip())]
            new = (before + new.lstrip() if before else new) + old[len(old.rstrip()) :]
        raw[place] = new
        self.lines[index] = self.separator.join(raw)

    def insert(self, after: int, cells: Mapping[str, str], row_id: str) -> None:
        """Insert a row with as many cells as the header; a missing end of the last line stays so."""
        self.lines.insert(after + 1, self.separator * (self._width - 1))
        self._ends.insert(after + 1, self._ends[after])
        self._ends[after] = self._ends[after] or next(filter(None, self._ends), "\n")
        super().insert(after, cells, row_id)

    def delete(self, index: int) -> None:
        """Delete a row; a missing end of the last line stays so."""
        if not self._ends[index] and index:
            self._ends[index - 1] = ""
        del self._ends[index]
        super().delete(index)

    def _split(self, index: int) -> list[str]:
        """Cells of a line as they are written, with their quotes."""
        line, sep = self.lines[index], re.escape(self.separator)
        if '"' not in line:
            return line.split(self.separator)
        return [m[1] for m in re.finditer(rf'(?:^|{sep})("(?:[^"]|"")*"|[^{sep}]*)', line)]

    def _number(self, text: str) -> str:
        """With the decimal sign of the file; 1,350 and 1.350 stay, since they may mean thousands."""
        if not decimal_comma([text.replace(".", ",")], "\t"):
            return text
        sign = "," if has_decimal_comma(text) else "."
        self._sign = self._sign or sign
        return text.replace(sign, self._sign)
