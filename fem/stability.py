"""Where a rotor whirls by itself: the largest growth of all its motions over speed.

Growth of a motion is Re λ / |λ|. The largest one of all motions is continuous in speed whatever mode has it:
no mode must be followed. It is looked at on a grid of speeds, which is halved where its slopes tell of a
change of sign between two of them. A motion grows where it is above `GROWTH`, the rounding of what damps and
drives it: motions without any damping do not. Edges of unstable ranges are where the largest growth passes
this level, moved back to Re λ = 0 on the mode that grows.

Which motions may grow is bounded. Multiplied by the conjugate velocity the equations show that on positive
stiffness and damping a growing motion of frequency ω takes work q from circulating forces and gives c ω to
the damping, so that ω < q / c for one of them at least: kxy − kyx = 2 q at a support, ω < Ω for material and
other damping that turns with the shaft (c z' − i Ω c z). Gyroscopic moments do no work. Where no bound is low
enough, modes up to twice the highest speed are looked at.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable
from dataclasses import dataclass
from typing import Any, Literal

import numpy as np

from fem.assembly import both_planes, internal_damping
from fem.orbits import DIRECTION_NAMES
from fem.result import Result, holding_arrays
from fem.rotor import Rotor
from fem.whirl import (
    GROWTH,
    NONE,
    Whirl,
    available_modes,
    checked_number,
    decrements_of,
    solve_whirl,
    whirling,
)
from rotorid.base.arrays import BoolArray, ComplexArray, FloatArray, IndexArray, checked_speeds
from rotorid.base.json import plain
from rotorid.base.tables import Column, Table
from rotorid.base.text import RPM, rpm_text, speed_text

AWAY = 1e-6
"""Part of the lowest frequency above which a real eigenvalue runs away."""
_BESIDE = 0.1  # weight of such an eigenvalue beside the growth of motions that oscillate
_SLACK = 1e-12  # of the largest entry of a matrix: rounding
_NO_DAMPING = 1e-100  # N s/m, below which none is divided by
_TIMES = 2.0  # the highest speed: up to there modes are looked at, where no bound says how far
_GRID = 60  # speeds of a grid at most, before it is halved
_PARTS = 20  # of a range over tables, at least
_ROUNDS = 6  # of halving
_BACK = 1e-5  # of a step: to which the slope at an edge belongs
_PAIR = 1e-6  # relative distance of forward and backward whirl that coincide
_SECANTS = 60  # at most
_EXACT = 1e-9  # relative change of a root by the last secant

Status = Literal["stable", "threshold", "unstable"]


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
        Which mode grows there, by frequency at `first`, from 1, of two that coincide the backward one first;
        None if the rotor runs away without oscillating.
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

    @property
    def way(self) -> str | None:
        """The direction in a word."""
        return None if self.direction is None else DIRECTION_NAMES[self.direction]

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
            "direction": self.way,
        }

    def where(self, text: Callable[[float], str] = rpm_text) -> str:
        """The range, in rpm or as another function writes a speed."""
        if self.first == self.last:
            return f"at {text(self.first)}"
        if self.begins and not self.ends:
            return f"above {text(self.first)}"
        return f"from {text(self.first)} to {text(self.last)}"

    def sentence(self) -> str:
        """A warning of the growth in this window."""
        cause = "the rotor runs away without oscillating; check negative stiffness"
        if self.mode is not None:
            cause = f"mode {self.mode} ({self.way} whirl, {self.frequency:.6g} rad/s) grows"
        last = f" up to the last speed, {speed_text(self.last)}" if self.begins and not self.ends else ""
        return f"the steady response does not exist {self.where(speed_text)}{last}: there {cause}"


def within(windows: Iterable[Window], speeds: FloatArray) -> BoolArray:
    """Which speeds, shape (S,), lie in one of the windows."""
    inside = ((window.first <= speeds) & (speeds <= window.last) for window in windows)
    return sum(inside, np.zeros(speeds.shape, bool))


@holding_arrays
class Stability(Result):
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
        speed = self.threshold or self.lowest
        return self.frequency / speed if self.frequency and speed else None

    def to_dict(self) -> dict[str, Any]:
        """Plain data for JSON; unknown values are None."""
        way = None if self.direction is None else DIRECTION_NAMES[self.direction]
        return plain(
            {
                "status": self.status,
                "lowest_rad_s": self.lowest,
                "highest_rad_s": self.highest,
                "threshold_rad_s": self.threshold,
                "threshold_rpm": self.threshold and self.threshold * RPM,
                "mode": self.mode,
                "frequency_rad_s": self.frequency,
                "whirl_ratio": self.whirl_ratio,
                "direction": way,
                "smallest_log_decrement": self.margin,
                "warnings": self.warnings,
            }
        )

    def tables(self) -> tuple[Table, ...]:
        """One row, all but the warnings."""
        *row, _ = self.to_dict().items()
        return (Table("stability", tuple(Column(key, (value,), key=key) for key, value in row)),)

    def sentence(self) -> str:
        """Whether it is stable, or from which speed on which mode grows."""
        where = f"from {self.lowest:.6g} to {self.highest:.6g} rad/s"
        if self.status == "stable":
            return f"stable {where}; smallest logarithmic decrement {self.margin:z.4g}"
        text = f"unstable already at {self.lowest:.6g} rad/s, where the search began"
        if self.threshold is not None:
            text = f"stable up to {speed_text(self.threshold)}"
        if self.mode is None:
            return f"{text}; there the rotor runs away without oscillating"
        ratio = f", {self.whirl_ratio:.4g} × speed" if self.whirl_ratio else ""
        return (
            f"{text}; there mode {self.mode} grows, {self.to_dict()['direction']} whirl at "
            f"{self.frequency:.6g} rad/s{ratio}"
        )


def growth_bound(rotor: Rotor, speeds: FloatArray) -> FloatArray:
    """Frequency above which no mode grows at each speed, rad/s, shape (S,); 0: none grows, inf: not known."""
    bound = speeds * bool(rotor.material_damping.any() or internal_damping(rotor))
    for support in rotor.supports:
        k, c = support.table if support.constant else support.at(speeds)
        tiny, slack = (_SLACK * abs(one).max(axis=(1, 2)) for one in (k, c))
        stiffness, damping = (np.linalg.eigvalsh((one + one.swapaxes(1, 2)) / 2)[:, 0] for one in (k, c))
        driving = abs(k[:, 0, 1] - k[:, 1, 0]) / 2
        highest = np.where(driving > tiny, driving / np.maximum(damping, _NO_DAMPING), 0.0)
        bound = np.maximum(bound, np.where((stiffness < -tiny) | (damping < -slack), np.inf, highest))
    return bound


def grid_of(rotor: Rotor, speeds: FloatArray) -> FloatArray:
    """Speeds, ascending, and the knots of tables between them; over tables at least so many."""
    if rotor.constant:
        return speeds
    first, last = speeds[[0, -1]]
    knots = np.clip(rotor.knots, first, last)
    return np.unique(np.concatenate((speeds, knots, np.linspace(first, last, _PARTS + 1))))


def covering(whirl: Whirl) -> Whirl:
    """The whirl given, or one at the same speeds that has all modes that may grow."""
    P, speeds, n = whirl.Q.P, whirl.speeds, whirl.values.shape[1]
    bound, available = growth_bound(P.rotor, speeds), available_modes(P.rotor)
    while n < available:
        top = np.nan_to_num(abs(whirl.values.imag), nan=np.inf).max(axis=1)
        size, columns = whirl.Q.basis.shape
        if (bound < top).all() or (columns < size and top.min() > _TIMES * speeds[-1]):
            break
        n = min(2 * n, available)
        whirl = solve_whirl(P, speeds, n)
    return whirl


def fastest(whirl: Whirl) -> tuple[ComplexArray, FloatArray]:
    """Eigenvalue of the motion that grows fastest at each speed, and its growth, shape (S,) each.

    That of what does not oscillate by the scale.
    """
    rates = np.nan_to_num(whirl.values.real / abs(whirl.values), nan=-1.0)
    rows, k = np.arange(len(rates)), rates.argmax(axis=1)
    away = _BESIDE * (_largest_real(whirl) - AWAY)
    value = np.where(away > rates[rows, k], _largest_real(whirl) * whirl.scale, whirl.values[rows, k])
    return value, np.maximum(away, rates[rows, k])


def _largest_real(whirl: Whirl) -> FloatArray:
    """Largest eigenvalue of what does not oscillate at each speed, by the scale, shape (S,)."""
    return np.array([real.max(initial=-whirl.scale) for real in whirl.real]) / whirl.scale


def runs_away(whirl: Whirl) -> BoolArray:
    """At which speeds a motion grows without oscillating, shape (S,).

    Parameters
    ----------
    whirl
        Modes over speeds.

    Returns
    -------
    One truth value a speed.
    """
    return _largest_real(whirl) > AWAY


def near_level(values: FloatArray, level: float) -> IndexArray:
    """Steps beside values that are the nearest to a level, where one more such step would pass it."""
    gap = values - level
    side = np.where(gap > 0, 1.0, -1.0)[1:-1]
    before, after = side * (gap[:-2] - gap[1:-1]), side * (gap[2:] - gap[1:-1])
    near = (np.minimum(before, after) >= 0) & (np.maximum(before, after) > side * gap[1:-1])
    k = np.flatnonzero(near)
    return np.union1d(k, k + 1)


def _scan(whirl: Whirl) -> tuple[FloatArray, FloatArray]:
    """Speeds between which the largest growth does not pass its level unseen, and it there."""
    grid, rates = whirl.speeds, fastest(whirl)[1]
    for _ in range(_ROUNDS):
        k = near_level(rates, GROWTH)
        if not k.size:
            break
        more = (grid[k] + grid[k + 1]) / 2
        rates = np.insert(rates, k + 1, fastest(whirl.at(more))[1])
        grid = np.insert(grid, k + 1, more)
    return grid, rates


def roots(
    function: Callable[[FloatArray], FloatArray], ends: FloatArray, values: FloatArray
) -> tuple[FloatArray, FloatArray]:
    """Where functions vanish, each between two ends with values of unlike signs, and what they are there.

    By secants, with half of the value at an end that stays (Illinois); ends and values of shape (2, B).
    """
    (old, new), (f, g) = ends, values
    for _ in range(_SECANTS):
        last, new = new, (old * g - new * f) / (g - f)
        h = function(new)
        stays = (h < 0) == (g < 0)
        old, f, g = np.where(stays, old, last), np.where(stays, f / 2, g), h
        if (abs(new - last) <= _EXACT * new).all():
            break
    return new, g


def _edge(whirl: Whirl, ends: FloatArray, rates: FloatArray) -> tuple[float, bool, complex]:
    """Speed between a stable and an unstable one where growth begins or ends, and the eigenvalue there."""
    from scipy.optimize import brentq

    there = dict(zip(ends, rates - GROWTH, strict=True))  # not computed again, with another rounding
    speed = brentq(
        lambda speed: there.get(speed) or fastest(whirl.at(speed))[1].item() - GROWTH,
        *ends,
        xtol=1e-10 * ends[1],
        rtol=1e-15,
    )
    step = _BACK * (ends[rates.argmax()] - speed)
    value, other = fastest(whirl.at(speed, speed + step))[0]
    rise = (other - value).real
    back = step * value.real / rise if rise > 0 else 0.0
    return float(np.clip(speed - back, *ends)), True, value


def _mode(whirl: Whirl, speed: float, value: complex) -> tuple[int, float, float] | tuple[None, None, None]:
    """Number by frequency, whirl frequency and direction of a mode, as `Window` has them."""
    if not value.imag:
        return None, None, None
    pairs = whirl.at(speed)
    k = int(np.nanargmin(abs(pairs.values[0] - value)))
    lam, direction = whirling(whirl.Q, pairs.values[0], pairs.vectors[0])
    rank = lam.imag * (1 + _PAIR * direction)
    return int((rank <= rank[k]).sum()), float(lam[k].imag), float(direction[k])


def windows_of(whirl: Whirl) -> tuple[Window, ...]:
    """Ranges of speed in which a mode grows.

    Parameters
    ----------
    whirl
        Modes over the speeds, all those that may grow among them.

    Returns
    -------
    Windows in the order of their speeds, rad/s.
    """
    grid, rates = _scan(whirl)
    grows = rates > GROWTH
    if not grows.any():
        return ()
    edges = [_edge(whirl, grid[k : k + 2], rates[k : k + 2]) for k in np.flatnonzero(np.diff(grows))]
    if grows[0]:
        edges.insert(0, (float(grid[0]), False, fastest(whirl)[0][0]))
    if grows[-1]:
        edges.append((float(grid[-1]), False, NONE))
    return tuple(
        Window(first, last, begins, ends, *_mode(whirl, first, value))
        for (first, begins, value), (last, ends, _) in zip(edges[::2], edges[1::2], strict=True)
    )


def unstable_windows(whirl: Whirl, asked: FloatArray) -> tuple[Window, ...]:
    """Ranges of growth that hold one of the speeds asked for.

    Raises
    ------
    ValueError
        If negative stiffness, or too large cross-coupling, pushes the rotor aside at every speed.
    """
    if runs_away(whirl).all():
        raise ValueError(
            "the rotor on its supports is statically unstable at these speeds: a support has negative "
            "stiffness, or cross-coupling that exceeds its own; check signs and sizes"
        )
    return tuple(window for window in windows_of(covering(whirl)) if within((window,), asked).any())


def judge(rotor: Rotor, speeds: FloatArray) -> tuple[tuple[Window, ...], tuple[str, ...]]:
    """Ranges of speed without a steady response that hold one of the speeds asked for, and sentences on them.

    Parameters
    ----------
    rotor
        The rotor.
    speeds
        rad/s, in any order, shape (S,).

    Returns
    -------
    The ranges, and a sentence of each; or none, and why stability cannot be judged.

    Raises
    ------
    ValueError
        If negative stiffness, or too large cross-coupling, pushes the rotor aside at every speed.
    """
    asked = np.unique(speeds)
    try:
        grid = grid_of(rotor, asked if asked.size <= _GRID else np.linspace(asked[0], asked[-1], _GRID))
        if not growth_bound(rotor, grid).any():
            return (), ()
        whirl = covering(solve_whirl(both_planes(rotor), grid, checked_number(rotor, None)))
    except ValueError as problem:
        return (), (f"whether the rotor is stable at these speeds is not known: {problem}",)
    windows = unstable_windows(whirl, asked)
    return windows, tuple(window.sentence() for window in windows)


def stability_threshold(
    rotor: Rotor, highest: float, *, lowest: float = 0.0, n: int = 8, steps: int = 40
) -> Stability:
    """Find the first speed at which a mode of the rotor stops decaying.

    Every mode that may grow is judged.

    Parameters
    ----------
    rotor
        The rotor with all its supports.
    highest, lowest
        Range of speeds, rad/s.
    n
        How many modes of lowest frequency the margin is taken from.
    steps
        Into how many steps the range is divided at least; a mode that is unstable only in a narrow range
        between two neighbouring speeds may not be seen. The threshold itself is found by iteration.

    Raises
    ------
    ValueError
        For an impossible range, or outside the table of a support.
    """
    n = checked_number(rotor, min(n, available_modes(rotor)))
    speeds = grid_of(rotor, range_of_speeds(lowest, highest, steps))
    return threshold_of(covering(solve_whirl(both_planes(rotor), speeds, n)), n)


def range_of_speeds(lowest: float, highest: float, steps: int) -> FloatArray:
    """The speeds of a search for a threshold, rad/s, shape (steps + 1,).

    Parameters
    ----------
    lowest, highest
        rad/s.
    steps
        Into how many the range is divided.

    Returns
    -------
    rad/s, ascending, shape (steps + 1,).

    Raises
    ------
    ValueError
        For an impossible range.
    """
    if not -np.inf < lowest < highest < np.inf:
        raise ValueError(
            f"the range of speeds is empty: {lowest!r} to {highest!r} rad/s; give finite lowest < highest"
        )
    if int(steps) != steps or steps < 1:
        raise ValueError(f"the range is divided into at least one step; got {steps!r}")
    return checked_speeds(np.linspace(lowest, highest, int(steps) + 1))


def threshold_of(whirl: Whirl, n: int | None = None) -> Stability:
    """The first threshold in a whirl that has all modes that may grow; its margin is that of n of them.

    Parameters
    ----------
    whirl
        All modes that may grow, over ascending speeds.
    n
        How many modes of lowest frequency the margin is taken from; None: all.

    Returns
    -------
    The threshold, or that there is none.
    """
    speeds, windows = whirl.speeds, windows_of(whirl)
    first = windows[0] if windows else Window(np.inf, np.inf, False, False)
    lam = whirl.values[: max(1, int((speeds < first.first).sum())), :n]
    return Stability(
        "threshold" if first.begins else "unstable" if windows else "stable",
        float(speeds[0]),
        float(speeds[-1]),
        first.first if first.begins else None,
        first.mode,
        first.frequency,
        first.direction,
        float(np.fmin.reduce(decrements_of(lam), axis=None)),
        whirl.Q.P.rotor,
    )
