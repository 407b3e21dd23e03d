"""Weights that can really be mounted, chosen together: what makes the vibration itself smallest.

Every plane takes sums of pieces in holes (or free amounts in steps); over all planes together

    minimise sqrt(Σ wᵢ² |Yᵢ + Wᵢ D|²)   or   max wᵢ |Yᵢ + Wᵢ D|,   D_p attainable in plane p.

Exact branch and bound (`balancing.mounting.discrete_search`) around the continuous optimum; planes without
holes are continuous and follow the others. Where time runs out, or a plane has more vectors than can be
listed, the best that was found comes with a lower bound that holds for every mounting.
"""

from __future__ import annotations

import time
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Literal

import numpy as np
from numpy.typing import ArrayLike

from balancing.data.limits import Limits
from balancing.mounting.discrete_relax import best_form, form, project_out, relax
from balancing.mounting.discrete_search import Found, Leaves, nearest, polish, search
from balancing.mounting.discrete_sets import LONGEST, Attainable
from balancing.mounting.discrete_steps import StepSums, attainable
from balancing.mounting.holes import Holes, Mounting
from balancing.solvers.cone import InfeasibleError, problem, solve_cone
from rotorid.base.arrays import BoolArray, ComplexArray, FloatArray, IntArray

__all__ = ["Discrete", "solve_discrete"]

_KEPT = 1 + 1e-9
_SHARP = 1e-9


@dataclass(frozen=True, eq=False)
class Discrete:
    """The best mounting.

    Attributes
    ----------
    mountings
        Of each plane; None for a plane without holes.
    weights
        Vectors that are added, shape (P,).
    residual
        Y + W D, shape (N,).
    objective, bound, gap
        Of these weights; lower bound for every mounting; (objective − bound) / objective, 0 where `proven`.
    proven
        Whether no mounting is better (to within 1e-9).
    rounded_objective
        Of the continuous answer rounded plane by plane to the nearest attainable vectors; infinite where that
        breaks a limit.
    """

    mountings: tuple[Mounting | None, ...]
    weights: ComplexArray
    residual: ComplexArray
    objective: float
    bound: float
    gap: float
    proven: bool
    rounded_objective: float


def solve_discrete(
    W: ArrayLike,
    Y: ArrayLike,
    planes: Sequence[Holes | None],
    *,
    method: Literal["least-squares", "minmax"] = "least-squares",
    row_weights: ArrayLike | None = None,
    limits: Limits | None = None,
    time_limit: float = 5.0,
    names: Sequence[str] = (),
) -> Discrete:
    """The mounting of all planes that leaves the least vibration.

    Parameters
    ----------
    W, Y
        Influence coefficients (N, P) and readings (N,), complex.
    planes
        What each plane can take; None for a plane that takes any weight.
    method
        What is minimised.
    row_weights
        wᵢ ≥ 0, shape (N,); default 1.
    limits
        Largest amplitudes (S·C = N, speed by speed), largest weights of the planes (of what is mounted and
        added together) and arcs in which no hole is used.
    time_limit
        s; what is found until then is returned with its gap.
    names
        Of the planes, for messages.

    Raises
    ------
    InfeasibleError
        Where no mounting keeps the limits, or none was found in time.
    ValueError
        For NaN, shapes that do not fit, planes in which nothing can be mounted.
    """
    start = time.perf_counter()
    if method not in ("least-squares", "minmax"):
        raise ValueError(f"the method must be 'least-squares' or 'minmax'; got {method!r}")
    if not (np.isfinite(time_limit) and time_limit > 0):
        raise ValueError("the time limit must be a number of seconds above 0")
    residual = None if limits is None else limits.residual.ravel()
    most = None if limits is None else limits.max_weight
    checked = problem(W, Y, row_weights, most, residual)
    P = checked.W.shape[1]
    named = tuple(names) or tuple(str(p + 1) for p in range(P))
    if len(planes) != P or len(named) != P:
        raise ValueError(f"there must be holes, or None, and a name for each of the {P} planes")
    arcs = limits.forbidden if limits is not None else ((),) * P
    usable = [_usable(h, a, name) for h, a, name in zip(planes, arcs, named, strict=True)]
    joint = _Joint(
        checked.W, checked.Y, checked.row_weights, checked.residual, checked.max_weight, planes, usable, named
    )
    return joint.best(method == "minmax", start, time_limit)


def _usable(holes: Holes | None, arcs: Sequence[tuple[float, float]], name: str) -> BoolArray | None:
    """Free holes outside the forbidden arcs."""
    if holes is None:
        if arcs:
            raise ValueError(f"plane {name} has forbidden angles but no holes: list its holes")
        return None
    kept = holes.free.copy()
    for first, width in arcs:
        after = np.mod(holes.angles - first, 2 * np.pi)
        kept &= ~((after > 1e-9) & (after < width - 1e-9))
    if not kept.any():
        raise ValueError(
            f"nothing can be mounted in plane {name}: every hole is taken or at a forbidden angle"
        )
    return kept


class _Joint:
    """One problem: weighted rows, sets of the planes, continuous planes."""

    def __init__(
        self,
        W: ComplexArray,
        Y: ComplexArray,
        row_weights: FloatArray,
        residual: FloatArray,
        max_weight: FloatArray,
        planes: Sequence[Holes | None],
        usable: Sequence[BoolArray | None],
        names: tuple[str, ...],
    ) -> None:
        self.W, self.Y, self.w, self.residual, self.max_weight = W, Y, row_weights, residual, max_weight
        self.planes, self.usable, self.names = planes, usable, names
        self.limited = np.flatnonzero(np.isfinite(residual))
        reach = self._needed()
        self.sets: list[Attainable | None] = []
        for p, (holes, own) in enumerate(zip(planes, usable, strict=True)):
            if holes is None or own is None:
                self.sets.append(None)
                continue
            heaviest = min(holes.max_weight, float(max_weight[p]))
            if holes.free_amounts and not np.isfinite(min(reach[p], heaviest)):
                raise ValueError(
                    f"the readings do not tell how much plane {names[p]} needs: state its largest weight"
                )
            one = attainable(holes, own, heaviest, float(reach[p]), LONGEST // len(planes))
            free = isinstance(one, StepSums) and not holes.step and one.surround and np.isinf(heaviest)
            self.sets.append(None if free else one)
        self.fixed = np.array([p for p, s in enumerate(self.sets) if s is not None], dtype=np.int64)
        self.free = np.array([p for p, s in enumerate(self.sets) if s is None], dtype=np.int64)
        self.own = [s for s in self.sets if s is not None]

    def _needed(self) -> FloatArray:
        """Largest weights that can be better than none (ten times that where there are limits)."""
        A, y = self.w[:, None] * self.W, self.w * self.Y
        ls = np.linalg.lstsq(A, -y, rcond=None)[0]
        room = np.sqrt(len(y)) * np.linalg.norm(y)
        reach = np.full(A.shape[1], np.inf)
        for p in range(A.shape[1]):
            (rest,) = project_out(np.delete(A, p, axis=1), A[:, p])
            size = float(np.linalg.norm(rest))
            if size > 1e-9 * np.linalg.norm(A[:, p]):
                reach[p] = abs(ls[p]) + room / size
        return reach * (10.0 if len(self.limited) else 1.0)

    def best(self, minmax: bool, start: float, limit: float) -> Discrete:
        """Solve; `solve_discrete` says what it raises."""
        rows = self.w > 0
        A, y = (self.w[:, None] * self.W)[rows], (self.w * self.Y)[rows]
        continuous = self._continuous(minmax)
        if not len(self.fixed):
            return self._result(minmax, continuous, np.zeros((0, 3), dtype=np.int64), None, np.inf)
        simple = not minmax and not len(self.limited) and np.isinf(self.max_weight[self.free]).all()
        relaxed, prices = relax(A, y, self.sets, minmax=minmax)
        if simple:  # continuous planes cancel what they can
            Af, yf = project_out(A[:, self.free], A[:, self.fixed], y)
        else:
            Af, yf = A[:, self.fixed], y
        exact = simple or not len(self.free)

        def leaves(D: ComplexArray, bounds: FloatArray, best: float) -> FloatArray:
            if exact:
                return self._squares(Af, yf, D, minmax)
            return self._with_continuous(D, bounds, best, minmax)

        found = Found(np.inf, np.zeros(len(self.fixed), dtype=complex), np.zeros((0, 3), dtype=np.int64))
        rounded = None
        for target in (continuous, relaxed, np.zeros_like(continuous)):
            picks = [nearest(s, complex(z)) for s, z in zip(self.own, target[self.fixed], strict=True)]
            D, keys = np.array([d for d, _ in picks]), np.array([k for _, k in picks])
            rounded = D if rounded is None else rounded
            square = float(leaves(D[None], np.zeros(1), found.square)[0])
            if square < found.square or not len(found.keys):
                found = Found(square, D, keys)
        if np.isinf(found.square):
            found = self._feasible(found, start, limit, leaves)
        polish(self.own, leaves, found, start + (0.2 if exact else 0.1) * limit)
        if minmax:
            sharp = best_form(A, y, prices, self.fixed, self.own, np.sqrt(found.square), (0.0,)).bound
            q = best_form(A, y, prices, self.fixed, self.own, np.sqrt(found.square))
        else:
            B, c = project_out(A[:, self.free], A[:, self.fixed], y)
            q = form(B, c, relax(B, c, self.own, minmax=False)[0], self.own)
            sharp = q.bound
        found.unexplored = sharp
        if found.square * (1 - _SHARP) > sharp:
            found = search(q, self.own, leaves, found, start + limit, 4096 if exact else 8)
            if not all(s.complete for s in self.own):
                found.unexplored = min(found.unexplored, q.bound)
            found.unexplored = max(found.unexplored, sharp)
        weights = continuous.copy()
        weights[self.fixed] = found.D
        weights[self.free] = self._follow(found.D, minmax)
        split = continuous.copy()
        split[self.fixed] = rounded
        return self._result(minmax, weights, found.keys, split, found.unexplored)

    def _feasible(self, found: Found, start: float, limit: float, leaves: Leaves) -> Found:
        """A mounting that keeps every limit: the largest share of a limit made smallest."""
        tight = self.residual[self.limited]
        if (tight <= 0).any():
            raise InfeasibleError("a limit of an amplitude is 0, which pieces cannot reach: relax it")
        w = np.zeros(len(self.Y))
        w[self.limited] = 1 / tight
        none = np.full(len(self.Y), np.inf)
        other = _Joint(self.W, self.Y, w, none, self.max_weight, self.planes, self.usable, self.names)
        answer = other.best(True, start, 0.5 * limit)
        if answer.objective > _KEPT:
            if answer.bound > 1:
                raise InfeasibleError(
                    "no mounting of these pieces keeps every limit: relax one, or add pieces"
                )
            raise InfeasibleError(
                "no mounting that keeps every limit was found in time: allow more time, or relax a limit"
            )
        D = answer.weights[self.fixed]
        keys = np.array([nearest(s, complex(d))[1] for s, d in zip(self.own, D, strict=True)])
        return Found(float(leaves(D[None], np.zeros(1), np.inf)[0]), D, keys)

    def _squares(self, A: ComplexArray, y: ComplexArray, D: ComplexArray, minmax: bool) -> FloatArray:
        size = np.abs(y + D @ A.T) ** 2
        squares = size.max(axis=1) if minmax else size.sum(axis=1)
        if len(self.limited):
            left = np.abs(self.Y[self.limited] + D @ self.W[np.ix_(self.limited, self.fixed)].T)
            squares[(left > self.residual[self.limited] * _KEPT).any(axis=1)] = np.inf
        return np.asarray(squares)

    def _with_continuous(self, D: ComplexArray, bounds: FloatArray, best: float, minmax: bool) -> FloatArray:
        squares = np.full(len(D), np.inf)
        for n, (d, bound) in enumerate(zip(D, bounds, strict=True)):
            if bound > min(best, squares.min()):
                continue
            weights = np.zeros(self.W.shape[1], dtype=complex)
            try:
                weights[self.free] = self._follow(d, minmax)
            except InfeasibleError:
                continue
            weights[self.fixed] = d
            squares[n] = self._value(weights, minmax) ** 2
        return squares

    def _follow(self, d: ComplexArray, minmax: bool) -> ComplexArray:
        """Best continuous planes for given vectors of the others."""
        if not len(self.free):
            return np.zeros(0, dtype=complex)
        left = self.Y + self.W[:, self.fixed] @ d
        return self._solve_free(self.W[:, self.free], left, self.max_weight[self.free], self.residual, minmax)

    def _continuous(self, minmax: bool) -> ComplexArray:
        """The continuous answer, without regard to pieces; limits only where no plane has holes."""
        most = np.where(np.isin(np.arange(len(self.sets)), self.free), self.max_weight, np.inf)
        residual = self.residual if not len(self.fixed) else np.full(len(self.Y), np.inf)
        return self._solve_free(self.W, self.Y, most, residual, minmax)

    def _solve_free(
        self, W: ComplexArray, Y: ComplexArray, most: FloatArray, residual: FloatArray, minmax: bool
    ) -> ComplexArray:
        if not minmax and np.isinf(most).all() and np.isinf(residual).all():
            return np.asarray(np.linalg.lstsq(self.w[:, None] * W, -self.w * Y, rcond=None)[0])
        return solve_cone(problem(W, Y, self.w, most, residual, minmax=minmax)).weights

    def _value(self, weights: ComplexArray, minmax: bool) -> float:
        left = self.Y + self.W @ weights
        if (np.abs(left[self.limited]) > self.residual[self.limited] * _KEPT).any():
            return np.inf
        return float(np.max(self.w * np.abs(left)) if minmax else np.linalg.norm(self.w * left))

    def _result(
        self,
        minmax: bool,
        weights: ComplexArray,
        keys: IntArray,
        split: ComplexArray | None,
        unexplored: float,
    ) -> Discrete:
        objective = self._value(weights, minmax)
        rounded = objective if split is None else self._value(split, minmax)
        lower = min(float(np.sqrt(unexplored)), objective)
        proven = bool(lower >= objective * (1 - _SHARP))
        mountings: list[Mounting | None] = [None] * len(weights)
        for k, p in enumerate(self.fixed):
            mountings[p] = self.own[k].mount(keys[k])
        for p in self.free:
            holes, usable = self.planes[p], self.usable[p]
            if holes is not None and usable is not None:
                mountings[p] = StepSums(holes, usable, np.inf, max(abs(weights[p]), 1e-300)).place(weights[p])
        return Discrete(
            mountings=tuple(mountings),
            weights=weights,
            residual=self.Y + self.W @ weights,
            objective=objective,
            bound=objective if proven else lower,
            gap=0.0 if proven else (objective - lower) / objective,
            proven=proven,
            rounded_objective=max(rounded, objective) if rounded >= objective * (1 - 1e-7) else rounded,
        )
