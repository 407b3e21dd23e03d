"""Which modes a Campbell diagram shows: followed over speed, so many as asked for, with speeds between.

Over bearing tables two crossings of the 1× line may lie between two speeds: there speeds are added.
"""

from __future__ import annotations

from itertools import pairwise

import numpy as np

from fem.matrices.lateral_planes import both_planes
from fem.model.rotor import Rotor
from fem.model.supports import ROUNDED
from fem.solvers.crossing import off_synchronous, turns
from fem.solvers.mode_tracking import Followed, follow
from fem.solvers.quadratic_eigenvalues import Solutions
from fem.solvers.reduced_whirl import Whirl, solve_whirl, with_speeds
from fem.solvers.stable_speeds import GROWTH
from fem.whirl import available_modes
from rotorid.base.arrays import BoolArray, ComplexArray, FloatArray, IndexArray

_ROUNDS = 8  # of looking for crossings between the speeds
_PARTS = 20  # into which a range over tables is divided at least
_SWINGS = 0.4  # |Im λ| / |λ| below which a mode hardly oscillates: log decrement above 14
_NARROW = 1e-3  # of a speed: steps that are not divided for a mode that ceases to oscillate
_SPARE = 2  # modes above those asked for, which may come down; more are taken where a mode is lost
_MOST = 3  # modes computed for each one asked for, at most
_REACH = 0.5  # part of the highest frequency computed above which a mode that vanished may have gone on
_PAIR = 1e-6  # relative distance of forward and backward whirl that start together, as at rest


def followed_closely(rotor: Rotor, speeds: FloatArray, n: int) -> tuple[Whirl, Followed, IndexArray]:
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
    oscillates = swings(values)
    seldom = oscillates.sum(axis=0) < S / 2
    meets = np.array([_meets(size[oscillates[:, c], c], speeds[oscillates[:, c]]) for c in range(count)])
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


def swings(values: ComplexArray) -> BoolArray:
    """Which modes oscillate so that a critical speed has a meaning: damping ratio below 0.92."""
    return np.asarray(np.abs(values.imag) > _SWINGS * np.abs(values))


def runs_away(whirl: Whirl) -> list[bool]:
    """At which speeds a motion grows without oscillating, length S."""
    return [bool(real.size) and bool(real.max() > 1e-6 * whirl.scale) for real in whirl.found.real]
