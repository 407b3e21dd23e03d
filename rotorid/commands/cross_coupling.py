"""Stability over cross-coupling added at one place, as the level I analysis of API 617 and API 684 has it.

Seals and impellers push a whirling rotor along its motion: F = k (−y, x). How much of it, k in N/m, a rotor
bears at its mid span (or at an impeller) is the usual measure of its margin.
"""

from __future__ import annotations

import dataclasses
from dataclasses import dataclass
from typing import Any

import numpy as np

import fem
from rotorid.base.arrays import FloatArray
from rotorid.base.json import plain
from rotorid.base.tables import Column, Table
from rotorid.base.text import RPM, rpm_text

_STEPS, _MODES = 11, 12


@dataclass(frozen=True, eq=False)
class CrossCoupling:
    """Logarithmic decrements over added cross-coupling.

    Attributes
    ----------
    node, speed
        Where it acts; speed of the rotor, rad/s.
    added
        N/m, shape (K,).
    smallest, frequencies
        Smallest logarithmic decrement of the modes looked at, and the whirl frequency of that mode, rad/s,
        shape (K,).
    forward
        Logarithmic decrement of the first forward mode, shape (K,); NaN where none is forward.
    threshold
        Where the smallest becomes 0, N/m; None: not in the range.
    """

    node: int
    speed: float
    added: FloatArray
    smallest: FloatArray
    frequencies: FloatArray
    forward: FloatArray
    threshold: float | None

    def to_dict(self) -> dict[str, Any]:
        """Plain data for JSON."""
        return plain(
            {
                "node": self.node,
                "speed_rad_s": self.speed,
                "added_N_per_m": self.added,
                "smallest_log_decrement": self.smallest,
                "frequency_rad_s": self.frequencies,
                "first_forward_log_decrement": self.forward,
                "threshold_N_per_m": self.threshold,
            }
        )

    def tables(self) -> tuple[Table, ...]:
        """A row for each stiffness."""
        columns = (
            Column("added, N/m", self.added, "{:.4g}".format, "added_N_per_m.*"),
            Column("smallest log dec", self.smallest, "{:z.4f}".format, "smallest_log_decrement.*"),
            Column("of whirl at, rpm", self.frequencies * RPM, "{:.1f}".format, "frequency_rad_s.*", RPM),
            Column("first forward", self.forward, "{:z.4f}".format, "first_forward_log_decrement.*"),
        )
        return (Table(f"cross-coupling added at node {self.node}, at {rpm_text(self.speed)}", columns),)

    def sentence(self) -> str:
        """How much is borne."""
        place = f"cross-coupling at node {self.node}, at {rpm_text(self.speed)}"
        first, last = self.smallest[0], self.smallest[-1]
        if first <= 0:
            return f"UNSTABLE at {rpm_text(self.speed)} before any cross-coupling is added."
        most, left = self.added[-1], f"smallest log decrement {last:z.4f}"
        if self.threshold is not None:
            most, left = self.threshold, "there the smallest log decrement is 0"
        return f"It bears {most:.4g} N/m of {place}: {left} ({first:z.4f} without)."


def cross_coupling(
    rotor: fem.Rotor, speed: float, span: tuple[float, float], place: str | int | None = None
) -> CrossCoupling:
    """Compute decrements over cross-coupling added at a node or station; by default at the mid span.

    Parameters
    ----------
    rotor
        The rotor.
    speed
        rad/s.
    span
        Least and most, N/m.
    place
        Node or station; None: the node next to the middle between the outer bearings, or of the shaft.

    Raises
    ------
    ValueError
        As `fem.campbell`, and for a place that the rotor does not have.
    """
    from scipy.optimize import brentq

    node = rotor.node(mid_span(rotor) if place is None else place)

    def at(k: float) -> tuple[float, float, float]:
        seal = fem.Support(node, ((0.0, k), (-k, 0.0)), kind="seal")
        whirl = fem.campbell(dataclasses.replace(rotor, supports=[*rotor.supports, seal]), [speed], _MODES)
        decrements, there = whirl.log_decrements[0], np.isfinite(whirl.log_decrements[0])
        least = int(np.nanargmin(decrements))
        ahead = np.flatnonzero(there & (whirl.direction[0] > 0) & (decrements < 6.0))
        first = min(ahead, key=lambda mode: whirl.frequencies[0, mode], default=None)
        return (
            float(decrements[least]),
            float(whirl.frequencies[0, least]),
            np.nan if first is None else float(decrements[first]),
        )

    added = np.linspace(*span, _STEPS)
    smallest, frequencies, forward = np.array([at(float(k)) for k in added]).T
    below = np.flatnonzero((smallest[:-1] > 0) & (smallest[1:] <= 0))
    threshold = None
    if below.size:
        ends = added[below[0] : below[0] + 2]
        threshold = float(brentq(lambda k: at(k)[0], *ends, xtol=1e-6 * span[1], rtol=1e-9))
    return CrossCoupling(node, speed, added, smallest, frequencies, forward, threshold)


def mid_span(rotor: fem.Rotor) -> int:
    """The node next to the middle between the outer bearings."""
    ends = [rotor.positions[each.node - 1] for each in rotor.supports if each.kind == "bearing"] or [
        rotor.positions[-1]
    ]
    middle = (min(ends) + max(ends)) / 2 if ends[1:] else ends[0] / 2
    return int(abs(rotor.positions - middle).argmin()) + 1
