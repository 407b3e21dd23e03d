"""Cells of workbooks that are kept or changed: all digits, text never as a formula."""

from __future__ import annotations

import re
from collections.abc import Sequence
from decimal import Decimal
from typing import Any

from rotorid.files.cells import BadCell, Cell, Shown

Line = tuple[Cell | None, ...]
"""A row of cells; `""` and None are blanks."""


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
