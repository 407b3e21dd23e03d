"""The speed above which a rotor whirls by itself.

Near a veering a mode that is followed may slip to another. The largest growth rate of all modes is
continuous in speed whatever curve it runs along, so its root needs no names. Of a motion without damping
rounding decides the sign of Re λ: hence growth beyond rounding is asked for first, and the last step back to
Re λ = 0 is made along the slope of the mode that grows, in a basis that holds its vector of the full model.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace
from functools import partial
from itertools import pairwise
from typing import Any, Literal

import numpy as np

from fem.campbell import followed, runs_away
from fem.matrices.lateral_planes import Quadratic
from fem.model.rotor import Rotor
from fem.orbits import DIRECTION_NAMES, whirl_direction
from fem.solvers.quadratic import Solutions, polish, solve
from fem.solvers.reduced_whirl import Whirl, enriched
from fem.solvers.tracking import likeness, mass_weight
from fem.whirl import available_modes, checked_number, checked_speeds, in_both_planes
from rotorid.base.arrays import AnyArray, ComplexArray, FloatArray
from rotorid.base.json import finite
from rotorid.base.units import RPM, speed_text

_GROWTH = 1e-9  # Re λ / |λ| above which a mode grows: an undamped one has rounding there
_PARTS = 8  # into how many parts the interval with the threshold is divided
_AWAY = 1e-6  # a real eigenvalue above this part of the reference frequency runs away
_JUMP = 1e-4  # growth where it should vanish, of its change: more is a motion that came, not one that passed
_STEP = 1e-6  # relative step of speed for a slope
_SECANTS = 6
_SAME = 0.9  # MAC of a mode before and after the last digits
_DIGITS = 1e-9  # relative step of speed after which it is found
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
            "smallest_log_decrement": finite(self.margin),
            "warnings": list(self.warnings),
        }

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
        speeds is not seen. The threshold itself is found by iteration on the largest growth of all modes,
        which does not depend on which mode is which.

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
    lost = _first_growth(whirl, k, values, X)
    if lost is None:
        # It grew out of an overdamped motion, or came from above: the interval is all that is known.
        return replace(
            stable,
            status="threshold",
            threshold=float(speeds[k - 1]),
            warnings=(
                f"a motion becomes unstable between {speeds[k - 1]:.6g} and {speeds[k]:.6g} rad/s that did "
                "not oscillate before; the lower speed is given, search this range with a smaller step",
            ),
        )
    speed, mode, value, shape = lost
    stable = replace(stable, status="threshold", threshold=speed)
    if mode is None:
        return stable
    frequency, direction = _described(np.array([value]), shape)
    return replace(stable, mode=mode + 1, frequency=frequency, direction=direction)


def _first_growth(
    whirl: Whirl, k: int, values: ComplexArray, X: ComplexArray
) -> tuple[float, int | None, complex, AnyArray] | None:
    """Where growth begins: at speed number k − 1 no watched mode grows, at k one does.

    Parameters
    ----------
    whirl
        All modes at each speed.
    k
        Number of the first speed with growth.
    values, X
        Watched modes, shapes (S, n) and (S, n, R).

    Returns
    -------
    Speed, mode from 0 (None if it does not oscillate), eigenvalue and shape (1, planes, N); None if the
    motion was not there before.
    """
    Q, m = whirl.Q, whirl.found.values.shape[1]
    low, high = float(whirl.speeds[k - 1]), float(whirl.speeds[k])
    # Modes that are not watched may grow already, or begin to here: these are passed over by number.
    passed = int((_growth(whirl.found)[k - 1] > _GROWTH).sum())
    for skip in range(passed, m + 1):
        excess = partial(_excess, whirl, skip, Q)
        bracket = _first_part(excess, low, high)
        if bracket is None:
            return None
        speed, rest = _root(excess, *bracket)
        if rest > _JUMP:
            return None
        pairs, rank = _fastest(whirl, skip, Q, speed)
        if rank is None:
            return speed, None, 0j, np.empty(0)
        value, vector = complex(pairs.values[0, rank]), pairs.vectors[:1, rank]
        mode = _watched(whirl, k, values, X, np.array([value]), vector)
        if mode is not None:
            break
    else:
        return None
    larger, x = enriched(whirl, np.array([speed]), np.array([value]), vector)
    if larger is not Q:
        # The same once more in a basis that holds the full model's vector there.
        a, b = bracket
        excess = partial(_excess, whirl, skip, larger)
        if excess(a) < 0 < excess(b):
            speed, _ = _root(excess, a, b)
            pairs, rank = _fastest(whirl, skip, larger, speed)
            if rank is not None:
                value, x = complex(pairs.values[0, rank]), pairs.vectors[:1, rank]
    # The mode may have been without growth and decay, but for rounding, for some time before.
    growth = np.nan_to_num(values[:k, mode].real / np.abs(values[:k, mode]), nan=0.0)
    decays = np.flatnonzero(growth < -_GROWTH)
    floor = float(whirl.speeds[decays[-1]]) if decays.size else low
    back = _back(larger, speed, value, x, floor, high)
    if back is not None:
        speed, value, x = back
    return speed, mode, value, larger.nodes(x)


def _watched(
    whirl: Whirl, k: int, values: ComplexArray, X: ComplexArray, value: ComplexArray, vector: ComplexArray
) -> int | None:
    """Which watched mode a pair (1,), (1, R) between speeds k − 1 and k belongs to; None if to another."""
    weight, apart = mass_weight(whirl), whirl.Q.P.planes == 1
    growing = np.nan_to_num(values[k].real / np.abs(values[k]), nan=-1.0) > _GROWTH
    mine, others = np.zeros(values.shape[1]), []
    for end in (k - 1, k):
        mac = likeness(value, vector, whirl.found.values[end], whirl.found.vectors[end], weight, apart)[0]
        others.append(whirl.found.values[end, int(np.argmax(mac))])
        mine += likeness(value, vector, values[end], X[end], weight, apart)[0]
    if not growing.any() or not any(
        (values[end] == v).any() for end, v in zip((k - 1, k), others, strict=True)
    ):
        return None
    return int(np.argmax(np.where(growing, mine, -1.0)))


def _described(values: ComplexArray, shapes: AnyArray) -> tuple[float, float]:
    """Frequency and direction of one mode."""
    lam, x, y = in_both_planes(values, shapes)
    return float(lam.imag[0]), float(whirl_direction(x, y)[0])


def _growth(found: Solutions) -> FloatArray:
    """Re λ / |λ|, −1 where there is no mode."""
    return np.asarray(np.nan_to_num(found.values.real / np.abs(found.values), nan=-1.0))


def _excess(whirl: Whirl, passed: int, Q: Quadratic, speed: float) -> float:
    """Largest growth but for a number of modes, less what is rounding; real eigenvalues by the reference."""
    pairs = solve(Q, np.array([speed]), whirl.found.values.shape[1], whirl.scale)
    ranked = np.sort(_growth(pairs)[0])[::-1]
    fastest = float(ranked[passed]) - _GROWTH if passed < ranked.size else -1.0
    return max(fastest, _real(pairs, whirl))


def _fastest(whirl: Whirl, passed: int, Q: Quadratic, speed: float) -> tuple[Solutions, int | None]:
    """The pairs at a speed and which of them `_excess` means; None if it does not oscillate."""
    pairs = solve(Q, np.array([speed]), whirl.found.values.shape[1], whirl.scale)
    rates = _growth(pairs)[0]
    rank = int(np.argsort(-rates, kind="stable")[min(passed, rates.size - 1)])
    away = passed >= rates.size or _real(pairs, whirl) > rates[rank] - _GROWTH
    return pairs, None if away else rank


def _real(pairs: Solutions, whirl: Whirl) -> float:
    """Growth of motions that do not oscillate, as `_excess` counts it."""
    return float(pairs.real[0].max(initial=-whirl.scale)) / whirl.scale - _AWAY


def _first_part(function: Callable[[float], float], low: float, high: float) -> tuple[float, float] | None:
    """The first part of an interval in which a function becomes positive."""
    speeds = np.linspace(low, high, _PARTS + 1).tolist()
    return next(((a, b) for a, b in pairwise(speeds) if function(b) > 0), None)


def _root(function: Callable[[float], float], a: float, b: float) -> tuple[float, float]:
    """A bracketed root, and what is left of the function there, relative to its change."""
    from scipy.optimize import brentq

    start, end = function(a), function(b)
    if start >= 0:
        return a, 0.0
    speed = float(brentq(function, a, b, xtol=1e-13 * b, rtol=1e-14))
    return speed, abs(function(speed)) / (end - start)


def _back(
    Q: Quadratic, speed: float, value: complex, X: ComplexArray, floor: float, high: float
) -> tuple[float, complex, ComplexArray] | None:
    """Speed, eigenvalue and vector (1, R) where a mode neither grows nor decays; None if it is not plain."""
    at, first = np.array([0]), X
    lam = np.array([value])
    lam, X, _ = polish(Q, np.array([speed]), at, lam, X, 1)
    step = _STEP * high if speed + _STEP * high <= high else -_STEP * high
    other = polish(Q, np.array([speed + step]), at, lam, X, 2)[0]
    slope = float((other.real / np.abs(other) - lam.real / np.abs(lam))[0]) / step
    if not slope > 0:
        return None
    for _ in range(_SECANTS):
        here = float((lam.real / np.abs(lam))[0])
        new = float(np.clip(speed - here / slope, floor, high))
        moved, speed = abs(new - speed), new
        lam, X, _ = polish(Q, np.array([speed]), at, lam, X, 2)
        if moved <= 1e-3 * _DIGITS * high:
            break
    same = np.abs(np.vdot(first, X)) ** 2 / (np.vdot(first, first).real * np.vdot(X, X).real)
    if moved > _DIGITS * high or same < _SAME:
        return None
    return speed, complex(lam[0]), X
