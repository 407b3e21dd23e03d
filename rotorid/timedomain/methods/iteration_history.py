"""History of the iterations of a fit, and the kernel's judgement at their end."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from rotorid.base.arrays import FloatArray
from rotorid.regression.estimate import Estimate
from rotorid.regression.nonlinear import NonlinearEstimate


@dataclass(frozen=True, eq=False)
class Path(NonlinearEstimate):
    """Iterations of one method; costs are NaN where they were not computed.

    Attributes
    ----------
    trajectories
        Quasilinearization: the states (n, n_x) of each record at the start and after each iteration.
    """

    trajectories: tuple[tuple[FloatArray, ...], ...] = ()

    def after(self, before: FloatArray) -> Path:
        """The same, as the continuation of earlier steps, (k, n)."""
        costs = np.append(np.full(len(before), np.nan), self.costs)
        return replace(self, history=np.vstack((before, self.history)), costs=costs)


def at(found: Estimate, theta: FloatArray, residuals: FloatArray) -> Estimate:
    """The estimate of a step, as one of the parameters themselves."""
    values = np.where(np.isnan(found.values), np.nan, theta)
    chi = float(residuals @ residuals) if found.errors_stated else None
    return replace(found, values=values, solution=theta, residuals=residuals, chi_square=chi)


def negligible(
    step: FloatArray, theta: FloatArray, found: Estimate, tolerance: float, before: FloatArray | None = None
) -> bool:
    """Whether what follows a step no longer matters: relative to the parameters, or to their errors.

    With the step before this one, the next is taken to be smaller by the same factor: where the convergence
    is quadratic it is smaller still.
    """
    # all components: the step has no part that the data do not determine, and vanishes with the combinations
    size, value = np.abs(step), np.abs(theta)
    if before is not None:
        size = size * min(1.0, float(size.max()) / max(float(np.abs(before).max()), 1e-300))
    limit = tolerance * np.maximum(value, 1e-6 * float(value.max()))
    if found.std is not None:
        limit = np.maximum(limit, 1e-5 * np.nan_to_num(found.std))
    return bool((size <= limit).all())


def half_square(r: FloatArray, prior: FloatArray | None = None) -> float:
    """The cost of residuals, and of those of a prior."""
    return 0.5 * float(r @ r) + (0.0 if prior is None else 0.5 * float(prior @ prior))
