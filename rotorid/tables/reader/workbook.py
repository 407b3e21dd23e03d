"""Workbooks (.xlsx): sheets into rows of cells."""

from __future__ import annotations

import datetime
import io
import re
import warnings
from collections.abc import Iterator
from pathlib import Path
from typing import Any

from rotorid.tables.reader.grid import BadCell, Cell, Row, Shown, clean
from rotorid.tables.reader.problems import Problems
from rotorid.tables.reader.text_file import read_bytes

SUFFIXES = (".xlsx", ".xlsm")
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
    if not data.startswith(b"PK"):
        problems.add(str(path), None, None, None, "an Excel workbook, as the name says; this is none")
        return None
    try:
        values, formulas = _load(data, values=True), _load(data, values=False)
        return {
            sheet.title: list(_rows(sheet, formulas[sheet.title]))
            for sheet in values.worksheets
            if sheet.title in formulas.sheetnames
        }
    except Exception as error:  # openpyxl lets errors of zip, XML and its own through, of any class
        reason = str(error).splitlines()[0] if str(error) else type(error).__name__
        problems.add(str(path), None, None, None, f"an intact Excel workbook (reading it failed: {reason})")
        return None


def _load(data: bytes, *, values: bool) -> Any:  # noqa: ANN401  openpyxl has no types
    import openpyxl

    with warnings.catch_warnings():
        warnings.simplefilter("ignore")  # about styles and validation rules, which do not concern us
        return openpyxl.load_workbook(io.BytesIO(data), data_only=values)


def _rows(values: Any, formulas: Any) -> Iterator[Row]:  # noqa: ANN401
    for row, written in zip(values.iter_rows(), formulas.iter_rows(), strict=True):
        if row:
            yield row[0].row, tuple(_cell(cell, source) for cell, source in zip(row, written, strict=True))


def _cell(cell: Any, written: Any) -> Cell:  # noqa: ANN401
    value = cell.value
    if value is None:
        if written.data_type == "f":
            formula = str(getattr(written.value, "text", written.value))
            return BadCell(formula, "a formula with its stored value: open and save the file in Excel")
        return ""
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
    named = find_sheet(sheets, name)
    if named is not None:
        return named, sheets[named]
    filled = [title for title, rows in sheets.items() if rows] or list(sheets)
    if filled and (first or len(filled) == 1):
        return filled[0], sheets[filled[0]]
    problems.add(str(path), None, None, None, f"a sheet {name!r}; the sheets are {', '.join(sheets)}")
    return None


def find_sheet(sheets: dict[str, list[Row]], name: str) -> str | None:
    """The title of the sheet of this name, capitals aside."""
    return next((title for title in sheets if title.strip().casefold() == name), None)
