"""Checks of an identified model: what it leaves of the readings, signs of elements."""

from __future__ import annotations

import numpy as np

from rotorid.base.arrays import FloatArray
from rotorid.identify.operator_model import HarmonicModel
from rotorid.regression.estimate import Estimate
from rotorid.regression.nonlinear import Bounds

LARGE = 0.12
"""Readings are rarely wrong by more than this share: a model that leaves more of them is doubted."""
KINDS = ("spring", "damper", "mass")


def unexplained(left: float, estimate: Estimate) -> list[str]:
    """What the model leaves of the readings, a share, if it is much.

    Stated errors: residuals that these explain with a probability below 0.1 %.
    """
    if why := estimate.misfit():
        return [
            f"{why}: the model, a reading, or the errors stated are wrong, or a better minimum lies "
            "elsewhere (try another start)"
        ]
    if estimate.errors_stated or not left > LARGE:
        return []
    return [
        f"the model leaves {100 * left:.0f} % of the readings: unless they are as noisy as that, the model, "
        "a reading, a unit or the sign of phases is wrong"
    ]


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
