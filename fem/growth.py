"""Modes that grow: from which speed on, refined on the model."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np

from fem.orbits import whirl_direction
from fem.solvers.crossing import crossings
from fem.solvers.quadratic import NONE
from fem.solvers.reduced_whirl import Whirl
from fem.whirl import DIRECTION_NAMES, in_both_planes
from rotorid.base.arrays import ComplexArray, FloatArray
from rotorid.base.units import RPM, speed_text

GROWTH = 1e-7  # Re λ / |λ| above which a mode is said to grow: an undamped one has rounding there


@dataclass(frozen=True)
class Growing:
    """A mode that grows at some of the speeds.

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
    frequency, direction
        Whirl frequency, rad/s, and 1 forward, −1 backward, 0 neither, where it starts.
    log_decrement
        The lowest in the range.
    """

    mode: int
    speed: float
    from_start: bool
    last: float
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
            "frequency_rad_s": self.frequency,
            "direction": self.way,
            "lowest_log_decrement": self.log_decrement,
        }

    def said(self) -> str:
        """What happens, as a warning."""
        where = "already at" if self.from_start else "above"
        return (
            f"unstable: mode {self.mode} ({self.way} whirl, {self.frequency:.6g} rad/s) grows {where} "
            f"{speed_text(self.speed)}, log decrement down to "
            f"{self.log_decrement:.3g} in this range"
        )


def growing(whirl: Whirl, values: ComplexArray, X: ComplexArray) -> tuple[Growing, ...]:
    """Modes that grow somewhere, by the speed where they start to, from shapes (S, n) and (S, n, R)."""
    growth = values.real / np.abs(values)
    grows = np.nan_to_num(growth, nan=-np.inf) > GROWTH
    modes = [int(mode) for mode in np.flatnonzero(grows.any(axis=0))]
    first = grows.argmax(axis=0)
    only = np.full_like(values, NONE)
    for mode in modes:
        k = first[mode]
        if k > 0 and growth[k - 1, mode] < 0:
            only[k - 1 : k + 1, mode] = values[k - 1 : k + 1, mode]
    refined: dict[int, tuple[float, ComplexArray, ComplexArray]] = {}
    if np.isfinite(only).any():
        found = crossings(whirl, only, X, _level)
        for i, mode in enumerate(found.modes):
            refined[int(mode)] = (float(found.speeds[i]), found.values[i : i + 1], found.shapes[i : i + 1])
    out = []
    for mode in modes:
        k = int(first[mode])
        from_start = k == 0 or not np.isfinite(values[k - 1, mode])
        here = values[k : k + 1, mode], whirl.Q.nodes(X[k : k + 1, mode])
        speed, lam, shape = refined.get(mode, (float(whirl.speeds[k]), here[0], here[1]))
        lam, x, y = in_both_planes(lam, shape)
        out.append(
            Growing(
                mode=mode + 1,
                speed=speed,
                from_start=from_start,
                last=float(whirl.speeds[grows[:, mode]][-1]),
                frequency=float(lam.imag[0]),
                direction=float(whirl_direction(x, y)[0]),
                log_decrement=float(
                    np.nanmin(-2 * np.pi * values[:, mode].real / np.abs(values[:, mode].imag))
                ),
            )
        )
    return tuple(sorted(out, key=lambda g: (g.speed, g.mode)))


def _level(lam: ComplexArray, _: FloatArray) -> FloatArray:
    return np.asarray(lam.real / np.abs(lam))
