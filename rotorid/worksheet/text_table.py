"""A table of a job as its file holds it, line by line, so that an edit changes its row alone."""

from __future__ import annotations

import csv
import io
import re
import warnings
from collections import Counter
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, field, replace
from pathlib import Path

from rotorid.base.tables import guarded
from rotorid.files.cells import SEP_LINE, Grid, clean, decimal_comma, decode, parse_text, show
from rotorid.files.headings import find_header
from rotorid.files.job_models import READINGS
from rotorid.files.problems import InputError, Problems

_NUMBER = re.compile(r"[+-]?(?:[0-9]+[.,]?[0-9]*|[.,][0-9]+)(?:[eE][+-]?[0-9]+)?")


class Conflict(ValueError):
    """What an edit changes is not what it was."""


@dataclass(eq=False)
class Line:
    """One line of a file; `cells` is empty in a comment, a blank line and the header.

    `number` is that of a spreadsheet; `id` what edits call the row.
    """

    text: str = ""
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
    separator, newline, encoding
        What stands between cells and between lines; of the file.
    changed
        Whether it was edited.
    """

    path: Path
    header: Sequence[str] = ()
    lines: list[Line] = field(default_factory=list)
    read_only: str = ""
    separator: str = ","
    newline: str = "\n"
    encoding: str = "utf-8"
    changed: bool = False

    def columns(self) -> dict[str, str]:
        """Names of the columns by what they hold."""
        return {content(name): name for name in reversed(self.header)}

    def rows(self) -> Iterator[Line]:
        """Its rows."""
        return (line for line in self.lines if line.cells)

    def row(self, row_id: str) -> Line:
        """The row with this id; Conflict if it is gone."""
        for line in self.rows():
            if line.id == row_id:
                return line
        raise Conflict(f"a row of {self.path.name} is not there any more")

    def column(self, name: str) -> int:
        """The place of a column; ValueError if there is none."""
        if not name or name not in self.header:
            raise ValueError(f"{self.path.name} has no column {name!r}")
        return self.header.index(name)

    def write(self, line: Line, cells: Mapping[str, str]) -> None:
        """Change some cells of a row."""
        for name, text in cells.items():
            line.cells[self.column(name)] = self._written(clean(text))
        stream = io.StringIO()
        plain = [cell if _NUMBER.fullmatch(cell) else guarded(cell) for cell in line.cells]
        csv.writer(stream, delimiter=self.separator, lineterminator="").writerow(plain)
        line.text, self.changed = stream.getvalue(), True

    def add(self, cells: Mapping[str, str]) -> None:
        """A new row below the last of the same run, else below all rows."""
        run, made = self.column("run"), Line(cells=[""] * len(self.header))
        rows = list(self.rows())
        same = [line for line in rows if line.cells[run] == cells.get("run")]
        above = [*(line for line in self.lines if line.id == "header"), *rows, *same][-1]
        self.lines.insert(self.lines.index(above) + 1, made)
        self.write(made, cells)
        self.name_rows()

    def name_rows(self) -> None:
        """Give rows their ids: run, speed and sensor, or run, and how many times these stood above."""
        names = [k for k, name in enumerate(self.header) if content(name) in ("run", "speed", "sensor")]
        times = Counter[str]()
        for line in self.rows():
            place = "|".join(line.cells[k] for k in names)
            times[place] += 1
            line.id = f"{place}|{times[place]}"

    def data(self) -> bytes:
        """The whole file."""
        return self.newline.join(line.text for line in self.lines).encode(self.encoding)

    def _written(self, text: str) -> str:
        """A number with the decimal sign of the file; 1,350 and 1.350 stay, since they may mean thousands."""
        if not decimal_comma([text.replace(".", ",")], "\t"):
            return text
        numbers = " ".join(cell for line in self.rows() for cell in line.cells if _NUMBER.fullmatch(cell))
        if self.separator == "," or "." in numbers:
            return text.replace(",", ".")
        return text.replace(".", ",") if "," in numbers else text


def content(column: str) -> str:
    """What a column holds, by its name."""
    return "weight" if re.match("mass|unbalance", column) else re.split("[_ ]", column)[0]


def read_table(path: Path, key: str, data: bytes) -> Table:
    """The table that the job names by `key`; one of another form is read only."""
    find = find_header if key in READINGS else None
    try:
        with warnings.catch_warnings():
            warnings.simplefilter("ignore")  # of a guessed encoding; the calculation says so
            text = decode(path.name, data)
        grid = parse_text(path.name, text, Problems(), may_be_empty=True, find=find)
    except InputError as error:
        return Table(path, read_only=str(error))
    table, texts = shown(path, key, grid), re.split(r"\r\n|\n|\r", text)
    rows = {grid.header_row: Line(id="header")} | {line.number: line for line in table.lines}
    first = 0 if SEP_LINE.fullmatch(texts[0].strip(" \ufeff")) else 1
    table.lines = [replace(rows.get(n, Line()), text=line) for n, line in enumerate(texts, first)]
    table.separator, table.newline = grid.separator, "\r\n" if "\r\n" in text else "\n"
    table.encoding = "utf-8" if data == text.encode() else "utf-8-sig"
    return table


def shown(path: Path, key: str, grid: Grid) -> Table:
    """What the reader of tables makes of a file or a sheet, without the lines between its rows.

    Of other columns than those that the page writes it is not edited.
    """
    rows = [Line("", n, [getattr(cell, "text", show(cell)) for cell in row]) for n, row in grid.rows]
    table = Table(path, grid.header, rows)
    form = ["run", "speed", "sensor", "amplitude", "phase"]
    if key not in READINGS:
        form = ["run", "plane", "weight", "angle"]
    names = table.columns()
    if not {*names, "phase"} >= {*form} or len(names) < len(grid.header):  # some instruments show no phase
        why = f"{path.name} has other columns than {', '.join(form)}"
        table.read_only = f"{why}: it is read as it is, edit it where it comes from"
    table.name_rows()
    return table
