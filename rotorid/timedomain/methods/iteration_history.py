"""History of the iterations of a fit, and the kernel's judgement at their end."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from rotorid.base.arrays import FloatArray
from rotorid.base.text import counted
from rotorid.regression.estimate import Estimate
from rotorid.regression.nonlinear import NonlinearEstimate


@dataclass(frozen=True, eq=False)
class Path(NonlinearEstimate):
    """Iterations of one method; costs are NaN where they were not computed.

    Attributes
    ----------
    trajectories
        Quasilinearization: the states (n, n_x) of each record at the start and after each iteration.
    stopped_by
        What ended Gauss–Newton or quasilinearization: "step" |Δβ| or "cost" I(β), see `Stop`; None: neither.
    """

    trajectories: tuple[tuple[FloatArray, ...], ...] = ()
    stopped_by: str | None = None

    def after(self, before: FloatArray) -> Path:
        """The same, as the continuation of earlier steps, (k, n)."""
        costs = np.append(np.full(len(before), np.nan), self.costs)
        return replace(self, history=np.vstack((before, self.history)), costs=costs)


def at(found: Estimate, theta: FloatArray, residuals: FloatArray) -> Estimate:
    """The estimate of a step, as one of the parameters themselves."""
    values = np.where(np.isnan(found.values), np.nan, theta)
    chi = float(residuals @ residuals) if found.errors_stated else None
    return replace(found, values=values, solution=theta, residuals=residuals, chi_square=chi)


@dataclass(frozen=True)
class Stop:
    """When an iteration ends: where no step matters (None), or with [F] at Δβ < ε or I(β) < ε.

    Here ε, the `tolerance`, is a part of each parameter, and of I(β), half the sum of squares, its change.
    """

    tolerance: float | None = None

    def __post_init__(self) -> None:
        if self.tolerance is not None and not 0 < self.tolerance < 1:
            raise ValueError(f"the tolerance is a number between 0 and 1, not {self.tolerance:g}")

    @property
    def near(self) -> tuple[float, float]:
        """Limits of a next step that no longer matters, see `negligible`."""
        return (1e-8, 1e-5) if self.tolerance is None else (1e-6, 0.1)

    @property
    def short(self) -> tuple[float, float]:
        """Limits of the step that ends it."""
        return (1e-9, 1e-5) if self.tolerance is None else (self.tolerance, 0.0)

    def met(self, short: bool, costs: Sequence[float]) -> str | None:
        """Which condition a step meets, "step" or "cost"; whether it is `short`, and the costs up to it."""
        if short or self.tolerance is None:
            return "step" if short else None
        return "cost" if abs(costs[-1] - costs[-2]) < self.tolerance * costs[-1] else None

    def words(self, by: str, iterations: int, converged: bool) -> str:
        """How it ended."""
        said, ε = f"converged in {counted(iterations, 'iteration')}", self.tolerance
        if ε is None:
            return said
        said += f": |Δβ| is below {ε:g} |β|" if by == "step" else f": I(β) changes by less than {ε:g} of it"
        return said if converged else f"not {said}, but the next step still matters; lower --tolerance"


def negligible(
    step: FloatArray,
    theta: FloatArray,
    found: Estimate,
    limits: tuple[float, float],
    before: FloatArray | None = None,
) -> bool:
    """Whether what follows a step no longer matters: relative to the parameters, or to their errors.

    With the step before this one, the next is taken to be smaller by the same factor: where the convergence
    is quadratic it is smaller still.
    """
    # all components: the step has no part that the data do not determine, and vanishes with the combinations
    size, value = np.abs(step), np.abs(theta)
    if before is not None:
        size = size * min(1.0, float(size.max()) / max(float(np.abs(before).max()), 1e-300))
    limit = limits[0] * np.maximum(value, 1e-6 * float(value.max()))
    if found.std is not None:
        limit = np.maximum(limit, limits[1] * np.nan_to_num(found.std))
    return bool((size <= limit).all())


def half_square(r: FloatArray, prior: FloatArray | None = None) -> float:
    """The cost of residuals, and of those of a prior."""
    return 0.5 * float(r @ r) + (0.0 if prior is None else 0.5 * float(prior @ prior))
