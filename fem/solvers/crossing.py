"""Where a mode does something at a speed: crosses the 1× line, or loses stability. Refined on the model.

Each root is sought on its own mode first, by inverse iteration from the last pair. Near a veering that may
slip to another mode: a root counts only if the function vanishes there and the shape is that of the mode at
both ends of the bracket, beyond doubt. All others are sought once more on what does not depend on which mode
is which: the values of the function of all modes, sorted. Each rank is continuous in speed, whatever curve
it runs along, and its roots are those of the modes.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace

import numpy as np

from fem.matrices.lateral_planes import Quadratic
from fem.solvers.bracketed_roots import bracketed_root
from fem.solvers.mode_tracking import likeness, mass_weight, plain
from fem.solvers.quadratic_eigenvalues import polish, solve
from fem.solvers.reduced_whirl import Whirl, enriched
from rotorid.base.arrays import BoolArray, ComplexArray, FloatArray, IndexArray

_ROUGH = 1e-8  # of a bracket: to which a root is known before its last digits
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


@dataclass(frozen=True, eq=False)
class _Root:
    """A mode at a speed, rad/s: its eigenvalue and vector in the basis, shape (R,)."""

    speed: float
    value: complex
    vector: ComplexArray


@dataclass(frozen=True, eq=False)
class _Bracket:
    """An interval of speed, rad/s, in which a function of one mode changes its sign.

    `f` are its values at both ends, `modes` the columns of all modes at both ends, `mode` the column sought.
    """

    ends: tuple[float, float]
    f: tuple[float, float]
    mode: int
    values: ComplexArray  # at both ends, shape (2,)
    vectors: ComplexArray  # shape (2, R)


def off_synchronous(lam: ComplexArray, speed: FloatArray) -> FloatArray:
    """Whirl frequency less the speed."""
    return np.asarray(np.abs(lam.imag) - speed)


def growth_rate(lam: ComplexArray, _: FloatArray | None = None) -> FloatArray:
    """Re λ / |λ|, at any speed: 0 where a mode neither grows nor decays."""
    return np.asarray(lam.real / np.abs(lam))


def crossings(whirl: Whirl, values: ComplexArray, vectors: ComplexArray, function: Function) -> Crossings:
    """Roots of a function of eigenvalue and speed on each mode, shapes (S, n) and (S, n, R)."""
    f = function(values, whirl.speeds[:, None])
    change = (f[:-1] * f[1:] < 0) | ((f[1:] == 0) & (f[:-1] != 0))
    change[:1] |= f[:1] == 0
    found: list[tuple[_Bracket, _Root]] = []
    for k in np.flatnonzero(change.any(axis=1)).tolist():
        two = slice(k, k + 2)
        ends = (float(whirl.speeds[k]), float(whirl.speeds[k + 1]))
        brackets = [
            _Bracket(
                ends, (float(f[k, mode]), float(f[k + 1, mode])), mode, values[two, mode], vectors[two, mode]
            )
            for mode in np.flatnonzero(change[k]).tolist()
        ]
        roots = [_on_the_mode(whirl.Q, bracket, function) for bracket in brackets]
        pairs = list(zip(brackets, roots, strict=True))
        if not all(_verified(whirl, k, *pair, function) for pair in pairs):
            pairs = _by_rank(whirl, k, brackets, function)
        found += pairs
    if not found:
        none = np.empty(0)
        shapes = whirl.Q.nodes(vectors[:0, 0])
        return Crossings(none, none.astype(np.intp), none.astype(complex), shapes)
    Q, vectors = enriched(
        whirl,
        np.array([root.speed for _, root in found]),
        np.array([root.value for _, root in found]),
        np.stack([root.vector for _, root in found]),
    )
    exact = [
        _last_digits(Q, bracket, replace(root, vector=vector), function)
        for (bracket, root), vector in zip(found, vectors, strict=True)
    ]
    order = np.argsort([root.speed for root in exact], kind="stable")
    return Crossings(
        np.array([root.speed for root in exact])[order],
        np.array([bracket.mode for bracket, _ in found], dtype=np.intp)[order],
        np.array([root.value for root in exact])[order],
        Q.nodes(np.stack([root.vector for root in exact])[order]),
    )


def _on_the_mode(Q: Quadratic, bracket: _Bracket, function: Function) -> _Root:
    """The root next to the straight line between both ends."""
    (a, b), (fa, fb) = bracket.ends, bracket.f
    part = fa / (fa - fb) if fa != fb else 0.0
    value = bracket.values[0] + part * (bracket.values[1] - bracket.values[0])
    start = _Root(a, value, bracket.vectors[int(part >= 0.5)])
    root, _ = _root(Q, start, bracket.ends, bracket.f, _ROUGH * (b - a), function)
    return root


def _last_digits(Q: Quadratic, bracket: _Bracket, rough: _Root, function: Function) -> _Root:
    """The same root in a better basis; as it was where the basis has another mode there."""
    there, here = _value(Q, rough, rough.speed, function)
    left = (here > 0) == (bracket.f[1] > 0)
    ends = (bracket.ends[0], rough.speed) if left else (rough.speed, bracket.ends[1])
    f = (bracket.f[0], here) if left else (here, bracket.f[1])
    root, excess = _root(Q, there, ends, f, 1e-14 * bracket.ends[1], function)
    mac = np.abs(np.vdot(rough.vector, root.vector)) / np.linalg.norm(rough.vector)
    good = mac**2 > _SAME and abs(excess) <= _VANISHES * max(map(abs, bracket.f))
    return root if good else rough


def _root(
    Q: Quadratic,
    start: _Root,
    ends: tuple[float, float],
    f: tuple[float, float],
    tolerance: float,
    function: Function,
) -> tuple[_Root, float]:
    """A bracketed root of a function whose values at both ends are known, on a mode like that of `start`.

    With the value of the function there.
    """
    last = start
    tried: dict[float, tuple[_Root, float]] = {}

    def excess(speed: float) -> float:
        nonlocal last
        last, value = tried[speed] = _value(Q, last, speed, function)
        return value

    speed = bracketed_root(excess, ends, f, tolerance)
    return tried[speed] if speed in tried else _value(Q, last, speed, function)


def _value(Q: Quadratic, start: _Root, speed: float, function: Function) -> tuple[_Root, float]:
    """The pair at a speed that inverse iteration finds from another one, and the function there."""
    at = np.array([speed])
    value, vector, _ = polish(
        Q, at, np.zeros(1, dtype=np.intp), np.array([start.value]), start.vector[None], 2
    )
    excess = float(np.nan_to_num(function(value, at))[0])
    return _Root(speed, complex(value[0]), vector[0]), excess


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


def _verified(whirl: Whirl, k: int, bracket: _Bracket, root: _Root, function: Function) -> bool:
    """Whether a root in interval k surely is that of the mode it was sought for."""
    lam = np.array([root.value])
    excess = function(lam, np.array([root.speed]))[0]
    if not abs(excess) <= _VANISHES * max(map(abs, bracket.f)):
        return False
    weight, apart = mass_weight(whirl), whirl.Q.P.planes == 1
    for end in (0, 1):
        others = whirl.found.values[k + end]
        mac = likeness(lam, root.vector[None], others, whirl.found.vectors[k + end], weight, apart)[0]
        mine = others == bracket.values[end]
        if not plain(mac[mine].max(initial=0.0), np.where(mine, 0.0, mac).max()):
            return False
    return True


def _by_rank(
    whirl: Whirl, k: int, brackets: list[_Bracket], function: Function
) -> list[tuple[_Bracket, _Root]]:
    """Roots of ranks in interval k, each with the mode it is most like; there may be fewer than brackets.

    Two modes that were exchanged between two speeds seem to cross in opposite directions: there is no root.
    """
    from scipy.optimize import linear_sum_assignment

    roots = _ranked(whirl, float(whirl.speeds[k]), float(whirl.speeds[k + 1]), function)
    if not roots:
        return []
    weight, apart = mass_weight(whirl), whirl.Q.P.planes == 1
    new, Y = np.array([root.value for root in roots]), np.stack([root.vector for root in roots])
    alike = np.zeros((len(brackets), len(roots)))
    for end in (0, 1):
        values = np.array([bracket.values[end] for bracket in brackets])
        vectors = np.stack([bracket.vectors[end] for bracket in brackets])
        alike += likeness(values, vectors, new, Y, weight, apart)
    pairs = zip(*linear_sum_assignment(alike, maximize=True), strict=True)
    return [(brackets[i], roots[j]) for i, j in pairs if alike[i, j] > 0]


def _ranked(whirl: Whirl, a: float, b: float, function: Function) -> list[_Root]:
    """Roots of all modes in an interval, by the ranks of the function."""
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
    out: list[_Root] = []
    for part, rank in zip(*np.nonzero(change), strict=True):

        def ranked(speed: float, rank: int = int(rank)) -> float:
            return float(min(at(np.array([speed]))[0][0, rank], 1e300))

        ends, values = speeds[part : part + 2].tolist(), f[part : part + 2, rank].tolist()
        speed = bracketed_root(ranked, ends, values, 1e-13 * b)
        here, lam, X = at(np.array([speed]))
        if abs(here[0, rank]) <= _JUMP * max(map(abs, values)):
            out.append(_Root(speed, complex(lam[0, rank]), X[0, rank]))
    return out
