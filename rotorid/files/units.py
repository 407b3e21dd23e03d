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
_POUND, _POUND_FORCE = 0.45359237, 4.4482216152605


def _table(kind: str, **factors: tuple[float, float]) -> dict[str, Unit]:
    return {name: Unit(name, kind, up, down) for name, (up, down) in factors.items()}


LENGTH = _table(
    "length", m=(1.0, 1.0), mm=(1.0, 1e3), um=(1.0, 1e6), mil=(254.0, 1e7), **{"in": (254.0, 1e4)}
)
MASS = _table("mass", kg=(1.0, 1.0), g=(1.0, 1e3), mg=(1.0, 1e6), oz=(_POUND, 16.0), lb=(_POUND, 1.0))
UNBALANCE = {
    f"{name}_{radius}": Unit(
        f"{name}_{radius}",
        "unbalance",
        mass.multiply * LENGTH[radius].multiply,
        mass.divide * LENGTH[radius].divide,
    )
    for name, mass in MASS.items()
    for radius in ("m", "mm", "in")
}
WEIGHT = MASS | UNBALANCE
SPEED = _table("speed", rpm=(2.0 * pi, 60.0), rad_s=(1.0, 1.0), Hz=(2.0 * pi, 1.0))
ANGLE = _table("angle", deg=(pi, 180.0), rad=(1.0, 1.0))
INERTIA = _table("inertia", kg_m2=(1.0, 1.0), lb_in2=(_POUND * 254.0**2, 1e8))
STIFFNESS = _table(
    "stiffness",
    N_per_m=(1.0, 1.0),
    N_per_mm=(1e3, 1.0),
    N_per_um=(1e6, 1.0),
    lbf_per_in=(_POUND_FORCE * 1e4, 254.0),
)
DAMPING = _table(
    "damping", N_s_per_m=(1.0, 1.0), N_s_per_mm=(1e3, 1.0), lbf_s_per_in=(_POUND_FORCE * 1e4, 254.0)
)
MODULUS = _table("modulus", Pa=(1.0, 1.0), MPa=(1e6, 1.0), GPa=(1e9, 1.0), psi=(_POUND_FORCE * 1e8, 254.0**2))
DENSITY = _table("density", kg_per_m3=(1.0, 1.0), g_per_cm3=(1e3, 1.0), lb_per_in3=(_POUND * 1e12, 254.0**3))
FORCE = _table("force", N=(1.0, 1.0), kN=(1e3, 1.0), lbf=(_POUND_FORCE, 1.0))
TIME = _table("time", s=(1.0, 1.0), ms=(1.0, 1e3), us=(1.0, 1e6), min=(60.0, 1.0))
VELOCITY = _table("velocity", m_s=(1.0, 1.0), mm_s=(1.0, 1e3), in_s=(254.0, 1e4))
VISCOSITY = _table("viscosity", Pa_s=(1.0, 1.0), mPa_s=(1.0, 1e3), cP=(1.0, 1e3))
CUBIC_STIFFNESS = _table(
    "cubic stiffness",
    N_per_m3=(1.0, 1.0),
    N_per_mm3=(1e9, 1.0),
    lbf_per_in3=(_POUND_FORCE * 1e12, 254.0**3),
)
_PEAK = {
    **LENGTH,
    **VELOCITY,
    **_table("acceleration", g=(STANDARD_GRAVITY, 1.0), m_s2=(1.0, 1.0), mm_s2=(1.0, 1e3)),
}
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


def weight(name: str) -> Unit:
    """The unit of a weight: a mass or a mass × radius.

    Raises
    ------
    UnitError
        For any other name.
    """
    unit = WEIGHT.get(spelt(name))
    if unit is None:
        raise UnitError(f"a unit of weight: {listing(WEIGHT)}, not {name!r}{did_you_mean(name, WEIGHT)}")
    return unit


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
    if name in VIBRATION:
        return VIBRATION[name]
    for unit in VIBRATION:
        if name.casefold() == unit.casefold():
            raise UnitError(f"the unit written {unit}, not {name}")
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
