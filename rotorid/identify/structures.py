"""Two models of the same readings: what the further parameters of one of them gain."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from rotorid.base.text import percent
from rotorid.identify.amplitude_residuals import compare
from rotorid.identify.fit_amplitudes import identify
from rotorid.identify.result import Identification


@dataclass(frozen=True)
class StructureTest:
    """AIC of a model less that of another; F and its chance, if the smaller one is a special case.

    `F`, `chance` and `freedom` are None where there are no more parameters, or nothing is left to test with.
    """

    delta_aic: float
    F: float | None = None
    chance: float | None = None
    freedom: tuple[int, int] | None = None

    def sentence(self, other: str) -> str:
        """In words; `other` names the other model."""
        more = "higher" if self.delta_aic > 0 else "lower"
        words = f"against {other}: AIC is {abs(self.delta_aic):.3g} {more}"
        if self.F is None or self.chance is None or self.freedom is None:
            return words
        return (
            f"{words}; F = {self.F:.4g} with {self.freedom[0]} and {self.freedom[1]} degrees of freedom: if "
            "the model with fewer parameters is a special case of the other and holds, chance gives as much "
            f"in {percent(self.chance)} % of such data"
        )


def compare_structures(found: Identification, other: Identification) -> StructureTest:
    """Compare two fits to the same readings, under the errors of the larger model's amplitudes.

    Without stated errors AIC is that of residuals with one unknown variance.

    Raises
    ------
    ValueError
        For models that do not predict the same readings.
    """
    from scipy.special import fdtrc

    pair = (found, other)
    if {*found.predicted} != {*other.predicted} or not found.predicted:
        raise ValueError("the models predict different readings: both need the same outputs and inputs")
    larger = max(pair, key=lambda fit: fit.estimate.rank)
    root = np.linalg.inv(compare(larger.model, larger.experiments).reweighted(larger.theta).whiten)
    errors = dict(zip(larger.model.outputs, np.moveaxis(root @ np.swapaxes(root, -1, -2), 1, 0), strict=True))
    fits = []
    for fit in pair:
        start = dict(zip(fit.parameters, fit.theta.tolist(), strict=True))
        fits.append(identify(fit.model, replace(fit.experiments, covariances=errors), start=start).estimate)
    misfits, ranks = [fit.chi_square or 0.0 for fit in fits], [fit.rank for fit in fits]
    rows = fits[0].dof + ranks[0]
    likely = misfits if found.experiments.stated else [rows * float(np.log(misfit)) for misfit in misfits]
    delta = likely[0] - likely[1] + 2 * (ranks[0] - ranks[1])
    many = int(np.argmax(ranks))
    more, left, least = ranks[many] - ranks[1 - many], fits[many].dof, misfits[many]
    if more < 1 or left < 1 or least <= 1e-12 * rows:
        return StructureTest(delta)
    F = max(misfits[1 - many] - least, 0.0) / more * left / least
    return StructureTest(delta, F, float(fdtrc(more, left, F)), (more, left))
