"""Modes that grow: from which speed on, refined on the model."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from fem.orbits import DIRECTION_NAMES, whirl_direction
from fem.solvers.crossing import crossings, growth_rate
from fem.solvers.quadratic_eigenvalues import NONE
from fem.solvers.reduced_whirl import Whirl
from fem.solvers.stable_speeds import GROWTH
from fem.whirl import in_both_planes
from fem.windows import Window
from rotorid.base.arrays import ComplexArray, FloatArray
from rotorid.base.rpm import RPM, speed_text


@dataclass(frozen=True)
class Growing:
    """A range of speeds in which a mode grows; a mode may have several.

    Attributes
    ----------
    mode
        Its number, from 1.
    speed
        Where it starts to grow, rad/s; the first speed if it grows there already.
    from_start
        Whether it grows at the first speed already (or at the first where it oscillates).
    last
        Last of the given speeds at which it grows, rad/s.
    end
        Where it stops growing, rad/s; None if it grows at the last speed (or the last where it oscillates).
    frequency, direction
        Whirl frequency, rad/s, and 1 forward, −1 backward, 0 neither, where it starts.
    log_decrement
        The lowest in the range.
    """

    mode: int
    speed: float
    from_start: bool
    last: float
    end: float | None
    frequency: float
    direction: float
    log_decrement: float

    @property
    def way(self) -> str:
        """The direction in a word."""
        return DIRECTION_NAMES[self.direction]

    def to_dict(self) -> dict[str, Any]:
        """Plain data for JSON."""
        return {
            "mode": self.mode,
            "speed_rad_s": self.speed,
            "speed_rpm": self.speed * RPM,
            "from_start": self.from_start,
            "last_speed_rad_s": self.last,
            "end_rad_s": self.end,
            "frequency_rad_s": self.frequency,
            "direction": self.way,
            "lowest_log_decrement": self.log_decrement,
        }

    def said(self) -> str:
        """What happens, as a warning."""
        where = ("already at " if self.from_start else "above ") + speed_text(self.speed)
        if self.end is not None:
            first = "the first speed, " if self.from_start else ""
            where = f"from {first}{speed_text(self.speed)} to {speed_text(self.end)}"
        return (
            f"unstable: mode {self.mode} ({self.way} whirl, {self.frequency:.6g} rad/s) grows {where}, "
            "log decrement down to "
            f"{self.log_decrement:.3g} in this range"
        )


def growing(whirl: Whirl, values: ComplexArray, X: ComplexArray) -> tuple[Growing, ...]:
    """Ranges in which modes grow, by the speed where they start to, from shapes (S, n) and (S, n, R)."""
    growth = growth_rate(values)
    grows = np.nan_to_num(growth, nan=-np.inf) > GROWTH
    only = np.full_like(values, NONE)
    runs = []
    for mode in np.flatnonzero(grows.any(axis=0)).tolist():
        edges = np.flatnonzero(np.diff(np.concatenate(([False], grows[:, mode], [False])))).tolist()
        runs += [(mode, start, end - 1) for start, end in zip(edges[::2], edges[1::2], strict=True)]
    for mode, i, j in runs:
        for k in (i - 1, j):
            if 0 <= k < len(growth) - 1 and min(growth[k, mode], growth[k + 1, mode]) < 0:
                only[k : k + 2, mode] = values[k : k + 2, mode]
    roots: dict[int, list[tuple[float, ComplexArray, ComplexArray]]] = {}
    if np.isfinite(only).any():
        found = crossings(whirl, only, X, growth_rate)
        for c, mode in enumerate(found.modes.tolist()):
            root = float(found.speeds[c]), found.values[c : c + 1], found.shapes[c : c + 1]
            roots.setdefault(mode, []).append(root)
    out = []
    speeds = whirl.speeds
    for mode, i, j in runs:
        here = float(speeds[i]), values[i : i + 1, mode], whirl.Q.nodes(X[i : i + 1, mode])
        before = i > 0 and np.isfinite(values[i - 1, mode])
        starts = [r for r in roots.get(mode, []) if before and speeds[i - 1] <= r[0] <= speeds[i]]
        after = j + 1 < len(speeds) and np.isfinite(values[j + 1, mode])
        ends = [r[0] for r in roots.get(mode, []) if after and speeds[j] <= r[0] <= speeds[j + 1]]
        speed, lam, shape = starts[0] if starts else here
        lam, x, y = in_both_planes(lam, shape)
        mine = values[i : j + 1, mode]
        out.append(
            Growing(
                mode=mode + 1,
                speed=speed,
                from_start=not before,
                last=float(speeds[j]),
                end=(ends[-1] if ends else float(speeds[j])) if after else None,
                frequency=float(lam.imag[0]),
                direction=float(whirl_direction(x, y)[0]),
                log_decrement=float(np.nanmin(-2 * np.pi * mine.real / np.abs(mine.imag))),
            )
        )
    return tuple(sorted(out, key=lambda g: (g.speed, g.mode)))


def joined(ranges: Sequence[Growing], speeds: FloatArray) -> tuple[Window, ...]:
    """Ranges of speed in which some mode grows, as far as they hold one of the speeds, ascending.

    Modes have the numbers that they have in the list.
    """
    found: list[Window] = []
    for g in ranges:
        last, ends = (g.last, False) if g.end is None else (g.end, True)
        if found and g.speed <= found[-1].last:
            if last > found[-1].last:
                found[-1] = replace(found[-1], last=last, ends=ends)
        else:
            begins = bool(g.speed > speeds[0])
            found.append(Window(g.speed, last, begins, ends, g.mode, g.frequency, g.direction))
    return tuple(w for w in found if ((speeds >= w.first) & (speeds <= w.last)).any())
