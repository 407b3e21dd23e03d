"""Solutions of a model in time with their sensitivities S = ∂x/∂θ: exact for linear models, and plain steps.

Differentiating dx/dt = f(t, x, θ, u) by θ and exchanging the derivatives gives

    dS/dt = f_x S + f_θ,    S(t0) = ∂x0/∂θ                                      [F] (3.6)

A linear model with constant coefficients is solved exactly. With z = (x, w), where w are 1, the
inputs and their slopes, dz/dt = M z; from sample to sample z' = e^{Mh} z, and S' = e^{Mh} S + (∂e^{Mh}/∂θ) z.
The derivative of e^A in the direction E is the upper right block of the exponential of [[A, E], [0, A]].
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from itertools import pairwise
from typing import TypeVar

import numpy as np

from rotorid.base.arrays import FloatArray, IndexArray
from rotorid.identify.ode import OdeModel

SAME_STEP = 4e-15
"""Steps that differ by less than this share of the largest time are one step (rounded times)."""
BATCH = 2**22
"""Numbers in one batch of matrix exponentials."""
At = TypeVar("At", int, float)
HEUN: dict[str, Callable[[int], list[list[int]]]] = {
    "heun": lambda n: [list(range(n))],
    "sequential-heun": lambda n: [[i] for i in range(n)],
}
"""Euler's predictor and the trapezoidal corrector: numbers of the n states that each corrects together."""


class System:
    """Right-hand side of the states x and, if wanted, of S behind them (row by row).

    Parameters
    ----------
    model, theta
        The model and its parameters (n_p,).
    t, u
        Times (n,) and inputs (n, n_u), straight lines between samples.
    sensitivities
        Whether S is part of the system.
    """

    def __init__(
        self, model: OdeModel, theta: FloatArray, t: FloatArray, u: FloatArray, sensitivities: bool
    ) -> None:
        self.model, self.theta, self.t, self.u = model, theta, t, u
        self.nx = len(model.states)
        self.np = len(theta) if sensitivities else 0
        self._none = np.zeros(0)
        table = model.x0(theta)[:, : 1 + self.np]
        self.first = np.concatenate([table[:, 0], table[:, 1:].reshape(-1)])
        """States and sensitivities at the first time."""
        self.steps = 0
        """Of an integration with error control."""

    def inputs(self, time: float) -> FloatArray:
        """Inputs at a time, (n_u,)."""
        if not self.model.inputs:
            return self._none
        i = min(max(int(np.searchsorted(self.t, time, side="right")) - 1, 0), len(self.t) - 2)
        part = (time - self.t[i]) / (self.t[i + 1] - self.t[i])
        return np.asarray((1 - part) * self.u[i] + part * self.u[i + 1])

    def __call__(self, time: float, z: FloatArray) -> FloatArray:
        """Rates, (size,)."""
        rates = self.model.augmented if self.np else self.model.rate
        return rates(time, z, self.theta, self.inputs(time))

    def jacobian(self, time: float, z: FloatArray) -> FloatArray:
        """Derivatives of the rates without those of f_x and f_θ themselves (good enough for Newton steps)."""
        f_x = self.model.f(time, z[: self.nx], self.theta, self.inputs(time))[:, 1 : 1 + self.nx]
        out = np.zeros((len(z), len(z)))
        out[: self.nx, : self.nx] = f_x
        out[self.nx :, self.nx :] = np.kron(f_x, np.eye(self.np))
        return out

    def rows(self, states: Sequence[int]) -> list[int]:
        """Where these states and their rows of S stand."""
        return [*states, *(self.nx + i * self.np + k for i in states for k in range(self.np))]


def exact(system: System) -> FloatArray:
    """States and sensitivities (n, size) of a linear model; not finite where they overflow."""
    model, t, n, k = system.model, system.t, system.nx, system.np
    if not model.linear_driven:
        raise ValueError(
            "expm solves linear models with constant coefficients, without explicit time; use dop853, lsoda, "
            "or auto"
        )
    nu = system.u.shape[1] if model.driven else 0
    u = system.u[:, :nu]
    matrix = np.zeros((1 + k, n + 1 + 2 * nu, n + 1 + 2 * nu))
    matrix[:, :n, : n + 1 + nu] = model.matrices(system.theta)[: 1 + k, :, : n + 1 + nu]
    matrix[0, n + 1 : n + 1 + nu, n + 1 + nu :] = np.eye(nu)
    steps = np.diff(t)
    drive = np.column_stack([np.ones(len(t) - 1), u[:-1], np.diff(u, axis=0) / steps[:, None]])[..., None]
    x, s = np.empty((len(t), n, 1)), np.empty((len(t), n, k))
    x[0, :, 0], s[0] = system.first[:n], system.first[n:].reshape(n, k)
    moving = np.flatnonzero(matrix[1:].any(axis=(1, 2)))  # others act by the initial values alone
    kinds, which = _distinct(steps, SAME_STEP * float(np.abs(t).max()))
    size = max(1, BATCH // ((1 + k) * matrix[0].size))
    for low in range(0, len(steps), size):
        part, w = slice(low + 1, low + 1 + size), drive[low : low + size]
        used, place = np.unique(which[low : low + size], return_inverse=True)
        h = kinds[used][:, None, None]
        P, D = expm_and_derivatives(h * matrix[0], h[:, None] * matrix[1 + moving])
        if len(h) > 1:
            P, D = P[place], D[place]
        x[part] = recurrence(P[:, :n, :n], x[low], P[:, :n, n:] @ w)
        z = np.concatenate([x[low : low + len(w)], w], axis=1)
        bend = np.zeros((len(w), n, k))
        bend[:, :, moving] = (D[:, :, :n] @ z[:, None])[..., 0].swapaxes(1, 2)
        s[part] = recurrence(P[:, :n, :n], s[low], bend)
    return np.concatenate([x[:, :, 0], s.reshape(len(t), -1)], axis=1)


def expm_and_derivatives(matrix: FloatArray, direction: FloatArray) -> tuple[FloatArray, FloatArray]:
    """e^A and its derivatives in directions E: blocks of the exponential of [[A, E], [0, A]].

    Parameters
    ----------
    matrix
        A, shape (..., n, n).
    direction
        E, shape (..., k, n, n): k directions for each matrix.

    Returns
    -------
    tuple
        e^A (..., n, n) and d/dε e^{A + ε E} at ε = 0, (..., k, n, n); not finite where they overflow.
    """
    from scipy.linalg import expm

    n = matrix.shape[-1]
    A = matrix[..., None, :, :]
    # E as large as A: a larger one would cost digits of e^A
    size = np.linalg.norm(direction, axis=(-2, -1), keepdims=True)
    scale = np.linalg.norm(A, axis=(-2, -1), keepdims=True) / np.where(size > 0, size, 1.0)
    scale = np.where(scale > 0, scale, 1.0)
    blocks = np.zeros((*direction.shape[:-2], 2 * n, 2 * n))
    blocks[..., :n, :n] = blocks[..., n:, n:] = A
    blocks[..., :n, n:] = scale * direction
    if not np.isfinite(blocks).all() or not np.isfinite(matrix).all():
        return np.full_like(matrix, np.nan), np.full_like(direction, np.nan)
    if not blocks.size:
        return expm(matrix), direction
    whole = expm(blocks)
    return whole[..., 0, :n, :n], whole[..., :n, n:] / scale


def recurrence(P: FloatArray, first: FloatArray, push: FloatArray) -> FloatArray:
    """y_i = P_i y_{i−1} + push_i after `first`, (n, m, k), by doubling spans; P (n, m, m), or one for all."""
    y = push.copy()
    y[0] += P[0] @ first
    span = 1
    while span < len(y):
        if len(P) > 1:
            y[span:] += P[span:] @ y[:-span]
            P = np.concatenate([P[:span], P[span:] @ P[:-span]])
        else:
            y[span:] += np.tensordot(y[:-span], P[0], (1, 1)).swapaxes(1, 2)
            P = P @ P
        span *= 2
    return y


def _distinct(steps: FloatArray, tolerance: float) -> tuple[FloatArray, IndexArray]:
    """Steps that differ by more than the tolerance, and which of them each step is.

    Of those that differ by rounding it is their mean: an error of one would add up over the record.
    """
    kinds = np.round((steps - steps[:1]) / tolerance)
    _, first, which, count = np.unique(kinds, return_index=True, return_inverse=True, return_counts=True)
    one = steps[first]
    return one + np.bincount(which, steps - one[which]) / count, which


def heun_step(
    rate: Callable[[At, FloatArray], FloatArray],
    now: At,
    then: At,
    z: FloatArray,
    h: float,
    parts: Sequence[Sequence[int]],
) -> FloatArray:
    """Predict, then correct part by part: a part takes those before it as corrected, the rest as predicted.

    Parameters
    ----------
    rate
        Of the states (n, …), at `now` and at `then`: times, or numbers of samples.
    z, h
        States now, and the length of the step.
    parts
        Of the rows of z.
    """
    k = rate(now, z)
    new: FloatArray = z + h * k
    for part in parts:
        new[part] = (z + h / 2 * (k + rate(then, new)))[part]
    return new


def stepwise(system: System, name: str) -> FloatArray:
    """States and sensitivities (n, size) by one step from sample to sample: of `HEUN`, or "rk4" as [F]."""
    parts = [system.rows(states) for states in HEUN[name](system.nx)] if name in HEUN else []
    table = np.full((len(system.t), len(system.first)), np.nan)
    table[0] = z = system.first
    for i, (now, then) in enumerate(pairwise(system.t.tolist()), start=1):
        h = then - now
        if parts:
            z = heun_step(system, now, then, z, h, parts)
        else:
            k1 = h * system(now, z)
            k2 = h * system(now + h / 2, z + k1 / 2)
            k3 = h * system(now + h / 2, z + k2 / 2)
            z = z + (k1 + 2 * k2 + 2 * k3 + h * system(then, z + k3)) / 6
        table[i] = z
        if not np.isfinite(z).all():
            break
    return table
