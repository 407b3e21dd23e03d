"""Errors of the readings that a correction is made of: how they go on into its weights and a check run."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from balancing.coefficients.baseline import Start
from balancing.coefficients.influence import Influence
from balancing.coefficients.run_error_estimate import seen_in
from balancing.coefficients.run_errors import (
    RunErrors,
    run_columns,
    runs_of,
)
from balancing.data.reading_errors import reading_covariance
from balancing.solvers.correction_methods import Fitted
from balancing.solvers.effective_variance import UNEXPLAINED
from balancing.solvers.error_propagation import prediction_covariance
from rotorid.base.arrays import ComplexArray, FloatArray, IntArray
from rotorid.regression import stretch


@dataclass(frozen=True, eq=False)
class StackErrors:
    """Errors of the chosen readings and coefficients.

    Attributes
    ----------
    W, Y
        Coefficients (S, C, P) and vibration of the bare rotor (S, C).
    channels, total
        Covariance of (Re Y, Im Y, Re W₁, …) of each reading, without and with what readings have in common,
        (N, 2P + 2, 2P + 2).
    common
        As `Influence.common`, (2, M, S, C, P + 1).
    start
        Errors of a further reading.
    run
        Errors between runs.
    between
        `Influence.own_between`.
    """

    W: ComplexArray
    Y: ComplexArray
    channels: FloatArray
    total: FloatArray
    common: ComplexArray | None
    start: Start
    run: RunErrors
    between: float

    def explain(self, D: ComplexArray, chance: float = 1 - UNEXPLAINED) -> bool:
        """Whether errors alone may leave what the weights leave: more, with at least this probability."""
        return self._after(D)[0] > chance

    def weights(self, fitted: Fitted) -> tuple[FloatArray | None, float | None]:
        """Covariance of the weights, (2P, 2P), and its degrees of freedom."""
        if fitted.covariance is None or not fitted.parts:
            return fitted.covariance, self.start.model.dof
        run = self._after(fitted.weights)[1] if self.start.fresh and fitted.explained else self.run
        own, speed, whole = fitted.parts
        parts = np.stack((own * (1 - self.between), own * self.between, speed, whole))
        scale, dof = run.degrees(parts, self.start.model.dof)
        return fitted.covariance * scale, dof

    def check_run(self, D: ComplexArray, after: ComplexArray) -> FloatArray:
        """Covariance of readings with the weights mounted around their prediction, (S, C, 2, 2)."""
        errors = self.start.model.errors
        assert errors is not None
        between = self.run.variance(after, after - self.Y)[..., None, None] * np.eye(2)
        predicted = prediction_covariance(D, self.total).reshape(between.shape)
        return np.asarray(reading_covariance(after, errors) + between + predicted)

    def check_rms(self, D: ComplexArray, after: ComplexArray, dof: float | None) -> float:
        """Root mean square below which 95 of 100 check runs stay, with the weights mounted.

        Σ|a + e|² of normal errors e of covariance C (real, over all readings) has the mean |a|² + tr C and
        the variance 2 tr C² + 4 aᵀ C a; its 95 % quantile is that of the gamma distribution of the same two.
        """
        from scipy.special import gammaincinv

        each = self.check_run(D, after).reshape(-1, 2, 2)
        further = run_columns(self.run, runs_of(after[None], D[None], self.W)).common
        columns = further.reshape(2, -1, *after.shape)
        if self.common is not None:
            columns = np.concatenate((self.common @ np.concatenate(([1.0], D)), columns), axis=1)
        shared = columns[0].reshape(-1, after.size)
        joint = shared.T @ shared.conj()
        C = after.shape[1]
        for s, part in enumerate(np.moveaxis(columns[1], 1, 0)):
            joint[s * C : s * C + C, s * C : s * C + C] += part.T @ part.conj()
        a = stretch(after.ravel()).reshape(-1, 2)
        mean = float(np.sum(a**2) + np.trace(each, axis1=1, axis2=2).sum())
        apart = joint - np.diag(np.diag(joint))
        variance = 2 * float(np.sum(each**2)) + 4 * float(np.einsum("ni,nij,nj->", a, each, a))
        variance += 4 * float(np.sum(np.abs(apart) ** 2))
        variance += 4 * float((after.ravel().conj() @ apart @ after.ravel()).real)
        shape = 1 / (variance / mean**2 + (0 if dof is None else 2 / dof))
        return float(np.sqrt(mean * gammaincinv(shape, 0.95) / shape / after.size))

    def _after(self, D: ComplexArray) -> tuple[float, RunErrors]:
        own = np.trace(prediction_covariance(D, self.channels), axis1=1, axis2=2).reshape(self.Y.shape) / 2
        shared = None if self.common is None else self.common @ np.concatenate(([1.0], D))
        return seen_in(self.run, self.Y + self.W @ D, own, self.between, shared, self.W)


def stack_errors(
    influence: Influence, start: Start, used: list[int], chosen: list[int]
) -> StackErrors | None:
    """Of these speeds and planes; None where the errors are unknown.

    Parameters
    ----------
    influence, start
        Coefficients and the vibration to correct.
    used, chosen
        Indices of speeds and planes.
    """
    own = start.own
    if start.covariance is None or own is None or start.model.errors is None:
        return None
    index: IntArray = np.concatenate([[0, 1], *([2 + 2 * p, 3 + 2 * p] for p in chosen)])
    n = len(index)
    common = None if start.common is None else start.common[:, :, used][..., [0, *(1 + p for p in chosen)]]
    return StackErrors(
        influence.W[used][..., chosen],
        start.readings[used],
        own[used][..., index[:, None], index].reshape(-1, n, n),
        start.covariance[used][..., index[:, None], index].reshape(-1, n, n),
        common,
        start,
        influence.run_errors,
        influence.own_between,
    )
