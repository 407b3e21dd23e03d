"""Mutations of text files: bytes, lines, numbers, columns, encodings, settings."""

from __future__ import annotations

import re

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


def _number(change):
    def done(rng, data):
        text = data.decode("utf-8-sig")
        found = list(NUMBER.finditer(text))
        if not found:
            return data
        m = rng.choice(found)
        return (text[: m.start()] + change(rng, m[0]) + text[m.end() :]).encode()

    done.__name__ = change.__name__
    return done


@_number
def change_number(rng, _written):
    return rng.choice(WORDS)


@_number
def rewrite_number(rng, written):
    """The same number, written otherwise."""
    number = float(written)
    zero = "0" if "." in written and "e" not in written.lower() else ""
    return rng.choice([f"{number!r}", f"{number:e}", f"{number:.17g}", f" {written} ", f"{written}{zero}"])


@_number
def scale_number(rng, written):
    return f"{float(written) * rng.choice((-1, 10, 1e-3, 1e3, 1e6, 1e-6, 1e12, 0.5, 2)):.6g}"


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


# encodings
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
