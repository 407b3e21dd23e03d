"""Undamped critical speed map: critical speeds over the stiffness of the supports."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace
from functools import partial
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import ArrayLike

from fem.critical import lowest_critical_speeds
from fem.model.rotor import Rotor, whole
from fem.model.supports import Support
from fem.solvers.bracketed_roots import bracketed_root
from rotorid.base.answer import Answer, Answered
from rotorid.base.arrays import FloatArray
from rotorid.base.json import plain
from rotorid.base.rpm import RPM
from rotorid.base.tables import Column, Table, frame, terminal

if TYPE_CHECKING:
    import pandas as pd

_Criticals = Callable[[float], FloatArray]  # critical speeds for a stiffness
_DECADES = 4  # of the default range, to both sides of the shaft's own stiffness


@dataclass(frozen=True)
class Intersection:
    """Where a critical speed meets the stiffness that a support really has.

    Attributes
    ----------
    support
        Its name, or "support 2".
    direction
        "x", "y", or "x and y" where they are equal.
    mode
        Number of the critical speed.
    speed
        rad/s.
    stiffness
        N/m.
    """

    support: str
    direction: str
    mode: int
    speed: float
    stiffness: float


@dataclass(frozen=True, eq=False)
class SpeedMap(Answered):
    """Critical speeds over support stiffness.

    Attributes
    ----------
    stiffness
        Of each support of the map, N/m, shape (K,).
    speeds
        Critical speeds, rad/s, shape (K, n); NaN where a mode has none (thin discs).
    free, pinned
        Their limits for vanishing and for infinite stiffness, rad/s, shape (n,).
    own
        What the supports really have: label, stiffness (N/m) and the speeds (rad/s) at which they have it.
    intersections
        Where these curves meet.
    rotor
        The rotor.
    """

    stiffness: FloatArray
    speeds: FloatArray
    free: FloatArray
    pinned: FloatArray
    own: tuple[tuple[str, FloatArray, FloatArray], ...]
    intersections: tuple[Intersection, ...]
    rotor: Rotor

    def to_dict(self) -> dict[str, Any]:
        """Plain data for JSON; one list of speeds per mode."""
        return plain(
            {
                "stiffness_N_per_m": self.stiffness,
                "critical_speeds_rad_s": self.speeds.T,
                "free_rad_s": self.free,
                "pinned_rad_s": self.pinned,
                "intersections": [
                    {
                        "support": item.support,
                        "direction": item.direction,
                        "mode": item.mode,
                        "speed_rad_s": item.speed,
                        "stiffness_N_per_m": item.stiffness,
                    }
                    for item in self.intersections
                ],
            }
        )

    def _tables(self) -> tuple[Table, ...]:
        """The map, a row for each stiffness; where the supports' own stiffness meets it; its limits."""
        met, rpm = self.intersections, "{:.2f}".format
        chart = (
            Column("stiffness_N_per_m", self.stiffness, "{:.4g}".format),
            *(Column(f"critical_speed_{k}_rad_s", v) for k, v in enumerate(self.speeds.T, start=1)),
        )
        meetings = (
            Column("own stiffness of", [item.support for item in met]),
            Column("direction", [item.direction for item in met]),
            Column("mode", [item.mode for item in met]),
            Column("rpm", [item.speed * RPM for item in met], rpm),
            Column("rad/s", [item.speed for item in met], "{:.4f}".format),
            Column("N/m", [item.stiffness for item in met], "{:.4g}".format),
        )
        limits = (
            Column("mode", range(1, self.free.size + 1)),
            Column("free supports, rpm", self.free * RPM, rpm, "free_rad_s.*", RPM),
            Column("pinned, rpm", self.pinned * RPM, rpm, "pinned_rad_s.*", RPM),
        )
        return (
            Table("map", chart),
            Table("own stiffness on the map", meetings),
            Table("limits of soft and of stiff supports", limits),
        )

    def tables(self) -> tuple[Table, ...]:
        """The limits of the critical speeds; and the map, a row for each stiffness."""
        chart, _, limits = self._tables()
        return limits, chart

    def to_frame(self) -> pd.DataFrame:
        """One row per stiffness, one column per critical speed."""
        return frame(self.tables()[1])

    def sentence(self) -> str:
        """What the map is of."""
        return self.answer.judgement

    @property
    def answer(self) -> Answer:
        """Where the supports' own stiffness meets the map; behind it the limits of each critical speed."""
        low, high = self.stiffness[0], self.stiffness[-1]
        _, meetings, limits = self._tables()
        return Answer(
            f"Map of critical speeds on supports of {low:.4g} to {high:.4g} N/m each.",
            terminal(meetings),
            tables=(terminal(limits),),
            more=limits.name,
        )


def speed_map(rotor: Rotor, stiffness: ArrayLike | None = None, n: int = 4) -> SpeedMap:
    """Compute the undamped critical speeds for supports of equal stiffness.

    Forward synchronous whirl with gyroscopic effect, as `critical_speeds`. Damping and cross-coupling play no
    part, and a support of the map stands on the ground.

    Parameters
    ----------
    rotor
        The rotor.
    stiffness
        N/m, ascending; by default eight decades around the shaft's own stiffness 48 E I / L³.
    n
        How many critical speeds.

    Raises
    ------
    ValueError
        For impossible stiffness, a rotor without supports, or more critical speeds than the model has.
    """
    if not rotor.supports:
        raise ValueError("the rotor has no support whose stiffness could vary: add supports")
    n = whole(n, "the number of critical speeds")
    flexural = (
        48 * float(rotor.length @ (rotor.youngs_modulus * rotor.second_moment)) / rotor.positions[-1] ** 4
    )
    if stiffness is None:
        stiffness = flexural * np.logspace(-_DECADES, _DECADES, 8 * _DECADES + 1)
    k = _checked(stiffness)

    def at(value: float) -> FloatArray:
        return _criticals(_with_stiffness(rotor, value), n)

    speeds = np.array([at(float(value)) for value in k])
    # ω∞ (1 − c/k) for stiff supports: two of them tell the limit.
    stiff = max(1e5 * flexural, 10 * float(k[-1]))
    pinned = 2 * at(2 * stiff) - at(stiff)
    own, meetings = [], []
    for number, support in enumerate(rotor.supports, start=1):
        name = support.name or f"support {number}"
        for direction, curve, where in _own_curves(support):
            label = name if direction == "x and y" else f"{name}, {direction}"
            own.append((label, curve, where))
            meetings += [
                Intersection(name, direction, mode, speed, value)
                for mode, speed, value in _meet(at, curve, where)
            ]
    for array in (speeds, pinned):
        array.flags.writeable = False
    return SpeedMap(k, speeds, _free(at, float(k[0])), pinned, tuple(own), tuple(meetings), rotor)


def _checked(stiffness: ArrayLike) -> FloatArray:
    try:
        k = np.atleast_1d(np.array(stiffness, dtype=float))
    except (TypeError, ValueError):
        raise ValueError("stiffness must be numbers in N/m") from None
    if k.ndim != 1 or not k.size or not (np.isfinite(k) & (k > 0)).all() or (np.diff(k) <= 0).any():
        raise ValueError("stiffness must be finite, above 0 and ascending, in N/m")
    k.flags.writeable = False
    return k


def _with_stiffness(rotor: Rotor, value: float) -> Rotor:
    supports = [
        Support(s.node, value, name=s.name, kind=s.kind, tilting_stiffness=s.tilting_stiffness)
        for s in rotor.supports
    ]
    changed: Rotor = replace(rotor, supports=supports)
    return changed


def _criticals(rotor: Rotor, n: int) -> FloatArray:
    """The n lowest, NaN for those that the model does not have."""
    # Thin discs take critical speeds away; anything else is the user's to know.
    least = 1 if rotor.model.gyroscopic else n
    found = lowest_critical_speeds(rotor, n, least).frequencies[:n]
    return np.concatenate((found, np.full(n - found.size, np.nan)))


def _free(at: _Criticals, lowest: float) -> FloatArray:
    """Limit for vanishing stiffness; rigid motions have 0."""
    soft = 1e-4 * lowest
    one, other = at(soft), at(soft / 4)
    # Either the frequency tends to 0 with the root of the stiffness, or to its limit linearly.
    rigid = np.abs(other / one - 0.5) < 0.05
    limit = np.where(rigid, 0.0, other - (one - other) / 3)
    limit.flags.writeable = False
    return limit


def _own_curves(support: Support) -> list[tuple[str, FloatArray, FloatArray]]:
    """Direction, stiffness and the speeds at which the support has it (none: at all speeds)."""
    where = np.array(support.speeds)
    k, _ = support.at(where if where.size else np.zeros(1))
    x, y = k[:, 0, 0], k[:, 1, 1]
    if support.pedestal is not None:
        (px, py) = support.pedestal.xy("stiffness")
        x, y = x * px / (x + px), y * py / (y + py)
    curves = [("x and y", x)] if np.array_equal(x, y) else [("x", x), ("y", y)]
    return [(direction, curve, where) for direction, curve in curves]


def _meet(at: _Criticals, curve: FloatArray, where: FloatArray) -> list[tuple[int, float, float]]:
    """Mode, speed and stiffness where ω(k) meets a support's curve."""
    if not where.size:
        value = float(curve[0])
        if value <= 0:
            return []
        return [(j + 1, float(w), value) for j, w in enumerate(at(value)) if np.isfinite(w)]
    if (curve <= 0).any():
        return []

    def excess(speed: float, mode: int) -> float:
        return float(at(float(np.interp(speed, where, curve)))[mode] - speed)

    f = np.array([at(float(value)) for value in curve]) - where[:, None]
    found = []
    for i, j in zip(*np.nonzero((f[:-1] > 0) != (f[1:] > 0)), strict=True):
        if not np.isfinite(f[i : i + 2, j]).all():
            continue
        ends = (float(where[i]), float(where[i + 1]))
        speed = bracketed_root(partial(excess, mode=j), ends, tuple(f[i : i + 2, j]), 1e-13 * ends[1])
        found.append((int(j) + 1, speed, float(np.interp(speed, where, curve))))
    return sorted(found)
