"""Gauss–Newton on sensitivity functions: the plain method of [F]."""

from __future__ import annotations

import numpy as np

from rotorid.base.arrays import FloatArray
from rotorid.base.text import counted
from rotorid.timedomain.integration.simulate import SimulationError
from rotorid.timedomain.methods.iteration_history import Path, Stop, at, half_square, negligible
from rotorid.timedomain.methods.least_squares_problem import Problem


def gauss_newton(problem: Problem, start: FloatArray, *, max_iterations: int, stop: Stop) -> Path:
    """Solve K δ = −r with the sensitivities K = ∂y/∂θ, and add δ; again, until δ is negligible.

    The whole step is taken, without safeguards, and without bounds: from a bad start it may diverge, which
    is said. Source: [F], dU/dt = f_x U + f_θ.

    Parameters
    ----------
    problem
        Residuals and sensitivities.
    start
        First parameters (n,).
    max_iterations
        Steps at most.
    stop
        When to end.

    Raises
    ------
    SimulationError
        The states diverge with the starting values.
    """
    theta = start.copy()
    r, K = problem.evaluate(theta)
    history, costs = [theta], [half_square(r, problem.prior.residual(theta))]
    found = problem.linear_fit(K, -r, theta)
    converged, message = False, f"not converged in {counted(max_iterations, 'iteration')}"
    ended: str | None = None
    for _ in range(max_iterations):
        new = theta + found.solution
        try:
            if not np.isfinite(new).all():
                raise SimulationError("the parameters grow beyond all bounds")
            r, K = problem.evaluate(new)
        except SimulationError as error:
            message = f"Gauss–Newton diverged after {counted(len(history) - 1, 'iteration')}: {error}"
            break
        step, theta = found.solution, new
        history.append(theta)
        costs.append(half_square(r, problem.prior.residual(theta)))
        met = stop.met(negligible(step, theta, found, stop.short), costs)
        found = problem.linear_fit(K, -r, theta)
        # a minimum, not only a short step: the next one is no longer either
        converged = met is not None and negligible(found.solution, theta, found, stop.near)
        if met and (converged or stop.tolerance is not None):
            ended, message = met, stop.words(met, len(history) - 1, converged)
            break
    r, _ = problem.evaluate(theta)
    path, size = np.array(history), np.array(costs)
    return Path(at(found, theta, r), path, size, converged, message, stopped_by=ended)
