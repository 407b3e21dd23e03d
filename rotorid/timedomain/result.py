"""Result of a fit to time records."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, Any

import numpy as np

from rotorid.base.answer import Answer, Answered
from rotorid.base.arrays import FloatArray
from rotorid.base.json import plain
from rotorid.base.result import Column, frame, rows
from rotorid.base.text import counted, percent
from rotorid.regression.estimate import parameter_columns
from rotorid.regression.normal_matrix import NormalMatrix
from rotorid.regression.prior import PriorEffect
from rotorid.timedomain.integration.simulate import Trajectory
from rotorid.timedomain.methods.iteration_history import Path
from rotorid.timedomain.methods.multiple_starts import Minimum
from rotorid.timedomain.models.ode_model import OdeModel
from rotorid.timedomain.models.record import Record, record_names

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
    history, costs, trajectories, stopped_by
        Parameters at the start and after each iteration, (k + 1, n), half the sum of squared residuals at
        each, the states of each record that quasilinearization went through, and what ended the iteration.
    converged, message, at_bounds
        Whether a minimum was reached, and in words; parameters that stand at a bound.
    estimate
        Values, covariance, rank, combinations; residuals (model − record, over the stated standard deviations
        if there are any), record by record, output by output. No covariance where intervals would mislead.
    reliable
        Whether a minimum was reached that describes the record, with residuals that are not in order:
        otherwise there are no intervals, or such as were widened.
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
    prior
        What a prior or a ridge did to the estimate; None without any.
    normal_matrix
        Of the last step; None where the states diverge.
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
    prior: PriorEffect | None = None
    normal_matrix: NormalMatrix | None = None

    @property
    def model(self) -> OdeModel:
        """Of the first record."""
        return self.models[0]

    @property
    def described(self) -> bool:
        """Whether the model describes the record: otherwise there are no intervals."""
        return self.reliable or self.estimate.covariance is not None

    @property
    def parameters(self) -> tuple[str, ...]:
        """Names of the parameters."""
        return self.model.parameters

    @property
    def series(self) -> tuple[Column, ...]:
        """Of each output of each record: number and rms of its samples, and rms of what the model leaves."""
        each = [
            (short, name, record.outputs[name], run.y[:, j] - record.outputs[name])
            for short, record, run in zip(
                record_names([one.name for one in self.records]), self.records, self.simulations, strict=False
            )
            for j, name in enumerate(self.model.outputs)
            if not np.isnan(record.outputs.get(name, np.nan)).all()
        ]
        names, outputs, y, left = zip(*each, strict=True) if each else [()] * 4
        rms = [[float(np.sqrt(np.nanmean(x**2))) for x in table] for table in (y, left)]
        return (
            Column("record", names, str if len(self.records) > 1 else None),
            Column("output", outputs, str),
            Column("samples", [int(np.isfinite(x).sum()) for x in y], "{:d}".format),
            Column("rms", rms[0], "{:.4g}".format),
            Column("residual_rms", rms[1], "{:.4g}".format, "left, rms"),
        )

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
                    "stopped_by": self.stopped_by,
                    "iterations": self.iterations,
                    "history": [
                        {"cost": cost, "parameters": dict(zip(names, row, strict=True))}
                        for row, cost in zip(self.history, self.costs, strict=True)
                    ],
                    "errors": self.errors,
                    "series": rows(self.series),
                    "at_bounds": self.at_bounds,
                    "minima": [
                        {"parameters": m.values, "cost": m.cost, "starts": m.starts} for m in self.minima
                    ],
                    "integration_change": None if change is None else dict(zip(names, change, strict=True)),
                    "autocorrelation": self.autocorrelation,
                    "warnings": self.warnings,
                }
            ),
            "normal_matrix": self.normal_matrix and self.normal_matrix.to_dict(),
            **(self.prior.to_dict() if self.prior else {}),
        }

    def to_frame(self) -> pd.DataFrame:
        """One row per parameter: value, std, the 95 % interval, and whether it stands at a bound."""
        at_bound = [name in self.at_bounds for name in self.parameters]
        return frame((*parameter_columns(self.parameters, self.estimate), Column("at_bound", at_bound)))

    @property
    def answer(self) -> Answer:
        """Whether there is an answer, the values with their intervals, and what the model leaves."""
        prior, judged = self.prior, self.estimate.describe_rank()
        own = self.estimate.told(self.at_bounds, prior.why if prior else {})
        own = replace(own, judgement=prior.judgement(own.judgement)) if prior else own
        said = own.judgement if self.described else f"NO intervals, see why. {own.judgement}"
        if not self.converged:  # nothing is said of a place that is no minimum
            said = "No estimates: the values are where the search stopped."
        found = [own.found, f"\n  {self.method}, integrator {self.integrator}: {self.message}"]
        found.append(f"  residual rms {self.residual_rms:.4g}")
        data = np.concatenate([values for record in self.records for values in record.outputs.values()])
        size = float(np.sqrt(np.nanmean(data**2)))
        if self.described and size > 0:
            left = self.residual_rms / size
            said += f"\nThe model leaves {percent(left)} % of the record (rms)."
        if self.errors:
            sizes = ", ".join(f"{name} {size:.3g}" for name, size in self.errors.items())
            found.append(f"  estimated standard deviations, used as weights: {sizes}")
        for i, m in enumerate(self.minima if len(self.minima) > 1 else ()):
            values = ", ".join(f"{name} = {value:.6g}" for name, value in m.values.items())
            found.append(f"  minimum {i + 1} ({counted(m.starts, 'start')}): {values}; cost {m.cost:.4g}")
        return Answer(
            said,
            "\n".join(found),
            tuple(w for w in self.warnings if w != judged and not w.startswith(self.message)),
            own.notes if self.described or self.estimate.dof <= 0 else (),
            (self.normal_matrix.text(),) if self.normal_matrix else (),
            "the normal matrix",
        )
