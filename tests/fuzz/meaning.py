"""A second reader, written apart from the program's: what the cells of a file say, and the same file plainly.

It reads less than the program does (None: no opinion), and never guesses.
"""

from __future__ import annotations

import csv
import io
import re
import tomllib
from decimal import Decimal

import openpyxl

PLAIN = re.compile(r"[+-]?(\d+\.?\d*|\.\d+)([eE][+-]?\d+)?", re.ASCII)
COMMA = re.compile(r"[+-]?(\d+,\d*|,\d+)([eE][+-]?\d+)?", re.ASCII)
BLANKS = " \t\u00a0\u202f\u2007\u2009\ufeff"


def table(text):
    """(comments, header, rows) of a text table, or None."""
    lines = re.split(r"\r\n|\n|\r", text.removeprefix("\ufeff"))
    declared = re.fullmatch(r'"?sep=(.)"?[;,\t]*', lines[0])
    if declared:
        lines = lines[1:]
    bare = [re.sub(r'"[^"]*"', "", line) for line in lines if line.strip()]
    usual = next((sign for sign in "\t;," if 2 * sum(sign in line for line in bare) > len(bare)), ",")
    separator, comments, rows = declared[1] if declared else usual, [], []
    for line in lines:
        if not line.strip(BLANKS + ';,"'):
            continue
        begins = line.strip(BLANKS).startswith(("#",) if rows else ("#", "//"))
        if begins and (not rows or separator not in line):
            comments.append(line.strip(BLANKS + "#"))
            continue
        if line.startswith('"#') and (not rows or separator not in re.sub('"[^"]*"', "", line)):
            comments.append(line.strip(BLANKS + '"#;,'))
            continue
        if line.count('"') % 2:
            return None
        rows.append([cell.strip(BLANKS) for cell in next(csv.reader([line], delimiter=separator))])
    if not rows:
        return None
    header, *body = rows
    while header and not header[-1]:
        header.pop()
    width = len(header)
    if any(any(row[width:]) for row in body) or len(set(header)) < width:
        return None
    body = [(row + [""] * width)[:width] for row in body]
    if separator != "," and any(COMMA.fullmatch(cell) for row in body for cell in row):
        if any("." in cell and PLAIN.fullmatch(cell) for row in body for cell in row):
            return None
        body = [[cell.replace(",", ".") if COMMA.fullmatch(cell) else cell for cell in row] for row in body]
    keep = [i for i, name in enumerate(header) if not name.casefold().startswith(("note", "comment"))]
    keep = [i for i in keep if header[i] or any(row[i] for row in body)]
    return comments, [header[i] for i in keep], [[row[i] for i in keep] for row in body]


def table_sense(read):
    """What must stay the same for the answer to stay: cells by column, numbers with their digits."""
    comments, header, rows = read
    order = sorted(range(len(header)), key=lambda i: header[i])
    return (
        sorted(c for c in comments if "=" in c),
        [header[i] for i in order],
        [[_number(row[i]) for i in order] for row in rows],
    )


def _number(cell):
    """A number and the place of its last digit, which is its resolution."""
    return (float(cell), Decimal(cell).as_tuple().exponent) if PLAIN.fullmatch(cell) else cell


def table_file(read):
    """The same table as plain as can be."""
    comments, header, rows = read
    out = io.StringIO()
    out.writelines(f"# {comment}\n" for comment in comments)
    csv.writer(out, lineterminator="\n", quoting=csv.QUOTE_MINIMAL).writerow(header)
    for row in rows:
        line = io.StringIO()
        quoting = csv.QUOTE_ALL if row[0].startswith("#") else csv.QUOTE_MINIMAL
        csv.writer(line, lineterminator="\n", quoting=quoting).writerow(row)
        out.write(line.getvalue())
    return out.getvalue().encode("utf-8-sig")


def settings(data):
    """The content of a TOML file, or None."""
    try:
        return tomllib.loads(data.decode("utf-8-sig").replace("\r\n", "\n"))
    except (ValueError, RecursionError):
        return None


def workbook(data):
    """{sheet: {(row, column): (value, format)}} with what is not blank, or None.

    The format of a number says in which steps it was written; other formats say nothing.
    """
    import warnings

    try:
        with warnings.catch_warnings():
            warnings.simplefilter("ignore")
            book = openpyxl.load_workbook(io.BytesIO(data), data_only=True)
    except Exception:
        return None
    found = {}
    for sheet in book.worksheets:
        cells = sheet._cells.values()  # those that are in the file; iter_rows fills the gaps between them
        found[sheet.title] = {
            (c.row, c.column): (_plain(c.value), _format(c)) for c in cells if _plain(c.value) != ""
        }
        if any("%" in str(c.number_format) for c in cells if c.value is not None):
            return None
    return found


def _format(cell):
    """Of decimals or a power of ten, else the general one."""
    written = str(cell.number_format) if isinstance(cell.value, (int, float)) else ""
    return written if re.fullmatch(r"(#,##)?0(\.0+)?(E\+0+)?", written) else "General"


def _plain(value):
    if value is None:
        return ""
    return value.strip(BLANKS) if isinstance(value, str) else value
