"""Result of a fit to time records."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, Any

import numpy as np

from rotorid.base import tables
from rotorid.base.answer import COLUMNS, Answer, Answered
from rotorid.base.json import plain
from rotorid.base.text import capital, percent
from rotorid.identify.ode import OdeModel
from rotorid.identify.record_least_squares import Iterations
from rotorid.identify.records import Record
from rotorid.identify.simulation import Trajectory
from rotorid.regression.estimate import parameter_columns
from rotorid.regression.linear import NormalMatrix
from rotorid.regression.prior import PriorEffect

if TYPE_CHECKING:
    import pandas as pd


@dataclass(frozen=True, eq=False, kw_only=True)
class Fit(Answered, Iterations):
    """Parameters of a model in time, fitted to records: the way of the search, and what became of it.

    Attributes
    ----------
    models, records
        What was fitted to what: one model for each record, all with the same parameters.
    method, integrator, loss
        How; the integrator is the one that was used ("none": the model has no states).
    history, costs, trajectories, integrals, regression, stopped_by
        Parameters at the start and after each iteration, (k + 1, n), half the sum of squared residuals at
        each; of the methods of the texts the states of each record by iteration, I(β), K θ = Y of the last
        one, and what ended them.
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
    autocorrelation
        Of neighbouring residuals; None for few samples or exact data.
    residual_rms
        In the unit of the outputs.
    prior
        What a prior or a ridge did to the estimate; None without any.
    normal_matrix
        At the result; None where the states diverge.
    """

    models: tuple[OdeModel, ...]
    records: tuple[Record, ...]
    method: str
    integrator: str
    loss: str
    reliable: bool
    warnings: tuple[str, ...]
    simulations: tuple[Trajectory, ...]
    autocorrelation: float | None
    residual_rms: float
    prior: PriorEffect | None
    normal_matrix: NormalMatrix | None

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

    def tables(self) -> tuple[tables.Table, ...]:
        """Parameters by iteration, and the states by iteration where a trajectory was iterated."""
        show = "{:.7g}".format
        sizes = self.integrals or tuple(self.costs.tolist())
        columns = [tables.Column("iteration", range(len(self.history)))]
        columns += [tables.Column(n, x, show) for n, x in zip(self.parameters, self.history.T, strict=True)]
        columns += [tables.Column("I(β)" if self.integrals else "half the sum of squares", sizes, show)]
        each = [tables.Table("iterations", tuple(columns))]
        for k, record in enumerate(self.records if self.trajectories else ()):
            t, which = tables.Column("t, s", record.t, show), f", record {k + 1}" if k else ""
            for j, name in enumerate(self.model.states):
                states = [tables.Column(str(i), x[k][:, j], show) for i, x in enumerate(self.trajectories)]
                each.append(tables.Table(f"{name} by iteration{which}", (t, *states)))
        return tuple(each)

    def to_dict(self) -> dict[str, Any]:
        """As JSON types; what is unknown is None."""
        names = self.parameters
        kept = "residual_rms method integrator loss converged message reliable stopped_by iterations"
        document = {key: getattr(self, key) for key in f"{kept} at_bounds autocorrelation warnings".split()}
        document["history"] = [
            {"cost": cost, "parameters": dict(zip(names, row, strict=True))}
            for row, cost in zip(self.history, self.costs, strict=True)
        ]
        document["solutions"] = []
        matrix = self.normal_matrix and self.normal_matrix.to_dict()
        more = {"normal_matrix": matrix, **(self.prior.to_dict() if self.prior else {})}
        return {**self.estimate.to_dict(), **plain(document), **more}

    def to_frame(self) -> pd.DataFrame:
        """One row per parameter: value, std and the 95 % interval."""
        return tables.frame(parameter_columns(self.parameters, self.estimate))

    @property
    def answer(self) -> Answer:
        """Whether there is an answer, the values with their intervals, and what the model leaves."""
        prior, rank = self.prior, self.estimate.describe_rank()
        at_bounds = dict.fromkeys(self.at_bounds, "at its bound")
        parts = self.estimate.answer_with((prior.why if prior else {}) | at_bounds)
        judgement = prior.judgement(parts.judgement) if prior else parts.judgement
        warnings = [w for w in self.warnings if w != rank and not w.startswith(self.message)]
        data = np.concatenate([values for record in self.records for values in record.outputs.values()])
        size = float(np.sqrt(np.nanmean(data**2)))
        if not self.converged:  # nothing is said of a place that is no minimum
            judgement = "No estimates: the values are where the search stopped."
        elif self.described:
            left = percent(self.residual_rms / size) if size > 0 else "0"
            judgement += f"\nThe model leaves {left} % of the record (rms)."
        elif warnings and not prior:
            judgement = f"NO intervals: {warnings.pop(0)}."
        else:
            judgement = f"NO intervals, see why. {judgement}"
        numbers = f"{parts.numbers}\n\n  {self.method}, integrator {self.integrator}: {self.message}"
        numbers += f"\n  residual rms {self.residual_rms:.4g}"
        texts = [f"{capital(table.name)}:\n{tables.terminal(table, COLUMNS)}" for table in self.tables()]
        texts += [self.normal_matrix.text()] if self.normal_matrix else []
        return replace(
            parts,
            judgement=judgement,
            numbers=numbers,
            warnings=tuple(warnings),
            notes=parts.notes if self.described or self.estimate.dof <= 0 else (),
            tables=tuple(texts),
            more="the iterations and the normal matrix",
        )
