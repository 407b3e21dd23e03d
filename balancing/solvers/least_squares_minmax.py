"""One entry for every way to choose correction weights: closed form where nothing is limited, else cones."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Literal

import numpy as np
from numpy.typing import ArrayLike

from balancing.coefficients.identifiability import UndeterminedError, check_planes
from balancing.data.limits import Limits
from balancing.solvers.certificate import Problem
from balancing.solvers.conditioning import check_stack
from balancing.solvers.cone import Cone, InfeasibleError, problem
from balancing.solvers.conflicting_limits import explain
from balancing.solvers.forbidden_angles import allowed_sectors, meets, solve_sectors
from rotorid.base.arrays import BoolArray, ComplexArray, FloatArray
from rotorid.regression import solution_and_rank

Criterion = Literal["least-squares", "minmax"]

_ROUNDING = 1e-12


@dataclass(frozen=True, eq=False)
class Solution:
    """Correction weights and the vibration they should leave.

    Attributes
    ----------
    weights
        Shape (P,), within every limit.
    residual
        Y + W D, shape (N,).
    method
        "least-squares" or "minmax".
    objective
        sqrt(Σ wᵢ²|rᵢ|²), or max wᵢ|rᵢ|.
    gap
        Largest relative distance of the objective from its optimum, certified; None for the closed form.
    active_weights, active_residuals
        Planes (P,) at their largest weight; readings (N,) at their limit or, for min–max, at the maximum.
    """

    weights: ComplexArray
    residual: ComplexArray
    method: Criterion
    objective: float
    gap: float | None
    active_weights: BoolArray
    active_residuals: BoolArray


def solve(  # noqa: PLR0913
    W: ArrayLike,
    Y: ArrayLike,
    *,
    method: Criterion = "least-squares",
    row_weights: ArrayLike | None = None,
    limits: Limits | None = None,
    names: Sequence[str] | None = None,
    readings: Sequence[str] | None = None,
    amplitude: Callable[[float], str] = "{:.4g}".format,
    weight: Callable[[float], str] = "{:.4g}".format,
) -> Solution:
    """Weights D that make Y + W D small, within limits.

    Parameters
    ----------
    W, Y
        Influence coefficients (N, P) and readings (N,), complex, stacked speed by speed.
    method
        "least-squares" minimises sqrt(Σ wᵢ²|rᵢ|²), "minmax" max wᵢ|rᵢ|.
    row_weights
        wᵢ ≥ 0, shape (N,); default 1. A reading of weight 0 counts only for its limit.
    limits
        Of weights, amplitudes (its `residual` (S, C) has N entries) and angles; default none.
    names, readings
        Of planes (P) and readings (N), for messages; default "1", "2", … and "reading 1", ….
    amplitude, weight
        Write an amplitude or a weight with its unit, for messages; default plain numbers.

    Raises
    ------
    ValueError
        For NaN, shapes that do not fit, an unknown method.
    UndeterminedError
        For planes (that may carry a weight) the readings do not tell apart.
    InfeasibleError
        For limits that cannot be met: which ones, and how far to relax them.

    Notes
    -----
    Sources: [S] (33), (40) for the closed form, by SVD of the row-weighted, column-scaled W.

    Examples
    --------
    >>> found = solve([[1.0], [1.0]], [3.0, 5.0], method="minmax")
    >>> print(f"{found.weights[0].real:.6f} {found.objective:.6f}")
    -4.000000 1.000000
    """
    if method not in ("least-squares", "minmax"):
        raise ValueError(f"the method must be 'least-squares' or 'minmax'; got {method!r}")
    A, y, w = check_stack(W, Y, row_weights)
    N, P = A.shape
    planes = [str(p + 1) for p in range(P)] if names is None else list(names)
    if len(planes) != P or (readings is not None and len(readings) != N):
        raise ValueError(f"{P} planes and {N} readings need as many names")
    limited = limits is not None and limits.any
    if method == "least-squares" and not limited:
        weights = _closed_form(A, y, w, planes)
        residual = y + A @ weights
        free = np.zeros(P, dtype=bool), np.zeros(N, dtype=bool)
        return Solution(weights, residual, method, float(np.linalg.norm(w * residual)), None, *free)
    whole, sectors = _within(A, y, w, limits, minmax=method == "minmax")
    may = np.array([m > 0 and s != () for m, s in zip(whole.max_weight, sectors, strict=True)])
    if may.any():
        own = [name for name, m in zip(planes, may, strict=True) if m]
        start = np.zeros(P, dtype=complex)
        start[may] = _closed_form(A[:, may], y, w, own)
        reached = whole.objective(start)
        exact = reached <= _ROUNDING * whole.objective(np.zeros(P, dtype=complex))  # no reading stays
        if (method == "least-squares" or exact) and meets(whole, sectors, start):
            none = np.zeros(N, dtype=bool)
            left_out = whole.max_weight == 0
            return Solution(start, y + A @ start, method, reached, None, left_out, none)
    try:
        found: Cone = solve_sectors(whole, sectors)
    except InfeasibleError:
        labels = [f"reading {i + 1}" for i in range(N)] if readings is None else list(readings)
        words = explain(whole, sectors, planes, labels, amplitude=amplitude, weight=weight)
        raise InfeasibleError(words) from None
    return Solution(
        weights=found.weights,
        residual=y + A @ found.weights,
        method=method,
        objective=found.objective,
        gap=found.gap,
        active_weights=found.active_weights,
        active_residuals=found.active_residuals,
    )


def _closed_form(W: ComplexArray, Y: ComplexArray, w: FloatArray, names: Sequence[str]) -> ComplexArray:
    """Least squares of the row-weighted, column-scaled equations; refuses dependent planes."""
    kept = w > 0
    A, right = w[kept, None] * W[kept], w[kept] * Y[kept]
    found, rank = solution_and_rank(A, -right)
    if rank == W.shape[1]:
        return np.asarray(found)
    check_planes(A, names)
    raise UndeterminedError(
        f"planes {', '.join(map(repr, names))} act alike to within rounding: leave one out, "
        "or add sensors or speeds"
    )


def _within(
    W: ComplexArray, Y: ComplexArray, w: FloatArray, limits: Limits | None, *, minmax: bool
) -> tuple[Problem, list[tuple[tuple[float, float], ...] | None]]:
    """The problem and, for each plane, the sectors its weight may stand in."""
    N, P = W.shape
    if limits is None:
        return problem(W, Y, w, minmax=minmax), [None] * P
    if limits.residual.size != N or len(limits.max_weight) != P:
        raise ValueError(
            f"the limits are for {limits.residual.size} readings and {len(limits.max_weight)} planes; "
            f"there are {N} and {P}"
        )
    whole = problem(W, Y, w, limits.max_weight, limits.residual.reshape(N), minmax=minmax)
    return whole, [allowed_sectors(arcs) for arcs in limits.forbidden]
