"""Fit a model in time to records: the methods behind one function."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence

import numpy as np

from rotorid.base.arrays import FloatArray
from rotorid.base.registry import find
from rotorid.regression.prior import Prior, prior_rows
from rotorid.regression.search import inside
from rotorid.timedomain.fit_diagnostics import judge
from rotorid.timedomain.integration import taylor
from rotorid.timedomain.integration.simulate import SimulationError
from rotorid.timedomain.methods.fit_methods import METHODS, Search, Trajectories
from rotorid.timedomain.methods.iteration_history import Path, Stop, half_square
from rotorid.timedomain.methods.least_squares_problem import RTOL, Problem
from rotorid.timedomain.methods.multiple_starts import Minimum, merge, spread_starts
from rotorid.timedomain.models.ode_model import OdeModel
from rotorid.timedomain.models.record import Record
from rotorid.timedomain.models.several_records import for_copies, recorded_starts
from rotorid.timedomain.residual_tests import output_errors, settled
from rotorid.timedomain.result import Fit

WEIGHINGS = 20
"""Fits at most with weights from the residuals of the last one."""
Searching = Callable[[Problem, FloatArray], Path]
Ends = tuple[Path, tuple[Minimum, ...]]
"""The best of several searches, and all minima."""


@np.errstate(all="ignore")  # what is not finite is looked for
def fit(  # noqa: PLR0913
    model: OdeModel,
    records: Record | Sequence[Record],
    *,
    method: str = "levenberg-marquardt",
    integrator: str = "auto",
    start: Mapping[str, float] | None = None,
    loss: str = "linear",
    starts: int = 1,
    trajectory: Trajectories | None = None,
    pieces: int | None = None,
    max_iterations: int = 100,
    tolerance: float | None = None,
    rtol: float = RTOL,
    seed: int = 0,
    weigh: bool = False,
    max_seconds: float = np.inf,
    ridge: float = 0.0,
) -> Fit:
    """Estimate the parameters of a model from time records.

    Parameters
    ----------
    model
        Of `ode_model` or `second_order`.
    records
        One, or several that share the parameters.
    method
        One of `METHODS` in `rotorid.timedomain.methods.fit_methods`.
    integrator
        Of `INTEGRATORS`. Quasilinearization takes one of `HEUN`, or integrates with error control.
    start
        Starting values by name, instead of the model's.
    loss
        One of `LOSSES` in `rotorid.regression.robust`.
    starts
        Number of starts: the first is `start`, the others spread over the bounds, or around it.
    trajectory
        First trajectory of quasilinearization and multiple shooting: "model" (its own solution), "data" (from
        the measured outputs), or {state: expression of t, number, or one value per time}. Default: "model"
        for quasilinearization, "data" for multiple shooting.
    pieces
        Of a record in multiple shooting; default: at most 12.
    max_iterations
        At most.
    tolerance
        Relative change of each parameter, or of the sum of squares, below which Gauss–Newton and
        quasilinearization stop; None: where no further step would matter.
    rtol
        Of the integration.
    seed
        Of the other starts.
    weigh
        Estimate the standard deviation of each output from its residuals and weigh by it, until it stays.
        Without stated errors all samples count alike otherwise, whatever their unit.
    max_seconds
        Limit of time of the search; what it has found by then is given, without intervals. Without it the
        number of evaluations alone is limited, by `max_iterations`.
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
    >>> from rotorid.timedomain import ode_model
    >>> model = ode_model({"x": "-a*x"}, initial={"x": 1.0}, estimate={"a": 0.5})
    >>> found = fit(model, Record(np.array([0.0, 1, 2, 3]), {"x": np.array([1.0, 0.37, 0.13, 0.05])}))
    >>> print(found.values.round(3), found.converged)
    [1.003] True
    """
    if not model.parameters:
        raise ValueError(
            "the model has nothing to estimate: put NAME = STARTING VALUE into the table [estimate] of its "
            "file"
        )
    way = find(METHODS, method, "method").function
    plain = method in ("gauss-newton", "quasilinearization")
    if plain and loss != "linear":
        raise ValueError(f"{method} knows no robust loss; use levenberg-marquardt")
    if method == "quasilinearization" and integrator == "rk4":
        raise ValueError("quasilinearization integrates with heun, sequential-heun, or error control (auto)")
    if starts < 1 or max_iterations < 1 or not max_seconds > 0:
        raise ValueError("starts and max_iterations must be at least 1, max_seconds above 0")
    several = (records,) if isinstance(records, Record) else tuple(records)
    stated = any(record.sigma is not None for record in several)
    if weigh and stated:
        raise ValueError("standard deviations are stated: there is nothing to estimate them for")
    if model.prior and not (weigh or stated):
        raise ValueError(
            "[prior] is weighed against the errors of the records: state them (--sigma 0.01, or columns "
            "NAME_std), or have them estimated (--sigma auto)"
        )
    problem = Problem(model, several, integrator, rtol, seconds=max_seconds)
    names = problem.model.parameters
    limits = problem.model.bounds
    recorded = recorded_starts(model, problem.records)
    begin = _start(problem.model, recorded | for_copies(model, len(several), start or {}))
    begin = inside(begin, limits[:, 0], limits[:, 1])
    prior = prior_rows(names, for_copies(model, len(several), model.prior), ridge, begin, problem.jacobian)
    if ridge or not weigh:
        problem.prior = prior
    kind = trajectory if trajectory is not None else "data" if method == "multiple-shooting" else "model"

    search = Search(way, limits, loss, kind, pieces, max_iterations, Stop(tolerance))
    begins = spread_starts(begin, limits, starts, seed)
    with taylor.learning(problem.models):
        path, minima = search_all(search, begins, problem)
        if weigh:
            problem, path, minima = _weighed(search, problem, (path, minima), prior, begins)
        problem.limit = np.inf  # of the search alone
        judged = judge(problem, path, loss)
        simulations = problem.runs if np.isfinite(problem.residual(path.estimate.solution)).all() else ()
    warnings = judged.warnings
    if len(minima) > 1:
        warnings = (*warnings, f"{len(minima)} different minima were found; the best is given, see minima")
    if plain and _outside(path.estimate.solution, limits):
        warnings = (*warnings, f"{method} knows no bounds, and the result lies outside those of the model")
    found = vars(path) | {"estimate": judged.estimate}
    return Fit(
        **found,
        models=problem.models,
        records=problem.records,
        method=method,
        integrator=simulations[0].method if simulations else integrator,
        loss=loss,
        reliable=judged.reliable,
        warnings=warnings,
        simulations=simulations,
        minima=minima,
        integration_change=judged.integration_change,
        autocorrelation=judged.autocorrelation,
        residual_rms=float(np.sqrt(np.mean(problem.plain(path.estimate.residuals) ** 2))),
        errors=problem.errors or None,
        prior=judged.prior,
        normal_matrix=judged.normal_matrix,
    )


def _weighed(
    search: Searching, problem: Problem, found: Ends, prior: Prior, begins: Sequence[FloatArray]
) -> tuple[Problem, *Ends]:
    """Weights from the residuals of the last fit, until they stay; only then a prior, from all starts."""
    path, minima = found
    for _ in range(WEIGHINGS if path.converged else 0):
        errors = output_errors(problem, path.estimate.residuals, path.estimate.rank)
        stopped = problem.late and not path.converged
        if stopped or errors is None or settled(errors, problem.errors):
            break
        problem = problem.weighed(errors)
        path = search(problem, path.estimate.solution).after(path.history)
    if len(prior) and problem.prior is not prior:
        if not (path.converged and problem.errors):
            raise ValueError("--sigma auto finds no errors without [prior] to weigh it by: state them")
        problem.prior, before = prior, path
        path, minima = search_all(search, [before.estimate.solution, *begins[1:]], problem)
        path = path.after(before.history)
    return problem, path, minima


def search_all(search: Searching, begins: Sequence[FloatArray], problem: Problem) -> Ends:
    """The best of several searches, and all minima; a start from which the states diverge is left out."""
    paths: list[Path] = []
    failure: SimulationError | None = None
    for begin in begins:
        if paths and problem.late:
            break
        try:
            paths.append(search(problem, begin))
        except SimulationError as error:
            failure = failure or error
    if not paths:
        assert failure is not None
        raise failure

    # one that did not converge is no minimum; where it describes the record better, it is given, and said
    def cost(path: Path) -> float:
        return half_square(path.estimate.residuals, problem.prior.residual(path.estimate.solution))

    best = min(paths, key=cost)
    return best, merge([p for p in paths if p.converged], cost) if len(begins) > 1 else ()


def _start(model: OdeModel, start: Mapping[str, float] | None) -> FloatArray:
    values = dict(zip(model.parameters, model.start.tolist(), strict=True))
    for name, value in (start or {}).items():
        if name not in values:
            raise ValueError(f"start: {name} is no parameter; parameters are {', '.join(values)}")
        values[name] = float(value)
    found = np.array(list(values.values()))
    if not np.isfinite(found).all():
        raise ValueError("starting values must be finite numbers")
    return found


def _outside(theta: FloatArray, limits: FloatArray) -> bool:
    return bool(((theta < limits[:, 0]) | (theta > limits[:, 1])).any())
