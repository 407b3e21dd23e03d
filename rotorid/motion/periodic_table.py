"""Periodic motion as tables: points of the branches with their amplitudes, bifurcations, jumps."""

from __future__ import annotations

import math
from dataclasses import dataclass
from functools import cached_property
from typing import Any

import numpy as np

from rotorid.base.arrays import FloatArray
from rotorid.base.json import plain
from rotorid.base.result import Column, rows
from rotorid.base.rpm import RPM
from rotorid.base.text import ROUNDING
from rotorid.motion.continuation import FOLD, HOPF, TORUS, Bifurcation, Branch, Point
from rotorid.motion.periodic import PeriodicMotion, departing, whirl_at_rest


@dataclass(frozen=True, eq=False)
class Readings:
    """Periodic motion as sensors read it.

    Attributes
    ----------
    motion
        The branches.
    labels
        Names of the k sensors.
    directions
        Unit vectors of what they read in the coordinates, shape (k, n).
    """

    motion: PeriodicMotion
    labels: tuple[str, ...]
    directions: FloatArray

    def amplitudes(self, point: Point) -> FloatArray:
        """Half of what each sensor reads from peak to peak, m, shape (k,)."""
        read = point.orbit.readings(self.directions)
        size = np.ptp(read, axis=0) / 2
        return np.where(size > 1e3 * ROUNDING * np.abs(read).max(axis=0), size, 0.0)

    @cached_property
    def along(self) -> tuple[FloatArray, ...]:
        """Amplitudes at the points of each branch, m, shape (points, k)."""
        return tuple(np.array([self.amplitudes(p) for p in branch.points]) for branch in self.motion.branches)

    @cached_property
    def at(self) -> tuple[FloatArray, ...]:
        """Amplitudes at the bifurcations of each branch, m, shape (bifurcations, k)."""
        k = len(self.labels)
        return tuple(
            np.array([self.amplitudes(b.point) for b in branch.bifurcations]).reshape(-1, k)
            for branch in self.motion.branches
        )

    @cached_property
    def jumps(self) -> tuple[tuple[float, FloatArray, FloatArray], ...]:
        """Where a stable motion ends at a fold: speed, rad/s, amplitudes there and where it jumps to, m.

        That is the stable motion at the same speed whose amplitudes are nearest.
        """
        found = []
        for branch, sizes in zip(self.motion.branches, self.at, strict=True):
            for fold, size in zip(branch.bifurcations, sizes, strict=True):
                if fold.kind != FOLD or not branch.stable[fold.after - 1 : fold.after + 1].any():
                    continue
                speed = fold.point.orbit.speed
                there = zip(self.motion.branches, self.along, strict=True)
                others = [one for b, values in there for one, stable in b.at(speed, values) if stable]
                far = [one for one in others if np.abs(one - size).max() > 0.02 * size.max()]
                if far:
                    found.append((speed, size, min(far, key=lambda one: np.abs(one - size).max())))
        return tuple(found)

    def points(self) -> tuple[Column, ...]:
        """One row a point."""
        each = [(k, branch, p) for k, branch in enumerate(self.motion.branches, 1) for p in branch.points]
        return (
            Column("branch", [k for k, _, _ in each]),
            Column("kind", [branch.kind for _, branch, _ in each]),
            Column("speed_rad_s", [p.orbit.speed for _, _, p in each]),
            Column("period_s", [_period(branch, p) for _, branch, p in each]),
            Column("stable", [p.outside == 0 for _, _, p in each]),
            Column("largest_multiplier", [p.largest for _, _, p in each]),
            *(
                Column(f"amplitude_{label}_m", values)
                for label, values in zip(self.labels, np.concatenate(self.along).T, strict=True)
            ),
        )

    def bifurcations(self) -> tuple[Column, ...]:
        """One row a bifurcation."""
        each = [
            (k, branch, b) for k, branch in enumerate(self.motion.branches, 1) for b in branch.bifurcations
        ]
        sizes = np.concatenate(self.at)
        ratios = [self._whirl(branch, b) for _, branch, b in each]
        return (
            Column("branch", [k for k, _, _ in each], str),
            Column("kind", [branch.kind for _, branch, _ in each], str, "motion"),
            Column("bifurcation", [b.kind for _, _, b in each], str),
            Column("speed_rad_s", [b.point.orbit.speed for _, _, b in each]),
            Column("speed_rpm", [b.point.orbit.speed * RPM for _, _, b in each], "{:.6g}".format, "rpm"),
            Column("whirl_ratio", ratios, "{:.4f}".format, "whirl/speed"),
            *(
                Column(f"amplitude_{label}_m", values, lambda m: f"{1e6 * m:.4g}", f"{label}, µm")
                for label, values in zip(self.labels, sizes.T, strict=True)
            ),
        )

    def _whirl(self, branch: Branch, bifurcation: Bifurcation) -> float:
        """Frequency that begins there, of a cycle its own, by the speed; NaN where none begins."""
        orbit = bifurcation.point.orbit
        if bifurcation.kind == HOPF:
            return whirl_at_rest(self.motion.system, orbit.start, orbit.speed)[0] / orbit.speed
        if not branch.turns:
            return math.tau / orbit.period / orbit.speed
        if bifurcation.kind == TORUS:
            return departing(self.motion.system, branch.turns, bifurcation) / orbit.speed
        return math.nan

    def to_dict(self) -> dict[str, Any]:
        """As JSON types."""
        branches = [
            {
                "kind": branch.kind,
                "turns": branch.turns or None,
                "ended": branch.ended,
                "speeds_rad_s": branch.speeds,
                "periods_s": [_period(branch, p) for p in branch.points],
                "stable": branch.stable,
                "largest_multiplier": [p.largest for p in branch.points],
                "steps": max(len(p.orbit.velocities) for p in branch.points),
                "amplitude_m": sizes.T,
            }
            for branch, sizes in zip(self.motion.branches, self.along, strict=True)
        ]
        return plain(
            {
                "sensors": self.labels,
                "branches": branches,
                "bifurcations": rows(self.bifurcations()),
                "jumps": [
                    {"speed_rad_s": speed, "from_m": before, "to_m": after}
                    for speed, before, after in self.jumps
                ],
                "tried": self.motion.tried,
                "warnings": self.motion.warnings,
            }
        )


def _period(branch: Branch, point: Point) -> float:
    """s; NaN for a rotor at rest."""
    return math.nan if branch.kind == "rest" else point.orbit.period
