"""A JSON document as arrays: all values of one key, whatever the indices above it.

`{"rows": [{"mass": 1.0}, {"mass": 2.0}]}` is `{"rows#": [2], "rows[].mass": [1.0, 2.0]}`: `#` holds how many
items each list has, `[]` stands for the indices. What is prose, or echoes the command line, has its key only.
"""

from __future__ import annotations

import json
import zlib
from fnmatch import fnmatchcase
from typing import Any

Arrays = dict[str, Any]
LONG = 12
"""More values than these are stored thinned."""
SHOWN = 6
"""About as many values of a thinned array are stored as they are."""
DIGITS = 8
PROSE = "…"
UNSTORED = (
    *("provenance.*", "*warnings", "*notes", "*note", "*assumptions", "*assumed", "*commands", "*pictures"),
    *("*message", "*reason", "*latex", "*symbolic[[]].text", "*title", "*about", "*description", "*$comment"),
)
"""Keys whose values are prose, or paths, dates and options as typed."""
WORDS = 3
"""A text with more spaces is a sentence."""


def arrays(document: Any) -> Arrays:
    """Values by key, in their order."""
    found: Arrays = {}

    def walk(value: Any, path: str) -> None:
        if any(fnmatchcase(path, pattern) for pattern in UNSTORED):
            found[path] = PROSE
        elif isinstance(value, dict):
            if not value:
                found.setdefault(path + "{}", []).append(0)
            for key, item in value.items():
                walk(item, f"{path}.{key}" if path else key)
        elif isinstance(value, list):
            found.setdefault(path + "#", []).append(len(value))
            for item in value:
                walk(item, path + "[]")
        elif isinstance(value, str) and value.count(" ") > WORDS:
            found.setdefault(path, []).append(PROSE)
        else:
            found.setdefault(path, []).append(value)

    walk(document, "")
    return found


def is_number(value: Any) -> bool:
    """Whether a value is compared as a number."""
    return isinstance(value, int | float) and not isinstance(value, bool)


def thinned(values: Any) -> Any:
    """Every k-th value of a long array, with what sees a wrong one between them.

    A sum sees one changed number, `moment`, the sum of the numbers weighted by their place (from 0 to 1), two
    exchanged ones; `words` is a checksum of what is no number, with its places.
    """
    if not isinstance(values, list) or len(values) <= LONG:
        return values
    count = len(values)
    if all(value == values[0] and type(value) is type(values[0]) for value in values):
        return {"count": count, "all": values[0]}
    every = -(-count // SHOWN)
    short = {"count": count, "every": every, "values": values[::every]}
    numbers = [(i, value) for i, value in enumerate(values) if is_number(value)]
    if numbers:
        only = [value for _, value in numbers]
        short |= {"least": min(only), "most": max(only), "sum": sum(only)}
        short["moment"] = sum(value * i for i, value in numbers) / (count - 1)
    if len(numbers) < count:
        words = [[i, value] for i, value in enumerate(values) if not is_number(value)]
        short["words"] = f"{zlib.crc32(json.dumps(words).encode()):08x}"
    return short


def rounded(value: Any, digits: int = DIGITS) -> Any:
    """Numbers with so many digits that no comparison sees it; more for a sum, compared like one number."""
    if isinstance(value, dict):
        more = dict.fromkeys(("sum", "moment"), DIGITS + 4)
        return {key: rounded(item, more.get(key, DIGITS)) for key, item in value.items()}
    if isinstance(value, list):
        return [rounded(item) for item in value]
    if isinstance(value, float):
        short = float(f"{value:.{digits}g}")
        return int(short) if short.is_integer() and abs(short) < 10**DIGITS else short
    return value
