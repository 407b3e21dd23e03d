"""Discrete weights of all planes chosen together: pieces in holes that leave the smallest vibration.

Every plane takes sums of pieces in holes (or free amounts in steps); over all planes together

    minimise sqrt(Σ wᵢ² |Yᵢ + Wᵢ D|²)   or   max wᵢ |Yᵢ + Wᵢ D|,   D_p attainable in plane p.

Exact branch and bound (`balancing.mounting.discrete_search`) around the continuous optimum; planes without
holes are continuous and follow the others. Where time runs out, or a plane has more vectors than can be
listed, the best that was found comes with a lower bound that holds for every mounting.
"""

from __future__ import annotations

import time
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Literal

import numpy as np
from numpy.typing import ArrayLike

from balancing.data.limits import Limits
from balancing.mounting.discrete_bounds import best_form, form, project_out, relax
from balancing.mounting.discrete_search import Found, polish, rounded, search
from balancing.mounting.fewest_pieces import fewest
from balancing.mounting.free_amounts import FreeAmounts
from balancing.mounting.holes import Holes, Mounting
from balancing.mounting.mountable_vectors import Attainable
from balancing.mounting.piece_sums import LONGEST, PieceSums
from balancing.solvers.certificate import Problem
from balancing.solvers.cone import InfeasibleError, problem, solve_cone
from rotorid.base.arrays import BoolArray, ComplexArray, FloatArray
from rotorid.regression import solution

__all__ = ["Discrete", "solve_discrete"]

_KEPT = 1 + 1e-9
_SHARP = 1e-9
_SAME = 1e-9
"""What is left counts as nothing below this share of what vibrates."""


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
    best
        The best choice, where this one is of fewer pieces: `bound` and `gap` are then its own, and `proven`
        says as well that no fewer pieces are within reach, and none of so many is better. None: this one.
    """

    mountings: tuple[Mounting | None, ...]
    weights: ComplexArray
    residual: ComplexArray
    objective: float
    bound: float
    gap: float
    proven: bool
    rounded_objective: float
    best: Discrete | None = None

    @property
    def pieces(self) -> int:
        """How many pieces all planes take together; free amounts do not count."""
        return sum(int(one.counts.sum()) for one in self.mountings if one is not None)


def solve_discrete(
    W: ArrayLike,
    Y: ArrayLike,
    planes: Mapping[str, Holes | None] | Sequence[Holes | None],
    *,
    method: Literal["least-squares", "minmax"] = "least-squares",
    row_weights: ArrayLike | None = None,
    limits: Limits | None = None,
    time_limit: float = 5.0,
    within: float | tuple[float, float] = 1.0,
) -> Discrete:
    """The mounting of all planes that leaves the least vibration, or little more with fewer pieces.

    Parameters
    ----------
    W, Y
        Influence coefficients (N, P) and readings (N,), complex.
    planes
        What each plane can take, perhaps by its name for messages; None for a plane that takes any weight.
    method
        What is minimised.
    row_weights
        wᵢ ≥ 0, shape (N,); default 1.
    limits
        Largest amplitudes (S·C = N, speed by speed), largest weights of the planes (of what is mounted and
        added together) and arcs in which no hole is used.
    time_limit
        s; what is found until then is returned with its gap; a fifth as long again proves that no fewer
        pieces are enough.
    within
        So many times the least objective is good enough for fewer pieces: of the choices within it the one
        of the fewest pieces, and of these the best; 1: the best of all. A second number: so large a share of
        the objective without weights is good enough, too.

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
    times, share = within if isinstance(within, tuple) else (within, 0.0)
    if not 1 <= times < np.inf:
        raise ValueError(f"the objective can be within 1 or more times of the least, not {times!r}")
    residual = None if limits is None else limits.residual.ravel()
    most = None if limits is None else limits.max_weight
    task = problem(W, Y, row_weights, most, residual, minmax=method == "minmax")
    P = task.W.shape[1]
    named = planes if isinstance(planes, Mapping) else {str(p): h for p, h in enumerate(planes, start=1)}
    if len(named) != P:
        raise ValueError(f"there must be holes, or None, for each of the {P} planes")
    arcs = limits.forbidden if limits is not None else ((),) * P
    usable = [_usable(h, a, name) for (name, h), a in zip(named.items(), arcs, strict=True)]
    return _Joint(task, tuple(named.values()), usable, tuple(named)).best(start, time_limit, times, share)


def _usable(holes: Holes | None, arcs: Sequence[tuple[float, float]], name: str) -> BoolArray:
    """Free holes outside the forbidden arcs."""
    if holes is None:
        if arcs:
            raise ValueError(f"plane {name} has forbidden angles but no holes: list its holes")
        return np.zeros(0, dtype=bool)
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
        task: Problem,
        planes: Sequence[Holes | None],
        usable: Sequence[BoolArray],
        names: tuple[str, ...],
    ) -> None:
        self.task, self.planes, self.usable, self.names = task, planes, usable, names
        on = task.row_weights > 0
        self.A, self.y = (task.row_weights[:, None] * task.W)[on], (task.row_weights * task.Y)[on]
        self.limited = np.flatnonzero(np.isfinite(task.residual))
        self.sets = [self._set(p, float(needed)) for p, needed in enumerate(self._needed())]
        self.own = [s for s in self.sets if s is not None]
        self.fixed = np.array([p for p, s in enumerate(self.sets) if s is not None], dtype=np.int64)
        self.free = np.array([p for p, s in enumerate(self.sets) if s is None], dtype=np.int64)
        # least squares: continuous planes without limits cancel what they can
        self.inner, self.known = project_out(self.A[:, self.free], self.A[:, self.fixed], self.y)
        limited = len(self.limited) or np.isfinite(task.max_weight[self.free]).any()
        self.exact = not len(self.free) or not (task.minmax or limited)

    def _needed(self) -> FloatArray:
        """Largest weights that can be better than none (ten times that where there are limits)."""
        A, y = self.A, self.y
        free = solution(A, -y)
        room = np.sqrt(len(y)) * np.linalg.norm(y)
        reach = np.full(A.shape[1], np.inf)
        for p in range(A.shape[1]):
            (rest,) = project_out(np.delete(A, p, axis=1), A[:, p])
            size = float(np.linalg.norm(rest))
            if size > 1e-9 * np.linalg.norm(A[:, p]):
                reach[p] = abs(free[p]) + room / size
        return reach * (10.0 if len(self.limited) else 1.0)

    def _set(self, p: int, needed: float) -> Attainable | None:
        """What a plane can take; None for any weight."""
        holes, usable = self.planes[p], self.usable[p]
        if holes is None:
            return None
        heaviest = min(holes.max_weight, float(self.task.max_weight[p]))
        if not holes.free_amounts:
            return PieceSums(holes, usable, heaviest, longest=LONGEST // len(self.planes))
        if not np.isfinite(min(needed, heaviest)):
            raise ValueError(
                f"the readings do not tell how much plane {self.names[p]} needs: state its largest weight"
            )
        amounts = FreeAmounts(holes, usable, heaviest, needed)
        return None if not holes.step and amounts.surround and np.isinf(heaviest) else amounts

    def best(self, start: float, limit: float, within: float = 1.0, share: float = 0.0) -> Discrete:
        """Solve; `solve_discrete` says what it raises."""
        continuous = self._continuous()
        if not self.own:
            return self._result(continuous, (), continuous, np.inf)
        relaxed, prices = relax(self.A, self.y, self.sets, minmax=self.task.minmax)
        for s, z in zip(self.own, relaxed[self.fixed], strict=True):
            s.aim(complex(z))
        nothing = np.zeros_like(relaxed)
        tried = [rounded(self.own, self._squares, D[self.fixed]) for D in (continuous, relaxed, nothing)]
        found, plane_by_plane = min(tried, key=lambda one: one.square), tried[0].D
        if np.isinf(found.square):
            found = self._feasible(start, limit)
        polish(self.own, self._squares, found, start + (0.2 if self.exact else 0.1) * limit)
        chunk = 4096 if self.exact else 8
        if self.task.minmax:
            shares = (self.A, self.y, prices, self.fixed, self.own, np.sqrt(found.square))
            sharp, q = best_form(*shares, (0.0,)).bound, best_form(*shares)
        else:
            centre = relax(self.inner, self.known, self.own, minmax=False)[0]
            q = form(self.inner, self.known, centre, self.own)
            sharp = q.bound
        unexplored = sharp
        if found.square * (1 - _SHARP) > sharp:
            unexplored = search(q, self.own, self._squares, found, start + limit, chunk)
            if not all(s.complete for s in self.own):
                unexplored = min(unexplored, q.bound)
            unexplored = max(unexplored, sharp)
        near = continuous.copy()
        near[self.fixed] = plane_by_plane
        result = self._placed(found, self.own, near, unexplored)
        if within == 1 or not result.pieces:
            return result
        present = self.task.objective(np.zeros_like(result.weights))
        enough = max(within * result.objective, share * present, _SAME * float(np.linalg.norm(self.y)))
        until = time.perf_counter() + limit / 5
        few, sure = fewest(q, self.own, self._squares, enough**2 * _KEPT, result.pieces, until, chunk)
        if few is None:
            return replace(result, proven=result.proven and sure)
        chosen = self._placed(*few, near, unexplored)
        best = result if result.objective < chosen.objective else None  # otherwise it was not the best
        return replace(chosen, bound=result.bound, gap=result.gap, proven=result.proven and sure, best=best)

    def _placed(
        self, found: Found, sets: Sequence[Attainable], near: ComplexArray, unexplored: float
    ) -> Discrete:
        """Pieces in their holes, and the continuous planes beside them."""
        mountings = tuple(s.mount(key) for s, key in zip(sets, found.keys, strict=True))
        weights = near.copy()
        weights[self.fixed] = found.D
        weights[self.free] = self._follow(found.D)
        return self._result(weights, mountings, near, unexplored)

    def _feasible(self, start: float, limit: float) -> Found:
        """A mounting that keeps every limit: the largest share of a limit made smallest."""
        tight = self.task.residual[self.limited]
        if (tight <= 0).any():
            raise InfeasibleError("a limit of an amplitude is 0, which pieces cannot reach: relax it")
        shares = np.zeros(len(self.task.Y))
        shares[self.limited] = 1 / tight
        unlimited = np.full(len(shares), np.inf)
        task = replace(self.task, row_weights=shares, residual=unlimited, minmax=True)
        other = _Joint(task, self.planes, self.usable, self.names)
        answer = other.best(start, 0.5 * limit)
        if answer.objective > _KEPT:
            if answer.bound > 1:
                raise InfeasibleError(
                    "no mounting of these pieces keeps every limit: relax one, or add pieces"
                )
            raise InfeasibleError(
                "no mounting that keeps every limit was found in time: allow more time, or relax a limit"
            )
        self.own = other.own  # where not all vectors are listed these are near what keeps the limits
        return rounded(self.own, self._squares, answer.weights[self.fixed])

    def _squares(self, D: ComplexArray, bounds: FloatArray, best: float) -> FloatArray:
        """Squared objectives of vectors (M, P'), infinite where a limit is broken; see `Squares`."""
        if not self.exact:
            return self._with_continuous(D, bounds, best)
        size = np.abs(self.known + D @ self.inner.T) ** 2
        squares = size.max(axis=1) if self.task.minmax else size.sum(axis=1)
        if len(self.limited):  # then no plane is continuous
            left = np.abs(self.task.Y[self.limited] + D @ self.task.W[self.limited].T)
            squares[(left > self.task.residual[self.limited] * _KEPT).any(axis=1)] = np.inf
        return np.asarray(squares)

    def _with_continuous(self, D: ComplexArray, bounds: FloatArray, best: float) -> FloatArray:
        squares = np.full(len(D), np.inf)
        weights = np.zeros(self.task.W.shape[1], dtype=complex)
        for n, (d, bound) in enumerate(zip(D, bounds, strict=True)):
            if bound > min(best, squares.min()):
                continue
            weights[self.fixed] = d
            try:
                weights[self.free] = self._follow(d)
            except InfeasibleError:
                continue
            squares[n] = self._value(weights) ** 2
        return squares

    def _follow(self, d: ComplexArray) -> ComplexArray:
        """Best continuous planes for given vectors of the others."""
        W, free = self.task.W, self.free
        left = self.task.Y + W[:, self.fixed] @ d
        most, sectors = self.task.max_weight[free], (None,) * len(free)
        return _optimum(replace(self.task, W=W[:, free], Y=left, max_weight=most, sectors=sectors))

    def _continuous(self) -> ComplexArray:
        """The continuous answer, without regard to pieces; limits only where no plane has holes."""
        most = self.task.max_weight.copy()
        most[self.fixed] = np.inf
        residual = np.full(len(self.task.Y), np.inf) if self.own else self.task.residual
        return _optimum(replace(self.task, max_weight=most, residual=residual))

    def _value(self, weights: ComplexArray) -> float:
        left = np.abs(self.task.Y + self.task.W @ weights)
        return self.task.objective(weights) if (left <= self.task.residual * _KEPT).all() else np.inf

    def _result(
        self,
        weights: ComplexArray,
        mounted: tuple[Mounting, ...],
        rounded: ComplexArray,
        unexplored: float,
    ) -> Discrete:
        objective, plane_by_plane = self._value(weights), self._value(rounded)
        if plane_by_plane >= objective * (1 - 1e-7):
            plane_by_plane = max(plane_by_plane, objective)
        lower = min(float(np.sqrt(unexplored)), objective)
        proven = bool(lower >= objective * (1 - _SHARP))
        mountings: list[Mounting | None] = [None] * len(weights)
        for p, found in zip(self.fixed, mounted, strict=True):
            mountings[p] = found
        for p in self.free:
            holes = self.planes[p]
            if holes is not None:
                mountings[p] = FreeAmounts(holes, self.usable[p], np.inf, np.inf).place(complex(weights[p]))
        return Discrete(
            mountings=tuple(mountings),
            weights=weights,
            residual=self.task.Y + self.task.W @ weights,
            objective=objective,
            bound=objective if proven else lower,
            gap=0.0 if proven else (objective - lower) / objective,
            proven=proven,
            rounded_objective=plane_by_plane,
        )


def _optimum(task: Problem) -> ComplexArray:
    """The weights of a continuous problem."""
    if not task.W.shape[1]:
        return np.zeros(0, dtype=complex)
    if task.minmax or np.isfinite(task.max_weight).any() or np.isfinite(task.residual).any():
        return solve_cone(task).weights
    return np.asarray(solution(task.row_weights[:, None] * task.W, -task.row_weights * task.Y), dtype=complex)
