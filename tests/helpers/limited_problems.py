"""Drawn problems of the weighted fit within limits, a global search of their objective by SciPy."""

from __future__ import annotations

from itertools import product

import numpy as np
from scipy.optimize import minimize

from balancing import Limits, solve
from balancing.limits_and_minmax import allowed_sectors


def drawn(seed):
    """Equations of 1–3 planes and 2–8 readings from trial runs, some of them weak, without limits."""
    rng = np.random.default_rng(seed)
    P = int(rng.integers(1, 4))
    N = int(rng.integers(max(P, 2), 9))
    amplitude, phase = rng.permutation([rng.uniform(0.03, 0.15), 10 ** rng.uniform(-2.7, -1)])

    def normal(*shape):
        return rng.standard_normal(shape) + 1j * rng.standard_normal(shape)

    W = normal(N, P)
    Y = W @ normal(P) + rng.choice([0.0, 0.3]) * normal(N)
    trial = rng.uniform(0.05, 0.8) * np.exp(2j * np.pi * rng.random(P))
    runs = np.column_stack((Y, Y[:, None] + W * trial))
    error = amplitude * rng.standard_normal(runs.shape) + 1j * phase * rng.standard_normal(runs.shape)
    runs *= 1 + error
    # Y and W as linear functions of the runs, with errors along and across each reading
    linear = np.zeros((P + 1, P + 1), dtype=complex)
    linear[0, 0] = 1
    linear[1:, 0], linear[1:, 1:] = -1 / trial, np.diag(1 / trial)
    out = runs @ linear.T
    channels = np.zeros((N, 2 * P + 2, 2 * P + 2))
    for p in range(P + 1):
        for way in (amplitude, 1j * phase):
            moved = linear[:, p] * (way * runs[:, p])[:, None]
            pairs = np.stack((moved.real, moved.imag), axis=2).reshape(N, -1)
            channels += pairs[:, :, None] * pairs[:, None]
    return out[:, 1:], out[:, 0], channels


def limited(W, Y, free, seed):
    """Limits that bind: of every weight, and sometimes of amplitudes and angles."""
    rng = np.random.default_rng([seed, 1])
    N, P = W.shape
    most = np.abs(free) * np.where(rng.random(P) < 0.7, rng.uniform(0.2, 0.95, P), 3.0)
    arcs = [()] * P
    if rng.random() < 0.4:
        at = rng.uniform(-np.pi, np.pi, P)
        arcs = [((np.angle(v) + a, w),) for v, a, w in zip(free, at, rng.uniform(0.3, 5, P), strict=True)]
    residual = np.full(N, np.inf)
    inside = [
        v * 0 if arc else 0.9 * m * np.exp(1j * np.angle(v))
        for v, m, arc in zip(free, most, arcs, strict=True)
    ]
    if rng.random() < 0.4:
        residual = np.abs(Y + W @ np.array(inside)) * rng.uniform(1.02, 2.0, N)
        residual[rng.random(N) < 0.4] = np.inf
    return Limits(most, residual[None], tuple(arcs))


def problem(seed):
    """W, Y, covariances of a drawn problem, those with the further error of the fit, and limits."""
    W, Y, channels = drawn(seed)
    free = solve(W, Y, "weighted", channels=channels)
    wider = channels.copy()
    wider[:, [0, 1], [0, 1]] += free.model_error**2
    return W, Y, channels, wider, limited(W, Y, free.weights, seed)


def global_search(objective_of, W, Y, limits, tries):
    """The least objective of SciPy's SLSQP from many starts for each plane, in every sector."""
    rng = np.random.default_rng(0)
    P, size = W.shape[1], limits.max_weight
    scale = np.repeat(size, 2)

    def objective(x):
        return objective_of(x * scale)

    best = np.inf
    on = np.isfinite(limits.residual.ravel())
    L = limits.residual.ravel()[on]
    for sectors in product(*[allowed_sectors(a) or ((None,) if not a else ()) for a in limits.forbidden]):
        sides = np.zeros((0, 2 * P))
        for p, sector in enumerate(sectors):
            for c in () if sector is None else (1j * np.exp(1j * sector[0]), -1j * np.exp(1j * sum(sector))):
                row = np.zeros(2 * P)
                row[2 * p : 2 * p + 2] = c.real, c.imag
                sides = np.vstack((sides, row))

        def kept(x, sides=sides):
            left = Y[on] + (W * size)[on] @ (x[::2] + 1j * x[1::2])
            return np.concatenate((1 - x[::2] ** 2 - x[1::2] ** 2, 1 - np.abs(left) ** 2 / L**2, sides @ x))

        for _ in range(tries * P):
            angle = [rng.uniform(0, 2 * np.pi) if s is None else s[0] + s[1] * rng.random() for s in sectors]
            z = np.sqrt(rng.random(P)) * np.exp(1j * np.array(angle))
            found = minimize(
                objective,
                z.view(float),
                constraints={"type": "ineq", "fun": kept},
                method="SLSQP",
                options={"ftol": 1e-13, "maxiter": 300},
            )
            if np.isfinite(found.fun) and kept(found.x).min(initial=0.0) >= -1e-9:
                best = min(best, float(found.fun))
    return best
