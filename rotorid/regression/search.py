"""Steps of the nonlinear search: scipy's driver, Gauss–Newton to the last digits, the kernel's judgement."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from typing import Any

import numpy as np

from rotorid.base.arrays import AnyArray, BoolArray, FloatArray
from rotorid.base.text import counted
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


class Search:
    """Residuals and Jacobian of one search, with the accepted points it passed."""

    def __init__(
        self, residual: Function, jacobian: Function, loss: str, tolerance: float = TOLERANCE
    ) -> None:
        self.residual = residual
        self.tolerance = tolerance
        self.slopes = jacobian
        self.loss = loss
        self.f_scale = 1.0
        self.path: list[FloatArray] = []
        self.costs: list[float] = []

    def jacobian(self, x: FloatArray) -> FloatArray:
        """Derivatives at x, once per accepted point (the driver asks for no others)."""
        if not self.path or not np.array_equal(self.path[-1], x):
            self.path.append(x.copy())
            self.costs.append(self.cost(np.asarray(self.residual(x))))
        return np.array(self.slopes(x), dtype=np.float64)  # a copy: the driver scales it in place

    def residuals(self, x: FloatArray) -> FloatArray:
        """Residuals at x, for the driver to scale in place."""
        return np.array(self.residual(x), dtype=np.float64)

    def cost(self, r: FloatArray) -> float:
        """Half the sum of the loss."""
        return cost(r, self.loss, self.f_scale)


def drive(
    search: Search,
    x: FloatArray,
    lower: FloatArray,
    upper: FloatArray,
    loss: str,
    stated: bool,
    limit: int,
) -> tuple[FloatArray, bool, str]:
    """Scipy's trust-region search; a robust loss without stated errors finds its own scale first."""
    from scipy.optimize import least_squares as driver

    ok, why = False, ""
    rounds = ["linear"] if loss == "linear" else [loss] if stated else ["linear", loss, loss]
    for step, name in enumerate(rounds):
        if name != "linear":
            search.f_scale = tuning(name) * (1.0 if stated else spread(np.asarray(search.residual(x))))
        if step:
            search.path.clear()
            search.costs.clear()
        search.loss = name
        with np.errstate(all="ignore"):  # the driver shortens steps that overflow
            found = driver(
                search.residuals,
                inside(x, lower, upper, 1e-10),
                jac=search.jacobian,
                bounds=(lower, upper),
                method="trf",
                x_scale="jac",
                loss=name,
                f_scale=search.f_scale,
                ftol=search.tolerance,
                xtol=search.tolerance,
                gtol=TOLERANCE,  # absolute: it depends on the units of the parameters
                max_nfev=limit,
            )
        x, ok = np.asarray(found.x), found.status > 0
        x = np.where(found.active_mask < 0, lower, np.where(found.active_mask > 0, upper, x))
        tried = counted(limit, "evaluation")
        why = "" if ok else f"not converged after {tried}: raise max_iterations or start nearer"
    return x, ok, why


def together(both: Callable[[FloatArray], tuple[AnyArray, ...]]) -> tuple[Function, Function]:
    """Residuals and Jacobian, which are evaluated in one call, as two functions that remember the last."""
    last: dict[bytes, tuple[AnyArray, ...]] = {}

    def at(x: FloatArray) -> tuple[AnyArray, ...]:
        if (key := x.tobytes()) not in last:
            last.clear()
            last[key] = both(x)
        return last[key]

    return lambda x: at(x)[0], lambda x: at(x)[1]


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


def polish(
    search: Search, x: FloatArray, lower: FloatArray, upper: FloatArray, names: tuple[str, ...], stated: bool
) -> tuple[FloatArray, Estimate, bool]:
    """Gauss–Newton to the last digits; the kernel's judgement there; whether the last step is negligible."""
    r = np.asarray(search.residual(x), dtype=np.float64)
    step, judged, slopes = _judge(search, x, r, lower, upper, names, stated)
    now, size = search.cost(r), _size(step, x, judged, slopes)
    for _ in range(POLISH):
        if size < 1e-9:
            break
        new = inside(x + step, lower, upper)
        with np.errstate(all="ignore"):  # a step too far is refused below
            r_new = np.asarray(search.residual(new), dtype=np.float64)
        if not np.isfinite(r_new).all() or search.cost(r_new) > now * (1 + 1e-9):
            break
        next_step, next_judged, slopes = _judge(search, new, r_new, lower, upper, names, stated, record=False)
        next_size = _size(next_step, new, next_judged, slopes)
        if next_size > 0.9 * size:  # rounding is all that is left, or Gauss–Newton does not contract here
            break
        x, r, now, step, judged, size = new, r_new, search.cost(r_new), next_step, next_judged, next_size
        search.path.append(x.copy())
        search.costs.append(now)
    return x, judged, size < 1e-6 or _offset(step, judged) < 1e-3


def _judge(
    search: Search,
    x: FloatArray,
    r: FloatArray,
    lower: FloatArray,
    upper: FloatArray,
    names: tuple[str, ...],
    stated: bool,
    record: bool = True,
) -> tuple[FloatArray, Estimate, FloatArray]:
    """The Gauss–Newton step (n,), the kernel's estimate at x, parameters at bounds held, lengths |K_j|."""
    J = search.jacobian(x) if record else np.asarray(search.slopes(x), dtype=np.float64)
    pseudo, J = pseudo_residuals(r, search.loss, search.f_scale), np.asarray(J)
    free = (x > lower) & (x < upper)
    n = len(names)
    known = stated and search.loss == "linear"
    if not free.any():
        empty = np.full((n, n), np.nan)
        judged = Estimate(
            names, x.copy(), x.copy(), empty, r, len(r), n, 1.0, np.ones(0), known, None, np.eye(n), empty
        )
        return np.zeros(n), judged, np.zeros(n)
    # SVD of the free columns by the kernel; the rest of this function puts the held parameters back in
    part = least_squares(
        J[:, free],
        -pseudo,
        names=[name for name, f in zip(names, free, strict=True) if f],
        sigma=1.0 if known else None,
        rcond=RCOND,
    )
    step = np.zeros(n)
    step[free] = part.solution
    values = np.where(free, 0.0, x)
    values[free] = np.where(np.isnan(part.values), np.nan, x[free])
    held = np.flatnonzero(~free)
    rows = np.zeros((part.rank + len(held), n))
    rows[: part.rank, free] = part.row_space
    rows[np.arange(part.rank, len(rows)), held] = 1.0
    judged = replace(
        part,
        names=names,
        values=values,
        solution=x.copy(),
        covariance=_embed(part.covariance, free),
        residuals=r,
        rank=part.rank + len(held),
        chi_square=float(r @ r) if known else None,
        row_space=rows,
        solution_covariance=_embed(part.solution_covariance, free),
    )
    return step, judged, np.linalg.norm(J, axis=0)


def _embed(covariance: FloatArray | None, free: BoolArray) -> FloatArray | None:
    if covariance is None or free.all():
        return covariance
    full = np.full((len(free), len(free)), np.nan)
    full[np.ix_(free, free)] = covariance
    return full


def _size(step: FloatArray, x: FloatArray, judged: Estimate, slopes: FloatArray) -> float:
    """Largest relative change by a step, of the parameters and combinations that the data determine.

    A parameter that moves the residuals by less than a millionth of what others do counts as so large: one
    that is 0 has no size of its own. `slopes` (n,) are the lengths of the columns of the Jacobian.
    """
    smallest = np.finfo(float).tiny ** 0.5
    known = ~np.isnan(judged.values)
    least = NEGLIGIBLE * (slopes * np.abs(x)).max() / np.maximum(slopes, smallest)
    change = np.abs(step[known]) / np.maximum(np.maximum(np.abs(x), least)[known], smallest)
    if not known.all():
        rows = judged.row_space
        change = np.append(change, np.abs(rows @ step) / np.maximum(np.abs(rows) @ np.abs(x), smallest))
    return float(change.max()) if change.size else 0.0


def _offset(step: FloatArray, judged: Estimate) -> float:
    """Largest change by a step in standard deviations, infinite where none is known."""
    std = judged.std
    if std is None:
        return float("inf")
    known = std > 0
    return float((np.abs(step[known]) / std[known]).max()) if known.any() else float("inf")


def inside(x: FloatArray, lower: FloatArray, upper: FloatArray, margin: float = 0.0) -> FloatArray:
    """X moved between its bounds (a little inside them for a start that the driver accepts)."""
    gap = np.where(np.isfinite(upper - lower), upper - lower, np.maximum(np.abs(x), 1.0)) * margin
    return np.asarray(np.clip(x, lower + gap, upper - gap))
