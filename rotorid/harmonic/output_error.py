"""Output error: parameters whose predicted amplitudes are nearest to the measured ones.

The linear regression (equation error) puts measured amplitudes into K, so their errors bias it: the estimate
is attenuated near resonances, where small errors of an amplitude are large errors of an equation. Here K
holds no measurement. Three stiffnesses of two masses, read at ten frequencies around the first resonance with
5 % and 3° errors: the 95 % intervals of the linear estimate contain the truth in 14 to 16 % of 2000
repetitions (75 to 78 % with stated errors) and its bias is 2.4 of its standard deviations; here it is
95 % and a tenth. In task 5.1 of [S] it hardly matters. The figures are printed by
`python examples/coverage_identify.py 2000`.

Residuals are the stretched differences of amplitudes, along and across each amplitude, over their errors:
stated, or relative to the amplitude. Their size is taken at the predicted amplitude after a first round at
the measured one: an amplitude that reads low by chance must not get more weight for it.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import ArrayLike

from rotorid.base.arrays import ComplexArray, FloatArray, IntArray
from rotorid.base.text import counted
from rotorid.harmonic.comparison import Comparison, compare
from rotorid.harmonic.experiments import Experiments
from rotorid.harmonic.hidden import hidden_outputs, without
from rotorid.harmonic.influence import leave_one_out
from rotorid.harmonic.model import HarmonicModel
from rotorid.harmonic.operator import Operator, operator_of
from rotorid.harmonic.plausibility import doubts, what_more_can_tell
from rotorid.harmonic.recovery import only_determined, why_several
from rotorid.harmonic.result import FoundCombination, Identification
from rotorid.harmonic.starting import starting_values
from rotorid.regression.estimate import Estimate
from rotorid.regression.nonlinear import Bounds, NonlinearEstimate, nonlinear_least_squares

if TYPE_CHECKING:
    from rotorid.harmonic.equation_error import LinearFit

REWEIGHTINGS = 2
"""Rounds with weights from predicted amplitudes after the first with measured ones."""
MOST_STARTS = 8
"""Solutions of the linear estimate from which to begin."""
WITHIN = 1e-6
"""A combination is determined if no more than this share of its slope lies outside what the data see."""
ROUNDING = 1e-9
"""Relative errors that are smaller are rounding."""
SAME = 1e-6
"""Parameters that differ by less, relatively, are the same solution."""


@dataclass(frozen=True, eq=False)
class OutputError:
    """An output-error fit.

    Attributes
    ----------
    fit
        Parameters, covariance, convergence. Its residuals are (predicted − measured) over the error.
    predicted
        Amplitudes of every output (n,), by name; NaN where an input is not known. In free vibration the shape
        has the measured amplitude at its reference.
    natural_frequencies
        Predicted, rad/s, shape (n,); NaN for forced experiments.
    rows
        (experiment, output, part) of each residual; part "amplitude" or "phase" (along and across the
        amplitude), "frequency" or "shape" in free vibration.
    jacobian
        Derivatives of the fit's residuals, (rows, parameters).
    experiment
        Index of each row's experiment.
    relative
        (measured − predicted) / |measured| of every output (n,), by name; NaN where not measured.
    left_out
        Readings that could not be used, in words.
    warnings
        In words.
    """

    fit: NonlinearEstimate
    predicted: Mapping[str, ComplexArray]
    natural_frequencies: FloatArray
    rows: tuple[tuple[str, str, str], ...]
    jacobian: FloatArray
    experiment: IntArray
    relative: Mapping[str, ComplexArray]
    left_out: tuple[str, ...]
    warnings: tuple[str, ...]


def output_error(
    model: HarmonicModel,
    experiments: Experiments,
    start: Mapping[str, float] | ArrayLike,
    *,
    bounds: Bounds | None = None,
    loss: str = "linear",
) -> OutputError:
    """Fit predicted to measured amplitudes.

    Parameters
    ----------
    model
        With as many equations as outputs.
    experiments
        Harmonic tests, with the inputs known; free vibrations (the predicted mode most like the measured
        shape is compared: its frequency, and its amplitudes relative to the first measured one, taken as
        exact; the frequency counts with the relative error of an amplitude). Some amplitudes may be missing.
    start
        First guess of each parameter, by name or in the model's order; NaN where there is none.
    bounds, loss
        As in `nonlinear_least_squares`.

    Raises
    ------
    ValueError
        If amplitudes cannot be predicted (equations and outputs differ in number, no inputs), or nothing is
        measured.

    Notes
    -----
    Exact Jacobian: dZ/dθ = A⁻¹ (db/dθ − dA/dθ Z).
    """
    operator = operator_of(model)
    comparison = compare(operator, experiments)
    point = starting_values(model, experiments, start)[0]
    rounds: list[NonlinearEstimate] = []
    while True:
        fit = nonlinear_least_squares(
            comparison.residual,
            comparison.jacobian,
            point,
            names=model.parameters,
            sigma_stated=experiments.stated,
            bounds=bounds,
            loss=loss,
            near=bool(rounds),
        )
        rounds.append(fit)
        if len(rounds) > REWEIGHTINGS or not fit.converged or not comparison.depends_on_prediction:
            break
        if len(rounds) > 1 and _moved(rounds[-2], fit) < 0.01:
            break
        point = fit.estimate.solution
        comparison = comparison.reweighted(point)
    joined = _joined(rounds)
    J = comparison.jacobian(joined.estimate.solution)
    return _result(replace(joined, estimate=_spare(joined.estimate, J)), comparison, experiments, operator)


def identify_outputs(
    model: HarmonicModel,
    experiments: Experiments,
    *,
    bounds: Bounds | None = None,
    loss: str = "linear",
    start: Mapping[str, float] | None = None,
) -> Identification:
    """Identify by output error from the linear estimate, from each of its solutions where it has several.

    Parameters
    ----------
    model, experiments, bounds, loss, start
        As in `identify`.

    Returns
    -------
    Residuals are relative to each amplitude: (measured − predicted)/|measured|. `influence` is of first
    order.
    """
    starts, linear, reasons = _linear_starts(model, experiments, bounds, start)
    found, problem = [], None
    for begin in starts:
        try:
            found.append(output_error(model, experiments, begin, bounds=bounds, loss=loss))
        except ValueError as error:  # one of several starts may have no answer
            problem = error
    if problem is not None and not found:
        raise problem
    lowest = min(f.fit.costs[-1] for f in found)
    slack = 1e-6 * lowest + 1e-16 * max(1.0, float(len(found[0].rows)))
    equal = [f for f in found if f.fit.costs[-1] <= lowest + slack]
    best = _distinct([f for f in equal if f.fit.converged] or equal)
    chosen, estimate = best[0], best[0].fit.estimate
    points = np.stack([f.fit.values for f in best])
    apart = (np.ptp(points, axis=0) > SAME * np.abs(points).max(axis=0)) & ~np.isnan(points).any(axis=0)
    values = np.where(apart, np.nan, estimate.values)
    covariance = None if estimate.covariance is None else estimate.covariance.copy()
    if covariance is not None:
        covariance[apart, :] = covariance[:, apart] = np.nan
    residuals = np.stack([chosen.relative[name] for name in model.outputs], axis=1)
    free_of_bounds = not chosen.fit.at_bounds and estimate.full_rank and loss == "linear"
    identification = Identification(
        model=model,
        experiments=experiments,
        method="output-error",
        values=values if chosen.fit.converged else estimate.solution,
        covariance=covariance,
        dof=estimate.dof,
        errors_stated=estimate.errors_stated,
        combinations=_combinations(model, estimate, linear) if chosen.fit.converged else (),
        solutions=tuple(dict(zip(model.parameters, map(float, point), strict=True)) for point in points),
        starts=(dict(zip(model.parameters, estimate.solution.tolist(), strict=True)),),
        rank=estimate.rank,
        condition_number=estimate.condition_number,
        unidentifiable=_undetermined(model, experiments, estimate, linear, reasons, points)
        if chosen.fit.converged and np.isnan(values).any()
        else (),
        residuals=residuals,
        residual_names=model.outputs,
        residual_rms=_rms(residuals),
        predicted=chosen.predicted,
        influence=leave_one_out(chosen.jacobian, -estimate.residuals, chosen.experiment, len(experiments))
        if free_of_bounds
        else None,
        left_out=chosen.left_out,
        converged=chosen.fit.converged,
        warnings=tuple(w for w in chosen.warnings if w != estimate.describe_rank()),
        notes=("residuals are relative to each amplitude", chosen.fit.message),
    )

    def refit(others: Experiments) -> Sequence[FloatArray]:
        from rotorid.harmonic.equation_error import linear_fit

        return linear_fit(model, others).recovery.solutions

    return replace(
        identification, warnings=(*identification.warnings, *doubts(identification, estimate, bounds, refit))
    )


def _linear_starts(
    model: HarmonicModel,
    experiments: Experiments,
    bounds: Bounds | None,
    start: Mapping[str, float] | None,
) -> tuple[list[dict[str, float]], LinearFit | None, tuple[str, ...]]:
    """Where to begin, the linear estimate, and its reasons for what is not determined.

    With hidden amplitudes the linear estimate is of the model without them, where that is not too long.
    """
    from rotorid.harmonic.equation_error import limits, linear_fit, reasons

    given, hidden = dict(start or {}), hidden_outputs(model, experiments)
    linear: LinearFit | None = None
    words: tuple[str, ...] = ()
    try:
        seen = without(model, hidden) if hidden else model
        if seen is not None:
            linear = linear_fit(seen, experiments, limits(bounds) or None)
            words = reasons(linear, experiments)
    except ValueError:  # more equations than outputs, no complete row
        pass
    if set(given) == set(model.parameters):
        return [given], linear, words
    ends = [] if linear is None else list(linear.recovery.solutions[:MOST_STARTS])
    if hidden or not ends:
        ends += starting_values(model, experiments, given)
    solutions = [dict(zip(model.parameters, end.tolist(), strict=True)) for end in ends]
    return [{**s, **given} for s in solutions], linear, words


def _distinct(found: Sequence[OutputError]) -> list[OutputError]:
    """Fits that ended at different parameters."""
    kept: list[OutputError] = []
    for one in found:
        here = one.fit.estimate.solution
        there = [k.fit.estimate.solution for k in kept if k.fit.estimate.full_rank]
        if not kept or not any(np.allclose(here, t, rtol=SAME, atol=0) for t in there):
            if kept and not one.fit.estimate.full_rank:
                continue
            kept.append(one)
    return kept


def _combinations(
    model: HarmonicModel, estimate: Estimate, linear: LinearFit | None
) -> tuple[FoundCombination, ...]:
    """Products, sums and ratios that the data see, at the estimate, with the spread of the linearised model.

    They are those of the linear estimate: exact, and not tangents at the end of the search. Without it
    tangents are given, named so.
    """
    theta, spread = estimate.solution, estimate.solution_covariance
    if linear is None:
        tangents = [] if estimate.full_rank else estimate.combinations
        return tuple(FoundCombination(f"(near these values) {c.words}", c.value, None) for c in tangents)
    if linear.model is not model and estimate.full_rank:
        return ()
    values, slopes = linear.system.combinations(theta), linear.system.jacobian(theta)
    rows = np.linalg.qr((estimate.row_space * np.where(theta == 0, 1.0, theta)).T)[0]
    out = []
    for words, value, slope in zip(linear.words, values, slopes, strict=True):
        relative = slope * np.where(theta == 0, 1.0, theta)
        beside = np.linalg.norm(relative - rows @ (rows.T @ relative))
        variance = np.nan if spread is None else float(slope @ spread @ slope)
        if words not in model.parameters and beside <= WITHIN * np.linalg.norm(relative):
            std = float(np.sqrt(max(variance, 0.0))) if np.isfinite(variance) else None
            out.append(FoundCombination(words, float(value), std))
    return tuple(out)


def _undetermined(
    model: HarmonicModel,
    experiments: Experiments,
    estimate: Estimate,
    linear: LinearFit | None,
    reasons: tuple[str, ...],
    points: FloatArray,
) -> tuple[str, ...]:
    """Why parameters have no one value."""
    if linear is not None and linear.model is model and reasons:
        return reasons
    if estimate.full_rank:
        return tuple(why_several(list(points), model.parameters, np.zeros(len(points[0]), dtype=bool)))
    words = [c.words for c in _combinations(model, estimate, linear)]
    more = what_more_can_tell(model, experiments, estimate.rank)
    return only_determined(model.parameters, estimate.undetermined, words), more


def _rms(residuals: ComplexArray) -> float:
    used = residuals[~np.isnan(residuals)]
    parts = np.concatenate((used.real, used.imag))
    return float(np.sqrt(np.mean(parts**2))) if len(parts) else float("nan")


def _moved(before: NonlinearEstimate, after: NonlinearEstimate) -> float:
    """Largest change from one round to the next, in standard deviations; infinite where these are unknown."""
    std = after.std
    if std is None:
        return float("inf")
    known = std > 0
    change = np.abs(after.estimate.solution - before.estimate.solution)
    return float((change[known] / std[known]).max()) if known.any() else float("inf")


def _joined(rounds: Sequence[NonlinearEstimate]) -> NonlinearEstimate:
    """The last round, with the history of all."""
    iterations = sum(fit.iterations for fit in rounds)
    last = rounds[-1]
    return replace(
        last,
        start=rounds[0].start,
        iterations=iterations,
        message=f"converged in {counted(iterations, 'iteration')}" if last.converged else last.message,
        history=np.concatenate([rounds[0].history, *(fit.history[1:] for fit in rounds[1:])]),
        costs=np.concatenate([rounds[0].costs, *(fit.costs[1:] for fit in rounds[1:])]),
    )


def _spare(estimate: Estimate, jacobian: FloatArray) -> Estimate:
    """Without the degrees of freedom of rows that no parameter moves and that hold but for rounding.

    Such are the phases of a model without damping: they are met by any values, and say nothing of errors.
    """
    still = np.abs(jacobian * estimate.solution).max(axis=1, initial=0.0) <= ROUNDING
    idle = int(np.count_nonzero(still & (np.abs(estimate.residuals) <= ROUNDING)))
    dof, factor = estimate.dof - idle, 1.0
    if not idle:
        return estimate
    if not estimate.errors_stated:
        factor = estimate.dof / dof if dof > 0 else np.nan

    def scaled(covariance: FloatArray | None) -> FloatArray | None:
        return None if covariance is None or np.isnan(factor) else covariance * factor

    return replace(
        estimate,
        dof=dof,
        covariance=scaled(estimate.covariance),
        solution_covariance=scaled(estimate.solution_covariance),
    )


def _result(
    fit: NonlinearEstimate, comparison: Comparison, experiments: Experiments, operator: Operator
) -> OutputError:
    predicted, frequencies = comparison.predict(fit.estimate.solution)
    table = {name: predicted[:, j] for j, name in enumerate(operator.outputs)}
    relative = {}
    for name, z in table.items():
        measured = np.asarray(experiments.signals.get(name, np.full(len(experiments), np.nan)), dtype=complex)
        good = ~np.isnan(measured) & ~np.isnan(z) & (measured != 0)
        relative[name] = np.full(len(z), np.nan, dtype=complex)
        relative[name][good] = (measured - z)[good] / np.abs(measured[good])
    return OutputError(
        fit=fit,
        predicted=table,
        natural_frequencies=frequencies,
        rows=comparison.rows,
        jacobian=comparison.jacobian(fit.estimate.solution),
        experiment=comparison.experiment,
        relative=relative,
        left_out=comparison.left_out,
        warnings=(*comparison.warnings, *fit.warnings),
    )
