"""Least-squares problem of a fit: residuals and their derivatives over all records, and iterations."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np

from rotorid.base.arrays import FloatArray
from rotorid.identify.adaptive_steps import worth_compiling
from rotorid.identify.ode import OdeModel, SimulationError
from rotorid.identify.records import Record, from_t0, inputs_of, models_of
from rotorid.identify.simulation import Trajectory, simulate
from rotorid.regression import least_squares
from rotorid.regression.estimate import Estimate
from rotorid.regression.nonlinear import NonlinearEstimate
from rotorid.regression.prior import Prior, prior_rows
from rotorid.regression.search import RCOND

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

    def after(self, before: FloatArray) -> Iterations:
        """The same, as the continuation of earlier steps, (k, n)."""
        costs = np.append(np.full(len(before), np.nan), self.costs)
        return replace(self, history=np.vstack((before, self.history)), costs=costs)


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
    errors
        Estimated standard deviation of each output, to weigh by; not stated ones.
    prior
        Rows that count with those of the records; none by default.

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
        errors: Mapping[str, float] | None = None,
        prior: Prior | None = None,
    ) -> None:
        self.given, self.records = model, tuple(from_t0(model, record) for record in records)
        self.integrator, self.rtol, self.errors = integrator, rtol, dict(errors or {})
        if not self.records:
            raise ValueError("a fit needs at least one record")
        self.models = models_of(model, len(self.records))
        """One per record, all with the same parameters."""
        self.model = self.models[0]
        self.prior = prior or prior_rows(self.model.parameters, {})
        self.inputs = [inputs_of(model, record) for record in self.records]
        self.measured, deviations = zip(*map(self._table, self.records), strict=True)
        self.masks = [~np.isnan(data.T) for data in self.measured]
        stated = {s is not None for each in deviations for s in each if s is not False}
        if len(stated) > 1:
            raise ValueError("standard deviations must be stated for all measured outputs, or for none")
        self.stated = stated == {True}
        sizes = [self.errors.get(name, 1.0) for name in self.model.outputs]
        self.weights = []
        for data, each, mask in zip(self.measured, deviations, self.masks, strict=True):
            mask[self.model.fixed_at_first, :1] = False
            known = [size if s is None or s is False else s for s, size in zip(each, sizes, strict=True)]
            sigma = np.stack([np.broadcast_to(s, len(data)) for s in known], axis=-1)
            self.weights.append(1.0 / np.where(np.isnan(data), 1.0, sigma))
        self.data = self.vector(self.measured)
        """Measured values as weighted rows."""
        if not len(self.data):
            raise ValueError("the records have no samples of an output beside those that known values fix")
        most = np.abs(self.data).max()
        if most > LARGEST or 0 < most < 1 / LARGEST:
            raise ValueError(
                f"the records reach {most:.3g} (over the standard deviations, where these are stated): no "
                "sum of squares can be made of such numbers; take other units"
            )
        self._last: tuple[bytes, FloatArray, FloatArray] | None = None
        self.runs: tuple[Trajectory, ...] = ()
        """Of the last evaluation, one per record."""
        self.quick = integrator
        """That of the evaluations: after the first one "taylor" where that is worth compiling."""

    @property
    def scaled(self) -> bool:
        """Whether a residual of 1 is one standard deviation, stated or estimated: a prior counts on it."""
        return self.stated or (len(self.prior) > 0 and not self.prior.ridge)

    def again(self, integrator: str, rtol: float) -> Problem:
        """The same problem, integrated otherwise."""
        return Problem(self.given, self.records, integrator, rtol, self.errors, self.prior)

    def weighed(self, errors: Mapping[str, float]) -> Problem:
        """The same problem with estimated errors to weigh by."""
        return Problem(self.given, self.records, self.integrator, self.rtol, errors, self.prior)

    @cached_property
    def series(self) -> dict[tuple[int, str], int]:
        """Number of samples of each series (an output of a record), in the order of the rows."""
        return {
            (k, name): int(count)
            for k, mask in enumerate(self.masks)
            for name, count in zip(self.model.outputs, mask.sum(axis=1), strict=True)
            if count
        }

    @cached_property
    def series_names(self) -> list[str]:
        """Of each series."""
        several = len(self.records) > 1
        return [f"{name} in {self.records[k].name}" if several else name for k, name in self.series]

    def split(self, rows: FloatArray) -> list[FloatArray]:
        """Rows by series."""
        return np.split(rows, np.cumsum([*self.series.values()])[:-1])

    def plain(self, r: FloatArray) -> FloatArray:
        """Weighted rows in the unit of the outputs."""
        return np.asarray(r / self.vector([np.ones_like(data) for data in self.measured]))

    def vector(self, tables: Sequence[FloatArray]) -> FloatArray:
        """Tables (n, n_y, …) of all records as weighted rows."""
        parts = [
            np.swapaxes(table * weight.reshape(weight.shape + (1,) * (table.ndim - 2)), 0, 1)[mask]
            for table, mask, weight in zip(tables, self.masks, self.weights, strict=True)
        ]
        return parts[0] if len(parts) == 1 else np.concatenate(parts)

    def evaluate(self, theta: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Residuals (m,) and derivatives (m, n).

        Raises
        ------
        SimulationError
            The states diverge.
        """
        key = theta.tobytes()
        if self._last is None or self._last[0] != key:
            if not np.isfinite(theta).all():
                raise SimulationError("the parameters grow beyond all bounds")
            runs, r, J = self._evaluated(theta)
            steps = sum(run.steps for run in runs) if self._last is None and self.quick == "auto" else 0
            if len({*self.models}) == 1 and worth_compiling(self.model, steps):
                self.quick = "taylor"
                again = self._evaluated(theta)
                if np.abs(again[1] - r).max() <= 1e-7 * (np.abs(r) + np.abs(self.data)).max():
                    runs, r, J = again
                else:
                    self.quick = "dop853"
            self._last, self.runs = (key, r, J), tuple(runs)
        return self._last[1], self._last[2]

    def _evaluated(self, theta: FloatArray) -> tuple[list[Trajectory], FloatArray, FloatArray]:
        runs = [
            simulate(model, theta, record, integrator=self.quick, rtol=self.rtol)
            for model, record in zip(self.models, self.records, strict=True)
        ]
        r = self.vector([run.y - data for run, data in zip(runs, self.measured, strict=True)])
        J = self.vector([run.y_theta for run in runs])
        if not (np.abs(r).max() < LARGEST and np.abs(J).max() < LARGEST):
            raise SimulationError("the outputs of the model, or their sensitivities, are beyond all bounds")
        return runs, r, J

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
        sigma = 1.0 if self.scaled else None
        step = least_squares(A, y, names=self.model.parameters, sigma=sigma, rcond=RCOND)
        return replace(step, residuals=step.residuals[: len(Y)])

    def _table(self, record: Record) -> tuple[FloatArray, list[float | FloatArray | bool | None]]:
        """Measured values (n, n_y), and of each output its deviation: None unknown, False not measured."""
        outputs = self.model.outputs
        if unknown := [name for name in record.outputs if name not in outputs]:
            raise ValueError(
                f"{record.name}: {', '.join(unknown)} is no output of the model; outputs are "
                f"{', '.join(outputs)}"
            )
        if not record.outputs:
            raise ValueError(f"{record.name} has no column of an output: {', '.join(outputs)}")
        nothing = np.full(len(record), np.nan)
        data = np.stack([record.outputs.get(name, nothing) for name in outputs], axis=-1)
        missing = np.isnan(data).all(axis=0)
        sigma = record.sigma or {}
        return data, [False if lost else sigma.get(n) for n, lost in zip(outputs, missing, strict=True)]


def at(step: Estimate, theta: FloatArray, residuals: FloatArray) -> Estimate:
    """The estimate of a step, as one of the parameters themselves."""
    values = np.where(np.isnan(step.values), np.nan, theta)
    chi = float(residuals @ residuals) if step.errors_stated else None
    return replace(step, values=values, solution=theta, residuals=residuals, chi_square=chi)


def negligible(size: FloatArray, theta: FloatArray, step: Estimate, limits: tuple[float, float]) -> bool:
    """Whether a step of this size (n,) no longer matters: relative to the parameters, or to their errors."""
    # all components: the step has no part that the data do not determine, and vanishes with the combinations
    value = np.abs(theta)
    limit = limits[0] * np.maximum(value, 1e-6 * float(value.max()))
    if step.std is not None:
        limit = np.maximum(limit, limits[1] * np.nan_to_num(step.std))
    return bool((np.abs(size) <= limit).all())
