"""Bearings and seals of a rotor file: constants, or a table over speed, with or without a pedestal."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from fem import KINDS, Coefficient, Pair, Pedestal, Support
from rotorid.base.arrays import FloatArray
from rotorid.base.registry import find, names
from rotorid.base.text import listing
from rotorid.files import units
from rotorid.files.columns import Column, Table, read_table
from rotorid.files.problems import Problems
from rotorid.files.settings_keys import Key, Kind, take
from rotorid.files.toml_file import Section
from rotorid.files.units import one_of
from rotorid.files.value_kinds import TEXT, choice, number, plain_number

SCALARS = {"stiffness": "stiffness_N_per_m", "damping": "damping_N_s_per_m"}
ENTRIES = {
    "stiffness": {name: f"{name}_N_per_m" for name in ("kxx", "kxy", "kyx", "kyy")},
    "damping": {name: f"{name}_N_s_per_m" for name in ("cxx", "cxy", "cyx", "cyy")},
}
DIAGONAL = ("kxx", "kyy", "cxx", "cyy")
"""What pushes back, or brakes, in a bearing; the others may have either sign."""
OUTWARDS = "a finite number, 0 or more; what pushes outwards, or drives, is a [[seal]], not a [[bearing]]"
TILTING = "tilting_stiffness_N_m_per_rad"
PEDESTAL = ("pedestal_mass_kg", "pedestal_stiffness_N_per_m", "pedestal_damping_N_s_per_m")
NODE = Kind(
    lambda section, key: section.take(key), {"type": ["integer", "string"], "minimum": 1}, "a node or station"
)
NAME = Kind(lambda section, key: section.name(key), {"type": "string"}, "text", cell="name")


def _one_or_two(section: Section, key: str) -> Pair | None:
    """A number, or `[x, y]`."""
    value = section.take(key)
    if not isinstance(value, list):
        return section.number(key, low=0.0)
    good = [float(item) for item in value if plain_number(item) is not None and item >= 0]
    if len(value) != 2 or len(good) != 2:
        section.complain(key, "a finite number, 0 or more, or two of them: [x, y]")
        return None
    return good[0], good[1]


_NUMBER = {"type": "number", "minimum": 0}
_TWO = {"type": "array", "items": _NUMBER, "minItems": 2, "maxItems": 2}
PAIR = Kind(_one_or_two, {"anyOf": [_NUMBER, _TWO]}, "a number, or [x, y]")


def _coefficient_keys(quantity: str, motion: str) -> Iterator[Key]:
    of = units.STIFFNESS if quantity == "stiffness" else units.DAMPING
    yield Key(SCALARS[quantity], number(), f"{quantity}, the same in all directions", of, si=True)
    for short, full in ENTRIES[quantity].items():
        yield Key(short, number(), f"`{full}` in short")
        yield Key(full, number(), f"force in {short[1]} against a {motion} in {short[2]}", of, si=True)


_PLACE = (
    Key("node", NODE, "the node, a number from 1, or a station"),
    Key("name", NAME, "a name", default=""),
    Key(TILTING, number(0.0), "moment against a tilt of the shaft", default=0.0),
)
_STAND = (
    Key("kind", choice(names(KINDS)), "one of the kinds, where it is another one", default=KINDS[0].name),
    Key(PEDESTAL[0], number(0.0), "mass of what it stands on", units.MASS, 0.0, si=True),
    Key(PEDESTAL[1], PAIR, "its stiffness; one number, or two for x and y", units.STIFFNESS, 0.0, si=True),
    Key(PEDESTAL[2], PAIR, "its damping; one number, or two for x and y", units.DAMPING, 0.0, si=True),
)
_COEFFICIENTS = (
    *_coefficient_keys("stiffness", "displacement"),
    *_coefficient_keys("damping", "velocity"),
    Key("table", TEXT, "a table of these coefficients over speed"),
)
KEYS_OF = {kind.name: (*_PLACE, *(_STAND if kind is KINDS[0] else ()), *_COEFFICIENTS) for kind in KINDS}
"""Of a `[[bearing]]` and the others of `KINDS`."""
_SETTLED = {key.name for key in (*_PLACE, *_STAND)}
_STIFFNESS, _DAMPING = one_of(units.STIFFNESS), one_of(units.DAMPING)
COLUMNS = (
    Column("speed", one_of(units.SPEED), ("speed_rpm", "speed_rad_s", "speed_Hz")),
    Column("stiffness", _STIFFNESS, ("stiffness_N_per_m",), required=False),
    Column("damping", _DAMPING, ("damping_N_s_per_m",), required=False),
    *(Column(n, _STIFFNESS, (full,), required=False) for n, full in ENTRIES["stiffness"].items()),
    *(Column(n, _DAMPING, (full,), required=False) for n, full in ENTRIES["damping"].items()),
)


@dataclass(frozen=True)
class _Coefficients:
    """What a section and its table say, `{name: number or values over speed}`, and how to complain."""

    values: Mapping[str, float | FloatArray]
    complain: Mapping[str, Callable[[str], None]]
    missing: Callable[[str, str], None]
    speeds: tuple[float, ...] = ()


def read_support(
    section: Section, node: Callable[[Section], int | None], folder: Path, kind: str, problems: Problems
) -> Support | None:
    """Read `[[bearing]]`, `[[seal]]` or another of `KINDS`, or None and problems.

    Parameters
    ----------
    section
        Its settings.
    node
        Reads its node.
    folder
        Where the rotor file lies, which names its tables from there.
    kind
        Which of them; `[[bearing]]` may also say `kind = "seal"`.
    problems
        Collects the complaints.
    """
    before = len(problems)
    said = take(section, KEYS_OF[kind])
    where = node(section)
    kind = said.get("kind", kind)
    pedestal = _pedestal(section, said)
    settled = len(problems)
    coefficients = _coefficients(section, said, folder, kind, problems)
    if coefficients is None or len(problems) > settled or section.refused - _SETTLED:
        return None  # what is missing may be what is misspelt
    stiffness = _quantity("stiffness", coefficients)
    damping = _quantity("damping", coefficients)
    if stiffness is None:
        if len(problems) == settled and damping is None:
            coefficients.missing(SCALARS["stiffness"], f"the stiffness of the {kind}, or its damping")
            return None
        stiffness = 0.0  # a damper
    if where is None or len(problems) > before:
        return None
    try:
        return Support(
            where,
            stiffness,
            0.0 if damping is None else damping,
            said["name"],
            speeds=coefficients.speeds,
            pedestal=None if pedestal is None else Pedestal(*pedestal),
            kind=kind,
            tilting_stiffness=said[TILTING],
        )
    except ValueError as error:
        section.refuse(f"a possible {kind}: {error}")
        return None


def bearing_tables(data: Mapping[str, object]) -> list[str]:
    """Names of the tables that the bearings and seals of a rotor file refer to."""
    named = []
    for kind in names(KINDS):
        items = data.get(kind)
        for item in items if isinstance(items, list) else []:
            table = item.get("table") if isinstance(item, dict) else None
            if isinstance(table, str) and table.strip():
                named.append(table.strip())
    return list(dict.fromkeys(named))


def _coefficients(
    section: Section, said: Mapping[str, Any], folder: Path, kind: str, problems: Problems
) -> _Coefficients | None:
    values: dict[str, float | FloatArray] = {}
    complain: dict[str, Callable[[str], None]] = {}
    low = find(KINDS, kind, "kind").function
    for quantity, scalar in SCALARS.items():
        _note(section, said, quantity, (scalar,), low, values, complain)
        for name, full in ENTRIES[quantity].items():
            lowest = low if name in DIAGONAL else -math.inf
            _note(section, said, name, (full, name), lowest, values, complain)
    file = said["table"]
    if file is None:
        return None if "table" in section else _Coefficients(values, complain, section.missing)
    table = read_table(folder / file, kind, COLUMNS, problems, first=True)
    if table is None:
        return None
    speed = table.numbers("speed")
    table.must_be("speed", speed >= 0, "a speed of 0 or more")
    rising = np.insert(~(np.diff(speed) <= 0), 0, True)
    table.must_be("speed", rising, "a speed above that of the row before (ascending, each once)")
    present = [column.stem for column in COLUMNS[1:] if column.stem in table]
    if not present:
        expected = f"a column of coefficients, such as {listing(c.names[0] for c in COLUMNS[1:4])}"
        table.in_header(COLUMNS[1].names[0], expected)
        return None
    for name in (*SCALARS, *DIAGONAL):
        table.must_be(name, table.numbers(name) >= low, OUTWARDS)
    if len(table) == 1:
        table.complain(0, "speed", "two speeds at least: a table says how coefficients change")
    for name in present:
        if name in values:
            complain[name](f"nothing: {table.source} has a column {table.fields[name].name}")
        values[name] = table.numbers(name)
        complain[name] = _in_header(table, name)
    return _Coefficients(values, complain, table.in_header, tuple(table.numbers("speed").tolist()))


def _note(
    section: Section,
    said: Mapping[str, Any],
    name: str,
    keys: tuple[str, ...],
    low: float,
    values: dict[str, float | FloatArray],
    complain: dict[str, Callable[[str], None]],
) -> None:
    """One constant; `kxx` alone is `kxx_N_per_m`."""
    for key in keys:
        value = said[key]
        if value is not None and value < low:
            section.complain(key, OUTWARDS)
        if value is None:
            continue
        if name in values:
            section.complain(key, f"the coefficient once, {keys[0]}")
        values[name] = value
        complain[name] = lambda expected, key=key: section.complain(key, expected)  # type: ignore[misc]


def _in_header(table: Table, name: str) -> Callable[[str], None]:
    column = table.fields[name].name
    return lambda expected: table.problems.add(table.source, table.header_row, column, column, expected)


def _quantity(quantity: str, given: _Coefficients) -> Coefficient | tuple[Coefficient, ...] | None:
    """Stiffness or damping as `Support` takes it; None if nothing is given."""
    entries = ENTRIES[quantity]
    used = [name for name in entries if name in given.values]
    if quantity in given.values:
        for name in used[:1]:
            given.complain[name](
                f"either {SCALARS[quantity]} or {listing(entries.values(), 'and')}, not some of both"
            )
        return _over_speed(given, lambda at: at(quantity))
    if not used:
        return None
    first, *_, last = entries
    diagonal = [name for name in (first, last) if name in used]
    if len(diagonal) == 1:  # none is cross-coupling alone
        (name,) = {first, last} - {*diagonal}
        given.missing(entries[name], f"{name} too, as {diagonal[0]} is given")
        return None
    xx, xy, yx, yy = entries
    return _over_speed(given, lambda at: ((at(xx), at(xy)), (at(yx), at(yy))))


def _over_speed(
    given: _Coefficients, make: Callable[[Callable[[str], float]], Coefficient]
) -> Coefficient | tuple[Coefficient, ...]:
    """Build an entry from the coefficients' names: one, or one per speed of the table."""

    def build(index: int) -> Coefficient:
        def at(name: str) -> float:
            value = given.values.get(name, 0.0)
            return value if isinstance(value, float) else float(value[index])

        return make(at)

    return tuple(build(k) for k in range(len(given.speeds))) if given.speeds else build(0)


def _pedestal(section: Section, said: Mapping[str, Any]) -> tuple[float, Pair, Pair] | None:
    if not any(key in said and key in section for key in PEDESTAL):
        return None
    if PEDESTAL[1] not in section:
        section.missing(PEDESTAL[1], "the stiffness of the pedestal")
    mass, stiffness, damping = (said[key] for key in PEDESTAL)
    return mass, stiffness, damping
