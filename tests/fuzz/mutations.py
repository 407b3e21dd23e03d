"""Mutations of files: bytes, lines, columns, numbers, encodings, what spreadsheet programs do."""

from __future__ import annotations

import io
import random
import re

import openpyxl

NUMBER = re.compile(r"(?<![\w.])[+-]?\d+\.?\d*(?:[eE][+-]?\d+)?(?![\w.])")
WORDS = (
    "nan",
    "inf",
    "-inf",
    "1e400",
    "1e300",
    "-1e300",
    "1e-320",
    "0",
    "-0",
    "-1",
    "1e30",
    "1e15",
    "0x10",
    "1_000",
    "١٢",
    "−3",
    "#N/A",
    "#DIV/0!",
    "#12",
    "",
    " ",
    "TRUE",
    "01.02.2024",
    "1.234,5",
    "1 234",
    "1'234",
    "1.234",
    "1,5",
    "5 mm",
    "50%",
    "NULL",
    "-",
    "?",
    "1.2.3",
    "+5",
    ".5",
    "5.",
    "1e3",
    "1E+03",
    "007",
    "=1+1",
    "@A1",
    "'5",
    "1/2",
    "1e",
    "--5",
    "½",
    "9" * 400,
    "a" * 5000,
    "\u200b5",
    "5\u200b",
    "\u202e5",
)


def mutate(rng, kind, data):
    """(what was done, the mutated file, its text where that is known and not plain UTF-8)."""
    if kind == "workbook":
        return _workbook(rng, data)
    group = rng.choice(
        (BYTES, LINES, NUMBERS, NUMBERS, *((COLUMNS, EXCEL, ENCODINGS) if kind == "table" else (SETTINGS,)))
    )
    done = rng.choice(group)
    changed = done(rng, data)
    text = None
    if isinstance(changed, tuple):
        changed, text = changed
    return done.__name__, changed, text


# bytes
def flip_bit(rng, data):
    at = rng.randrange(len(data))
    return data[:at] + bytes([data[at] ^ (1 << rng.randrange(8))]) + data[at + 1 :]


def delete_bytes(rng, data):
    at = rng.randrange(len(data))
    return data[:at] + data[at + rng.choice((1, 1, 2, 5, 30)) :]


def insert_bytes(rng, data):
    at = rng.randrange(len(data) + 1)
    more = rng.choice(
        (
            b"\x00",
            b"\xff",
            b"\n",
            b"\r",
            b'"',
            b",",
            b";",
            b"\t",
            b"#",
            b"=",
            b"-",
            b"0",
            b"9",
            b".",
            b" ",
            b"\xc2\xa0",
            b"\xef\xbb\xbf",
            b"\x1a",
            b"[",
            b"]",
            b"e",
        )
    )
    return data[:at] + more + data[at:]


def swap_bytes(rng, data):
    at = rng.randrange(len(data) - 1)
    return data[:at] + data[at + 1 : at + 2] + data[at : at + 1] + data[at + 2 :]


def truncate(rng, data):
    return data[: rng.randrange(len(data))]


def repeat_bytes(rng, data):
    at = rng.randrange(len(data))
    piece = data[at : at + rng.choice((1, 3, 10, 100))]
    return data[:at] + piece * rng.choice((2, 2, 3, 50)) + data[at:]


# lines
def _lines(change):
    def done(rng, data):
        lines = data.decode("utf-8-sig").split("\n")
        change(rng, lines)
        return "\n".join(lines).encode()

    done.__name__ = change.__name__
    return done


@_lines
def delete_line(rng, lines):
    del lines[rng.randrange(len(lines))]


@_lines
def repeat_line(rng, lines):
    at = rng.randrange(len(lines))
    lines.insert(at, lines[at])


@_lines
def swap_lines(rng, lines):
    a, b = rng.randrange(len(lines)), rng.randrange(len(lines))
    lines[a], lines[b] = lines[b], lines[a]


@_lines
def insert_line(rng, lines):
    more = (
        "",
        "# a remark",
        "#12 coupling",
        "#12,1,2,3,4",
        "# a, b",
        '"# a, b"',
        ";;;",
        ",,,",
        '"',
        "Title",
        "x" * 100_000,
        "#N/A",
        "-----",
        "===",
        " # x",
        "#",
    )
    lines.insert(rng.randrange(len(lines)), rng.choice(more))


@_lines
def comment_line_out(rng, lines):
    at = rng.randrange(len(lines))
    lines[at] = rng.choice(("#", "# ", "//", "'", '"#')) + lines[at]


@_lines
def join_lines(rng, lines):
    at = rng.randrange(len(lines) - 1)
    lines[at : at + 2] = [lines[at] + lines[at + 1]]


@_lines
def repeat_everything(_rng, lines):
    lines += list(lines)


# numbers
def change_digit(rng, data):
    places = [m.start() for m in re.finditer(rb"\d", data)]
    if not places:
        return data
    at = rng.choice(places)
    return data[:at] + str(rng.randrange(10)).encode() + data[at + 1 :]


def change_number(rng, data):
    text = data.decode("utf-8-sig")
    found = list(NUMBER.finditer(text))
    if not found:
        return data
    m = rng.choice(found)
    return (text[: m.start()] + rng.choice(WORDS) + text[m.end() :]).encode()


def rewrite_number(rng, data):
    """The same number, written otherwise."""
    text = data.decode("utf-8-sig")
    found = list(NUMBER.finditer(text))
    if not found:
        return data
    m = rng.choice(found)
    number = float(m[0])
    forms = [
        f"{number!r}",
        f"{number:e}",
        f"{number:.17g}",
        f" {m[0]} ",
        f"{m[0]}0" if "." in m[0] and "e" not in m[0].lower() else m[0],
    ]
    return (text[: m.start()] + rng.choice(forms) + text[m.end() :]).encode()


def scale_number(rng, data):
    text = data.decode("utf-8-sig")
    found = list(NUMBER.finditer(text))
    if not found:
        return data
    m = rng.choice(found)
    value = float(m[0]) * rng.choice((-1, 10, 1e-3, 1e3, 1e6, 1e-6, 1e12, 0.5, 2))
    return (text[: m.start()] + f"{value:.6g}" + text[m.end() :]).encode()


# columns of a table with commas
def _columns(change):
    def done(rng, data):
        lines = data.decode("utf-8-sig").splitlines()
        head = next(i for i, line in enumerate(lines) if not line.startswith("#"))
        rows = [line.split(",") for line in lines[head:]]
        change(rng, rows)
        return "\n".join([*lines[:head], *(",".join(row) for row in rows), ""]).encode()

    done.__name__ = change.__name__
    return done


@_columns
def swap_columns(rng, rows):
    a, b = rng.randrange(len(rows[0])), rng.randrange(len(rows[0]))
    for row in rows:
        row[a], row[b] = row[b], row[a]


@_columns
def swap_names(rng, rows):
    a, b = rng.randrange(len(rows[0])), rng.randrange(len(rows[0]))
    rows[0][a], rows[0][b] = rows[0][b], rows[0][a]


@_columns
def delete_column(rng, rows):
    at = rng.randrange(len(rows[0]))
    for row in rows:
        del row[at]


@_columns
def repeat_column(rng, rows):
    at = rng.randrange(len(rows[0]))
    for row in rows:
        row.insert(at, row[at])


@_columns
def add_column(rng, rows):
    at, name, value = (
        rng.randrange(len(rows[0]) + 1),
        *rng.choice((("", ""), ("note", "x"), ("", "x"), ("mass_kg", "1"), ("note", "#N/A"))),
    )
    for number, row in enumerate(rows):
        row.insert(at, value if number else name)


@_columns
def rename_column(rng, rows):
    at = rng.randrange(len(rows[0]))
    name = rows[0][at]
    rows[0][at] = rng.choice(
        (
            name.upper(),
            name.title(),
            name[:-1],
            f" {name} ",
            f'"{name}"',
            name.replace("_", " "),
            name + "s",
            name.rpartition("_")[0] or name,
            "#" + name,
        )
    )


@_columns
def label_with_sign(rng, rows):
    """A text cell that begins with #."""
    at = rng.randrange(len(rows[0]))
    olds = {row[at] for row in rows[1:] if at < len(row)}
    names = {old: f"#{old}" for old in olds if not NUMBER.fullmatch(old)}
    for row in rows[1:]:
        row[at] = names.get(row[at], row[at])


# what spreadsheet programs do: the same table in another dress
def _dress(change):
    def done(rng, data):
        return change(rng, data.decode("utf-8-sig"))

    done.__name__ = change.__name__
    return done


def _semicolons(text):
    return "\n".join(
        line if line.startswith("#") else line.replace(",", ";").replace(".", ",")
        for line in text.split("\n")
    )


EXCEL = [
    _dress(f)
    for f in (
        lambda _r, t: _semicolons(t).encode(),
        lambda _r, t: ("sep=;\n" + _semicolons(t)).encode(),
        lambda _r, t: t.replace("\n", "\r\n").encode(),
        lambda _r, t: t.replace("\n", "\r").encode(),
        lambda _r, t: "\n".join(x if x.startswith("#") else x and x + ",,," for x in t.split("\n")).encode(),
        lambda _r, t: (t + ",,,\n,,,\n\n").encode(),
        lambda _r, t: "\n".join(
            x if x.startswith("#") else x and '"' + x.replace(",", '","') + '"' for x in t.split("\n")
        ).encode(),
        lambda _r, t: "\n".join(
            x if x.startswith("#") else x.replace(",", "\t") for x in t.split("\n")
        ).encode(),
        lambda _r, t: "\n".join(
            x if x.startswith("#") else x.replace(",", "\u00a0, ") for x in t.split("\n")
        ).encode(),
        lambda r, t: re.sub(NUMBER, lambda m: f"{float(m[0]):.2E}" if r.random() < 0.3 else m[0], t).encode(),
        lambda r, t: re.sub(NUMBER, lambda m: f"{float(m[0]):.2f}" if r.random() < 0.3 else m[0], t).encode(),
        lambda _r, t: re.sub(r"(?<=,)(\d{4})(?=[,\n])", r"\1.000", t).encode(),
        lambda _r, t: re.sub(r"\b(\d)(\d{3})\b", r"\1,\2", t).encode(),
        lambda _r, t: re.sub(r"\b(\d)(\d{3})\b", r"\1.\2", _semicolons(t)).encode(),
    )
]
for _i, _f in enumerate(EXCEL):
    _f.__name__ = f"excel_{_i}"


def encode(rng, data):
    text = data.decode("utf-8-sig")
    if rng.random() < 0.5:  # a name with a letter that tells encodings apart
        text = re.sub(
            r"\b(left|right|A|B|S|1x|V1)\b",
            lambda m: rng.choice(("Lager süd", "Опора", "°", "µ", m[0])),
            text,
        )
    encoding = rng.choice(
        ("utf-8-sig", "utf-16", "utf-16-le", "utf-16-be", "cp1251", "cp1252", "utf-32", "utf-7")
    )
    try:
        return text.encode(encoding), text
    except UnicodeError:
        return text.encode(), text


ENCODINGS = (encode,)
BYTES = (flip_bit, delete_bytes, insert_bytes, swap_bytes, truncate, repeat_bytes)
LINES = (
    delete_line,
    repeat_line,
    swap_lines,
    insert_line,
    insert_line,
    comment_line_out,
    join_lines,
    repeat_everything,
)
NUMBERS = (change_digit, change_number, change_number, rewrite_number, scale_number)
COLUMNS = (swap_columns, swap_names, delete_column, repeat_column, add_column, rename_column, label_with_sign)


# settings
def change_value(rng, data):
    text = data.decode()
    found = list(re.finditer(r"= *(.+)$", text, re.M))
    if not found:
        return data
    m = rng.choice(found)
    new = rng.choice(
        (
            "true",
            '"x"',
            "[]",
            "{}",
            "[1, 2]",
            "1979-05-27",
            '""',
            "1e400",
            "nan",
            "-inf",
            "0x10",
            "[[1]]",
            '"' + "(" * 500 + '"',
            '"a**b**c"',
            '"1/0"',
            '"x**99999999"',
            "9" * 5000,
            "[" * 3000,
        )
    )
    return (text[: m.start(1)] + new + text[m.end(1) :]).encode()


def change_key(rng, data):
    text = data.decode()
    found = list(re.finditer(r"^\[*([\w.\"-]+)", text, re.M))
    if not found:
        return data
    m = rng.choice(found)
    new = rng.choice((m[1][:-1] or "x", m[1] + "x", m[1].upper(), '"' + m[1] + ' "', "a.b.c", '""'))
    return (text[: m.start(1)] + new + text[m.end(1) :]).encode()


SETTINGS = (change_value, change_key)


# workbooks
def _workbook(rng, data):
    if rng.random() < 0.2:
        done = rng.choice((flip_bit, flip_bit, delete_bytes, truncate, repeat_bytes))
        return done.__name__, done(rng, data), None
    book = openpyxl.load_workbook(io.BytesIO(data))
    sheet = rng.choice(book.worksheets)
    done = rng.choice(CELLS)
    done(rng, book, sheet)
    stream = io.BytesIO()
    book.save(stream)
    return done.__name__, stream.getvalue(), None


def _some_cell(rng, sheet):
    return sheet.cell(rng.randrange(1, sheet.max_row + 1), rng.randrange(1, sheet.max_column + 1))


def _set(change):
    def done(rng, _book, sheet):
        change(rng, _some_cell(rng, sheet))

    done.__name__ = change.__name__
    return done


@_set
def cell_value(rng, cell):
    import datetime

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


def generator(seed, number):
    """The random numbers of one mutant."""
    return random.Random(f"{seed}:{number}")
