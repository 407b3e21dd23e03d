"""Least-squares problem of a fit: residuals and their derivatives over all records, and iterations."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from functools import lru_cache

import numpy as np

from rotorid.base.arrays import FloatArray, IntArray
from rotorid.identify.adaptive_steps import worth_compiling
from rotorid.identify.ode import OdeModel, SimulationError, check_known
from rotorid.identify.records import Record, models_of
from rotorid.identify.simulation import Trajectory, simulate
from rotorid.regression import least_squares
from rotorid.regression.estimate import Estimate
from rotorid.regression.linear import JACOBIAN_RCOND
from rotorid.regression.nonlinear import NonlinearEstimate
from rotorid.regression.prior import prior_rows

LARGEST = 1e140
"""Residuals and sensitivities beyond this size have no sum of squares."""
RTOL = 1e-10
"""Of the integration during a fit."""


@dataclass(frozen=True, eq=False)
class Iterations(NonlinearEstimate):
    """Steps of one method; costs are NaN where they were not computed.

    Attributes
    ----------
    trajectories
        Quasilinearization: the states (n, n_x) of each record at the start and after each iteration.
    integrals
        Of [F]: I(β) at the start and after each step.
    regression
        Quasilinearization: rows K θ = Y (m, n) and (m,) of the last iteration.
    stopped_by
        What ended a method of the texts: "step" |Δβ| or "cost" I(β); None: neither.
    """

    trajectories: tuple[tuple[FloatArray, ...], ...] = ()
    integrals: tuple[float, ...] = ()
    regression: tuple[FloatArray, FloatArray] | None = None
    stopped_by: str | None = None

    @property
    def std(self) -> FloatArray | None:
        """Standard deviations (n,); NaN at a bound or where not determined; None where errors are unknown."""
        return self.estimate.std


class Problem:
    """Residuals y(t, θ) − measured, divided by the standard deviations where these are known.

    Rows are ordered record by record, output by output, sample by sample; missing samples have none, and none
    has the first sample of an output that known initial values fix: it tells nothing of the parameters, and
    would count as a degree of freedom.

    Parameters
    ----------
    model, records
        What is fitted to what.
    integrator, rtol
        Of `simulate`.

    Raises
    ------
    ValueError
        A record without any output of the model, or with columns the model does not have; standard deviations
        for some outputs only; fewer than one sample.
    """

    def __init__(
        self,
        model: OdeModel,
        records: Sequence[Record],
        integrator: str = "auto",
        rtol: float = RTOL,
    ) -> None:
        self.given, self.records, outputs = model, tuple(records), model.outputs
        self.integrator, self.rtol = integrator, rtol
        if not records:
            raise ValueError("a fit needs at least one record")
        for record in records:
            check_known(record.name, record.outputs, "output of the model", outputs)
        self.models = models_of(model, len(records))
        """One per record, all with the same parameters."""
        self.model = self.models[0]
        self.prior = prior_rows(self.model.parameters, {})
        """Rows that count with those of the records."""
        self.measured = [_table(record.outputs, outputs, len(record)) for record in records]
        self.series: list[tuple[str, slice]] = []
        """Words for each output of a record, and its rows."""
        low, high, places = 0, 0, list[IntArray]()
        for record, table in zip(records, self.measured, strict=True):
            seen = ~np.isnan(table)
            seen[:1, self.model.fixed_at_first] = False
            for j, name in enumerate(outputs):
                places.append(low + j * len(record) + np.flatnonzero(seen[:, j]))
                words, size = f"{name} in {record.name}" if len(records) > 1 else name, len(places[-1])
                self.series += [(words, slice(high, high + size))] * (size > 0)
                high += size
            low += table.size
        if not high:
            raise ValueError("the records have no samples of an output beside those that known values fix")
        self.places = np.concatenate(places)
        """Of the rows in the samples of the first output of the first record, of the next, …"""
        self.stated, self.scale = any(record.sigma for record in records), np.ones(high)
        """Whether errors are stated; 1 over the standard deviations."""
        if self.stated:
            sigma = self.vector([_table(record.sigma or {}, outputs, len(record)) for record in records])
            if np.isnan(sigma).any():
                raise ValueError("standard deviations must be stated for all measured outputs, or for none")
            self.scale = 1.0 / sigma
        self.data = self.vector(self.measured)
        most = np.abs(self.data).max()
        if not (most == 0 or 1 / LARGEST < most < LARGEST):
            raise ValueError(
                f"no sum of squares can be made of samples over σ of {most:.3g}: take other units"
            )
        self.runs: tuple[Trajectory, ...] = ()
        self._at = b""
        """Solutions of the last simulation, one per record, and its parameters."""
        self._latest = lru_cache(maxsize=2)(self._evaluated)

    def vector(self, tables: Sequence[FloatArray]) -> FloatArray:
        """Tables (n, n_y, …) of all records as weighted rows."""
        flat = [table.T.reshape(*table.shape[:1:-1], -1) for table in tables]
        rows = np.concatenate(flat, axis=-1).take(self.places, axis=-1)
        rows *= self.scale
        return rows.T

    def by_time(self, columns: Sequence[FloatArray]) -> FloatArray:
        """What belongs to the times of each record, (n,), as rows without weights."""
        return np.concatenate([np.tile(c, len(self.model.outputs)) for c in columns])[self.places]

    def evaluate(self, theta: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Residuals (m,) and derivatives (m, n).

        Raises
        ------
        SimulationError
            The states diverge.
        """
        return self._latest(theta.tobytes())

    def solutions(self, theta: FloatArray) -> tuple[Trajectory, ...]:
        """Of the models at parameters that can be evaluated, one per record."""
        if self._at != theta.tobytes():
            self._evaluated(theta.tobytes())
        return self.runs

    def _evaluated(self, values: bytes) -> tuple[FloatArray, FloatArray]:
        """What `evaluate` gives: a search comes back to parameters it has seen."""
        theta = np.frombuffer(values)
        if not np.isfinite(theta).all():
            raise SimulationError("the parameters grow beyond all bounds")
        # solutions take three times as much as what is kept of them
        first, self._at, self.runs = not self._at, self._at and b"?", ()
        runs = tuple(
            simulate(model, theta, record, integrator=self.integrator, rtol=self.rtol)
            for model, record in zip(self.models, self.records, strict=True)
        )
        first = first and self.integrator == "auto" and len({*self.models}) == 1
        if first and worth_compiling(self.model, sum(run.calls for run in runs)):
            self.integrator = "taylor"
            return self._evaluated(values)
        r = self.vector([run.y - data for run, data in zip(runs, self.measured, strict=True)])
        J = self.vector([run.y_theta for run in runs])
        if not (np.abs(r).max() < LARGEST and np.abs(J).max() < LARGEST):
            raise SimulationError("the outputs of the model, or their sensitivities, are beyond all bounds")
        self._at, self.runs = values, runs
        return r, J

    def residual(self, theta: FloatArray) -> FloatArray:
        """Residuals (m,); infinite where the states diverge, so that a search steps back."""
        try:
            return self.evaluate(theta)[0]
        except SimulationError:
            return np.full(len(self.data), np.inf)

    def jacobian(self, theta: FloatArray) -> FloatArray:
        """Derivatives (m, n)."""
        return self.evaluate(theta)[1]

    def cost(self, r: FloatArray, theta: FloatArray) -> float:
        """Half the sum of squares of residuals and of those of a prior."""
        p = self.prior.residual(theta)
        return 0.5 * float(r @ r + p @ p)

    def linear_fit(self, K: FloatArray, Y: FloatArray, theta: FloatArray) -> Estimate:
        """The step of the parameters (n,) from linearised rows K δ = Y, (m, n) and (m,), and the prior's."""
        A, y = self.prior.below(K), np.append(Y, -self.prior.residual(theta))
        sigma = 1.0 if self.stated else None
        step = least_squares(A, y, names=self.model.parameters, sigma=sigma, rcond=JACOBIAN_RCOND)
        return replace(step, residuals=step.residuals[: len(Y)])


def _table(columns: Mapping[str, float | FloatArray], outputs: Sequence[str], samples: int) -> FloatArray:
    """Columns of the outputs, (samples, n_y), NaN where there are none."""
    return np.stack([np.broadcast_to(columns.get(n, np.nan), samples) for n in outputs]).T


def negligible(size: FloatArray, theta: FloatArray, step: Estimate, limits: tuple[float, float]) -> bool:
    """Whether a step of this size (n,) no longer matters: relative to the parameters, or to their errors."""
    # all components: the step has no part that the data do not determine, and vanishes with the combinations
    value = np.abs(theta)
    limit = limits[0] * np.maximum(value, 1e-6 * float(value.max()))
    if step.std is not None:
        limit = np.maximum(limit, limits[1] * np.nan_to_num(step.std))
    return bool((np.abs(size) <= limit).all())
