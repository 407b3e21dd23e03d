"""Nonlinear least squares: scipy's driver, polished by Gauss–Newton, judged by the linear kernel.

The driver finds the minimum; the last digits and everything that is said about the result (covariance,
rank, null space in words, intervals) come from `rotorid.regression` applied to the Jacobian at the minimum.
Rules for the covariance are those of the kernel: stated errors give normal intervals, otherwise the variance
of the residuals and Student's t. Output error and time-domain fits share this module.

The loss "huber" counts a residual above 1.345 standard deviations by its size, not its square: there it loses
5 % of efficiency on normal errors. Its covariance is the classical one of an M-estimator, s² (JᵀJ)⁻¹ with s²
from the pseudo-residuals ψ(r) over the mean of ψ′ (P. J. Huber, Robust Statistics, 1981, section 7.6).
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field, replace
from itertools import compress

import numpy as np
from numpy.typing import ArrayLike

from rotorid.base.arrays import FloatArray
from rotorid.base.choices import one_of
from rotorid.base.text import counted
from rotorid.regression.estimate import Estimate
from rotorid.regression.linear import JACOBIAN_RCOND, least_squares, solution
from rotorid.regression.prior import Function, Prior

LOSSES = ("linear", "huber")
HUBER = 1.345
"""Standard deviations from which on the loss "huber" counts a residual less."""
TOLERANCE = 1e-9
"""The driver's tolerances on cost, step and gradient, before polishing."""
POLISH = 25
"""Gauss–Newton steps at most after the driver."""
NEGLIGIBLE = 1e-6
"""Share of what the other parameters do below which one has no size of its own."""
TINY = float(np.finfo(float).tiny ** 0.5)


@dataclass(frozen=True, eq=False)
class NonlinearEstimate:
    """Parameters of a nonlinear model, and how the search for them went.

    Attributes
    ----------
    estimate
        Values, covariance, rank and null space at the minimum; `residuals` are those of the given function.
        The values of combinations are of the model linearised there. No covariance where the search did not
        converge, NaN in it at a bound.
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
    def values(self) -> FloatArray:
        """Parameters (n,); NaN where the data do not determine one."""
        return self.estimate.values

    @property
    def ci95(self) -> FloatArray | None:
        """95 % intervals (n, 2); NaN at a bound; None where errors are unknown."""
        return self.estimate.ci95

    @property
    def bound_warning(self) -> str:
        """What stands at a bound, in words, or nothing."""
        words = " stands at its bound: no standard deviation is given, and those of the others hold it fixed"
        return " and ".join(self.at_bounds) + words if self.at_bounds else ""


def nonlinear_least_squares(  # noqa: PLR0913
    residual: Function,
    jacobian: Function,
    start: ArrayLike,
    *,
    names: Sequence[str],
    sigma_stated: bool,
    bounds: ArrayLike = (-np.inf, np.inf),
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
        Lower and upper bounds of the parameters, (n, 2) or the same (2,) for all; NaN or ±inf for none.
    loss
        One of `LOSSES`; with "huber" the spread is taken from the residuals and intervals are Student's.
    max_iterations
        Of the driver.
    near
        The start is near the minimum: Gauss–Newton alone, the driver only if that does not contract.
    prior
        Rows that count with those of the data, in χ² and degrees of freedom, too; not in `residuals`.

    Raises
    ------
    ValueError
        For an unknown loss, empty bounds, residuals that are not finite at the start, a robust loss with a
        prior.

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
    labels, robust = tuple(names), one_of(loss, "loss", LOSSES) != "linear"
    limits = np.array(bounds, dtype=np.float64)
    limits = np.where(np.isnan(limits), (-np.inf, np.inf), limits)
    lower, upper = np.broadcast_to(limits, (len(labels), 2)).T
    first = np.clip(np.asarray(start, dtype=np.float64), lower, upper)
    rows = len(r0 := residual(first))
    if not np.isfinite(r0).all():
        raise ValueError("the residuals at the starting values are not finite: choose other starting values")
    if prior:
        if robust:
            raise ValueError("a prior or a ridge needs the loss linear: a robust loss would discount it, too")
        residual, jacobian = prior.beside(residual, jacobian)
    search = _Search(labels, residual, jacobian, lower, upper, sigma_stated)
    x, why, small = first, "", False
    if near and not robust:
        x, estimate, small = search.polish(first)
    if not small:
        x, ended = search.drive(first, robust, max_iterations)
        x, estimate, small = search.polish(x)
        if not (small and ended):
            why = "not converged: raise max_iterations or start nearer"
    at_bounds = (x <= lower) | (x >= upper)
    unknown = np.where(at_bounds, np.nan, 0.0)
    covariance, of_solution = (
        None if why or each is None else each + np.add.outer(unknown, unknown)
        for each in (estimate.covariance, estimate.solution_covariance)
    )
    path, costs = zip(*search.path, strict=True)
    return NonlinearEstimate(
        estimate=replace(
            estimate,
            covariance=covariance,
            solution_covariance=of_solution,
            residuals=estimate.residuals[:rows].copy(),  # not with the slopes that they stand beside
        ),
        history=np.array(path),
        costs=np.array(costs),
        converged=not why,
        message=why or f"converged in {counted(len(path) - 1, 'iteration')}",
        at_bounds=tuple(compress(labels, at_bounds)),
    )


@dataclass(eq=False)
class _Search:
    """One search for n parameters between bounds, with the accepted points it passed and their costs.

    `stated`: a residual of 1 is one stated standard deviation. `limit`: the residual from which on the loss
    is no longer its square.
    """

    names: tuple[str, ...]
    residual: Function
    slopes: Function
    lower: FloatArray
    upper: FloatArray
    stated: bool
    limit: float = np.inf
    path: list[tuple[FloatArray, float]] = field(default_factory=list)

    def drive(self, x: FloatArray, robust: bool, most: int) -> tuple[FloatArray, bool]:
        """Where the driver ends, and whether it converged.

        A robust loss without stated errors takes its scale from the median residual of the search before it.
        """
        from scipy.optimize import least_squares as driver

        self.limit = HUBER if robust and self.stated else np.inf
        for run in range(3 if robust and not self.stated else 1):
            if run:
                r = np.abs(self.residual(x))
                self.limit = HUBER * max(1.4826 * float(np.median(r)), 1e-9 * float(r.max()), TINY)
            self.path.clear()
            with np.errstate(all="ignore"):  # the driver shortens steps that overflow
                end = driver(
                    lambda x: np.array(self.residual(x)),  # copies: it scales in place
                    x,
                    jac=self._at_accepted,
                    bounds=(self.lower, self.upper),
                    x_scale="jac",
                    loss="linear" if np.isinf(self.limit) else "huber",
                    f_scale=self.limit,
                    ftol=TOLERANCE,
                    xtol=TOLERANCE,
                    gtol=TOLERANCE,  # absolute: it depends on the units of the parameters
                    max_nfev=most,
                )
            at = end.active_mask
            x = np.where(at < 0, self.lower, np.where(at > 0, self.upper, end.x))
        return x, end.status > 0

    def polish(self, x: FloatArray) -> tuple[FloatArray, Estimate, bool]:
        """Gauss–Newton to the last digits; the kernel's judgement; whether the last step is negligible."""
        r = self.residual(x)
        cost, (step, size, rows) = self._pass(x, self._cost(r)), self._step(x, r)
        for _ in range(POLISH):
            if size < 1e-9:
                break
            new = np.clip(x + step, self.lower, self.upper)
            with np.errstate(all="ignore"):  # a step too far is refused
                new_r = self.residual(new)
                new_cost = self._cost(new_r)
            if not new_cost <= cost * (1 + 1e-9) < np.inf:
                break
            further = self._step(new, new_r)
            if further[1] > 0.9 * size:  # it does not contract here, or rounding is all that is left
                break
            x, r, cost, (step, size, rows) = new, new_r, self._pass(new, new_cost), further
        sigma = 1.0 if self.stated and np.isinf(self.limit) else None
        best = least_squares(*rows, names=self.names, sigma=sigma, rcond=JACOBIAN_RCOND)
        left = 1.0 if sigma else best.residuals @ best.residuals / max(best.dof, 1)
        # over their errors the step moves the data by more than any parameter over its own
        return x, best.at(x, r), size < 1e-6 or bool(np.sum((rows[0] @ step) ** 2) < 1e-6 * left)

    def _cost(self, r: FloatArray) -> float:
        """Half the sum of the loss of residuals (m,)."""
        size = np.minimum(np.abs(r), self.limit)
        return float(np.sum(size * (np.abs(r) - size / 2)))

    def _pass(self, x: FloatArray, cost: float) -> float:
        """Note an accepted point, once, and its cost."""
        if not self.path or not np.array_equal(self.path[-1][0], x):
            self.path.append((x.copy(), cost))
        return cost

    def _at_accepted(self, x: FloatArray) -> FloatArray:
        """Derivatives for the driver, which asks for them at accepted points only."""
        self._pass(x, self._cost(self.residual(x)))
        return np.array(self.slopes(x))

    def _step(self, x: FloatArray, r: FloatArray) -> tuple[FloatArray, float, tuple[FloatArray, FloatArray]]:
        """The Gauss–Newton step, its largest relative change of a parameter, and the rows it solves.

        A parameter at a bound is held by a row of its own.
        """
        J, free = self.slopes(x), (x > self.lower) & (x < self.upper)
        held = np.eye(len(x))[~free]
        pseudo = np.clip(r, -self.limit, self.limit) / max(float(np.mean(np.abs(r) <= self.limit)), 0.05)
        rows = np.vstack((J * free, held)), np.append(-pseudo, np.zeros(len(held)))
        step = solution(*rows, rcond=JACOBIAN_RCOND) * free
        # one that moves the residuals by less than a millionth of what others do counts as so large: one that
        # is 0 has no size
        slopes, size = np.linalg.norm(J, axis=0), np.abs(x)
        size = np.maximum(size, NEGLIGIBLE * (slopes * size).max() / np.maximum(slopes, TINY))
        return step, float((np.abs(step) / np.maximum(size, TINY)).max()), rows


def search_from(
    residual: Function, start: FloatArray, jacobian: Function | None = None, *, limit: int
) -> tuple[float, FloatArray] | None:
    """Half the sum of squares and the parameters (n,) where one of many searches ends; None if it ran away.

    Scipy's driver with at most `limit` evaluations, not polished: of most starts the end does not matter.
    Without a Jacobian differences and parameters of one size, such as logarithms.
    """
    from scipy.optimize import least_squares as driver

    enough = jacobian is not None and len(residual(start)) >= len(start)
    with np.errstate(all="ignore"):
        try:
            end = driver(
                residual,
                start,
                jac=jacobian or "2-point",
                x_scale="jac" if jacobian else 1.0,
                method="lm" if enough else "trf",
                max_nfev=limit,
            )
        except (ValueError, np.linalg.LinAlgError):
            return None
    return (float(end.cost), np.asarray(end.x)) if np.isfinite(end.x).all() else None
