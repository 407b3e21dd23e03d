"""Checks of an identified model: what it leaves of the readings, units, phases, signs of elements."""

from __future__ import annotations

from collections.abc import Mapping
from contextlib import suppress
from dataclasses import replace
from typing import Any

import numpy as np

from rotorid.base.arrays import FloatArray
from rotorid.identify.amplitude_residuals import Comparison, compare
from rotorid.identify.amplitudes import Experiments
from rotorid.identify.linear_start import linear_fit
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


def unexplained(comparison: Comparison, theta: FloatArray, estimate: Estimate) -> list[str]:
    """What the model leaves, if it is much, and units or phases that would explain it.

    Stated errors: residuals that these explain with a probability below 0.1 %. Otherwise more than a share
    of the readings.
    """
    left = comparison.left(theta)
    if why := estimate.misfit():
        words = [
            f"{why}: the model, a reading, or the errors stated are wrong, or a better minimum lies elsewhere "
            "(try another start)"
        ]
    elif not estimate.errors_stated and left > LARGE:
        words = [
            f"the model leaves {100 * left:.0f} % of the readings: unless they are as noisy as that, the "
            "model, a reading or a unit is wrong"
        ]
    else:
        return []
    model, data = comparison.model, replace(comparison.experiments, errors=None, covariances={}, rounding={})
    turned = {name: np.conj(z) for name, z in data.signals.items()}
    others = {"phases of the other sign": replace(data, signals=turned)}
    for unit, factor in UNITS.items():
        others[f"frequencies in {unit}, not rad/s,"] = replace(data, frequencies=data.frequencies * factor)
    for what, other in others.items():
        with suppress(ValueError, IndexError, np.linalg.LinAlgError):
            share = compare(model, other).left(linear_fit(model, other).recovery.solutions[0])
            if share < min(EXPLAINS * left, LARGE):
                words.append(
                    f"with {what} the model leaves {100 * share:.2g} % of the readings, not {100 * left:.0f} %"
                )
    return words


def negative(
    model: HarmonicModel, highest: float, values: FloatArray, high: FloatArray, bounds: Bounds
) -> list[str]:
    """Masses, dampers and springs that are negative beyond the upper end of their interval (n,).

    Unless bounds say that it may be so; `highest` is the highest frequency of the data, rad/s.
    """
    kinds = passive_elements(model)
    at = {name: model.parameters.index(name) for name in kinds}
    forces = {name: abs(values[at[name]]) * highest**kind for name, kind in kinds.items()}
    least = 1e-9 * np.nanmax([*forces.values(), 0.0])
    allowed = {name for name, (low, _) in bounds.items() if low is None or low < 0}
    named = [n for n in kinds if high[at[n]] < 0 and forces[n] > least and n not in allowed]
    if not named:
        return []
    wrong, known = {kinds[n] for n in named}, [n for n in kinds if np.isfinite(values[at[n]])]
    why = "a sign, a unit or the model may be wrong"
    if len(named) == len(known) and len(wrong) > 1:
        why = "does a force or a reading have the other sign?"
    elif wrong == {1} and len(named) == sum(kinds[n] == 1 for n in known):
        why = "are the phases counted the other way (lag, not lead)?"
    listed = ", ".join(f"{name} = {values[at[name]]:.6g}" for name in named)
    what = " or ".join(dict.fromkeys(KINDS[kinds[n]] for n in named))
    verb = "is" if len(named) == 1 else "are"
    return [f"{listed} {verb} negative, which no passive {what} is: {why}"]


def passive_elements(model: HarmonicModel) -> dict[str, int]:
    """Parameters that stand as a mass (2), damper (1) or spring (0): the power of p.

    Such a one multiplies one power of p and a symmetric matrix of the outputs that is positive semidefinite.
    """
    e, found = len(model.equations), dict[str, int]()
    for j, name in enumerate(model.parameters if len(model.outputs) == e else ()):
        (m, *others) = np.flatnonzero(model.exponents[:, j])
        used = np.flatnonzero(model.coefficients[:, m])
        kinds = {*model.power[used].tolist()}
        alone = not others and np.abs(model.exponents[m]).sum() == model.exponents[m, j] == 1
        if not alone or len(kinds) > 1 or not kinds <= {0, 1, 2}:
            continue
        S = np.zeros((e, len(model.signals) + 1))
        S[model.equation[used], model.column[used]] = model.coefficients[used, m]
        S = S[:, :e]
        passive = S.any() and (S == S.T).all() and np.linalg.eigvalsh(S)[0] >= -1e-9 * np.abs(S).max()
        if passive and not any(model.features[f].varying for f in used):
            (found[name],) = kinds
    return found


def what_more_can_tell(model: HarmonicModel, experiments: Experiments, now: int) -> str:
    """Whether experiments of the same kind could determine more than `now` combinations of the parameters.

    The rank of the derivatives of predicted amplitudes (or modes) at many frequencies, at general values.
    """
    rng, n, most = np.random.default_rng(3), len(model.parameters), 0
    many = experiments.take(np.tile(np.arange(len(experiments)), 1 + 16 * n // len(experiments)))

    def moved(table: Mapping[str, Any]) -> dict[str, Any]:
        return {name: values * rng.uniform(0.5, 1.5, len(values)) for name, values in table.items()}

    w, signals, varying = 10 ** rng.uniform(-2, 2, len(many)), moved(many.signals), moved(many.varying)
    plan = Experiments(many.names, w, signals, many.free, varying=varying)
    with suppress(ValueError, np.linalg.LinAlgError):
        theta = rng.uniform(0.6, 1.7, n)
        J = compare(model, plan).jacobian(theta) * theta
        J = J[np.isfinite(J).all(axis=1)]
        J /= np.fmax(np.linalg.norm(J, axis=1, keepdims=True), 1e-300)
        most = least_squares(J, np.zeros(len(J)), rcond=1e-9).rank
    if 0 < most <= now:
        return "no experiment of this kind tells more: make a parameter known, or excite or measure elsewhere"
    return "more experiments, at other frequencies, may determine the rest"
