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

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from functools import lru_cache
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from rotorid.base.arrays import AnyArray, FloatArray
from rotorid.base.choices import one_of
from rotorid.base.text import counted
from rotorid.regression.estimate import Estimate
from rotorid.regression.linear import JACOBIAN_RCOND, least_squares
from rotorid.regression.prior import Function, Prior

Bounds = Mapping[str, tuple[float | None, float | None]]

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
        stand = "stands at its bound" if len(self.at_bounds) == 1 else "stand at their bounds"
        words = (
            f"{', '.join(self.at_bounds)} {stand}: no standard deviation is given, and those of the others"
        )
        return f"{words} hold it fixed" if self.at_bounds else ""

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
    n, robust = len(labels), one_of(loss, "loss", LOSSES) != "linear"
    if first.shape != (n,) or n == 0 or len(set(labels)) != n or not np.isfinite(first).all():
        raise ValueError(f"{n} different names need as many finite starting values; got {list(first)}")
    lower, upper = _limits(bounds or {}, labels)
    first = inside(first, lower, upper)
    r0 = np.asarray(residual(first), dtype=np.float64)
    if r0.ndim != 1 or not np.isfinite(r0).all():
        raise ValueError("the residuals at the starting values are not finite: choose other starting values")
    if prior is not None and len(prior):
        if robust:
            raise ValueError("a prior or a ridge needs the loss linear: a robust loss would discount it, too")
        residual, jacobian = prior.beside(residual, jacobian)
    search = _Search(labels, residual, jacobian, lower, upper, sigma_stated)
    x, why, small = first, "", False
    if near and not robust:
        x, judged, small = search.polish(first)
    if not small:
        x, ended = search.drive(first, robust, max_iterations)
        x, judged, small = search.polish(x)
        tried = counted(max_iterations, "evaluation")
        why = "" if small else "the minimum was not reached: the last step is not yet small"
        why = why if ended else f"not converged after {tried}: raise max_iterations or start nearer"
    if why:
        judged = replace(judged, covariance=None, solution_covariance=None)
    path, costs = zip(*search.path, strict=True)
    return NonlinearEstimate(
        estimate=replace(judged, residuals=judged.residuals[: len(r0)]),
        history=np.array(path),
        costs=np.array(costs),
        converged=not why,
        message=why or f"converged in {counted(len(path) - 1, 'iteration')}",
        at_bounds=tuple(labels[j] for j in np.flatnonzero((x <= lower) | (x >= upper))),
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
                rms = max(float(np.sqrt(np.mean(r**2))), np.finfo(float).tiny)
                self.limit = HUBER * (1.4826 * float(np.median(r)) or rms)
            self.path.clear()
            with np.errstate(all="ignore"):  # the driver shortens steps that overflow
                end = driver(
                    lambda x: np.array(self.residual(x), dtype=np.float64),  # copies: it scales in place
                    inside(x, self.lower, self.upper, 1e-10),
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
        r = np.asarray(self.residual(x), dtype=np.float64)
        cost, (step, estimate, size) = self._pass(x, r), self._judged(x, r)
        for _ in range(POLISH):
            if size < 1e-9:
                break
            new = inside(x + step, self.lower, self.upper)
            with np.errstate(all="ignore"):  # a step too far is refused
                r = np.asarray(self.residual(new), dtype=np.float64)
                better = np.isfinite(r).all() and self._cost(r) <= cost * (1 + 1e-9)
            if not better:
                break
            judged = self._judged(new, r)
            if judged[2] > 0.9 * size:  # rounding is all that is left, or Gauss–Newton does not contract here
                break
            x, cost, (step, estimate, size) = new, self._pass(new, r), judged
        std = np.zeros(len(x)) if estimate.std is None else estimate.std
        sure = std > 0
        slight = bool(sure.any()) and float((np.abs(step[sure]) / std[sure]).max()) < 1e-3
        return x, estimate, size < 1e-6 or slight

    def _cost(self, r: FloatArray) -> float:
        """Half the sum of the loss of residuals (m,)."""
        size = np.minimum(np.abs(r), self.limit)
        return float(np.sum(size * (np.abs(r) - size / 2)))

    def _pass(self, x: FloatArray, r: FloatArray) -> float:
        """Note an accepted point, once; its cost."""
        cost = self._cost(r)
        if not self.path or not np.array_equal(self.path[-1][0], x):
            self.path.append((x.copy(), cost))
        return cost

    def _at_accepted(self, x: FloatArray) -> FloatArray:
        """Derivatives for the driver, which asks for them at accepted points only."""
        self._pass(x, np.asarray(self.residual(x)))
        return np.array(self.slopes(x), dtype=np.float64)

    def _judged(self, x: FloatArray, r: FloatArray) -> tuple[FloatArray, Estimate, float]:
        """The Gauss–Newton step (n,), the kernel's estimate at x, the largest relative change by the step.

        A parameter at a bound is held by a row of its own, and has no standard deviation.
        """
        J = np.asarray(self.slopes(x), dtype=np.float64)
        free = (x > self.lower) & (x < self.upper)
        held = np.eye(len(x))[~free]
        stated = self.stated and np.isinf(self.limit)
        inner = float(np.mean(np.abs(r) <= self.limit))
        pseudo = np.clip(r, -self.limit, self.limit) / max(inner, 0.05)
        estimate = least_squares(
            np.vstack((J * free, held)),
            np.append(-pseudo, np.zeros(len(held))),
            names=self.names,
            sigma=1.0 if stated else None,
            rcond=JACOBIAN_RCOND,
        )
        step = np.where(free, estimate.solution, 0.0)
        without = np.where(free[:, None] & free, 0.0, np.nan)
        seen, both = ~np.isnan(estimate.values), (estimate.covariance, estimate.solution_covariance)
        covariance, full = (None if each is None else each + without for each in both)
        judged = replace(
            estimate,
            values=np.where(seen, x, np.nan),
            solution=x.copy(),
            covariance=covariance,
            residuals=r,
            chi_square=float(r @ r) if stated else None,
            solution_covariance=full,
        )
        # one that moves the residuals by less than a millionth of what others do counts as so large: one that
        # is 0 has no size
        slopes, size = np.linalg.norm(J, axis=0), np.abs(x)
        size = np.maximum(size, NEGLIGIBLE * (slopes * size).max() / np.maximum(slopes, TINY))
        change = np.abs(step[seen]) / np.maximum(size[seen], TINY)
        if not seen.all():
            rows = estimate.row_space
            along = np.abs(rows @ step) / np.maximum(np.abs(rows) @ np.abs(x), TINY)
            change = np.append(change, along)
        return step, judged, float(change.max(initial=0.0))


def evaluated_once(both: Callable[[FloatArray], tuple[AnyArray, ...]]) -> tuple[Function, Function]:
    """Residuals and Jacobian, which are evaluated in one call, as two functions that remember the last."""

    @lru_cache(maxsize=1)
    def at(numbers: bytes) -> tuple[AnyArray, ...]:
        return both(np.frombuffer(numbers))

    return lambda x: at(x.tobytes())[0], lambda x: at(x.tobytes())[1]


def search_from(
    residual: Function, start: FloatArray, jacobian: Function | None = None, *, limit: int
) -> tuple[float, FloatArray] | None:
    """Half the sum of squares and the parameters (n,) where one of many searches ends; None if it ran away.

    Scipy's driver with at most `limit` evaluations, not polished: of most starts the end does not matter.
    Without a Jacobian differences and parameters of one size, such as logarithms.
    """
    from scipy.optimize import least_squares as driver

    options: dict[str, Any] = {"max_nfev": limit}
    if jacobian is not None:
        enough = len(residual(start)) >= len(start)
        options |= {"jac": jacobian, "x_scale": "jac", "method": "lm" if enough else "trf"}
    with np.errstate(all="ignore"):
        try:
            end = driver(residual, start, **options)
        except (ValueError, np.linalg.LinAlgError):
            return None
    return (float(end.cost), np.asarray(end.x)) if np.isfinite(end.x).all() else None


def inside(x: FloatArray, lower: FloatArray, upper: FloatArray, margin: float = 0.0) -> FloatArray:
    """X moved between its bounds (a little inside them for a start that the driver accepts)."""
    gap = np.where(np.isfinite(upper - lower), upper - lower, np.maximum(np.abs(x), 1.0)) * margin
    return np.asarray(np.clip(x, lower + gap, upper - gap))
