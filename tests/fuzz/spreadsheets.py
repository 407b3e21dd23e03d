"""What spreadsheet programs do: the same table in another dress, and cells, rows and sheets of a workbook."""

from __future__ import annotations

import datetime
import io
import re

import openpyxl

from fuzz.mutations import BYTES, NUMBER, named


def _rows(text, change):
    """Every line changed but comments and blank ones."""
    return "\n".join(change(x) if x and not x.startswith("#") else x for x in text.split("\n"))


def _semicolons(text):
    return _rows(text, lambda row: row.replace(",", ";").replace(".", ","))


def _rounded(rng, text):
    """Some numbers as a format of cells shows them."""
    form = rng.choice((".2E", ".2f"))
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
    "rounded": _rounded,
    "thousands_with_decimals": lambda _r, t: re.sub(r"(?<=,)(\d{4})(?=[,\n])", r"\1.000", t),
    "thousands": lambda _r, t: re.sub(r"\b(\d)(\d{3})\b", r"\1,\2", t),
    "thousands_with_points": lambda _r, t: re.sub(r"\b(\d)(\d{3})\b", r"\1.\2", _semicolons(t)),
}


def dress(rng, data):
    """(the name of the dress, the table in it)."""
    name = rng.choice(list(DRESSES))
    return name, DRESSES[name](rng, data.decode("utf-8-sig")).encode()


def mutate_workbook(rng, data):
    """(what was done, the mutated workbook)."""
    if rng.random() < 0.2:
        done = rng.choice(BYTES)
        return done.__name__, done(rng, data)
    book = openpyxl.load_workbook(io.BytesIO(data))
    done = rng.choice(CELLS + SHEETS)
    done(rng, rng.choice(book.worksheets))
    stream = io.BytesIO()
    book.save(stream)
    return done.__name__, stream.getvalue()


VALUES = (
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
)
VALUES += ("'5", "\n", "a\nb", "_x000D_", 10**20)
FORMATS = ("0.00", "0%", "0.00E+00", "dd.mm.yyyy", "@", "#,##0.000", "General", "[h]:mm")


def _set(change):
    """Of some cell: its value and maybe its type, or its format."""

    def done(rng, sheet):
        cell = sheet.cell(rng.randint(1, sheet.max_row), rng.randint(1, sheet.max_column))
        for name, value in change(rng, cell.value).items():
            setattr(cell, name, value)

    return done


CELLS = named(
    _set,
    {
        "cell_value": lambda r, _: {"value": r.choice(VALUES)},
        "cell_text": lambda _, x: {} if x is None else {"value": str(x), "data_type": "s"},
        "cell_decimal_comma": lambda _, x: {} if x is None else {"value": str(x).replace(".", ",")},
        "cell_format": lambda r, _: {"number_format": r.choice(FORMATS)},
        "cell_formula": lambda r, _: {"value": r.choice(("=1+1", "=A1", '=HYPERLINK("x")'))},
        "cell_error": lambda _, x: {"value": "#N/A", "data_type": "e"},
        "cell_scale": lambda r, x: {"value": x * r.choice((-1, 2, 0.5, 1e3))} if isinstance(x, float) else {},
    },
)


def _stray_format(rng, sheet):
    sheet.cell(rng.choice((1_048_576, 300, 5000)), rng.choice((1, 5, 16_384))).number_format = "0.00"


def _insert_row(rng, sheet):
    at = rng.randint(1, sheet.max_row + 1)
    sheet.insert_rows(at)
    sheet.cell(at, 1).value = rng.choice((None, None, "# remark", "#12 coupling", "Title", "#N/A"))


def _merge(rng, sheet):
    at = rng.randint(1, sheet.max_row)
    sheet.merge_cells(None, at, 1, at + rng.randint(1, 2), rng.randint(1, 2))


def _rename_sheet(rng, sheet):
    sheet.title = rng.choice((sheet.title.upper(), sheet.title + " ", sheet.title[:-1], "Sheet9", "notes"))


def _delete_sheet(_, sheet):
    sheet.parent.remove(sheet)
    if not sheet.parent.worksheets:
        sheet.parent.create_sheet("x")


SHEETS = named(
    lambda change: lambda rng, sheet: change(rng, sheet),
    {
        "stray_format": _stray_format,
        "insert_row": _insert_row,
        "delete_row": lambda r, s: s.delete_rows(r.randint(1, s.max_row)),
        "insert_blank_column": lambda r, s: s.insert_cols(r.randint(1, s.max_column + 1)),
        "delete_a_column": lambda r, s: s.delete_cols(r.randint(1, s.max_column)),
        "merge": _merge,
        "rename_sheet": _rename_sheet,
        "add_sheet": lambda r, s: s.parent.create_sheet(r.choice(("notes", "extra", "check"))).append(
            ["x", 1]
        ),
        "hide_sheet": lambda _, s: setattr(s, "sheet_state", "hidden"),
        "delete_sheet": _delete_sheet,
    },
)
