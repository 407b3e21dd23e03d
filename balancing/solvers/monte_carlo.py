"""Monte Carlo errors of weights that no formula gives: solve again for readings drawn from their errors."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
from numpy.typing import ArrayLike

from balancing.data.reading_errors import symmetric
from balancing.solvers.conditioning import check_channels, check_stack
from rotorid.base.arrays import ComplexArray, FloatArray
from rotorid.regression import covariance_root, stretch

Solver = Callable[[ComplexArray, ComplexArray], ComplexArray]

MOST_SKIPPED = 0.2
"""Share of the draws that the solver may fail at."""


def sampled_covariance(
    solver: Solver,
    W: ArrayLike,
    Y: ArrayLike,
    channels: ArrayLike,
    draws: int = 400,
    seed: int = 0,
    common: ComplexArray | None = None,
    parameters: ComplexArray | None = None,
) -> FloatArray:
    """Covariance of the weights of any solver, from readings drawn at random from their errors.

    Parameters
    ----------
    solver
        Takes coefficients (N, P) and vibration (N,), returns weights (P,); may raise ValueError where there
        is no solution.
    W, Y
        Coefficients stacked over speeds and sensors, shape (N, P), and vibration (N,), around which is drawn.
    channels
        Covariance of (Re Y, Im Y, Re W₁, …) of each reading, shape (N, 2P + 2, 2P + 2); may be singular.
    draws
        How many; standard deviations have a relative error of 1/√(2 draws), 3.5 % for 400.
    common, parameters
        What else the readings have in common, and errors of parameters, as of `balancing.Influence`.
    seed
        The same seed gives the same draws.

    Returns
    -------
    Of (Re D₁, Im D₁, …), shape (2P, 2P): the scatter of the solutions around their mean. A weight that a
    limit holds scatters along the limit only.

    Raises
    ------
    ValueError
        For shapes that do not fit, NaN, too few draws, and if more than 20 % of the draws have no solution.
    """
    w, y, _ = check_stack(W, Y)
    C = check_channels(channels, w)
    N, P = w.shape
    n = 2 * P + 2
    if draws <= n:
        raise ValueError(f"{P} planes need more than {n} draws to have a covariance; got {draws}")
    root = covariance_root(C, np.einsum("nii->ni", C))
    rng = np.random.default_rng(seed)
    mean = np.column_stack((y, w))
    found = []
    words = ""
    for _ in range(draws):
        errors = (root @ rng.standard_normal((N, n, 1)))[..., 0]
        drawn = mean + (errors[:, ::2] + 1j * errors[:, 1::2])
        if common is not None:
            drawn += _shared(rng, common)
        if parameters is not None:
            drawn += np.tensordot(rng.standard_normal(len(parameters)), parameters, 1).reshape(N, -1)
        try:
            D = np.asarray(solver(drawn[:, 1:].copy(), drawn[:, 0].copy()), dtype=complex)
        except ValueError as error:
            words = f" (the last one: {error})"
            continue
        if D.shape != (P,):
            raise ValueError(f"the solver must return {P} weights; it returned shape {D.shape}")
        if np.isfinite(D).all():
            found.append(stretch(D))
    skipped = draws - len(found)
    if skipped > MOST_SKIPPED * draws:
        raise ValueError(
            f"the errors of the weights cannot be stated: with readings changed within their errors, "
            f"{skipped} of {draws} problems have no solution{words}; widen the limits, or measure better"
        )
    return symmetric(np.atleast_2d(np.cov(np.array(found).T)))


def _shared(rng: np.random.Generator, common: ComplexArray) -> ComplexArray:
    """Errors (N, P + 1) of columns that readings have in common."""
    _, M, S, C, n = common.shape
    a, b = rng.standard_normal((2, M, S + 1))
    number = a + 1j * b
    run = np.einsum("m,mscp->scp", number[:, 0], common[0])
    return np.asarray(run + np.einsum("ms,mscp->scp", number[:, 1:], common[1])).reshape(S * C, n)
