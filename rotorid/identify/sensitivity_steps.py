"""The algorithm of [F]: Gauss–Newton steps on sensitivity functions U, dU/dt = f_x U + f_θ.

    Δβ = (∫ UᵀU dt)⁻¹ ∫ Uᵀ (ȳ − y) dt,    I(β) = ∫ (ȳ − y)ᵀ (ȳ − y) dt,

the integrals as sums over the samples; the factor Δt of both cancels in Δβ, and stands in I(β). The whole
step is taken, without safeguards and bounds, until |Δβ| < ε or I(β) < ε.
"""

from __future__ import annotations

from collections.abc import Iterator
from itertools import islice

import numpy as np

from rotorid.base.arrays import FloatArray
from rotorid.base.text import counted
from rotorid.identify.ode import SimulationError
from rotorid.identify.record_least_squares import Iterations, Problem, negligible
from rotorid.regression.estimate import Estimate

Step = tuple[FloatArray, FloatArray, Estimate | None, FloatArray, bool, bool]
"""Parameters and residuals, the linear fit there, the last step, if it is short, if this is a minimum."""


def sensitivity_steps(problem: Problem, theta: FloatArray, near: tuple[float, float]) -> Iterator[Step]:
    """Steps 1 to 5 of [F], again and again.

    Parameters
    ----------
    problem
        Residuals and sensitivities; with its integrator "rk4" the Runge–Kutta method that is printed.
    theta
        First parameters (n,).
    near
        Limits of a next step that no longer matters, see `negligible`.

    Raises
    ------
    SimulationError
        The states diverge.
    """
    step, short = np.full(len(theta), np.inf), False
    while True:
        r, U = problem.evaluate(theta)
        fitted = problem.linear_fit(U, -r, theta)
        # a minimum, not only a short step: the next one is no longer either
        yield theta, r, fitted, step, short, negligible(fitted.solution, theta, fitted, near)
        step, theta = fitted.solution, theta + fitted.solution
        short = negligible(step, theta, fitted, (1e-9, 1e-5))


def iterate(
    problem: Problem, name: str, steps: Iterator[Step], most: int, epsilon: float | None
) -> Iterations:
    """Go on until step 5 of [F] ends it, or without ε a short step at a minimum, in so many steps at most."""
    widths = [np.diff(record.t, prepend=record.t[0]) for record in problem.records]
    # the squares of residuals in the units of the outputs, each times the step before it
    width = problem.by_time(widths) / problem.scale**2
    history = []
    costs, integrals = [], []
    converged, message, by, last = False, f"not converged in {counted(most, 'iteration')}", None, None
    try:
        for theta, r, fitted, step, short, settled in islice(steps, most + 1):
            last = fitted
            history.append(theta)
            costs.append(problem.cost(r, theta))
            integrals.append(float(width @ r**2))
            if len(history) == 1:
                continue
            small = short and settled if epsilon is None else np.abs(step).max() < epsilon
            by = "step" if small else "cost" if integrals[-1] < (epsilon or 0.0) else None
            if by:
                converged, message = settled, f"converged in {counted(len(history) - 1, 'iteration')}"
                if epsilon is not None:
                    message += f": {'|Δβ|' if by == 'step' else 'I(β)'} is below {epsilon:g}"
                if not settled:
                    message = f"not {message}, but the next step still matters; lower --tolerance"
                break
    except SimulationError as error:
        if last is None:
            raise
        message = f"{name} diverged after {counted(len(history) - 1, 'iteration')}: {error}"
    assert last is not None
    r = problem.residual(history[-1])
    if not np.isfinite(r).all():
        converged, message, r = False, "not converged: the states diverge", -last.residuals
    return Iterations(
        last.at(history[-1], r),
        np.array(history),
        np.array(costs),
        converged,
        message,
        integrals=tuple(integrals),
        stopped_by=by,
    )
