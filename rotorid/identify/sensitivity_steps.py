"""The algorithm of [F]: Gauss–Newton steps on sensitivity functions U, dU/dt = f_x U + f_θ.

    Δβ = (∫ UᵀU dt)⁻¹ ∫ Uᵀ (ȳ − y) dt,    I(β) = ∫ (ȳ − y)ᵀ (ȳ − y) dt,

the integrals as sums over the samples; the factor Δt of both cancels in Δβ, and stands in I(β). The whole
step is taken, without safeguards and bounds, until |Δβ| < ε or I(β) < ε.
"""

from __future__ import annotations

import numpy as np

from rotorid.base.arrays import FloatArray
from rotorid.base.text import counted
from rotorid.identify.ode import SimulationError
from rotorid.identify.record_residuals import Iterations, Problem, at, negligible


def sensitivity_steps(
    problem: Problem, start: FloatArray, *, max_iterations: int, epsilon: float | None
) -> Iterations:
    """Steps 1 to 5 of [F], again and again.

    Parameters
    ----------
    problem
        Residuals and sensitivities; with its integrator "rk4" the Runge–Kutta method that is printed.
    start
        First parameters (n,).
    max_iterations
        Steps at most.
    epsilon
        ε, in the units of β and of I(β); None: end where no further step would matter.

    Raises
    ------
    SimulationError
        The states diverge with the starting values.
    """
    theta = start.copy()
    r, U = problem.evaluate(theta)
    history, costs, integrals = [theta], [problem.cost(r, theta)], [quality(problem, r)]
    step = problem.linear_fit(U, -r, theta)
    converged, message = False, f"not converged in {counted(max_iterations, 'iteration')}"
    ended: str | None = None
    for count in range(1, max_iterations + 1):
        new, last = theta + step.solution, step.solution
        try:
            r, U = problem.evaluate(new)
        except SimulationError as error:
            message = f"Gauss–Newton diverged after {counted(count - 1, 'iteration')}: {error}"
            break
        theta = new
        history.append(theta)
        costs.append(problem.cost(r, theta))
        integrals.append(quality(problem, r))
        short = negligible(last, theta, step, (1e-9, 1e-5))
        step = problem.linear_fit(U, -r, theta)
        # a minimum, not only a short step: the next one is no longer either
        near = (1e-8, 1e-5) if epsilon is None else (1e-6, 0.1)
        ended = stop(last, short, epsilon, integrals[-1])
        converged = ended is not None and negligible(step.solution, theta, step, near)
        if ended and (converged or epsilon is not None):
            message = ending(ended, count, epsilon, converged)
            break
        ended = None
    path = np.array(history), np.array(costs)
    r = problem.evaluate(theta)[0]
    return Iterations(
        at(step, theta, r), *path, converged, message, (), (), tuple(integrals), stopped_by=ended
    )


def quality(problem: Problem, r: FloatArray) -> float:
    """I(β) of residuals, in the unit of the outputs squared times s: each sample times the step before it."""
    steps = [np.diff(record.t, prepend=record.t[0]) for record in problem.records]
    rows = problem.vector([np.tile(h[:, None], len(problem.model.outputs)) for h in steps])
    return float(problem.plain(rows) @ problem.plain(r) ** 2)


def stop(step: FloatArray, short: bool, epsilon: float | None, integral: float) -> str | None:
    """Which condition of [F] step 5 ends the iteration, "step" or "cost"; without ε a short step does."""
    if epsilon is None:
        return "step" if short else None
    return "step" if np.abs(step).max() < epsilon else "cost" if integral < epsilon else None


def ending(by: str, iterations: int, epsilon: float | None, converged: bool) -> str:
    """How it ended, in words."""
    words = f"converged in {counted(iterations, 'iteration')}"
    if epsilon is None:
        return words
    words += f": {'|Δβ|' if by == 'step' else 'I(β)'} is below {epsilon:g}"
    return words if converged else f"not {words}, but the next step still matters; lower --tolerance"
