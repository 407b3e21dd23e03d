"""Result of an identification: parameters with intervals, and what the data cannot tell."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Any

import numpy as np

from rotorid.base.answer import Answer, Answered
from rotorid.base.arrays import ComplexArray, FloatArray
from rotorid.base.json import plain
from rotorid.base.result import Column, frame, rows, text
from rotorid.base.text import percent, sentence
from rotorid.harmonic.experiments import Experiments
from rotorid.harmonic.operator_model import HarmonicModel
from rotorid.regression.estimate import Uncertain, parameter_columns, parameter_dict, parameter_text
from rotorid.regression.normal_matrix import NormalMatrix
from rotorid.regression.prior import PriorEffect
from rotorid.regression.undetermined_combinations import FoundCombination

if TYPE_CHECKING:
    import pandas as pd

HEADINGS = {"equation-error": "linear regression (equation error)", "output-error": "output error"}
SEVERAL = "several values: see the solutions"


@dataclass(frozen=True, eq=False)
class Identification(Answered, Uncertain):
    """Parameters of a harmonic model, identified.

    Attributes
    ----------
    model, experiments, method
        What was identified from what, "equation-error" or "output-error".
    values
        Shape (n,), in the order of `model.parameters`; NaN where the data do not determine one value.
    covariance
        Shape (n, n), NaN where not determined; None where errors are unknown.
    dof, errors_stated
        Degrees of freedom; whether the covariance comes from stated errors (normal intervals) and not from
        the residuals (Student's t).
    combinations
        The estimated products and sums of parameters ([S] 1.8) that are no single parameter.
    solutions
        All parameter sets that explain the combinations; NaN for parameters that are not determined.
    starts
        The same sets with arbitrary consistent values where a parameter is not determined: where output error
        can begin.
    rank, condition_number
        Of the row-weighted, column-scaled regression (merged unknowns).
    unidentifiable
        Reasons in words why parameters have no one value; empty if all have.
    residuals
        Complex, shape (experiments, residual_names): of the equations, or of the amplitudes (output error);
        NaN where left out.
    residual_names
        "equation 1", …, or the names of the outputs.
    residual_rms
        Over the real rows used.
    predicted
        Amplitudes of the outputs for `values`, or for the first solution; empty where they cannot be had.
    influence
        Shape (experiments, n): change of each parameter if the experiment is left out; NaN where unknown.
    left_out
        Rows without effect because an amplitude was not measured, in words.
    converged
        False: the search did not end at a minimum; `values` are where it stopped, and have no intervals.
    notes
        How the numbers came about, in words.
    prior, normal_matrix
        What a prior or a ridge did, None without any; the normal matrix of the last step.
    warnings
        What should be known before the numbers are used.
    """

    model: HarmonicModel
    experiments: Experiments
    method: str
    values: FloatArray
    covariance: FloatArray | None
    dof: int
    errors_stated: bool
    combinations: tuple[FoundCombination, ...]
    solutions: tuple[Mapping[str, float], ...]
    rank: int
    condition_number: float
    unidentifiable: tuple[str, ...]
    residuals: ComplexArray
    residual_names: tuple[str, ...]
    residual_rms: float
    predicted: Mapping[str, ComplexArray] = field(default_factory=dict)
    influence: FloatArray | None = None
    starts: tuple[Mapping[str, float], ...] = ()
    left_out: tuple[str, ...] = ()
    converged: bool = True
    warnings: tuple[str, ...] = ()
    notes: tuple[str, ...] = ()
    prior: PriorEffect | None = None
    normal_matrix: NormalMatrix | None = None

    @property
    def parameters(self) -> tuple[str, ...]:
        """Names of the parameters."""
        return self.model.parameters

    @property
    def identifiable(self) -> bool:
        """Whether the data determine one value of every parameter, and the search found it."""
        return self.converged and bool(np.isfinite(self.values).all())

    def value(self, name: str) -> float:
        """Value of a parameter by name; NaN if it is not determined."""
        if name not in self.parameters:
            raise ValueError(f"{name} is no parameter; parameters are {', '.join(self.parameters)}")
        return float(self.values[self.parameters.index(name)])

    def to_dict(self) -> dict[str, Any]:
        """As JSON types; what is unknown is None."""
        names, correlation, influence = self.parameters, self.correlation, self.influence

        def by_name(values: Sequence[Any]) -> dict[str, Any]:
            return dict(zip(names, values, strict=True))

        return plain(
            {
                "method": self.method,
                "parameters": parameter_dict(names, self),
                "converged": self.converged,
                "rank": self.rank,
                "condition_number": self.condition_number,
                "identifiable": self.identifiable,
                "unidentifiable": self.unidentifiable,
                "combinations": {c.words: {"value": c.value, "std": c.std} for c in self.combinations},
                "solutions": self.solutions,
                "residual_rms": self.residual_rms,
                "left_out": self.left_out,
                "warnings": self.warnings,
                "correlation": None if correlation is None else by_name([*map(by_name, correlation)]),
                "residuals": rows(_residual_columns(self)),
                "influence": None
                if influence is None
                else [
                    {"experiment": experiment, "change": by_name(row)}
                    for experiment, row in zip(self.experiments.names, influence, strict=True)
                ],
                "normal_matrix": self.normal_matrix and self.normal_matrix.to_dict(),
                **(self.prior.to_dict() if self.prior else {}),
            }
        )

    def to_frame(self) -> pd.DataFrame:
        """One row per parameter: value, std, and the 95 % interval (NaN where unknown)."""
        return frame(parameter_columns(self.parameters, self))

    @property
    def answer(self) -> Answer:
        """What is determined and how well the model fits, the values, and what it leaves of each reading."""
        why = dict(self.prior.why) if self.prior else {}
        why |= {name: SEVERAL for name in self.parameters if self._several(name)}
        found = [parameter_text(self.parameters, self, why), *(f"  {c.line()}" for c in self.combinations)]
        for i, solution in enumerate(self.solutions if len(self.solutions) > 1 else ()):
            values = ", ".join(f"{k} = {v:.6g}" for k, v in solution.items() if np.isfinite(v))
            found.append(f"  solution {i + 1}: {values}")
        notes = [f"left out: {row}" for row in self.left_out]
        if self.covariance is None and self.converged and not self.prior:
            notes.append("no intervals: no errors are stated and there are no more equations than unknowns")
        columns = self.misfit
        left = np.array(columns[-1].values)
        said = f"{self._judgement()} Method: {HEADINGS.get(self.method, self.method)}."
        if known := bool(np.isfinite(left).any()):
            rms = float(np.sqrt(np.nanmean(np.square(left))))
            said += f"\nThe model leaves {percent(round(rms, 10))} % of the readings (rms)."
        return Answer(
            said,
            "\n".join(found),
            self.warnings[::-1],  # what speaks against the answer comes last there
            (*notes, *self.notes),
            (text(columns),) * known + ((self.normal_matrix.text(),) if self.normal_matrix else ()),
            "what it leaves of each reading, " * known + "the normal matrix",
        )

    def _judgement(self) -> str:
        if not self.converged:
            return "NOT converged: the values are where the search stopped, no estimates."
        if not self.identifiable:
            return "\n".join(map(sentence, self.unidentifiable))
        n = len(self.parameters)
        known = "The parameter is" if n == 1 else f"All {n} parameters are"
        said = f"{known} determined (condition number {self.condition_number:.3g})."
        return self.prior.judgement(said) if self.prior else said

    def _several(self, name: str) -> bool:
        """Whether a parameter has several values that explain the data alike."""
        if np.isfinite(self.value(name)):
            return False
        return len({round(s[name], 12) for s in self.solutions if np.isfinite(s[name])}) > 1

    @property
    def misfit(self) -> tuple[Column, ...]:
        """Size of measured and predicted amplitudes, and their difference as a share of the measured one."""
        names = [name for name in self.model.outputs if name in self.predicted]
        n, e = len(self.experiments), len(names)
        measured = self.experiments.table(names).ravel()
        model = np.array([self.predicted[name] for name in names]).T.ravel()
        with np.errstate(divide="ignore", invalid="ignore"):
            left = np.abs(model - measured) / np.abs(measured)
        return (
            Column("experiment", np.repeat(self.experiments.names, e), str),
            Column("rad/s", np.repeat(self.experiments.frequencies, e), "{:.6g}".format),
            Column("output", names * n, str),
            Column("measured", np.abs(measured), "{:.4g}".format),
            Column("model", np.abs(model), "{:.4g}".format),
            Column("%", left, percent, "left, %"),
        )


def _residual_columns(found: Identification) -> tuple[Column, ...]:
    n, e = found.residuals.shape
    return (
        Column("experiment", np.repeat(found.experiments.names, e)),
        Column("frequency_rad_s", np.repeat(found.experiments.frequencies, e)),
        Column("row", np.tile(found.residual_names, n)),
        Column("re", found.residuals.real.ravel()),
        Column("im", found.residuals.imag.ravel()),
    )
