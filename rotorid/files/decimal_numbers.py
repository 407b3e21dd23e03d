"""Decimal numbers from the text of a cell, with point or comma: strictly, or a reason why not."""

from __future__ import annotations

import math
import re
from collections.abc import Iterable

_POINT = re.compile(r"[+-]?(?:[0-9]+(?:\.[0-9]*)?|\.[0-9]+)(?:[eE][+-]?[0-9]+)?")
_COMMA = re.compile(r"[+-]?(?:[0-9]+,[0-9]*|,[0-9]+)(?:[eE][+-]?[0-9]+)?")
_POINT_THOUSANDS = re.compile(r"[+-]?[1-9][0-9]{0,2}(?:\.[0-9]{3})+")
_MAYBE_THOUSANDS = re.compile(r"[+-]?[1-9][0-9]{0,2},[0-9]{3}")
_THOUSANDS = re.compile(r"[+-]?[0-9]{1,3}(?:[ ,.'’][0-9]{3})+(?:[.,][0-9]*)?")
_WITH_UNIT = re.compile(r"([+-]?[0-9][0-9.,]*(?:[eE][+-]?[0-9]+)?)\s*([^\W\d_]|[°%µμ]).*")
_NOT_FINITE = re.compile(r"[+-]?(?:nan|inf|infinity|ind|1\.#(?:qnan|inf|ind))", re.IGNORECASE)
SMALLEST, LARGEST = 1e-30, 1e30
"""Sizes outside occur in no table of this project, but squares of them overflow."""
LARGEST_STATED = 1e12
"""Of an option."""


class NotANumber(ValueError):
    """The message says what was expected instead."""


def has_decimal_comma(text: str) -> bool:
    """Whether the text is a number written with a decimal comma."""
    return _COMMA.fullmatch(text) is not None


def decimal_comma(cells: Iterable[str], separator: str) -> bool:
    """Whether the numbers of a file have decimal commas.

    Between semicolons a comma can be nothing else. Between tabs and in a sheet it may also separate
    thousands: there at least one number must show that it does not (1,5 or 1500,000).
    """
    if separator == ",":
        return False
    return any(
        has_decimal_comma(cell) and (separator == ";" or _MAYBE_THOUSANDS.fullmatch(cell) is None)
        for cell in cells
    )


def thousands_or_decimals(cells: Iterable[str], name: str) -> set[str]:
    """Cells of a column without decimal commas whose points may separate thousands, as in 1.350 beside 720.

    A European spreadsheet writes 1350 so where no number of the column has decimals. The column is doubtful
    if it has whole numbers without a point too, or holds revolutions per minute, and no other decimals.
    """
    found = {cell for cell in cells if cell}
    doubtful = {cell for cell in found if _POINT_THOUSANDS.fullmatch(cell)}
    others = found - doubtful
    whole = any(cell.lstrip("+-").isdecimal() and cell.strip("+-0") for cell in others)
    decimals = any("." in cell for cell in others)
    return doubtful if not decimals and (whole or name.casefold().endswith("_rpm")) else set()


def check_size(value: float, largest: float = LARGEST) -> None:
    """Refuse a number that no instrument shows.

    Raises
    ------
    NotANumber
        For one that is not finite, or not zero and outside 1e-30 … `largest`.
    """
    if not math.isfinite(value):
        raise NotANumber("a finite number")
    if value and not SMALLEST <= abs(value) <= largest:
        raise NotANumber(f"0 or a number between {SMALLEST:g} and {largest:g} in size")


def parse_number(text: str, *, comma: bool = False, separator: str = "") -> float:
    """The number a cell holds.

    Parameters
    ----------
    text
        Without surrounding blanks.
    comma
        Whether the numbers of this file have decimal commas.
    separator
        What separates the columns of the file, for the explanation.

    Raises
    ------
    NotANumber
        For everything that is not plainly a finite number; nothing is guessed.
    """
    comma_there = has_decimal_comma(text)
    if comma_there and not comma:
        raise NotANumber(_why_no_comma(separator))
    if not comma_there and _POINT.fullmatch(text) is None:
        raise NotANumber(_reason(text))
    if comma and "." in text:
        raise NotANumber(
            "a number with a decimal comma, as elsewhere in this file (a point could separate thousands)"
        )
    value = float(text.replace(",", "."))
    if not math.isfinite(value):
        raise NotANumber("a finite number")
    return value


def _why_no_comma(separator: str) -> str:
    if separator == ",":
        words = "in a comma-separated file a comma is not a decimal sign (separate by ;)"
        return f"a number with a decimal point: {words}"
    return "a number with a decimal point: this comma may separate thousands (or separate columns by ;)"


def _reason(text: str) -> str:
    if _NOT_FINITE.fullmatch(text):
        return "a finite number"
    if _THOUSANDS.fullmatch(text):
        return "a number without thousands separators"
    if "\N{MINUS SIGN}" in text or "\N{EN DASH}" in text:
        return "a number with the minus sign written as -"
    return "a number alone; write the unit in the header" if _WITH_UNIT.fullmatch(text) else "a number"
