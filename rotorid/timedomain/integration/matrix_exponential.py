"""Exact solution of linear systems with constant coefficients by matrix exponentials, with sensitivities."""

from __future__ import annotations

import numpy as np

from rotorid.base.arrays import FloatArray, IndexArray

SAME_STEP = 4e-15
"""Steps that differ by less than this share of the largest time are one step (rounded times)."""
BATCH = 2**22
"""Numbers in one batch of matrix exponentials."""


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
    found = expm(blocks)
    return found[..., 0, :n, :n], found[..., :n, n:] / scale


def propagate(
    times: FloatArray,
    x0: FloatArray,
    s0: FloatArray,
    system: FloatArray,
    derivatives: FloatArray,
    drive: FloatArray,
) -> tuple[FloatArray, FloatArray]:
    """Solution of dz/dt = M z for z = (x, w), where w begins every step anew: 1, inputs and their slopes.

    Parameters
    ----------
    times
        Shape (n,), increasing.
    x0, s0
        Initial values (n_x,) and their derivatives by the parameters (n_x, k).
    system, derivatives
        M (m, m) and ∂M/∂θ (k, m, m).
    drive
        w at the beginning of each step, (n − 1, m − n_x).

    Returns
    -------
    tuple
        x (n, n_x) and S = ∂x/∂θ (n, n_x, k); not finite where they overflow.
    """
    n, nx, k, m = len(times), len(x0), s0.shape[1], len(system)
    moving = np.flatnonzero(derivatives.any(axis=(1, 2)))  # others act by the initial values alone
    slopes = derivatives[moving]
    x, s = np.empty((n, nx, 1)), np.empty((n, nx, k))
    x[0, :, 0], s[0] = x0, s0
    kinds, which = _distinct(np.diff(times), SAME_STEP * float(np.abs(times).max()))
    size = max(1, BATCH // ((1 + k) * m * m))
    with np.errstate(all="ignore"):
        for low in range(0, n - 1, size):
            part, now = slice(low + 1, low + 1 + size), slice(low, low + size)
            used, place = np.unique(which[now], return_inverse=True)
            h = kinds[used]
            P, D = expm_and_derivatives(h[:, None, None] * system, h[:, None, None, None] * slopes)
            if len(h) > 1:
                P, D = P[place], D[place]
            w = drive[now, :, None]
            x[part] = _recurrence(P[:, :nx, :nx], x[low], P[:, :nx, nx:] @ w)
            z = np.concatenate([x[low : low + len(w)], w], axis=1)
            bend = np.zeros((len(w), nx, k))
            bend[:, :, moving] = (D[:, :, :nx] @ z[:, None])[..., 0].swapaxes(1, 2)
            s[part] = _recurrence(P[:, :nx, :nx], s[low], bend)
    return x[:, :, 0], s


def _recurrence(P: FloatArray, first: FloatArray, push: FloatArray) -> FloatArray:
    """y_i = P_i y_{i−1} + push_i after `first`, (n, m, k), by doubling spans; P (n, m, m), or one for all."""
    y = push.copy()
    y[0] += P[0] @ first
    span = 1
    while span < len(y):
        y[span:] += _times(P[-len(y) + span :], y[:-span])
        P = P @ P if len(P) == 1 else np.concatenate([P[:span], P[span:] @ P[:-span]])
        span *= 2
    return y


def _times(P: FloatArray, y: FloatArray) -> FloatArray:
    """Matrices by matrices, one by one; one matrix by all of them at once."""
    if len(P) > 1:
        return P @ y
    return np.tensordot(y, P[0], (1, 1)).swapaxes(1, 2)


def _distinct(steps: FloatArray, tolerance: float) -> tuple[FloatArray, IndexArray]:
    """Steps that differ by more than the tolerance, and which of them each step is.

    Of those that differ by rounding it is their mean: an error of one would add up over the record.
    """
    kinds = np.round((steps - steps[:1]) / tolerance)
    _, first, which, count = np.unique(kinds, return_index=True, return_inverse=True, return_counts=True)
    one = steps[first]
    return one + np.bincount(which, steps - one[which]) / count, which
