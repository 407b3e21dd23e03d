"""The algorithm of [F]: Gauss–Newton steps on sensitivity functions U, dU/dt = f_x U + f_θ.

    Δβ = (∫ UᵀU dt)⁻¹ ∫ Uᵀ (ȳ − y) dt,    I(β) = ∫ (ȳ − y)ᵀ (ȳ − y) dt,

the integrals as sums over the samples; the factor Δt of both cancels in Δβ, and stands in I(β). The whole
step is taken, without safeguards and bounds, until |Δβ| < ε or I(β) < ε.
"""

from __future__ import annotations

from typing import Any

import numpy as np

from rotorid.base.arrays import FloatArray
from rotorid.base.text import counted
from rotorid.identify.ode import SimulationError
from rotorid.identify.record_residuals import Iterations, Problem, at, negligible
from rotorid.regression.estimate import Estimate


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
    steps = Steps(problem, theta, r, max_iterations, epsilon)
    step = problem.linear_fit(U, -r, theta)
    for count in range(1, max_iterations + 1):
        new, last = theta + step.solution, step
        try:
            r, U = problem.evaluate(new)
        except SimulationError as error:
            steps.message = f"Gauss–Newton diverged after {counted(count - 1, 'iteration')}: {error}"
            break
        theta = new
        steps.append(theta, r)
        step = problem.linear_fit(U, -r, theta)
        short = negligible(last.solution, theta, last, (1e-9, 1e-5))
        # a minimum, not only a short step: the next one is no longer either
        if steps.end(last.solution, short, negligible(step.solution, theta, step, steps.near)):
            break
    return steps.result(step, problem.evaluate(theta)[0])


class Steps:
    """What an iteration passes, and when it ends."""

    def __init__(
        self, problem: Problem, theta: FloatArray, r: FloatArray, max_iterations: int, epsilon: float | None
    ) -> None:
        self.problem, self.epsilon = problem, epsilon
        self.history: list[FloatArray] = []
        self.costs: list[float] = []
        self.integrals: list[float] = []
        self.converged, self.message = False, f"not converged in {counted(max_iterations, 'iteration')}"
        self.ended: str | None = None
        self.near = (1e-8, 1e-5) if epsilon is None else (1e-6, 0.1)
        """Limits of a next step that no longer matters, see `negligible`."""
        self.append(theta, r)

    def append(self, theta: FloatArray, r: FloatArray) -> None:
        """Parameters and residuals of an iteration; I(β): each sample times the step before it."""
        widths = [np.diff(record.t, prepend=record.t[0]) for record in self.problem.records]
        rows = self.problem.vector([np.tile(h[:, None], len(self.problem.model.outputs)) for h in widths])
        self.history.append(theta)
        self.costs.append(self.problem.cost(r, theta))
        self.integrals.append(float(self.problem.plain(rows) @ self.problem.plain(r) ** 2))

    def end(self, step: FloatArray, short: bool, settled: bool) -> bool:
        """Whether a step ends it, by step 5 of [F], or without ε if it is short; settled: at a minimum."""
        by = "step" if short and self.epsilon is None else None
        if self.epsilon is not None:
            small = np.abs(step).max() < self.epsilon
            by = "step" if small else "cost" if self.integrals[-1] < self.epsilon else None
        if by is None or not (settled or self.epsilon is not None):
            return False
        self.ended, self.converged = by, settled
        words = f"converged in {counted(len(self.history) - 1, 'iteration')}"
        if self.epsilon is not None:
            words += f": {'|Δβ|' if by == 'step' else 'I(β)'} is below {self.epsilon:g}"
        self.message = (
            words if settled else f"not {words}, but the next step still matters; lower --tolerance"
        )
        return True

    def result(self, step: Estimate, r: FloatArray, **more: Any) -> Iterations:  # noqa: ANN401
        """All of it, with the estimate of a step as one of the parameters, and residuals there."""
        estimate = at(step, self.history[-1], r)
        path = np.array(self.history), np.array(self.costs), self.converged, self.message
        return Iterations(estimate, *path, **more, integrals=tuple(self.integrals), stopped_by=self.ended)
