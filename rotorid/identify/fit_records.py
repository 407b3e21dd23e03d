"""Fit a model in time to records: the methods behind one function.

Levenberg–Marquardt from the start, and from others where the model at the first minimum does not describe the
record. The methods of [Q] and [F] stand beside it as they are printed.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping, Sequence
from functools import partial

import numpy as np

from rotorid.base.arrays import FloatArray
from rotorid.base.choices import Method, find
from rotorid.base.text import counted
from rotorid.identify.expressions import finite
from rotorid.identify.ode import OdeModel, SimulationError, check_known
from rotorid.identify.quasilinearization import quasilinearization
from rotorid.identify.record_least_squares import RTOL, Iterations, Problem
from rotorid.identify.record_warnings import judge
from rotorid.identify.records import Record, for_copies, recorded_starts
from rotorid.identify.result_records import Fit
from rotorid.identify.sensitivity_steps import iterate, sensitivity_steps
from rotorid.regression.nonlinear import nonlinear_least_squares
from rotorid.regression.prior import prior_rows

MOST_STARTS, OTHERS, MOST_WARNINGS = 10_000, 7, 3
"""Starts at most; so many where the first does not describe the record; warnings at most, the worst first."""
METHODS: tuple[Method[None], ...] = (
    Method("levenberg-marquardt", "safeguarded, with bounds and robust losses", None),
    Method("gauss-newton", "whole steps without safeguards, as [F]", None),
    Method("quasilinearization", "linear fits about the last trajectory, as [Q]", None),
)
Searching = Callable[[Problem, FloatArray], Iterations]


@np.errstate(all="ignore")  # what is not finite is looked for
def fit(  # noqa: PLR0913
    model: OdeModel,
    records: Record | Sequence[Record],
    *,
    method: str = "levenberg-marquardt",
    integrator: str = "auto",
    start: Mapping[str, float] | None = None,
    loss: str = "linear",
    starts: int | None = None,
    max_iterations: int = 100,
    tolerance: float | None = None,
    rtol: float = RTOL,
    seed: int = 0,
    ridge: float = 0.0,
) -> Fit:
    """Estimate the parameters of a model from time records.

    Parameters
    ----------
    model
        Of `ode_model` or `second_order`.
    records
        One, or several that share the parameters. Without stated errors all samples count alike, whatever
        their unit.
    method
        One of `METHODS`.
    integrator
        Of `INTEGRATORS`. Quasilinearization takes one of `HEUN`, or integrates with error control.
    start
        Starting values by name, instead of the model's.
    loss
        One of `LOSSES` in `rotorid.regression.nonlinear`: "linear", or "huber" against gross errors.
    starts
        Number of starts: the first is `start`, the others spread over the bounds, or around it. None: others
        where levenberg-marquardt ends at a minimum that does not describe the record.
    max_iterations
        At most.
    tolerance
        ε of the methods of the texts: they end at a step |Δβ| < ε, or at I(β) < ε; None: where no further
        step would matter.
    rtol
        Of the integration.
    seed
        Of the other starts.
    ridge
        λ of a ridge towards the starting values, as `rotorid.regression.prior` has it.

    Raises
    ------
    ValueError
        Unknown names or methods, records that do not suit the model, a prior without errors to weigh it by.
    SimulationError
        The states diverge with the starting values.

    Examples
    --------
    >>> from rotorid.identify.ode import ode_model
    >>> model = ode_model({"x": "-a*x"}, initial={"x": 1.0}, estimate={"a": 0.5})
    >>> fitted = fit(model, Record(np.array([0.0, 1, 2, 3]), {"x": np.array([1.0, 0.37, 0.13, 0.05])}))
    >>> print(fitted.values.round(3), fitted.converged)
    [1.003] True
    """
    several = (records,) if isinstance(records, Record) else tuple(records)
    count = 1 if starts is None else starts
    if min(max_iterations, count) < 1 or count > MOST_STARTS:
        raise ValueError(f"starts and max_iterations must be at least 1, and starts at most {MOST_STARTS:,}")
    if not 0 < (1.0 if tolerance is None else tolerance) < np.inf:
        raise ValueError(f"the tolerance is a number above 0, not {tolerance:g}")
    _check(model, several, method, integrator, loss)
    problem = Problem(model, several, integrator, rtol)
    (low, high), names = problem.model.bounds.T, problem.model.parameters
    begin = np.clip(_start(problem, start or {}), low, high)
    priors = for_copies(model, len(several), model.prior)
    problem.prior = prior_rows(names, priors, ridge, begin, problem.jacobian)

    def search(problem: Problem, theta: FloatArray) -> Iterations:
        near = (1e-8, 1e-5) if tolerance is None else (1e-6, 0.1)
        if method == "gauss-newton":
            steps = sensitivity_steps(problem, theta, near)
            return iterate(problem, "Gauss–Newton", steps, max_iterations, tolerance)
        if method == "quasilinearization":
            return quasilinearization(problem, theta, near, max_iterations, tolerance)
        problem.evaluate(theta)  # says why, where the states diverge
        reached = nonlinear_least_squares(
            problem.residual,
            problem.jacobian,
            theta,
            names=names,
            sigma_stated=problem.stated,
            bounds=problem.model.bounds,
            loss=loss,
            max_iterations=max_iterations,
            near=loss == "linear",
            prior=problem.prior,
        )
        return Iterations(**vars(reached))

    spread = partial(spread_starts, begin, problem.model.bounds, seed=seed)
    paths, more = _searched(search, problem, spread(count)), ""
    path = min(paths, key=_cost)
    judged, safe = judge(problem, path, loss), starts is None and method == "levenberg-marquardt"
    if judged["poor"] and safe and (path.converged or path.iterations > 20):
        path, more = _from_elsewhere(search, problem, path, spread)
        judged = judge(problem, path, loss)
    del judged["poor"]
    theta = path.estimate.solution
    words = [*judged.pop("warnings"), more, *_rivals(paths, path)]
    if ((theta < low) | (theta > high)).any():
        words.append(f"{method} knows no bounds, and the result lies outside those of the model")
    runs = problem.solutions(theta) if np.isfinite(problem.residual(theta)).all() else ()
    return Fit(
        **(vars(path) | judged),
        models=problem.models,
        records=problem.records,
        method=method,
        integrator=runs[0].integrator if runs else integrator,
        loss=loss,
        warnings=tuple(filter(None, words))[:MOST_WARNINGS],
        simulations=runs,
        residual_rms=float(np.sqrt(np.mean((path.estimate.residuals / problem.scale) ** 2))),
    )


def spread_starts(first: FloatArray, limits: FloatArray, count: int, seed: int) -> list[FloatArray]:
    """The first start, and others: a Latin hypercube over the bounds.

    Where a parameter has no bounds, it ranges from a tenth to ten times its first value (from −1 to 1 if that
    is 0), and not beyond the bound it has.

    Parameters
    ----------
    first
        Starting values (n,).
    limits
        Bounds (n, 2), ±inf for none.
    count
        Of all starts.
    seed
        Of the random numbers: the same starts every time.
    """
    rng, m = np.random.default_rng(seed), count - 1
    if m < 1:
        return [first]
    cells = np.array([rng.permutation(m) for _ in first]).T
    share = (cells + rng.random((m, len(first)))) / m
    low, high = limits.T
    around = np.where(first == 0, 2 * share - 1, first * 10 ** (2 * share - 1))
    within = np.where(np.isfinite(high - low), low + share * (high - low), around)
    return [first, *np.clip(within, low, high)]


def _searched(
    search: Searching, problem: Problem, begins: Sequence[FloatArray], paths: Sequence[Iterations] = ()
) -> list[Iterations]:
    """Further searches; one from which the states diverge is left out, if there is another."""
    done = [*paths]
    for i, begin in enumerate(begins):
        try:
            done.append(search(problem, begin))
        except SimulationError:
            if not done and i == len(begins) - 1:
                raise
    return done


def _from_elsewhere(
    search: Searching,
    problem: Problem,
    path: Iterations,
    spread: Callable[[int], Sequence[FloatArray]],
) -> tuple[Iterations, str]:
    """A better minimum from other starts and words, where the first does not describe the record."""
    paths = _searched(search, problem, spread(OTHERS)[1:], [path])
    best = min(paths, key=_cost)
    if _cost(path) <= 1.5 * _cost(best):
        return path, ""
    return best, (
        "from the starting values the search ends where the model does not describe the record; this is from "
        f"another of {counted(len(paths), 'start')} (--start names better ones)"
    )


def _cost(path: Iterations) -> float:
    return float(path.costs[-1])


def _rivals(paths: Sequence[Iterations], path: Iterations) -> Iterator[str]:
    """Words for a start that ends elsewhere, where the model describes the record nearly as well."""
    best = path.estimate
    for other in paths:
        theta = other.estimate.solution
        apart = (
            other is not path
            and best.full_rank
            and not np.allclose(theta, best.solution, rtol=1e-3, atol=1e-12)
        )
        if apart and other.converged and _cost(other) <= 1.5 * _cost(path):
            values = ", ".join(f"{n} = {x:.6g}" for n, x in zip(path.estimate.names, theta, strict=True))
            yield f"another start ends at {values}, which describes the record nearly as well"
            return


def _start(problem: Problem, given: Mapping[str, float]) -> FloatArray:
    """Starting values (n,): those given, else what the records say, else the model's."""
    model, values = problem.given, dict(zip(problem.model.parameters, problem.model.start, strict=True))
    values |= recorded_starts(model, problem.records)
    given = for_copies(model, len(problem.records), given)
    check_known("start", given, "parameter", values)
    return np.array([finite(name, value) for name, value in (values | given).items()])


def _check(model: OdeModel, records: Sequence[Record], method: str, integrator: str, loss: str) -> None:
    """Refuse what does not go together."""
    if not model.parameters:
        raise ValueError(
            "the model has nothing to estimate: put NAME = STARTING VALUE into the table [estimate] of its "
            "file"
        )
    if find(METHODS, method, "method").name != "levenberg-marquardt" and loss != "linear":
        raise ValueError(f"{method} knows no robust loss; use levenberg-marquardt")
    if method == "quasilinearization" and integrator == "rk4":
        raise ValueError("quasilinearization integrates with heun, sequential-heun, or error control (auto)")
    if model.prior and all(record.sigma is None for record in records):
        raise ValueError(
            "[prior] is weighed against the errors of the records: state them (--sigma 0.01, or columns "
            "NAME_std)"
        )
