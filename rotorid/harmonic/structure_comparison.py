"""Two structures on the same readings: misfits of amplitudes under the same errors, and the F test.

Both are fitted by output error: each multiplies its equations out in its own way, amplitudes are the same.
Their errors are taken where the model with more parameters predicts them.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from contextlib import suppress
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, Any

import numpy as np

from rotorid.base.answer import Answer, Answered
from rotorid.base.arrays import FloatArray
from rotorid.base.json import plain
from rotorid.base.result import Column, frame, rows, text
from rotorid.base.text import percent
from rotorid.harmonic.comparison import compare
from rotorid.harmonic.equation_error import limits
from rotorid.harmonic.experiments import Experiments
from rotorid.harmonic.operator_model import HarmonicModel
from rotorid.harmonic.output_identification import identify_outputs
from rotorid.harmonic.plausibility import EXACT, left_over
from rotorid.harmonic.result import Identification
from rotorid.regression.estimate import parameter_text
from rotorid.regression.nonlinear import Bounds

if TYPE_CHECKING:
    import pandas as pd


@dataclass(frozen=True)
class Structure:
    """A model, the readings by its own names, bounds and starting values as in `identify`."""

    name: str
    model: HarmonicModel
    data: Experiments
    bounds: Bounds
    start: Mapping[str, float]

    def fit(self, data: Experiments, start: Mapping[str, float]) -> tuple[Identification, float]:
        """Output error, and the sum of squared residuals over their errors."""
        try:
            found = identify_outputs(self.model, data, self.bounds or None, start=start or None)
        except ValueError as error:
            raise ValueError(f"{self.name}: {error}") from None
        return found, float(np.sum(compare(self.model, data).residual(_values(found)) ** 2))


@dataclass(frozen=True, eq=False)
class StructureComparison(Answered):
    """Fits of two models.

    Attributes
    ----------
    names, fits
        Of the models, each as it is identified alone.
    misfits, dof
        Sums of squared residuals over errors, or of shares of the amplitudes; degrees of freedom.
    special
        Index of the model that is a special case of the other (or the same); None: neither is.
    f_test
        F and the probability of more if the special case holds; None: no test.
    warnings
        Why there is none, and those of the fits.
    """

    names: tuple[str, ...]
    fits: tuple[Identification, ...]
    misfits: tuple[float, ...]
    dof: tuple[int, ...]
    special: int | None
    f_test: tuple[float, float] | None
    warnings: tuple[str, ...]

    @property
    def answer(self) -> Answer:
        """The test, the misfits, and the parameters of both."""
        said = "Neither model is a special case of the other: the F test does not apply. Compare the misfits."
        if self.special is not None:
            said = f"{self.names[self.special]} is a special case of the other model."
        ranks = [fit.rank for fit in self.fits]
        if self.special is not None and ranks[0] == ranks[1] and self.dof[0] == self.dof[1]:
            said = "The models predict the same amplitudes: no such readings tell them apart."
        elif self.special is not None and self.f_test is not None:
            many = self.dof[1 - self.special]
            F, chance = self.f_test
            said += f"\nF = {F:.4g} with {self.dof[self.special] - many} and {many} degrees of freedom: "
            said += f"if the special case holds, chance gives as much in {percent(chance)} % of such data."
        tables = [
            f"{name}\n{parameter_text(fit.parameters, fit, {})}"
            for name, fit in zip(self.names, self.fits, strict=True)
        ]
        note = "no errors are stated: misfits are of shares of the amplitudes"
        if self.fits[0].errors_stated:
            note = "chance of the misfit: how often it is as large, if the model and the stated errors hold"
        return Answer(said, "\n\n".join((text(self._columns()), *tables)), self.warnings, (note,))

    def _columns(self) -> tuple[Column, ...]:
        from scipy.special import chdtrc

        known = np.array(self.dof) * self.fits[0].errors_stated > 0
        return (
            Column("model", self.names, str),
            Column("determined", [fit.rank for fit in self.fits], str, "parameters"),
            Column("misfit", self.misfits, "{:.5g}".format),
            Column("dof", self.dof, str),
            Column("chance", np.where(known, chdtrc(self.dof, self.misfits), np.nan), "{:.3g}".format),
        )

    def to_frame(self) -> pd.DataFrame:
        """One row per model."""
        return frame(self._columns())

    def to_dict(self) -> dict[str, Any]:
        """As JSON types."""
        models = rows((*self._columns(), Column("fit", [fit.to_dict() for fit in self.fits])))
        special = None if self.special is None else self.names[self.special]
        F, chance = self.f_test or (None, None)
        told = {"models": models, "special_case": special, "F": F, "probability": chance}
        return plain({**told, "warnings": self.warnings})


def compare_structures(pair: Sequence[Structure]) -> StructureComparison:
    """Fit two models to the same readings, and test whether the smaller one is enough.

    Raises
    ------
    ValueError
        For models that do not predict the same readings, and as `identify`.
    """
    from scipy.special import fdtrc

    plans = [compare(one.model, one.data) for one in pair]
    if {*plans[0].rows} != {*plans[1].rows}:
        raise ValueError("the models predict different readings: both need the same outputs and inputs")
    alone = [one.fit(one.data, one.start)[0] for one in pair]
    sizes = [(fit.rank, not one.bounds) for one, fit in zip(pair, alone, strict=True)]
    less = int(sizes[0] > sizes[1])
    more = 1 - less
    # the errors of the larger model's amplitudes, as covariances, for both
    root = np.linalg.inv(plans[more].reweighted(_values(alone[more])).whiten)
    every = np.moveaxis(root @ np.swapaxes(root, -1, -2), 1, 0)
    stated = dict.fromkeys(pair[less].model.outputs, every[0])  # what nobody measures has any
    stated |= dict(zip(pair[more].model.outputs, every, strict=True))
    data = [replace(s.data, covariances={name: stated[name] for name in s.model.outputs}) for s in pair]
    fits = [one.fit(rows, fit.starts[0]) for one, rows, fit in zip(pair, data, alone, strict=True)]
    theta = _values(fits[less][0])
    elsewhere = theta * np.random.default_rng(7).uniform(0.8, 1.25, len(theta))
    for i, name in enumerate(pair[less].model.parameters):
        elsewhere[i] = np.clip(elsewhere[i], *limits(pair[less].bounds).get(name, (-np.inf, np.inf)))
    begin, again = (_reproduced(pair[less], point, pair[more]) for point in (theta, elsewhere))
    nested = begin is not None and again is not None
    if begin is not None and nested:  # the larger model is nowhere worse than there
        fits[more] = min(fits[more], pair[more].fit(data[more], begin), key=lambda fit: fit[1])
    misfits, dof = [misfit for _, misfit in fits], [fit.dof for fit, _ in fits]
    warnings = [
        f"{one.name}: {words}" for one, fit in zip(pair, alone, strict=True) for words in fit.warnings
    ]
    left = left_over(pair[more].model, pair[more].data, _values(fits[more][0]))
    few, test, why = dof[less] - dof[more], None, ""
    if nested and few != fits[more][0].rank - fits[less][0].rank:
        why = "a parameter stands at its bound, where F does not hold"
    elif nested and plans[more].warnings:  # the misfits are too small for their degrees of freedom
        why = "an amplitude or a phase counts as exact: state both errors"
    elif not dof[more] or (left is not None and left < EXACT) or not all(fit.converged for fit, _ in fits):
        why = "a fit leaves no degree of freedom or only rounding, or it did not converge"
    if why:
        warnings.insert(0, f"no F test: {why}")
    elif nested and few > 0:
        F = max(misfits[less] - misfits[more], 0.0) / few * dof[more] / misfits[more]
        test = F, float(fdtrc(few, dof[more], F))
    return StructureComparison(
        names=tuple(one.name for one in pair),
        fits=tuple(alone),
        misfits=tuple(misfits),
        dof=tuple(dof),
        special=less if nested else None,
        f_test=test,
        warnings=tuple(warnings),
    )


def _values(fit: Identification) -> FloatArray:
    return np.array(list(fit.starts[0].values()))


def _reproduced(one: Structure, theta: FloatArray, other: Structure) -> Mapping[str, float] | None:
    """Parameters of another model within its bounds that give the same readings as these of this one."""
    plan = compare(one.model, one.data)
    predicted, natural = plan.predict(theta)
    table = dict(zip(one.model.outputs, np.where(np.isnan(plan.measured), np.nan, predicted).T, strict=True))
    signals = {name: table.get(name, z) for name, z in other.data.signals.items()}
    w = np.where(one.data.free, natural, one.data.frequencies)
    with suppress(ValueError):  # no such mode, no start
        exact = replace(other.data, signals=signals, frequencies=w, errors=None, covariances={})
        found = identify_outputs(other.model, exact, other.bounds or None)
        left = left_over(other.model, exact, _values(found))
        return found.starts[0] if left is not None and left < EXACT else None
    return None
