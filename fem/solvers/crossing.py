"""Where a mode does something at a speed: crosses the 1× line, or loses stability. Refined on the model.

Each root is sought on its own mode first, by inverse iteration from the last pair. Near a veering that may
slip to another mode: a root counts only if the function vanishes there and the shape is that of the mode at
both ends of the bracket, beyond doubt. All others are sought once more on what does not depend on which mode
is which: the values of the function of all modes, sorted. Each rank is continuous in speed, whatever curve
it runs along, and its roots are those of the modes.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from fem.matrices.lateral_planes import Quadratic
from fem.solvers.quadratic import polish, solve
from fem.solvers.reduced_whirl import Whirl, enriched
from fem.solvers.tracking import likeness, mass_weight, plain
from rotorid.base.arrays import BoolArray, ComplexArray, FloatArray, IndexArray

_CONVERGED = 1e-13
_STEPS = 60
_VANISHES = 1e-6  # |f| at a root, of its size at the ends
_JUMP = 1e-4  # the same of a rank: more is a mode that came or went
_NOTHING = 1e-11  # of the largest |f|: rounding
_FALL = 3.0  # times the width of an interval: more a function does not fall within it, if it is not steep
_STEEP = 20.0  # the same for the steepest
_SLOPE = 1e-4  # of an interval: step for a slope
_PARTS = 8  # into how many parts a doubtful bracket is divided
_SAME = 0.9  # MAC of a mode before and after the last digits
Function = Callable[[ComplexArray, FloatArray], FloatArray]


@dataclass(frozen=True, eq=False)
class Crossings:
    """Roots over speed, ascending.

    Attributes
    ----------
    speeds
        rad/s, shape (c,).
    modes
        Column of each, from 0, shape (c,).
    values
        Eigenvalue there, shape (c,).
    shapes
        Deflections of all nodes, shape (c, planes, N).
    """

    speeds: FloatArray
    modes: IndexArray
    values: ComplexArray
    shapes: ComplexArray

    def only(self, which: BoolArray | IndexArray) -> Crossings:
        """Some of them."""
        return Crossings(self.speeds[which], self.modes[which], self.values[which], self.shapes[which])


def synchronous(whirl: Whirl, values: ComplexArray, vectors: ComplexArray) -> Crossings:
    """Speeds that equal the whirl frequency of a mode."""
    return crossings(whirl, values, vectors, off_synchronous)


def off_synchronous(lam: ComplexArray, speed: FloatArray) -> FloatArray:
    """Whirl frequency less the speed."""
    return np.asarray(np.abs(lam.imag) - speed)


def crossings(whirl: Whirl, values: ComplexArray, vectors: ComplexArray, function: Function) -> Crossings:
    """Roots of a function of eigenvalue and speed on each mode, shapes (S, n) and (S, n, R)."""
    speeds, Q = whirl.speeds, whirl.Q
    f = function(values, speeds[:, None])
    change = (f[:-1] * f[1:] < 0) | ((f[1:] == 0) & (f[:-1] != 0))
    change[:1] |= f[:1][:, :] == 0 if len(change) else False
    k, mode = np.nonzero(change)
    part = f[k, mode] / (f[k, mode] - f[k + 1, mode])
    near = np.where(part < 0.5, k, k + 1)
    start = values[k, mode] + part * (values[k + 1, mode] - values[k, mode])
    ends = np.stack((speeds[k], speeds[k + 1]))
    found, lam, X = _roots(
        Q, ends, np.stack((f[k, mode], f[k + 1, mode])), start, vectors[near, mode], function
    )
    if k.size:
        size = np.maximum(np.abs(f[k, mode]), np.abs(f[k + 1, mode]))
        sure = _verified(whirl, k, (values, vectors, mode), (found, lam, X), function, size)
        if not sure.all():
            keep = _by_rank(whirl, k, mode, (values, vectors), (found, lam, X), ~sure, function)
            k, mode, ends, size = k[keep], mode[keep], ends[:, keep], size[keep]
            found, lam, X = found[keep], lam[keep], X[keep]
    if k.size:
        # The same once more in a basis that holds the full model's vectors there.
        Q, X = enriched(whirl, found, lam, X)
        slack = 1e-6 * (ends[1] - ends[0])
        tight = np.clip(np.stack((found - slack, found + slack)), ends[0], ends[1])
        better, value, Y = _secant(Q, found, tight, lam, X, function)
        mac = np.abs(np.einsum("br,br->b", X.conj(), Y)) / np.linalg.norm(X, axis=1)
        good = (better >= ends[0] - slack) & (better <= ends[1] + slack) & (mac**2 > _SAME)
        good &= np.abs(function(value, better)) <= _VANISHES * size
        # At an end of a table there is nothing beyond.
        better = np.clip(better, ends[0], ends[1])
        found, lam = np.where(good, better, found), np.where(good, value, lam)
        X = np.where(good[:, None], Y, X)
    order = np.argsort(found, kind="stable")
    return Crossings(found[order], mode[order], lam[order], Q.nodes(X[order]))


def turns(
    whirl: Whirl, values: ComplexArray, vectors: ComplexArray, function: Function, among: BoolArray
) -> FloatArray:
    """Speeds between those given near which a function of a mode turns towards zero, ascending.

    There it may vanish twice without a change of sign: by its slopes at both ends, of a step of the model.
    Only intervals count over which it may fall so far, by the width or by a slope, and only those `among`
    which it is sought, shape (S − 1,).
    """
    speeds, Q = whirl.speeds, whirl.Q
    f = function(values, speeds[:, None])
    width = np.diff(speeds)[:, None]
    near = np.minimum(np.abs(f[:-1]), np.abs(f[1:])) < _STEEP * width
    k, mode = np.nonzero((f[:-1] * f[1:] > 0) & near & among[:, None])
    sign, h = np.sign(f[k, mode]), width[k, 0]
    slopes = []
    for end, way in ((k, 1), (k + 1, -1)):
        step = way * _SLOPE * h
        beside = speeds[end] + step
        lam, _, _ = polish(Q, beside, np.arange(k.size), values[end, mode], vectors[end, mode], 2)
        slopes.append(sign * (function(lam, beside) - f[end, mode]) / step)
    first, last = slopes
    before, after = np.abs(f[k, mode]), np.abs(f[k + 1, mode])
    reach = np.maximum(
        _FALL * h - np.minimum(before, after), -np.minimum(before + first * h, after - last * h)
    )
    turn = (first < 0) & (last > 0) & (reach > 0)
    part = first[turn] / (first - last)[turn]  # of a parabola
    return np.unique(speeds[k][turn] + np.clip(part, 0.1, 0.9) * h[turn])


def _verified(
    whirl: Whirl,
    k: IndexArray,
    modes: tuple[ComplexArray, ComplexArray, IndexArray],
    roots: tuple[FloatArray, ComplexArray, ComplexArray],
    function: Function,
    size: FloatArray,
) -> BoolArray:
    """Which roots in the intervals k surely are those of the modes they were sought for, shape (c,)."""
    values, vectors, mode = modes
    found, lam, X = roots
    sure = np.isfinite(found) & np.isfinite(lam)
    sure &= (found >= whirl.speeds[k]) & (found <= whirl.speeds[k + 1])
    sure &= np.abs(function(lam, found)) <= _VANISHES * size
    weight, apart = mass_weight(whirl), whirl.Q.P.planes == 1
    for end in (k, k + 1):
        others = whirl.found.values[end]
        mac = likeness(lam[:, None], X[:, None], others, whirl.found.vectors[end], weight, apart)[:, 0]
        mine = values[end, mode][:, None], vectors[end, mode][:, None]
        own = likeness(lam[:, None], X[:, None], *mine, weight, apart)[:, 0, 0]
        rivals = np.where(others == mine[0], 0.0, mac).max(axis=1)
        sure &= plain(own, rivals)
    return np.asarray(sure)


def _by_rank(
    whirl: Whirl,
    k: IndexArray,
    mode: IndexArray,
    modes: tuple[ComplexArray, ComplexArray],
    roots: tuple[FloatArray, ComplexArray, ComplexArray],
    doubtful: BoolArray,
    function: Function,
) -> BoolArray:
    """Put the roots of ranks in place of doubtful ones, and tell which roots there are, shape (c,).

    Two modes that were exchanged between two speeds seem to cross in opposite directions: there is no root.
    """
    values, vectors = modes
    found, lam, X = roots
    keep = np.ones(k.size, dtype=bool)
    weight, apart = mass_weight(whirl), whirl.Q.P.planes == 1
    for interval in np.unique(k[doubtful]):
        mine = np.flatnonzero(k == interval)
        keep[mine] = False
        speeds, new, Y = _ranked(
            whirl, float(whirl.speeds[interval]), float(whirl.speeds[interval + 1]), function
        )
        if not speeds.size:
            continue
        alike = np.zeros((mine.size, speeds.size))
        for end in (interval, interval + 1):
            alike += likeness(values[end, mode[mine]], vectors[end, mode[mine]], new, Y, weight, apart)
        for _ in range(min(alike.shape)):
            i, j = np.unravel_index(int(np.argmax(alike)), alike.shape)
            if alike[i, j] <= 0:
                break
            keep[mine[i]] = True
            found[mine[i]], lam[mine[i]], X[mine[i]] = speeds[j], new[j], Y[j]
            alike[i], alike[:, j] = -1.0, -1.0
    return keep


def _ranked(
    whirl: Whirl, a: float, b: float, function: Function
) -> tuple[FloatArray, ComplexArray, ComplexArray]:
    """Roots of all modes in an interval, by the ranks of the function: speeds, eigenvalues and vectors."""
    from scipy.optimize import brentq

    Q, m = whirl.Q, whirl.found.values.shape[1]

    def at(speeds: FloatArray) -> tuple[FloatArray, ComplexArray, ComplexArray]:
        pairs = solve(Q, speeds, m, whirl.scale)
        there = np.isfinite(pairs.values)
        f = np.where(there, function(np.where(there, pairs.values, 1j), speeds[:, None]), np.inf)
        order = np.argsort(f, axis=1, kind="stable")
        return (
            np.take_along_axis(f, order, axis=1),
            np.take_along_axis(pairs.values, order, axis=1),
            np.take_along_axis(pairs.vectors, order[:, :, None], axis=1),
        )

    speeds = np.linspace(a, b, _PARTS + 1)
    f, _, _ = at(speeds)
    known = np.isfinite(f)
    least = _NOTHING * np.abs(f[known]).max(initial=0.0)
    change = ((f[:-1] < 0) != (f[1:] < 0)) & known[:-1] & known[1:]
    change &= np.maximum(np.abs(f[:-1]), np.abs(f[1:])) > least
    out: list[tuple[float, complex, ComplexArray]] = []
    for part, rank in zip(*np.nonzero(change), strict=True):

        def ranked(speed: float, rank: int = int(rank)) -> float:
            return float(min(at(np.array([speed]))[0][0, rank], 1e300))

        low, high = float(speeds[part]), float(speeds[part + 1])
        if f[part, rank] == 0 or f[part + 1, rank] == 0:
            speed = low if f[part, rank] == 0 else high
        elif (ranked(low) < 0) == (ranked(high) < 0):
            continue
        else:
            speed = float(brentq(ranked, low, high, xtol=1e-13 * b, rtol=1e-14))
        here, lam, X = at(np.array([speed]))
        if abs(here[0, rank]) <= _JUMP * max(abs(f[part, rank]), abs(f[part + 1, rank])):
            out.append((speed, complex(lam[0, rank]), X[0, rank]))
    if not out:
        return np.empty(0), np.empty(0, dtype=complex), np.empty((0, Q.size), dtype=complex)
    return np.array([o[0] for o in out]), np.array([o[1] for o in out]), np.stack([o[2] for o in out])


def _roots(
    Q: Quadratic, ends: FloatArray, f: FloatArray, lam: ComplexArray, X: ComplexArray, function: Function
) -> tuple[FloatArray, ComplexArray, ComplexArray]:
    """Bracketed roots, all at once, by regula falsi after Anderson and Björck."""
    (a, b), (fa, fb) = ends.copy(), f.copy()
    root = (a * fb - b * fa) / np.where(fa == fb, 1.0, fb - fa)
    for _ in range(_STEPS):
        new, Y, _ = polish(Q, root, np.arange(root.size), lam, X, 2)
        value = function(new, root)
        lam, X = new, Y
        left = np.sign(value) == np.sign(fa)
        held = np.where(left, fa, fb)
        ratio = 1 - value / np.where(held == 0, 1.0, held)
        ratio = np.where(ratio > 0, ratio, 0.5)
        fa, fb = np.where(left, value, fa * ratio), np.where(left, fb * ratio, value)
        a, b = np.where(left, root, a), np.where(left, b, root)
        step = (a * fb - b * fa) / np.where(fa == fb, 1.0, fb - fa)
        step = np.where(value == 0, root, np.clip(step, np.minimum(a, b), np.maximum(a, b)))
        moved, root = np.abs(step - root), step
        if (moved <= 1e-11 * np.maximum(ends[1], 1e-300)).all():
            break
    lam, X, _ = polish(Q, root, np.arange(root.size), lam, X, 2)
    return root, lam, X


def _secant(
    Q: Quadratic,
    root: FloatArray,
    tight: FloatArray,
    lam: ComplexArray,
    X: ComplexArray,
    function: Function,
) -> tuple[FloatArray, ComplexArray, ComplexArray]:
    """Last digits of roots that are known well."""
    at = np.arange(root.size)
    lam, X, _ = polish(Q, root, at, lam, X, 2)
    here = function(lam, root)
    other = np.where(tight[1] - root > root - tight[0], tight[1], tight[0])
    there = function(polish(Q, other, at, lam, X, 3)[0], other)
    slope = (there - here) / np.where(other == root, 1.0, other - root)
    for _ in range(3):
        root = root - here / np.where(slope == 0, 1.0, slope)
        lam, X, _ = polish(Q, np.maximum(root, 0.0), at, lam, X, 2)
        here = function(lam, root)
        if (np.abs(here) <= _CONVERGED * np.abs(slope) * root).all():
            break
    return root, lam, X
