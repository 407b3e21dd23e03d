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
from dataclasses import replace
from typing import Any

import numpy as np

from rotorid.base.arrays import BoolArray, FloatArray
from rotorid.base.choices import one_of
from rotorid.base.text import counted, listing
from rotorid.identify.amplitudes import Comparison, Experiments, compare, evaluated_once
from rotorid.identify.combinations import NAME, why_several
from rotorid.identify.linear_start import SAME, LinearFit, build_rows, linear_fit, passive_elements, several
from rotorid.identify.ode import check_known
from rotorid.identify.operator_model import HarmonicModel
from rotorid.identify.result import Identification
from rotorid.identify.starting_values import starting_values
from rotorid.regression.estimate import Combination, Estimate, only_determined
from rotorid.regression.linear import NormalMatrix, normal_matrix
from rotorid.regression.nonlinear import (
    LOSSES,
    NonlinearEstimate,
    nonlinear_least_squares,
)
from rotorid.regression.prior import PriorEffect, PriorValues, effect, prior_rows

REWEIGHTINGS, MOVED = 2, 0.01
"""Rounds at most with weights from predicted amplitudes, after the first with measured ones; standard
deviations by which a round moves the parameters that ends them."""
MOST_STARTS = 8
WITHIN = 1e-6
"""A combination is determined if no more than this share of its slope lies outside what the data see."""
LARGE = 0.12
"""Readings are rarely wrong by more than this share: a model that leaves more of them is doubted."""
Bounds = Mapping[str, tuple[float | None, float | None]]
OutputError = tuple[NonlinearEstimate, Comparison, PriorEffect | None, NormalMatrix]
"""A fit, the comparison with the last weights, what a prior did, and the last normal matrix."""


def identify(
    model: HarmonicModel,
    experiments: Experiments,
    *,
    bounds: Bounds | None = None,
    loss: str = "linear",
    start: Mapping[str, float] | None = None,
    prior: PriorValues | None = None,
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
        One of `LOSSES` in `rotorid.regression.nonlinear`: "linear", or "huber" against gross errors.
    start
        Starting values by name, tried beside the linear estimate.
    prior, ridge
        What is known beside the data, or λ of a ridge towards where the search begins.

    Raises
    ------
    ValueError
        For signals that were not measured at all, options that do not go together, unknown names.
    """
    how: dict[str, Any] = {"bounds": bounds or {}, "loss": loss, "prior": prior or {}, "ridge": ridge}
    _check(model, experiments, start or {}, **how)
    answer = _identified(model, experiments, start or {}, how)
    if experiments.rounding and not experiments.stated and answer.predicted and len(answer.solutions) == 1:
        answer = _by_digits(answer, how)
    return _finished(answer, how["bounds"])


def _check(
    model: HarmonicModel,
    experiments: Experiments,
    start: Mapping[str, float],
    *,
    bounds: Bounds,
    loss: str,
    prior: PriorValues,
    ridge: float,
) -> None:
    """Refuse names that are not the model's, or that stand for two things."""
    one_of(loss, "loss", LOSSES)
    for what, names in (("start", start), ("bounds", bounds), ("prior", prior)):
        check_known(what, names, "parameter", model.parameters)
    for name, (low, high) in bounds.items():
        if low is not None and high is not None and not low < high:
            raise ValueError(f"the bounds of {name} must be (lowest, highest); got ({low}, {high})")
    if prior and not experiments.stated:
        raise ValueError(
            "[prior] is weighed against the errors of the amplitudes: state them (--errors, or "
            "[errors] in the model file)"
        )
    if (prior or ridge or loss != "linear") and len(model.outputs) != len(model.equations):
        raise ValueError(
            "a prior, a ridge and a robust loss belong to models with as many outputs as equations"
        )
    words = NAME.findall(" ".join(model.equations))
    for name in model.signals:
        alike = [w for w in words if w != name and w.casefold() == name.casefold()]
        if alike and words.count(name) == 1 and not np.nan_to_num(experiments.table([name])).any():
            raise ValueError(
                f"is {name} meant to be {alike[0]}? It stands in the equations once and has no readings; "
                f"if it is an amplitude of its own, give it another name"
            )


def _identified(
    model: HarmonicModel,
    data: Experiments,
    start: Mapping[str, float],
    how: Mapping[str, Any],
    linear: LinearFit | None = None,
) -> Identification:
    """By output error, or linear regression alone where the model cannot predict."""
    problem, fits = ValueError(), list[OutputError]()
    try:
        rows = linear.rows if linear else build_rows(model, data)
    except ValueError as error:  # an amplitude that it needs is missing
        problem = error
    else:
        linear = linear or linear_fit(model, rows)
    predicts = len(model.outputs) == len(model.equations)
    hidden = {name for name in model.signals if np.isnan(data.table([name])).all()}
    if linear is None and (not predicts or hidden.intersection(model.inputs) or hidden >= {*model.outputs}):
        raise problem
    solutions = linear.recovery.solutions if linear else ()
    if predicts:
        comparison = compare(model, data)
        given = np.array([start.get(name, np.nan) for name in model.parameters])
        whole = bool(np.isfinite(given).all())
        ends = solutions[: 0 if whole and how["ridge"] else MOST_STARTS]
        begins = [given] * whole + [end if whole else np.where(np.isnan(given), end, given) for end in ends]
        for begin in begins or starting_values(model, data, start):
            try:
                fits.append(output_error(comparison, begin, **how))
            except ValueError as error:  # one of several starts may have no answer
                problem = error
        good = any(fit.converged and fit.estimate.full_rank for fit, *_ in fits)
        if fits and (good or solutions or linear is None):
            return _by_output_error(fits, linear, whole=whole)
        if how["prior"] or how["ridge"] or not (fits or solutions):
            raise problem
    assert linear is not None
    return _by_regression(model, data, linear)


def output_error(
    comparison: Comparison,
    begin: FloatArray,
    *,
    bounds: Bounds | None = None,
    loss: str = "linear",
    prior: PriorValues | None = None,
    ridge: float = 0.0,
) -> OutputError:
    """Fit predicted to measured amplitudes from a start (n,)."""
    names, data, point = comparison.model.parameters, comparison.experiments, begin
    residual, jacobian = evaluated_once(comparison.residuals)
    added = prior_rows(names, prior or {}, ridge, begin, jacobian)
    iterations, moved = 0, np.inf
    for left in reversed(range(REWEIGHTINGS + 1)):
        fit = nonlinear_least_squares(
            residual,
            jacobian,
            point,
            names=names,
            sigma_stated=data.stated,
            bounds=np.array([(bounds or {}).get(name, (None, None)) for name in names], dtype=float),
            loss=loss,
            near=left < REWEIGHTINGS,
            prior=added,
        )
        iterations += fit.iterations
        std = np.zeros(len(begin)) if fit.estimate.std is None else fit.estimate.std
        if left < REWEIGHTINGS and (std > 0).any():
            moved = float((np.abs(fit.estimate.solution - point)[std > 0] / std[std > 0]).max())
        point = fit.estimate.solution
        same = {*comparison.model.outputs} <= {*data.covariances}  # errors that no prediction changes
        if not left or not fit.converged or moved < MOVED or same:
            break
        comparison = comparison.reweighted(point)
        residual, jacobian = evaluated_once(comparison.residuals)
    J = jacobian(point)
    did = effect(added, J, fit.estimate.residuals, point, at_bounds=fit.at_bounds)
    estimate = did.apart(fit.estimate) if did else fit.estimate
    message = f"converged in {counted(iterations, 'iteration')}" if fit.converged else fit.message
    return replace(fit, estimate=estimate, message=message), comparison, did, normal_matrix(names, J)


def _by_output_error(fits: Sequence[OutputError], linear: LinearFit | None, *, whole: bool) -> Identification:
    """The best of the fits, or all that are as good; `whole`: the first began at values that were given."""
    lowest = min(fit.costs[-1] for fit, *_ in fits)
    slack = 1e-6 * lowest + 1e-16 * len(fits[0][0].estimate.residuals)
    equal = [one for one in fits if one[0].costs[-1] <= lowest + slack]
    equal = [one for one in equal if one[0].converged] or equal
    chosen = equal[:1]
    for one in equal if not (whole and equal[0] is fits[0]) else ():
        here = one[0].estimate.solution
        near = any(np.allclose(here, other[0].estimate.solution, rtol=SAME, atol=0) for other in chosen)
        if one[0].estimate.full_rank and not near:
            chosen.append(one)
    fit, comparison, prior, matrix = chosen[0]
    model, data, converged = comparison.model, comparison.experiments, fit.converged
    estimate, theta, points = fit.estimate, fit.estimate.solution, [one.values for one, *_ in chosen]
    apart = several(points) & ~np.isnan(points).any(axis=0)
    values = np.where(apart, np.nan, estimate.values) if converged else theta
    combinations = _combinations(estimate, linear) if converged else ()
    why = linear.reasons if linear and linear.recovery.solutions else ()
    if prior and prior.alone and why:
        prior = replace(prior, alone=why[0])
    if not why and estimate.full_rank:
        why = tuple(why_several(points, model.parameters, np.flatnonzero(apart).tolist()))
    elif not why:
        words = [c.words for c in combinations]
        why = (only_determined(model.parameters, estimate.undetermined, words),)
    covariance = estimate.covariance
    if covariance is not None:
        covariance = np.where(apart[:, None] | apart, np.nan, covariance)

    warnings = [*filter(None, ("" if converged else fit.message, fit.bound_warning))]
    warnings += unexplained(estimate, stated=data.stated) if converged else []
    return Identification(
        model=model,
        experiments=data,
        method="output-error",
        values=values,
        covariance=covariance,
        estimate=estimate,
        linear=linear,
        combinations=combinations,
        solutions=tuple(_named(model, point) for point in points),
        theta=theta,
        unidentifiable=why if np.isnan(values).any() else (),
        predicted=dict(zip(model.outputs, comparison.predict(theta)[0].T, strict=True)),
        left_out=comparison.left_out,
        converged=converged,
        warnings=tuple(warnings),
        notes=(fit.message,),
        normal_matrix=matrix,
        prior=prior,
    )


def _by_regression(model: HarmonicModel, data: Experiments, linear: LinearFit) -> Identification:
    """The answer of linear regression alone."""
    recovery, covariance, each = linear.recovery, linear.system.covariance, linear.system.values
    values, spread = recovery.values, np.full(len(each), np.nan)
    if covariance is not None:
        spread = np.sqrt(np.diag(covariance).clip(0))
        covariance = recovery.gain @ covariance @ recovery.gain.T
        covariance[np.isnan(values)[:, None] | np.isnan(values)] = np.nan
    return Identification(
        model=model,
        experiments=data,
        method="equation-error",
        values=values,
        covariance=covariance,
        estimate=linear.estimate,
        linear=linear,
        combinations=_listed(linear, each, spread, np.ones(len(each), dtype=bool)),
        solutions=tuple(
            _named(model, np.where(recovery.undetermined, np.nan, theta)) for theta in recovery.solutions
        ),
        theta=recovery.solutions[0] if recovery.solutions else values,
        unidentifiable=linear.reasons if np.isnan(values).any() else (),
        left_out=linear.rows.left_out,
        notes=("the model predicts no amplitudes: linear regression, which noisy readings bias",),
        normal_matrix=normal_matrix(linear.estimate.names, linear.rows.K),
    )


def _by_digits(answer: Identification, how: Mapping[str, Any]) -> Identification:
    """With the digits of the readings as their errors, where these explain what is left with 5 % chance.

    What is left widens the intervals, if it is more than the digits make on average.
    """
    from scipy.special import chdtrc

    data, without = answer.experiments, answer
    spread = {name: each for name, each in data.rounding.items() if name}
    std = np.sqrt(data.rounding[""]) if data.free.any() else None
    stated = replace(data, covariances=spread, frequency_std=std)
    try:
        answer = _identified(answer.model, stated, _named(answer.model, answer.theta), how, answer.linear)
    except (ValueError, np.linalg.LinAlgError):
        return without
    chi_square, dof = answer.estimate.chi_square or 0.0, answer.dof
    explained = answer.predicted and answer.converged and (dof < 1 or chdtrc(dof, chi_square) > 0.05)
    if not explained or answer.covariance is None:
        return without
    more = max(1.0, chi_square / max(dof, 1))
    note = "no errors are stated: those of the digits in which readings are written are taken"
    return replace(
        answer,
        covariance=answer.covariance * more,
        combinations=tuple(replace(c, std=c.std and c.std * more**0.5) for c in answer.combinations),
        experiments=data,
        warnings=without.warnings,
        notes=(note, *answer.notes),
    )


def _finished(answer: Identification, bounds: Bounds) -> Identification:
    """With what any answer says: terms left out, that it was searched for, signs."""
    model, data, words = answer.model, answer.experiments, []
    if data.free.any() and (model.power % 2 == 1).any():
        words.append(
            "in free vibration p**2 = -omega**2: terms with odd powers of p (damping) are left out there"
        )
    words += [
        f"{name} is estimated as one unknown: what stands in it is not solved for from it"
        for name in model.parameters
        if not name.isidentifier()
    ]
    words += answer.warnings
    if answer.converged:
        high = answer.values if answer.ci95 is None else np.fmax(answer.values, answer.ci95[:, 1])
        words += _negative(model, float(data.frequencies.max()), answer.values, high, bounds)
    return replace(answer, warnings=(*words, *(answer.prior.warnings if answer.prior else ())))


def _named(model: HarmonicModel, theta: FloatArray) -> dict[str, float]:
    return dict(zip(model.parameters, theta.tolist(), strict=True))


def _combinations(estimate: Estimate, linear: LinearFit | None) -> tuple[Combination, ...]:
    """Products, sums and ratios that the data see, at the estimate, with the spread of the linearised model.

    They are those of the linear estimate: exact, and not tangents at the end of the search. Without it
    tangents are given, named so.
    """
    theta, spread = estimate.solution, estimate.solution_covariance
    if linear is None:
        tangents = [] if estimate.full_rank else estimate.combinations
        return tuple(Combination(f"(near these values) {c.words}", c.value, None) for c in tangents)
    values, slopes = linear.system.combinations(theta)
    scale = np.where(theta == 0, 1.0, theta)
    rows, relative = np.linalg.qr((estimate.row_space * scale).T)[0], slopes * scale
    beside = np.linalg.norm(relative - relative @ rows @ rows.T, axis=1)
    seen = beside <= WITHIN * np.linalg.norm(relative, axis=1)
    std = np.full(len(values), np.nan)
    if spread is not None:
        std = np.sqrt(np.einsum("qi,ij,qj->q", slopes, spread, slopes).clip(0))
    return _listed(linear, values, std, seen)


def _listed(
    linear: LinearFit, values: FloatArray, std: FloatArray, seen: BoolArray
) -> tuple[Combination, ...]:
    """Combinations that the data see, but for single parameters; NaN: no standard deviation is known."""
    each = zip(linear.words, values.tolist(), std.tolist(), seen, strict=True)
    return tuple(
        Combination(words, value, None if np.isnan(error) else error)
        for words, value, error, shown in each
        if shown and words not in linear.system.names
    )


def unexplained(estimate: Estimate, *, stated: bool) -> list[str]:
    """What the model leaves of the readings, if it is much: more than stated errors, or a large share."""
    if why := estimate.misfit():
        return [
            f"{why}: the model, a reading, or the errors stated are wrong, or a better minimum lies "
            "elsewhere (try another start)"
        ]
    left = np.sqrt(2 * np.mean(estimate.residuals**2))  # of both parts of an amplitude, relative to it
    if stated or not left > LARGE:
        return []
    return [
        f"the model leaves {100 * left:.0f} % of the readings: unless they are as noisy as that, the model, "
        "a reading, a unit or the sign of phases is wrong"
    ]


def _negative(
    model: HarmonicModel, highest: float, values: FloatArray, high: FloatArray, bounds: Bounds
) -> list[str]:
    """Masses, dampers and springs whose forces are negative up to the end of their interval (n,).

    But those that bounds allow; `highest` is the highest frequency of the data, rad/s.
    """
    kinds = passive_elements(model)
    power = np.array([kinds.get(name, -1) for name in model.parameters])
    force = np.nan_to_num(np.where(power < 0, 0.0, np.abs(values) * highest**power))
    lowest = [bounds.get(name, (0.0, None))[0] for name in model.parameters]
    each = zip(model.parameters, values, (high < 0) & (force > 1e-9 * force.max()), lowest, strict=True)
    wrong = [f"{name} = {x:.6g}" for name, x, below, low in each if below and low is not None and low >= 0]
    if not wrong:
        return []
    return [
        f"{listing(wrong, 'and')} negative, which no passive spring, damper or mass is: a sign (of a force, "
        "or of phases: lead, not lag), a unit or the model may be wrong"
    ]
