"""Identification by linear regression: residuals of the equations (equation error)."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from fractions import Fraction

import numpy as np
from numpy.typing import ArrayLike

from rotorid.base.arrays import ComplexArray, FloatArray, IntArray
from rotorid.base.text import listing
from rotorid.harmonic.experiments import Experiments
from rotorid.harmonic.leave_one_out import leave_one_out
from rotorid.harmonic.operator_model import HarmonicModel
from rotorid.harmonic.output_error import output_error
from rotorid.harmonic.parameter_combinations import combination_words, ratio_words
from rotorid.harmonic.parameter_recovery import (
    Recovery,
    only_determined,
    recover,
    undetermined_parameters,
)
from rotorid.harmonic.plausibility import doubts, what_more_can_tell
from rotorid.harmonic.polynomial import ONE, Polynomial
from rotorid.harmonic.polynomial_solutions import System
from rotorid.harmonic.regression_rows import Rows, build_rows, row_covariance, whiten
from rotorid.harmonic.result import Identification
from rotorid.regression import least_squares
from rotorid.regression.estimate import Estimate
from rotorid.regression.nonlinear import NonlinearEstimate
from rotorid.regression.normal_matrix import normal_matrix
from rotorid.regression.undetermined_combinations import FoundCombination, echelon

Bounds = Mapping[str, tuple[float | None, float | None]]

REWEIGHTINGS = 60
SETTLED = 0.01
"""Weights have settled where the last round moved nothing by more than this share of its deviation."""
RCOND = 1e-11
"""Columns are merged exactly beforehand; what is left below this comes from too few different experiments."""


@dataclass(frozen=True, eq=False)
class LinearFit:
    """What linear regression finds, before it becomes an answer.

    Attributes
    ----------
    model, rows
        The equations, and their rows.
    estimate, K, Y, experiment
        The regression: its unknowns, weighted rows (m, u), (m,) and the experiment of each.
    solution
        Of all unknowns, those that the others are told relative to included (as 1).
    picks
        Combinations of its unknowns that the data determine, (q, u).
    groups
        Unknowns that may all be multiplied by one factor; of these only ratios are determined.
    system, words, recovery
        The combinations (q,) as functions of the parameters, in words, and the parameters from them.
    settled
        Whether the weights fit the estimate.
    """

    model: HarmonicModel
    rows: Rows
    estimate: Estimate
    solution: FloatArray
    K: FloatArray
    Y: FloatArray
    experiment: IntArray
    picks: FloatArray
    groups: tuple[IntArray, ...]
    system: System
    words: tuple[str, ...]
    recovery: Recovery
    settled: bool


def linear_fit(model: HarmonicModel, experiments: Experiments, bounds: Bounds | None = None) -> LinearFit:
    """Regression of the equations, and the parameters that follow; errors as in `identify`."""
    rows = build_rows(model, experiments)
    groups = _groups(model, rows)
    fixed = told_as_one(rows, groups)
    kept = np.flatnonzero(fixed == 0)
    estimate, solution, K, Y, experiment, settled = _regress(model, experiments, rows, fixed)
    picks = _determined(estimate)[: 0 if len(groups) and not fixed.any() else None]
    whole = np.zeros((len(picks), len(fixed)))
    whole[:, kept] = picks
    below = np.zeros_like(whole)
    for group in groups:
        below[whole[:, group].any(axis=1)] = np.where(np.isin(np.arange(len(fixed)), group), fixed, 0.0)
    cov_u = estimate.solution_covariance if settled else None
    covariance = None if cov_u is None else picks @ cov_u @ picks.T
    combos = model.combinations
    system = System(
        model.parameters,
        model.exponents[1:],
        whole @ combos.rows,
        whole @ solution,
        covariance,
        below @ combos.rows if groups else None,
    )
    if len(picks):
        recovery = recover(system, limits(bounds))
    else:
        recovery = Recovery((), np.ones(len(model.parameters), dtype=bool), None, (), ())
    words = _words(model, whole, system)
    return LinearFit(
        model, rows, estimate, solution, K, Y, experiment, picks, groups, system, words, recovery, settled
    )


def equation_error(
    model: HarmonicModel, experiments: Experiments, *, bounds: Bounds | None = None
) -> Identification:
    """Linear regression; see `identify`."""
    fit = linear_fit(model, experiments, bounds)
    rows, estimate, recovery, words = fit.rows, fit.estimate, fit.recovery, fit.words
    values, covariance = fit.system.values, fit.system.covariance
    warnings = [*rows.warnings, *recovery.warnings]
    if not fit.settled:
        warnings.append(
            "the weights that follow from the stated errors did not settle: no intervals; use output error"
        )
    parameters = recovery.values
    for name, (low, high) in limits(bounds).items():
        value = parameters[model.parameters.index(name)]
        if np.isfinite(value) and not low <= value <= high:
            warnings.append(f"{name} = {value:.6g} lies outside its bounds; output error keeps to them")

    theta_cov = None
    if covariance is not None:
        theta_cov = np.full((len(parameters), len(parameters)), np.nan)
        if recovery.gain is not None:
            theta_cov = recovery.gain @ covariance @ recovery.gain.T
            theta_cov[np.isnan(parameters), :] = theta_cov[:, np.isnan(parameters)] = np.nan
    if not recovery.solutions:  # what stands alone in the equations is known all the same
        own = [i for i, w in enumerate(words) if w in model.parameters]
        at = [model.parameters.index(words[i]) for i in own]
        parameters[at] = values[own]
        if theta_cov is not None and covariance is not None:
            theta_cov[np.ix_(at, at)] = covariance[np.ix_(own, own)]
    influence = None
    if recovery.gain is not None:
        change = leave_one_out(fit.K, fit.Y, fit.experiment, len(experiments))
        influence = change @ (recovery.gain @ fit.picks).T
    residuals = rows.residuals(fit.solution)
    used = np.stack((residuals.real, residuals.imag), axis=2)[rows.used]
    found = Identification(
        model=model,
        experiments=experiments,
        method="equation-error",
        values=parameters,
        covariance=theta_cov,
        dof=estimate.dof,
        errors_stated=estimate.errors_stated,
        combinations=tuple(
            FoundCombination(w, float(values[i]), None if covariance is None else _root(covariance[i, i]))
            for i, w in enumerate(words)
            if w not in model.parameters
        ),
        solutions=tuple(
            dict(zip(model.parameters, np.where(recovery.undetermined, np.nan, theta).tolist(), strict=True))
            for theta in recovery.solutions
        ),
        starts=tuple(
            dict(zip(model.parameters, theta.tolist(), strict=True)) for theta in recovery.solutions
        ),
        rank=len(fit.picks),
        condition_number=estimate.condition_number,
        unidentifiable=reasons(fit, experiments) if np.isnan(parameters).any() else (),
        residuals=residuals,
        residual_names=tuple(f"equation {i + 1}" for i in range(len(model.equations))),
        residual_rms=float(np.sqrt(np.mean(used**2))),
        predicted=_predicted(model, experiments, recovery),
        influence=influence,
        left_out=rows.left_out,
        converged=fit.settled,
        warnings=tuple(warnings),
        notes=_notes(model, experiments, estimate),
        normal_matrix=normal_matrix(estimate.names, fit.K),
    )

    return replace(found, warnings=(*found.warnings, *_doubts(fit, found, bounds)))


def _doubts(fit: LinearFit, found: Identification, bounds: Bounds | None) -> tuple[str, ...]:
    """What speaks against the answer, after a look at output error from there."""

    def refit(others: Experiments) -> Sequence[FloatArray]:
        return linear_fit(fit.model, others).recovery.solutions

    def refine(theta: FloatArray) -> tuple[NonlinearEstimate, FloatArray]:
        refined = output_error(fit.model, found.experiments, theta).fit
        shown = [i for i, w in enumerate(fit.words) if w not in found.parameters]
        return refined, fit.system.combinations(refined.estimate.solution)[shown]

    return doubts(found, fit.estimate, bounds, refit, refine)


def limits(bounds: Bounds | None) -> dict[str, tuple[float, float]]:
    """Bounds as numbers, infinite where there is no limit."""
    return {
        name: (-np.inf if low is None else low, np.inf if high is None else high)
        for name, (low, high) in (bounds or {}).items()
    }


def _regress(
    model: HarmonicModel, experiments: Experiments, rows: Rows, fixed: FloatArray
) -> tuple[Estimate, FloatArray, FloatArray, FloatArray, IntArray, bool]:
    """Unweighted, or with stated errors reweighted until the weights fit; some unknowns are fixed."""
    kept = np.flatnonzero(fixed == 0)
    names = _unique(model.combinations.words)
    words = [names[i] for i in kept]

    def solve(K: FloatArray, Y: FloatArray, sigma: float | None) -> tuple[Estimate, FloatArray]:
        found = least_squares(K[:, kept], Y - K @ fixed, names=words, sigma=sigma, rcond=RCOND)
        solution = fixed.copy()
        solution[kept] = found.solution
        return found, solution

    K, Y, experiment = rows.real_rows()
    estimate, solution = solve(K, Y, None)
    settled = True
    if experiments.stated and np.any(Y - K @ fixed):
        for _ in range(REWEIGHTINGS):
            before = solution
            K, Y, experiment = whiten(rows, row_covariance(model, experiments, rows, before))
            estimate, solution = solve(K, Y, 1.0)
            if np.all(np.abs(solution - before) <= 1e-12 * np.abs(before)):
                break
        spread = estimate.solution_covariance
        std = np.zeros(len(kept)) if spread is None else np.sqrt(np.diag(spread).clip(0))
        size = np.maximum(1e-6 * np.abs(before[kept]), SETTLED * std)
        settled = bool(np.all(np.abs(solution - before)[kept] <= size))
    return estimate, solution, K[:, kept], Y - K @ fixed, experiment, settled


def _determined(estimate: Estimate) -> FloatArray:
    """Rows that pick the combinations of regression unknowns that these data determine, (q, u)."""
    if estimate.full_rank:
        return np.eye(len(estimate.names))
    rows = echelon(estimate.row_space)
    return np.array(rows) if rows else np.zeros((0, len(estimate.names)))


def _groups(model: HarmonicModel, rows: Rows) -> tuple[IntArray, ...]:
    """Groups of regression unknowns that may all be multiplied by one factor: right sides are 0.

    Regression would find zero for them, a wrong answer. Equations are linked by the unknowns that they share.
    """
    holds = np.zeros((rows.Y.shape[1], rows.coefficients.shape[1]), dtype=bool)
    np.logical_or.at(holds, model.equation, rows.coefficients != 0)
    linked = holds @ holds.T | np.eye(len(holds), dtype=bool)
    for _ in range(len(holds).bit_length()):
        linked = linked @ linked
    known = np.any(rows.Y != 0, axis=0)
    parts = np.unique(linked, axis=0)[::-1]
    return tuple(
        np.flatnonzero(holds[part].any(axis=0))
        for part in parts
        if holds[part].any() and not known[part].any()
    )


def told_as_one(rows: Rows, groups: Sequence[IntArray]) -> FloatArray:
    """1 for each unknown that others are told relative to, else 0, (u,)."""
    fixed = np.zeros(rows.coefficients.shape[1])
    fixed[[_reference(rows, group) for group in groups]] = 1.0
    # where each unknown is alone with its factor, nothing is told relative to another
    return np.zeros_like(fixed) if fixed.all() else fixed


def _reference(rows: Rows, group: IntArray) -> int:
    """The first unknown of a group that is surely not zero: the others are told relative to it."""
    K = rows.real_rows()[0][:, group]
    scale = np.linalg.norm(K, axis=0)
    scale[scale == 0] = 1.0
    share = np.abs(np.linalg.svd(K / scale)[2][-1])
    return int(group[np.flatnonzero(share > 0.1 * share.max())[0]])


def _words(model: HarmonicModel, picks: FloatArray, system: System) -> tuple[str, ...]:
    own = model.combinations.words
    words = []
    for i, (pick, row) in enumerate(zip(picks, system.matrix, strict=True)):
        used = np.flatnonzero(pick)
        if system.below is not None and system.below[i].any():
            words.append(ratio_words(_polynomial(model, row), _polynomial(model, system.below[i])))
        elif len(used) == 1:
            words.append(own[used[0]])
        else:
            words.append(combination_words({m: {ONE: x} for m, x in _polynomial(model, row).items()}))
    return tuple(words)


def _polynomial(model: HarmonicModel, row: FloatArray) -> Polynomial:
    return {model.monomials[j]: Fraction(float(f"{row[j]:.6g}")) for j in np.flatnonzero(row)}


def _unique(words: tuple[str, ...]) -> list[str]:
    return [w if words.count(w) == 1 else f"{w} [{i + 1}]" for i, w in enumerate(words)]


def reasons(fit: LinearFit, experiments: Experiments) -> tuple[str, ...]:
    """Why parameters have no one value, in words."""
    model, recovery, estimate = fit.model, fit.recovery, fit.estimate
    found = []
    if recovery.undetermined.any():
        lost = [name for name, out in zip(model.parameters, recovery.undetermined, strict=True) if out]
        found.append(only_determined(model.parameters, lost, fit.words))
    for group in fit.groups:
        loose = [model.combinations.words[i] for i in group]
        if set(loose) <= set(model.parameters):
            found.append(
                f"every multiple of {listing(loose, 'and')} fits, for no known term that is not zero stands "
                "in their equations: no experiment of this kind tells more than ratios; make one of them "
                "known"
            )
    if not estimate.full_rank:
        now = len(model.parameters) - len(undetermined_parameters(fit.system)[1])
        found.append(
            f"these experiments determine {estimate.rank} of the {len(estimate.names)} combinations that the "
            f"model could show; {what_more_can_tell(model, experiments, now)}"
        )
    return (*found, *recovery.reasons)


def _predicted(model: HarmonicModel, experiments: Experiments, recovery: Recovery) -> dict[str, ComplexArray]:
    """Amplitudes of the outputs, NaN in free vibration; empty where the model cannot predict them."""
    driven = np.flatnonzero(~experiments.free)
    if not recovery.solutions or not len(driven):
        return {}
    part = experiments.take(driven)
    try:
        found = model.predict(recovery.solutions[0], part.frequencies, part.signals, part.varying)
    except (np.linalg.LinAlgError, ValueError):
        return {}
    out = {name: np.full(len(experiments), np.nan, dtype=complex) for name in found}
    for name, values in found.items():
        out[name][driven] = values
    return out


def _notes(model: HarmonicModel, experiments: Experiments, estimate: Estimate) -> tuple[str, ...]:
    notes = []
    if model.varying:
        notes.append(f"{listing(model.varying, 'and')}: from the measurements, row by row")
    if not experiments.stated:
        notes.append(
            "all rows count alike; state errors of the amplitudes to weight them and for honest intervals"
        )
    if estimate.dof > 0 and len(model.outputs) == len(model.equations):
        notes.append(
            "measured amplitudes stand in the regression matrix: where noise matters prefer output error"
        )
    return tuple(notes)


def _root(variance: ArrayLike) -> float:
    return float(np.sqrt(max(float(np.asarray(variance)), 0.0)))
