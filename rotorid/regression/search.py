"""Steps of the nonlinear search: scipy's driver, Gauss–Newton to the last digits, the kernel's judgement."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field, replace
from functools import lru_cache
from typing import Any

import numpy as np

from rotorid.base.arrays import AnyArray, FloatArray
from rotorid.regression.estimate import Estimate
from rotorid.regression.linear import least_squares
from rotorid.regression.robust import cost, pseudo_residuals, spread, tuning

Function = Callable[[FloatArray], FloatArray]

TOLERANCE = 1e-9
"""The driver's tolerances on cost, step and gradient, before polishing."""
POLISH = 25
"""Gauss–Newton steps at most after the driver."""
NEGLIGIBLE = 1e-6
"""Share of what the other parameters do below which one has no size of its own."""
RCOND = 1e-10
"""Scaled singular values of a Jacobian below this count as zero: it carries more rounding than a table."""
TINY = float(np.finfo(float).tiny ** 0.5)


@dataclass(eq=False)
class Search:
    """One search for n parameters between bounds, with the accepted points it passed and their costs.

    `stated`: a residual of 1 is one stated standard deviation.
    """

    names: tuple[str, ...]
    residual: Function
    slopes: Function
    lower: FloatArray
    upper: FloatArray
    stated: bool
    loss: str = "linear"
    scale: float = 1.0
    path: list[FloatArray] = field(default_factory=list)
    costs: list[float] = field(default_factory=list)

    def drive(self, x: FloatArray, loss: str, limit: int) -> tuple[FloatArray, bool]:
        """Where scipy's trust-region search ends, and whether it converged.

        A robust loss without stated errors finds its own scale first.
        """
        from scipy.optimize import least_squares as driver

        converged = False
        for step in ("linear",) if loss == "linear" else (loss,) if self.stated else ("linear", loss, loss):
            self.loss = step
            if step != "linear":
                self.scale = tuning(loss) * (1.0 if self.stated else spread(self.residual(x)))
            self.path.clear()
            self.costs.clear()
            with np.errstate(all="ignore"):  # the driver shortens steps that overflow
                end = driver(
                    lambda x: np.array(self.residual(x), dtype=np.float64),  # copies: it scales in place
                    inside(x, self.lower, self.upper, 1e-10),
                    jac=self._at_accepted,
                    bounds=(self.lower, self.upper),
                    method="trf",
                    x_scale="jac",
                    loss=step,
                    f_scale=self.scale,
                    ftol=TOLERANCE,
                    xtol=TOLERANCE,
                    gtol=TOLERANCE,  # absolute: it depends on the units of the parameters
                    max_nfev=limit,
                )
            x, converged = np.asarray(end.x), end.status > 0
            x = np.where(end.active_mask < 0, self.lower, np.where(end.active_mask > 0, self.upper, x))
        return x, converged

    def polish(self, x: FloatArray) -> tuple[FloatArray, Estimate, bool]:
        """Gauss–Newton to the last digits; the kernel's judgement; whether the last step is negligible."""
        r = np.asarray(self.residual(x), dtype=np.float64)
        cost, (step, estimate, size) = self._cost(r), self._judged(x, r)
        self._pass(x, cost)
        for _ in range(POLISH):
            if size < 1e-9:
                break
            new = inside(x + step, self.lower, self.upper)
            with np.errstate(all="ignore"):  # a step too far is refused
                r = np.asarray(self.residual(new), dtype=np.float64)
                next_cost = self._cost(r)
            if not next_cost <= cost * (1 + 1e-9) or not np.isfinite(r).all():
                break
            judged = self._judged(new, r)
            if judged[2] > 0.9 * size:  # rounding is all that is left, or Gauss–Newton does not contract here
                break
            x, cost, (step, estimate, size) = new, next_cost, judged
            self._pass(x, cost)
        std = np.zeros(len(x)) if estimate.std is None else estimate.std
        sure = std > 0
        slight = bool(sure.any()) and float((np.abs(step[sure]) / std[sure]).max()) < 1e-3
        return x, estimate, size < 1e-6 or slight

    def _cost(self, r: FloatArray) -> float:
        return cost(r, self.loss, self.scale)

    def _pass(self, x: FloatArray, cost: float) -> None:
        """Note an accepted point, once."""
        if not self.path or not np.array_equal(self.path[-1], x):
            self.path.append(x.copy())
            self.costs.append(cost)

    def _at_accepted(self, x: FloatArray) -> FloatArray:
        """Derivatives for the driver, which asks for them at accepted points only."""
        self._pass(x, self._cost(np.asarray(self.residual(x))))
        return np.array(self.slopes(x), dtype=np.float64)

    def _judged(self, x: FloatArray, r: FloatArray) -> tuple[FloatArray, Estimate, float]:
        """The Gauss–Newton step (n,), the kernel's estimate at x, the largest relative change by the step.

        A parameter at a bound is held by a row of its own, and has no standard deviation.
        """
        J = np.asarray(self.slopes(x), dtype=np.float64)
        free = (x > self.lower) & (x < self.upper)
        held = np.eye(len(x))[~free]
        stated = self.stated and self.loss == "linear"
        estimate = least_squares(
            np.vstack((J * free, held)),
            np.append(-pseudo_residuals(r, self.loss, self.scale), np.zeros(len(held))),
            names=self.names,
            sigma=1.0 if stated else None,
            rcond=RCOND,
        )
        step = np.where(free, estimate.solution, 0.0)
        without = np.where(free[:, None] & free, 0.0, np.nan)
        covariance, full = estimate.covariance, estimate.solution_covariance
        seen = ~np.isnan(estimate.values)
        judged = replace(
            estimate,
            values=np.where(seen, x, np.nan),
            solution=x.copy(),
            covariance=None if covariance is None else covariance + without,
            residuals=r,
            chi_square=float(r @ r) if stated else None,
            solution_covariance=None if full is None else full + without,
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


def together(both: Callable[[FloatArray], tuple[AnyArray, ...]]) -> tuple[Function, Function]:
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
            found = driver(residual, start, **options)
        except (ValueError, np.linalg.LinAlgError):
            return None
    return (float(found.cost), np.asarray(found.x)) if np.isfinite(found.x).all() else None


def inside(x: FloatArray, lower: FloatArray, upper: FloatArray, margin: float = 0.0) -> FloatArray:
    """X moved between its bounds (a little inside them for a start that the driver accepts)."""
    gap = np.where(np.isfinite(upper - lower), upper - lower, np.maximum(np.abs(x), 1.0)) * margin
    return np.asarray(np.clip(x, lower + gap, upper - gap))
