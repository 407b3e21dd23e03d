"""Plausibility of an identified model: what it leaves of the readings, signs of passive elements."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import replace

import numpy as np

from rotorid.base.arrays import FloatArray
from rotorid.harmonic.comparison import compare
from rotorid.harmonic.experiments import Experiments
from rotorid.harmonic.operator_model import HarmonicModel
from rotorid.harmonic.parameter_combinations import multipliers
from rotorid.harmonic.result import Identification
from rotorid.regression import least_squares
from rotorid.regression.estimate import Estimate
from rotorid.regression.nonlinear import Bounds, NonlinearEstimate

LARGE = 0.12
"""Readings are rarely wrong by more than this share: a model that leaves more of them is doubted."""
EXPLAINS = 0.2
"""Another reading of the data is named where it leaves less than this share of what is left without it."""
EXACT = 1e-6
"""Share of the readings below which there is no noise."""
KINDS = ("spring", "damper", "mass")
Refit = Callable[[Experiments], Sequence[FloatArray]]
Refine = Callable[[FloatArray], tuple[NonlinearEstimate, FloatArray]]
UNITS = {"Hz": 2 * np.pi, "rpm": np.pi / 30}


def doubts(
    found: Identification,
    estimate: Estimate,
    bounds: Bounds | None,
    refit: Refit,
    refine: Refine | None = None,
) -> tuple[str, ...]:
    """What speaks against a result, in words.

    Stated errors: residuals that these explain with a probability below 0.1 %. Otherwise: what the model
    leaves of the readings, if it is much. A linear estimate is judged after `refine`, output error from there
    (and its combinations): noise that biases it is not the model's fault, and is named instead. Units and
    phases that would explain what is left are found by `refit`, a linear estimate from other experiments.
    Passive elements with a negative value are named, unless bounds say that it may be so.
    """
    left, theta, fit, combinations = None, None, None, np.zeros(0)
    if found.starts:
        theta = np.array(list(found.starts[0].values()))
        left = left_over(found.model, found.experiments, theta)
    if refine is not None and theta is not None and left is not None and left > EXACT:
        fit, combinations = _refined(refine, theta)
    if fit is not None and left is not None:
        rest = left_over(found.model, found.experiments, fit.estimate.solution)
        if rest is not None and rest < left:
            left, theta, estimate = rest, fit.estimate.solution, fit.estimate
    words = [*misfit(estimate)] if found.converged else []
    if found.converged and not estimate.errors_stated and left is not None and left > LARGE:
        ordered = theta is not None and _ordered(found, theta)
        random = "not at random over the frequency, so " if ordered else "unless they are as noisy as that, "
        words.append(
            f"the model leaves {100 * left:.0f} % of the readings: {random}the model, a reading or a unit is "
            "wrong"
        )
    if not words and fit is not None and (biased := _biased(found, fit, combinations)):
        return (biased,)
    if left is not None and (words or not found.converged):
        words += _other_reading(found, left, refit)
    return (*words, *(_negative(found, bounds, fit) if found.converged else ()))


def _refined(refine: Refine, theta: FloatArray) -> tuple[NonlinearEstimate | None, FloatArray]:
    try:
        fit, combinations = refine(theta)
    except (ValueError, np.linalg.LinAlgError):
        return None, np.zeros(0)
    return fit if fit.converged else None, combinations


def _biased(found: Identification, fit: NonlinearEstimate, combinations: FloatArray) -> str:
    """Words where output error lies outside an interval of the linear estimate."""
    factor = found.coverage_factor
    if found.std is None or factor is None:
        return ""
    words = [*found.parameters, *(c.words for c in found.combinations)]
    here = np.array([*found.values, *(c.value for c in found.combinations)])
    half = factor * np.array([*found.std, *(np.nan if c.std is None else c.std for c in found.combinations)])
    there = np.array([*fit.values, *combinations])
    with np.errstate(divide="ignore", invalid="ignore"):
        away = np.nan_to_num(np.abs(there - here) / half)
    i = int(np.argmax(away))
    if away[i] <= 1:
        return ""
    return (
        "noisy readings bias the linear estimate and make its intervals too narrow: output error gives "
        f"{words[i]} = {there[i]:.6g}, outside its interval; take the method output-error"
    )


def _ordered(found: Identification, theta: FloatArray) -> bool:
    """Whether relative residuals of neighbouring frequencies are alike: those of noise are not (2.5 %)."""
    comparison = compare(found.model, found.experiments)
    gap = (comparison.predict(theta)[0] - comparison.measured) / np.abs(comparison.measured)
    seen = np.isfinite(gap)
    r = np.where(seen, gap, 0.0)[np.argsort(found.experiments.frequencies)]
    alike = float((r[1:] * r[:-1].conj()).real.sum())
    return bool(alike * np.sqrt(2 * np.count_nonzero(seen)) > 1.96 * float(np.sum(np.abs(r) ** 2)))


def misfit(estimate: Estimate) -> tuple[str, ...]:
    """A warning where residuals this large are improbable (0.1 %) for the stated errors."""
    from scipy.special import chdtrc

    if estimate.chi_square is None or estimate.dof < 1:
        return ()
    if chdtrc(estimate.dof, estimate.chi_square) > 1e-3:
        return ()
    ratio = float(np.sqrt(estimate.chi_square / estimate.dof))
    return (
        f"residuals are {ratio:.2g} times as large as the stated errors explain: the model, a reading, or "
        "the errors stated are wrong, or a better minimum lies elsewhere (try another start)",
    )


def left_over(model: HarmonicModel, experiments: Experiments, theta: FloatArray) -> float | None:
    """Root mean square of what the model leaves of each output's readings and of natural frequencies.

    Relative to the root mean square of the readings; None where the model predicts none.
    """
    try:
        comparison = compare(model, experiments)
        predicted, natural = comparison.predict(theta)
    except (ValueError, np.linalg.LinAlgError):
        return None
    gap = np.abs(predicted - comparison.measured) ** 2
    size = np.where(np.isnan(gap), 0.0, np.abs(comparison.measured) ** 2).sum(axis=0)
    shares = (np.nansum(gap, axis=0)[size > 0] / size[size > 0]).tolist()
    if len(comparison.free):
        w = experiments.frequencies[comparison.free]
        # a mode that the model does not have is left whole
        shares.append(float(np.mean(np.nan_to_num(natural[comparison.free] / w - 1, nan=1.0) ** 2)))
    return float(np.sqrt(np.mean(shares))) if shares else None


def _other_reading(found: Identification, left: float, refit: Refit) -> list[str]:
    """Units of the frequency and a sign of the phase with which the model fits much better."""
    data = replace(found.experiments, errors=None, covariances={})
    w = data.frequencies
    turned = {name: np.conj(z) for name, z in data.signals.items()}
    others = {"phases of the other sign": replace(data, signals=turned)}
    for unit, factor in UNITS.items():
        others[f"frequencies in {unit}, not rad/s,"] = replace(data, frequencies=w * factor)
        others[f"frequencies in rad/s, not {unit},"] = replace(data, frequencies=w / factor)
    words = []
    plain = _left_by_refit(found.model, data, refit)
    left = left if plain is None else min(left, plain)  # the same estimate with and without the change
    for what, other in others.items():
        rest = _left_by_refit(found.model, other, refit)
        if rest is not None and rest < min(EXPLAINS * left, LARGE):
            words.append(
                f"with {what} the model leaves {100 * rest:.2g} % of the readings, not {100 * left:.0f} %"
            )
    return words


def _left_by_refit(model: HarmonicModel, data: Experiments, refit: Refit) -> float | None:
    try:
        solutions = refit(data)
    except (ValueError, np.linalg.LinAlgError):
        return None
    return left_over(model, data, solutions[0]) if solutions else None


def _negative(found: Identification, bounds: Bounds | None, fit: NonlinearEstimate | None) -> list[str]:
    """Masses, dampers and springs negative beyond their interval, and for output error `fit`, too."""
    interval, kinds = found.ci95, passive_elements(found.model)
    pk = multipliers([0, 1, 2], [()] * 3, np.array([found.experiments.frequencies.max()]))
    force = max((abs(found.value(n) * pk[0, k]) for n, k in kinds.items()), default=0.0)
    named: list[tuple[str, int]] = []
    for name, kind in kinds.items():
        i, (low, _) = found.parameters.index(name), (bounds or {}).get(name, (0.0, None))
        high = found.values[i] if interval is None or np.isnan(interval[i, 1]) else interval[i, 1]
        rounding = abs(found.values[i] * pk[0, kind]) <= 1e-9 * force
        noise = fit is not None and fit.values[i] >= 0
        if high < 0 and not (rounding or noise) and low is not None and low >= 0:
            named.append((name, kind))
    if not named:
        return []
    known = [kind for name, kind in kinds.items() if np.isfinite(found.value(name))]
    if len(named) == len(known) and len({k for _, k in named}) > 1:
        why = "does a force or a reading have the other sign?"
    elif all(kind == 1 for _, kind in named) and len(named) == known.count(1):
        why = "are the phases counted the other way (lag, not lead)?"
    else:
        why = "a sign, a unit or the model may be wrong"
    listed = ", ".join(f"{name} = {found.value(name):.6g}" for name, _ in named)
    words = " or ".join(dict.fromkeys(KINDS[kind] for _, kind in named))
    verb = "is" if len(named) == 1 else "are"
    return [f"{listed} {verb} negative, which no passive {words} is: {why}"]


def passive_elements(model: HarmonicModel) -> dict[str, int]:
    """Parameters that stand as a mass (2), damper (1) or spring (0): the power of p.

    Such a one multiplies one power of p and a symmetric matrix of the outputs that is positive semidefinite,
    where the equations are turned so that masses that are known or estimated stand positive.
    """
    e = len(model.equations)
    if len(model.outputs) != e:
        return {}
    equation, signal, power = model.equation, model.column, model.power
    own = (signal == equation) & (power >= 0) & (power <= 2)
    diagonal = np.zeros((e, 3))
    np.add.at(diagonal, (equation[own], power[own]), model.coefficients.sum(axis=1)[own])
    sign = np.array([next((np.sign(x) for x in row[::-1] if x), 1.0) for row in diagonal])
    found = {}
    for j, name in enumerate(model.parameters):
        (monomials,) = np.nonzero(model.exponents[:, j])
        if len(monomials) != 1 or model.exponents[monomials[0], j] != 1:
            continue
        alone = model.coefficients[:, monomials[0]]
        used = np.flatnonzero(alone)
        kinds = {int(k) for k in power[used]}
        if np.abs(model.exponents[monomials[0]]).sum() != 1 or len(kinds) != 1 or not kinds <= {0, 1, 2}:
            continue
        S = np.zeros((e, e))
        for f in used[signal[used] < e]:
            S[equation[f], signal[f]] = sign[equation[f]] * alone[f]
        passive = S.any() and (S == S.T).all() and np.linalg.eigvalsh(S)[0] >= -1e-9 * np.abs(S).max()
        if passive and not any(model.features[f].varying for f in used):
            found[name] = kinds.pop()
    return found


def what_more_can_tell(model: HarmonicModel, experiments: Experiments, now: int) -> str:
    """Whether experiments of the same kind could determine more than `now` combinations of the parameters.

    The rank of the derivatives of all predicted amplitudes (or modes) at many frequencies, at general values.
    """
    rng = np.random.default_rng(3)
    n, most = len(model.parameters), 0
    kinds = np.tile(np.arange(len(experiments)), 1 + 8 * n // len(experiments))
    for scale in (1.0, 1.0, 1e-2, 1e2):
        theta = rng.uniform(0.6, 1.7, n)
        many = experiments.take(kinds)
        w = scale * 10 ** rng.uniform(-1, 1, len(kinds))
        varying = {name: v * rng.uniform(0.5, 1.5, len(v)) for name, v in many.varying.items()}
        signals = {
            name: z * rng.uniform(0.5, 1.5, len(z))
            if name in model.inputs
            else np.where(np.isnan(z), z, rng.standard_normal(len(z)))
            for name, z in many.signals.items()
        }
        try:
            plan = replace(many, frequencies=w, signals=signals, varying=varying, errors=None, covariances={})
            comparison = compare(model, plan)
            exact = comparison.predict(theta)[0]
            both = {name: exact[:, j] for j, name in enumerate(model.outputs) if name in signals}
            seen = {name: np.where(np.isnan(signals[name]), np.nan, z) for name, z in both.items()}
            J = compare(model, replace(plan, signals={**signals, **seen})).jacobian(theta)
        except (ValueError, np.linalg.LinAlgError):
            continue
        J = J[np.isfinite(J).all(axis=1)] * theta
        if len(J):
            most = max(most, least_squares(J, np.zeros(len(J)), rcond=1e-9).rank)
    if 0 < most <= now:
        return "no experiment of this kind tells more: make a parameter known, or excite or measure elsewhere"
    return "more experiments, at other frequencies, may determine the rest"
