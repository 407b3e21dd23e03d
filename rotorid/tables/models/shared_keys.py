"""Keys that model files of both kinds have: names, numbers and limits by name, errors of amplitudes."""

from __future__ import annotations

import math
from collections.abc import Callable, Collection, Iterator
from typing import TYPE_CHECKING

from rotorid.base.suggestions import did_you_mean
from rotorid.files import value_kinds
from rotorid.files.decimal_numbers import LARGEST
from rotorid.files.settings_keys import Key, Kind, Said, take
from rotorid.files.toml_file import Section
from rotorid.identify.expressions import is_name

if TYPE_CHECKING:
    from rotorid.identify.amplitudes import AmplitudeErrors

_LIMITS = {"type": "array", "items": {"type": "number"}, "minItems": 2, "maxItems": 2}
NAMES = {"type": "array", "items": {"type": "string"}}


def by_own_name(value: dict[str, object]) -> Kind:
    """A table of names that users choose: the section, to be read when other keys say which there may be.

    Parameters
    ----------
    value
        What stands at each name, as a JSON schema.
    """
    schema = {"type": "object", "additionalProperties": value}
    return Kind(lambda section, key: section.section(key), schema, header="[{}]")


def _errors(section: Section) -> AmplitudeErrors | None:
    percent, phase, floor = take(section, ERRORS).values()
    if not (percent or phase or floor):
        section.refuse(
            "at least one of amplitude_percent, phase_deg and floor above 0, or no [errors] at all"
        )
        return None
    from rotorid.identify.amplitudes import AmplitudeErrors

    return AmplitudeErrors(percent / 100.0, math.radians(phase), floor)


NUMBERS = by_own_name({"type": "number"})
TEXTS = by_own_name({"type": ["string", "number"]})
ERRORS = (
    Key("amplitude_percent", value_kinds.number(0.0, 1000.0), "of an amplitude, percent of it", default=0.0),
    Key("phase_deg", value_kinds.number(0.0, 360.0), "of a phase, degrees", default=0.0),
    Key("floor", value_kinds.number(0.0), "at amplitude 0, in the unit of the model", default=0.0),
)
"""One standard deviation of a reading."""
STATED_ERRORS = Key(
    "errors", value_kinds.table(ERRORS, _errors), "of readings of amplitudes, one standard deviation"
)
PRIOR = Key(
    "prior", by_own_name(_LIMITS), "name = [value, standard deviation]: what is known of it beside the data"
)
BOUNDS = Key("bounds", by_own_name(_LIMITS), "name = [lowest, highest], `inf` for none")


def unlike_a_name(name: object, reserved: str) -> str:
    """What is expected instead of what is no name, or nothing; `reserved` is a letter with a meaning."""
    if isinstance(name, str) and is_name(name) and name != reserved:
        return ""
    return f"names: a letter, then letters, digits and _; not {reserved} and no function"


def unlike(name: str, known: Collection[str], where: str) -> str:
    """What is expected instead of a name that does not stand there, or nothing."""
    return "" if name in known else f"a name of {where}{did_you_mean(name, known)}"


def names_in(section: Section | None, wrong: Callable[[str], str]) -> Iterator[str]:
    """The keys of a table, if there is one, that are as they should be.

    Parameters
    ----------
    section
        The table.
    wrong
        Says what is expected instead of a key, which becomes a complaint; empty where the key is right.
    """
    if section is None:
        return
    for name in section.keys:
        if expected := wrong(name):
            section.take(name)
            section.complain(name, expected, value=False)
        else:
            yield name


def limits(section: Section, name: str) -> tuple[float, float] | None:
    """[lowest, highest] of a name, or None and a problem."""
    found = pair(section.take(name))
    if found is None:
        section.complain(name, "two numbers, [lowest, highest], such as [0, 2e6] or [0, inf]")
    return found


def priors(section: Section | None, names: Collection[str]) -> dict[str, tuple[float, float]]:
    """Value and standard deviation of parameters with a prior; anything else is complained about."""
    found = {}
    for name in names_in(section, lambda name: unlike(name, names, "estimate")):
        value = section.take(name) if section else None
        numbers: list[float] = value if isinstance(value, list) and len(value) == 2 else [math.inf, 0.0]
        good = [isinstance(x, int | float) and not isinstance(x, bool) and abs(x) <= LARGEST for x in numbers]
        if all(good) and numbers[1] >= 1 / LARGEST:
            found[name] = float(numbers[0]), float(numbers[1])
        elif section:
            section.complain(name, "[value, standard deviation above 0], such as [1.0, 0.5]")
    return found


def is_missing(said: Said, key: str) -> bool:
    """Whether a key is neither there nor only misspelt, which is reported as that."""
    section = said.section
    others = [name for name in section.keys if name not in said]
    return key not in section and not any(did_you_mean(name, [key]) for name in others)


def pair(value: object) -> tuple[float, float] | None:
    """Two numbers in order, the outer ones perhaps infinite."""
    if not isinstance(value, list) or len(value) != 2:
        return None
    if not all(isinstance(item, (int, float)) and not isinstance(item, bool) for item in value):
        return None
    low, high = (
        float(max(min(item, LARGEST * 10), -LARGEST * 10)) if isinstance(item, int) else item
        for item in value
    )
    sizes_fit = all(abs(item) <= LARGEST or math.isinf(item) for item in (low, high))
    return (low, high) if sizes_fit and low < high else None
