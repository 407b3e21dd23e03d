"""Jobs in a workbook that rotorid has made: single cells of its sheets changed, all other sheets kept."""

from __future__ import annotations

import io
import re
import warnings
import zipfile
from collections.abc import Callable, Mapping, Sequence
from copy import copy
from functools import cached_property
from pathlib import Path
from typing import Any

from rotorid.tables.job.job_from_excel import NAMED, OPTIONAL, SETTINGS, job_in_sheets, key_parts
from rotorid.tables.job.job_keys import CELLS, READINGS
from rotorid.tables.job.workbook_sheets import dotted_key, number_cell, setting_cell
from rotorid.tables.reader.columns import sheet_source
from rotorid.tables.reader.decimal_numbers import NotANumber, decimal_comma
from rotorid.tables.reader.excel_pages import header_row, put, sized
from rotorid.tables.reader.excel_workbook import sheets_in
from rotorid.tables.reader.grid import Cell, Row, clean, from_header, make_grid, show
from rotorid.tables.reader.problems import InputError, Problems
from rotorid.worksheet.settings_cells import with_setting
from rotorid.worksheet.text_cells import IS_HEADER, KEYS, Cells, is_text

_LOST = re.compile(
    r"xl/(charts|media|embeddings|activeX|ctrlProps|slicers|drawings/d|externalL|vba|threaded)"
)
"""Parts of workbooks that openpyxl does not keep."""


class SheetCells(Cells):
    """A table in a sheet; `sheet` gives it as openpyxl has it."""

    def __init__(self, name: str, rows: Sequence[Row], table: str, sheet: Callable[[], Any]) -> None:
        super().__init__(name)
        self._sheet, problems = sheet, Problems()
        shaped = from_header(list(rows), IS_HEADER) if table in READINGS else rows
        grid = make_grid(name, shaped, "", problems, may_be_empty=True)
        self._cells: list[list[str]] = [[] for _ in range(rows[-1][0] if rows else 0)]
        for number, cells in rows:
            self._cells[number - 1] = [getattr(cell, "text", show(cell)) for cell in cells]
        self.lines = [repr(cells) for cells in self._cells]
        self.fill(table, grid, problems, 0)

    def cells(self, index: int) -> list[str]:
        """Cells of a row as they are now."""
        return (self._cells[index] + [""] * len(self.header))[: len(self.header)]

    def put(self, index: int, column: str, text: str) -> None:
        """Change one cell: a number to a number, names and all else to text."""
        place, text = self.column(column), clean(text)
        self._cells[index] = self.cells(index)
        self._cells[index][place] = text
        value: Cell = text
        try:
            value = text if is_text(column) else number_cell(text, "", comma=decimal_comma([text], ""))
        except NotANumber:
            pass
        _put(self._sheet().cell(index + 1, place + 1), value)

    def insert(self, after: int, cells: Mapping[str, str], row_id: str) -> None:
        """Insert a row; rules of whole columns hold for it, too."""
        self._sheet().insert_rows(after + 2)
        self._cells.insert(after + 1, [])
        self.lines.insert(after + 1, "")
        self.ids.insert(after + 1, row_id)
        self.end += after <= self.end
        for column, text in cells.items():
            self.put(after + 1, column, text)

    def delete(self, index: int) -> None:
        """Delete a row."""
        self._sheet().delete_rows(index + 1)
        del self._cells[index], self.lines[index], self.ids[index]
        self.end -= index <= self.end


class WorkbookVersion:
    """A job in a workbook as it is at one time; see `FilesVersion`."""

    def __init__(self, job: Path, read: Callable[[Path], bytes | None]) -> None:
        self.job, self._read = job, read
        data = read(job)
        self.data: dict[Path, bytes | None] = {job: data}
        self.tables: dict[str, Cells] = {}
        self.settings: dict[str, Any] = {}
        self._bytes, problems = data or b"", Problems()
        sheets = sheets_in(job, self._bytes, problems)
        self.read_only = _kept_from_edits(job.name, self._bytes)
        if sheets is None:
            self.read_only = str(InputError(problems))
        named = {title.strip().casefold(): title for title in reversed(list(sheets or {}))}
        said = {title: (sheets or {})[title] for name, title in named.items() if name in SETTINGS}
        try:  # runs of any kind: what is wrong with the tables must not hide the settings
            self.settings = job_in_sheets(
                job, {**said, "runs": [(1, ("run",)), (2, ("1",))]}, Problems()
            ).settings
        except InputError as error:
            self.read_only = str(error)
        for key in KEYS:
            if key in named and (sheets or {})[named[key]]:
                self._table(key, named[key], (sheets or {})[named[key]])
        self.paths = dict.fromkeys(self.tables, job)

    def _table(self, key: str, title: str, rows: Sequence[Row]) -> None:
        name = sheet_source(Path(self.job.name), title)
        self.tables[key] = SheetCells(name, rows, key, lambda: self._book[title])

    @cached_property
    def _book(self) -> Any:  # noqa: ANN401  openpyxl has no types
        import openpyxl

        with warnings.catch_warnings():
            warnings.simplefilter("ignore")
            return openpyxl.load_workbook(io.BytesIO(self._bytes))

    def put_setting(self, key: Sequence[str], new: Any) -> None:  # noqa: ANN401
        """Change, add or (None) remove a setting."""
        self.settings = with_setting(self.settings, key, new)
        if key[0] in NAMED and len(key) == 2:
            for name in new or [""]:
                self._put_named(key, name, (new or {}).get(name))
        elif key[0] in NAMED and len(key) == 3:
            self._put_named(key[:2], key[2], new)
        elif key[0] in NAMED:
            raise ValueError(f"{'.'.join(key)} is no setting of a plane or sensor")
        else:
            self._put("settings", ["key", "value"], dotted_key(key), "value", new, whole=new is None)

    def _put_named(self, key: Sequence[str], column: str, new: Any) -> None:  # noqa: ANN401
        name = NAMED[key[0]][0]
        self._put(key[0], [name], key[1], column or name, new, whole=not column)

    def _put(
        self, title: str, header: Sequence[str], item: str, column: str, new: Any, *, whole: bool
    ) -> None:  # noqa: ANN401
        """Put a value into a row and a column by their names, which are added where they are missing."""
        sheet, lines = self._sheet(title, header)
        top = header_row(lines)
        names = lines[top - 1]
        at = next(i for i, name in enumerate(names) if name.casefold() in (header[0], "setting"))
        rows = [n for n, cells in enumerate(lines, 1) if n > top and key_parts(cells[at]) == key_parts(item)]
        row = rows[0] if rows else len(lines) + 1
        if whole:
            for place in range(len(names)):
                if OPTIONAL not in names or names[place] == column:
                    sheet.cell(row, place + 1).value = None
            return
        if not rows:
            _put(sheet.cell(row, at + 1), item)
        if column not in names:
            names.append(column)
            _put(sheet.cell(top, len(names)), column)
            sheet.cell(top, len(names))._style = copy(sheet.cell(top, at + 1)._style)
        value = "" if new is None else setting_cell(column, new)
        kind = CELLS.get(key_parts(item)[-1] if title == "settings" else column)
        _put(sheet.cell(row, names.index(column) + 1), show(value) if kind in ("name", "words") else value)

    def _sheet(self, title: str, header: Sequence[str]) -> tuple[Any, list[list[str]]]:
        """A sheet, made with this header where there is none, and its cells as text."""
        found = [sheet for sheet in self._book.worksheets if sheet.title.strip().casefold() == title]
        sheet = found[0] if found else self._book.create_sheet(title)
        lines = [
            [clean("" if v is None else str(v)) for v in row] for row in sheet.iter_rows(values_only=True)
        ]
        while lines and not any(lines[-1]):
            lines.pop()
        if not header_row([tuple(line) for line in lines]):
            for place, name in enumerate(header, 1):
                _put(sheet.cell(len(lines) + 1, place), name)
            lines.append(list(header))
        while not lines[header_row([tuple(line) for line in lines]) - 1][-1]:
            lines = [line[:-1] for line in lines]
        return sheet, lines

    def create(self, key: str, header: Sequence[str]) -> None:
        """Begin a table in a sheet of its own."""
        sheet, lines = self._sheet(key, header)
        self._table(key, sheet.title, [(n, tuple(line)) for n, line in enumerate(lines, 1) if any(line)])
        self.tables[key].ids = [""] * len(lines)
        self.paths[key] = self.job

    def written(self) -> dict[Path, bytes]:
        """The workbook, if it is not as it was."""
        if "_book" not in vars(self):
            return {}
        for sheet in self._book.worksheets:
            for row in sheet.iter_rows():
                for cell in row:
                    if cell.comment is not None:  # openpyxl does not read its size
                        sized(cell.comment)
                    if isinstance(cell.value, float):  # nor would it write 17 digits
                        put(cell, cell.value, sheet.title)
        stream = io.BytesIO()
        self._book.save(stream)
        return {self.job: stream.getvalue()}


def _put(cell: Any, value: Cell) -> None:  # noqa: ANN401
    if value == "":
        cell.value = None
        return
    if isinstance(value, str):
        cell.number_format = "@"
    elif cell.number_format == "@":
        cell.number_format = "General"
    put(cell, value, cell.parent.title)


def _kept_from_edits(name: str, data: bytes) -> str:
    """Why a workbook cannot be edited here, else empty."""
    try:
        with zipfile.ZipFile(io.BytesIO(data)) as archive:
            core = archive.read("docProps/core.xml") if "docProps/core.xml" in archive.namelist() else b""
            parts = [part for part in archive.namelist() if part.startswith("xl/worksheets/sheet")]
            lost = any(_LOST.match(part) for part in archive.namelist())
            lost = lost or any(re.search(rb"<f[ >]|<extLst", archive.read(part)) for part in parts)
    except (zipfile.BadZipFile, KeyError, OSError) as error:
        return f"{name} is no intact workbook: {error}"
    if not re.search(rb"creator[^>]*>rotorid<", core):
        return f"{name} was not made by rotorid: it is shown as it is, edit it in Excel"
    if lost:
        return f"{name} holds formulas, pictures or the like, which would be lost: edit it in Excel"
    return ""
