"""What can be mounted in a plane, as a job says it: holes, available weights, weights that are there already.

Angles of holes count as all angles of the job do. Where material is removed (`remove = true`) a hole drilled
at the angle φ acts like a weight added at φ + 180°: `Holes` has the angles of these equivalent weights, so
that amounts are positive and Σ amounts e^{iφ} is the correction D in either case; `names` say which hole.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from typing import TYPE_CHECKING

from rotorid.base.suggestions import did_you_mean
from rotorid.tables.job.quantity import (
    Quantity,
    by_name,
    measured,
    measured_list,
    numbers,
    whole,
)
from rotorid.tables.reader import units
from rotorid.tables.reader.toml_file import Section

if TYPE_CHECKING:
    pass

MOST_HOLES = 1000
MOST_IN_ONE = 100
TURN = 360.0
SAME_DEG = 1e-4
_PLACES = ("holes", "holes_deg")
_OTHERS = ("first_hole_deg", "hole_names", "per_hole", "taken", "stock")
_WEIGHTS = (("available", "g"), ("step", "g"))
_UNITS = (*units.MASS, *units.UNBALANCE)
HOLE_COLUMNS = (*_PLACES, *_OTHERS, *(f"{stem}_{unit}" for stem, _ in _WEIGHTS for unit in _UNITS))
"""Columns of the sheet planes, and keys of a plane in a job file."""

_DEG = "angles of the holes in degrees, such as holes_deg = [0, 30, 75]"
_AVAILABLE = "weights of which each can be mounted, such as available_g = [5, 10, 20]"
_TAKEN = 'weights that are in holes already, by number or name of the hole, such as { "3" = 10 }'
_STOCK = "how many there are of each available weight, such as stock = [4, 4, 2]"


@dataclass(frozen=True)
class HoleKeys:
    """Holes and weights of one section [planes.NAME]; `degrees` and `taken` as the job writes them."""

    section: Section
    key: str
    degrees: tuple[float, ...]
    names: tuple[str, ...]
    available: tuple[Quantity, ...] = ()
    per_hole: int = 1
    step: Quantity | None = None
    taken: Mapping[str, float] = field(default_factory=dict)
    stock: tuple[int, ...] | None = None


def read_holes(section: Section) -> HoleKeys | None:
    """Take all keys about holes and available weights; None without them, or with a problem."""
    given = [key for key in HOLE_COLUMNS if key in section]
    key, degrees = _degrees(section)
    names = _names(section, len(degrees))
    available = measured_list(
        section, _AVAILABLE, ("available", units.MASS, "g"), ("available", units.UNBALANCE, "g_mm")
    )
    step = measured(section, ("step", units.MASS, "g"), ("step", units.UNBALANCE, "g_mm"))
    per_hole = whole(section, "per_hole", "how many weights one hole takes", 1, MOST_IN_ONE)
    taken = by_name(section, "taken", _TAKEN)
    stock = _stock(section, len(available))
    if given and not any(place in section for place in _PLACES):
        section.complain(given[0], "the holes of the plane too, holes = 12 or holes_deg = [0, 30, 75]")
        return None
    complaints = _contradictions(given, names, available, step, taken)
    for wrong, expected in complaints:
        section.complain(wrong, expected)
    if complaints or not degrees or not names:
        return None
    return HoleKeys(section, key, degrees, names, available, per_hole or 1, step, taken, stock)


def _contradictions(
    given: Sequence[str],
    names: Sequence[str],
    available: Sequence[Quantity],
    step: Quantity | None,
    taken: Mapping[str, float],
) -> list[tuple[str, str]]:
    """Keys of which each is right by itself, and what is expected of them together."""
    out = []
    if available and step is not None:
        first = available[0].key
        out.append((step.key, f"either {first}, single weights, or {step.key}, any size in steps"))
    if "per_hole" in given and not any(key.startswith("available_") for key in given):
        out.append(("per_hole", "the weights that are available too, available_g = [5, 10]"))
    for name in taken:
        if names and name not in names:
            few = f"from {names[0]} to {names[-1]}" if len(names) > 1 else names[0]
            out.append(("taken", f"holes of the plane, {few}, not {name!r}{did_you_mean(name, names)}"))
    sizes = [weight.value for weight in available]
    if len(set(sizes)) < len(sizes):
        out.append((available[0].key, "each weight once (stock says how many of each there are)"))
    if names and all(name in taken for name in names):
        out.append(("taken", "at least one hole that is free"))
    return out


def _degrees(section: Section) -> tuple[str, tuple[float, ...]]:
    """The key that gives the holes, and their angles in the job's degrees; none with a problem."""
    count = whole(section, "holes", "the number of holes, equally spaced", 1, MOST_HOLES)
    first = section.number("first_hole_deg", 0.0, low=-TURN, high=TURN)
    listed = numbers(section, "holes_deg", _DEG)
    if "holes_deg" in section and "holes" in section:
        section.complain("holes", "either holes, equally spaced, or holes_deg, their angles, not both")
        return "", ()
    if "first_hole_deg" in section and "holes" not in section:
        section.complain("first_hole_deg", "the number of equally spaced holes too, holes = 12")
    if count is not None:
        return "holes", tuple((first or 0.0) + TURN * k / count for k in range(count))
    return ("holes_deg", listed) if listed is not None and _sound(section, listed) else ("", ())


def _sound(section: Section, degrees: Sequence[float]) -> bool:
    """Whether listed angles are within one turn, different and ascending; else a problem."""
    beyond = [angle for angle in degrees if abs(angle) > TURN]
    if beyond:
        section.complain("holes_deg", f"angles from -360 to 360 degrees, not {beyond[0]:g}: {_DEG}")
        return False
    if len(degrees) > MOST_HOLES:
        section.complain("holes_deg", f"at most {MOST_HOLES} holes, not {len(degrees)}", value=False)
        return False
    order = sorted(range(len(degrees)), key=lambda k: degrees[k] % TURN)
    for k, following in zip(order, [*order[1:], order[0]], strict=True):
        gap = (degrees[following] - degrees[k]) % TURN
        if following != k and min(gap, TURN - gap) < SAME_DEG:
            a, b = sorted((k, following))
            section.complain(
                "holes_deg",
                f"each hole once; numbers {a + 1} ({degrees[a]:g}) and {b + 1} ({degrees[b]:g}) are one",
            )
            return False
    for k in range(1, len(degrees)):
        if degrees[k] < degrees[k - 1]:
            section.complain(
                "holes_deg",
                f"angles in ascending order, because holes are numbered in the order of the list; number "
                f"{k + 1} ({degrees[k]:g}) follows {degrees[k - 1]:g} (a list may begin below zero: "
                "[-30, 0, 30]; hole_names gives holes other names)",
            )
            return False
    return True


def _names(section: Section, count: int) -> tuple[str, ...]:
    """Names of the holes: those of the job, or "1", "2", …; none with a problem."""
    value = section.take("hole_names")
    if value is None:
        return tuple(str(k + 1) for k in range(count))
    if isinstance(value, str):
        value = [part.strip() for part in value.split(";") if part.strip()]
    words = (
        [str(word).strip() for word in value if isinstance(word, (str, int)) and not isinstance(word, bool)]
        if isinstance(value, list)
        else []
    )
    if not words or not all(words) or len(words) < len(value) or len(set(words)) < len(words):
        section.complain("hole_names", 'a different name for each hole, such as ["A", "B", "C"]')
        return ()
    if count and len(words) != count:
        section.complain("hole_names", f"a name for each of the {count} holes, not {len(words)} names")
        return ()
    return tuple(words)


def _stock(section: Section, count: int) -> tuple[int, ...] | None:
    """How many there are of each available weight; None without it, and with a problem."""
    values = numbers(section, "stock", _STOCK)
    if values is None:
        return None
    wrong = [value for value in values if value < 0 or value != int(value)]
    if wrong:
        section.complain("stock", f"whole numbers of 0 or more, not {wrong[0]:g}: {_STOCK}")
    elif not any(values):
        section.complain("stock", f"at least one weight: {_STOCK}")
    elif count and len(values) != count:
        section.complain("stock", f"one number for each of the {count} available weights, not {len(values)}")
    elif not count and not any(key.startswith("available_") for key in section.keys):
        section.complain("stock", "the weights that are available too, available_g = [5, 10]")
    else:
        return tuple(int(value) for value in values)
    return None
