"""Identification from harmonic tests: a linear start, then output error, whose answer is given.

The linear regression puts measured amplitudes into K, so that their errors bias it: the estimate is
attenuated near resonances, where small errors of an amplitude are large errors of an equation. Three
stiffnesses of two masses, read at ten frequencies around the first resonance with 5 % and 3° errors: its 95 %
intervals contain the truth in 14 to 18 % of repetitions (33 to 36 % with stated errors). Output error,
which predicts the amplitudes, is begun there, from each of its solutions; its intervals contain the truth in
95 % (`python tests/coverage/coverage_identify.py 2000`).

The size of errors is taken at the predicted amplitude after a first round at the measured one: an amplitude
that reads low by chance must not get more weight for it. Where no errors are stated, the digits in which
readings are written are taken as errors, if what the model leaves is no larger than they explain.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np

from rotorid.base.arrays import BoolArray, FloatArray
from rotorid.base.registry import find
from rotorid.base.text import counted, listing
from rotorid.identify.amplitude_residuals import Comparison, compare
from rotorid.identify.amplitudes import Experiments
from rotorid.identify.checks_amplitudes import negative, unexplained, what_more_can_tell
from rotorid.identify.combinations import NAME, only_determined, why_several
from rotorid.identify.linear_start import LinearFit, build_rows, linear_fit, reasons
from rotorid.identify.operator_model import HarmonicModel
from rotorid.identify.recovery import SAME, several
from rotorid.identify.result import Identification
from rotorid.identify.starting_values import starting_values
from rotorid.regression.estimate import Estimate
from rotorid.regression.nonlinear import Bounds, NonlinearEstimate, nonlinear_least_squares
from rotorid.regression.normal_matrix import normal_matrix
from rotorid.regression.prior import Known, PriorEffect, effect, prior_rows
from rotorid.regression.robust import LOSSES
from rotorid.regression.undetermined_combinations import FoundCombination

REWEIGHTINGS = 2
"""Rounds with weights from predicted amplitudes after the first with measured ones."""
ROUNDING = 1e-9
"""Relative errors that are smaller are rounding."""
MOST_STARTS = 8
_SEARCHED = "the parameters were found by a search; there may be more solutions than shown"
WITHIN = 1e-6
"""A combination is determined if no more than this share of its slope lies outside what the data see."""


@dataclass(frozen=True)
class Options:
    """What `identify` takes beside model and data."""

    bounds: Bounds
    loss: str
    start: Mapping[str, float]
    prior: Known
    ridge: float


@dataclass(frozen=True, eq=False)
class OutputError:
    """A fit, the comparison with the last weights, and what a prior did."""

    fit: NonlinearEstimate
    comparison: Comparison
    prior: PriorEffect | None


def identify(
    model: HarmonicModel,
    experiments: Experiments,
    *,
    bounds: Bounds | None = None,
    loss: str = "linear",
    start: Mapping[str, float] | None = None,
    prior: Known | None = None,
    ridge: float = 0.0,
) -> Identification:
    """Identify a model's parameters from measured amplitudes, natural frequencies and shapes.

    Parameters
    ----------
    model
        From `harmonic_model`. One that has not as many outputs as equations predicts no amplitudes: the
        answer is then that of linear regression, [S] (9), (24).
    experiments
        Amplitudes of all signals; some may be missing (NaN), and of an output all.
    bounds
        Lowest and highest value by name, None: no limit; they also choose among several solutions.
    loss
        One of `LOSSES` in `rotorid.regression.robust`.
    start
        Starting values by name, tried beside the linear estimate.
    prior, ridge
        What is known beside the data, or λ of a ridge towards where the search begins.

    Raises
    ------
    ValueError
        For signals that were not measured at all, options that do not go together, unknown names.
    """
    options = Options(bounds or {}, loss, start or {}, prior or {}, ridge)
    _check(model, experiments, options)
    data, copies = experiments.without_copies()
    found = _identified(model, data, options)
    if data.rounding and not data.stated and found.method == "output-error" and len(found.solutions) == 1:
        found = _by_digits(found, options)
    return replace(found, left_out=(*copies, *found.left_out))


def _check(model: HarmonicModel, experiments: Experiments, options: Options) -> None:
    """Refuse names that are not the model's, or that stand for two things."""
    find(LOSSES, options.loss, "loss")
    for what in ("bounds", "start", "prior"):
        for name in getattr(options, what):
            if name not in model.parameters:
                raise ValueError(f"{what}: {name} is no parameter; those are {', '.join(model.parameters)}")
    for name, (low, high) in options.bounds.items():
        if low is not None and high is not None and not low <= high:
            raise ValueError(f"the bounds of {name} must be (lowest, highest); got ({low}, {high})")
    if options.prior and not experiments.stated:
        raise ValueError(
            "[prior] is weighed against the errors of the amplitudes: state them (--amplitude-error and "
            "--phase-error, or [errors] in the model file)"
        )
    for name in experiments.signals:
        if name in model.known or name in model.parameters:
            what = "known in" if name in model.known else "a parameter of"
            raise ValueError(f"{name} is {what} the model and also measured; remove one of the two")
    words = NAME.findall(" ".join(model.equations))
    for name in model.signals:
        alike = [w for w in words if w != name and w.casefold() == name.casefold()]
        if alike and words.count(name) == 1 and not np.nan_to_num(experiments.table([name])).any():
            raise ValueError(
                f"is {name} meant to be {alike[0]}? It stands in the equations once and has no readings; "
                f"if it is an amplitude of its own, give it another name"
            )


def _identified(model: HarmonicModel, experiments: Experiments, options: Options) -> Identification:
    """By output error, or linear regression alone where the model cannot predict."""
    rows, problem = None, ValueError()
    try:
        rows = build_rows(model, experiments)
    except ValueError as error:  # an amplitude that it needs is missing
        problem = error
    linear = None if rows is None else linear_fit(model, experiments, rows)
    square = len(model.outputs) == len(model.equations)
    hidden = np.isnan(experiments.table(model.outputs)).all(axis=0)
    if linear is None and (not square or hidden.all() or "input" in str(problem)):
        raise problem
    if square:
        compare(model, experiments)  # which refuses readings that cannot be compared
        starts = _starts(model, experiments, linear, options, hidden=bool(hidden.any()))
        fits, problem = [], ValueError()
        for begin in starts:
            try:
                fits.append(output_error(model, experiments, begin, options))
            except ValueError as error:  # one of several starts may have no answer
                problem = error
        good = any(one.fit.converged and one.fit.estimate.full_rank for one in fits)
        lost = linear and not linear.recovery.solutions and not good
        if fits and not lost:
            return _by_output_error(fits, linear, options)
        if linear is None or not (fits or linear.recovery.solutions) or options.prior or options.ridge:
            raise problem
    elif options.prior or options.ridge or options.loss != "linear":
        raise ValueError(
            "[prior], --ridge and --loss belong to models that have as many outputs as equations"
        )
    assert linear is not None
    return _by_regression(experiments, linear, options)


def _starts(
    model: HarmonicModel,
    experiments: Experiments,
    linear: LinearFit | None,
    options: Options,
    *,
    hidden: bool,
) -> list[FloatArray]:
    """Where to begin: at the given values if these are all, and at the linear solutions."""
    given = np.array([options.start.get(name, np.nan) for name in model.parameters])
    whole = bool(np.isfinite(given).all())
    if whole and options.ridge:  # which pulls towards it
        return [given]
    solutions = linear.recovery.solutions[:MOST_STARTS] if linear else ()
    ends = [given] * whole + [end if whole else np.where(np.isnan(given), end, given) for end in solutions]
    return ends or starting_values(model, experiments, options.start)


def output_error(
    model: HarmonicModel, experiments: Experiments, begin: FloatArray, options: Options
) -> OutputError:
    """Fit predicted to measured amplitudes from a start (n,); ValueError as of `compare`."""
    comparison = compare(model, experiments)
    stated, point = experiments.stated, begin
    known = prior_rows(model.parameters, options.prior, options.ridge, begin, comparison.jacobian)
    rounds: list[NonlinearEstimate] = []
    while True:
        fit = nonlinear_least_squares(
            comparison.residual,
            comparison.jacobian,
            point,
            names=model.parameters,
            sigma_stated=stated,
            bounds=options.bounds or None,
            loss=options.loss,
            near=bool(rounds),
            prior=known,
        )
        rounds.append(fit)
        if len(rounds) > REWEIGHTINGS or not fit.converged or not comparison.depends_on_prediction:
            break
        if len(rounds) > 1 and _moved(rounds[-2], fit) < 0.01:
            break
        point = fit.estimate.solution
        comparison = comparison.reweighted(point)
    estimate, J = fit.estimate, comparison.jacobian(fit.estimate.solution)
    did = effect(known, J, estimate.residuals, estimate.solution, stated=stated, at_bounds=fit.at_bounds)
    if did:
        estimate = did.apart(estimate, stated=stated)
    iterations = sum(one.iterations for one in rounds)
    message = f"converged in {counted(iterations, 'iteration')}" if fit.converged else fit.message
    return OutputError(replace(fit, estimate=_spare(estimate, J), message=message), comparison, did)


def _moved(before: NonlinearEstimate, after: NonlinearEstimate) -> float:
    """Largest change from one round to the next, in standard deviations; infinite where these are unknown."""
    known = after.std > 0 if after.std is not None else np.zeros(0, dtype=bool)
    if after.std is None or not known.any():
        return np.inf
    change = np.abs(after.estimate.solution - before.estimate.solution)
    return float((change[known] / after.std[known]).max())


def _spare(estimate: Estimate, jacobian: FloatArray) -> Estimate:
    """Without the degrees of freedom of rows that no parameter moves and that hold but for rounding.

    Such are the phases of a model without damping: they are met by any values, and say nothing of errors.
    """
    still = np.abs(jacobian * estimate.solution).max(axis=1, initial=0.0) <= ROUNDING
    dof = estimate.dof - int(np.count_nonzero(still & (np.abs(estimate.residuals) <= ROUNDING)))
    factor = 1.0 if estimate.errors_stated else estimate.dof / dof if dof > 0 else np.nan

    def scaled(covariance: FloatArray | None) -> FloatArray | None:
        return None if covariance is None or np.isnan(factor) else covariance * factor

    covariances = scaled(estimate.covariance), scaled(estimate.solution_covariance)
    return replace(estimate, dof=dof, covariance=covariances[0], solution_covariance=covariances[1])


def _by_output_error(
    fits: Sequence[OutputError], linear: LinearFit | None, options: Options
) -> Identification:
    """The best of the fits, or all that are as good."""
    chosen = _best(fits, options)
    fit, comparison, prior = chosen[0].fit, chosen[0].comparison, chosen[0].prior
    estimate, theta, converged = fit.estimate, fit.estimate.solution, fit.converged
    model, data = comparison.model, comparison.experiments
    points = [one.fit.values for one in chosen]
    apart = several(points) & ~np.isnan(points).any(axis=0)
    values = np.where(apart, np.nan, estimate.values) if converged else theta
    combinations = _combinations(estimate, linear) if converged else ()
    lost, more = np.isnan(values).any(), ""
    if (lost and not estimate.full_rank) or (linear and not linear.estimate.full_rank):
        more = what_more_can_tell(model, data, estimate.rank)
    why = reasons(linear, more) if linear and linear.recovery.solutions else ()
    if prior and prior.alone and why:
        prior = replace(prior, alone=why[0])
    if not why and estimate.full_rank:
        why = tuple(why_several(points, model.parameters, np.flatnonzero(apart).tolist()))
    elif not why:
        words = [c.words for c in combinations]
        why = only_determined(model.parameters, estimate.undetermined, words), more
    warnings = [*(linear.rows.warnings if linear else ()), *comparison.warnings]
    warnings += [w for w in fit.end_warnings if w != estimate.describe_rank()]
    warnings += [_SEARCHED] if linear and not linear.recovery.complete else []

    def refit(others: Experiments) -> Sequence[FloatArray]:
        return linear_fit(model, others).recovery.solutions

    warnings += unexplained(comparison, theta, estimate, refit, converged=converged)
    found = Identification(
        model=model,
        experiments=data,
        method="output-error",
        values=values,
        covariance=_without(estimate.covariance, apart),
        estimate=estimate,
        linear=linear,
        combinations=combinations,
        solutions=tuple(_named(model, point) for point in points),
        theta=theta,
        unidentifiable=why if lost else (),
        predicted=dict(zip(model.outputs, comparison.predict(theta)[0].T, strict=True)),
        left_out=comparison.left_out,
        converged=converged,
        warnings=tuple(warnings),
        notes=(fit.message,),
        normal_matrix=normal_matrix(model.parameters, comparison.jacobian(theta)),
        prior=prior,
    )
    signs = _negative(found, options) if converged else ()
    return replace(found, warnings=(*found.warnings, *signs, *(prior.warnings if prior else ())))


def _best(fits: Sequence[OutputError], options: Options) -> list[OutputError]:
    """Fits with the lowest cost, one for each set of parameters; that from a start which gives all alone."""
    lowest = min(one.fit.costs[-1] for one in fits)
    slack = 1e-6 * lowest + 1e-16 * max(1.0, float(len(fits[0].comparison.experiment)))
    equal = [one for one in fits if one.fit.costs[-1] <= lowest + slack]
    equal = [one for one in equal if one.fit.converged] or equal
    if equal[0] is fits[0] and set(options.start) == set(fits[0].comparison.model.parameters):
        return equal[:1]
    kept: list[OutputError] = []
    for one in equal:
        full, here = one.fit.estimate.full_rank, one.fit.estimate.solution
        near = (k.fit.estimate.solution for k in kept)
        if not kept or (full and not any(np.allclose(here, there, rtol=SAME, atol=0) for there in near)):
            kept.append(one)
    return kept


def _by_regression(experiments: Experiments, linear: LinearFit, options: Options) -> Identification:
    """The answer of linear regression alone."""
    model, recovery, estimate, system = linear.model, linear.recovery, linear.estimate, linear.system
    values, covariance = linear.values, system.covariance
    spread: list[float | None] = [None] * len(system.values)
    if covariance is not None:
        spread = np.sqrt(np.diag(covariance).clip(0)).tolist()
    warnings = [*linear.rows.warnings, *([] if recovery.complete else [_SEARCHED])]
    notes = [f"{listing(model.varying, 'and')}: from the measurements, row by row"] * bool(model.varying)
    more = "" if estimate.full_rank else what_more_can_tell(model, experiments, recovery.rank)
    solutions = [np.where(recovery.undetermined, np.nan, theta) for theta in recovery.solutions]
    found = Identification(
        model=model,
        experiments=experiments,
        method="equation-error",
        values=values,
        covariance=_without(
            None if covariance is None else linear.gain @ covariance @ linear.gain.T, np.isnan(values)
        ),
        estimate=estimate,
        linear=linear,
        combinations=tuple(
            FoundCombination(words, float(value), std)
            for words, value, std in zip(linear.words, system.values, spread, strict=True)
            if words not in model.parameters
        ),
        solutions=tuple(_named(model, theta) for theta in solutions),
        theta=recovery.solutions[0] if solutions else values,
        unidentifiable=reasons(linear, more) if np.isnan(values).any() else (),
        predicted={},
        left_out=linear.rows.left_out,
        converged=True,
        warnings=tuple(warnings),
        notes=(*notes, "the model predicts no amplitudes: linear regression, which noisy readings bias"),
        normal_matrix=normal_matrix(estimate.names, linear.K),
    )
    return replace(found, warnings=(*found.warnings, *_negative(found, options)))


def _without(covariance: FloatArray | None, lost: BoolArray) -> FloatArray | None:
    """A covariance, NaN where a parameter has no one value."""
    if covariance is None:
        return None
    return np.where(lost[:, None] | lost, np.nan, covariance)


def _by_digits(found: Identification, options: Options) -> Identification:
    """With the digits of the readings as their errors, where these explain what is left with 5 % chance.

    What is left widens the intervals, if it is more than the digits make on average.
    """
    from scipy.special import chdtrc

    data = found.experiments
    spread = {name: each for name, each in data.rounding.items() if name}
    std = np.sqrt(data.rounding[""]) if data.free.any() else None
    stated = replace(data, covariances=spread, frequency_std=std)
    try:
        other = _identified(found.model, stated, replace(options, start=_named(found.model, found.theta)))
    except (ValueError, np.linalg.LinAlgError):
        return found
    chi_square, dof = other.estimate.chi_square or 0.0, other.dof
    explained = dof < 1 or chdtrc(dof, chi_square) > 0.05
    if other.method != found.method or not (other.converged and explained) or other.covariance is None:
        return found
    more = max(1.0, chi_square / max(dof, 1))
    combinations = tuple(replace(c, std=c.std and c.std * more**0.5) for c in other.combinations)
    note = "no errors are stated: those of the digits in which readings are written are taken"
    wide = replace(other, covariance=other.covariance * more, combinations=combinations)
    return replace(
        wide, experiments=data, linear=found.linear, notes=(note, *other.notes), warnings=found.warnings
    )


def _negative(found: Identification, options: Options) -> tuple[str, ...]:
    interval = found.ci95
    high = found.values if interval is None else np.fmax(found.values, interval[:, 1])
    highest = float(found.experiments.frequencies.max())
    return negative(found.model, highest, found.values, high, options.bounds)


def _named(model: HarmonicModel, theta: FloatArray) -> dict[str, float]:
    return dict(zip(model.parameters, theta.tolist(), strict=True))


def _combinations(estimate: Estimate, linear: LinearFit | None) -> tuple[FoundCombination, ...]:
    """Products, sums and ratios that the data see, at the estimate, with the spread of the linearised model.

    They are those of the linear estimate: exact, and not tangents at the end of the search. Without it
    tangents are given, named so.
    """
    theta, spread = estimate.solution, estimate.solution_covariance
    if linear is None:
        tangents = [] if estimate.full_rank else estimate.combinations
        return tuple(FoundCombination(f"(near these values) {c.words}", c.value, None) for c in tangents)
    values, slopes = linear.system.combinations(theta)
    scale = np.where(theta == 0, 1.0, theta)
    rows = np.linalg.qr((estimate.row_space * scale).T)[0]
    found = []
    for words, value, slope in zip(linear.words, values, slopes, strict=True):
        relative = slope * scale
        beside = np.linalg.norm(relative - rows @ (rows.T @ relative))
        if words not in linear.model.parameters and beside <= WITHIN * np.linalg.norm(relative):
            variance = np.nan if spread is None else float(slope @ spread @ slope)
            std = float(np.sqrt(max(variance, 0.0))) if np.isfinite(variance) else None
            found.append(FoundCombination(words, float(value), std))
    return tuple(found)
