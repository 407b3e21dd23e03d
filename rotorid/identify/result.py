"""Result of an identification from harmonic tests: parameters with intervals, and what data cannot tell."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np

from rotorid.base.answer import Answer, Answered
from rotorid.base.arrays import ComplexArray, FloatArray
from rotorid.base.json import plain
from rotorid.base.result import Column, frame, rows, text
from rotorid.base.text import counted, percent, sentence
from rotorid.identify.amplitudes import Experiments
from rotorid.identify.linear_start import LinearFit
from rotorid.identify.operator_model import HarmonicModel
from rotorid.regression.estimate import Estimate, Uncertain, parameter_columns, parameter_dict, parameter_text
from rotorid.regression.normal_matrix import NormalMatrix
from rotorid.regression.prior import PriorEffect
from rotorid.regression.undetermined_combinations import FoundCombination

if TYPE_CHECKING:
    import pandas as pd

FEW = 2
"""Degrees of freedom that tell little of the size of errors."""
HEADINGS = {"equation-error": "linear regression (equation error)", "output-error": "output error"}


@dataclass(frozen=True, eq=False, kw_only=True)
class Identification(Answered, Uncertain):
    """Parameters of a harmonic model, identified.

    Attributes
    ----------
    model, experiments, method
        What was identified from what; "output-error", or "equation-error" where the model cannot predict.
    values
        Shape (n,), in the order of `model.parameters`; NaN where the data do not determine one value.
    covariance
        Shape (n, n), NaN where not determined; None where errors are unknown.
    estimate
        Of the last step: rank, condition number and degrees of freedom.
    linear
        The regression K θ = Y that the search started from; None: amplitudes that it needs are missing.
    combinations
        The estimated products and sums of parameters ([S] 1.8) that are no single parameter.
    solutions
        All parameter sets that explain the data alike; NaN for parameters that are not determined.
    theta
        The first of them (n,), with arbitrary consistent values where a parameter is not determined.
    unidentifiable
        Reasons in words why parameters have no one value; empty if all have.
    predicted
        Amplitudes of the outputs; empty where they cannot be had.
    left_out
        Rows without effect because an amplitude was not measured, in words.
    converged
        False: the search did not end at a minimum; `values` are where it stopped, and have no intervals.
    warnings, notes
        What should be known before the numbers are used; how they came about, in words.
    prior, normal_matrix
        What a prior or a ridge did, None without any; the normal matrix of the last step.
    """

    model: HarmonicModel
    experiments: Experiments
    method: str
    values: FloatArray
    covariance: FloatArray | None
    estimate: Estimate
    linear: LinearFit | None
    combinations: tuple[FoundCombination, ...]
    solutions: tuple[Mapping[str, float], ...]
    theta: FloatArray
    unidentifiable: tuple[str, ...]
    predicted: Mapping[str, ComplexArray]
    left_out: tuple[str, ...]
    converged: bool
    warnings: tuple[str, ...]
    notes: tuple[str, ...]
    normal_matrix: NormalMatrix
    prior: PriorEffect | None = None

    @property
    def parameters(self) -> tuple[str, ...]:
        """Names of the parameters."""
        return self.model.parameters

    @property
    def identifiable(self) -> bool:
        """Whether the data determine one value of every parameter, and the search found it."""
        return self.converged and bool(np.isfinite(self.values).all())

    @property
    def dof(self) -> int:  # type: ignore[override]
        """Degrees of freedom."""
        return self.estimate.dof

    @property
    def errors_stated(self) -> bool:  # type: ignore[override]
        """Whether errors are stated: intervals are normal ones, else Student's t of what the model leaves."""
        return self.estimate.errors_stated

    @property
    def residuals(self) -> dict[str, ComplexArray]:
        """Of each output (n,): measured less predicted, relative to the size; without predictions of each
        equation. NaN where left out.
        """
        if not self.predicted and self.linear:
            left = np.full(self.linear.used.shape, np.nan)
            left[self.linear.used] = self.linear.estimate.residuals
            return {
                f"equation {e // 2 + 1}": left[:, e] + 1j * left[:, e + 1] for e in range(0, left.shape[1], 2)
            }
        measured = self.experiments.table(self.model.outputs).T
        with np.errstate(divide="ignore", invalid="ignore"):
            gaps = (measured - np.array([*self.predicted.values()])) / np.abs(measured)
        gaps[~np.isfinite(gaps)] = np.nan
        return dict(zip(self.predicted, gaps, strict=True))

    @property
    def residual_rms(self) -> float:
        """Over the real rows used; NaN where there are none."""
        parts = np.array([*self.residuals.values()]).view(float)
        return float(np.sqrt(np.nanmean(np.square(parts)))) if np.isfinite(parts).any() else np.nan

    def value(self, name: str) -> float:
        """Value of a parameter by name; NaN if it is not determined."""
        if name not in self.parameters:
            raise ValueError(f"{name} is no parameter; parameters are {', '.join(self.parameters)}")
        return float(self.values[self.parameters.index(name)])

    def to_dict(self) -> dict[str, Any]:
        """As JSON types; what is unknown is None."""
        names, correlation, left = self.parameters, self.correlation, self.residuals

        def by_name(values: Sequence[Any]) -> dict[str, Any]:
            return dict(zip(names, values, strict=True))

        n, e, z = len(self.experiments), len(left), np.array([*left.values()]).T.ravel()
        residuals = (
            Column("experiment", np.repeat(self.experiments.names, e)),
            Column("frequency_rad_s", np.repeat(self.experiments.frequencies, e)),
            Column("row", [*left] * n),
            Column("re", z.real),
            Column("im", z.imag),
        )
        keys = (
            *("method", "converged", "identifiable", "unidentifiable"),
            *("solutions", "residual_rms", "left_out", "warnings"),
        )
        return plain(
            {
                "parameters": parameter_dict(names, self),
                **{key: getattr(self, key) for key in keys},
                "rank": self.estimate.rank,
                "condition_number": self.estimate.condition_number,
                "combinations": {c.words: {"value": c.value, "std": c.std} for c in self.combinations},
                "correlation": None if correlation is None else by_name([*map(by_name, correlation)]),
                "residuals": rows(residuals),
                "normal_matrix": self.normal_matrix.to_dict(),
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
        for k, name in enumerate(self.parameters):
            if np.isnan(self.values[k]) and len({f"{s[name]:.9g}" for s in self.solutions}) > 1:
                why[name] = "several values: see the solutions"
        found = [parameter_text(self.parameters, self, why), *(f"  {c.line()}" for c in self.combinations)]
        for i, solution in enumerate(self.solutions if len(self.solutions) > 1 else ()):
            values = ", ".join(f"{k} = {v:.6g}" for k, v in solution.items() if np.isfinite(v))
            found.append(f"  solution {i + 1}: {values}")
        notes = [f"left out: {row}" for row in self.left_out]
        if self.covariance is None and self.converged and not self.prior:
            notes.append("no intervals: no errors are stated and there are no more equations than unknowns")
        if self.covariance is not None and not self.errors_stated and self.dof <= FEW:
            notes.append(
                f"the intervals rest on what is left by {counted(self.dof, 'degree')} of freedom only"
            )
        columns = self.misfit
        left = np.array(columns[-1].values)
        words = f"{self._judgement()} Method: {HEADINGS[self.method]}."
        if known := bool(np.isfinite(left).any()):
            rms = float(np.sqrt(np.nanmean(np.square(left))))
            words += f"\nThe model leaves {percent(round(rms, 10))} % of the readings (rms)."
        return Answer(
            words,
            "\n".join(found),
            self.warnings[::-1],  # what speaks against the answer comes last there
            (*notes, *self.notes),
            (*((text(columns),) if known else ()), self.normal_matrix.text()),
            "what it leaves of each reading, " * known + "the normal matrix",
        )

    def _judgement(self) -> str:
        if not self.converged:
            return "NOT converged: the values are where the search stopped, no estimates."
        if not self.identifiable:
            return "\n".join(map(sentence, self.unidentifiable))
        n = len(self.parameters)
        known = "The parameter is" if n == 1 else f"All {n} parameters are"
        words = f"{known} determined (condition number {self.estimate.condition_number:.3g})."
        return self.prior.judgement(words) if self.prior else words

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
