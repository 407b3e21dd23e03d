"""A number from the text of a cell: strictly, or a reason why not."""

from __future__ import annotations

import math
import re

_POINT = re.compile(r"[+-]?(?:[0-9]+(?:\.[0-9]*)?|\.[0-9]+)(?:[eE][+-]?[0-9]+)?")
_COMMA = re.compile(r"[+-]?(?:[0-9]+,[0-9]*|,[0-9]+)(?:[eE][+-]?[0-9]+)?")
_THOUSANDS = re.compile(r"[+-]?[0-9]{1,3}(?:[ ,.'’][0-9]{3})+(?:[.,][0-9]*)?")
_WITH_UNIT = re.compile(r"([+-]?[0-9][0-9.,]*(?:[eE][+-]?[0-9]+)?)\s*([^\W\d_]|[°%µμ]).*")
_NOT_FINITE = {"nan", "inf", "infinity", "-nan", "ind", "1.#qnan", "1.#inf", "-1.#ind", "1.#ind", "-1.#inf"}
_MISSING = {"na", "n/a", "#n/a", "null", "none", "-", "--", "?"}


class NotANumber(ValueError):
    """The message says what was expected instead."""


def has_decimal_comma(text: str) -> bool:
    """Whether the text is a number written with a decimal comma."""
    return _COMMA.fullmatch(text) is not None


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
    if _POINT.fullmatch(text):
        if comma and "." in text:
            raise NotANumber(
                "a number with a decimal comma, as elsewhere in this file (a point could separate thousands)"
            )
        return _finite(text)
    if has_decimal_comma(text):
        if comma:
            return _finite(text.replace(",", "."))
        raise NotANumber(_why_no_comma(separator))
    raise NotANumber(_reason(text))


def _finite(text: str) -> float:
    value = float(text)
    if not math.isfinite(value):
        raise NotANumber("a finite number")
    return value


def _why_no_comma(separator: str) -> str:
    where = {",": "comma-separated", "\t": "tab-separated"}.get(separator)
    if where is None:
        return "a number; the cell holds text, with a comma"
    return f"a number with a decimal point: in a {where} file a comma is not a decimal sign (separate by ;)"


def _reason(text: str) -> str:
    folded = text.casefold()
    if not text:
        return "a number"
    if folded.lstrip("+-") in _NOT_FINITE or folded in _NOT_FINITE:
        return "a finite number"
    if folded in _MISSING:
        return "a number; a missing value is not filled in"
    if _THOUSANDS.fullmatch(text):
        return "a number without thousands separators"
    if "\N{MINUS SIGN}" in text or "\N{EN DASH}" in text:
        return "a number with the minus sign written as -"
    if _WITH_UNIT.fullmatch(text):
        return "a number alone; write the unit in the header"
    return "a number"
