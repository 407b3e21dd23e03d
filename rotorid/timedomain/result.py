"""Result of a fit to time records."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np

from rotorid.base.answer import Answer, Answered
from rotorid.base.arrays import FloatArray
from rotorid.base.json import plain
from rotorid.base.result import Column, frame, text
from rotorid.base.text import counted, percent
from rotorid.regression.estimate import parameter_columns
from rotorid.timedomain.integration.simulate import Trajectory
from rotorid.timedomain.methods.iteration_history import Path
from rotorid.timedomain.methods.multiple_starts import Minimum
from rotorid.timedomain.models.ode_model import OdeModel
from rotorid.timedomain.models.record import Record

if TYPE_CHECKING:
    import pandas as pd


@dataclass(frozen=True, eq=False, kw_only=True)
class Fit(Answered, Path):
    """Parameters of a model in time, fitted to records: the way of the search, and what became of it.

    Attributes
    ----------
    models, records
        What was fitted to what: one model for each record, all with the same parameters.
    method, integrator, loss
        How; the integrator is the one that was used ("none": the model has no states).
    history, costs, trajectories
        Parameters at the start and after each iteration, (k + 1, n), half the sum of squared residuals at
        each, and the states of each record that quasilinearization went through.
    converged, message, at_bounds
        Whether a minimum was reached, and in words; parameters that stand at a bound.
    estimate
        Values, covariance, rank, combinations; residuals (model − record, over the stated standard deviations
        if there are any), record by record, output by output. No covariance where intervals would mislead.
    reliable
        Whether a minimum was reached that describes the record: otherwise there are no intervals.
    warnings
        What must be known before the numbers are used.
    simulations
        States, outputs and sensitivities of each record with the result; empty where they diverge.
    minima
        Where the starts ended, best first; empty for one start.
    integration_change
        Change of each parameter at a tighter tolerance; None where the solution is exact.
    autocorrelation
        Of neighbouring residuals; None for few samples or exact data.
    residual_rms
        In the unit of the outputs.
    errors
        Standard deviation of each output as estimated from its residuals, where these were the weights.
    """

    models: tuple[OdeModel, ...]
    records: tuple[Record, ...]
    method: str
    integrator: str
    loss: str
    reliable: bool
    warnings: tuple[str, ...]
    simulations: tuple[Trajectory, ...]
    minima: tuple[Minimum, ...]
    integration_change: FloatArray | None
    autocorrelation: float | None
    residual_rms: float
    errors: dict[str, float] | None = None

    @property
    def model(self) -> OdeModel:
        """Of the first record."""
        return self.models[0]

    @property
    def parameters(self) -> tuple[str, ...]:
        """Names of the parameters."""
        return self.model.parameters

    def to_dict(self) -> dict[str, Any]:
        """As JSON types; what is unknown is None."""
        names, change = self.parameters, self.integration_change
        return {
            **self.estimate.to_dict(),
            "solutions": [],
            **plain(
                {
                    "residual_rms": self.residual_rms,
                    "method": self.method,
                    "integrator": self.integrator,
                    "loss": self.loss,
                    "converged": self.converged,
                    "message": self.message,
                    "reliable": self.reliable,
                    "iterations": self.iterations,
                    "history": [
                        {"cost": cost, "parameters": dict(zip(names, row, strict=True))}
                        for row, cost in zip(self.history, self.costs, strict=True)
                    ],
                    "errors": self.errors,
                    "at_bounds": self.at_bounds,
                    "minima": [
                        {"parameters": m.values, "cost": m.cost, "starts": m.starts} for m in self.minima
                    ],
                    "integration_change": None if change is None else dict(zip(names, change, strict=True)),
                    "autocorrelation": self.autocorrelation,
                    "warnings": self.warnings,
                }
            ),
        }

    def to_frame(self) -> pd.DataFrame:
        """One row per parameter: value, std, the 95 % interval, and whether it stands at a bound."""
        at_bound = [name in self.at_bounds for name in self.parameters]
        return frame((*parameter_columns(self.parameters, self.estimate), Column("at_bound", at_bound)))

    def history_frame(self) -> pd.DataFrame:
        """One row per iteration: parameters and cost."""
        values = (Column(*pair) for pair in zip(self.parameters, self.history.T, strict=True))
        return frame((Column("iteration", range(1 + self.iterations)), *values, Column("cost", self.costs)))

    @property
    def answer(self) -> Answer:
        """Whether there is an answer, the values with their intervals, and what the model leaves."""
        own = self.estimate.told(self.at_bounds)
        notes = own.notes if self.reliable or self.estimate.dof <= 0 else ()
        how = f"{self.method}, integrator {self.integrator}"
        end = f"{how}: {self.message}; residual rms {self.residual_rms:.4g}"
        said = "No estimates: the values are where the search stopped."
        if self.converged:  # nothing is said of a place that is no minimum
            said = own.judgement if self.reliable else f"NO intervals, see why. {own.judgement}"
        minima = [
            f"minimum {i + 1} ({counted(m.starts, 'start')}): "
            + ", ".join(f"{name} = {value:.6g}" for name, value in m.values.items())
            + f"; cost {m.cost:.4g}"
            for i, m in enumerate(self.minima if len(self.minima) > 1 else ())
        ]
        judged = self.estimate.describe_rank()
        warnings = tuple(w for w in self.warnings if w != judged and not w.startswith(self.message))
        columns = self._outputs() if self.simulations else ()
        outputs = text(columns, left=1 + (len(self.records) > 1)) if columns else ""
        if self.reliable and columns:
            shares = next(column.values for column in columns if column.name == "%")
            said += f"\nThe model leaves at most {percent(max(shares))} % (rms) of an output."
        tables = [table for table in (outputs, "\n".join(minima)) if table]
        more = "what the model leaves of each output" + ("; all minima" if minima else "")
        return Answer(said, f"{own.found}\n\n  {end}", warnings, notes, tuple(tables), more)

    def _outputs(self) -> tuple[Column, ...]:
        """Of each record and output: rms of what was measured, of what the model leaves, and the error used."""
        names = self.model.outputs
        pairs = [
            (record, name, record.outputs[name], run.y[:, j])
            for record, run in zip(self.records, self.simulations, strict=True)
            for j, name in enumerate(names)
            if name in record.outputs
        ]
        whole = np.array([_rms(measured) for _, _, measured, _ in pairs])
        left = np.array([_rms(measured - y) for _, _, measured, y in pairs])
        with np.errstate(divide="ignore", invalid="ignore"):
            share = np.where(whole > 0, left / whole, 0.0)
        records = [Column("record", [record.name for record, *_ in pairs], str)]
        columns = [
            *(records if len(self.records) > 1 else ()),
            Column("output", [name for _, name, *_ in pairs], str),
            Column("rms", whole, "{:.4g}".format),
            Column("left", left, "{:.4g}".format, "left by the model"),
            Column("%", share, percent),
        ]
        if self.errors:
            known = [self.errors.get(name) for _, name, *_ in pairs]
            columns.append(Column("errors", known, "{:.3g}".format, "estimated errors, the weights"))
        return tuple(columns)


def _rms(values: FloatArray) -> float:
    """Of the samples that there are."""
    return float(np.sqrt(np.nanmean(np.square(values)))) if np.isfinite(values).any() else 0.0
