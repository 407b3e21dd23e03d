"""Ranges of speed in which a rotor is unstable and has no steady response."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass
from typing import Any

import numpy as np

from fem.orbits import DIRECTION_NAMES
from rotorid.base.arrays import BoolArray, FloatArray
from rotorid.base.rpm import RPM, rpm_text, speed_text


@dataclass(frozen=True)
class Window:
    """A range of speeds in which a mode grows, so that no steady response exists.

    Attributes
    ----------
    first, last
        Where growth begins and ends, rad/s; or the first and last speed asked for.
    begins, ends
        Whether these are such edges, and not the first or last speed asked for.
    mode
        Which mode grows there, by frequency at the edge, from 1; None if the rotor runs away without
        oscillating.
    frequency, direction
        Its whirl frequency, rad/s, and 1 forward, −1 backward, 0 neither; None likewise.
    """

    first: float
    last: float
    begins: bool
    ends: bool
    mode: int | None = None
    frequency: float | None = None
    direction: float | None = None

    def to_dict(self) -> dict[str, Any]:
        """Plain data for JSON."""
        return {
            "from_rad_s": self.first,
            "to_rad_s": self.last,
            "from_rpm": self.first * RPM,
            "to_rpm": self.last * RPM,
            "begins": self.begins,
            "ends": self.ends,
            "mode": self.mode,
            "frequency_rad_s": self.frequency,
            "direction": None if self.direction is None else DIRECTION_NAMES[self.direction],
        }

    def where(self) -> str:
        """The range, in rpm."""
        if self.first == self.last:
            return f"at {rpm_text(self.first)}"
        if self.begins and not self.ends:
            return f"above {rpm_text(self.first)}"
        return f"from {self.first * RPM:.6g} to {rpm_text(self.last)}"

    def said(self) -> str:
        """What happens, as a warning."""
        start, end = speed_text(self.first), speed_text(self.last)
        if self.first == self.last:
            where = f"at {start}"
        elif self.begins and self.ends:
            where = f"from {start} to {end}"
        elif self.begins:
            where = f"above {start}, up to the last speed, {end}"
        else:
            where = f"from the first speed, {start}, {'up to' if self.ends else 'to the last,'} {end}"
        text = f"the steady response does not exist {where}: "
        if self.mode is None or self.frequency is None or self.direction is None:
            return text + "the rotor runs away without oscillating there; check negative stiffness"
        return (
            f"{text}mode {self.mode} ({DIRECTION_NAMES[self.direction]} whirl, {self.frequency:.6g} rad/s) "
            "grows there; amplitudes computed there are never reached"
        )


def ranges(windows: Iterable[Window]) -> list[tuple[float, float]]:
    """First and last speed of each, rad/s."""
    return [(window.first, window.last) for window in windows]


def within(windows: tuple[Window, ...], speeds: FloatArray) -> BoolArray:
    """Which speeds, shape (S,), lie in one of the windows."""
    inside: BoolArray = np.zeros(speeds.shape, dtype=bool)
    for window in windows:
        inside |= (speeds >= window.first) & (speeds <= window.last)
    return inside
