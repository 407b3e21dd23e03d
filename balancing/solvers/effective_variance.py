"""Corrections by the effective-variance fit, where errors stand in W as well as in Y₀.

Trial runs put the errors of their readings into W. Least squares then finds weights that are too small, and
its region is optimistic. This fit minimises the residuals in units of their own errors, which depend on D
through those of W: the maximum likelihood of normal errors (`balancing.solvers.likelihood`).

Which covariance is honest was found by simulating jobs whose truth is known (two planes, twelve readings with
3 % and 2°, no errors between runs; other jobs: docs/sure.md). Shares of 95 % regions with
the true weights, for trial weights that change the vibration by 30–100 % / 10–30 % / 3–10 %, at condition
numbers up to 10:

- least squares, first-order errors: 84 % / 62 % / 15 %;
- this fit, (Σ Wᵀ Σ⁻¹ W)⁻¹ with W as measured: 94 % / 87 % / 49 %;
- (Σ Ŵᵀ Σ⁻¹ Ŵ)⁻¹ = M⁻¹ with the adjusted Ŵ: 94 % / 91 % / 58 %;
- inverse Hessian: 95 % / 92 % / 65 %;
- A⁻¹ M A⁻¹, errors of Ŵ subtracted, the one used: 95 % / 94 % / 70 %.

The differences grow with the condition number. What is lacking for weak trials is not a matter of the
covariance: the region is then no ellipse any more, and `balancing.correction.region_coverage` says so.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike

from balancing.coefficients.identifiability import check_planes
from balancing.coefficients.repeatability import tail
from balancing.data.reading_errors import mean_variance
from balancing.solvers.conditioning import check_channels, check_stack
from balancing.solvers.error_propagation import prediction_covariance
from balancing.solvers.likelihood import (
    Minimum,
    Problem,
    State,
    covariance,
    derivatives,
    descend,
    gradient,
    hessian,
    jacobian,
    problem_of,
)
from rotorid.base.arrays import ComplexArray, FloatArray
from rotorid.regression import gain, solution, stretch, unstretch

FLOOR = 1e-4
"""Every residual gets a further error of this share of the root mean square error of all residuals."""

UNEXPLAINED = 0.95
"""Level of the χ² test beyond which the residuals are larger than the errors explain."""

_STEPS = 100
_DONE = 1e-13  # predicted decrease: a step of 3e-7 standard deviations, after which Newton is at rounding
_NO_SHARE, _SEARCHED = 1e-9, 1e-13  # of the mean variance
_STUCK = 1e-10  # above it, no way down means lost and not rounding


@dataclass(frozen=True, eq=False)
class Effective:
    """Corrections by the effective-variance fit.

    Attributes
    ----------
    weights
        Corrections, shape (P,).
    covariance
        Of (Re D₁, Im D₁, …), shape (2P, 2P), for the stated errors and `model_error`.
    chi_square
        Σ rᵀ Σ⁻¹ r of the fit by the stated errors alone, without row weights (readings of weight 0 left out).
    dof
        2N − 2P, with N readings of weight > 0.
    inflation
        √(chi_square / dof) where chi_square is beyond what errors explain (95 %), else 1.
    model_error
        Where it is beyond: standard deviation of what else stands in both parts of every reading, in the unit
        of Y, as large as the residuals say; weights and covariance allow for it. Else 0.
    converged
        False where no minimum is in reach: the trial runs tell too little, and the weights grow without
        bound. They are not to be used then.
    """

    weights: ComplexArray
    covariance: FloatArray
    chi_square: float
    dof: int
    inflation: float
    model_error: float
    converged: bool
    derivatives: FloatArray
    """Of (Re D₁, …) by (Re Y, Im Y, Re W₁, …) of each reading of weight > 0, else 0; (N, 2P, 2P + 2)."""


def effective_variance(
    W: ArrayLike,
    Y: ArrayLike,
    channels: ArrayLike,
    *,
    row_weights: ArrayLike | None = None,
    start: ArrayLike | None = None,
    explained: Callable[[ComplexArray], bool] | None = None,
) -> Effective:
    """Corrections D that minimise Σ w² rᵀ Σ(D)⁻¹ r, the residuals r = Y + W D in units of their errors.

    Parameters
    ----------
    W
        Influence coefficients stacked over speeds and sensors, shape (N, P).
    Y
        Vibration of the bare rotor, shape (N,).
    channels
        Covariance of (Re Y, Im Y, Re W₁, …) of each reading, shape (N, 2P + 2, 2P + 2).
    row_weights
        w ≥ 0 of each reading, shape (N,); a reading of weight 0 is left out of the fit. Default 1.
    start
        Corrections to begin with, shape (P,); default least squares.
    explained
        Whether errors explain what the corrections leave; default: χ² within its 95 % quantile.

    Returns
    -------
    Effective
        The fit for the errors as stated; `chi_square` tells whether they explain the residuals.

    Raises
    ------
    UndeterminedError
        Planes that act alike exactly, or fewer readings than planes.
    ValueError
        Shapes that do not fit, NaN or infinity, negative weights, and where no reading has any error.

    Notes
    -----
    Newton's method with the exact Hessian, Gauss–Newton where that is not positive definite; step halving.

    Errors in one direction only (amplitudes without phases, floor 0) can make Σ singular: an exact equation.
    It is kept, but a further error of `FLOOR` times the root mean square of all errors is added to each
    reading of Y, which changes regular problems by 1e-8.

    Unbalance outside the planes leaves residuals that no error of the readings explains. Large weights
    would excuse them by the errors of W: weights of the plain fit are up to a third too large. Where
    chi_square is beyond what errors explain (95 %), every reading of Y therefore gets a further error, alike
    for all, such that χ² equals its degrees of freedom. The fit is close to least squares then, and as good.
    If the cause is errors of the trial runs that are larger than stated, the covariance is too small: times
    `inflation`² it holds the truth for either cause.
    """
    w, y, weight = check_stack(W, Y, row_weights)
    C = check_channels(channels, w)
    used = weight > 0
    P = w.shape[1]
    w_used, y_used, weight = w[used], y[used], weight[used]
    check_planes(w_used, [str(p + 1) for p in range(P)])
    first = stretch(-(gain(weight[:, None] * w_used) @ (weight * y_used)))
    variance = float(mean_variance(prediction_covariance(unstretch(first), C[used])).mean())
    if not variance > 0:
        raise ValueError("no reading has any error: a fit by errors needs some; use least squares instead")
    given = first if start is None else stretch(start)
    if given.shape != (2 * P,) or not np.isfinite(given).all():
        raise ValueError(f"the corrections to begin with must be {P} finite numbers")

    def fit(share: float, d: FloatArray) -> Minimum:
        wider = widened(C[used], (FLOOR**2 + share) * variance)
        problem = problem_of(w_used, y_used, wider, weight)
        return descend(
            problem, d, lambda _, at: _step(problem, at), most=_STEPS, settled=_DONE, rounding=_STUCK
        )

    best = fit(0.0, given)
    chi_square, dof, share = float(best.at.each.sum()), 2 * (len(weight) - P), 0.0
    unexplained = dof > 0 and chi_square > dof
    if unexplained:
        within = explained is not None and best.settled and explained(unstretch(best.d))
        unexplained = not within if explained is not None else tail(chi_square, dof) < 1 - UNEXPLAINED
    if unexplained:
        best, share = _explained(fit, first, chi_square / dof, dof)
    moved = np.zeros((len(y), 2 * P, 2 * P + 2))
    moved[used] = derivatives(best.problem, best.at, best.d)
    return Effective(
        weights=unstretch(best.d),
        covariance=covariance(best.problem, best.at),
        chi_square=chi_square,
        dof=dof,
        inflation=float(np.sqrt(chi_square / dof)) if unexplained else 1.0,
        model_error=float(np.sqrt(share * variance)),
        converged=best.settled,
        derivatives=moved,
    )


def widened(C: FloatArray, variance: float) -> FloatArray:
    """Covariances (N, 2P + 2, 2P + 2) with a further variance of both parts of Y."""
    out = C.copy()
    out[:, [0, 1], [0, 1]] += variance
    return out


def _explained(
    fit: Callable[[float, FloatArray], Minimum], first: FloatArray, ratio: float, dof: int
) -> tuple[Minimum, float]:
    """The fit with a further share of the mean variance such that χ² = dof, and the share."""
    from scipy.optimize import brentq

    tried: dict[float, Minimum] = {}

    def excess(share: float) -> float:
        near = min(tried, key=lambda other: abs(other - share), default=None)
        tried[share] = fit(share, first if near is None else tried[near].d)
        return float(tried[share].at.each.sum()) / dof - 1

    low = high = ratio - 1  # χ² falls with the share
    if excess(high) > 0:
        while excess(high := 2 * high) > 0:
            low = high
    else:
        while low > _NO_SHARE and excess(low := low / 2) < 0:
            high = low
    share = brentq(excess, low, high, xtol=_SEARCHED * low, rtol=_SEARCHED) if low > _NO_SHARE else 0.0
    excess(share)
    return tried[share], share


def _step(problem: Problem, at: State) -> tuple[FloatArray, float, bool]:
    """Newton's step, or that of Gauss and Newton; how far it should lead down; whether Q is convex."""
    g = gradient(problem, at)
    J, r = jacobian(problem, at)
    scale = np.linalg.norm(J, axis=0)
    H = hessian(problem, at) / np.outer(scale, scale)
    curvatures = np.linalg.eigvalsh(H)
    convex = bool(curvatures[0] > len(H) * np.finfo(float).eps * curvatures[-1])
    step = -np.linalg.solve(H, g / scale) / scale if convex else -solution(J, r)
    return step, max(float(-g @ step), 0.0), convex
