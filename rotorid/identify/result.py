"""Result of an identification from harmonic tests: parameters with intervals, and what data cannot tell."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Any

import numpy as np

from rotorid.base.answer import Answer, Answered
from rotorid.base.arrays import ComplexArray, FloatArray
from rotorid.base.json import plain
from rotorid.base.tables import Column, frame, records, text
from rotorid.base.text import counted, percent, sentence
from rotorid.identify.amplitudes import Experiments
from rotorid.identify.linear_start import LinearFit
from rotorid.identify.operator_model import HarmonicModel
from rotorid.regression.estimate import (
    Combination,
    Estimate,
    Uncertain,
    parameter_columns,
    parameter_dict,
    parameter_text,
)
from rotorid.regression.linear import NormalMatrix
from rotorid.regression.prior import PriorEffect

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
    combinations: tuple[Combination, ...]
    solutions: tuple[Mapping[str, float], ...]
    theta: FloatArray
    unidentifiable: tuple[str, ...]
    left_out: tuple[str, ...]
    normal_matrix: NormalMatrix
    notes: tuple[str, ...]
    predicted: Mapping[str, ComplexArray] = field(default_factory=dict)
    converged: bool = True
    warnings: tuple[str, ...] = ()
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
    def left(self) -> ComplexArray:
        """Measured less predicted, as a share of the size, (n, outputs); else (n, equations).

        NaN where left out.
        """
        if self.predicted or self.linear is None:
            measured = self.experiments.table(self.model.outputs)
            with np.errstate(divide="ignore", invalid="ignore"):
                left: ComplexArray = (measured - np.transpose([*self.predicted.values()])) / np.abs(measured)
            left[~np.isfinite(left)] = np.nan
            return left
        parts = np.full(self.linear.rows.used.shape, np.nan)
        parts[self.linear.rows.used] = self.linear.estimate.residuals
        return parts[:, ::2] + 1j * parts[:, 1::2]

    @property
    def residuals(self) -> tuple[Column, ...]:
        """What is `left` of each experiment and output, or equation, in a row."""
        left = self.left
        n, e = left.shape
        equations = [f"equation {k + 1}" for k in range(e)]
        rows_of = [*self.model.outputs] if self.predicted or self.linear is None else equations
        return (
            Column("experiment", np.repeat(self.experiments.names, e)),
            Column(
                "frequency_rad_s", np.repeat(self.experiments.frequencies, e), "{:.6g}".format, title="rad/s"
            ),
            Column("row", rows_of * n),
            Column("re", left.real.ravel(), "{:.3g}".format, title="left, re"),
            Column("im", left.imag.ravel(), "{:.3g}".format, title="left, im"),
        )

    @property
    def residual_rms(self) -> float:
        """Over the real rows used; NaN where there are none."""
        left = self.left
        parts = np.stack((left.real, left.imag))
        return float(np.sqrt(np.nanmean(parts**2))) if np.isfinite(parts).any() else np.nan

    def value(self, name: str) -> float:
        """Value of a parameter by name; NaN if it is not determined."""
        if name not in self.parameters:
            raise ValueError(f"{name} is no parameter; parameters are {', '.join(self.parameters)}")
        return float(self.values[self.parameters.index(name)])

    def to_dict(self) -> dict[str, Any]:
        """As JSON types; what is unknown is None."""
        names, correlation = self.parameters, self.correlation

        def by_name(values: Sequence[Any]) -> dict[str, Any]:
            return dict(zip(names, values, strict=True))

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
                "residuals": records(self.residuals),
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
        why, several = dict(self.prior.why) if self.prior else {}, len(self.solutions) > 1
        for k, name in enumerate(self.parameters):
            if np.isnan(self.values[k]) and len({f"{s[name]:.9g}" for s in self.solutions}) > 1:
                why[name] = "several values: see the solutions"
        lines = [parameter_text(self.parameters, self, why), *(f"  {c.line()}" for c in self.combinations)]
        for i, solution in enumerate(self.solutions if several else ()):
            values = ", ".join(f"{k} = {v:.6g}" for k, v in solution.items() if np.isfinite(v))
            lines.append(f"  solution {i + 1}: {values}")
        notes = [f"left out: {row}" for row in self.left_out]
        if self.covariance is None and self.converged and not self.prior:
            notes.append("no intervals: no errors are stated and there are no more equations than unknowns")
        if self.covariance is not None and not self.errors_stated and self.dof <= FEW:
            notes.append(
                f"the intervals rest on what is left by {counted(self.dof, 'degree')} of freedom only"
            )
        if not self.converged:
            judgement = "NOT converged: the values are where the search stopped, no estimates."
        elif not self.identifiable:
            judgement = "\n".join(map(sentence, self.unidentifiable))
        else:
            n, condition = len(self.parameters), self.estimate.condition_number
            subject = "The parameter is" if n == 1 else f"All {n} parameters are"
            judgement = f"{subject} determined (condition number {condition:.3g})."
            judgement = self.prior.judgement(judgement) if self.prior else judgement
        judgement += f" Method: {HEADINGS[self.method]}."
        if self.predicted and np.isfinite(self.residual_rms):
            left = percent(round(2**0.5 * self.residual_rms, 10))
            judgement += f"\nThe model leaves {left} % of the readings (rms)."
        return Answer(
            judgement,
            "\n".join(lines),
            self.warnings[::-1],  # what speaks against the answer comes last there
            (*notes, *self.notes),
            (lambda: text(self.residuals), self.normal_matrix.text()),
            "what it leaves of each reading, the normal matrix",
        )
