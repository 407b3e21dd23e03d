"""The files of a job as texts: tables line by line and keys, so that an edit changes its row or key alone."""

from __future__ import annotations

import codecs
import csv
import io
import re
import tomllib
import warnings
from collections import Counter
from collections.abc import Iterator, Mapping, Sequence
from contextlib import suppress
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Any

from rotorid.base.tables import guarded
from rotorid.files.cells import SEP_LINE, Grid, clean, decimal_comma, decode, parse_text, show
from rotorid.files.headings import find_header
from rotorid.files.input_problems import InputError, Problems
from rotorid.files.job_keys import READINGS, named_tables

KEYS = ("runs", "weights", "check", "check_weights")
"""Tables that are shown."""
NUMBER = re.compile(r"[+-]?(?:[0-9]+[.,]?[0-9]*|[.,][0-9]+)(?:[eE][+-]?[0-9]+)?")


class Conflict(ValueError):
    """What an edit changes is not what it was."""


@dataclass(eq=False)
class Line:
    """One line of a file; a row has `cells`, its `number` in a spreadsheet, and an `id` for edits."""

    text: str = ""
    number: int = 0
    cells: dict[str, str] = field(default_factory=dict)
    id: str = ""


@dataclass(eq=False)
class Table:
    """A table as the page shows it."""

    path: Path  # or what messages call its sheet
    header: Sequence[str] = ()
    lines: list[Line] = field(default_factory=list)  # of a sheet its rows alone
    read_only: str = ""  # why it cannot be edited
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

    def write(self, line: Line, cells: Mapping[str, str]) -> None:
        """Change some cells of a row."""
        for name, text in cells.items():
            if name not in self.header:
                raise ValueError(f"{self.path.name} has no column {name!r}")
            line.cells[name] = self._written(clean(text))
        stream = io.StringIO()
        plain = (cell if NUMBER.fullmatch(cell) else guarded(cell) for cell in line.cells.values())
        csv.writer(stream, delimiter=self.separator, lineterminator="").writerow(plain)
        line.text, self.changed = stream.getvalue(), True

    def add(self, cells: Mapping[str, str]) -> None:
        """A new row below the last of the same run, else below all rows."""
        made, rows = Line(cells=dict.fromkeys(self.header, "")), list(self.rows())
        same = [line for line in rows if line.cells.get("run") == cells.get("run")]
        above = [*(line for line in self.lines if line.id == "header"), *rows, *same][-1]
        self.lines.insert(self.lines.index(above) + 1, made)
        self.write(made, cells)

    def state(self, key: str) -> dict[str, Any]:
        """What the page shows, by what columns hold; of a row its `id`, too, and where it is `at`."""
        columns = self.columns()
        rows = [
            {what: line.cells[name] for what, name in columns.items()}
            | {"id": f"{key}|{line.id}", "at": f"{self.path} {line.number}"}
            for line in self.rows()
        ]
        return {"columns": columns, "rows": rows, "header": [*self.header], "read_only": self.read_only}

    def data(self) -> bytes:
        """The whole file."""
        return self.newline.join(line.text for line in self.lines).encode(self.encoding)

    def _written(self, text: str) -> str:
        """A number with the decimal sign of the file; 1,350 and 1.350 stay, since they may mean thousands."""
        if not decimal_comma([text.replace(".", ",")], "\t"):
            return text
        cells = (cell for line in self.rows() for cell in line.cells.values())
        numbers = " ".join(cell for cell in cells if NUMBER.fullmatch(cell))
        if self.separator == "," or "." in numbers:
            return text.replace(",", ".")
        return text.replace(".", ",") if "," in numbers else text


def content(column: str) -> str:
    """What a column holds, by its name."""
    return "weight" if re.match("mass|unbalance", column) else re.split("[_ ]", column)[0]


def read_table(path: Path, key: str, data: bytes) -> Table:
    """The table that the job names by `key`; one that cannot be read is read only."""
    try:
        with warnings.catch_warnings():
            warnings.simplefilter("ignore")  # of a guessed encoding; the calculation says so
            text = decode(path.name, data)
        find = find_header if key in READINGS else None
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

    A row is called by its run, speed and sensor, and how many times these stood above. A table of other
    columns than those that the page writes is not edited.
    """
    table, times = Table(path, grid.header), Counter[str]()
    for number, *row in zip(grid.numbers, *grid.columns, strict=True):
        cells = {name: getattr(cell, "text", show(cell)) for name, cell in zip(grid.header, row, strict=True)}
        place = "|".join(cells[name] for name in cells if content(name) in ("run", "speed", "sensor"))
        times[place] += 1
        table.lines.append(Line("", number, cells, f"{place}|{times[place]}"))
    form = "run speed sensor amplitude phase" if key in READINGS else "run plane weight angle"
    names = table.columns()
    # some instruments show no phase
    if not {*names, "phase"} >= {*form.split()} or len(names) < len(grid.header):
        why = f"{path.name} has other columns than {', '.join(form.split())}"
        table.read_only = f"{why}: it is read as it is, edit it where it comes from"
    return table


def settings_in(data: bytes) -> dict[str, Any]:
    """What a job file holds; ValueError or RecursionError if it is no TOML."""
    return tomllib.loads(data.decode("utf-8-sig").replace("\r\n", "\n"))


def text_of(value: object) -> str:
    """A setting as one types it: a list "5; 10", values by name "3000: 20; 4500: 30"."""
    if isinstance(value, Mapping):
        return "; ".join(f"{key}: {text_of(one)}" for key, one in value.items())
    if isinstance(value, list):
        return "; ".join(map(text_of, value))
    return "" if value is None else str(value).removesuffix(".0")


def _texts(settings: object) -> list[Any]:
    """Settings, each with its name, its text, and the settings in it."""
    if not isinstance(settings, Mapping):
        return []
    return [[name, text_of(value), _texts(value)] for name, value in settings.items()]


def value_of(key: str, text: str) -> Any:  # noqa: ANN401  any type of TOML
    """The setting that was typed; None for nothing."""
    parts = [part.strip() for part in text.split(";") if part.strip()]
    if ":" in text:
        return {name.strip(): _one(value.strip()) for name, _, value in (one.partition(":") for one in parts)}
    values = [*map(_one, parts)]
    if len(values) > 1 or (values and key.startswith(("available", "stock", "holes_"))):  # these are lists
        return values
    return values[0] if values else None


def _one(word: str) -> float | str:
    number = word.replace(",", ".")
    if not NUMBER.fullmatch(word):
        return word
    return int(number) if number.lstrip("+-").isdigit() else float(number)


def _change(table: Any, key: Sequence[str], new: Any) -> None:  # noqa: ANN401
    """Change one setting, or (None) remove it and the tables that are empty then."""
    first, *rest = key
    if rest:
        _change(table.setdefault(first, {}), rest, new)
    else:
        table[first] = {} if new is None else new
    if new is None and not table[first]:
        del table[first]


@dataclass(eq=False)
class Job:
    """What the files of a job say, edited in place before they are written."""

    text: bytes | None = None  # of the job file, if there is one
    settings: dict[str, Any] = field(default_factory=dict)
    tables: dict[str, Table] = field(default_factory=dict)  # by `KEYS`
    read_only: str = ""  # why nothing can be edited

    def state(self) -> dict[str, Any]:
        """What the page shows; of settings the texts, in the order of the file."""
        tables = {key: table.state(key) for key, table in self.tables.items()}
        return {"settings": _texts(self.settings), "tables": tables, "read_only": self.read_only}

    def _set(self, key: Sequence[str], new: Any) -> None:  # noqa: ANN401
        """Change a setting, add it, or (None) remove it; comments and order of the file stay."""
        import tomlkit

        with suppress(ValueError, TypeError, AttributeError, LookupError):  # tomlkit stumbles over odd files
            document = tomlkit.parse((self.text or b"").decode("utf-8-sig"))
            _change(self.settings, key, new)
            _change(document, key, new)
            self.text = tomlkit.dumps(document).encode()
            if settings_in(self.text) == self.settings:
                return
        raise ValueError(f"{'.'.join(key)} cannot be changed here: change it in the job file itself")

    def edit(self, edit: Mapping[str, Any], folder: Path) -> None:
        """Carry out one edit; a table that is made gets a name that is free in the folder."""
        if self.read_only:
            raise ValueError(self.read_only)
        if "create" in edit:
            self._create(edit["create"], edit["header"], folder)
            return
        whole = edit.get("table") or edit.get("delete") or edit["cell"]
        name, _, place = whole.partition("|")
        row, _, column = place.rpartition("|")
        if name not in KEYS:
            key = [part for part in (name, row, column) if part]
            now: Any = self.settings
            for part in key:
                now = now.get(part) if isinstance(now, dict) else None
            if _is_new(text_of(now), edit, ".".join(key)):
                self._set(key, value_of(key[-1], edit["new"]))
            return
        table = self.tables[name]
        if table.read_only:
            raise ValueError(table.read_only)
        if "cells" in edit:
            table.add({name: str(text) for name, text in edit["cells"].items()})
        elif "delete" in edit:
            table.lines.remove(table.row(place))
            table.changed = True
        else:
            line = table.row(row)
            if _is_new(line.cells[column], edit, f"{column} in a row of {table.path.name}"):
                table.write(line, {column: edit["new"]})

    def _create(self, key: str, header: Sequence[str], folder: Path) -> None:
        """Begin a table in a file that the job names then."""
        if key not in KEYS or key in self.tables or isinstance(self.settings.get(key), list):
            raise ValueError(f"a table {key!r} cannot be made: there is one, or none of this name")
        name = named_tables(self.settings).get(key)
        if name is None:
            names = (f"{key}{end}.csv" for end in ("", *range(2, 1000)))
            name = next(name for name in names if not (folder / name).exists())
            self._set([key], name)
        separator = next((one.separator for one in self.tables.values() if one.lines), ",")
        # with a mark, because Excel takes a file without it for its own 8-bit encoding
        data = codecs.BOM_UTF8 + f"{separator.join(header)}\n".encode()
        self.tables[key] = read_table(folder / name, key, data)
        self.tables[key].changed = True


def _is_new(now: str, edit: Mapping[str, Any], what: str) -> bool:
    """Whether an edit changes a text; Conflict if it is neither the old one nor the new one."""
    new = clean(edit["new"])
    if now not in (new, clean(edit.get("old", now))):
        raise Conflict(f"{what} was changed meanwhile: {now!r} is there now")
    return now != new
