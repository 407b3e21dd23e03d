"""What a fit to time records found."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

from rotorid.base.arrays import FloatArray
from rotorid.base.json import finite
from rotorid.base.text import counted
from rotorid.regression.estimate import Estimate
from rotorid.timedomain.integration.simulate import Trajectory
from rotorid.timedomain.models.model import OdeModel
from rotorid.timedomain.models.record import Record

if TYPE_CHECKING:
    import pandas as pd


@dataclass(frozen=True)
class Minimum:
    """Where one or more starts ended.

    Attributes
    ----------
    values
        Parameters, by name.
    cost
        Half the sum of squared weighted residuals.
    starts
        How many starts ended here.
    """

    values: dict[str, float]
    cost: float
    starts: int


@dataclass(frozen=True, eq=False)
class Fit:
    """Parameters of a model in time, fitted to records.

    Attributes
    ----------
    models, records
        What was fitted to what: one model for each record, all with the same parameters.
    method, integrator, loss
        How; the integrator is the one that was used ("none": the model has no states).
    estimate
        Values, covariance, rank, combinations; residuals (model − record, over the stated standard deviations
        if there are any), record by record, output by output. No covariance where intervals would mislead.
    history
        Parameters at the start and after each iteration, (iterations + 1, n).
    costs
        Half the sum of squared weighted residuals at each.
    converged, message
        Whether a minimum was reached, and in words.
    at_bounds
        Parameters that stand at a bound.
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
    trajectories
        Quasilinearization: states of each record at the start and after each iteration.
    errors
        Standard deviation of each output as estimated from its residuals, where these were the weights.
    """

    models: tuple[OdeModel, ...]
    records: tuple[Record, ...]
    method: str
    integrator: str
    loss: str
    estimate: Estimate
    history: FloatArray
    costs: FloatArray
    converged: bool
    message: str
    at_bounds: tuple[str, ...]
    reliable: bool
    warnings: tuple[str, ...]
    simulations: tuple[Trajectory, ...]
    minima: tuple[Minimum, ...]
    integration_change: FloatArray | None
    autocorrelation: float | None
    residual_rms: float
    trajectories: tuple[tuple[FloatArray, ...], ...] = ()
    errors: dict[str, float] | None = None

    @property
    def model(self) -> OdeModel:
        """Of the first record."""
        return self.models[0]

    @property
    def parameters(self) -> tuple[str, ...]:
        """Names of the parameters."""
        return self.model.parameters

    @property
    def values(self) -> FloatArray:
        """Parameters (n,); NaN where the data do not determine one."""
        return self.estimate.values

    @property
    def std(self) -> FloatArray | None:
        """Standard deviations (n,); None where none can be given."""
        return self.estimate.std

    @property
    def ci95(self) -> FloatArray | None:
        """95 % intervals (n, 2); None where none can be given."""
        return self.estimate.ci95

    @property
    def iterations(self) -> int:
        """Number of steps."""
        return len(self.history) - 1

    def to_dict(self) -> dict[str, Any]:
        """As JSON types; what is unknown is None."""
        change = self.integration_change
        return {
            **self.estimate.to_dict(),
            "solutions": [],
            "residual_rms": finite(self.residual_rms),
            "method": self.method,
            "integrator": self.integrator,
            "loss": self.loss,
            "converged": self.converged,
            "message": self.message,
            "reliable": self.reliable,
            "iterations": self.iterations,
            "history": [
                {"cost": finite(cost), "parameters": dict(zip(self.parameters, row.tolist(), strict=True))}
                for row, cost in zip(self.history, self.costs, strict=True)
            ],
            "errors": self.errors,
            "at_bounds": list(self.at_bounds),
            "minima": [
                {"parameters": m.values, "cost": finite(m.cost), "starts": m.starts} for m in self.minima
            ],
            "integration_change": None
            if change is None
            else {name: finite(c) for name, c in zip(self.parameters, change, strict=True)},
            "autocorrelation": None if self.autocorrelation is None else finite(self.autocorrelation),
            "warnings": list(self.warnings),
        }

    def to_frame(self) -> pd.DataFrame:
        """One row per parameter: value, std, the 95 % interval, and whether it stands at a bound."""
        frame = self.estimate.to_frame()
        frame["at_bound"] = [name in self.at_bounds for name in self.parameters]
        return frame

    def history_frame(self) -> pd.DataFrame:
        """One row per iteration: parameters and cost."""
        import pandas as pd

        frame = pd.DataFrame(self.history, columns=list(self.parameters))
        frame.insert(0, "iteration", range(len(frame)))
        frame["cost"] = self.costs
        return frame

    def summary(self) -> str:
        """Text for an engineer: method, values ± standard deviations, intervals, and what to beware of."""
        lines = self.estimate.summary(self.at_bounds).splitlines()
        if not self.converged:  # nothing is said of a place that is no minimum
            lines = [line for line in lines if line != self.estimate.describe_rank()]
        if self.estimate.covariance is None and self.estimate.dof > 0:
            lines = [line for line in lines if not line.startswith("no intervals: ")]
        lines.insert(0, f"{self.method}, integrator {self.integrator}: {self.message}")
        lines.append(f"residual rms {self.residual_rms:.4g}")
        if self.errors:
            sizes = ", ".join(f"{name} {size:.3g}" for name, size in self.errors.items())
            lines.append(f"estimated standard deviations, used as weights: {sizes}")
        for i, m in enumerate(self.minima if len(self.minima) > 1 else ()):
            values = ", ".join(f"{name} = {value:.6g}" for name, value in m.values.items())
            lines.append(f"minimum {i + 1} ({counted(m.starts, 'start')}): {values}; cost {m.cost:.4g}")
        said = set(lines)
        return "\n".join([*lines, *(f"warning: {text}" for text in self.warnings if text not in said)])
