"""Kinds of values that stand at keys: numbers, names, choices, lists, and tables of keys."""

from __future__ import annotations

import contextlib
import datetime
import math
import re
import sys
from collections.abc import Callable, Sequence
from typing import Any

from rotorid.base.suggestions import did_you_mean
from rotorid.base.text import listing
from rotorid.files.decimal_numbers import NotANumber, check_size, has_decimal_comma, parse_number
from rotorid.files.settings_keys import Key, Kind, object_schema, take
from rotorid.files.toml_file import Section

_DAY = re.compile(r"\d{4}-\d\d-\d\d")
_TEXT = {"type": "string"}
_NUMBER = {"type": "number"}


def number(low: float = -math.inf, high: float = math.inf) -> Kind:
    """A finite number within limits; `ABOVE_ZERO` is one, too."""
    bounds = {"minimum": low, "maximum": high}
    schema = _NUMBER | {name: bound for name, bound in bounds.items() if math.isfinite(bound)}
    above_zero = low == sys.float_info.min
    if above_zero:
        schema = {**_NUMBER, "exclusiveMinimum": 0}
    words = "a number above 0" if above_zero else f"a number of {low:g} or more"
    if math.isfinite(high):
        words = f"a number from {low:g} to {high:g}"
    return Kind(lambda section, key: section.number(key, low=low, high=high), schema, words)


ABOVE_ZERO = number(sys.float_info.min)
TURN = number(-360.0, 360.0)
"""An angle in degrees."""
TEXT = Kind(lambda section, key: section.text(key), _TEXT, "text", cell="name")


def choice(words: Sequence[str]) -> Kind:
    """One of several texts."""

    def read(section: Section, key: str) -> str | None:
        value = section.take(key)
        if value in words:
            return str(value)
        hint = did_you_mean(value, words) if isinstance(value, str) else ""
        section.complain(key, listing(map(repr, words)) + hint)
        return None

    return Kind(read, {"enum": list(words)}, listing(words), cell="name")


def _flag(section: Section, key: str) -> bool | None:
    value = section.take(key)
    if isinstance(value, bool):
        return value
    section.complain(key, "true or false, without quotes (in a sheet: yes or no)")
    return None


FLAG = Kind(_flag, {"type": "boolean"}, "yes or no", "false", cell="flag")


def _label(section: Section, key: str) -> str | None:
    value = section.take(key)
    return section.text(key) if isinstance(value, bool) or not isinstance(value, int) else str(value)


LABEL = Kind(_label, {"type": ["string", "integer"]}, "text, or a number as its name", cell="name")
"""A name that may be a number, as serial numbers are."""


def _date(section: Section, key: str) -> datetime.date | None:
    value = section.take(key)
    if isinstance(value, datetime.datetime):
        return value.date()
    with contextlib.suppress(ValueError):
        if isinstance(value, datetime.date) or (isinstance(value, str) and _DAY.fullmatch(value.strip())):
            return value if isinstance(value, datetime.date) else datetime.date.fromisoformat(value.strip())
    section.complain(key, "a date, such as 2026-03-17")
    return None


DATE = Kind(_date, {"type": "string", "format": "date"}, "a date, 2026-03-17", "2026-03-17", cell="date")


def whole(what: str, low: int, high: int) -> Kind:
    """A whole number within limits; `what` is it, for messages."""

    def read(section: Section, key: str) -> int | None:
        found = plain_number(section.take(key))
        if found is None or not low <= found <= high or found != int(found):
            section.complain(key, f"{what}, a whole number from {low} to {high}")
            return None
        return int(found)

    schema = {"type": "integer", "minimum": low, "maximum": high}
    return Kind(read, schema, f"a whole number from {low} to {high}")


def numbers(what: str, form: str, *, above_zero: bool = False) -> Kind:
    """A list of finite numbers, a single one, or a text of them with semicolons, as in a sheet.

    Parameters
    ----------
    what
        The list with an example, for messages.
    form
        The text with semicolons, for forms.
    above_zero
        Whether zero and negative numbers are wrong.
    """

    def read(section: Section, key: str) -> tuple[float, ...] | None:
        value = section.take(key)
        if isinstance(value, str):
            value = [part.strip() for part in value.split(";") if part.strip()]
        elif not isinstance(value, list):
            value = [value]
        if not value:
            section.complain(key, f"at least one number: {what}")
            return None
        found = []
        for entry in value:
            one = plain_number(entry, comma=True)
            if one is None or (above_zero and one <= 0):
                shown = "a list" if isinstance(entry, list) else repr(entry)
                wrong = f"numbers, not {shown}" if one is None else f"numbers above 0, not {one:g}"
                section.complain(key, f"{wrong}: {what}")
                return None
            found.append(one)
        return tuple(found)

    one = {**_NUMBER, "exclusiveMinimum": 0} if above_zero else _NUMBER
    schema = {"anyOf": [one, {"type": "array", "items": one, "minItems": 1}, _TEXT]}
    return Kind(read, schema, form, _example(what))


def by_name(what: str, form: str) -> Kind:
    """A table of numbers above 0 by name, or a text of them, as in a sheet.

    Parameters
    ----------
    what
        The table with an example, for messages.
    form
        The text, such as `3: 10; 5: 20`.
    """

    def read(section: Section, key: str) -> dict[str, float] | None:
        value = entries(section, key, section.take(key), f'{what}, in a sheet "{form}"', "name")
        if not isinstance(value, dict) or not value:
            if key not in section.refused:
                section.complain(key, what)
            return None
        found = {}
        for name, entry in value.items():
            one = plain_number(entry, comma=True)
            if one is None or one <= 0:
                section.complain(key, f"a number above 0 for {name!r}, not {entry!r}: {what}")
            else:
                found[name] = one
        return found

    table = {"type": "object", "additionalProperties": {**_NUMBER, "exclusiveMinimum": 0}, "minProperties": 1}
    return Kind(read, {"anyOf": [table, _TEXT]}, form, _example(what), cell="name")


def _example(what: str) -> str:
    return what.rpartition("such as ")[2] if "such as " in what else ""


def entries(section: Section, key: str, value: object, expected: str, each: str) -> object:
    """The table that a text such as `3: 10` stands for, None with a problem; else the value as it is."""
    if not isinstance(value, str):
        return value
    parts = [part.partition(":") for part in value.split(";") if part.strip()]
    if not parts or not all(separator and name.strip() for name, separator, _ in parts):
        section.complain(key, expected)
        return None
    found = {name.strip(): text.strip() for name, _, text in parts}
    if len(found) < len(parts):
        section.complain(key, f"each {each} once")
        return None
    return found


def plain_number(value: object, *, comma: bool = False) -> float | None:
    """A finite number of a size that occurs, from a number or its text (`comma`: or with one); else None."""
    if isinstance(value, bool) or not isinstance(value, (int, float, str)):
        return None
    try:
        own = comma and isinstance(value, str) and has_decimal_comma(value)
        read = parse_number(value, comma=own) if isinstance(value, str) else float(value)
        check_size(read)
    except (NotANumber, OverflowError):
        return None
    return read


def table(keys: Sequence[Key], made: Callable[[Section], Any] | None = None) -> Kind:
    """A table [key]; `made` takes its keys and makes something of them (default: as `take`)."""

    def read(section: Section, key: str) -> Any:  # noqa: ANN401
        inner = section.section(key)
        return None if inner is None else _made(inner, keys, made)

    return Kind(read, object_schema(keys), header="[{}]")


def named(keys: Sequence[Key], made: Callable[[Section], Any] | None = None) -> Kind:
    """Tables [key.NAME], by name."""

    def read(section: Section, key: str) -> dict[str, Any]:
        return {name: _made(inner, keys, made) for name, inner in section.named(key).items()}

    schema = {"type": "object", "additionalProperties": object_schema(keys)}
    return Kind(read, schema, header="[{}.NAME]")


def each(keys: Sequence[Key], made: Callable[[Section], Any] | None = None) -> Kind:
    """Tables [[key]], in their order."""

    def read(section: Section, key: str) -> list[Any]:
        return [_made(inner, keys, made) for inner in section.sections(key)]

    return Kind(read, {"type": "array", "items": object_schema(keys)}, header="[[{}]]")


def _made(section: Section, keys: Sequence[Key], made: Callable[[Section], Any] | None) -> Any:  # noqa: ANN401
    return take(section, keys) if made is None else made(section)
