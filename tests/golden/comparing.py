"""What differs between a stored outcome and one of now, beyond rounding.

Keys, their order, words, whole numbers and exit statuses are compared exactly; decimals to 1e-9 of the
largest number of their array (all numbers of one path, whatever the indices), or to one unit of the last
printed digit. `TOLERANCES` names what may differ more.
"""

from __future__ import annotations

import csv
import io
import json
import re
from collections.abc import Iterator
from dataclasses import dataclass, field
from fnmatch import fnmatchcase
from typing import Any

from golden.tolerances import TOLERANCES, Tolerance

RELATIVE = 1e-9
NUMBER = re.compile(r"(?<![\w.])[-+]?\d+(?:\.\d+)?(?:[eE][-+]?\d+)?(?!\w)|(?<=±)\d+\.\d+")
LONG = 10
"""A printed number with so many digits is one that was not rounded for reading."""
MOST = 12
"""So many differences of one part are told."""


def compare(
    case: str,
    stored: tuple[dict[str, str], str | None],
    now: tuple[dict[str, str], str | None],
    tolerances: tuple[Tolerance, ...] = TOLERANCES,
) -> list[str]:
    """Differences in words; empty if there are none.

    Parameters
    ----------
    case
        Its name, which tolerances ask for.
    stored, now
        As `golden.storing.read` and `golden.storing.parts` give them.
    tolerances
        What may differ more.
    """
    mine = [tolerance for tolerance in tolerances if fnmatchcase(case, tolerance.case)]
    if list(stored[0]) != list(now[0]):
        return [f"parts: {list(stored[0])} are now {list(now[0])}; {now[0].get('error', '')}"]
    found: list[str] = []
    for part, old in stored[0].items():
        found += [f"{part}: {line}" for line in _part(part, old, now[0][part], mine)]
    if (stored[1] is None) != (now[1] is None):
        return [*found, f"json: {'there is none now' if now[1] is None else 'there was none'}"]
    if stored[1] is not None and now[1] is not None:
        found += [f"json: {line}" for line in documents(json.loads(stored[1]), json.loads(now[1]), mine)]
    return found


def _part(part: str, old: str, new: str, tolerances: list[Tolerance]) -> list[str]:
    kind = part.rpartition(".")[2] if part.startswith("file ") else ""
    if kind == "csv":
        return tables(old, new, tolerances)
    if kind in ("json", "mat", "npz"):
        return documents(json.loads(old), json.loads(new), tolerances)
    if kind == "xlsx":
        return documents(_sheets(old), _sheets(new), tolerances)
    return texts(old, new, tolerances)


# documents


def documents(old: Any, new: Any, tolerances: list[Tolerance] | tuple[Tolerance, ...] = ()) -> list[str]:
    """Differences of two JSON documents."""
    arrays: dict[str, list[tuple[str, float, float]]] = {}
    found = list(_structure(old, new, "", "", arrays))
    for array, pairs in arrays.items():
        found += _numbers(array, pairs, tolerances)
    return found[:MOST]


def _structure(
    old: Any, new: Any, path: str, array: str, arrays: dict[str, list[tuple[str, float, float]]]
) -> Iterator[str]:
    """What differs but the decimals, which are collected by the path without its indices."""
    where = path or "document"
    if type(old) is not type(new):
        yield f"{where}: {old!r:.100} is now {new!r:.100}"
    elif isinstance(old, dict):
        if list(old) != list(new):
            yield f"{where}: keys {list(old)} are now {list(new)}"
            return
        for key, value in old.items():
            yield from _structure(value, new[key], f"{path}.{key}", f"{array}.{key}", arrays)
    elif isinstance(old, list):
        if len(old) != len(new):
            yield f"{where}: {len(old)} items are now {len(new)}"
            return
        for i, (a, b) in enumerate(zip(old, new, strict=True)):
            yield from _structure(a, b, f"{path}[{i}]", array, arrays)
    elif isinstance(old, float):
        arrays.setdefault(array, []).append((where, old, new))
    elif old != new:
        yield f"{where}: {old!r} is now {new!r}"


def _numbers(
    array: str, pairs: list[tuple[str, float, float]], tolerances: list[Tolerance] | tuple[Tolerance, ...]
) -> Iterator[str]:
    largest = max(abs(old) for _, old, _ in pairs)
    allowed = RELATIVE * largest
    for tolerance in tolerances:
        if fnmatchcase(array.lstrip("."), tolerance.place):
            allowed = max(allowed, tolerance.relative * largest, tolerance.absolute)
    for where, old, new in pairs:
        if not abs(old - new) <= allowed:
            yield f"{where}: {old!r} is now {new!r}, more than {allowed:.2g} apart"


def _sheets(text: str) -> dict[str, Any]:
    """The cells of a workbook by sheet, column and row: a column is an array."""
    sheets: dict[str, Any] = {}
    for line in text.splitlines():
        sheet, row, *cells = json.loads(line)
        for column, cell in enumerate(cells):
            sheets.setdefault(sheet, {}).setdefault(f"column {column + 1}", []).append(
                {"row": row, "cell": cell}
            )
    return sheets


def tables(old: str, new: str, tolerances: list[Tolerance] | tuple[Tolerance, ...] = ()) -> list[str]:
    """Differences of two tables in CSV: comments and header exactly, a column is an array."""
    return documents(_table(old), _table(new), tolerances)


def _table(text: str) -> dict[str, Any]:
    lines = text.splitlines()
    comments = [line for line in lines if line.startswith("#")]
    rows = list(csv.reader(io.StringIO("\n".join(line for line in lines if not line.startswith("#")))))
    header, body = rows[0], [[_cell(cell) for cell in row] for row in rows[1:]]
    return {
        "comments": comments,
        "header": header,
        "rows": [dict(zip(header, row, strict=True)) for row in body],
    }


def _cell(cell: str) -> float | str:
    try:
        return float(cell)
    except ValueError:
        return cell


# texts


@dataclass
class Line:
    """A line of text: its words with a mark for each decimal, and the decimals."""

    text: str
    words: str = ""
    numbers: list[str] = field(default_factory=list)

    def __post_init__(self) -> None:
        self.numbers = [n for n in NUMBER.findall(self.text) if re.search(r"[.eE]", n)]
        marked = NUMBER.sub(lambda found: "#" if re.search(r"[.eE]", found[0]) else found[0], self.text)
        self.words = " ".join(marked.split())


def texts(old: str, new: str, tolerances: list[Tolerance] | tuple[Tolerance, ...] = ()) -> list[str]:
    """Differences of two texts: words line by line exactly, decimals to a unit of their last digit.

    Where no decimal differs, the spaces must not either.
    """
    if old == new:
        return []
    before, after = ([Line(line) for line in text.split("\n")] for text in (old, new))
    if len(before) != len(after):
        return [f"{len(before)} lines are now {len(after)}", *_first(before, after)]
    found: list[str] = []
    rounded = False
    for number, (a, b) in enumerate(zip(before, after, strict=True), start=1):
        if a.words != b.words:
            found.append(f"line {number}: {a.text.strip()!r} is now {b.text.strip()!r}")
            continue
        rounded |= a.numbers != b.numbers
        found += [
            f"line {number}: {a.text.strip()!r:.300} is now {b.text.strip()!r:.300}: {x}"
            for x in _decimals(a, b, tolerances)
        ]
    if not found and not rounded:
        found = _first(before, after)
    return found[:MOST]


def _decimals(a: Line, b: Line, tolerances: list[Tolerance] | tuple[Tolerance, ...]) -> Iterator[str]:
    largest = max((abs(float(x)) for x in a.numbers if _digits(x) >= LONG), default=0.0)
    mine = [tolerance for tolerance in tolerances if fnmatchcase(a.words, tolerance.place)]
    for x, y in zip(a.numbers, b.numbers, strict=True):
        old, new = float(x), float(y)
        allowed = (1 + 1e-6) * max(min(_unit(x), _unit(y)), 0.0)
        if _digits(x) >= LONG:
            allowed = max(allowed, RELATIVE * largest)
        for tolerance in mine:
            allowed = max(allowed, tolerance.relative * abs(old), tolerance.absolute)
        if not abs(old - new) <= allowed:
            yield f"{x} is now {y}"


def _digits(number: str) -> int:
    return len(re.sub(r"[eE].*|\D", "", number).lstrip("0"))


def _unit(number: str) -> float:
    """One unit of the last printed digit."""
    mantissa, _, exponent = number.lower().partition("e")
    return float(10.0 ** (int(exponent or 0) - len(mantissa.partition(".")[2])))


def _first(before: list[Line], after: list[Line]) -> list[str]:
    for number, (a, b) in enumerate(zip(before, after, strict=False), start=1):
        if a.text != b.text:
            return [f"line {number}: {a.text!r} is now {b.text!r}"]
    return []
