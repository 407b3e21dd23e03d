"""Errors of the readings and coefficients of a correction together, for its weights and a check run."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from balancing.coefficients.baseline import Start
from balancing.coefficients.influence import Influence
from balancing.coefficients.run_error_estimate import few, seen_in
from balancing.coefficients.run_errors import (
    RunErrors,
    run_columns,
    runs_of,
)
from balancing.data.reading_errors import reading_covariance
from balancing.solvers.correction_methods import Fitted
from balancing.solvers.effective_variance import UNEXPLAINED
from balancing.solvers.error_propagation import prediction_covariance
from rotorid.base.arrays import AnyArray, ComplexArray, FloatArray, IntArray
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
    common, parameters
        As of `Influence`, (2, M, S, C, P + 1) and (M, S, C, P + 1).
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
    parameters: ComplexArray | None
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
        scale, dof = run.degrees(self._parts(*fitted.parts), self.start.model.dof)
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

        S, C = after.shape
        each = self.check_run(D, after)
        further = run_columns(self.run, runs_of(after[None], D[None], self.W)).common
        speed, run, moved = (F.reshape(S, 2 * C, -1) for F in self._columns(D, further.reshape(2, -1, S, C)))
        # C is columns that all readings have in common, but for its blocks at a speed
        wide = np.concatenate((run, moved), axis=2)
        block = speed @ speed.swapaxes(1, 2) + wide @ wide.swapaxes(1, 2)
        n = np.arange(C)
        block.reshape(S, C, 2, C, 2)[:, n, :, n] = each.swapaxes(0, 1)
        a = stretch(after.ravel()).reshape(S, 2 * C)
        square, along = wide.swapaxes(1, 2) @ wide, np.einsum("si,sik->sk", a, wide)
        mean = float(np.sum(a**2) + np.trace(each, axis1=2, axis2=3).sum())
        squares = np.sum(block**2) - np.sum(square**2) + np.sum(square.sum(axis=0) ** 2)
        moved_a = np.einsum("si,sij,sj", a, block, a) - np.sum(along**2) + np.sum(along.sum(axis=0) ** 2)
        variance = 2 * float(squares) + 4 * float(moved_a)
        shape = 1 / (variance / mean**2 + (0 if dof is None else 2 / dof))
        return float(np.sqrt(mean * gammaincinv(shape, 0.95) / shape / after.size))

    def _after(self, D: ComplexArray) -> tuple[float, RunErrors]:
        at = few(*self.Y.shape)
        each = self.channels.reshape(*self.Y.shape, *self.channels.shape[1:])[at]
        some = replace(
            self,
            W=self.W[at],
            Y=self.Y[at],
            channels=each.reshape(-1, *self.channels.shape[1:]),
            common=None if self.common is None else self.common[:, :, *at],
            parameters=None if self.parameters is None else self.parameters[:, *at],
        )
        return some._seen(D)

    def _seen(self, D: ComplexArray) -> tuple[float, RunErrors]:
        own = np.trace(prediction_covariance(D, self.channels), axis1=1, axis2=2) / 2
        parts = self._parts(np.diag(np.repeat(own, 2)), *self._shared(D, np.zeros((2, 0, *self.Y.shape))))
        return seen_in(self.run, self.Y + self.W @ D, parts, self.W)

    def _parts(self, own: FloatArray, *others: FloatArray) -> FloatArray:
        """As `RunErrors.degrees` takes them, (5, n, n)."""
        return np.stack((own * (1 - self.between), own * self.between, *others))

    def _shared(self, D: ComplexArray, further: AnyArray) -> tuple[FloatArray, ...]:
        """Of Y₀ + W D what is common at a speed, to the run (`further` too), of parameters, (2N, 2N) each."""
        S, C = self.Y.shape
        speed, run, moved = (F @ F.T for F in self._columns(D, further))
        return speed * np.kron(np.eye(S), np.ones((2 * C,) * 2)), run, moved

    def _columns(self, D: ComplexArray, further: AnyArray) -> tuple[FloatArray, ...]:
        """Columns F of covariances F Fᵀ, (2N, …) each: as `_shared`, at a speed as if common to all."""
        z = np.concatenate(([1.0], D))
        S, C = self.Y.shape
        common = further if self.common is None else np.concatenate((self.common @ z, further), axis=1)
        run, speed = (stretch(F.T) for F in common.reshape(2, -1, S * C))
        moved = np.zeros((0, S, C)) if self.parameters is None else self.parameters @ z
        columns = stretch(moved.reshape(-1, S * C).T)[:, ::2]
        return speed, run, columns


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
    common, parameters = (
        None if columns is None else columns[..., used, :, :][..., [0, *(1 + p for p in chosen)]]
        for columns in (start.common, start.parameters)
    )
    return StackErrors(
        influence.W[used][..., chosen],
        start.readings[used],
        own[used][..., index[:, None], index].reshape(-1, n, n),
        start.covariance[used][..., index[:, None], index].reshape(-1, n, n),
        common,
        parameters,
        start,
        influence.run_errors,
        influence.own_between,
    )
