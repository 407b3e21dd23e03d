"""Identification by linear regression: residuals of the equations (equation error)."""

from __future__ import annotations

from collections.abc import Mapping
from fractions import Fraction

import numpy as np
from numpy.typing import ArrayLike

from rotorid.base.arrays import BoolArray, ComplexArray, FloatArray, IntArray
from rotorid.harmonic.experiments import Experiments
from rotorid.harmonic.features import combination_words
from rotorid.harmonic.influence import leave_one_out
from rotorid.harmonic.model import HarmonicModel
from rotorid.harmonic.polynomial import ONE
from rotorid.harmonic.recovery import Recovery, System, and_words, recover
from rotorid.harmonic.result import FoundCombination, Identification
from rotorid.harmonic.rows import Rows, build_rows, row_covariance, whiten
from rotorid.regression import least_squares
from rotorid.regression.estimate import Estimate, echelon

Bounds = Mapping[str, tuple[float | None, float | None]]

METHODS = ("equation-error", "output-error")
REWEIGHTINGS = 20
RCOND = 1e-11
"""Columns are merged exactly beforehand; what is left below this comes from too few different experiments."""


def identify(
    model: HarmonicModel,
    experiments: Experiments,
    *,
    method: str = "equation-error",
    bounds: Bounds | None = None,
    loss: str = "linear",
    start: Mapping[str, float] | None = None,
) -> Identification:
    """Identify a model's parameters from measured amplitudes.

    Parameters
    ----------
    model
        From `harmonic_model`.
    experiments
        Amplitudes of all signals; a row that needs one that was not measured (NaN) is left out.
    method
        "equation-error": linear regression of the equations' residuals, all rows alike as in [S] (9), (24);
        with stated errors of the amplitudes each row has the weight that follows from them.
        "output-error": nonlinear least squares of predicted against measured amplitudes, started from the
        linear estimate; unbiased where noise in the amplitudes makes the linear one biased.
    bounds
        Lowest and highest value by name, None: no limit. Output error keeps to them; with equation error
        they choose among several solutions.
    loss
        "linear" or a robust loss of output error ("soft_l1", "huber", "cauchy").
    start
        Starting values by name for output error, where the linear estimate is not to be used.

    Raises
    ------
    ValueError
        For signals that were not measured at all, options that do not go together, unknown names.
    """
    if method not in METHODS:
        raise ValueError(f"method is one of {', '.join(METHODS)}; got '{method}'")
    for what, given in (("bounds", bounds), ("start", start)):
        for name in given or {}:
            if name not in model.parameters:
                raise ValueError(f"{what}: {name} is no parameter; those are {', '.join(model.parameters)}")
    for name, (low, high) in limits(bounds).items():
        if not low <= high:
            raise ValueError(f"the bounds of {name} must be (lowest, highest); got ({low}, {high})")
    if method == "output-error":
        from rotorid.harmonic.output_error import identify_outputs

        return identify_outputs(model, experiments, bounds=bounds, loss=loss, start=start)
    if loss != "linear" or start:
        raise ValueError("loss and start belong to method='output-error'; linear regression has neither")
    return equation_error(model, experiments, bounds=bounds)


def equation_error(
    model: HarmonicModel, experiments: Experiments, *, bounds: Bounds | None = None
) -> Identification:
    """Linear regression; see `identify`."""
    rows = build_rows(model, experiments)
    estimate, K, Y, experiment = _regress(model, experiments, rows)
    combos = model.combinations
    scalable = _scalable(rows)
    picks = _determined(estimate)
    picks = picks[~np.any(picks[:, scalable], axis=1)]
    matrix = picks @ combos.rows
    values = picks @ estimate.solution
    cov_u = estimate.solution_covariance
    covariance = None if cov_u is None else picks @ cov_u @ picks.T
    words = _words(model, picks, matrix)

    warnings = list(rows.warnings)
    if not len(picks):
        recovery = Recovery((), np.ones(len(model.parameters), dtype=bool), None, (), ())
    else:
        system = System(model.parameters, model.exponents[1:], matrix, values, covariance)
        recovery = recover(system, limits(bounds))
    warnings += recovery.warnings
    parameters = recovery.values
    for name, (low, high) in limits(bounds).items():
        value = parameters[model.parameters.index(name)]
        if np.isfinite(value) and not low <= value <= high:
            warnings.append(f"{name} = {value:.6g} lies outside its bounds; output error keeps to them")

    theta_cov = None
    if covariance is not None and recovery.gain is not None:
        theta_cov = recovery.gain @ covariance @ recovery.gain.T
        theta_cov[np.isnan(parameters), :] = theta_cov[:, np.isnan(parameters)] = np.nan
    elif covariance is not None:
        theta_cov = np.full((len(parameters), len(parameters)), np.nan)
    if not recovery.solutions:  # what stands alone in the equations is known all the same
        own = [(i, model.parameters.index(w)) for i, w in enumerate(words) if w in model.parameters]
        for i, j in own:
            parameters[j] = values[i]
            for k, m in own:
                if theta_cov is not None and covariance is not None:
                    theta_cov[j, m] = covariance[i, k]
    influence = None
    if recovery.gain is not None:
        influence = leave_one_out(K, Y, experiment, len(experiments)) @ (recovery.gain @ picks).T
    residuals = rows.residuals(estimate.solution)
    used = np.stack((residuals.real, residuals.imag), axis=2)[rows.used]
    return Identification(
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
            {
                name: float("nan") if recovery.undetermined[j] else float(theta[j])
                for j, name in enumerate(model.parameters)
            }
            for theta in recovery.solutions
        ),
        starts=tuple(
            {name: float(x) for name, x in zip(model.parameters, theta, strict=True)}
            for theta in recovery.solutions
        ),
        rank=len(picks),
        condition_number=estimate.condition_number,
        unidentifiable=_reasons(model, recovery, words, estimate, scalable),
        residuals=residuals,
        residual_names=tuple(f"equation {i + 1}" for i in range(len(model.equations))),
        residual_rms=float(np.sqrt(np.mean(used**2))),
        predicted=_predicted(model, experiments, recovery),
        influence=influence,
        left_out=rows.left_out,
        warnings=tuple(warnings),
        notes=_notes(model, experiments, estimate),
    )


def limits(bounds: Bounds | None) -> dict[str, tuple[float, float]]:
    """Bounds as numbers, infinite where there is no limit."""
    return {
        name: (-np.inf if low is None else low, np.inf if high is None else high)
        for name, (low, high) in (bounds or {}).items()
    }


def _regress(
    model: HarmonicModel, experiments: Experiments, rows: Rows
) -> tuple[Estimate, FloatArray, FloatArray, IntArray]:
    """Unweighted, or with stated errors reweighted until the weights fit the estimate."""
    words = _unique(model.combinations.words)
    K, Y, experiment = rows.real_rows()
    estimate = least_squares(K, Y, names=words, rcond=RCOND)
    if not experiments.stated or not np.any(Y):
        return estimate, K, Y, experiment
    for _ in range(REWEIGHTINGS):
        before = estimate.solution
        covariance = row_covariance(model, experiments, rows, before)
        K, Y, experiment = whiten(rows, covariance)
        estimate = least_squares(K, Y, names=words, sigma=1.0, rcond=RCOND)
        if np.all(np.abs(estimate.solution - before) <= 1e-12 * np.abs(before)):
            break
    return estimate, K, Y, experiment


def _determined(estimate: Estimate) -> FloatArray:
    """Rows that pick the combinations of regression unknowns that these data determine, (q, u)."""
    if estimate.full_rank:
        return np.eye(len(estimate.names))
    rows = echelon(estimate.row_space)
    return np.array(rows) if rows else np.zeros((0, len(estimate.names)))


def _scalable(rows: Rows) -> BoolArray:
    """Regression unknowns (u,) that may all be multiplied by one factor: their equations have right side 0.

    Regression would find zero for them, a wrong answer. Equations are linked by the unknowns that they share.
    """
    e, u = rows.Y.shape[1], rows.coefficients.shape[1]
    holds = np.zeros((e, u), dtype=bool)
    np.logical_or.at(holds, rows.equation, rows.coefficients != 0)
    fixed = np.any(rows.Y != 0, axis=0)
    while True:
        known = np.any(holds[fixed], axis=0)
        linked = fixed | np.any(holds[:, known], axis=1)
        if (linked == fixed).all():
            return np.asarray(~known, dtype=bool)
        fixed = linked


def _words(model: HarmonicModel, picks: FloatArray, matrix: FloatArray) -> tuple[str, ...]:
    own = model.combinations.words
    words = []
    for pick, row in zip(picks, matrix, strict=True):
        used = np.flatnonzero(pick)
        if len(used) == 1:
            words.append(own[used[0]])
        else:
            parts = {model.monomials[j]: {ONE: Fraction(float(f"{row[j]:.6g}"))} for j in np.flatnonzero(row)}
            words.append(combination_words(parts))
    return tuple(words)


def _unique(words: tuple[str, ...]) -> list[str]:
    return [w if words.count(w) == 1 else f"{w} [{i + 1}]" for i, w in enumerate(words)]


def _reasons(
    model: HarmonicModel,
    recovery: Recovery,
    words: tuple[str, ...],
    estimate: Estimate,
    scalable: BoolArray,
) -> tuple[str, ...]:
    reasons = []
    if recovery.undetermined.any():
        lost = [name for name, out in zip(model.parameters, recovery.undetermined, strict=True) if out]
        seen = [name for name in model.parameters if name not in lost]
        seen += [w for w in words if w not in seen and any(n in _names(w) for n in lost)]
        verb = "is" if len(seen) == 1 else "are"
        text = f"only {and_words(seen)} {verb} determined" if seen else "nothing is determined"
        itself = "itself is" if len(lost) == 1 else "themselves are"
        reasons.append(f"{text}; {and_words(lost)} by {itself} not")
    if scalable.any():
        loose = [w for w, loose in zip(model.combinations.words, scalable, strict=True) if loose]
        reasons.append(
            f"every multiple of {and_words(loose)} fits, for no known term that is not zero stands in their "
            f"equations; make one of them known, or give a force that is not zero"
        )
    if not estimate.full_rank:
        reasons.append(
            f"these experiments determine {estimate.rank} of the {len(estimate.names)} combinations that the "
            f"model could show; more experiments, at other frequencies, may determine the rest"
        )
    return (*reasons, *recovery.reasons)


def _names(words: str) -> set[str]:
    import re

    return set(re.findall(r"[^\W\d]\w*", words))


def _predicted(model: HarmonicModel, experiments: Experiments, recovery: Recovery) -> dict[str, ComplexArray]:
    """Amplitudes of the outputs, NaN in free vibration; empty where the model cannot predict them."""
    if not recovery.solutions or len(model.outputs) != len(model.equations):
        return {}
    driven = np.flatnonzero(~experiments.free)
    if not len(driven):
        return {}
    part = experiments.take(driven)
    try:
        found = model.predict(recovery.solutions[0], part.frequencies, part.signals, part.varying)
    except (np.linalg.LinAlgError, ValueError):
        return {}
    out = {}
    for name, values in found.items():
        out[name] = np.full(len(experiments), np.nan, dtype=complex)
        out[name][driven] = values
    return out


def _notes(model: HarmonicModel, experiments: Experiments, estimate: Estimate) -> tuple[str, ...]:
    notes = []
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
