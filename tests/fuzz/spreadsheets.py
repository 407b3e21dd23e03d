"""What spreadsheet programs do: the same table in another dress, and cells, rows and sheets of a workbook."""

from __future__ import annotations

import datetime
import io
import re

import openpyxl

from fuzz.mutations import NUMBER, delete_bytes, flip_bit, repeat_bytes, truncate


# the same table in another dress
def _rows(text, change):
    """Every line changed but comments and blank ones."""
    return "\n".join(change(x) if x and not x.startswith("#") else x for x in text.split("\n"))


def _semicolons(text):
    return _rows(text, lambda row: row.replace(",", ";").replace(".", ","))


def _rounded(rng, text, form):
    """Some numbers as a format of cells shows them."""
    return NUMBER.sub(lambda m: format(float(m[0]), form) if rng.random() < 0.3 else m[0], text)


DRESSES = {
    "semicolons": lambda _r, t: _semicolons(t),
    "declared_semicolons": lambda _r, t: "sep=;\n" + _semicolons(t),
    "windows_lines": lambda _r, t: t.replace("\n", "\r\n"),
    "old_mac_lines": lambda _r, t: t.replace("\n", "\r"),
    "empty_columns": lambda _r, t: _rows(t, lambda row: row + ",,,"),
    "empty_rows": lambda _r, t: t + ",,,\n,,,\n\n",
    "quotes": lambda _r, t: _rows(t, lambda row: '"' + row.replace(",", '","') + '"'),
    "tabs": lambda _r, t: _rows(t, lambda row: row.replace(",", "\t")),
    "blanks": lambda _r, t: _rows(t, lambda row: row.replace(",", "\u00a0, ")),
    "rounded": lambda r, t: _rounded(r, t, r.choice((".2E", ".2f"))),
    "thousands_with_decimals": lambda _r, t: re.sub(r"(?<=,)(\d{4})(?=[,\n])", r"\1.000", t),
    "thousands": lambda _r, t: re.sub(r"\b(\d)(\d{3})\b", r"\1,\2", t),
    "thousands_with_points": lambda _r, t: re.sub(r"\b(\d)(\d{3})\b", r"\1.\2", _semicolons(t)),
}


def dress(rng, data):
    """(the name of the dress, the table in it)."""
    name = rng.choice(list(DRESSES))
    return name, DRESSES[name](rng, data.decode("utf-8-sig")).encode()


# workbooks
def mutate_workbook(rng, data):
    """(what was done, the mutated workbook)."""
    if rng.random() < 0.2:
        done = rng.choice((flip_bit, flip_bit, delete_bytes, truncate, repeat_bytes))
        return done.__name__, done(rng, data)
    book = openpyxl.load_workbook(io.BytesIO(data))
    sheet = rng.choice(book.worksheets)
    done = rng.choice(CELLS)
    done(rng, book, sheet)
    stream = io.BytesIO()
    book.save(stream)
    return done.__name__, stream.getvalue()


def _some_cell(rng, sheet):
    return sheet.cell(rng.randrange(1, sheet.max_row + 1), rng.randrange(1, sheet.max_column + 1))


def _set(change):
    def done(rng, _book, sheet):
        change(rng, _some_cell(rng, sheet))

    done.__name__ = change.__name__
    return done


@_set
def cell_value(rng, cell):
    values = (
        None,
        "",
        " ",
        "x",
        "#1",
        "#N/A",
        True,
        0,
        -1,
        1e300,
        datetime.datetime(2024, 5, 1),
        "7,2",
        "1.234,5",
        "'5",
        "\n",
        "a\nb",
        "_x000D_",
        10**20,
    )
    cell.value = rng.choice(values)


@_set
def cell_text(_rng, cell):
    cell.value = None if cell.value is None else str(cell.value)
    cell.data_type = "s"


@_set
def cell_decimal_comma(_rng, cell):
    cell.value = None if cell.value is None else str(cell.value).replace(".", ",")


@_set
def cell_format(rng, cell):
    cell.number_format = rng.choice(
        ("0.00", "0%", "0.00E+00", "dd.mm.yyyy", "@", "#,##0.000", "General", "[h]:mm")
    )


@_set
def cell_formula(rng, cell):
    cell.value = rng.choice(("=1+1", "=A1", '=HYPERLINK("x")'))


@_set
def cell_error(_rng, cell):
    cell.value = "#N/A"
    cell.data_type = "e"


@_set
def cell_scale(rng, cell):
    if isinstance(cell.value, (int, float)):
        cell.value *= rng.choice((-1, 2, 0.5, 1e3, 1e6, 1e-3))


def stray_format(rng, _book, sheet):
    sheet.cell(rng.choice((1_048_576, 300, 5000)), rng.choice((1, 5, 16_384))).number_format = "0.00"


def insert_row(rng, _book, sheet):
    at = rng.randrange(1, sheet.max_row + 2)
    sheet.insert_rows(at)
    if rng.random() < 0.6:
        sheet.cell(at, 1).value = rng.choice(("# remark", "#12 coupling", "Title", "#N/A"))


def delete_row(rng, _book, sheet):
    sheet.delete_rows(rng.randrange(1, sheet.max_row + 1))


def insert_blank_column(rng, _book, sheet):
    sheet.insert_cols(rng.randrange(1, sheet.max_column + 2))


def delete_a_column(rng, _book, sheet):
    sheet.delete_cols(rng.randrange(1, sheet.max_column + 1))


def merge(rng, _book, sheet):
    a = rng.randrange(1, sheet.max_row + 1)
    sheet.merge_cells(
        start_row=a, end_row=a + rng.randrange(1, 3), start_column=1, end_column=rng.randrange(1, 3)
    )


def rename_sheet(rng, _book, sheet):
    sheet.title = rng.choice((sheet.title.upper(), sheet.title + " ", sheet.title[:-1], "Sheet9", "notes"))


def add_sheet(rng, book, _sheet):
    book.create_sheet(rng.choice(("notes", "extra", "results", "check"))).append(["x", 1])


def hide_sheet(_rng, _book, sheet):
    sheet.sheet_state = "hidden"


def delete_sheet(_rng, book, sheet):
    book.remove(sheet)
    if not book.worksheets:
        book.create_sheet("x")


CELLS = (
    cell_value,
    cell_value,
    cell_value,
    cell_text,
    cell_decimal_comma,
    cell_format,
    cell_formula,
    cell_error,
    cell_scale,
    stray_format,
    insert_row,
    delete_row,
    insert_blank_column,
    delete_a_column,
    merge,
    rename_sheet,
    add_sheet,
    hide_sheet,
    delete_sheet,
)
