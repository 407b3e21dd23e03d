"""The speed above which a rotor whirls by itself."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Any, Literal

import numpy as np

from fem.campbell import followed, runs_away
from fem.crossing import crossings
from fem.orbits import whirl_direction
from fem.planes import AnyArray, ComplexArray
from fem.quadratic import NONE
from fem.rotor import RPM, FloatArray, Rotor
from fem.whirl import DIRECTION_NAMES, available_modes, checked_number, checked_speeds, in_both_planes

_GROWTH = 1e-9  # Re λ / |λ| above which a mode grows: an undamped one has rounding there
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
        Number of this mode (or of the one that grows fastest from the start), by frequency at the lowest
        speed; None if stable, or if the motion runs away without oscillating.
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
        return {
            "status": self.status,
            "lowest_rad_s": self.lowest,
            "highest_rad_s": self.highest,
            "threshold_rad_s": self.threshold,
            "threshold_rpm": None if self.threshold is None else self.threshold * RPM,
            "mode": self.mode,
            "frequency_rad_s": self.frequency,
            "whirl_ratio": self.whirl_ratio,
            "direction": None if self.direction is None else DIRECTION_NAMES[self.direction],
            "smallest_log_decrement": self.margin if np.isfinite(self.margin) else None,
            "warnings": list(self.warnings),
        }

    def summary(self) -> str:
        """The answer as text."""
        where = f"from {self.lowest:.6g} to {self.highest:.6g} rad/s"
        if self.status == "stable":
            lines = [f"stable {where}; smallest logarithmic decrement {self.margin:.4g}"]
        elif self.status == "threshold" and self.threshold is not None:
            lines = [f"stable up to {self.threshold:.6g} rad/s = {self.threshold * RPM:.6g} rpm"]
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

    Parameters
    ----------
    rotor
        The rotor with all its supports.
    highest, lowest
        Range of speeds, rad/s.
    n
        How many modes of lowest frequency to watch.
    steps
        Into how many steps the range is divided; a mode that is unstable only between two neighbouring
        speeds is not seen. The threshold itself is found by iteration.

    Raises
    ------
    ValueError
        For an impossible range, or outside the table of a support.
    """
    if not lowest < highest:
        raise ValueError(
            f"the range of speeds is empty: {lowest!r} to {highest!r} rad/s; give lowest < highest"
        )
    speeds = checked_speeds(np.linspace(lowest, highest, max(int(steps), 1) + 1))
    n = checked_number(rotor, min(n, available_modes(rotor)))
    whirl, paths, columns = followed(rotor, speeds, n)
    values, X = paths.values[:, columns], paths.vectors[:, columns]
    growth = np.nan_to_num(values.real / np.abs(values), nan=-np.inf)
    running = np.array(runs_away(whirl))
    grows = (growth > _GROWTH).any(axis=1) | running
    upto = int(np.argmax(grows)) if grows.any() else len(speeds)
    decrements = (-2 * np.pi * values.real / np.abs(values.imag))[: max(upto, 1)]
    stable = Stability(
        status="stable",
        lowest=float(speeds[0]),
        highest=float(speeds[-1]),
        threshold=None,
        mode=None,
        frequency=None,
        direction=None,
        margin=float(np.nanmin(decrements)) if np.isfinite(decrements).any() else float("nan"),
        rotor=rotor,
    )
    if not grows.any():
        return stable
    k = int(np.argmax(grows))
    if k == 0:
        if not (growth[0] > _GROWTH).any():
            return replace(stable, status="unstable")
        worst = int(np.argmax(growth[0]))
        frequency, direction = _described(values[:1, worst], whirl.Q.nodes(X[:1, worst]))
        return replace(stable, status="unstable", mode=worst + 1, frequency=frequency, direction=direction)
    fresh = (growth[k] > _GROWTH) & np.isfinite(growth[k - 1])
    if not fresh.any():
        # It grew out of an overdamped motion: the interval is all that is known.
        return replace(
            stable,
            status="threshold",
            threshold=float(speeds[k - 1]),
            warnings=(
                f"an overdamped motion becomes unstable between {speeds[k - 1]:.6g} and {speeds[k]:.6g} "
                "rad/s; the lower speed is given, search this range with a smaller step",
            ),
        )
    only = np.full_like(values, NONE)
    # From the last speed at which the mode decays beyond rounding; undamped up to the threshold, rounding
    # decides the sign of Re λ, and growth beyond it is asked for.
    decays = growth[:k] < -_GROWTH
    damped = bool(decays[:, fresh].any(axis=0).all())
    offset = 0.0 if damped else _GROWTH
    for mode in np.flatnonzero(fresh):
        start = int(np.flatnonzero(decays[:, mode])[-1]) if damped else k - 1
        only[start : k + 1, mode] = values[start : k + 1, mode]

    def level(lam: ComplexArray, _: FloatArray) -> FloatArray:
        return np.asarray(lam.real / np.abs(lam) - offset)

    found = crossings(whirl, only, X, level)
    frequency, direction = _described(found.values[:1], found.shapes[:1])
    return replace(
        stable,
        status="threshold",
        threshold=float(found.speeds[0]),
        mode=int(found.modes[0]) + 1,
        frequency=frequency,
        direction=direction,
    )


def _described(values: ComplexArray, shapes: AnyArray) -> tuple[float, float]:
    """Frequency and direction of one mode."""
    lam, x, y = in_both_planes(values, shapes)
    return float(lam.imag[0]), float(whirl_direction(x, y)[0])
