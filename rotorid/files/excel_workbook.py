"""Excel workbooks (.xlsx): sheets into rows of cells."""

from __future__ import annotations

import io
import re
import warnings
import zipfile
from pathlib import Path
from typing import Any

from rotorid.files.cells import MOST_CELLS, BadCell, Cell, Row, Shown, clean
from rotorid.files.disk import file_content
from rotorid.files.input_problems import InputError, Problems, refusal

MOST_UNPACKED = 200_000_000
"""Bytes of all parts of a workbook."""
_DIGITS = re.compile(r"(?:#,##)?0(?=[.E])(?:\.(0+))?(E\+0+)?")
"""A number format with decimals or a power of ten."""
_REFUSED = {
    "f": "a formula with its stored value: open and save the file in Excel",
    "e": "a value, not an error of the spreadsheet",
    "b": "a number or text, not a logical value",
    "d": "a number or text; the spreadsheet turned the cell into a date or time",
}
"""What is expected instead of a cell of these types of openpyxl."""


def read_workbook(path: Path, problems: Problems) -> dict[str, list[Row]]:
    """All sheets of a workbook as rows of cells; InputError where it is none.

    Formulas count with the values that the spreadsheet program stored.
    """
    try:
        return _sheets(path, file_content(path), problems)
    except InputError:
        raise
    except Exception as error:  # openpyxl lets errors of zip, XML and its own through, of any class
        reason = str(error).splitlines()[0] if str(error) else type(error).__name__
        raise refusal(path, f"an intact Excel workbook (reading it failed: {reason})") from None


def _sheets(path: Path, data: bytes, problems: Problems) -> dict[str, list[Row]]:
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

    if not data.startswith(b"PK"):
        raise refusal(path, "an Excel workbook, as the name says; this is none")
    with zipfile.ZipFile(io.BytesIO(data)) as archive:
        size = sum(part.file_size for part in archive.infolist())
    if size > MOST_UNPACKED:  # known before anything is unpacked
        most = f"a workbook of at most {MOST_UNPACKED / 1e6:.0f} MB unpacked"
        raise refusal(path, f"{most}; this one has {size / 1e6:.0f} MB")
    sheets: dict[str, list[Row]] = {}
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")  # about styles and validation rules, which do not concern us
        book = openpyxl.load_workbook(io.BytesIO(data), data_only=True, read_only=True)
        if "schema_version" in book.custom_doc_props.names:
            problems.refuse_newer(str(path), book.custom_doc_props["schema_version"].value)
        dates = {"date_formats": book._date_formats, "timedelta_formats": book._timedelta_formats}
        for sheet in book.worksheets:
            rows, total = sheets.setdefault(sheet.title, []), 0
            # not its iter_rows, which fills gaps up to the last format and drops rows that are not in order
            with sheet._get_source() as source:
                parser = Parser(source, sheet._shared_strings, data_only=True, epoch=book.epoch, **dates)
                for number, written in parser.parse():
                    cells = {one["column"]: _cell(ReadOnlyCell(sheet, **one)) for one in written}
                    width = max((place for place, cell in cells.items() if cell != ""), default=0)
                    if width:
                        rows.append((number, tuple(cells.get(place, "") for place in range(1, width + 1))))
                    total += width
                    if total > MOST_CELLS:
                        most = f"a workbook of at most {MOST_CELLS:,} cells"
                        raise refusal(path, f"{most}; this one has more")
            rows.sort(key=lambda row: row[0])
    return sheets


def _cell(cell: Any) -> Cell:  # noqa: ANN401
    """The cell of openpyxl: text, or a number with the digits that its format shows if that is all of it."""
    value = cell.value
    if value is None:
        return ""
    if cell.data_type in _REFUSED:
        text = str(getattr(value, "text", value))
        return BadCell(text.upper() if cell.data_type == "b" else text, _REFUSED[cell.data_type])
    if not isinstance(value, (int, float)):
        return clean(str(value))
    if "%" in str(cell.number_format):
        return BadCell(f"{100 * value:g}%", "a plain number; the cell is formatted as a percentage")
    form = _DIGITS.fullmatch(str(cell.number_format))
    if form is None:
        return value
    text = f"{value:.{len(form[1] or '')}{'e' if form[2] else 'f'}}"
    return Shown(value, text) if float(text) == value else value


def pick_sheet(
    path: Path, sheets: dict[str, list[Row]], name: str, *, first: bool = False
) -> tuple[str, list[Row]]:
    """The sheet of this name, else the only one that holds something (or, with `first`, the first)."""
    there = [title for title in sheets if title.strip().casefold() == name][:1]
    there = there or [title for title, rows in sheets.items() if rows] or list(sheets)
    if there and (first or len(there) == 1):
        return there[0], sheets[there[0]]
    raise refusal(path, f"a sheet {name!r}; the sheets are {', '.join(sheets)}")
