"""Values of a job: numbers with units in their keys, and lists, as job files and sheets write them."""

from __future__ import annotations

import sys
from collections.abc import Mapping
from typing import NamedTuple

from rotorid.tables.reader import units
from rotorid.tables.reader.number import NotANumber, check_size, has_decimal_comma, parse_number
from rotorid.tables.reader.toml_file import Section
from rotorid.tables.reader.units import Unit


class Quantity(NamedTuple):
    """A number with the key that holds it and its unit."""

    key: str
    value: float
    unit: Unit

    @property
    def si(self) -> float:
        """In SI."""
        return self.unit.to_si(self.value)


Stem = tuple[str, Mapping[str, Unit], str]
"""Beginning of a key, the units that may end it, and the usual one."""


def to_job_weight(weight: Quantity, weight_unit: str, radius: float | None) -> float | None:
    """A mass or unbalance as the job's weights are (kg or kg·m); None: a radius is needed."""
    wanted = units.weight(weight_unit).kind
    if weight.unit.kind == wanted:
        return weight.si
    if radius is None:
        return None
    return weight.si * radius if wanted == "unbalance" else weight.si / radius


def measured(section: Section, *stems: Stem) -> Quantity | None:
    """The one key of the given stems with a unit in its name, a number above 0."""
    by_key = _take(section, stems)
    keys = [key for key in section.keys if key in by_key]
    values = {key: section.number(key, low=sys.float_info.min) for key in keys}
    found = [Quantity(key, value, by_key[key]) for key, value in values.items() if value is not None]
    _complain_about_more(section, keys)
    return found[0] if found and len(keys) == 1 else None


def measured_list(section: Section, what: str, *stems: Stem) -> tuple[Quantity, ...]:
    """The one key of the given stems, a list of numbers above 0 (or one number); empty without it.

    Parameters
    ----------
    section
        Where it stands.
    what
        The list with an example, for messages.
    stems
        See `measured`.
    """
    by_key = _take(section, stems)
    keys = [key for key in section.keys if key in by_key]
    values = {key: numbers(section, key, what, above_zero=True) for key in keys}
    _complain_about_more(section, keys)
    if len(keys) != 1:
        return ()
    return tuple(Quantity(keys[0], value, by_key[keys[0]]) for value in values[keys[0]] or ())


def numbers(section: Section, key: str, what: str, *, above_zero: bool = False) -> tuple[float, ...] | None:
    """A list of finite numbers, a single one, or a text of them with semicolons, as in a sheet.

    Parameters
    ----------
    section, key
        Where it stands.
    what
        The list with an example, for messages.
    above_zero
        Whether zero and negative numbers are wrong.

    Returns
    -------
    None without the key, and with a problem.
    """
    value = section.take(key)
    if value is None:
        return None
    if isinstance(value, str):
        value = [part.strip() for part in value.split(";") if part.strip()]
    elif not isinstance(value, list):
        value = [value]
    if not value:
        section.complain(key, f"at least one number: {what}")
        return None
    found = [number(entry, comma=True) for entry in value]
    for entry, read in zip(value, found, strict=True):
        if read is None:
            shown = "a list" if isinstance(entry, list) else repr(entry)
            section.complain(key, f"numbers, not {shown}: {what}")
            return None
        if above_zero and read <= 0:
            section.complain(key, f"numbers above 0, not {read:g}: {what}")
            return None
    return tuple(read for read in found if read is not None)


def whole(section: Section, key: str, what: str, low: int, high: int) -> int | None:
    """A whole number within limits; None without the key, and with a problem."""
    value = section.take(key)
    if value is None:
        return None
    read = number(value)
    if read is None or not low <= read <= high or read != int(read):
        section.complain(key, f"{what}, a whole number from {low} to {high}")
        return None
    return int(read)


def by_name(section: Section, key: str, what: str) -> dict[str, float]:
    """A table of numbers above 0 by name, or a text of them, as in a sheet; empty with a problem.

    Parameters
    ----------
    section, key
        Where it stands.
    what
        The table with an example, for messages.
    """
    value = section.take(key)
    if value is None:
        return {}
    if isinstance(value, str):
        parts = [part.partition(":") for part in value.split(";") if part.strip()]
        if not parts or not all(separator and name.strip() for name, separator, _ in parts):
            section.complain(key, f'{what}, in a sheet "3: 10; 5: 20"')
            return {}
        value = {name.strip(): text.strip() for name, _, text in parts}
        if len(value) < len(parts):
            section.complain(key, "each name once")
            return {}
    if not isinstance(value, dict) or not value:
        section.complain(key, what)
        return {}
    found: dict[str, float] = {}
    for name, entry in value.items():
        read = number(entry, comma=True)
        if read is None or read <= 0:
            section.complain(key, f"a number above 0 for {name!r}, not {entry!r}: {what}")
        else:
            found[name] = read
    return found


def number(value: object, *, comma: bool = False) -> float | None:
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


def _take(section: Section, stems: tuple[Stem, ...]) -> dict[str, Unit]:
    for stem, _, usual in stems:
        section.take(f"{stem}_{usual}")  # known, so that a misspelt one gets it as a suggestion
    return {f"{stem}_{name}": unit for stem, known, _ in stems for name, unit in known.items()}


def _complain_about_more(section: Section, keys: list[str]) -> None:
    for key in keys[1:]:
        section.complain(key, f"one key of them; {keys[0]} says it already")
