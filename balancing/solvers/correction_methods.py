"""Methods of correction (registry): each solves the stacked equations; a new method goes here.

Every method gets the same stack `Y + W D` and gives weights, their covariance and what it can certify.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace
from functools import partial
from typing import Any

import numpy as np

from balancing.coefficients.identifiability import HOPELESS, UndeterminedError
from balancing.coefficients.run_errors import marginal
from balancing.data.limits import Limits
from balancing.data.reading_errors import mean_variance, symmetric
from balancing.solvers.cone import AT_LIMIT
from balancing.solvers.effective_variance import FLOOR, Effective, effective_variance, widened
from balancing.solvers.error_propagation import common_covariance, correction_jacobian
from balancing.solvers.least_squares_minmax import Criterion, Solution, solve
from balancing.solvers.monte_carlo import sampled_covariance
from balancing.solvers.regularised import Regularised, ridge, truncated
from balancing.solvers.weighted_limits import (
    RIVAL,
    SETTLED_DRAWN,
    LimitedProblem,
    descend_all,
    limited_fit,
    limited_problem,
)
from rotorid.base.arrays import BoolArray, ComplexArray, FloatArray
from rotorid.base.registry import Method, find

NO_EFFECT = 1e-6
"""Share of the largest singular value below which a combination of planes has no effect."""


@dataclass(frozen=True, eq=False)
class Stack:
    """The equations of all chosen readings, one below the other.

    Attributes
    ----------
    W, Y
        Influence coefficients (N, P) and vibration of the bare rotor (N,).
    channels
        Covariance of (Re Y, Im Y, Re W₁, …) of each reading by errors of its own, (N, 2P + 2, 2P + 2); None:
        unknown.
    common
        What the readings have in common, as `balancing.Influence.common`.
    explained
        Whether the errors explain what weights leave.
    parameters
        Errors of a model's parameters, as `balancing.Influence.parameters`.
    row_weights
        How much each reading counts, (N,); None: all alike.
    limits
        Of weights and amplitudes; None: no limits.
    planes, readings
        Names of the planes, and what to call each reading.
    amplitude, weight
        Write an amplitude or a weight with its unit.
    """

    W: ComplexArray
    Y: ComplexArray
    channels: FloatArray | None
    row_weights: FloatArray | None
    limits: Limits | None
    planes: tuple[str, ...]
    readings: tuple[str, ...]
    amplitude: Callable[[float], str]
    weight: Callable[[float], str]
    common: ComplexArray | None = None
    explained: Callable[[ComplexArray], bool] | None = None
    parameters: ComplexArray | None = None


@dataclass(frozen=True, eq=False)
class Fitted:
    """Weights of one method.

    Attributes
    ----------
    weights
        Shape (P,).
    covariance
        (2P, 2P); None where errors are unknown.
    parts
        What of it comes from own errors, those common at a speed, to a run, and of a model's parameters, four
        times (2P, 2P).
    gap
        Certified relative distance from the optimum; None for a closed form or a search.
    chi_square, dof
        Of the weighted fit: how well these weights explain the readings.
    explained
        Whether errors alone may leave so much.
    active_weights, active_residuals
        Limits that bind, (P,) and (N,).
    warnings
        What the user should know.
    """

    weights: ComplexArray
    covariance: FloatArray | None
    parts: tuple[FloatArray, ...] = ()
    gap: float | None = None
    chi_square: float | None = None
    dof: int | None = None
    explained: bool = True
    active_weights: BoolArray | None = None
    active_residuals: BoolArray | None = None
    warnings: tuple[str, ...] = ()


def fit_weights(
    stack: Stack, method: str, *, strength: float | str | None = None, keep: float | None = None
) -> Fitted:
    """Weights by one of the methods.

    Parameters
    ----------
    stack
        Equations, errors, limits.
    method
        One of `METHODS`.
    strength
        Ridge: how strongly large weights are avoided, relative; "auto".
    keep
        Truncation: number of combinations of planes to keep, or the smallest singular value relative to the
        largest.

    Raises
    ------
    ValueError
        For an unknown method, combinations that are not offered, limits that cannot be met.
    UndeterminedError
        Where the readings do not tell the planes apart and neither ridge nor truncation is asked for.
    """
    fit = find(METHODS, method, "method").function
    asked = [(v, how) for v, how in zip(VARIANTS, (strength, keep), strict=True) if how is not None]
    if not asked:
        return fit(stack)
    if len(asked) > 1:
        raise ValueError("ridge and truncation are two ways to the same end: choose one")
    if method != "least-squares" or (stack.limits is not None and stack.limits.any):
        raise ValueError("ridge and truncation go with least squares without limits only")
    ((variant, how),) = asked
    return variant.function(stack, how)


def _plain(method: Criterion, stack: Stack) -> Fitted:
    found = _solve(stack, method, stack.W, stack.Y, stack.row_weights)
    bound = found.gap is not None  # limits that do not bind leave the closed form
    covariance: FloatArray | None = None
    parts: tuple[FloatArray, ...] = ()
    words: tuple[str, ...] = ()
    if stack.channels is not None:
        parts = _propagated(stack, found.weights, stack.row_weights)
        covariance = symmetric(sum(parts[1:], parts[0]))
        if method != "least-squares" or bound:
            covariance, words = _sampled(
                stack, lambda W, Y: _solve(stack, method, W, Y, stack.row_weights).weights, stack.channels
            )
    return Fitted(
        found.weights,
        covariance,
        parts,
        found.gap,
        active_weights=found.active_weights,
        active_residuals=found.active_residuals,
        warnings=words,
    )


def _solve(
    stack: Stack, method: Criterion, W: ComplexArray, Y: ComplexArray, row_weights: FloatArray | None
) -> Solution:
    return solve(
        W,
        Y,
        method=method,
        row_weights=row_weights,
        limits=stack.limits,
        names=stack.planes,
        readings=stack.readings,
        amplitude=stack.amplitude,
        weight=stack.weight,
    )


def _propagated(stack: Stack, D: ComplexArray, row_weights: FloatArray | None) -> tuple[FloatArray, ...]:
    """First-order covariances of least squares with row weights, those of the scaled rows: `Fitted.parts`."""
    assert stack.channels is not None
    w = np.ones(len(stack.Y)) if row_weights is None else row_weights
    W, r = w[:, None] * stack.W, w * (stack.Y + stack.W @ D)
    J = w[:, None, None] * correction_jacobian(W, D, r)
    own = symmetric(np.sum(J @ stack.channels @ np.swapaxes(J, 1, 2), axis=0))
    return (own, *common_covariance(J, stack.common, stack.parameters))


def _weighted(stack: Stack) -> Fitted:
    if stack.channels is None:
        if stack.row_weights is None:
            raise ValueError(
                "the method weighted needs errors of the readings ([errors], --amplitude-error, "
                "--phase-error or repeated readings), or weights of sensors or speeds"
            )
        note = "the errors of the readings are unknown: they count by the weights of sensors and speeds alone"
        plain = _plain("least-squares", stack)
        return replace(plain, warnings=(note,))
    free = effective_variance(
        stack.W, stack.Y, stack.channels, row_weights=stack.row_weights, explained=stack.explained
    )
    if not free.converged:
        raise UndeterminedError(
            "the trial runs tell too little of the planes for the weighted fit: its weights grow without "
            "bound; use larger trial weights, fewer planes or another method"
        )
    if stack.limits is None:
        return _unlimited(stack, free)
    return _weighted_within(stack, stack.channels, stack.limits, free)


def _unlimited(stack: Stack, free: Effective) -> Fitted:
    parts = (free.covariance, *common_covariance(free.derivatives, stack.common, stack.parameters))
    total = symmetric(sum(parts[1:], parts[0]))
    told = free.model_error == 0
    return Fitted(free.weights, total, parts, chi_square=free.chi_square, dof=free.dof, explained=told)


def _weighted_within(stack: Stack, channels: FloatArray, limits: Limits, free: Effective) -> Fitted:
    """The weighted fit within limits; `free` is the one without."""
    first = _solve(stack, "least-squares", stack.W, stack.Y, stack.row_weights)  # names limits in conflict

    def given(W: ComplexArray, Y: ComplexArray, model_error: float) -> LimitedProblem:
        return limited_problem(W, Y, _regular(channels, model_error), stack.row_weights, limits)

    problem = given(stack.W, stack.Y, free.model_error)
    ends = limited_fit(problem, (free.weights, first.weights))
    D = ends[0].weights
    if problem.kept(free.weights) and np.allclose(D, free.weights, rtol=1e-6, atol=0.0):  # no limit binds
        return _unlimited(stack, free)
    rivals = [end.weights for end in ends if end.objective <= ends[0].objective + RIVAL]

    def again(W: ComplexArray, Y: ComplexArray) -> ComplexArray:
        found = descend_all(given(W, Y, free.model_error), rivals, SETTLED_DRAWN)
        return min(found, key=lambda end: end.objective).weights

    # with what explains the residuals, as the ± without limits are
    covariance, words = _sampled(stack, again, _regular(channels, free.model_error))
    if free.inflation > 1:
        words += (
            "even without the limits, weights in these planes do not explain the vibration: what would be "
            f"left is {free.inflation:.2g} times as large as the errors of the readings; unbalance outside "
            "the planes (or a bow, or a rotor that is not linear) is likely, or errors larger than stated",
        )
    if not ends[0].settled:
        words += (
            "the weighted fit within the limits did not settle: better weights may exist; use larger trial "
            "weights, fewer planes or another method",
        )
    return Fitted(
        D,
        covariance,
        (free.covariance, *common_covariance(free.derivatives, stack.common, stack.parameters)),
        chi_square=given(stack.W, stack.Y, 0.0).chi_square(D),
        dof=free.dof,
        explained=free.model_error == 0,
        active_weights=np.abs(D) >= limits.max_weight * (1 - AT_LIMIT),
        active_residuals=np.abs(stack.Y + stack.W @ D) >= limits.residual.ravel() * (1 - AT_LIMIT),
        warnings=words,
    )


def _regular(channels: FloatArray, model_error: float) -> FloatArray:
    """Errors of the readings with the further one that explains the residuals, and none that is exactly 0."""
    least = FLOOR**2 * float(mean_variance(channels[:, :2, :2]).mean())
    return widened(channels, model_error**2 + least)


def _sampled(
    stack: Stack, solver: Callable[[ComplexArray, ComplexArray], ComplexArray], channels: FloatArray
) -> tuple[FloatArray | None, tuple[str, ...]]:
    """Covariance of a solver's weights; None and words where most drawn readings cannot keep the limits."""
    common, known = stack.common, stack.parameters
    try:
        return sampled_covariance(solver, stack.W, stack.Y, channels, common=common, parameters=known), ()
    except ValueError as error:
        return None, (str(error),)


def _ridge(stack: Stack, strength: float | str) -> Fitted:
    total = stack.channels
    if total is not None:
        shared = marginal(stack.common, stack.parameters)
        total = total + shared.reshape(-1, *shared.shape[2:])
    found = ridge(
        stack.W,
        stack.Y,
        strength,
        stack.row_weights,
        channels=stack.channels,
        total=total,
        planes=stack.planes,
    )
    return Fitted(found.weights, _with_model(stack, found), warnings=(found.words,))


def _with_model(stack: Stack, found: Regularised) -> FloatArray | None:
    """Covariance with what errors of a model's parameters do."""
    if found.covariance is None:
        return None
    return symmetric(found.covariance + common_covariance(found.jacobian, None, stack.parameters)[2])


def _truncated(stack: Stack, keep: float) -> Fitted:
    found = truncated(stack.W, stack.Y, keep, stack.row_weights, channels=stack.channels, planes=stack.planes)
    words = [found.words]
    if found.kept:
        share = float(found.singular_values[found.kept - 1] / found.singular_values[0])
        if share < NO_EFFECT:
            raise UndeterminedError(
                f"of the {found.kept} combinations of planes to keep, the last has no effect ({share:.1g} "
                "of that of the first): keep fewer"
            )
        if share < 1 / HOPELESS:
            words.append(
                f"the last combination of planes that is kept has only {share:.1g} of the effect of the "
                "first: no instrument measures that; keep fewer"
            )
    return Fitted(found.weights, _with_model(stack, found), warnings=tuple(words))


METHODS: tuple[Method[Callable[[Stack], Fitted]], ...] = (
    Method("weighted", "every reading counts by its error, that of the coefficients included", _weighted),
    Method(
        "least-squares",
        "the sum of squared amplitudes is the smallest possible",
        partial(_plain, "least-squares"),
        "least squares",
    ),
    Method("minmax", "the largest amplitude is the smallest possible", partial(_plain, "minmax"), "min–max"),
)
"""The first is the usual one where errors are known, the second where they are not."""
VARIANTS: tuple[Method[Callable[[Stack, Any], Fitted]], ...] = (
    Method("ridge", "small weights where planes act alike", _ridge),
    Method("truncated", "combinations of planes that hardly act stay without weights", _truncated),
)
"""Of least squares without limits; what they take is the strength, and what to keep."""
