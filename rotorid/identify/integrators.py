"""Solutions of a model in time with their sensitivities S = ∂x/∂θ: exact for linear models, and plain steps.

Differentiating dx/dt = f(t, x, θ, u) by θ and exchanging the derivatives gives

    dS/dt = f_x S + f_θ,    S(t0) = ∂x0/∂θ                                      [F] (3.6)

A linear model with constant coefficients is solved exactly: its states, their sensitivities by the parameters
of A, b and B, and what drives them, w = (1, the inputs, their slopes), are one linear system

    dx/dt = A x + B w,    ds_j/dt = A s_j + A_j x + B_j w,    dw/dt = N w,

so that a matrix exponential leads from sample to sample. Other parameters act by the initial values alone.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from functools import lru_cache
from itertools import pairwise
from typing import Any, TypeVar

import numpy as np

from rotorid.base.arrays import FloatArray
from rotorid.identify.expression_functions import Compiled
from rotorid.identify.ode import OdeModel, SimulationError
from rotorid.identify.records import Record, inputs_of

UNROLLED = 300
"""Products in f_x S below which they are written out."""
BATCH = 2**18
"""Numbers in one batch of matrix exponentials."""
At = TypeVar("At", float, FloatArray)
HEUN: dict[str, Callable[[int], list[list[int]]]] = {
    "heun": lambda n: [list(range(n))],
    "sequential-heun": lambda n: [[i] for i in range(n)],
}
"""Euler's predictor and the trapezoidal corrector: numbers of the n states that each corrects together."""


class System:
    """Rates of z = [x | S], (n_x, 1 + k): the states and, if wanted (k = n_p), their sensitivities.

    Parameters
    ----------
    model, theta
        The model and its parameters (n_p,).
    record
        Times (n,) and inputs (n, n_u), straight lines between samples.
    sensitivities
        Whether S is part of the system.
    """

    def __init__(self, model: OdeModel, theta: FloatArray, record: Record, sensitivities: bool) -> None:
        self.model, self.theta, self.record = model, theta, record
        self.t, self.u = record.t, inputs_of(model, record)
        self.k = len(theta) if sensitivities else 0
        self.first = model.x0(theta)[:, : 1 + self.k]
        """z at the first time."""
        self.calls, self.most, self.latest = 0, np.inf, self.first
        """Rates asked for so far, and at most; for which states and sensitivities."""

    def __call__(self, time: float, z: FloatArray) -> FloatArray:
        """Rates, of the shape of z; flat for a flat one. SimulationError for one too many."""
        self.calls, self.latest = self.calls + 1, z
        if self.calls > self.most:
            raise SimulationError(
                f"the integration needs too many steps: it has come to t = {time:.6g} only, of "
                f"{self.t[-1]:.6g} s. Are the times in seconds, and not in ms? Choose other parameters or "
                "bounds, or lsoda (stiff models)"
            )
        u = [float(np.interp(time, self.t, column)) for column in self.u.T]
        if (rates := written_out(self.model, self.k)) is not None:
            return rates.one([time, *z.ravel().tolist(), *self.theta.tolist(), *u]).reshape(z.shape)
        x, n = z.reshape(self.first.shape), len(self.first)
        table = self.model.f(time, x[:, 0], self.theta, u)
        slopes = table[:, 1 : 1 + n] @ x[:, 1:] + table[:, 1 + n :][:, : self.k]
        return np.hstack((table[:, :1], slopes)).reshape(z.shape)


@lru_cache(maxsize=64)
def written_out(model: OdeModel, k: int) -> Compiled | None:
    """Rates of [x | S] with k sensitivities as one function, where the products of f_x S are few: quicker."""
    import sympy

    n, rates = len(model.states), sympy.Matrix(model.rates)
    if n**2 * (1 + k) >= UNROLLED or model.inertia:
        return None
    t, x, p, u = np.split(np.array(model.symbols), np.cumsum([1, n, len(model.start)]))
    S = sympy.Matrix(n, k, lambda *_: sympy.Dummy())
    slopes = rates.jacobian([*x]) * S + rates.jacobian([*p]) if k else S
    z = sympy.Matrix([*x]).row_join(S)
    return Compiled([*t, *z, *p, *u], [*rates.row_join(slopes)], (n, 1 + k))


def exact(system: System) -> FloatArray:
    """States and sensitivities (n, n_x, 1 + k) of a linear model; not finite where they overflow."""
    from scipy.linalg import expm

    n, nu = len(system.first), system.u.shape[1]
    tables = system.model.matrices(system.theta)[: 1 + system.k]
    sizes = np.maximum(np.abs(tables).max(axis=(1, 2)), 1e-300)
    still = sizes <= 1e-300
    still[0] = False
    moving, still = np.flatnonzero(~still), np.flatnonzero(still)
    # A_j as large as A: larger ones would cost digits
    scale, m = 2.0 ** np.round(np.log2(sizes[0] / sizes[moving]))[:, None, None], n * len(moving)
    M = np.eye(m + 1 + 2 * nu, k=nu)
    M[: m + 1] = 0.0
    parts = (tables[moving] * scale).reshape(m, -1)
    M[:m, :n], M[:m, m : m + 1 + nu] = parts[:, :n], parts[:, n:]
    for low in range(n, m, n):
        M[low : low + n, low : low + n] = tables[0, :, :n]
    lengths, which = system.record.steps
    w = np.hstack((system.u[:-1], np.diff(system.u, axis=0) / lengths[which, None]))
    z = np.zeros((1 + system.k, n, len(system.t)))
    z[..., 0], size, shape = system.first.T, max(1, BATCH // M.size), (m + 1, 1 + len(still))
    for low in range(0, len(which), size):
        back = slice(low, min(low + size, len(which)))
        rows = slice(low + 1, back.stop + 1)
        used = place = which[:1]
        if len(lengths) > 1:
            used, place = np.unique(which[back], return_inverse=True)
        P = expm(lengths[used, None, None] * M)[place]
        first, push = np.zeros(shape), np.zeros((back.stop - low, *shape))
        first[:, 0], first[:n, 1:] = np.append(z[moving, :, low, None] * scale, 1.0), z[still, :, low].T
        push[..., :1] = P[:, : m + 1, m + 1 :] @ w[back, :, None]
        solved = recurrence(P[:, : m + 1, : m + 1], first, push).T
        z[moving, :, rows] = solved[0, :m].reshape(len(moving), n, -1) / scale
        z[still, :, rows] = solved[1:, :n]
    return z.T


def recurrence(P: FloatArray, first: FloatArray, push: FloatArray) -> FloatArray:
    """y_i = P_i y_{i−1} + push_i after `first`, (n, m, k).

    P is (n, m, m), and the result stands in the place of `push`; or one for all, and spans are doubled.
    """
    n, m, k = push.shape
    if len(P) > 1:
        for i, A in enumerate(P):
            push[i] = first = A @ first + push[i]
        return push
    flat, driven, span = push.swapaxes(0, 1).copy().reshape(m, -1), push.any(), 1
    flat[:, :k] += P[0] @ first
    while span < n:
        new = flat[:, span * k :] if driven else flat[:, span * k : 2 * span * k]
        new += P[0] @ flat[:, : new.shape[1]]
        P, span = P @ P, 2 * span
    return flat.reshape(m, n, k).swapaxes(0, 1)


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
    new = z + h * k
    for part in parts:
        new[part] = (z + h / 2 * (k + rate(then, new)))[part]
    return new


def stepwise(system: System, name: str) -> FloatArray:
    """States and sensitivities (n, n_x, 1 + k), a step from sample to sample: of `HEUN`, or "rk4" as [F]."""
    table = np.full((len(system.t), *system.first.shape), np.nan)
    table[0] = z = system.first
    for i, (now, then) in enumerate(pairwise(system.t.tolist()), start=1):
        h = then - now
        if name in HEUN:
            z = heun_step(system, now, then, z, h, HEUN[name](len(z)))
        else:
            k1 = h * system(now, z)
            k2 = h * system(now + h / 2, z + k1 / 2)
            k3 = h * system(now + h / 2, z + k2 / 2)
            z = z + (k1 + 2 * k2 + 2 * k3 + h * system(then, z + k3)) / 6
        table[i] = z
        if not np.isfinite(z).all():
            break
    return table
