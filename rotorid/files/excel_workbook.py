"""Excel workbooks (.xlsx): sheets into rows of cells."""

from __future__ import annotations

import datetime
import io
import re
import warnings
import zipfile
from collections.abc import Iterable, Iterator
from pathlib import Path
from typing import Any

from rotorid.files.cells import MOST_CELLS, BadCell, Cell, Row, Shown, clean, read_bytes
from rotorid.files.problems import Problems

SUFFIXES = (".xlsx", ".xlsm")
MOST_UNPACKED = 200_000_000
"""Bytes of all parts of a workbook."""
_DIGITS = re.compile(r"(?:#,##)?0(?=[.E])(?:\.(0+))?(E\+0+)?")
"""A number format with decimals or a power of ten."""


def is_workbook(path: Path) -> bool:
    """Whether the name says that the file is a workbook."""
    return path.suffix.lower() in SUFFIXES


def read_workbook(path: Path, problems: Problems) -> dict[str, list[Row]] | None:
    """All sheets of a workbook as rows of cells, or None and a problem.

    Formulas count with the values that the spreadsheet program stored.
    """
    data = read_bytes(path, problems)
    if data is None:
        return None
    try:
        if not data.startswith(b"PK"):
            raise _RefusedError("an Excel workbook, as the name says; this is none")
        with zipfile.ZipFile(io.BytesIO(data)) as archive:
            size = sum(part.file_size for part in archive.infolist())
        if size > MOST_UNPACKED:  # known before anything is unpacked
            most = f"a workbook of at most {MOST_UNPACKED / 1e6:.0f} MB unpacked"
            raise _RefusedError(f"{most}; this one has {size / 1e6:.0f} MB")
        return _sheets(str(path), data, problems)
    except _RefusedError as error:
        expected = str(error)
    except Exception as error:  # openpyxl lets errors of zip, XML and its own through, of any class
        reason = str(error).splitlines()[0] if str(error) else type(error).__name__
        expected = f"an intact Excel workbook (reading it failed: {reason})"
    problems.add(str(path), None, None, None, expected)
    return None


class _RefusedError(ValueError):
    """The message says what was expected instead."""


def _sheets(source: str, data: bytes, problems: Problems) -> dict[str, list[Row]]:
    import openpyxl
    from openpyxl.cell.read_only import ReadOnlyCell
    from openpyxl.worksheet._reader import FORMULA_TAG, WorkSheetParser

    class Parser(WorkSheetParser):  # type: ignore[misc]
        """Stored values as openpyxl reads them, and formulas that have none."""

        def parse_cell(self, element: Any) -> Any:  # noqa: ANN401
            cell = super().parse_cell(element)
            if cell["value"] is None and element.find(FORMULA_TAG) is not None:
                cell |= {"value": self.parse_formula(element), "data_type": "f"}
            return cell

    with warnings.catch_warnings():
        warnings.simplefilter("ignore")  # about styles and validation rules, which do not concern us
        book = openpyxl.load_workbook(io.BytesIO(data), data_only=True, read_only=True)
        if "schema_version" in book.custom_doc_props.names:
            problems.refuse_newer(source, book.custom_doc_props["schema_version"].value)
        found: dict[str, list[Row]] = {}
        for sheet in book.worksheets:
            # not its iter_rows, which fills gaps up to the last format and drops rows that are not in order
            with sheet._get_source() as source:
                rows = Parser(
                    source,
                    sheet._shared_strings,
                    data_only=True,
                    epoch=book.epoch,
                    date_formats=book._date_formats,
                    timedelta_formats=book._timedelta_formats,
                ).parse()
                made = ((number, [ReadOnlyCell(sheet, **cell) for cell in cells]) for number, cells in rows)
                found[sheet.title] = sorted(_rows(made), key=lambda row: row[0])
    return found


def _rows(rows: Iterable[tuple[int, list[Any]]]) -> Iterator[Row]:
    """The rows that hold something, without blanks at their ends."""
    total = 0
    for number, written in rows:
        cells = {cell.column: value for cell in written if (value := _cell(cell)) != ""}
        if not cells:
            continue
        total += max(cells)
        if total > MOST_CELLS:
            raise _RefusedError(f"a workbook of at most {MOST_CELLS:,} cells; this one has more")
        yield number, tuple(cells.get(column, "") for column in range(1, max(cells) + 1))


def _cell(cell: Any) -> Cell:  # noqa: ANN401
    value = cell.value
    if value is None:
        return ""
    if cell.data_type == "f":
        formula = str(getattr(value, "text", value))
        return BadCell(formula, "a formula with its stored value: open and save the file in Excel")
    if cell.data_type == "e":
        return BadCell(str(value), "a value, not an error of the spreadsheet")
    if isinstance(value, bool):
        return BadCell(str(value).upper(), "a number or text, not a logical value")
    if isinstance(value, (datetime.date, datetime.time, datetime.timedelta)):
        return BadCell(str(value), "a number or text; the spreadsheet turned the cell into a date or time")
    if isinstance(value, (int, float)):
        if "%" in str(cell.number_format):
            return BadCell(f"{100 * value:g}%", "a plain number; the cell is formatted as a percentage")
        return _with_digits(value, str(cell.number_format))
    return clean(str(value))


def _with_digits(value: float, number_format: str) -> float:
    """The number with the digits that its format shows, if the format shows all of it."""
    found = _DIGITS.fullmatch(number_format)
    if found is None:
        return value
    text = f"{value:.{len(found[1] or '')}{'e' if found[2] else 'f'}}"
    return Shown(value, text) if float(text) == value else value


def pick_sheet(
    path: Path, sheets: dict[str, list[Row]], name: str, problems: Problems, *, first: bool = False
) -> tuple[str, list[Row]] | None:
    """The sheet of this name, else the only one that holds something (or, with `first`, the first)."""
    there = [title for title in sheets if title.strip().casefold() == name][:1]
    there = there or [title for title, rows in sheets.items() if rows] or list(sheets)
    if there and (first or len(there) == 1):
        return there[0], sheets[there[0]]
    problems.add(str(path), None, None, None, f"a sheet {name!r}; the sheets are {', '.join(sheets)}")
    return None
