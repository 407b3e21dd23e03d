"""Permissible residual unbalance by the balance quality grades of ISO 21940-11, and its share per plane.

The standard (before: ISO 1940-1) limits the velocity e·ω of the centre of mass of a rigid rotor. With the
grade G in mm/s, the mass m in kg and the service speed ω in rad/s

    e_per = G/ω         (m with G in m/s; 1000 G/ω in µm, or g·mm per kg),
    U_per = m e_per     (kg·m; 1000 G m/ω in g·mm).

How it is shared by two planes:

**Tolerance planes** (the clauses on allocation to tolerance planes) are the bearing planes, at a and b, with
the centre of mass at c. An unbalance U_per at c loads them like the static weight, by the levers

    s_A = |b − c| / |b − a|,     s_B = |c − a| / |b − a|,

and U_A = s_A U_per, U_B = s_B U_per within limits: between the bearings 0.3 … 0.7 (public descriptions of the
standard state the lever rule and these), with the centre of mass outside (overhung) 0.3 … 1.3 (the standard's
clause on outboard rotors; no public text was at hand to compare, so look into your copy). A disc that needs
one plane only has the whole U_per there.

**Correction planes** (the clauses on allocation to correction planes). An unbalance u_k at z_k is equivalent
for a rigid rotor to T_Ak u_k and T_Bk u_k at the bearings,

    T_Ak = (b − z_k)/(b − a),    T_Bk = (z_k − a)/(b − a),

with signs: one of them is negative for a plane outside the bearings. The angles of the residuals are not
known beforehand, so amounts are safe if they keep the tolerances even in the worst case,

    |T_A1| u_1 + |T_A2| u_2 ≤ U_A,    |T_B1| u_1 + |T_B2| u_2 ≤ U_B.

The standard leaves open which of these pairs to take. Here it is the one with the largest product u_1 u_2:
it uses both tolerances fully where that leaves something for both planes, gives U_A and U_B to planes at the
bearings, and gives neither plane nothing. Residuals that exceed it may still be good: what counts is what
they are together at the bearings (`Tolerance.transfer`).
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np

from rotorid.base.answer import Answer, Answered
from rotorid.base.arrays import FloatArray
from rotorid.base.tables import Column, frame, records, text
from rotorid.base.text import figures, rpm, rpm_text

if TYPE_CHECKING:
    import pandas as pd


GRADES = (0.4, 1.0, 2.5, 6.3, 16.0, 40.0, 100.0, 250.0, 630.0, 1600.0, 4000.0)
"""Balance quality grades of the standard, mm/s."""

INBOARD = (0.3, 0.7)
"""Least and largest share of U_per at a bearing, centre of mass between the bearings."""
OUTBOARD = (0.3, 1.3)
"""The same, centre of mass outside the bearings."""
_GRAM_MM = 1e6


@dataclass(frozen=True, eq=False)
class Tolerance(Answered):
    """Permissible residual unbalance of a rotor, and where it may be.

    Attributes
    ----------
    grade
        mm/s.
    mass, speed
        kg and rad/s.
    planes
        Names of the correction planes, length P (0, 1 or 2).
    positions
        Along the shaft, m, shape (P,); NaN where no distances are known.
    bearings
        Positions of the tolerance planes, m, shape (2,); empty where nothing is allocated to them.
    centre
        Position of the centre of mass, m; None as before.
    bearing_limits
        U_A and U_B, kg·m, shape (2,); empty as before.
    limits
        Of each correction plane, kg·m, shape (P,).
    rule
        How it was allocated, in words.
    warnings
        What the user should know.
    """

    grade: float
    mass: float
    speed: float
    planes: tuple[str, ...]
    positions: FloatArray
    bearings: FloatArray
    centre: float | None
    bearing_limits: FloatArray
    limits: FloatArray
    rule: str
    warnings: tuple[str, ...] = ()

    @property
    def eccentricity(self) -> float:
        """Permissible specific unbalance e_per, m."""
        return self.grade * 1e-3 / self.speed

    @property
    def total(self) -> float:
        """U_per, kg·m."""
        return self.mass * self.eccentricity

    @property
    def transfer(self) -> FloatArray | None:
        """T (2, P): unbalance at the bearings per unbalance in the planes; None without distances."""
        placed = len(self.bearings) > 0 and np.isfinite(self.positions).all()
        return transfer(self.positions, self.bearings) if placed else None

    def to_dict(self) -> dict[str, Any]:
        """As JSON types: kg·m, m, rad/s, and g·mm, µm where people read these."""
        ends = records(_limit_columns(self.bearings, self.bearing_limits))
        planes = _limit_columns(self.positions, self.limits)
        return {
            "grade": f"G{self.grade:g}",
            "mass_kg": self.mass,
            "speed_rad_s": self.speed,
            "speed_rpm": rpm(self.speed),
            "permissible_kg_m": self.total,
            "permissible_g_mm": self.total * _GRAM_MM,
            "specific_um": self.eccentricity * 1e6,
            "centre_of_mass_m": self.centre,
            "bearings": ends or None,
            "planes": records((Column("plane", self.planes), *planes)),
            "rule": self.rule,
            "warnings": list(self.warnings),
        }

    def to_frame(self) -> pd.DataFrame:
        """One row for the rotor, each bearing and each plane: place, position_mm, limit_g_mm."""
        return frame(self._columns())

    def _columns(self) -> tuple[Column, ...]:
        names = ("bearing A", "bearing B")[: len(self.bearings)]
        at = np.concatenate(([np.nan], self.bearings, self.positions))
        limits = np.concatenate(([self.total], self.bearing_limits, self.limits)) * _GRAM_MM
        places = ("whole rotor", *names, *(f"plane {name}" for name in self.planes))
        return (
            Column("place", places, title=""),
            Column("position_mm", at * 1e3, "at {:.6g} mm".format, title=""),
            Column("limit_g_mm", limits, figures, title="g·mm"),
        )

    @property
    def answer(self) -> Answer:
        """The permissible unbalance, and the share of each bearing and plane."""
        return Answer(
            f"G{self.grade:g} for {self.mass:.6g} kg at {rpm_text(self.speed)}: permissible residual "
            f"unbalance {figures(self.total * _GRAM_MM)} g·mm ({self.eccentricity * 1e6:.3g} g·mm/kg).",
            f"{text(self._columns())}\n\n{self.rule}",
            self.warnings,
        )


def _limit_columns(positions: FloatArray, limits: FloatArray) -> tuple[Column, ...]:
    return (
        Column("position_m", positions),
        Column("limit_kg_m", limits),
        Column("limit_g_mm", limits * _GRAM_MM),
    )


def tolerance(
    mass: float,
    speed: float,
    grade: float,
    *,
    planes: Mapping[str, float | None] | None = None,
    bearings: tuple[float, float] | None = None,
    centre: float | None = None,
) -> Tolerance:
    """Permissible residual unbalance, allocated to one or two planes.

    Parameters
    ----------
    mass
        Of the rotor, kg.
    speed
        Highest service speed, rad/s.
    grade
        mm/s, one of `GRADES`: 2.5 for G2.5.
    planes
        Position, m, of each correction plane (one or two), from any origin; None: without positions. Without
        any position two planes have half each (a symmetric rotor), one plane has all.
    bearings
        Positions of both bearings, m. Without them the two correction planes are the tolerance planes (a
        component without a shaft).
    centre
        Position of the centre of mass, m; needed with positions.

    Returns
    -------
    Tolerance

    Raises
    ------
    ValueError
        For a mass or speed that is not positive, a grade that does not exist, and positions that are missing,
        equal or too many.

    Examples
    --------
    >>> from math import pi
    >>> found = tolerance(500, 100 * pi, 2.5)
    >>> f"{found.total * 1e6:.0f} g·mm, {found.eccentricity * 1e6:.2f} µm"
    '3979 g·mm, 7.96 µm'
    """
    named = dict(planes or {})
    given = np.array([*named.values()], dtype=np.float64)  # None becomes NaN
    positions = given[np.isfinite(given)]
    placed, two = len(positions) == len(named) > 0, len(positions) == 2
    ends = np.array(positions if bearings is None and two else bearings or (), dtype=np.float64)
    for right, words in (
        (0 < mass < math.inf, f"the mass of the rotor must be a finite number above 0, not {mass:g}"),
        (0 < speed < math.inf, f"the service speed must be a finite number above 0, not {speed:g}"),
        (
            len(named) < 3,
            f"the tolerance of a rigid rotor is shared by one or two planes, not {len(named)}: choose two",
        ),
        (placed or not len(positions), "give the position of both planes, or of none"),
        (len(set(bearings or "ab")) == 2, "both bearings are at the same place: give two positions"),
        (
            not two or positions[0] != positions[1],
            "both planes are at the same place: give two different positions, or one plane",
        ),
        (
            placed or bearings is None or len(named) < 2,
            "with the positions of the bearings, give those of the planes, too",
        ),
        (
            (centre is None) == (not len(ends)),
            "the share of each plane needs the position of the centre of mass, and that the positions of the "
            "bearings or of two planes: give both, or neither",
        ),
    ):
        if not right:
            raise ValueError(words)
    if grade not in GRADES:
        raise ValueError(f"there is no balance quality grade {grade}: the grades, mm/s, are {GRADES}")
    total = mass * grade * 1e-3 / speed
    at, rule = np.zeros(0), ""
    warnings: tuple[str, ...] = ()
    if centre is not None:
        at, rule, warnings = _bearing_limits(total, ends, centre)
    if len(named) < 2:
        limits = np.full(len(named), total)
        rule += "One plane (a disc) has the whole of it." if named else ""
    elif not two:
        limits, rule = np.full(2, total / 2), "Half in each plane, as for a symmetric rotor."
    elif bearings is None:
        limits, rule = at, rule + "The correction planes are the tolerance planes."
    else:
        limits = _safe_pair(np.abs(transfer(positions, ends)), at)
        rule += "In the planes: safe at the bearings whatever the angles of the residuals are."
    return Tolerance(
        grade=float(grade),
        mass=float(mass),
        speed=float(speed),
        planes=tuple(named),
        positions=given,
        bearings=ends,
        centre=centre,
        bearing_limits=at,
        limits=limits,
        rule=rule.strip() or "Nothing is allocated to planes.",
        warnings=warnings,
    )


def _bearing_limits(total: float, ends: FloatArray, centre: float) -> tuple[FloatArray, str, tuple[str, ...]]:
    """U_A and U_B (2,), kg·m, by the levers of the centre of mass; the rule in words; warnings."""
    share = np.abs((ends[::-1] - centre) / (ends[1] - ends[0]))
    inboard = ends.min() <= centre <= ends.max()
    low, high = INBOARD if inboard else OUTBOARD
    kept = np.clip(share, low, high)
    rule = (
        f"Tolerance planes by the levers of the centre of mass ({'between' if inboard else 'outside'} them): "
        f"shares {kept[0]:.3g} and {kept[1]:.3g}. "
    )
    words = (
        f"by the levers the tolerance planes had {share[0]:.3g} and {share[1]:.3g} of the permissible "
        f"unbalance; the limits {low:g} … {high:g} make it {kept[0]:.3g} and {kept[1]:.3g}"
    )
    return kept * total, rule, (words,) if (np.abs(kept - share) > 1e-12).any() else ()


def transfer(positions: FloatArray, ends: FloatArray) -> FloatArray:
    """T (2, P): unbalance at the tolerance planes per unbalance at these positions (P,), m."""
    a, b = ends
    return np.asarray(np.array([b - positions, positions - a]) / (b - a))


def _safe_pair(T: FloatArray, limits: FloatArray) -> FloatArray:
    """The pair u ≥ 0 of largest product with T u ≤ limits, T (2, 2) ≥ 0 without a zero column.

    log u₁ + log u₂ is concave: at the optimum either one constraint holds alone, where each plane uses half
    of it, u_k = limit / (2 T_k), or both hold, at their intersection.
    """
    for k in (0, 1):
        u = limits[k] / (2 * np.maximum(T[k], 1e-300))
        if T[1 - k] @ u <= limits[1 - k] * (1 + 1e-12):
            return np.asarray(u)
    return np.asarray(np.linalg.solve(T, limits))
