"""Checks of an identified model: what it leaves of the readings, units, phases, signs of elements."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import replace

import numpy as np

from rotorid.base.arrays import FloatArray
from rotorid.identify.amplitude_residuals import Comparison, compare
from rotorid.identify.amplitudes import Experiments
from rotorid.identify.operator_model import HarmonicModel
from rotorid.regression import least_squares
from rotorid.regression.estimate import Estimate
from rotorid.regression.nonlinear import Bounds

LARGE = 0.12
"""Readings are rarely wrong by more than this share: a model that leaves more of them is doubted."""
EXPLAINS = 0.2
"""Another reading of the data is named where it leaves less than this share of what is left without it."""
KINDS = ("spring", "damper", "mass")
UNITS = {"Hz": 2 * np.pi, "rpm": np.pi / 30}
Refit = Callable[[Experiments], Sequence[FloatArray]]
"""Solutions of the linear estimate from other experiments."""


def unexplained(
    comparison: Comparison, theta: FloatArray, estimate: Estimate, refit: Refit, *, converged: bool
) -> tuple[str, ...]:
    """What the model leaves, if it is much, and units or phases that would explain it.

    Stated errors: residuals that these explain with a probability below 0.1 %. Otherwise more than a share
    of the readings; that it is ordered over the frequency shows that it is no noise.
    """
    words, left = [], comparison.left(theta)
    if converged and (why := estimate.misfit()):
        words.append(
            f"{why}: the model, a reading, or the errors stated are wrong, or a better minimum lies "
            "elsewhere (try another start)"
        )
    if converged and not estimate.errors_stated and left > LARGE:
        gap = (comparison.predict(theta)[0] - comparison.measured) / np.abs(comparison.measured)
        seen = np.isfinite(gap)
        r = np.where(seen, gap, 0.0)[np.argsort(comparison.experiments.frequencies)]
        # correlation of neighbours over that of noise (2.5 %)
        alike = (r[1:] * r[:-1].conj()).real.sum() * np.sqrt(2 * np.count_nonzero(seen))
        ordered = alike > 1.96 * np.sum(np.abs(r) ** 2)
        random = "not at random over the frequency, so " if ordered else "unless they are as noisy as that, "
        words.append(
            f"the model leaves {100 * left:.0f} % of the readings: {random}the model, a reading or a unit is "
            "wrong"
        )
    if not (words or not converged):
        return ()
    model, data = comparison.model, replace(comparison.experiments, errors=None, covariances={}, rounding={})
    turned = {name: np.conj(z) for name, z in data.signals.items()}
    others = {"": data, "phases of the other sign": replace(data, signals=turned)}
    for unit, factor in UNITS.items():
        others[f"frequencies in {unit}, not rad/s,"] = replace(data, frequencies=data.frequencies * factor)
        others[f"frequencies in rad/s, not {unit},"] = replace(data, frequencies=data.frequencies / factor)
    rest = {what: _left_by_refit(model, other, refit) for what, other in others.items()}
    left = np.fmin(left, rest.pop(""))  # the same estimate with and without the change
    words += [
        f"with {what} the model leaves {100 * share:.2g} % of the readings, not {100 * left:.0f} %"
        for what, share in rest.items()
        if share < min(EXPLAINS * left, LARGE)
    ]
    return tuple(words)


def _left_by_refit(model: HarmonicModel, data: Experiments, refit: Refit) -> float:
    try:
        solutions = refit(data)
        return compare(model, data).left(solutions[0]) if solutions else np.nan
    except (ValueError, np.linalg.LinAlgError):
        return np.nan


def negative(
    model: HarmonicModel, highest: float, values: FloatArray, high: FloatArray, bounds: Bounds | None
) -> tuple[str, ...]:
    """Masses, dampers and springs that are negative beyond the upper end of their interval (n,).

    Unless bounds say that it may be so; `highest` is the highest frequency of the data, rad/s.
    """
    kinds = passive_elements(model)
    at = {name: model.parameters.index(name) for name in kinds}
    forces = {name: abs(values[at[name]]) * highest**kind for name, kind in kinds.items()}
    large = np.nanmax([*forces.values(), 0.0])
    named = []
    for name in kinds:
        low = (bounds or {}).get(name, (0.0, None))[0]
        if high[at[name]] < 0 and forces[name] > 1e-9 * large and low is not None and low >= 0:
            named.append(name)
    if not named:
        return ()
    found = [kinds[name] for name in named]
    known = [kind for name, kind in kinds.items() if np.isfinite(values[at[name]])]
    why = "a sign, a unit or the model may be wrong"
    if len(named) == len(known) and len({*found}) > 1:
        why = "does a force or a reading have the other sign?"
    elif {*found} == {1} and len(named) == known.count(1):
        why = "are the phases counted the other way (lag, not lead)?"
    listed = ", ".join(f"{name} = {values[at[name]]:.6g}" for name in named)
    what = " or ".join(dict.fromkeys(KINDS[kind] for kind in found))
    verb = "is" if len(named) == 1 else "are"
    return (f"{listed} {verb} negative, which no passive {what} is: {why}",)


def passive_elements(model: HarmonicModel) -> dict[str, int]:
    """Parameters that stand as a mass (2), damper (1) or spring (0): the power of p.

    Such a one multiplies one power of p and a symmetric matrix of the outputs that is positive semidefinite.
    """
    e, found = len(model.equations), {}
    if len(model.outputs) != e:
        return {}
    for j, name in enumerate(model.parameters):
        (m, *others) = np.flatnonzero(model.exponents[:, j])
        factors = model.coefficients[:, m]
        used = np.flatnonzero(factors)
        kind = int(model.power[used[0]])
        alone = not others and np.abs(model.exponents[m]).sum() == model.exponents[m, j] == 1
        if not alone or kind not in (0, 1, 2) or (model.power[used] != kind).any():
            continue
        inside = used[model.column[used] < e]
        S = np.zeros((e, e))
        S[model.equation[inside], model.column[inside]] = factors[inside]
        passive = S.any() and (S == S.T).all() and np.linalg.eigvalsh(S)[0] >= -1e-9 * np.abs(S).max()
        if passive and not any(model.features[f].varying for f in used):
            found[name] = kind
    return found


def what_more_can_tell(model: HarmonicModel, experiments: Experiments, now: int) -> str:
    """Whether experiments of the same kind could determine more than `now` combinations of the parameters.

    The rank of the derivatives of all predicted amplitudes (or modes) at many frequencies, at general values.
    """
    rng = np.random.default_rng(3)
    n, most = len(model.parameters), 0
    many = experiments.take(np.tile(np.arange(len(experiments)), 1 + 8 * n // len(experiments)))
    for scale in (1.0, 1.0, 1e-2, 1e2):
        theta = rng.uniform(0.6, 1.7, n)
        varying = {name: v * rng.uniform(0.5, 1.5, len(v)) for name, v in many.varying.items()}
        signals = {
            name: z * rng.uniform(0.5, 1.5, len(z))
            if name in model.inputs
            else np.where(np.isnan(z), z, rng.standard_normal(len(z)))
            for name, z in many.signals.items()
        }
        w = scale * 10 ** rng.uniform(-1, 1, len(many))
        plan = replace(
            many, frequencies=w, signals=signals, varying=varying, errors=None, covariances={}, rounding={}
        )
        try:
            exact = compare(model, plan).predict(theta)[0]
            seen = {
                name: np.where(np.isnan(signals[name]), np.nan, exact[:, j])
                for j, name in enumerate(model.outputs)
                if name in signals
            }
            J = compare(model, replace(plan, signals={**signals, **seen})).jacobian(theta)
        except (ValueError, np.linalg.LinAlgError):
            continue
        J = J[np.isfinite(J).all(axis=1)] * theta
        if len(J):
            most = max(most, least_squares(J, np.zeros(len(J)), rcond=1e-9).rank)
    if 0 < most <= now:
        return "no experiment of this kind tells more: make a parameter known, or excite or measure elsewhere"
    return "more experiments, at other frequencies, may determine the rest"
