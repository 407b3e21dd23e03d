"""The fit by errors within limits: sequential cone programs with a line search, from several starts.

The objective Q(D) of `balancing.solvers.effective_variance` is expanded about the last weights D_k with its
exact gradient g and its Hessian H, negative curvatures turned round:

    Q(D) ≈ Q(D_k) + 2 gᵀ(d − d_k) + (d − d_k)ᵀ H (d − d_k), stretched.

The minimum of that within the limits is a cone program. The limits are convex, if of each plane's allowed
angles only the sector where its weight stands is looked at, so the whole way to that minimum keeps them, and
is shortened until Q falls. Q has several minima where trial weights are weak or phases are known much better
than amplitudes: the steps start from many weights spread over what the limits allow, and the best end is
taken. That no better one exists is not certified.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Sequence
from dataclasses import replace
from typing import NamedTuple

import numpy as np

from balancing.data.limits import Arc, Limits
from balancing.solvers import likelihood
from balancing.solvers.certificate import Problem
from balancing.solvers.cone import problem
from balancing.solvers.cone_program import InfeasibleError, quadratic_minimum
from balancing.solvers.forbidden_angles import allowed_sectors, meets
from rotorid.base.arrays import ComplexArray, FloatArray
from rotorid.regression import stretch, unstretch

STEPS = 200
SETTLED, SETTLED_DRAWN = 1e-12, 1e-4
"""Share of 1 + Q below which its expected fall ends the steps; for drawn readings."""
SPREAD, PROJECTED, STARTS = 300, 60, 24
"""So many weights are looked at, fewer where amplitudes are limited, and so many of them are started from."""
RIVAL = 16.0
"""For drawn readings the ends are started from again whose Q is larger than the best by at most so much."""

_ROUNDING = 1e-7
_LEAST_CURVATURE = 1e-9
_SAME = 1e-4
_BEYOND = 3.0


class LimitedProblem(NamedTuple):
    """Q of the weights; their limits; the sectors of each plane (None: all angles)."""

    fit: likelihood.Problem
    limits: Problem
    sectors: tuple[tuple[Arc, ...] | None, ...]

    def kept(self, D: ComplexArray) -> bool:
        """Whether weights are within the limits."""
        return meets(self.limits, self.sectors, D)

    def chi_square(self, D: ComplexArray) -> float:
        """Σ rᵀ Σ⁻¹ r, without row weights (readings of weight 0 left out)."""
        return float(likelihood.evaluate(self.fit, stretch(D)).each[self.fit.weight > 0].sum())


class End(NamedTuple):
    """Where steps ended: weights (P,), Q, and whether Q falls no further."""

    weights: ComplexArray
    objective: float
    settled: bool


def limited_problem(
    W: ComplexArray, Y: ComplexArray, channels: FloatArray, row_weights: FloatArray | None, limits: Limits
) -> LimitedProblem:
    """As `effective_variance` takes it, with regular errors of every reading."""
    w = np.ones(len(Y)) if row_weights is None else row_weights
    sectors = tuple(allowed_sectors(arcs) for arcs in limits.forbidden)
    most = np.where([s == () for s in sectors], 0.0, limits.max_weight)
    return LimitedProblem(
        likelihood.problem_of(W, Y, channels, w),
        problem(W, Y, w, most, limits.residual.ravel()),
        tuple(s or None for s in sectors),
    )


def limited_fit(given: LimitedProblem, starts: Sequence[ComplexArray]) -> list[End]:
    """Minima of the sum of squared residuals in units of their errors, within limits.

    Parameters
    ----------
    given
        The problem.
    starts
        Weights to start from, besides those spread over the limits; they may be beyond them.

    Returns
    -------
    The minima found, the best first, no two alike. Where the steps from every start go on, the best of their
    last weights.

    Raises
    ------
    InfeasibleError
        Limits that cannot be met.
    """
    ends = descend_all(given, (*starts, *_spread(given, starts)))
    settled = [end for end in ends if end.settled]
    found: list[End] = []
    for end in sorted(settled or ends, key=lambda end: end.objective):
        if not any(
            np.abs(end.weights - other.weights).max() <= _SAME * np.abs(other.weights).max()
            for other in found
        ):
            found.append(end)
    return found if settled else found[:1]


def descend_all(given: LimitedProblem, starts: Iterable[ComplexArray], settled: float = SETTLED) -> list[End]:
    """Steps down from every start whose sectors the limits allow; `InfeasibleError` where there is none."""
    ends = []
    for D in starts:
        try:
            ends.append(_descend(given, D, settled))
        except InfeasibleError:
            continue
    if not ends:
        raise InfeasibleError("no weights are within the limits")
    return ends


def _descend(given: LimitedProblem, D: ComplexArray, settled: float) -> End:
    """Steps down from some weights; the first one is taken whole where they are beyond the limits."""

    def step(d: FloatArray, at: likelihood.State) -> tuple[FloatArray, float, bool]:
        g = likelihood.gradient(given.fit, at)
        H = _convex(likelihood.hessian(given.fit, at))
        D, down = unstretch(d), -unstretch(g)
        limits = replace(given.limits, sectors=_sectors_at(given, np.where(D == 0, down, D)))
        move = stretch(quadratic_minimum(limits, D, g, H)) - d
        return move, float(-2 * g @ move - move @ H @ move), True

    d = stretch(D)
    if not given.kept(D):
        d = d + step(d, likelihood.evaluate(given.fit, d))[0]
    end = likelihood.descend(given.fit, d, step, most=STEPS, settled=settled, rounding=_ROUNDING)
    return End(unstretch(end.d), end.at.objective, end.settled)


def _convex(H: FloatArray) -> FloatArray:
    """H with the absolute values of its curvatures, scaled."""
    scale = np.sqrt(np.abs(np.diag(H)))
    outer = np.outer(scale, scale)
    values, vectors = np.linalg.eigh(H / outer)
    size = np.abs(values)
    return np.asarray((vectors * np.maximum(size, _LEAST_CURVATURE * size.max())) @ vectors.T * outer)


def _nearest(given: LimitedProblem, D: ComplexArray) -> ComplexArray:
    """Weights within the limits, of an effect that differs least from that of D."""
    none = np.zeros_like(D)
    effect = np.repeat(_effect(given) ** 2, 2)
    limits = replace(given.limits, sectors=_sectors_at(given, D))
    return quadratic_minimum(limits, none, -effect * stretch(D), np.diag(effect))


def _effect(given: LimitedProblem) -> FloatArray:
    return np.asarray(np.linalg.norm(given.limits.W, axis=0))


def _sectors_at(given: LimitedProblem, D: ComplexArray) -> tuple[Arc | None, ...]:
    """Of each plane the sector in which its weight stands, the farthest from the ends."""

    def depth(v: complex, arc: Arc) -> float:
        return arc[1] / 2 - abs(float(np.angle(v * np.exp(-1j * (arc[0] + arc[1] / 2)))))

    pairs = zip(D.tolist(), given.sectors, strict=True)
    return tuple(None if s is None else max(s, key=lambda arc: depth(v, arc)) for v, s in pairs)


def _spread(given: LimitedProblem, starts: Sequence[ComplexArray]) -> list[ComplexArray]:
    """Weights all over the limits whose Q is smaller than that of neighbours in the same sectors."""
    rng = np.random.default_rng(0)
    effect, M, P = _effect(given), given.limits.max_weight, len(given.sectors)
    amplitudes = bool(np.isfinite(given.limits.residual).any())
    reach = np.minimum(M, _BEYOND * np.abs(starts * effect).max() / effect)
    edge = np.where(np.isfinite(M), M, reach)
    shape = (PROJECTED if amplitudes else SPREAD, P)
    size = np.where(rng.random(shape) < 1 / 3, edge, reach * rng.random(shape))
    points = size * np.exp(1j * np.transpose([_angles(s, shape[0], rng) for s in given.sectors]))
    if amplitudes:
        points = np.array(list(_possible(given, points))).reshape(-1, P)
    where = [_sectors_at(given, D) for D in points]
    Q = np.array([likelihood.evaluate(given.fit, stretch(D)).objective for D in points])
    away = (np.abs(points[:, None] - points) * effect).sum(axis=2)
    away[[[a != b for b in where] for a in where]] = np.inf
    near = np.argsort(away, axis=1)[:, : 2 * P + 2]
    around = np.where(np.isfinite(np.take_along_axis(away, near, axis=1)), Q[near], np.inf)
    lowest = np.flatnonzero(around.min(axis=1, initial=np.inf) >= Q)
    best = lowest[np.argsort(Q[lowest])]
    rank = [sum(where[j] == where[i] for j in best[:k]) for k, i in enumerate(best)]  # all sectors take part
    return list(points[best[np.argsort(rank, kind="stable")][:STARTS]])


def _angles(sectors: Sequence[Arc] | None, n: int, rng: np.random.Generator) -> FloatArray:
    """Angles drawn from the sectors."""
    start, width = np.transpose(((0.0, 2 * np.pi),) if sectors is None else sectors)
    chosen = rng.choice(len(start), n, p=width / width.sum())
    return np.asarray(start[chosen] + width[chosen] * rng.random(n))


def _possible(given: LimitedProblem, points: Iterable[ComplexArray]) -> Iterator[ComplexArray]:
    """Each put within the limits, where they are possible in its sectors."""
    for D in points:
        try:
            yield D if given.kept(D) else _nearest(given, D)
        except InfeasibleError:
            continue
