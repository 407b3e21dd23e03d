"""Campbell diagram: whirl frequencies and decrements over speed, and the damped critical speeds."""

from __future__ import annotations

from dataclasses import dataclass
from itertools import pairwise
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import ArrayLike

from fem.growth import Growing, growing, joined
from fem.growth_check import growth_bound, judge
from fem.matrices.lateral_planes import both_planes
from fem.model.rotor import Rotor, whole
from fem.model.supports import ROUNDED
from fem.orbits import DIRECTION_NAMES, whirl_direction
from fem.solvers.crossing import crossings, off_synchronous, turns
from fem.solvers.quadratic import Solutions
from fem.solvers.reduced_whirl import Whirl, solve_whirl, with_speeds
from fem.solvers.stable_speeds import GROWTH
from fem.solvers.tracking import Followed, follow
from fem.whirl import available_modes, checked_number, checked_speeds, in_both_planes
from fem.windows import Window, within
from rotorid.base.arrays import BoolArray, ComplexArray, FloatArray, IndexArray
from rotorid.base.json import floats
from rotorid.base.text import counted
from rotorid.base.units import RPM, rpm_text

if TYPE_CHECKING:
    import pandas as pd

HEAVY = 1.28  # log decrement at an amplification factor of 2.5: critically damped after API 684
_ROUNDS = 8  # of looking for crossings between the speeds
_PARTS = 20  # into which a range over tables is divided at least
_SWINGS = 0.4  # |Im λ| / |λ| below which a mode hardly oscillates: log decrement above 14
_NARROW = 1e-3  # of a speed: steps that are not divided for a mode that ceases to oscillate
_NAMED = 5  # critical speeds that a warning names
_SPARE = 2  # modes above those asked for, which may come down; more are taken where a mode is lost
_MOST = 3  # modes computed for each one asked for, at most
_REACH = 0.5  # part of the highest frequency computed above which a mode that vanished may have gone on
_PAIR = 1e-6  # relative distance of forward and backward whirl that start together, as at rest


@dataclass(frozen=True, eq=False)
class Campbell:
    """Whirl over speed; each column is one mode, followed through crossings.

    Attributes
    ----------
    speeds
        rad/s, shape (S,).
    frequencies
        |Im λ|, rad/s, shape (S, n); NaN where a mode does not oscillate.
    log_decrements
        −2π Re λ / |Im λ|, shape (S, n); negative: unstable.
    direction
        1 forward, −1 backward, 0 neither (a line, or different along the rotor), shape (S, n).
    critical_speeds
        Damped critical speeds, where a frequency equals the speed, rad/s, ascending, shape (c,); not those of
        motions that hardly oscillate (log decrement above 14).
    critical_modes
        Which column (from 1) each belongs to, shape (c,).
    critical_log_decrements, critical_direction
        There, shape (c,).
    error
        Estimated relative error of the eigenvalues.
    rotor
        The rotor.
    warnings
        What the reader must know.
    unstable
        Modes that grow at some of the speeds, and from which speed on, by that speed.
    windows
        Ranges of speed in which any mode grows, listed or not.
    cut
        What the list of critical speeds leaves out because only n modes were asked for; else empty.
    """

    speeds: FloatArray
    frequencies: FloatArray
    log_decrements: FloatArray
    direction: FloatArray
    critical_speeds: FloatArray
    critical_modes: IndexArray
    critical_log_decrements: FloatArray
    critical_direction: FloatArray
    error: float
    rotor: Rotor
    warnings: tuple[str, ...] = ()
    unstable: tuple[Growing, ...] = ()
    windows: tuple[Window, ...] = ()
    cut: str = ""

    @property
    def eigenvalues(self) -> ComplexArray:
        """λ with Im λ > 0, rad/s, shape (S, n)."""
        return np.asarray(self.frequencies * (1j - self.log_decrements / (2 * np.pi)))

    @property
    def criticals(self) -> list[tuple[float, float]]:
        """Damped critical speed, rad/s, and logarithmic decrement there, of each."""
        return list(zip(self.critical_speeds.tolist(), self.critical_log_decrements.tolist(), strict=True))

    def to_dict(self) -> dict[str, Any]:
        """Plain data for JSON, keys as in INTERFACE.md, `rotorid campbell`; one list per mode."""
        return {
            "speeds_rad_s": self.speeds.tolist(),
            "frequencies_rad_s": [floats(row) for row in self.frequencies.T],
            "log_decrements": [floats(row) for row in self.log_decrements.T],
            "direction": [
                [
                    DIRECTION_NAMES[float(d)] if np.isfinite(w) else None
                    for d, w in zip(way, omega, strict=True)
                ]
                for way, omega in zip(self.direction.T, self.frequencies.T, strict=True)
            ],
            "damped_critical_speeds_rad_s": self.critical_speeds.tolist(),
            "damped_critical_speeds": [
                {
                    "speed_rad_s": float(speed),
                    "speed_rpm": float(speed * RPM),
                    "mode": int(mode),
                    "log_decrement": float(delta),
                    "direction": DIRECTION_NAMES[float(way)],
                    "heavily_damped": bool(delta > HEAVY),
                }
                for speed, mode, delta, way in self._criticals()
            ],
            "damped_critical_speeds_cut": self.cut or None,
            "unstable": [mode.to_dict() for mode in self.unstable],
            "unstable_speeds": [window.to_dict() for window in self.windows],
            "warnings": list(self.warnings),
        }

    def to_frame(self) -> pd.DataFrame:
        """One row per speed and mode."""
        import pandas as pd

        S, n = self.frequencies.shape
        there = np.isfinite(self.frequencies.ravel())
        names = [
            DIRECTION_NAMES[float(d)] if found else None
            for d, found in zip(self.direction.ravel(), there, strict=True)
        ]
        return pd.DataFrame(
            {
                "speed_rad_s": np.repeat(self.speeds, n),
                "mode": np.tile(np.arange(1, n + 1), S),
                "frequency_rad_s": self.frequencies.ravel(),
                "log_decrement": self.log_decrements.ravel(),
                "direction": names,
            }
        )

    def summary(self) -> str:
        """Frequencies at both ends of the range and the damped critical speeds as text."""
        first, last = self.speeds[0], self.speeds[-1]
        lines = [
            f"Whirl from {first:.6g} to {last:.6g} rad/s ({first * RPM:.6g} to {rpm_text(last)})",
            "mode    at first, rad/s   log dec    at last, rad/s   log dec",
        ]
        for k in range(self.frequencies.shape[1]):
            parts = [f"{k + 1:4d}"]
            for s in (0, -1):
                omega, delta = self.frequencies[s, k], self.log_decrements[s, k]
                text = f"{omega:16.4f} {_LETTERS[float(self.direction[s, k])]}{_rounded(delta):10.4f}"
                parts.append(text if np.isfinite(omega) else f"{'none':>18}{'':10}")
            lines.append("".join(parts))
        heavy = self.critical_log_decrements > HEAVY
        for title, which in (
            ("damped critical speeds", ~heavy),
            (f"heavily damped, without a peak (log decrement above {HEAVY})", heavy),
        ):
            if which.any():
                lines += [title, "mode     rad/s         rpm   log dec  direction"]
            for (speed, mode, delta, way), here in zip(self._criticals(), which, strict=True):
                if here:
                    lines.append(
                        f"{mode:4d}{speed:12.4f}{speed * RPM:12.2f}{_rounded(delta):10.4f}  "
                        f"{DIRECTION_NAMES[float(way)]}"
                    )
        if not self.critical_speeds.size:
            lines.append("no damped critical speed in this range")
        if self.cut:
            lines.append(self.cut)
        return "\n".join([*lines, *(f"Warning: {text}" for text in self.warnings)])

    def _criticals(self) -> list[tuple[float, int, float, float]]:
        return list(
            zip(
                self.critical_speeds.tolist(),
                self.critical_modes.tolist(),
                self.critical_log_decrements.tolist(),
                self.critical_direction.tolist(),
                strict=True,
            )
        )


_LETTERS = {1.0: "F", -1.0: "B", 0.0: "-"}


def campbell(rotor: Rotor, speeds: ArrayLike, n: int | None = None) -> Campbell:
    """Compute whirl frequencies, logarithmic decrements and directions over speed.

    Modes are followed from speed to speed by the likeness of their complex shapes (MAC), with smaller steps
    between the given speeds where it leaves a doubt; on rotationally symmetric supports forward and backward
    whirl are kept apart exactly. The n modes are those that meet the 1× line first, then those that are most
    often among the n of lowest frequency; they are numbered by frequency at the first speed, backward before
    forward where a pair coincides. Where a curve crosses the 1× line between two speeds, the crossing is
    found by iteration on the model.

    Parameters
    ----------
    rotor
        The rotor with all its supports.
    speeds
        rad/s, ascending, shape (S,).
    n
        How many modes, by default 6; forward and backward whirl count apart. Where the model has fewer, all.

    Raises
    ------
    ValueError
        If speeds are impossible or outside the table of a support, the mesh is too fine for float64, or the
        rotor is pushed aside by negative stiffness at every speed.
    """
    speeds = checked_speeds(speeds)
    available = available_modes(rotor)
    said_of_number: tuple[str, ...] = ()
    if n is not None and whole(n, "the number of modes") > available:
        said_of_number, n = (f"the model has only {available} of {n} modes",), available
    n = checked_number(rotor, n)
    whirl, paths, columns = _followed_closely(rotor, speeds, n)
    asked = np.searchsorted(whirl.speeds, speeds)
    if not columns.size:
        raise ValueError("the rotor has no oscillating mode at these speeds: all motions are overdamped")
    values, X = paths.values[:, columns], paths.vectors[:, columns]
    if all(runs_away(whirl)):
        raise ValueError(
            "the rotor on its supports is statically unstable at these speeds: a support has negative "
            "stiffness; check its sign and size"
        )
    lam, x, y = in_both_planes(values[asked], whirl.Q.nodes(X[asked]))
    gone = ~np.isfinite(lam)
    direction = np.where(gone, 0.0, whirl_direction(np.nan_to_num(x), np.nan_to_num(y)))
    frequencies = np.where(gone, np.nan, lam.imag)
    log_decrements = -2 * np.pi * lam.real / frequencies
    met = crossings(whirl, values, X, off_synchronous)
    met = met.only(_swings(met.values))
    at, cx, cy = in_both_planes(met.values, met.shapes)
    unstable = growing(whirl, values, X)
    windows, said = _windows(whirl, asked, values, unstable) or judge(rotor, speeds)
    shown = np.zeros(speeds.size, dtype=bool)
    for mode in unstable:
        shown |= (speeds >= mode.speed) & (speeds <= mode.last)
    hidden = [
        text if window.mode is None else f"{text} (a mode that is not listed: ask for more)"
        for window, text in zip(windows, said, strict=False)
        if window.mode is None or (within((window,), speeds) & ~shown).any()
    ]
    hidden += said[len(windows) :]
    for array in (frequencies, log_decrements, direction, met.speeds):
        array.flags.writeable = False
    return Campbell(
        speeds=speeds,
        frequencies=frequencies,
        log_decrements=log_decrements,
        direction=direction,
        critical_speeds=met.speeds,
        critical_modes=met.modes + 1,
        critical_log_decrements=-2 * np.pi * at.real / at.imag,
        critical_direction=whirl_direction(cx, cy),
        error=whirl.error,
        rotor=rotor,
        warnings=(
            *(mode.said() for mode in unstable),
            *hidden,
            *_warnings(whirl, paths, columns, n, asked),
            *said_of_number,
        ),
        unstable=unstable,
        windows=windows,
        cut=_cut(whirl, paths, columns),
    )


def _windows(
    whirl: Whirl, asked: IndexArray, values: ComplexArray, listed: tuple[Growing, ...]
) -> tuple[tuple[Window, ...], tuple[str, ...]] | None:
    """As `judge`, where every mode that may grow is known and those that do are listed; else None."""
    found = whirl.found.values[asked]
    numbers = [
        np.count_nonzero(np.nan_to_num(lam.real / np.abs(lam), nan=-1.0) > GROWTH, axis=1)
        for lam in (found, values[asked])
    ]
    known = np.nanmax(np.abs(found.imag), axis=1, initial=0.0)
    bound = growth_bound(whirl.Q.P.rotor, whirl.speeds[asked])
    if (bound > known).any() or (numbers[0] > numbers[1]).any() or any(runs_away(whirl)):
        return None
    windows = joined(listed, whirl.speeds[asked])
    return windows, tuple(window.said() for window in windows)


def _followed_closely(rotor: Rotor, speeds: FloatArray, n: int) -> tuple[Whirl, Followed, IndexArray]:
    """`followed`, over tables with so many speeds between that no two crossings of the 1× line are hidden."""
    knots = rotor.knots[(rotor.knots > speeds[0]) & (rotor.knots < speeds[-1])]
    grid = _with(speeds, knots)
    if not rotor.constant:
        longest = (speeds[-1] - speeds[0]) / _PARTS
        grid = np.unique(
            np.concatenate(
                [np.linspace(a, b, int(np.ceil((b - a) / longest)) + 1) for a, b in pairwise(grid)] or [grid]
            )
        )
    whirl, paths, columns, known = followed(rotor, grid, n)
    extra = grid
    for _ in range(0 if rotor.constant else _ROUNDS):
        new = np.isin(whirl.speeds, extra)
        extra = np.union1d(
            turns(whirl, paths.values, paths.vectors, off_synchronous, new[:-1] | new[1:]),
            _unclear(whirl, paths),
        )
        if not extra.size:
            break
        whirl = with_speeds(whirl, extra)
        paths = follow(whirl, known)
        columns = asked_for(paths, whirl.speeds, n)
    return whirl, paths, columns


def _with(speeds: FloatArray, more: FloatArray) -> FloatArray:
    """Speeds with those of others that differ by more than rounding."""
    apart = np.abs(more[:, None] - speeds).min(axis=1, initial=np.inf) > ROUNDED * speeds[-1]
    return np.union1d(speeds, more[apart])


def _unclear(whirl: Whirl, paths: Followed) -> FloatArray:
    """Middles of intervals in which modes cross the 1× line both ways: they may have been exchanged.

    And of those in which a mode above it begins or ceases to oscillate, which crosses it there.
    """
    speeds, f = whirl.speeds, off_synchronous(paths.values, whirl.speeds[:, None])
    gone = np.isnan(f) & ~went_above(whirl, paths, np.arange(f.shape[1]))
    ends = (gone[1:] & (f[:-1] > 0)) | (gone[:-1] & (f[1:] > 0))
    up, down = (f[:-1] < 0) & (f[1:] > 0), (f[:-1] > 0) & (f[1:] < 0)
    unclear = ends.any(axis=1) | (up.any(axis=1) & down.any(axis=1))
    unclear &= np.diff(speeds) > _NARROW * speeds[1:]
    return np.asarray(((speeds[:-1] + speeds[1:]) / 2)[unclear])


def _swings(values: ComplexArray) -> BoolArray:
    """Which modes oscillate so that a critical speed has a meaning: damping ratio below 0.92."""
    return np.asarray(np.abs(values.imag) > _SWINGS * np.abs(values))


def _cut(whirl: Whirl, paths: Followed, columns: IndexArray) -> str:
    """What to say where modes that are not listed have critical speeds in the range."""
    others = np.delete(paths.values, columns, axis=1)
    f, swings = off_synchronous(others, whirl.speeds[:, None]), _swings(others)
    k, _ = np.nonzero((f[:-1] * f[1:] < 0) & (swings[:-1] | swings[1:]))
    if k.size:
        near = ", ".join(f"{speed:.6g}" for speed in np.unique(whirl.speeds[k])[:_NAMED])
        return (
            f"the list of critical speeds is cut: modes that are not listed have {k.size} more in this "
            f"range, just above {near} rad/s; ask for more modes (-n)"
        )
    sizes = np.abs(whirl.found.values[-1].imag)
    top, last = float(np.nan_to_num(sizes).max(initial=0.0)), float(whirl.speeds[-1])
    if np.isfinite(sizes).all() and top < last and sizes.size < available_modes(whirl.Q.P.rotor):
        return (
            f"the list of critical speeds may be cut: the modes followed reach {top:.6g} rad/s only at "
            f"{last:.6g} rad/s; ask for more modes (-n)"
        )
    return ""


def followed(
    rotor: Rotor, speeds: FloatArray, n: int
) -> tuple[Whirl, Followed, IndexArray, dict[float, Solutions]]:
    """Modes over speed, which n (or fewer) of them were asked for, and solutions between the speeds."""
    P = both_planes(rotor)
    available = available_modes(rotor)
    m = min(n + n % 2 + _SPARE, available)  # even: modes come in pairs, a forward and a backward one
    best, missing = None, np.inf
    while True:
        whirl = solve_whirl(P, speeds, m)
        known: dict[float, Solutions] = {}
        paths = follow(whirl, known)
        columns = asked_for(paths, speeds, n)
        above = int(went_above(whirl, paths, columns).sum())
        # A mode that went on above those computed needs more of them, an overdamped one is not found so.
        if best is None or above < missing:
            best, missing = (whirl, paths, columns, known), above
        else:
            return best
        if not above or m >= min(_MOST * n + 16, available):
            return best
        m = min(m + max(4, n), available)


def went_above(whirl: Whirl, paths: Followed, columns: IndexArray) -> BoolArray:
    """Where a mode is missing that may lie above those that were computed, shape (S, n).

    Elsewhere a missing mode does not oscillate: all that do are known, or all of its frequencies.
    """
    size = np.abs(paths.values[:, columns].imag)
    gone: BoolArray = np.isnan(size)
    full = np.asarray(np.isfinite(whirl.found.values).all(axis=1))
    top = np.abs(np.nan_to_num(whirl.found.values).imag).max(axis=1)
    near = np.zeros(size.shape)
    for k in range(len(columns)):
        known = np.flatnonzero(~gone[:, k])
        if known.size:
            nearest = np.abs(np.arange(len(size))[:, None] - known).argmin(axis=1)
            near[:, k] = size[known[nearest], k]
    return np.asarray(gone & full[:, None] & (near > _REACH * top[:, None]))


def asked_for(paths: Followed, speeds: FloatArray, n: int) -> IndexArray:
    """The n lowest modes, by frequency at the first speed, backward first where a pair starts as one.

    Lowest are those that meet the 1× line first (or are below it from the start), so that no damped critical
    speed is left out below that of another; then those that are most often among the n of lowest frequency.
    Modes that grow go before all others, heavily damped ones that oscillate at few speeds come last.
    """
    values = paths.values
    there = np.isfinite(values)
    size = np.where(there, np.abs(values.imag), np.inf)
    S, count = size.shape
    lowest = np.argsort(size, axis=1, kind="stable")[:, :n]
    low: BoolArray = np.zeros(size.shape, dtype=bool)
    np.put_along_axis(low, lowest, True, axis=1)
    low &= there
    begins = np.asarray(there.argmax(axis=0))
    start = values[begins, np.arange(count)]
    grows = ((np.nan_to_num(values.real / np.abs(values)) > GROWTH) & low).any(axis=0)
    swings = _swings(values)
    seldom = swings.sum(axis=0) < S / 2
    meets = np.array([_meets(size[swings[:, c], c], speeds[swings[:, c]]) for c in range(count)])
    order = np.lexsort((_paired(start, begins), -low.sum(axis=0), meets, seldom, ~grows))
    best = [c for c in order if low[:, c].any() or np.isfinite(meets[c])][:n]
    rank = _paired(start, begins)
    return np.array(sorted(best, key=lambda c: rank[c]), dtype=np.intp)


def _meets(size: FloatArray, speeds: FloatArray) -> float:
    """Frequency at which a mode is synchronous, or at its first speed if it is below that; else infinite."""
    below = np.flatnonzero(size <= speeds)
    if not below.size:
        return np.inf
    k = int(below[0])
    if k == 0:
        return float(size[0])
    before, after = size[k - 1] - speeds[k - 1], speeds[k] - size[k]
    return float(speeds[k - 1] + (speeds[k] - speeds[k - 1]) * before / (before + after))


def _paired(start: ComplexArray, begins: IndexArray) -> IndexArray:
    """Rank by where a mode begins and its frequency there; of two that coincide the backward one first.

    In a complex coordinate Im λ < 0 is backward whirl.
    """
    out: list[int] = []
    for c in np.lexsort((np.abs(start.imag), begins)).tolist():
        before = start[out[-1]].imag if out and begins[out[-1]] == begins[c] else -1.0
        if start[c].imag < 0 < before and -start[c].imag - before <= _PAIR * before:
            out.insert(-1, c)
        else:
            out.append(c)
    rank = np.empty(len(out), dtype=np.intp)
    rank[out] = np.arange(len(out))
    return rank


def runs_away(whirl: Whirl) -> list[bool]:
    """At which speeds a motion grows without oscillating, length S."""
    return [bool(real.size) and bool(real.max() > 1e-6 * whirl.scale) for real in whirl.found.real]


def _warnings(
    whirl: Whirl, paths: Followed, columns: IndexArray, n: int, asked: IndexArray
) -> tuple[str, ...]:
    texts = []
    values, speeds = paths.values[asked][:, columns], whirl.speeds[asked]
    gone = ~np.isfinite(values)
    above = went_above(whirl, paths, columns)[asked]
    for text, cells in (
        ("does not oscillate (overdamped)", gone & ~above),
        ("was not found (overdamped, or above the frequencies computed)", above),
    ):
        for k in np.flatnonzero(cells.any(axis=0)):
            where = speeds[cells[:, k]]
            texts.append(
                f"mode {k + 1} {text} at {where.size} of {counted(speeds.size, 'speed')}, "
                f"from {where[0]:.6g} to {where[-1]:.6g} rad/s"
            )
    if columns.size < n:
        texts.append(f"only {columns.size} of {n} modes oscillate, the others are overdamped")
    rigid = whirl.found.still // 2
    if rigid.any():
        texts.append("rigid-body motions that nothing holds (eigenvalue 0) are left out")
    doubtful = sorted({k for k, mode in paths.doubtful if mode in columns})
    if doubtful:
        places = ", ".join(f"{whirl.speeds[k]:.6g}" for k in doubtful[:5])
        texts.append(
            f"modes could not be told apart by shape just above {places} rad/s: from there on two curves "
            "may be exchanged"
        )
    return tuple(texts)


def _rounded(delta: float) -> float:
    """To the four digits that are printed, without a negative zero."""
    return round(float(delta), 4) + 0.0
