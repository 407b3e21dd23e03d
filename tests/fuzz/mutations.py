"""Mutations of text files: bytes, lines, numbers, columns, encodings, settings.

A mutation takes a generator of random numbers and the file, and gives the file changed; its name is that of
the entry in the tables below, in which what happens more often stands twice.
"""

from __future__ import annotations

import re

NUMBER = re.compile(r"(?<![\w.])[+-]?\d+\.?\d*(?:[eE][+-]?\d+)?(?![\w.])")
_WORDS = """nan inf -inf 1e400 1e300 -1e300 1e-320 0 -0 -1 1e30 1e15 0x10 1_000 ١٢ −3 #N/A #DIV/0! #12 TRUE 1e
½ 01.02.2024 1.234,5 1'234 1.234 1,5 50% NULL - ? 1.2.3 +5 .5 5. 1e3 1E+03 007 =1+1 @A1 '5 1/2 --5"""
WORDS = (*_WORDS.split(), "", " ", "1 234", "5 mm", "9" * 400, "a" * 5000, "\u200b5", "5\u200b", "\u202e5")
PIECES = [b"\xc2\xa0", b"\xef\xbb\xbf", *(bytes([c]) for c in b'\x00\xff\n\r",;\t#=-09. \x1a[]e')]
REMARKS = ("", "# a remark", "#12 coupling", "#12,1,2,3,4", "# a, b", '"# a, b"', ";;;", ",,,", '"', "Title")
REMARKS += ("x" * 100_000, "#N/A", "-----", "===", " # x", "#")
SPELLINGS = (str.upper, str.title, " {} ".format, '"{}"'.format, "{}s".format, "#{}".format)
SPELLINGS += (
    lambda name: name[:-1],
    lambda name: name.replace("_", " "),
    lambda name: name.rpartition("_")[0],
)
_VALUES = 'true "x" [] {} [1,2] 1979-05-27 "" 1e400 nan -inf 0x10 [[1]] "a**b**c" "1/0" "x**99999999"'
VALUES = (*_VALUES.split(), '"' + "(" * 500 + '"', "9" * 5000, "[" * 3000)


def named(wrap, changes):
    """Mutations with their names."""
    made = []
    for name, change in changes.items():
        made.append(wrap(change))
        made[-1].__name__ = name
    return made


def _bytes(change):
    """Of the bytes before and behind a place."""

    def done(rng, data):
        at = rng.randrange(len(data))
        return change(rng, data[:at], data[at:])

    return done


BYTES = named(
    _bytes,
    {
        "flip_bit": lambda r, a, b: a + bytes([b[0] ^ (1 << r.randrange(8))]) + b[1:],
        "delete_bytes": lambda r, a, b: a + b[r.choice((1, 1, 2, 5, 30)) :],
        "insert_bytes": lambda r, a, b: a + r.choice(PIECES) + b,
        "swap_bytes": lambda _, a, b: a + b[1:2] + b[:1] + b[2:],
        "truncate": lambda _, a, b: a,
        "repeat_bytes": lambda r, a, b: a + b[: r.choice((1, 3, 10, 100))] * r.choice((2, 3, 50)) + b,
    },
)


def _lines(change):
    """Of the lines before, at and behind a place."""

    def done(rng, data):
        lines = data.decode("utf-8-sig").split("\n")
        at = rng.randrange(len(lines) - 1)
        return "\n".join(change(rng, lines[:at], lines[at], lines[at + 1 :])).encode()

    return done


def _swap_lines(rng, above, line, below):
    k = rng.randrange(len(below))
    return [*above, below[k], *below[:k], line, *below[k + 1 :]]


LINES = named(
    _lines,
    {
        "delete_line": lambda _, a, line, b: a + b,
        "repeat_line": lambda _, a, line, b: [*a, line, line, *b],
        "swap_lines": _swap_lines,
        "insert_line": lambda r, a, line, b: [*a, r.choice(REMARKS), line, *b],
        "comment_line_out": lambda r, a, line, b: [*a, r.choice(("#", "# ", "//", "'", '"#')) + line, *b],
        "join_lines": lambda _, a, line, b: [*a, line + b[0], *b[1:]],
        "repeat_everything": lambda _, a, line, b: [*a, line, *b] * 2,
    },
)


def _number(change, pattern=NUMBER, group=0):
    """Of one number, or another part of the text."""

    def done(rng, data):
        text = data.decode("utf-8-sig")
        places = list(pattern.finditer(text))
        if not places:
            return data
        m = rng.choice(places)
        return (text[: m.start(group)] + change(rng, m[group]) + text[m.end(group) :]).encode()

    return done


def _rewritten(rng, written):
    """The same number, written otherwise."""
    number, zero = float(written), "0" if "." in written and "e" not in written.lower() else ""
    return rng.choice([f"{number!r}", f"{number:e}", f"{number:.17g}", f" {written} ", f"{written}{zero}"])


NUMBERS = named(
    _number,
    {
        "change_number": lambda r, _: r.choice(WORDS),
        "rewrite_number": _rewritten,
        "scale_number": lambda r, x: f"{float(x) * r.choice((-1, 10, 1e-3, 1e3, 1e6, 1e-6, 1e12, 0.5)):.6g}",
    },
) + named(
    lambda change: _number(change, re.compile(r"\d")), {"change_digit": lambda r, _: r.choice("0123456789")}
)


def _columns(change):
    """Of the columns of a table with commas, each with its heading first; ragged rows end early."""

    def done(rng, data):
        lines = data.decode("utf-8-sig").splitlines()
        head = next(i for i, line in enumerate(lines) if not line.startswith("#"))
        columns = [list(c) for c in zip(*(line.split(",") for line in lines[head:]), strict=False)]
        columns = change(rng, columns, rng.randrange(len(columns)))
        rows = [",".join(row) for row in zip(*columns, strict=True)]
        return "\n".join([*lines[:head], *rows, ""]).encode()

    return done


def _swap_columns(rng, columns, at):
    other = rng.randrange(len(columns))
    columns[at], columns[other] = columns[other], columns[at]
    return columns


def _swap_names(rng, columns, at):
    other = rng.choice(columns)
    columns[at][0], other[0] = other[0], columns[at][0]
    return columns


def _add_column(rng, columns, at):
    name, value = rng.choice((("", ""), ("note", "x"), ("", "x"), ("mass_kg", "1"), ("note", "#N/A")))
    return [*columns[:at], [name] + [value] * (len(columns[0]) - 1), *columns[at:]]


def _renamed(rng, columns, at):
    columns[at][0] = rng.choice(SPELLINGS)(columns[at][0])
    return columns


def _labelled(_, columns, at):
    """Text cells that begin with #."""
    columns[at][1:] = [cell if NUMBER.fullmatch(cell) else f"#{cell}" for cell in columns[at][1:]]
    return columns


COLUMNS = named(
    _columns,
    {
        "swap_columns": _swap_columns,
        "swap_names": _swap_names,
        "delete_column": lambda _, columns, at: columns[:at] + columns[at + 1 :],
        "repeat_column": lambda _, columns, at: [*columns[:at], columns[at], *columns[at:]],
        "add_column": _add_column,
        "rename_column": _renamed,
        "label_with_sign": _labelled,
    },
)


def encode(rng, data):
    """The file in another encoding, half of the time with letters that tell encodings apart, and its text."""
    text = data.decode("utf-8-sig")
    if rng.random() < 0.5:
        names = r"\b(left|right|A|B|S|1x|V1)\b"
        text = re.sub(names, lambda m: rng.choice(("Lager süd", "Опора", "°", "µ", m[0])), text)
    try:
        encodings = "utf-8-sig utf-16 utf-16-le utf-16-be cp1251 cp1252 utf-32 utf-7"
        return text.encode(rng.choice(encodings.split())), text
    except UnicodeError:
        return text.encode(), text


ENCODINGS = (encode,)
SETTINGS = named(
    lambda change: _number(change, re.compile(r"= *(.+)$", re.M), 1),
    {"change_value": lambda r, _: r.choice(VALUES)},
) + named(
    lambda change: _number(change, re.compile(r"^\[*([\w.\"-]+)", re.M), 1),
    {"change_key": lambda r, x: r.choice((x[:-1] or "x", f"{x}x", x.upper(), f'"{x} "', "a.b.c", '""'))},
)
