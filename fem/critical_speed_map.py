"""Undamped critical speed map: critical speeds over the stiffness of the supports."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from fem.result import Result, holding_arrays
from fem.rotor import Rotor, Support
from fem.undamped import lowest_critical_speeds
from rotorid.base.arrays import FloatArray, whole
from rotorid.base.json import plain
from rotorid.base.tables import Column, Table
from rotorid.base.text import RPM


@holding_arrays
class SpeedMap(Result):
    """Critical speeds over support stiffness.

    Attributes
    ----------
    stiffness
        Of each support of the map, N/m, shape (K,).
    speeds
        Critical speeds, rad/s, shape (K, n); NaN where a mode has none (thin discs).
    free, pinned
        Their limits for vanishing and for infinite stiffness, rad/s, shape (n,).
    """

    stiffness: FloatArray
    speeds: FloatArray
    free: FloatArray
    pinned: FloatArray

    def to_dict(self) -> dict[str, Any]:
        """Plain data for JSON; one list of speeds per mode."""
        return plain(
            {
                "stiffness_N_per_m": self.stiffness,
                "critical_speeds_rad_s": self.speeds.T,
                "free_rad_s": self.free,
                "pinned_rad_s": self.pinned,
            }
        )

    def tables(self) -> tuple[Table, ...]:
        """The limits of the critical speeds; and the map, a row for each stiffness."""
        limits = (
            Column("mode", range(1, self.free.size + 1)),
            Column("free supports, rpm", self.free * RPM, "{:.2f}".format, "free_rad_s.*", RPM),
            Column("pinned, rpm", self.pinned * RPM, "{:.2f}".format, "pinned_rad_s.*", RPM),
        )
        chart = (
            Column("stiffness_N_per_m", self.stiffness, "{:.4g}".format),
            *(Column(f"critical_speed_{k}_rad_s", v) for k, v in enumerate(self.speeds.T, start=1)),
        )
        return (Table("limits of soft and of stiff supports", limits), Table("map", chart))

    def sentence(self) -> str:
        """Range of stiffness and number of critical speeds, in one sentence."""
        return (
            f"Map of critical speeds on supports of {self.stiffness[0]:.4g} to {self.stiffness[-1]:.4g} N/m."
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
    bending = rotor.length @ (rotor.youngs_modulus * rotor.second_moment)
    flexural = 48 * bending / rotor.positions[-1] ** 4
    if stiffness is None:
        stiffness = flexural * np.logspace(-4, 4, 33)
    k = np.array(stiffness, float, ndmin=1)
    if k.ndim > 1 or not k.size or not (np.isfinite(k) & (np.diff(k, prepend=0.0) > 0)).all():
        raise ValueError("stiffness must be finite, above 0 and ascending, in N/m")

    def at(value: float) -> FloatArray:
        """The n lowest, NaN for those that thin discs take away."""
        supports = [Support(s.node, value, tilting_stiffness=s.tilting_stiffness) for s in rotor.supports]
        other = replace(rotor, supports=supports)
        lowest = lowest_critical_speeds(other, n, 1 if rotor.model.gyroscopic else n).frequencies
        return np.append(lowest, n * [np.nan])[:n]

    # ω∞ (1 − c/k) for stiff supports; for soft ones ω₀ + c k, or, of rigid motions, the root of k.
    soft, stiff = 1e-4 * k[0], max(1e5 * flexural, 10 * k[-1])
    softer, less, *speeds, more, stiffer = map(at, [soft / 4, soft, *k, stiff, 2 * stiff])
    pinned, chart = 2 * stiffer - more, np.array(speeds)
    free = np.where(np.abs(softer / less - 0.5) < 0.05, 0.0, softer - (less - softer) / 3)
    return SpeedMap(k, chart, free, pinned)
