"""Least-squares problem of a fit: residuals and their derivatives over all records."""

from __future__ import annotations

import time
from collections.abc import Mapping, Sequence
from dataclasses import replace
from functools import cached_property

import numpy as np

from rotorid.base.arrays import FloatArray
from rotorid.regression import least_squares
from rotorid.regression.estimate import Estimate
from rotorid.regression.prior import Prior, prior_rows
from rotorid.regression.search import RCOND
from rotorid.timedomain.integration.simulate import SimulationError, Trajectory, simulate
from rotorid.timedomain.models.ode_model import OdeModel
from rotorid.timedomain.models.record import Record, from_t0
from rotorid.timedomain.models.several_records import models_of

LARGEST = 1e140
"""Residuals and sensitivities beyond this size have no sum of squares."""
RTOL = 1e-10
"""Of the integration during a fit."""


class OutOfTime(Exception):
    """The limit of time has come."""


class Problem:
    """Residuals y(t, θ) − measured, divided by the standard deviations where these are stated.

    Rows are ordered record by record, output by output, sample by sample; missing samples have none, and none
    has the first sample of an output that known initial values fix: it tells nothing of the parameters, and
    would count as a degree of freedom.

    Parameters
    ----------
    model, records
        What is fitted to what.
    integrator
        Of `simulate`.
    rtol
        Its tolerance.
    errors
        Estimated standard deviation of each output, to weigh by; not stated ones.
    seconds
        Limit of time of the search, which begins now.
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
        seconds: float = np.inf,
        prior: Prior | None = None,
    ) -> None:
        self.records, self._given = tuple(from_t0(model, record) for record in records), model
        self.integrator, self.rtol = integrator, rtol
        self.errors = dict(errors or {})
        self.limit = time.monotonic() + seconds
        """When the search has to end."""
        self.seconds = seconds
        if not self.records:
            raise ValueError("a fit needs at least one record")
        self.models = models_of(model, len(self.records))
        """One per record, all with the same parameters."""
        self.model = self.models[0]
        self.prior = prior or prior_rows(self.model.parameters, {})
        tables = [self._table(record) for record in self.records]
        known = {given for _, _, given in tables if given is not None}
        if len(known) > 1:
            raise ValueError("standard deviations must be stated for all measured outputs, or for none")
        self.stated = known == {True}
        self.measured = [data for data, _, _ in tables]
        self.masks = [~np.isnan(data.T) for data, _, _ in tables]
        for one, mask in zip(self.models, self.masks, strict=True):
            mask[one.fixed_at_first, :1] = False
        self.weights = [1.0 / sigma for _, sigma, _ in tables]
        if self.rows == 0:
            raise ValueError("the records have no samples of an output beside those that known values fix")
        if np.abs(self.data).max() > LARGEST or 0 < np.abs(self.data).max() < 1 / LARGEST:
            raise ValueError(
                f"the records reach {np.abs(self.data).max():.3g} (over the standard deviations, where these "
                "are stated): no sum of squares can be made of such numbers; take other units"
            )
        self._last: tuple[bytes, FloatArray, FloatArray] | None = None
        self.runs: tuple[Trajectory, ...] = ()
        """Of the last evaluation, one per record."""
        self.best: tuple[float, FloatArray] | None = None
        """Smallest sum of squares so far, and the parameters there."""
        self.failure = ""

    @property
    def late(self) -> bool:
        """Whether the limit of time has come."""
        return time.monotonic() > self.limit

    @property
    def scaled(self) -> bool:
        """Whether a residual of 1 is one standard deviation, stated or estimated: a prior counts on it."""
        return self.stated or (len(self.prior) > 0 and not self.prior.ridge)

    def again(self, integrator: str, rtol: float) -> Problem:
        """The same problem, integrated otherwise."""
        return Problem(self._given, self.records, integrator, rtol, self.errors, prior=self.prior)

    def weighed(self, errors: Mapping[str, float]) -> Problem:
        """The same problem with estimated errors to weigh by, and with the time that is left."""
        left = self.limit - time.monotonic()
        other = Problem(self._given, self.records, self.integrator, self.rtol, errors, left, self.prior)
        other.seconds = self.seconds  # what a message says
        return other

    @cached_property
    def rows(self) -> int:
        """Number of samples."""
        return int(sum(np.count_nonzero(mask) for mask in self.masks))

    @cached_property
    def groups(self) -> list[int]:
        """Samples of each series (one output of one record), in the order of the rows."""
        return [int(count) for mask in self.masks for count in mask.sum(axis=1) if count]

    @cached_property
    def series(self) -> list[str]:
        """Name of each series, in the order of the rows."""
        several = len(self.records) > 1
        return [
            f"{name} in {record.name}" if several else name
            for record, mask in zip(self.records, self.masks, strict=True)
            for name, count in zip(self.model.outputs, mask.sum(axis=1), strict=True)
            if count
        ]

    def plain(self, r: FloatArray) -> FloatArray:
        """Weighted rows in the unit of the outputs."""
        return np.asarray(r / self.vector([np.ones_like(data) for data in self.measured]))

    def vector(self, tables: Sequence[FloatArray]) -> FloatArray:
        """Tables (n, n_y, …) of all records as weighted rows."""
        parts = []
        for table, mask, weight in zip(tables, self.masks, self.weights, strict=True):
            w = weight if table.ndim == 2 else weight[..., None]
            parts.append(np.swapaxes(table * w, 0, 1)[mask])
        return parts[0] if len(parts) == 1 else np.concatenate(parts)

    @cached_property
    def data(self) -> FloatArray:
        """Measured values as weighted rows."""
        return self.vector(self.measured)

    def evaluate(self, theta: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Residuals (m,) and derivatives (m, n).

        Raises
        ------
        SimulationError
            The states diverge.
        OutOfTime
            The limit of time has come; never at the first evaluation.
        """
        key = theta.tobytes()
        if self._last is None or self._last[0] != key:
            if self.best is not None and self.late:
                raise OutOfTime
            if not np.isfinite(theta).all():
                raise SimulationError("the parameters grow beyond all bounds")
            runs = [
                simulate(model, theta, record, method=self.integrator, rtol=self.rtol)
                for model, record in zip(self.models, self.records, strict=True)
            ]
            r = self.vector([run.y - data for run, data in zip(runs, self.measured, strict=True)])
            J = self.vector([run.y_theta for run in runs])
            if not (np.abs(r).max() < LARGEST and np.abs(J).max() < LARGEST):
                raise SimulationError(
                    "the outputs of the model, or their sensitivities, are beyond all bounds"
                )
            self._last, self.runs = (key, r, J), tuple(runs)
            square = float(r @ r)
            if self.best is None or square < self.best[0]:
                self.best = square, theta.copy()
        return self._last[1], self._last[2]

    def residual(self, theta: FloatArray) -> FloatArray:
        """Residuals (m,); infinite where the states diverge, so that a search steps back."""
        try:
            return self.evaluate(theta)[0]
        except SimulationError as error:
            self.failure = str(error)
            return np.full(self.rows, np.inf)

    def jacobian(self, theta: FloatArray) -> FloatArray:
        """Derivatives (m, n)."""
        return self.evaluate(theta)[1]

    def linear_fit(self, K: FloatArray, Y: FloatArray, theta: FloatArray) -> Estimate:
        """The step of the parameters (n,) from linearised rows K δ = Y, (m, n) and (m,), and the prior's."""
        A, y = self.prior.below(K), np.append(Y, -self.prior.residual(theta))
        sigma = 1.0 if self.scaled else None
        found = least_squares(A, y, names=self.model.parameters, sigma=sigma, rcond=RCOND)
        return replace(found, residuals=found.residuals[: len(Y)])

    def _table(self, record: Record) -> tuple[FloatArray, FloatArray, bool | None]:
        """Measured values and standard deviations (n, n_y); whether these are stated (None: no values)."""
        outputs = self.model.outputs
        unknown = [name for name in record.outputs if name not in outputs]
        if unknown:
            raise ValueError(
                f"{record.name}: {', '.join(unknown)} is no output of the model; outputs are "
                f"{', '.join(outputs)}"
            )
        missing = [name for name in self.model.inputs if name not in record.inputs]
        if missing:
            raise ValueError(f"{record.name}: the input {', '.join(missing)} is missing")
        if not record.outputs:
            raise ValueError(f"{record.name} has no column of an output: {', '.join(outputs)}")
        data = np.full((len(record), len(outputs)), np.nan)
        sigma = np.ones_like(data)
        given: set[bool] = set()
        for i, name in enumerate(outputs):
            if name not in record.outputs or np.isnan(record.outputs[name]).all():
                continue
            data[:, i] = record.outputs[name]
            given.add(record.sigma is not None and name in record.sigma)
            if record.sigma is not None and name in record.sigma:
                sigma[:, i] = record.sigma[name]
        if len(given) > 1:
            raise ValueError(
                f"{record.name}: standard deviations must be stated for all measured outputs, or for none"
            )
        if given and not any(given):
            sigma = np.tile([self.errors.get(name, 1.0) for name in outputs], (len(record), 1))
        sigma[np.isnan(data)] = 1.0
        return data, sigma, given.pop() if given else None
