"""Excel pages for people: bold headers that stay in sight, names as text."""

from __future__ import annotations

import re
from collections.abc import Sequence
from dataclasses import dataclass
from decimal import Decimal
from typing import Any

from rotorid.base.tables import workbook_bytes
from rotorid.base.versions import SCHEMA_VERSION, now
from rotorid.files.cells import BadCell, Cell, Shown

_NARROWEST = 12

Line = tuple[Cell | None, ...]
"""A row of cells; `""` and None are blanks."""


@dataclass(frozen=True)
class Page:
    """One sheet.

    Attributes
    ----------
    title
        Its name.
    lines
        Rows of cells; rows whose first cell begins with # stand above the header.
    """

    title: str
    lines: Sequence[Line]


def book_bytes(pages: Sequence[Page], shown: str, book: Any = None) -> bytes:  # noqa: ANN401
    """A workbook (.xlsx) of these pages, behind those of `book`, opened at the one of the title `shown`.

    Raises
    ------
    ValueError
        For what no workbook holds: control characters, sheets that are too long.
    """
    import openpyxl
    from openpyxl.packaging.custom import IntProperty

    if book is None:
        book = openpyxl.Workbook()
        book.remove(book.active)
        book.properties.creator = "rotorid"
        book.properties.created = now().replace(tzinfo=None)
        book.custom_doc_props.append(IntProperty(name="schema_version", value=SCHEMA_VERSION))
    book.properties.modified = now().replace(tzinfo=None)
    keep_cells(book)
    for sheet in book.worksheets:
        sheet.sheet_view.tabSelected = False
    for page in pages:
        sheet = book.create_sheet(page.title)
        _write(sheet, page)
        sheet.sheet_view.tabSelected = page.title == shown
    book.active = book.sheetnames.index(shown)
    return workbook_bytes(book)


def keep_cells(book: Any) -> None:  # noqa: ANN401
    """Keep what openpyxl would change of a workbook that it has read: sizes of comments, the last digits."""
    for sheet in book.worksheets:
        for cell in (cell for row in sheet.iter_rows() for cell in row):
            if cell.comment is not None:
                sized(cell.comment)
            if isinstance(cell.value, float):
                put(cell, cell.value, sheet.title)


def header_row(lines: Sequence[Line]) -> int:
    """Row of the header, from 1: the first that is not empty and no comment; 0 without one."""
    for number, cells in enumerate(lines, start=1):
        if any(cell not in ("", None) for cell in cells) and not str(cells[0]).startswith("#"):
            return number
    return 0


def _write(sheet: Any, page: Page) -> None:  # noqa: ANN401  openpyxl has no types
    from openpyxl.styles import Font, PatternFill
    from openpyxl.utils import get_column_letter

    top = header_row(page.lines)
    header = page.lines[top - 1] if top else ()
    for number, cells in enumerate(page.lines, start=1):
        for place, value in enumerate(cells, start=1):
            if value is not None and value != "":
                cell = sheet.cell(number, place)
                put(cell, value, page.title)
                if isinstance(value, str):
                    cell.number_format = "@"
    for place, name in enumerate(header, start=1):
        sheet.column_dimensions[get_column_letter(place)].width = max(_NARROWEST, len(str(name)) + 2)
        cell = sheet.cell(top, place)
        cell.font, cell.fill = Font(bold=True), PatternFill("solid", fgColor="FFE6E6E6")
    if top:
        sheet.freeze_panes = f"A{top + 1}"


def put(cell: Any, value: Cell, title: str) -> None:  # noqa: ANN401
    """Give a cell a value: numbers with all digits, text never as a formula."""
    if isinstance(value, BadCell):
        value = value.value
    if isinstance(value, float):
        # Given a float, openpyxl would keep 16 digits; 17 are needed.
        cell.value, cell.data_type = repr(value), "n"
        if isinstance(value, Shown):
            cell.number_format = _number_format(value.text)
    elif isinstance(value, str):
        if re.search(r"[\x00-\x08\x0b-\x1f\x7f]", value):
            raise ValueError(f"text with control characters cannot be written to a workbook: {value[:60]!r}")
        cell.value, cell.data_type = value, "s"  # never a formula
    else:
        cell.value = value


def _number_format(text: str) -> str:
    """The number format that shows a number with the digits of this text."""
    _, digits, exponent = Decimal(text).as_tuple()
    power = "e" in text.lower()
    decimals = len(digits) - 1 if power else -int(exponent)
    return f"0{'.' if decimals else ''}{'0' * decimals}{'E+00' if power else ''}"


def sized(comment: Any) -> Any:  # noqa: ANN401
    """A comment as large as its text."""
    comment.width, comment.height = 320, 24 + 20 * (1 + len(comment.text) // 45)
    return comment
