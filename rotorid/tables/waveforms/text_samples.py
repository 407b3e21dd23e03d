"""Waveforms in text files: the header is found under a preamble, the numbers are read in pieces by pandas."""

from __future__ import annotations

import codecs
import csv
import re
from collections import Counter
from itertools import islice
from pathlib import Path
from typing import NamedTuple, TextIO

import numpy as np

from rotorid.base.arrays import FloatArray
from rotorid.files.cells import decode
from rotorid.files.decimal_numbers import NotANumber, decimal_comma, parse_number
from rotorid.files.input_file import first_bytes
from rotorid.files.problems import Problems
from rotorid.files.units import TIME, spelt
from rotorid.files.value_kinds import plain_number
from rotorid.tables.waveforms.sampled_file import Sampled, refusal, sampled

HEAD = 65_536
"""Bytes in which the form of a file shows."""
PIECE = 200_000
"""Rows that are read at a time."""


class _Form(NamedTuple):
    """How a file is written: the names of the columns of numbers, where these and the first row stand."""

    encoding: str
    separator: str
    comma: bool
    columns: dict[str, int]
    width: int
    above: int


def read_text(path: Path) -> Sampled:
    """Channels of a text file: a column each, and one of times, if the rate is not stated.

    A preamble may stand above the header, a row of units below it, and columns of other things beside.
    """
    head = first_bytes(path, HEAD)
    wide = head.startswith((codecs.BOM_UTF16_LE, codecs.BOM_UTF16_BE))
    if len(head) == HEAD and not wide:
        head = head[: head.rfind(b"\n") + 1] or head
    problems = Problems()
    text = problems.need(decode(str(path), head, problems))
    form = _form(path, text, "utf-16" if wide else "latin-1")
    numbers = _numbers(path, form)
    return sampled(path, dict(zip(form.columns, numbers, strict=True)), first_row=form.above + 1)


def _form(path: Path, text: str, encoding: str) -> _Form:
    lines = re.split(r"\r\n|\n|\r", text)
    later = lines[len(lines) // 2 :]
    separator = max("\t;,", key=lambda sign: sum(sign in line for line in later))
    rows = [[cell.strip() for cell in _cells(line, separator)] for line in lines]
    comma = decimal_comma((cell for row in rows[len(lines) // 2 :] for cell in row if "," in cell), separator)
    kinds = [tuple(plain_number(cell, comma=comma) is not None for cell in row) for row in rows]
    usual = Counter(kind for kind in kinds if any(kind)).most_common(1)
    if not usual:
        raise refusal(path, "a table: a column a channel, a row a sample, and names above the numbers")
    own = usual[0][0]
    above = kinds.index(own)
    places = [i for i, number in enumerate(own) if number]
    headers = [row for row in rows[:above] if len(row) > places[-1] and any(row)]
    if not headers:
        raise refusal(path, "a row with a name for each column above the numbers", above + 1)
    names = [headers[-1][i].lstrip("# ") for i in places]
    units = [spelt(cell.strip("[]() ")) for cell in names]
    if len(headers) > 1 and units[0] in TIME:
        names = [f"{headers[-2][i]}_{unit}".strip("#_ ") for i, unit in zip(places, units, strict=True)]
    for i, name in enumerate(names):
        if not name or name in names[:i]:
            raise refusal(path, "a name for each column of numbers, each once", above, None, name)
    return _Form(encoding, separator, comma, dict(zip(names, places, strict=True)), len(own), above)


def _cells(line: str, separator: str) -> list[str]:
    return next(csv.reader([line], delimiter=separator), [])


def _open(path: Path, form: _Form) -> TextIO:
    return path.open(encoding=form.encoding, errors="replace", newline="")


def _numbers(path: Path, form: _Form) -> FloatArray:
    """Shape (columns, rows); NaN where a cell is blank."""
    import pandas as pd

    with path.open("rb") as stream:
        ends = [(piece.count(b"\n"), piece.count(b"\r")) for piece in iter(lambda: stream.read(2**20), b"")]
    numbers = np.empty((len(form.columns), int(np.max(np.sum(ends, axis=0))) + 1 - form.above))
    done, places = 0, list(form.columns.values())
    with _open(path, form) as text:
        for _ in range(form.above):
            text.readline()
        try:
            pieces = pd.read_csv(
                text,
                sep=form.separator,
                decimal="," if form.comma else ".",
                header=None,
                dtype={i: np.float64 if i in places else str for i in range(form.width)},
                chunksize=PIECE,
                skip_blank_lines=False,
            )
            for piece in pieces:
                numbers[:, done : done + len(piece)] = piece[places].to_numpy().T
                done += len(piece)
        except ValueError as error:  # a ParserError too
            _explain(path, form, form.above + done)
            raise refusal(path, f"rows of numbers ({error})") from error
    while done and np.isnan(numbers[:, done - 1]).all():
        done -= 1
    return numbers[:, :done]


def _explain(path: Path, form: _Form, skipped: int) -> None:
    """Complain about the first cell below so many rows that is neither a number nor blank."""
    with _open(path, form) as stream:
        for number, line in enumerate(islice(stream, skipped, None), skipped + 1):
            cells = _cells(line, form.separator)
            for name, place in form.columns.items():
                cell = cells[place].strip() if place < len(cells) else ""
                try:
                    parse_number(cell or "0", comma=form.comma)
                except NotANumber as error:
                    raise refusal(path, str(error), number, name, cell) from None
            if len(cells) > form.width:
                raise refusal(path, f"a row of {form.width} cells like the others", number)
