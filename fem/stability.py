"""The speed above which a rotor whirls by itself, of any equations of motion."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Any, Literal

import numpy as np

from fem.growth_check import growing_mode, judged, loss
from fem.matrices.lateral_planes import both_planes
from fem.model.rotor import Rotor
from fem.orbits import DIRECTION_NAMES
from fem.solvers.reduced_whirl import Whirl, solve_whirl
from fem.solvers.stable_speeds import Bases
from fem.whirl import available_modes, checked_number
from rotorid.base.arrays import BoolArray, FloatArray
from rotorid.base.checks import checked_speeds
from rotorid.base.json import plain
from rotorid.base.rpm import RPM, speed_text

Status = Literal["stable", "threshold", "unstable"]


@dataclass(frozen=True, eq=False)
class Stability:
    """Where a rotor loses stability.

    Attributes
    ----------
    status
        "stable" in the whole range; "threshold": stable up to `threshold`; "unstable" from the start.
    lowest, highest
        The range that was searched, rad/s.
    threshold
        First speed at which a mode stops decaying, rad/s; None unless `status` is "threshold".
    mode
        Number of this mode (or of the one that grows fastest from the start), by frequency there, of two
        that coincide the backward one first; None if stable, or if the rotor runs away without oscillating.
    frequency
        Its whirl frequency there, rad/s; None likewise.
    direction
        1 forward, −1 backward, 0 neither; None likewise.
    margin
        Smallest logarithmic decrement of all modes over the range (up to the threshold).
    rotor
        The rotor.
    warnings
        What the reader must know.
    """

    status: Status
    lowest: float
    highest: float
    threshold: float | None
    mode: int | None
    frequency: float | None
    direction: float | None
    margin: float
    rotor: Rotor
    warnings: tuple[str, ...] = ()

    @property
    def whirl_ratio(self) -> float | None:
        """Whirl frequency by speed where stability is lost."""
        speed = self.threshold if self.status == "threshold" else self.lowest
        return self.frequency / speed if self.frequency is not None and speed else None

    def to_dict(self) -> dict[str, Any]:
        """Plain data for JSON; unknown values are None."""
        return plain(
            {
                "status": self.status,
                "lowest_rad_s": self.lowest,
                "highest_rad_s": self.highest,
                "threshold_rad_s": self.threshold,
                "threshold_rpm": None if self.threshold is None else self.threshold * RPM,
                "mode": self.mode,
                "frequency_rad_s": self.frequency,
                "whirl_ratio": self.whirl_ratio,
                "direction": None if self.direction is None else DIRECTION_NAMES[self.direction],
                "smallest_log_decrement": self.margin,
                "warnings": self.warnings,
            }
        )

    def summary(self) -> str:
        """The answer as text."""
        where = f"from {self.lowest:.6g} to {self.highest:.6g} rad/s"
        if self.status == "stable":
            lines = [f"stable {where}; smallest logarithmic decrement {self.margin:.4g}"]
        elif self.status == "threshold" and self.threshold is not None:
            lines = [f"stable up to {speed_text(self.threshold)}"]
        else:
            lines = [f"unstable already at {self.lowest:.6g} rad/s, where the search began"]
        if self.mode is not None and self.frequency is not None and self.direction is not None:
            ratio = f", {self.whirl_ratio:.4g} × speed" if self.whirl_ratio else ""
            lines.append(
                f"there mode {self.mode} grows, {DIRECTION_NAMES[self.direction]} whirl at "
                f"{self.frequency:.6g} rad/s{ratio}"
            )
        elif self.status != "stable":
            lines.append("there the rotor runs away without oscillating")
        return "\n".join([*lines, *(f"Warning: {text}" for text in self.warnings)])


def stability_threshold(
    rotor: Rotor, highest: float, *, lowest: float = 0.0, n: int = 8, steps: int = 40
) -> Stability:
    """Find the first speed at which a mode of the rotor stops decaying.

    Every mode that may grow is judged, as `fem.growth_check` does it.

    Parameters
    ----------
    rotor
        The rotor with all its supports.
    highest, lowest
        Range of speeds, rad/s.
    n
        How many modes of lowest frequency the margin is taken from.
    steps
        Into how many steps the range is divided; a mode that is unstable only between two neighbouring
        speeds is not seen. The threshold itself is found by iteration.

    Raises
    ------
    ValueError
        For an impossible range, or outside the table of a support.
    """
    speeds = range_of_speeds(lowest, highest, steps)
    n = checked_number(rotor, min(n, available_modes(rotor)))
    found, grows = judged(rotor, speeds)
    return searched(found, grows, solve_whirl(both_planes(rotor), speeds, n))


def range_of_speeds(lowest: float, highest: float, steps: int) -> FloatArray:
    """The speeds that are looked at, rad/s, shape (steps + 1,).

    Raises
    ------
    ValueError
        For an impossible range.
    """
    if not (np.isfinite(highest) and np.isfinite(lowest) and lowest < highest):
        raise ValueError(
            f"the range of speeds is empty: {lowest!r} to {highest!r} rad/s; give finite lowest < highest"
        )
    if int(steps) != steps or steps < 1:
        raise ValueError(f"the range is divided into at least one step; got {steps!r}")
    return checked_speeds(np.linspace(lowest, highest, int(steps) + 1), ascending=True)


def searched(found: Bases | None, grows: BoolArray, whirl: Whirl) -> Stability:
    """The first threshold in the range of some speeds.

    Parameters
    ----------
    found
        The equations; None where nothing can grow.
    grows
        At which speeds a mode grows, shape (S,).
    whirl
        The modes at each speed that the margin is taken from.
    """
    speeds = whirl.speeds
    upto = int(np.argmax(grows)) if grows.any() else speeds.size
    decrements = least_damped(whirl)[0][: max(upto, 1)]
    known = decrements[np.isfinite(decrements)]
    stable = Stability(
        status="stable",
        lowest=float(speeds[0]),
        highest=float(speeds[-1]),
        threshold=None,
        mode=None,
        frequency=None,
        direction=None,
        margin=float(known.min()) if known.size else float("nan"),
        rotor=whirl.Q.P.rotor,
    )
    if found is None or upto == speeds.size:
        return stable
    if upto == 0:
        mode, frequency, direction = growing_mode(found, speeds[0])
        return replace(stable, status="unstable", mode=mode, frequency=frequency, direction=direction)
    speed, value = loss(found, speeds[upto], speeds[upto - 1])
    mode, frequency, direction = growing_mode(found, speed, value)
    return replace(
        stable, status="threshold", threshold=speed, mode=mode, frequency=frequency, direction=direction
    )


def least_damped(whirl: Whirl) -> tuple[FloatArray, FloatArray]:
    """Smallest logarithmic decrement at each speed and the frequency of its mode, rad/s, shape (S,) each."""
    values = whirl.found.values
    decrements = np.where(np.isfinite(values), -2 * np.pi * values.real / np.abs(values.imag), np.inf)
    which = np.argmin(decrements, axis=1)[:, None]
    least, lam = np.take_along_axis(decrements, which, axis=1), np.take_along_axis(values, which, axis=1)
    return np.where(np.isfinite(least), least, np.nan)[:, 0], np.abs(lam.imag)[:, 0]
