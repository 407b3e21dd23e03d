"""The fit by errors within limits: sequential cone programs.

The objective Q(D) of `balancing.solvers.effective_variance` is expanded about the last weights D_k with its
exact gradient g and a Hermitian matrix H, the part of its Hessian that a complex matrix can express (for
errors that are alike in both directions all of it):

    Q(D) ≈ Q(D_k) + 2 Re gᴴ (D − D_k) + (D − D_k)ᴴ H (D − D_k) = |U (D − D_k) + U⁻ᴴ g|² + const.,   H = Uᴴ U,

a least-squares problem with P rows, which `balancing.solvers.solve` takes with all limits; the readings stand
beside them with weight 0, for their limits. Where the steps end, the exact gradient fulfils the conditions of
the optimum, so the answer passes without a jump into that without limits.
"""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from balancing.data.limits import Limits
from balancing.solvers import likelihood
from balancing.solvers.solve import Solution
from rotorid.base.arrays import ComplexArray, FloatArray
from rotorid.regression import stretch, unstretch

Search = Callable[[ComplexArray, ComplexArray, FloatArray, Limits], Solution]
"""Least squares with limits of W, Y, row weights and limits."""

STEPS = 50
SETTLED = 1e-9


def limited_fit(
    W: ComplexArray,
    Y: ComplexArray,
    channels: FloatArray,
    row_weights: FloatArray | None,
    limits: Limits,
    start: ComplexArray,
    search: Search,
    *,
    steps: int = STEPS,
) -> Solution:
    """Weights that minimise the sum of squared residuals in units of their errors, within limits.

    Parameters
    ----------
    W, Y, channels, row_weights
        As in `balancing.solvers.effective_variance.effective_variance`, with regular errors of every reading.
    limits
        Of these planes and readings.
    start
        Weights without limits, (P,).
    search
        Solves the linearised problems.
    steps
        At most; one is enough for weights that scatter about those of the limited fit.

    Returns
    -------
    Solution
        Its residual is Y + W D; the gap is that of the last linearised problem.

    Raises
    ------
    ValueError
        Limits that cannot be met.
    """
    N, P = W.shape
    problem = likelihood.problem_of(W, Y, channels, np.ones(N) if row_weights is None else row_weights)
    stacked = Limits(
        limits.max_weight,
        np.concatenate((np.full(P, np.inf), limits.residual.ravel()))[None],
        limits.forbidden,
    )
    rows = np.concatenate((np.ones(P), np.zeros(N)))
    D = start
    for _ in range(steps):
        at = likelihood.evaluate(problem, stretch(D))
        J = likelihood.jacobian(problem, at)[0]
        U = _root(likelihood.hessian(problem, at), J.T @ J)
        g = unstretch(likelihood.gradient(problem, at))
        target = np.linalg.solve(U.conj().T, g) - U @ D
        found = search(np.vstack((U, W)), np.concatenate((target, Y)), rows, stacked)
        step, D = np.abs(found.weights - D).max(), found.weights
        if step <= SETTLED * max(float(np.abs(D).max()), 1e-300):
            break
    return Solution(
        weights=D,
        residual=Y + W @ D,
        method="least-squares",
        objective=found.objective,
        gap=found.gap,
        active_weights=found.active_weights,
        active_residuals=found.active_residuals[P:],
    )


def _root(hessian: FloatArray, positive: FloatArray) -> ComplexArray:
    """U with Uᴴ U the Hermitian part of a stretched Hessian, or of a positive one instead."""
    for matrix in (hessian, positive):
        blocks = matrix.reshape(len(matrix) // 2, 2, -1, 2)
        H = (blocks[:, 0, :, 0] + blocks[:, 1, :, 1]) / 2 + 1j * (blocks[:, 1, :, 0] - blocks[:, 0, :, 1]) / 2
        try:
            return np.asarray(np.linalg.cholesky((H + H.conj().T) / 2).conj().T)
        except np.linalg.LinAlgError:
            continue
    raise ValueError("the fit by errors has no curvature: the trial runs tell too little of the planes")
