"""Excel pages for people: bold headers that stay in sight, names as text, explanations, choices."""

from __future__ import annotations

import math
import re
from collections.abc import Collection, Mapping, Sequence
from dataclasses import dataclass, field
from decimal import Decimal
from typing import Any

from rotorid.base.tables import workbook_bytes
from rotorid.base.versions import SCHEMA_VERSION, now
from rotorid.tables.reader.grid import BadCell, Cell, Shown, show

LONGEST_TEXT = 32767
MOST_ROWS = 1048576
_LONGEST_LIST = 255
_WIDEST, _NARROWEST, _LOOKED_AT = 60, 9, 200

Line = tuple[Cell | None, ...]
"""A row of cells; `""` and None are blanks."""


@dataclass(frozen=True)
class Choice:
    """Values that a cell may have: some texts, or numbers from `low` to `high`."""

    texts: tuple[str, ...] = ()
    low: float = -360.0
    high: float = 360.0
    strict: bool = True


@dataclass(frozen=True)
class Page:
    """One sheet.

    Attributes
    ----------
    title
        Its name.
    lines
        Rows of cells; rows whose first cell begins with # stand above the header.
    names
        Columns of names, in which `1` is text: cells that are filled in later stay as they are typed.
    explained
        Comments on cells of the header, by name of the column.
    choices
        Of the cells below the header, by name of the column.
    cell_choices
        Of single cells, by row (from 1) and column (from 1).
    """

    title: str
    lines: Sequence[Line]
    names: Collection[str] = ()
    explained: Mapping[str, str] = field(default_factory=dict)
    choices: Mapping[str, Choice] = field(default_factory=dict)
    cell_choices: Mapping[tuple[int, int], Choice] = field(default_factory=dict)


def book_bytes(pages: Sequence[Page], shown: str) -> bytes:
    """A workbook (.xlsx) of these pages, opened at the one of the title `shown`.

    Raises
    ------
    ValueError
        For what no workbook holds: control characters, cells and sheets that are too long.
    """
    import openpyxl
    from openpyxl.packaging.custom import IntProperty

    book = openpyxl.Workbook()
    book.remove(book.active)
    book.properties.creator = "rotorid"
    book.properties.created = book.properties.modified = now().replace(tzinfo=None)
    book.custom_doc_props.append(IntProperty(name="schema_version", value=SCHEMA_VERSION))
    for page in pages:
        sheet = book.create_sheet(page.title)
        _write(sheet, page)
        sheet.sheet_view.tabSelected = page.title == shown
    book.active = [page.title for page in pages].index(shown)
    return workbook_bytes(book)


def header_row(lines: Sequence[Line]) -> int:
    """Row of the header, from 1: the first that is not empty and no comment; 0 without one."""
    for number, cells in enumerate(lines, start=1):
        if any(cell not in ("", None) for cell in cells) and not str(cells[0]).startswith("#"):
            return number
    return 0


def _write(sheet: Any, page: Page) -> None:  # noqa: ANN401  openpyxl has no types
    from openpyxl.styles import Font, PatternFill
    from openpyxl.utils import get_column_letter

    if len(page.lines) > MOST_ROWS:
        raise ValueError(
            f"the sheet {page.title!r} would have {len(page.lines)} rows, and a workbook holds {MOST_ROWS}: "
            "keep this job in CSV files"
        )
    top = header_row(page.lines)
    header = page.lines[top - 1] if top else ()
    for number, cells in enumerate(page.lines, start=1):
        for place, value in enumerate(cells, start=1):
            if value is not None and value != "":
                cell = sheet.cell(number, place)
                put(cell, value, page.title)
                if isinstance(value, str):
                    cell.number_format = "@"
    for place in range(1, max((len(line) for line in page.lines), default=0) + 1):
        sheet.column_dimensions[get_column_letter(place)].width = _width(page.lines, place)
    for place, name in enumerate(header, start=1):
        if name in page.names:  # cells that are filled in later: 1 stays a name, 1.5 and 3:10 are no date
            sheet.column_dimensions[get_column_letter(place)].number_format = "@"
        cell = sheet.cell(top, place)
        cell.font, cell.fill = Font(bold=True), PatternFill("solid", fgColor="FFE6E6E6")
        if name in page.explained:
            cell.comment = _comment(page.explained[str(name)])
    if top:
        sheet.freeze_panes = f"A{top + 1}"
    _validate(sheet, page, top, header)


def _width(lines: Sequence[Line], place: int) -> float:
    """Of a column; lines of a single cell run over the cells beside it."""
    cells = [line[place - 1] for line in lines[:_LOOKED_AT] if len(line) > 1 and len(line) >= place]
    texts = [show(cell) for cell in cells if cell is not None]
    return min(max(_NARROWEST, *map(len, texts), 0) + 2, _WIDEST)


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
        if len(value) > LONGEST_TEXT:
            raise ValueError(
                f"the sheet {title!r} would have a cell of {len(value)} characters, and one holds "
                f"{LONGEST_TEXT}: keep this job in files"
            )
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


def _comment(text: str) -> Any:  # noqa: ANN401
    from openpyxl.comments import Comment

    return sized(Comment(text, "rotorid"))


def sized(comment: Any) -> Any:  # noqa: ANN401
    """A comment as large as its text."""
    comment.width, comment.height = 320, 24 + 20 * (1 + len(comment.text) // 45)
    return comment


def _validate(sheet: Any, page: Page, top: int, header: Line) -> None:  # noqa: ANN401
    from openpyxl.utils import get_column_letter

    for place, name in enumerate(header, start=1):
        if name in page.choices:
            letter = get_column_letter(place)
            _add(sheet, page.choices[str(name)], f"{letter}{top + 1}:{letter}{MOST_ROWS}")
    for (row, place), choice in page.cell_choices.items():
        _add(sheet, choice, f"{get_column_letter(place)}{row}")


def _add(sheet: Any, choice: Choice, where: str) -> None:  # noqa: ANN401
    from openpyxl.worksheet.datavalidation import DataValidation

    if choice.texts:
        joined = ",".join(choice.texts)
        if len(joined) > _LONGEST_LIST:
            raise ValueError(f"a list of choices of {len(joined)} characters; Excel takes {_LONGEST_LIST}")
        rule = DataValidation(type="list", formula1=f'"{joined}"', allow_blank=True)
        rule.error = f"One of: {joined}"[:250]
    else:
        low, high = f"{choice.low:g}", f"{choice.high:g}" if math.isfinite(choice.high) else None
        operator = "greaterThanOrEqual" if high is None else "between"
        rule = DataValidation(
            type="decimal", operator=operator, formula1=low, formula2=high, allow_blank=True
        )
        words = f"of {low} or more" if high is None else f"from {low} to {high}"
        rule.error = f"A number {words}, in a cell of its own, without a unit"
    rule.errorTitle = "rotorid"
    rule.showErrorMessage = True
    rule.errorStyle = "stop" if choice.strict else "warning"
    sheet.add_data_validation(rule)
    rule.add(where)
