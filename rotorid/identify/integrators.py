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
from typing import Any, TypeVar

import numpy as np

from rotorid.base.arrays import FloatArray
from rotorid.identify.ode import OdeModel

SAME_STEP = 4e-15
"""Steps that differ by less than this share of the largest time are one step (rounded times)."""
BATCH = 2**22
"""Numbers in one batch of matrix exponentials."""
At = TypeVar("At", float, FloatArray)
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
        self.nx, self.np = len(model.states), len(theta) if sensitivities else 0
        table = model.x0(theta)[:, : 1 + self.np]
        self.first = np.concatenate([table[:, 0], table[:, 1:].reshape(-1)])
        """States and sensitivities at the first time."""
        self.steps = 0
        """Of an integration with error control."""

    def inputs(self, time: float) -> FloatArray:
        """Inputs at a time, (n_u,)."""
        return np.array([np.interp(time, self.t, column) for column in self.u.T])

    def __call__(self, time: float, z: FloatArray) -> FloatArray:
        """Rates, (size,)."""
        return self.model.augmented(time, z, self.theta, self.inputs(time))


def exact(system: System) -> FloatArray:
    """States and sensitivities (n, size) of a linear model; not finite where they overflow."""
    model, t, n, k = system.model, system.t, system.nx, system.np
    if not model.linear_driven:
        raise ValueError(
            "expm solves linear models with constant coefficients, without explicit time; use dop853, lsoda, "
            "or auto"
        )
    u = system.u[:, : system.u.shape[1] * model.driven]
    nu = u.shape[1]
    matrix = np.zeros((1 + k, n + 1 + 2 * nu, n + 1 + 2 * nu))
    matrix[:, :n, : n + 1 + nu] = model.matrices(system.theta)[: 1 + k, :, : n + 1 + nu]
    matrix[0, n + 1 : n + 1 + nu, n + 1 + nu :] = np.eye(nu)
    moving = np.flatnonzero(matrix[1:].any(axis=(1, 2)))  # others act by the initial values alone
    steps = np.diff(t)
    w = np.column_stack([np.ones(len(t) - 1), u[:-1], np.diff(u, axis=0) / steps[:, None]])[..., None]
    x, s = np.empty((len(t), n, 1)), np.empty((len(t), n, k))
    x[0, :, 0], s[0] = system.first[:n], system.first[n:].reshape(n, k)
    # of steps that differ by rounding the mean is taken: an error of one would add up over the record
    kinds = np.round((steps - steps[:1]) / (SAME_STEP * np.abs(t).max()))
    _, one, which, count = np.unique(kinds, return_index=True, return_inverse=True, return_counts=True)
    lengths = steps[one] + np.bincount(which, steps - steps[one][which]) / count
    size = max(1, BATCH // ((1 + k) * matrix[0].size))
    for low in range(0, len(steps), size):
        high = min(low + size, len(steps))
        used, place = np.unique(which[low:high], return_inverse=True)
        h = lengths[used][:, None, None]
        P, D = expm_and_derivatives(h * matrix[0], h[:, None] * matrix[1 + moving])
        if len(h) > 1:
            P, D = P[place], D[place]
        x[low + 1 : high + 1] = recurrence(P[:, :n, :n], x[low], P[:, :n, n:] @ w[low:high])
        z = np.concatenate([x[low:high], w[low:high]], axis=1)
        bend = np.zeros((high - low, n, k))
        bend[:, :, moving] = (D[:, :, :n] @ z[:, None])[..., 0].swapaxes(1, 2)
        s[low + 1 : high + 1] = recurrence(P[:, :n, :n], s[low], bend)
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

    if not np.isfinite(direction).all() or not np.isfinite(matrix).all():
        return np.full_like(matrix, np.nan), np.full_like(direction, np.nan)
    if not direction.size:
        return expm(matrix), direction
    n, A = matrix.shape[-1], matrix[..., None, :, :]
    # E as large as A: a larger one would cost digits of e^A
    sizes = [np.linalg.norm(part, axis=(-2, -1), keepdims=True) for part in (A, direction)]
    scale = np.where(sizes[0] * sizes[1] > 0, sizes[0] / np.maximum(sizes[1], 1e-300), 1.0)
    blocks = np.zeros((*direction.shape[:-2], 2 * n, 2 * n))
    blocks[..., :n, :n] = blocks[..., n:, n:] = A
    blocks[..., :n, n:] = scale * direction
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


def heun_step(
    rate: Callable[[At, FloatArray], FloatArray],
    now: At,
    then: At,
    z: FloatArray,
    h: At,
    parts: Sequence[Any],
) -> FloatArray:
    """Predict, then correct part by part: a part takes those before it as corrected, the rest as predicted.

    Parameters
    ----------
    rate
        Of the states, at `now` and at `then`: times, or whatever it takes for them.
    z, h
        States now, and the length of the step.
    parts
        Places in z.
    """
    k = rate(now, z)
    new: FloatArray = z + h * k
    for part in parts:
        new[part] = (z + h / 2 * (k + rate(then, new)))[part]
    return new


def stepwise(system: System, name: str) -> FloatArray:
    """States and sensitivities (n, size) by one step from sample to sample: of `HEUN`, or "rk4" as [F]."""
    n, k = system.nx, system.np
    # of each part the states, and their sensitivities
    parts = [
        [*part, *(n + k * i + j for i in part for j in range(k))]
        for part in (HEUN[name](n) if name in HEUN else [])
    ]
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
