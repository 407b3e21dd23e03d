"""A table of a job as its file holds it, line by line, so that an edit changes its row alone."""

from __future__ import annotations

import csv
import io
import re
import warnings
from collections import Counter
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path

from rotorid.base.tables import guarded
from rotorid.files import runs, weights
from rotorid.files.cells import SEP_LINE, Grid, clean, decimal_comma, decode, parse_text, show
from rotorid.files.columns import REMARKS, column_of
from rotorid.files.headings import find_header
from rotorid.files.job_excel import TEXT_COLUMNS
from rotorid.files.job_models import READINGS
from rotorid.files.problems import InputError, Problems

_NUMBER = re.compile(r"[+-]?(?:[0-9]+[.,]?[0-9]*|[.,][0-9]+)(?:[eE][+-]?[0-9]+)?")


@dataclass(eq=False)
class Line:
    """One line of a file; `cells` is empty in a comment, a blank line and the header.

    `number` is that of a spreadsheet; `id` what edits call the row.
    """

    text: str
    number: int = 0
    cells: list[str] = field(default_factory=list)
    id: str = ""


@dataclass(eq=False)
class Table:
    """A table as the page shows it.

    Attributes
    ----------
    path
        Where it is, or what messages call its sheet.
    header, lines
        Names of the columns; the lines of the file, of a sheet its rows alone.
    read_only
        Why it cannot be edited, else empty.
    separator, sign, newline, encoding
        What stands between cells, in decimals ("" where there are none) and between lines; of the file.
    changed
        Whether it was edited.
    """

    path: Path
    header: Sequence[str] = ()
    lines: list[Line] = field(default_factory=list)
    read_only: str = ""
    separator: str = ","
    sign: str = ""
    newline: str = "\n"
    encoding: str = "utf-8"
    changed: bool = False

    def rows(self) -> Iterator[Line]:
        """Its rows."""
        return (line for line in self.lines if line.cells)

    def row(self, row_id: object) -> Line | None:
        """The row with this id, None if it is gone."""
        return next((line for line in self.rows() if line.id == row_id), None)

    def column(self, name: str) -> int:
        """The place of a column; ValueError if there is none."""
        if not name or name not in self.header:
            raise ValueError(f"{self.path.name} has no column {name!r}")
        return self.header.index(name)

    def write(self, line: Line, cells: Mapping[str, str]) -> None:
        """Change some cells of a row."""
        for name, text in cells.items():
            line.cells[self.column(name)] = self._written(name, clean(text))
        stream = io.StringIO()
        csv.writer(stream, delimiter=self.separator, lineterminator="").writerow(map(_plain, line.cells))
        line.text, self.changed = stream.getvalue(), True

    def add(self, cells: Mapping[str, str]) -> str:
        """A new row below the last of the same run, else below all rows; its id."""
        rows = list(self.rows())
        same = [
            line
            for line in rows
            if "run" in self.header and line.cells[self.column("run")] == cells.get("run")
        ]
        made = Line("", cells=[""] * len(self.header))
        above = [*(line for line in self.lines if line.id == "header"), *rows, *same][-1]
        self.lines.insert(self.lines.index(above) + 1, made)
        self.write(made, cells)
        self.name_rows()
        return made.id

    def remove(self, line: Line) -> None:
        """Remove a row."""
        self.lines.remove(line)
        self.changed = True

    def name_rows(self) -> None:
        """Give rows their ids: run, speed and sensor, or run, and how many times these stood above."""
        names = [
            k for k, name in enumerate(self.header) if name.partition("_")[0] in ("run", "speed", "sensor")
        ]
        times = Counter[str]()
        for line in self.rows():
            place = "|".join(line.cells[k] for k in names)
            times[place] += 1
            line.id = f"{place}|{times[place]}"

    def data(self) -> bytes:
        """The whole file."""
        return self.newline.join(line.text for line in self.lines).encode(self.encoding)

    def _written(self, column: str, text: str) -> str:
        """A number with the decimal sign of the file; 1,350 and 1.350 stay, since they may mean thousands."""
        unclear = not decimal_comma([text.replace(".", ",")], "\t")
        if is_text(column) or not _NUMBER.fullmatch(text) or unclear:
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
    table = shown(path, key, grid)
    rows = {line.number: line for line in table.lines}
    texts = re.split(r"\r\n|\n|\r", text)
    above = 1 if SEP_LINE.fullmatch(texts[0].strip(" \ufeff")) else 0
    table.lines = [rows.get(k, Line("")) for k in range(1 - above, len(texts) + 1 - above)]
    for line, its in zip(table.lines, texts, strict=True):
        line.text = its
    table.lines[grid.header_row - 1 + above].id = "header"
    pairs = [pair for line in rows.values() for pair in zip(grid.header, line.cells, strict=True)]
    numbers = [cell for name, cell in pairs if not is_text(name)]
    if decimal_comma(numbers, grid.separator):
        table.sign = ","
    elif grid.separator == "," or any("." in cell for cell in numbers):
        table.sign = "."
    table.separator, table.newline = grid.separator, "\r\n" if "\r\n" in text else "\n"
    table.encoding = "utf-8" if data == text.encode() else "utf-8-sig"
    return table


def shown(path: Path, key: str, grid: Grid) -> Table:
    """What the reader of tables makes of a file or a sheet, without the lines between its rows."""
    rows = [Line("", n, [getattr(cell, "text", show(cell)) for cell in row]) for n, row in grid.rows]
    table = Table(path, grid.header, rows, _untidy(path.name, key, grid.header))
    table.name_rows()
    return table


def is_text(column: str) -> bool:
    """Whether a column holds names or remarks, in which nothing is a number."""
    return column in TEXT_COLUMNS or column.casefold().startswith(REMARKS)


def _plain(cell: str) -> str:
    """Without what a spreadsheet would run; numbers stay."""
    return cell if _NUMBER.fullmatch(cell) else guarded(cell)


def _untidy(name: str, key: str, header: Sequence[str]) -> str:
    """Why a table of other columns is not edited; empty for the form that the page writes."""
    columns = runs.COLUMNS if key in READINGS else weights.COLUMNS
    stems = [column.stem for one in header if (column := column_of(one, columns)) is not None]
    needed = {column.stem for column in columns if column.required}
    if any(name.startswith("unbalance_") for name in header):
        needed.discard("mass")
    if needed <= set(stems) and len(set(stems)) == len(stems):
        return ""
    form = "run, speed, sensor, amplitude, phase" if key in READINGS else "run, plane, mass, angle"
    return f"{name} has other columns than {form}: it is read as it is, edit it where it comes from"
