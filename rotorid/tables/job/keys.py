"""What a job says about its planes and sensors, section by section; nothing is converted to the job yet."""

from __future__ import annotations

import math
import re
from collections.abc import Iterable
from dataclasses import dataclass, field
from typing import NamedTuple

from rotorid.tables.job.job_holes import HOLE_COLUMNS, HoleKeys, read_holes
from rotorid.tables.job.quantity import Quantity, measured, number
from rotorid.tables.reader import units
from rotorid.tables.reader.toml_file import Section

RADIUS = {name: units.LENGTH[name] for name in ("mm", "m", "in")}
PLANES_USUAL = (
    "max_mass_g",
    "max_unbalance_g_mm",
    "radius_mm",
    "trial_radius_mm",
    "forbidden_deg",
    "holes",
    "first_hole_deg",
    "holes_deg",
    "available_g",
    "remove",
    "node",
    "station",
    "use",
)
SENSORS_USUAL = ("limit", "weight", "node", "station", "angle_deg")


class Columns(NamedTuple):
    """Columns of a sheet: those that a message lists, and all others."""

    usual: tuple[str, ...]
    more: frozenset[str]


COLUMNS = {
    "planes": Columns(
        PLANES_USUAL,
        frozenset(
            (
                *(f"max_mass_{unit}" for unit in units.MASS),
                *(f"max_unbalance_{unit}" for unit in units.UNBALANCE),
                *(f"radius_{unit}" for unit in RADIUS),
                *(f"trial_radius_{unit}" for unit in RADIUS),
                *HOLE_COLUMNS,
            )
        ),
    ),
    "sensors": Columns(SENSORS_USUAL, frozenset()),
}
"""Of the sheets planes and sensors of a workbook, besides the name."""

Pair = tuple[float, float]
_NUMBER = r"([+-]?[0-9]+(?:[.,][0-9]+)?)"
_PAIR = re.compile(rf"{_NUMBER}\s*(?:-|\N{{EN DASH}}|\.\.|:|to)\s*{_NUMBER}")
_PAIRS = "pairs [from, to] of different angles from -360 to 360 degrees, such as [[20, 60], [300, 340]]"
_PAIRS_TEXT = f"{_PAIRS}, in a sheet 20-60; 300-340"


@dataclass(frozen=True)
class PlaneKeys:
    """One section [planes.NAME]; `forbidden` in the job's degrees, `place` a node or a station."""

    section: Section
    max_weight: Quantity | None = None
    radius: float | None = None
    forbidden: tuple[Pair, ...] = ()
    place: int | str | None = None
    use: bool = True
    holes: HoleKeys | None = None
    remove: bool = False
    trial_radius: Quantity | None = None


@dataclass(frozen=True)
class SensorKeys:
    """One section [sensors.NAME]; limits by speed have the speed's text as key, "" stands for all speeds."""

    section: Section
    limits: dict[str, float] = field(default_factory=dict)
    weight: float = 1.0
    place: int | str | None = None
    angle_deg: float | None = None


def read_plane(section: Section) -> PlaneKeys:
    """Take all keys of a plane; problems are noted with the section."""
    limit = measured(section, ("max_mass", units.MASS, "g"), ("max_unbalance", units.UNBALANCE, "g_mm"))
    radius = measured(section, ("radius", RADIUS, "mm"))
    trial_radius = measured(section, ("trial_radius", RADIUS, "mm"))
    use = "use" not in section or section.flag("use")
    remove = section.flag("remove")
    forbidden = _forbidden(section)
    place = _place(section)
    holes = read_holes(section)
    section.finish()
    return PlaneKeys(
        section,
        limit,
        None if radius is None else radius.si,
        forbidden,
        place,
        use,
        holes,
        remove,
        trial_radius,
    )


def read_sensor(section: Section) -> SensorKeys:
    """Take all keys of a sensor; problems are noted with the section."""
    limits = by_speed(section, "limit", "an amplitude above 0 in the unit of the readings", above_zero=True)
    weight = section.number("weight", 1.0, low=0.0)
    angle = section.number("angle_deg", low=-360.0, high=360.0)
    place = _place(section)
    section.finish()
    return SensorKeys(section, limits, 1.0 if weight is None else weight, place, angle)


def by_speed(section: Section, key: str, what: str, *, above_zero: bool) -> dict[str, float]:
    """A number for all speeds (under the key ""), or a table, or a text, of numbers by speed.

    Parameters
    ----------
    section, key
        Where it stands.
    what
        What each number is, for messages.
    above_zero
        Whether zero is wrong.
    """
    value = section.take(key)
    example = f'{what}, or a table of them by speed, such as {{ "3000" = 20, "4500" = 30 }}'
    if value is None:
        return {}
    if isinstance(value, str):
        parts = [part.partition(":") for part in value.split(";") if part.strip()]
        if not parts or not all(separator for _, separator, _ in parts):
            section.complain(key, f'{example}, in a sheet "3000: 20; 4500: 30"')
            return {}
        value = {speed.strip(): number.strip() for speed, _, number in parts}
        if len(value) < len(parts):
            section.complain(key, "each speed once")
            return {}
    if not isinstance(value, dict):
        single = _plain(value, above_zero=above_zero)
        if single is None:
            section.complain(key, example)
            return {}
        return {"": single}
    numbers: dict[str, float] = {}
    for speed, entry in value.items():
        size = _plain(entry, above_zero=above_zero)
        if _plain(speed, above_zero=True) is None:
            section.complain(key, f"speeds above 0, not {speed!r}: {example}")
        elif size is None:
            section.complain(key, f"{what}, not {entry!r} at speed {speed}")
        else:
            numbers[speed] = size
    if not value:
        section.complain(key, example)
    return numbers


def _plain(value: object, *, above_zero: bool) -> float | None:
    """A number ≥ 0 (or > 0) from a number or its text; else None."""
    read = number(value, comma=True)
    return None if read is None or read < 0 or (above_zero and read == 0) else read


def _place(section: Section) -> int | str | None:
    """`node` (a number) or `station` (a name) of the rotor model."""
    node, station = section.take("node"), section.take("station")
    if node is not None and station is not None:
        section.complain("station", "either node or station, not both")
        return None
    if node is not None:
        whole = isinstance(node, (int, float)) and not isinstance(node, bool)
        if not whole or not math.isfinite(node) or node != int(node) or node < 1:
            section.complain("node", "a node of the rotor model, a whole number from 1 (or station, a name)")
            return None
        return int(node)
    if station is not None and (not isinstance(station, str) or not station.strip()):
        section.complain("station", "the name of a station of the rotor model, in quotes")
        return None
    return station.strip() if isinstance(station, str) else None


def _forbidden(section: Section) -> tuple[Pair, ...]:
    value = section.take("forbidden_deg")
    if value is None:
        return ()
    pairs = _pairs(value)
    if pairs is None:
        section.complain("forbidden_deg", _PAIRS_TEXT)
        return ()
    if any((last - first) % 360.0 == 0.0 for first, last in pairs):
        section.complain("forbidden_deg", f"{_PAIRS} (use = false leaves a plane out)")
        return ()
    if covers_circle(pairs):
        section.complain("forbidden_deg", "arcs that leave some angle free; use = false leaves a plane out")
        return ()
    return pairs


def _pairs(value: object) -> tuple[Pair, ...] | None:
    if isinstance(value, str):
        matches = [_PAIR.fullmatch(part.strip()) for part in value.split(";") if part.strip()]
        value = [[float(m[1].replace(",", ".")), float(m[2].replace(",", "."))] for m in matches if m]
        if len(value) < len(matches):
            return None
    if not isinstance(value, list) or not value:
        return None
    if all(_is_angle(item) for item in value):
        value = [value]
    if not all(isinstance(pair, list) and len(pair) == 2 and all(map(_is_angle, pair)) for pair in value):
        return None
    return tuple((float(first), float(last)) for first, last in value)


def _is_angle(value: object) -> bool:
    return isinstance(value, (int, float)) and not isinstance(value, bool) and abs(value) <= 360.0


def covers_circle(pairs: Iterable[Pair]) -> bool:
    """Whether arcs (degrees, from → to) together leave no arc of the circle free."""
    pairs = list(pairs)
    edges = sorted({angle % 360.0 for pair in pairs for angle in pair})
    for edge, following in zip(edges, [*edges[1:], edges[0] + 360.0], strict=True):
        middle = (edge + following) / 2
        if not any((middle - first) % 360.0 < (last - first) % 360.0 for first, last in pairs):
            return False
    return True
