"""Jobs in a workbook that rotorid has made: single cells of its sheets changed, all other sheets kept."""

from __future__ import annotations

import io
import re
import warnings
import zipfile
from collections.abc import Callable, Mapping, Sequence
from contextlib import suppress
from copy import copy
from functools import cached_property
from pathlib import Path
from typing import Any

from rotorid.base.tables import workbook_bytes
from rotorid.base.versions import now
from rotorid.files.cells import Cell, Row, clean, make_grid, show
from rotorid.files.columns import sheet_source
from rotorid.files.decimal_numbers import NotANumber, decimal_comma
from rotorid.files.excel_pages import Line, header_row, keep_cells, put
from rotorid.files.excel_workbook import find_sheet, sheets_in
from rotorid.files.job_excel import (
    NAMED,
    OPTIONAL,
    SETTINGS,
    dotted_key,
    job_in_sheets,
    key_parts,
    number_cell,
    setting_cell,
)
from rotorid.files.job_models import READINGS
from rotorid.files.layout import rows_from_header
from rotorid.files.problems import InputError, Problems
from rotorid.worksheet.settings_cells import setting, with_setting
from rotorid.worksheet.text_cells import KEYS, Cells, is_text

_LOST = re.compile(
    r"xl/(charts|media|embeddings|activeX|ctrlProps|slicers|drawings/d|externalL|vba|threaded)"
)
"""Parts of workbooks that openpyxl does not keep; nor does it keep what it finds formulas to be."""


class SheetCells(Cells):
    """A table in a sheet; `sheet` gives it as openpyxl has it."""

    def __init__(self, name: str, rows: Sequence[Row], table: str, sheet: Callable[[], Any]) -> None:
        super().__init__(name)
        self._sheet, problems = sheet, Problems()
        self._cells: list[list[str]] = [[] for _ in range(rows[-1][0] if rows else 0)]
        for number, cells in rows:
            self._cells[number - 1] = [getattr(cell, "text", show(cell)) for cell in cells]
        self.lines = [repr(cells) for cells in self._cells]
        shaped = rows_from_header(rows, {}) if table in READINGS else rows
        self.fill(table, make_grid(name, shaped, "", problems, may_be_empty=True), problems, 0)

    def cells(self, index: int) -> list[str]:
        """Cells of a row as they are now."""
        return (self._cells[index] + [""] * len(self.header))[: len(self.header)]

    def put(self, index: int, column: str, text: str) -> None:
        """Change one cell: a number to a number, names and all else to text."""
        place, value = self.column(column), clean(text)
        self._cells[index] = self.cells(index)
        self._cells[index][place] = value
        cell: Cell = value
        with suppress(NotANumber):
            cell = value if is_text(column) else number_cell(value, "", comma=decimal_comma([value], ""))
        _put(self._sheet().cell(index + 1, place + 1), cell)

    def insert(self, after: int, cells: Mapping[str, str], row_id: str) -> None:
        """Insert a row; rules of whole columns hold for it, too."""
        self._sheet().insert_rows(after + 2)
        self._cells.insert(after + 1, [])
        self.lines.insert(after + 1, "")
        super().insert(after, cells, row_id)

    def delete(self, index: int) -> None:
        """Delete a row."""
        self._sheet().delete_rows(index + 1)
        del self._cells[index]
        super().delete(index)


class WorkbookVersion:
    """A job in a workbook as `read` gives it; edits change this copy, not the file."""

    def __init__(self, job: Path, read: Callable[[Path], bytes | None]) -> None:
        self.data: dict[Path, bytes | None] = {job: read(job)}
        self.job, self._bytes, problems = job, self.data[job] or b"", Problems()
        self.tables: dict[str, Cells] = {}
        self.settings: dict[str, Any] = {}
        self.read_only, sheets = (
            _kept_from_edits(job.name, self._bytes),
            sheets_in(job, self._bytes, problems),
        )
        said = {title: rows for title, rows in (sheets or {}).items() if title.strip().casefold() in SETTINGS}
        try:
            problems.stop()
            # with runs of any kind: what is wrong with the tables must not hide the settings
            said["runs"] = [(1, ("run",)), (2, ("1",))]
            self.settings = job_in_sheets(job, said, Problems()).settings
        except InputError as error:
            self.read_only = str(error)
        for key in KEYS:
            if sheets and (title := find_sheet(sheets, key)) and sheets[title]:
                self._open(key, title, sheets[title])
        self.paths = dict.fromkeys(self.tables, job)

    def _open(self, key: str, title: str, rows: Sequence[Row]) -> None:
        name = sheet_source(Path(self.job.name), title)
        self.tables[key] = SheetCells(name, rows, key, lambda: self._book[title])

    @cached_property
    def _book(self) -> Any:  # noqa: ANN401  openpyxl has no types
        import openpyxl

        with warnings.catch_warnings():
            warnings.simplefilter("ignore")
            return openpyxl.load_workbook(io.BytesIO(self._bytes))

    def put_setting(self, key: Sequence[str], new: Any) -> None:  # noqa: ANN401  any type of JSON
        """Change, add or (None) remove a setting."""
        old = setting(self.settings, key)
        if key[0] in NAMED and len(key) in (2, 3):
            self._put(key[0], [NAMED[key[0]][0]], key[1], new if len(key) == 2 else {key[2]: new})
        elif key[0] in NAMED:
            raise ValueError(f"{'.'.join(key)} is no setting of a plane or sensor")
        elif key[0] != "speed_weights" and isinstance(new or old, dict):
            for name in new or old:
                self.put_setting([*key, name], (new or {}).get(name))
        else:
            self._put("settings", ["key", "value"], dotted_key(key), None if new is None else {"value": new})
        self.settings = with_setting(self.settings, key, new)

    def _put(self, title: str, header: Sequence[str], item: str, values: Mapping[str, Any] | None) -> None:
        """Put values into a row by names of columns, both added if they are missing; None: blank the row."""
        sheet, lines = self._lines(title, header)
        top = header_row(lines)
        names = [str(name) for name in lines[top - 1]]
        at = next(i for i, name in enumerate(names) if name.casefold() in (header[0], "setting"))
        parts = key_parts(item)
        rows = [n for n, line in enumerate(lines[top:], top + 1) if key_parts(str(line[at])) == parts]
        row = rows[0] if rows else len(lines) + 1
        for place, name in enumerate(names, 1):
            if values is None and (OPTIONAL not in names or name == "value"):
                sheet.cell(row, place).value = None
        if values is not None and not rows:
            _put(sheet.cell(row, at + 1), item)
        for name, value in (values or {}).items():
            if name not in names:
                names.append(name)
                _put(sheet.cell(top, len(names)), name)
                sheet.cell(top, len(names))._style = copy(sheet.cell(top, at + 1)._style)
            cell = "" if value is None else setting_cell(name, value)
            _put(sheet.cell(row, names.index(name) + 1), cell)

    def _lines(self, title: str, header: Sequence[str]) -> tuple[Any, list[Line]]:
        """A sheet, made with this header where there is none, and its cells as text."""
        found = find_sheet({sheet.title: [] for sheet in self._book.worksheets}, title)
        sheet = self._book[found] if found else self._book.create_sheet(title)
        rows = sheet.iter_rows(values_only=True)
        lines: list[Line] = [tuple(clean("" if v is None else str(v)) for v in row) for row in rows]
        while lines and not any(lines[-1]):
            lines.pop()
        if not header_row(lines):
            for place, name in enumerate(header, 1):
                _put(sheet.cell(len(lines) + 1, place), name)
            return sheet, [*lines, tuple(header)]
        return sheet, lines

    def create(self, key: str, header: Sequence[str]) -> None:
        """Begin a table in a sheet of its own."""
        sheet, lines = self._lines(key, header)
        self._open(
            key, sheet.title, [(n, tuple(map(str, line))) for n, line in enumerate(lines, 1) if any(line)]
        )
        self.paths[key] = self.job

    def written(self) -> dict[Path, bytes]:
        """The workbook, if it is not as it was."""
        if "_book" not in vars(self):
            return {}
        keep_cells(self._book)
        self._book.properties.modified = now().replace(tzinfo=None)
        return {self.job: workbook_bytes(self._book)}


def _put(cell: Any, value: Cell) -> None:  # noqa: ANN401
    if value == "":
        cell.value = None
        return
    text = isinstance(value, str)
    cell.number_format = "@" if text else cell.number_format.replace("@", "General")
    put(cell, value, cell.parent.title)


def _kept_from_edits(name: str, data: bytes) -> str:
    """Why a workbook cannot be edited here, else empty."""
    try:
        with zipfile.ZipFile(io.BytesIO(data)) as archive:
            parts = archive.namelist()
            core = archive.read("docProps/core.xml") if "docProps/core.xml" in parts else b""
            sheets = [archive.read(part) for part in parts if part.startswith("xl/worksheets/sheet")]
    except (zipfile.BadZipFile, OSError) as error:
        return f"{name} is no intact workbook: {error}"
    if not re.search(rb"creator[^>]*>rotorid<", core):
        return f"{name} was not made by rotorid: it is shown as it is, edit it in Excel"
    if any(map(_LOST.match, parts)) or any(re.search(rb"<f[ >]|<extLst", sheet) for sheet in sheets):
        return f"{name} holds formulas, pictures or the like, which would be lost: edit it in Excel"
    return ""
