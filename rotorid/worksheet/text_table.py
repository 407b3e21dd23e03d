"""A table of a job in memory: rows with ids that stay, changed one at a time, written as a whole file."""

from __future__ import annotations

import csv
import io
import re
import warnings
from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from difflib import SequenceMatcher
from pathlib import Path
from typing import NamedTuple

from rotorid.base.tables import guarded
from rotorid.files import runs, weights
from rotorid.files.cells import SEP_LINE, Grid, clean, decimal_comma, decode, parse_text, show
from rotorid.files.columns import REMARKS, column_of
from rotorid.files.headings import find_header
from rotorid.files.job_excel import TEXT_COLUMNS
from rotorid.files.job_models import READINGS
from rotorid.files.problems import InputError, Problems

_NUMBER = re.compile(r"[+-]?(?:[0-9]+[.,]?[0-9]*|[.,][0-9]+)(?:[eE][+-]?[0-9]+)?")


class Line(NamedTuple):
    """One line of a file; `cells` is None in a comment, a blank line and the header."""

    text: str
    cells: tuple[str, ...] | None
    id: str = ""


@dataclass(frozen=True, eq=False)
class Table:
    """A table as the page shows it; edits make another one.

    Attributes
    ----------
    path
        Where it is, or what messages call its sheet.
    header, lines
        Names of the columns; all lines of the file. Row 1 is the line at the place `first`.
    separator, sign, newline, mark
        How it is written: between cells, in decimals ("" where there are none), between lines, at the start.
    read_only
        Why it cannot be edited, else empty.
    original
        The file, as long as nothing is edited.
    """

    path: Path
    header: tuple[str, ...] = ()
    lines: tuple[Line, ...] = ()
    first: int = 0
    separator: str = ","
    sign: str = ""
    newline: str = "\n"
    mark: str = ""
    read_only: str = ""
    original: bytes = b""

    def rows(self) -> Iterator[tuple[int, Line]]:
        """The rows, each with its number in a spreadsheet."""
        return ((i + 1 - self.first, line) for i, line in enumerate(self.lines) if line.cells is not None)

    def row(self, row_id: object) -> Line | None:
        """The row with this id, None if it is gone."""
        return next((line for _, line in self.rows() if line.id == row_id), None)

    def column(self, name: str) -> int:
        """The place of a column; ValueError if there is none."""
        if not name or name not in self.header:
            raise ValueError(f"{self.path.name} has no column {name!r}")
        return self.header.index(name)

    def with_cells(self, line: Line, cells: Mapping[str, str]) -> Table:
        """With some cells of a row changed."""
        new = list(line.cells or ())
        for name, text in cells.items():
            new[self.column(name)] = self._written(name, clean(text))
        stream = io.StringIO()
        csv.writer(stream, delimiter=self.separator, lineterminator="").writerow(map(_plain, new))
        made = Line(stream.getvalue(), tuple(map(clean, new)), line.id)
        return self._with(made if one is line else one for one in self.lines)

    def with_row(self, after: object, cells: Mapping[str, str], row_id: str) -> Table:
        """With a new row below the one with the id `after`, or below the last."""
        below = self.row(after)
        at = 1 + (self.lines.index(below) if below else self._last())
        made = Line("", ("",) * len(self.header), row_id)
        return self._with((*self.lines[:at], made, *self.lines[at:])).with_cells(made, cells)

    def without(self, line: Line) -> Table:
        """Without a row."""
        return self._with(one for one in self.lines if one is not line)

    def with_ids(self, old: Table | None, new_ids: Iterator[str]) -> Table:
        """Read anew after another program: rows that are as they were, or were replaced, keep their ids."""
        ids, before = [""] * len(self.lines), () if old is None else old.lines
        match = SequenceMatcher(None, [one.text for one in before], [one.text for one in self.lines], False)
        for kind, a, b, c, d in match.get_opcodes():
            if kind == "equal" or b - a == d - c:
                ids[c:d] = [line.id for line in before[a:b]]
        pairs = zip(self.lines, ids, strict=True)
        return replace(
            self, lines=tuple(one._replace(id=one.id or kept or next(new_ids)) for one, kept in pairs)
        )

    def data(self) -> bytes:
        """The whole file."""
        return self.original or (self.mark + self.newline.join(line.text for line in self.lines)).encode()

    def _with(self, lines: Iterable[Line]) -> Table:
        return replace(self, lines=tuple(lines), original=b"")

    def _last(self) -> int:
        """The place of the last row, or of the header."""
        rows = [i for i, line in enumerate(self.lines) if line.cells is not None]
        return rows[-1] if rows else next(i for i, line in enumerate(self.lines) if line.id == "header")

    def _written(self, column: str, text: str) -> str:
        """A number with the decimal sign of the file; 1,350 and 1.350 stay, since they may mean thousands."""
        if is_text(column) or not _NUMBER.fullmatch(text):
            return guarded(text)
        if not decimal_comma([text.replace(".", ",")], "\t"):
            return text
        sign = self.sign or ("," if self.separator != "," and "," in text else ".")
        return text.replace(",", ".").replace(".", sign)


def read_table(path: Path, key: str, data: bytes) -> Table:
    """The table that the job names by `key`; one of another form is read only."""
    problems = Problems()
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")  # of a guessed encoding; the calculation says so
        text = decode(path.name, data, problems) or ""
    find = find_header if key in READINGS else None
    grid = None if len(problems) else parse_text(path.name, text, problems, may_be_empty=True, find=find)
    if grid is None:
        return Table(path, read_only=str(InputError(problems)))
    lines = re.split(r"\r\n|\n|\r", text)
    first = 1 if SEP_LINE.fullmatch(lines[0].strip(" \ufeff")) else 0
    numbers = [
        c
        for cells in _cells(grid).values()
        for c, name in zip(cells, grid.header, strict=True)
        if not is_text(name)
    ]
    comma = decimal_comma(numbers, grid.separator)
    return replace(
        shown(path, key, grid, lines, first),
        separator=grid.separator,
        sign="," if comma else "." if grid.separator == "," or any("." in c for c in numbers) else "",
        newline="\r\n" if "\r\n" in text else "\n",
        mark="" if data == text.encode() else "\ufeff",
        original=data,
    )


def shown(path: Path, key: str, grid: Grid, lines: Sequence[str] | None = None, first: int = 0) -> Table:
    """What the reader of tables has found; without lines, as in a sheet of a workbook."""
    cells = _cells(grid)
    texts = lines or [""] * max([grid.header_row, *cells])
    rows = [Line(text, cells.get(i + 1 - first)) for i, text in enumerate(texts)]
    rows[grid.header_row + first - 1] = Line(texts[grid.header_row + first - 1], None, "header")
    return Table(path, grid.header, tuple(rows), first, read_only=_untidy(path.name, key, grid.header))


def is_text(column: str) -> bool:
    """Whether a column holds names or remarks, in which nothing is a number."""
    return column in TEXT_COLUMNS or column.casefold().startswith(REMARKS)


def _cells(grid: Grid) -> dict[int, tuple[str, ...]]:
    return {n: tuple(getattr(cell, "text", show(cell)) for cell in row) for n, row in grid.rows}


def _plain(cell: str) -> str:
    """Without what a spreadsheet would run; numbers stay."""
    return cell if _NUMBER.fullmatch(cell) else guarded(cell)


def _untidy(name: str, key: str, header: Sequence[str]) -> str:
    columns = runs.COLUMNS if key in READINGS else weights.COLUMNS
    stems = [column.stem for one in header if (column := column_of(one, columns)) is not None]
    needed = {column.stem for column in columns if column.required}
    if any(name.startswith("unbalance_") for name in header):
        needed.discard("mass")
    if needed <= set(stems) and len(set(stems)) == len(stems):
        return ""
    form = "run, speed, sensor, amplitude, phase" if key in READINGS else "run, plane, mass, angle"
    return f"{name} has other columns than {form}: it is read as it is, edit it where it comes from"
