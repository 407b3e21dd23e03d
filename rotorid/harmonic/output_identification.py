"""Identification by output error, begun at the linear estimate."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace

import numpy as np

from rotorid.base.arrays import ComplexArray, FloatArray
from rotorid.harmonic.equation_error import LinearFit, limits, linear_fit, reasons
from rotorid.harmonic.experiments import Experiments
from rotorid.harmonic.leave_one_out import leave_one_out
from rotorid.harmonic.operator_model import HarmonicModel
from rotorid.harmonic.output_error import OutputError, output_error
from rotorid.harmonic.parameter_recovery import only_determined, why_several
from rotorid.harmonic.plausibility import doubts, what_more_can_tell
from rotorid.harmonic.result import Identification
from rotorid.harmonic.starting_values import starting_values
from rotorid.harmonic.unmeasured_amplitudes import hidden_outputs, without
from rotorid.regression.estimate import Estimate
from rotorid.regression.nonlinear import Bounds
from rotorid.regression.normal_matrix import normal_matrix
from rotorid.regression.prior import Known
from rotorid.regression.undetermined_combinations import FoundCombination

MOST_STARTS = 8
"""Solutions of the linear estimate from which to begin."""
WITHIN = 1e-6
"""A combination is determined if no more than this share of its slope lies outside what the data see."""
SAME = 1e-6
"""Parameters that differ by less, relatively, are the same solution."""


def identify_outputs(
    model: HarmonicModel,
    experiments: Experiments,
    bounds: Bounds | None = None,
    loss: str = "linear",
    start: Mapping[str, float] | None = None,
    prior: Known | None = None,
    ridge: float = 0.0,
) -> Identification:
    """Identify by output error from the linear estimate, from each of its solutions where it has several.

    Parameters
    ----------
    model, experiments, bounds, loss, start, prior, ridge
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
            found.append(output_error(model, experiments, begin, bounds, loss, prior, ridge))
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
    K, r, experiment, told = chosen.jacobian, estimate.residuals, chosen.experiment, chosen.prior
    if told:  # its rows belong to no experiment
        K, r = told.rows.below(K), np.append(r, told.rows.residual(estimate.solution))
        experiment = np.append(experiment, np.full(len(told.rows), -1))
        told = replace(told, alone=told.alone and (reasons or (told.alone,))[0])
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
        influence=leave_one_out(K, -r, experiment, len(experiments)) if free_of_bounds else None,
        left_out=chosen.left_out,
        converged=chosen.fit.converged,
        warnings=tuple(w for w in chosen.warnings if w != estimate.describe_rank()),
        notes=("residuals are relative to each amplitude", chosen.fit.message),
        prior=told,
        normal_matrix=normal_matrix(model.parameters, chosen.jacobian),
    )

    def refit(others: Experiments) -> Sequence[FloatArray]:
        return linear_fit(model, others).recovery.solutions

    said = (*doubts(identification, estimate, bounds, refit), *(told.warnings if told else ()))
    return replace(identification, warnings=(*identification.warnings, *said))


def _linear_starts(
    model: HarmonicModel,
    experiments: Experiments,
    bounds: Bounds | None,
    start: Mapping[str, float] | None,
) -> tuple[list[dict[str, float]], LinearFit | None, tuple[str, ...]]:
    """Where to begin, the linear estimate, and its reasons for what is not determined.

    With hidden amplitudes the linear estimate is of the model without them, where that is not too long.
    """
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
