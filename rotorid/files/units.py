"""Units (mm, mil, g, oz, rpm …): the last part of a column's name, and how its numbers become SI."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from math import pi, sqrt
from typing import Any

from rotorid.base.choices import did_you_mean
from rotorid.base.text import listing

STANDARD_GRAVITY = 9.80665


@dataclass(frozen=True)
class Unit:
    """One unit: SI = value × multiply / divide (two numbers, so that 318 mm are exactly 0.318 m).

    Attributes
    ----------
    name
        As in a column's name ("um_pp").
    kind
        The quantity ("length"); units of one kind may be converted into each other.
    multiply, divide
        See above; for vibrations SI means a peak amplitude.
    """

    name: str
    kind: str
    multiply: float = 1.0
    divide: float = 1.0

    @property
    def scale(self) -> float:
        """Shown = SI × scale."""
        return self.divide / self.multiply

    def to_si(self, value: float) -> float:
        """A number written in this unit, in SI."""
        return value * self.multiply / self.divide


@dataclass(frozen=True)
class Quantity:
    """A number (or several) with the key or option that holds it and its unit."""

    key: str
    value: Any
    unit: Unit

    @property
    def si(self) -> float:
        """In SI."""
        return self.unit.to_si(self.value)


class UnitError(ValueError):
    """A unit that cannot be used; the message says what was expected."""


UnitReader = Callable[[str], Unit]

_SPELLING = str.maketrans(
    {"\N{MICRO SIGN}": "u", "\N{GREEK SMALL LETTER MU}": "u", "/": "_", "·": "_", "*": "_"}
)
_FACTORS = {
    **dict.fromkeys(("m", "kg", "s", "N", "Pa", "rad"), (1.0, 1.0)),
    **dict.fromkeys(("mm", "g", "ms", "mPa", "cP"), (1.0, 1e3)),
    **dict.fromkeys(("um", "mg", "us"), (1.0, 1e6)),
    "cm": (1.0, 100.0),
    "kN": (1e3, 1.0),
    "mil": (254.0, 1e7),
    "in": (254.0, 1e4),
    "oz": (0.45359237, 16.0),
    "lb": (0.45359237, 1.0),
    "lbf": (4.4482216152605, 1.0),
    "psi": (4.4482216152605 * 1e8, 254.0**2),
    "MPa": (1e6, 1.0),
    "GPa": (1e9, 1.0),
    "min": (60.0, 1.0),
    "rpm": (2.0 * pi, 60.0),
    "Hz": (2.0 * pi, 1.0),
    "deg": (pi, 180.0),
}
"""SI = value × first / second."""


def _units(kind: str, names: str) -> dict[str, Unit]:
    """Units of one kind; a name may be a product of others, behind `_per_` a quotient: `lbf_s_per_in`."""
    units = {}
    for name in names.split():
        size = [1.0, 1.0]
        for side, parts in enumerate(name.split("_per_")):
            for part in parts.split("_"):
                base = part if part in _FACTORS else part[:-1]
                for k, factor in enumerate(_FACTORS[base]):
                    size[k ^ side] *= factor ** int(part.removeprefix(base) or 1)
        units[name] = Unit(name, kind, *size)
    return units


LENGTH = _units("length", "m mm um mil in")
MASS = _units("mass", "kg g mg oz lb")
UNBALANCE = _units("unbalance", " ".join(f"{mass}_{radius}" for mass in MASS for radius in ("m", "mm", "in")))
WEIGHT = MASS | UNBALANCE
SPEED = _units("speed", "rpm rad_s Hz")
ANGLE = _units("angle", "deg rad")
INERTIA = _units("inertia", "kg_m2 lb_in2")
STIFFNESS = _units("stiffness", "N_per_m N_per_mm N_per_um lbf_per_in")
DAMPING = _units("damping", "N_s_per_m N_s_per_mm lbf_s_per_in")
MODULUS = _units("modulus", "Pa MPa GPa psi")
DENSITY = _units("density", "kg_per_m3 g_per_cm3 lb_per_in3")
FORCE = _units("force", "N kN lbf")
COMPLIANCE = _units("compliance", "m_per_N mm_per_N um_per_N")
TIME = _units("time", "s ms us min")
VELOCITY = _units("velocity", "m_s mm_s in_s")
VISCOSITY = _units("viscosity", "Pa_s mPa_s cP")
CUBIC_STIFFNESS = _units("cubic stiffness", "N_per_m3 N_per_mm3 lbf_per_in3")
_G = Unit("g", "acceleration", STANDARD_GRAVITY)
_PEAK = LENGTH | VELOCITY | {"g": _G} | _units("acceleration", "m_s2 mm_s2")
VIBRATION = {
    name + suffix: Unit(name + suffix, unit.kind, unit.multiply * up, unit.divide * down)
    for name, unit in _PEAK.items()
    for suffix, up, down in (("", 1.0, 1.0), ("_pp", 1.0, 2.0), ("_rms", sqrt(2.0), 1.0))
}


def one_of(units: dict[str, Unit]) -> UnitReader:
    """A reader that accepts exactly these units.

    Returns
    -------
    Callable[[str], Unit]
        Raises `UnitError` for any other name.
    """

    def read(name: str) -> Unit:
        unit = units.get(spelt(name))
        if unit is None:
            other = f"not {name!r}" if name else "which is missing"
            raise UnitError(f"one of the units {listing(units)}, {other}{did_you_mean(name, units)}")
        return unit

    return read


weight = one_of(WEIGHT)
"""The unit of a weight: a mass or a mass × radius."""


def ratio(name: str) -> Unit:
    """The unit of a plain number, which has none.

    Raises
    ------
    UnitError
        For any name at all.
    """
    if name:
        raise UnitError(f"a column without a unit, not {name!r}")
    return Unit("", "ratio")


def vibration(name: str) -> Unit:
    """The unit of a vibration: a known one, or any label at all, which is then only printed.

    Raises
    ------
    UnitError
        Where a known unit was meant but is misspelt (`MM`, `um_pk`): as a label it would lose its meaning.
    """
    name = spelt(name)
    if unit := (VIBRATION | UNBALANCE).get(name):  # the latter: readings of a calibrated balancing machine
        return unit
    for other in VIBRATION:
        if name.casefold() == other.casefold():
            raise UnitError(f"the unit written {other}, not {name}")
    base = max((unit for unit in _PEAK if name.startswith(f"{unit}_")), key=len, default=None)
    if base is not None:
        raise UnitError(
            f"{base} (peak), {base}_pp (peak to peak) or {base}_rms, not {name}; known vibration units are "
            f"{listing(_PEAK)}"
        )
    return Unit(name, f"label {name!r}")


def spelt(name: str) -> str:
    """A unit's name as this project spells it: `µm` is `um`, `mm/s` is `mm_s`, `lbs` is `lb`."""
    spelling = name.translate(_SPELLING)
    return "lb" if spelling == "lbs" else spelling


def in_job_units(weight: Quantity, unit: str, radius: float | None) -> tuple[float, ...] | None:
    """A mass or unbalance, or several, in kg or kg·m, as weights in a unit are.

    Returns
    -------
    None where masses and unbalances convert only with a radius, m, and there is none.
    """
    values = weight.value if isinstance(weight.value, tuple) else (weight.value,)
    sizes = tuple(map(weight.unit.to_si, values))
    wanted = WEIGHT[unit].kind
    if weight.unit.kind == wanted:
        return sizes
    if radius is None:
        return None
    return tuple(size * radius if wanted == "unbalance" else size / radius for size in sizes)
