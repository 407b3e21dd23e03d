"""Settings of a job as cells of a workbook, as `job_from_excel` reads them."""

from __future__ import annotations

import json
import math
import re
from collections.abc import Mapping, Sequence
from decimal import Decimal
from typing import Any

from rotorid.files.cells import Cell, Shown, show
from rotorid.files.decimal_numbers import parse_number
from rotorid.tables.job.job_keys import FORBIDDEN

TEXT_COLUMNS = ("run", "sensor", "plane", "repeat", "key")
"""Columns of names, in which `1` is text."""
_BARE = re.compile(r"[A-Za-z0-9_-]+")


def number_cell(cell: Cell, separator: str, *, comma: bool) -> Cell:
    """A number with the digits in which it is written; NotANumber for a text that is none."""
    if not isinstance(cell, str) or not cell:
        return cell
    value = parse_number(cell, comma=comma, separator=separator)
    text = cell.replace(",", ".").rstrip(".")
    if text != show(value) and (value or "e" not in text.lower()):
        return Shown(value, text)  # 12.50 keeps its digits
    whole = value.is_integer() and abs(value) < 1e15 and (value != 0 or math.copysign(1.0, value) > 0)
    return int(value) if whole else value


def dotted_key(parts: Sequence[str]) -> str:
    """A dotted key; where a part could be misread, parts stand in quotes, as in a job file."""
    if all(part and part == part.strip() and not re.search(r"[.\"'\\#]", part) for part in parts):
        return ".".join(parts)
    return ".".join(part if _BARE.fullmatch(part) else json.dumps(part, ensure_ascii=False) for part in parts)


def setting_cell(column: str, value: Any) -> Cell:  # noqa: ANN401
    """A value about a plane or sensor; one pair of angles may stand without a list around it."""
    alone = FORBIDDEN.accepts(column) and isinstance(value, list) and not isinstance(value[0], list)
    return _setting([value] if alone else value)


def _setting(value: Any) -> Cell:  # noqa: ANN401  whatever a job file holds
    """A value of a job file as one cell."""
    if isinstance(value, bool):
        return "yes" if value else "no"
    if isinstance(value, (int, float, str)):
        return value
    if isinstance(value, Mapping):
        return "; ".join(f"{name}: {_text(entry)}" for name, entry in value.items())
    if not isinstance(value, list):
        return str(value)
    if any(isinstance(entry, list) for entry in value):
        return "; ".join(_pair(entry) for entry in value)
    if len(value) == 1 and not isinstance(value[0], bool):
        return value[0] if isinstance(value[0], (int, float, str)) else str(value[0])
    return "; ".join(_text(entry) for entry in value)


def _pair(pair: Sequence[float]) -> str:
    return " to ".join(_plain(end) for end in pair)


def _text(entry: object) -> str:
    return repr(entry) if isinstance(entry, (int, float)) else str(entry)


def _plain(number: float) -> str:
    """A number without an exponent."""
    return format(Decimal(repr(number)), "f")
