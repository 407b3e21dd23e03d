"""Correction weights within limits, and min–max of amplitudes: second-order cone programs.

What the solver (clarabel) returns is a proposal. The weights are brought within the limits exactly (the
program is solved with limits tighter by a few 1e-9 of themselves, more where many digits cancel, and weights
are shortened by what rounding adds), and the lower bound of the optimum comes from
`balancing.solvers.certificate`, which corrects the dual point itself.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import ArrayLike

from balancing.data.limits import Arc
from balancing.solvers.certificate import Bound, Problem, lower_bound
from balancing.solvers.conditioning import check_stack
from balancing.solvers.cone_program import TIGHTER, InfeasibleError, Program, SolverError, within_limits
from rotorid.base.arrays import BoolArray, ComplexArray, FloatArray

__all__ = [
    "Cone",
    "InfeasibleError",
    "problem",
    "solve_cone",
]

AT_LIMIT = 1e-6
"""A limit counts as active where less than this share of it is left; less than 1e-3 where it has a price."""

# what is quick comes first: the certificate tells whether it was good enough
_SETTINGS = ((1e-9, False), (1e-10, True))
_ACCEPTED_GAP = 1e-7
_ROUNDING = 1e-12
_POOR_GAP = 1e-3
_COSTLY = 1e-3
NEGLIGIBLE = 1e-6
"""Objectives below this share of that without weights count as zero."""


@dataclass(frozen=True, eq=False)
class Cone:
    """Weights that solve a convex program, and how close to its optimum they are.

    Attributes
    ----------
    weights
        Within every limit, shape (P,).
    objective
        What was minimised, at these weights.
    bound
        Certified lower bound of the optimum.
    gap
        (objective − bound) / objective; objectives below 1e-6 of that without weights count as that much.
    active_weights, active_residuals
        Planes (P,) at their largest weight; readings (N,) at their limit or, for min–max, at the maximum.
    residual_prices, weight_prices
        What each limit costs, see `balancing.solvers.certificate.Bound`.
    """

    weights: ComplexArray
    objective: float
    bound: float
    gap: float
    active_weights: BoolArray
    active_residuals: BoolArray
    residual_prices: FloatArray
    weight_prices: FloatArray


def problem(
    W: ArrayLike,
    Y: ArrayLike,
    row_weights: ArrayLike | None = None,
    max_weight: ArrayLike | None = None,
    residual: ArrayLike | None = None,
    sectors: Sequence[Arc | None] | None = None,
    *,
    minmax: bool = False,
    budget: float = np.inf,
) -> Problem:
    """The problem: weights D that minimise sqrt(Σ wᵢ² |Yᵢ + Wᵢ D|²) within limits.

    Parameters
    ----------
    W, Y
        Influence coefficients (N, P) and readings (N,), complex.
    row_weights
        wᵢ ≥ 0, shape (N,); default 1.
    max_weight
        Largest |D_p|, shape (P,); 0 leaves a plane empty, infinite is no limit.
    residual
        Largest |Yᵢ + Wᵢ D|, shape (N,), infinite for none.
    sectors
        For each plane None or the convex arc (start, width ≤ π), rad, in which its weight must stand (or be
        zero).
    minmax
        Minimise max wᵢ |Yᵢ + Wᵢ D| instead.
    budget
        Largest Σ|D_p|.

    Raises
    ------
    ValueError
        For NaN, shapes that do not fit, negative limits.
    """
    A, y, w = check_stack(W, Y, row_weights)
    N, P = A.shape
    arcs = tuple(sectors) if sectors is not None else (None,) * P
    if len(arcs) != P or not all(s is None or 0 < s[1] <= np.pi * (1 + 1e-12) for s in arcs):
        raise ValueError("there must be one sector, of a width up to π, or None for every plane")
    if not budget >= 0:
        raise ValueError(f"the total weight must be a number ≥ 0; got {budget}")
    L = _limits(residual, N, "limits of amplitudes")
    M = _limits(max_weight, P, "largest weights")
    return Problem(A, y, w, L, M, arcs, float(budget), minmax)


def _limits(values: ArrayLike | None, n: int, what: str) -> FloatArray:
    if values is None:
        return np.full(n, np.inf)
    array = np.asarray(values, dtype=np.float64)
    if array.shape != (n,) or not (array >= 0).all():  # NaN is not ≥ 0
        raise ValueError(f"the {what} must be {n} numbers ≥ 0")
    return array


def solve_cone(problem: Problem) -> Cone:
    """Solve a checked problem.

    Raises
    ------
    InfeasibleError
        Where no weights are within the limits.
    SolverError
        Where the solver does not come near the optimum.
    """
    free = (problem.max_weight > 0) & (problem.budget > 0)
    if free.all():
        weights, bound = _optimum(problem)
    else:
        weights = np.zeros(len(free), dtype=complex)
        prices = np.zeros(len(free))
        if free.any():
            weights[free], bound = _optimum(problem.of_planes(free))
            prices[free] = bound.weight_prices
        else:
            bound = _empty(problem)
        bound = replace(bound, weight_prices=prices)
    return _result(problem, weights, bound)


def _empty(problem: Problem) -> Bound:
    """Without any weight there is nothing to choose."""
    if (np.abs(problem.Y) > problem.residual).any():
        raise InfeasibleError(
            "no plane may carry a weight, and a reading without weights exceeds its limit already"
        )
    none = np.zeros(problem.W.shape[1], dtype=complex)
    return Bound(problem.objective(none), np.zeros(len(problem.Y)), np.zeros(len(none)))


def _result(problem: Problem, weights: ComplexArray, bound: Bound) -> Cone:
    size, objective = np.abs(problem.Y + problem.W @ weights), problem.objective(weights)
    limit = problem.residual
    if problem.minmax:
        w = problem.row_weights
        limit = np.minimum(limit, np.divide(objective, w, out=np.full(len(w), np.inf), where=w > 0))
    lower = min(bound.value, objective)
    return Cone(
        weights=weights,
        objective=objective,
        bound=lower,
        gap=relative_gap(problem, objective, lower),
        active_weights=_active(np.abs(weights), problem.max_weight, bound.weight_prices / (objective or 1.0)),
        active_residuals=_active(size, limit, bound.residual_prices / (objective or 1.0)),
        residual_prices=bound.residual_prices,
        weight_prices=bound.weight_prices,
    )


def relative_gap(problem: Problem, objective: float, lower: float) -> float:
    """Distance of an objective from a bound, relative to it; see `Cone.gap`."""
    without = problem.objective(np.zeros(problem.W.shape[1], dtype=complex))
    return (objective - lower) / (max(objective, NEGLIGIBLE * without) or 1.0)


def _active(size: FloatArray, limit: FloatArray, price: FloatArray) -> BoolArray:
    """Limits reached; those that cost something are, although the solver stopped a little before them."""
    close = np.where(price > AT_LIMIT, _COSTLY, AT_LIMIT)
    return np.asarray(np.isfinite(limit) & (size >= np.where(np.isfinite(limit), limit, 0.0) * (1 - close)))


def _optimum(problem: Problem) -> tuple[ComplexArray, Bound]:
    """Weights within the limits and the certified bound, where every plane may carry some."""
    program = Program(problem)
    without = problem.objective(np.zeros_like(program.base))
    kept = (np.abs(program.residual) <= problem.residual).all()
    if kept and problem.objective(program.base) <= _ROUNDING * without:  # nothing is left to minimise
        return program.base, Bound(0.0, np.zeros(len(problem.Y)), np.zeros(len(program.base)))
    best: tuple[float, ComplexArray, Bound] | None = None
    for tolerance, careful in _SETTINGS:
        for tighter in TIGHTER if program.amplitudes_limited else (0.0,):
            try:
                proposed, a, u = program.run(tighter, tolerance, careful)
            except InfeasibleError:
                if best is None and tighter == TIGHTER[0]:
                    raise
                break
            if not np.isfinite(proposed).all():
                continue
            weights = within_limits(problem, proposed)
            if (np.abs(problem.Y + problem.W @ weights) > problem.residual).any():
                continue
            bound = lower_bound(problem, a, u)
            objective = problem.objective(weights)
            gap = relative_gap(problem, objective, bound.value)
            if best is None or gap < best[0]:
                best = gap, weights, bound
            if gap <= _ACCEPTED_GAP:
                return weights, bound
            break
    if best is None:
        raise InfeasibleError(
            "the limits can be met only to within rounding: relax a limit of the amplitudes a little"
        )
    if best[0] > _POOR_GAP:
        raise SolverError(
            "the solver did not come near the best weights: leave out a plane that acts like another, "
            "or relax the limits"
        )
    return best[1], best[2]
