"""Tables of results, told once: named columns, one writer each for terminal, CSV, Excel, HTML and pandas.

>>> speeds = Table(
...     "critical speeds",
...     (
...         Column("mode", (1, 2)),
...         Column("whirl", ("forward", "mixed")),
...         Column("speed, rpm", (2980.5, float("nan")), "{:.1f}".format),
...     ),
... )
>>> speeds.records[1]
{'mode': 2, 'whirl': 'mixed', 'speed, rpm': None}
>>> print(terminal(speeds))
  mode  whirl     speed, rpm
  1     forward       2980.5
  2     mixed
>>> print(csv(speeds).decode(), end="")
mode,whirl,"speed, rpm"
1,forward,2980.5
2,mixed,
"""

from __future__ import annotations

import io
import re
import zipfile
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from math import nan
from typing import TYPE_CHECKING, Any

from rotorid.base.json import SCHEMA_VERSION, cell, now
from rotorid.base.text import WIDTH, aligned

if TYPE_CHECKING:
    import pandas as pd
    from markupsafe import Markup
    from numpy.typing import NDArray

Value = str | int | float | bool | None
LONGEST_TITLE = 31
"""Characters of the name of a sheet in a workbook."""
NARROW = 4
"""Columns that a telephone shows side by side; rows of wider tables become blocks there."""
LONG, THINNED = 60, 13
"""Rows of a table that a page shows whole, and of a longer one so many."""
NOTHING, MINUS = "\N{EN DASH}", "\N{MINUS SIGN}"
"""In HTML, where nothing is known, and before negative numbers."""


@dataclass(frozen=True, eq=False)
class Column:
    """One column of a table.

    Attributes
    ----------
    heading
        What it holds, with its unit.
    values
        One cell a row; what is not finite becomes None, which is unknown. Only JSON has lists in cells.
    shown
        A value as a reader sees it; CSV and workbooks keep all digits. None: `text` leaves the column out.
    key
        Where the JSON document of the result holds the values, `*` for the row from 0; empty: nowhere.
    scale
        What one unit of the document is in that of the heading.
    title
        What `text` prints over the column, where that is not the heading.
    """

    heading: str
    values: Sequence[Any] | NDArray[Any]
    shown: Callable[[Any], str] | None = str
    key: str = ""
    scale: float = 1.0
    title: str | None = None

    def __post_init__(self) -> None:
        object.__setattr__(self, "values", tuple(map(cell, self.values)))

    @property
    def words(self) -> bool:
        """Whether it holds texts."""
        return any(isinstance(value, str) for value in self.values)

    @property
    def texts(self) -> list[str]:
        """Cells as a reader sees them; blank where nothing is known."""
        return ["" if value is None else (self.shown or str)(value) for value in self.values]


@dataclass(frozen=True, eq=False)
class Table:
    """Columns of one length under a name.

    Attributes
    ----------
    name
        What it shows, in a few words.
    columns
        At least one.
    note
        What a reader must know about it.

    """

    name: str
    columns: tuple[Column, ...]
    note: str = ""

    def under(self, place: str) -> Table:
        """The same, of a result that stands at this place of a document."""
        moved = (replace(each, key=each.key and f"{place}.{each.key}") for each in self.columns)
        return replace(self, columns=tuple(moved))

    @property
    def headings(self) -> list[str]:
        """Of the columns."""
        return [column.heading for column in self.columns]

    @property
    def rows(self) -> list[tuple[Value, ...]]:
        """Values row by row."""
        return rows(self.columns)

    @property
    def records(self) -> list[dict[str, Value]]:
        """Values row by row, by their headings."""
        return records(self.columns)


def rows(columns: Sequence[Column]) -> list[tuple[Any, ...]]:
    """Values row by row, of JSON types."""
    return list(zip(*(column.values for column in columns), strict=True))


def records(columns: Sequence[Column]) -> list[dict[str, Any]]:
    """One dict a row, of JSON types."""
    names = [column.heading for column in columns]
    return [dict(zip(names, row, strict=True)) for row in rows(columns)]


def frame(columns: Sequence[Column]) -> pd.DataFrame:
    """The columns as a DataFrame; NaN where nothing is known."""
    import pandas as pd

    return pd.DataFrame({each.heading: [nan if x is None else x for x in each.values] for each in columns})


def text(columns: Sequence[Column], left: int = 1, width: int = WIDTH) -> str:
    """Aligned text: words of the first `left` of the printed columns, and the first, to the left."""
    printed = [column for column in columns if column.shown is not None]
    texts = [[each.heading if each.title is None else each.title, *each.texts] for each in printed]
    for k in range(1, left):
        if not printed[k].words:
            texts[k] = [cell.rjust(max(map(len, texts[k]))) for cell in texts[k]]
    return aligned(texts, left, width)


def terminal(table: Table, width: int = WIDTH) -> str:
    """Aligned text: words and the first column to the left, other numbers to the right."""
    printed = [column for column in table.columns if column.shown is not None]
    last = max((k for k, column in enumerate(printed, start=1) if column.words), default=1)
    return text(printed, last, width)


def csv(table: Table) -> bytes:
    """A CSV file, of numbers 15 digits; a note stands in a line with # above the header."""
    rows = [[float(f"{x:.15g}") if isinstance(x, float) else x for x in row] for row in table.rows]
    return csv_bytes(table.headings, rows, table.note)


def excel(*tables: Table, book: Any = None) -> bytes:  # noqa: ANN401
    """A workbook (.xlsx) with a sheet for each table, behind the sheets of a `book` and opened there.

    Its date is that of `now`; its parts have none.
    """
    import openpyxl
    from openpyxl.packaging.custom import IntProperty
    from openpyxl.writer.excel import ExcelWriter

    date = now().replace(tzinfo=None)
    if book is None:
        book = openpyxl.Workbook()
        book.remove(book.active)
        book.properties.creator, book.properties.created = "rotorid", date
        book.custom_doc_props.append(IntProperty(name="schema_version", value=SCHEMA_VERSION))
    for sheet in book.worksheets:
        sheet.sheet_view.tabSelected = False
    first = len(book.sheetnames)
    for table in tables:
        _fill(book.create_sheet(table.name[:LONGEST_TITLE]), table)
    book.active = first
    book.properties.modified = date
    saved, undated = io.BytesIO(), io.BytesIO()
    ExcelWriter(book, zipfile.ZipFile(saved, "w")).save()
    with zipfile.ZipFile(saved) as parts, zipfile.ZipFile(undated, "w") as archive:
        for part in parts.namelist():
            archive.writestr(zipfile.ZipInfo(part), parts.read(part), zipfile.ZIP_DEFLATED)
    return undated.getvalue()


def _fill(sheet: Any, table: Table) -> None:  # noqa: ANN401
    """Note, headings and rows of a table in a sheet."""
    from openpyxl.utils import get_column_letter

    above = [(f"# {line}",) for line in table.note.splitlines()]
    for row in (*above, table.headings, *table.rows):
        sheet.append([guarded(value) if isinstance(value, str) else value for value in row])
    for place, heading in enumerate(table.headings, start=1):
        sheet.column_dimensions[get_column_letter(place)].width = max(12, len(heading) + 2)
    sheet.freeze_panes = f"A{len(above) + 2}"


def html(table: Table, longest: int = LONG) -> Markup:
    """A table of HTML: numbers with their place in the JSON document as `data-key`; `blocks` if wide.

    Of one that is longer some rows, evenly spread.
    """
    from markupsafe import Markup, escape

    count = len(table.columns[0].values)
    rows: Sequence[int] = range(count)
    if count > longest:
        rows = [round(i * (count - 1) / (THINNED - 1)) for i in range(THINNED)]
    heads, cells = "", []
    for column in table.columns:
        heading, texts, kind = escape(column.heading), column.texts, "" if column.words else ' class="n"'
        heads += f"<th{kind}>{heading}</th>"
        shown = (_number(column, row, escape(texts[row] or NOTHING)) for row in rows)
        cells.append([f'<td{kind} data-label="{heading}">{each}</td>' for each in shown])
    body = "\n".join(f"<tr>{''.join(row)}</tr>" for row in zip(*cells, strict=True))
    caption = f"<caption>{escape(table.name)}</caption>\n" if table.name else ""
    wide = ' class="blocks"' if len(cells) > NARROW else ""
    thinned = f"{len(rows)} of {count} rows; --output writes all." if len(rows) < count else ""
    words = " ".join(filter(None, (table.note, thinned)))
    note = f'\n<p class="note">{escape(words)}</p>' if words else ""
    return Markup(
        f"<table{wide}>\n{caption}<thead><tr>{heads}</tr></thead>\n<tbody>\n{body}\n</tbody>\n</table>{note}"
    )


def _number(column: Column, row: int, text: str) -> str:
    """A cell of HTML; a number with its place in the document."""
    if column.words or not column.key:
        return text if column.words else text.replace("-", MINUS)
    scale = "" if column.scale == 1.0 else f' data-scale="{column.scale!r}"'
    return f'<span data-key="{column.key.replace("*", str(row))}"{scale}>{text.replace("-", MINUS)}</span>'


def csv_bytes(names: Sequence[str], rows: Sequence[Sequence[Value]], note: str = "") -> bytes:
    """A CSV file: a note (with the version above it), columns, rows; numbers with all their digits.

    A table without a note stays one that every program reads.
    """
    above = [f"schema_version = {SCHEMA_VERSION}", note] if note else []
    lines = [f"# {one_line(line)}" for line in above]
    lines += [",".join(map(_csv_cell, row)) for row in (names, *rows)]
    lines.append("")
    # Excel takes a file without the mark for its own 8-bit encoding; plain ASCII needs none.
    return (whole := "\n".join(lines)).encode("utf-8" if whole.isascii() else "utf-8-sig")


def _csv_cell(value: Value) -> str:
    if isinstance(value, bool):
        return "true" if value else "false"
    if isinstance(value, (int, float)):
        return repr(value)
    text = guarded(value or "")
    # any sign that could separate columns: a reader looks for one in the header
    return '"' + text.replace('"', '""') + '"' if re.search('[,;\t"]|^#', text) else text


def guarded(text: str) -> str:
    """Text of one line that no spreadsheet takes for a formula; readers drop the blank before it."""
    text = one_line(text)
    return f" {text}" if text.startswith(("=", "+", "-", "@")) else text


def one_line(text: str) -> str:
    """Text with its spaces made single, refused where it has control characters."""
    line = " ".join(text.split())
    if re.search(r"[\x00-\x1f\x7f]", line):
        raise ValueError(f"text with control characters cannot be written to a table: {text!r}")
    return line
