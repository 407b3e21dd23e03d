"""Nonlinear least squares: scipy's driver, polished by Gauss–Newton, judged by the kernel.

The driver finds the minimum; the last digits and everything that is said about the result (covariance,
rank, null space in words, intervals) come from `rotorid.regression` applied to the Jacobian at the minimum.
Rules for the covariance are those of the kernel: stated errors give normal intervals, otherwise the variance
of the residuals and Student's t. Output error and time-domain fits share this module.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import ArrayLike

from rotorid.base.arrays import FloatArray
from rotorid.base.choices import find
from rotorid.base.text import counted
from rotorid.regression.estimate import Estimate
from rotorid.regression.prior import Prior
from rotorid.regression.robust import LOSSES
from rotorid.regression.search import Function, Search, inside

Bounds = Mapping[str, tuple[float | None, float | None]]


@dataclass(frozen=True, eq=False)
class NonlinearEstimate:
    """Parameters of a nonlinear model, and how they were found.

    Attributes
    ----------
    estimate
        Values, covariance, rank and null space at the minimum; `residuals` are those of the given function.
        The values of combinations are of the model linearised there. No covariance where the search did not
        converge.
    history
        Parameters at the start and after each accepted step, polishing included, shape (iterations + 1, n).
    costs
        Half the sum of squared residuals (of the loss) at each of them.
    converged, message
        Whether the minimum was reached, and in words.
    at_bounds
        Names of parameters that stand at a bound: kept there, without a standard deviation.
    """

    estimate: Estimate
    history: FloatArray
    costs: FloatArray
    converged: bool
    message: str
    at_bounds: tuple[str, ...] = ()

    @property
    def iterations(self) -> int:
        """Number of steps."""
        return len(self.history) - 1

    @property
    def names(self) -> tuple[str, ...]:
        """Names of the parameters."""
        return self.estimate.names

    @property
    def values(self) -> FloatArray:
        """Parameters (n,); NaN where the data do not determine one."""
        return self.estimate.values

    @property
    def std(self) -> FloatArray | None:
        """Standard deviations (n,); NaN at a bound or where not determined; None where errors are unknown."""
        return self.estimate.std

    @property
    def ci95(self) -> FloatArray | None:
        """95 % intervals (n, 2); NaN at a bound; None where errors are unknown."""
        return self.estimate.ci95

    @property
    def bound_warning(self) -> str:
        """What stands at a bound, in words, or nothing."""
        if not self.at_bounds:
            return ""
        stand = "stands at its bound" if len(self.at_bounds) == 1 else "stand at their bounds"
        return (
            f"{', '.join(self.at_bounds)} {stand}: no standard deviation is given, and those of the others "
            "hold it fixed"
        )

    @property
    def end_warnings(self) -> tuple[str, ...]:
        """What a user must know of the end of the search before trusting the numbers."""
        rank = self.estimate.describe_rank() if self.converged and not self.estimate.full_rank else ""
        return tuple(filter(None, ("" if self.converged else self.message, self.bound_warning, rank)))


def nonlinear_least_squares(  # noqa: PLR0913
    residual: Function,
    jacobian: Function,
    start: ArrayLike,
    *,
    names: Sequence[str],
    sigma_stated: bool,
    bounds: Bounds | None = None,
    loss: str = "linear",
    max_iterations: int = 200,
    near: bool = False,
    prior: Prior | None = None,
) -> NonlinearEstimate:
    """Minimise the sum of squared residuals over the parameters of a nonlinear model.

    Parameters
    ----------
    residual
        Function of the parameters (n,) giving residuals (m,), each divided by its standard deviation where
        errors are stated.
    jacobian
        Their derivatives, (m, n).
    start
        First guess (n,); a value outside its bounds is moved inside.
    names
        Of the parameters.
    sigma_stated
        Whether a residual of 1 means one stated standard deviation (normal intervals, not rescaled).
    bounds
        {name: (lower, upper)}, None for no bound.
    loss
        One of `LOSSES`; with a robust one the spread is taken from the residuals and intervals are Student's.
    max_iterations
        Of the driver.
    near
        The start is near the minimum: Gauss–Newton alone, the driver only if that does not contract.
    prior
        Rows that count with those of the data, in χ² and degrees of freedom, too; not in `residuals`.

    Raises
    ------
    ValueError
        For shapes that do not fit, unknown names or losses, empty bounds, residuals that are not finite at
        the start, a robust loss with a prior.

    Notes
    -----
    Every step of the search solves the linearised problem K δ = −r, [S] (9), with K the Jacobian.

    Examples
    --------
    >>> t = np.array([0.0, 1.0, 2.0, 3.0])
    >>> y = np.array([2.0, 1.21, 0.74, 0.44])
    >>> fit = nonlinear_least_squares(
    ...     lambda x: x[0] * np.exp(-x[1] * t) - y,
    ...     lambda x: np.stack((np.exp(-x[1] * t), -x[0] * t * np.exp(-x[1] * t)), axis=1),
    ...     [1.0, 1.0], names=["a", "k"], sigma_stated=False)
    >>> print(np.round(fit.values, 3), fit.converged)
    [2.    0.501] True
    """
    labels = tuple(names)
    first = np.asarray(start, dtype=np.float64)
    n = len(labels)
    if first.shape != (n,) or n == 0 or len(set(labels)) != n or not np.isfinite(first).all():
        raise ValueError(f"{n} different names need as many finite starting values; got {list(first)}")
    find(LOSSES, loss, "loss")
    lower, upper = _limits(bounds or {}, labels)
    first = inside(first, lower, upper)
    r0 = np.asarray(residual(first), dtype=np.float64)
    if r0.ndim != 1 or not np.isfinite(r0).all():
        raise ValueError("the residuals at the starting values are not finite: choose other starting values")
    if prior is not None and len(prior):
        if loss != "linear":
            raise ValueError("a prior or a ridge needs the loss linear: a robust loss would discount it, too")
        residual, jacobian = prior.beside(residual, jacobian)
    search = Search(labels, residual, jacobian, lower, upper, sigma_stated)
    x, ended, left = first, near and loss == "linear", False
    if ended:
        x, judged, left = search.polish(first)
    if not left:
        x, ended = search.drive(first, loss, max_iterations)
        x, judged, left = search.polish(x)
    converged = ended and left
    if not ended:
        tried = counted(max_iterations, "evaluation")
        why = f"not converged after {tried}: raise max_iterations or start nearer"
    elif not left:
        why = "the minimum was not reached: the last step is not yet small"
    else:
        why = f"converged in {counted(len(search.path) - 1, 'iteration')}"
    if not converged:
        judged = replace(judged, covariance=None, solution_covariance=None)
    judged = replace(judged, residuals=judged.residuals[: len(r0)])
    fixed = (x <= lower) | (x >= upper)
    return NonlinearEstimate(
        estimate=judged,
        history=np.array(search.path),
        costs=np.array(search.costs),
        converged=converged,
        message=why,
        at_bounds=tuple(name for name, f in zip(labels, fixed, strict=True) if f),
    )


def _limits(bounds: Bounds, names: tuple[str, ...]) -> tuple[FloatArray, FloatArray]:
    """Lower and upper bounds (n,), infinite where there are none."""
    if others := bounds.keys() - {*names}:
        raise ValueError(f"bounds are given for {min(others)!r}, which is not estimated: {', '.join(names)}")
    limits = np.array([bounds.get(name, (None, None)) for name in names], dtype=float)
    lower, upper = np.where(np.isnan(limits), (-np.inf, np.inf), limits).T
    for name, low, high in zip(names, lower, upper, strict=True):
        if not low < high:
            raise ValueError(f"the lower bound of {name} must be below the upper one; got {low:g}, {high:g}")
    return lower, upper
