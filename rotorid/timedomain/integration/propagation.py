"""Exact solution of linear systems with constant coefficients, and its exact sensitivities."""

from __future__ import annotations

from itertools import groupby

import numpy as np

from rotorid.base.arrays import FloatArray, IndexArray
from rotorid.timedomain.integration.matrix_exponential import expm_and_derivatives, squared

SAME_STEP = 4e-15
"""Steps that differ by less than this share of the largest time are one step (rounded times)."""
BATCH = 2**22
"""Numbers in one batch of matrix exponentials."""


def propagate(
    times: FloatArray,
    z0: FloatArray,
    s0: FloatArray,
    system: FloatArray,
    derivatives: FloatArray,
) -> tuple[FloatArray, FloatArray]:
    """Solution of dz/dt = A z at given times.

    Parameters
    ----------
    times
        Shape (n,), increasing; z0 belongs to the first.
    z0, s0
        Initial values (m,) and their derivatives by the parameters (m, k).
    system, derivatives
        A (m, m) and ∂A/∂θ (k, m, m).

    Returns
    -------
    tuple
        z (n, m) and S = ∂z/∂θ (n, m, k); not finite where they overflow.
    """
    n, m, k = len(times), len(z0), s0.shape[1]
    # columns: z, then S, one beside the other
    table = np.zeros((n, m, 1 + k))
    table[0, :, 0], table[0, :, 1:] = z0, s0
    kinds, which = _distinct(np.diff(times), float(np.abs(times).max()))
    size = max(1, BATCH // ((1 + k) * m * m))
    ready: dict[int, tuple[FloatArray, FloatArray]] = {}
    with np.errstate(all="ignore"):
        at = 0
        for kind, run in groupby(which.tolist()):
            if kind not in ready:
                batch = kinds[kind : kind + size]
                p, d = expm_and_derivatives(
                    batch[:, None, None] * system, batch[:, None, None, None] * derivatives
                )
                ready = {kind + i: (p[i], d[i]) for i in range(len(batch))}
            steps = len(list(run))
            _fill(table[at : at + steps + 1], *ready[kind])
            at += steps
    return table[:, :, 0], table[:, :, 1:]


def propagate_driven(
    times: FloatArray,
    x0: FloatArray,
    s0: FloatArray,
    system: FloatArray,
    derivatives: FloatArray,
    drive: FloatArray,
) -> tuple[FloatArray, FloatArray]:
    """Solution of dx/dt = A x + b + B u with straight lines as inputs u.

    Parameters
    ----------
    times
        Shape (n,), increasing.
    x0, s0
        Initial values (n_x,) and their derivatives by the parameters (n_x, k).
    system, derivatives
        The matrix (m, m) of dz/dt for z = (x, drive), and its derivatives (k, m, m).
    drive
        The states behind x at the beginning of each step, (n − 1, m − n_x).

    Returns
    -------
    tuple
        x (n, n_x) and S (n, n_x, k); not finite where they overflow.
    """
    n, nx, k, m = len(times), len(x0), s0.shape[1], len(system)
    x, s = np.empty((n, nx)), np.empty((n, nx, k))
    x[0], s[0] = x0, s0
    kinds, which = _distinct(np.diff(times), float(np.abs(times).max()))
    size = max(1, BATCH // ((1 + k) * m * m))
    with np.errstate(all="ignore"):
        for low in range(0, n - 1, size):
            used, place = np.unique(which[low : low + size], return_inverse=True)
            h = kinds[used]
            p, d = expm_and_derivatives(h[:, None, None] * system, h[:, None, None, None] * derivatives)
            place = place.reshape(-1)
            step = p[place, :nx]
            w = drive[low : low + size]
            push = (step[:, :, nx:] @ w[:, :, None])[:, :, 0]
            step = step[:, :, :nx]
            for i in range(len(w)):
                x[low + i + 1] = step[i] @ x[low + i] + push[i]
            z = np.concatenate([x[low : low + len(w)], w], axis=1)
            bend = (d[place, :, :nx] @ z[:, None, :, None])[..., 0].transpose(0, 2, 1)
            for i in range(len(w)):
                s[low + i + 1] = step[i] @ s[low + i] + bend[i]
    return x, s


def _distinct(steps: FloatArray, largest: float) -> tuple[FloatArray, IndexArray]:
    """Distinct steps in order of appearance, and which one each step is."""
    if steps.size == 0:
        return steps, np.zeros(0, dtype=np.intp)
    if np.ptp(steps) <= SAME_STEP * largest:
        return np.array([steps.mean()]), np.zeros(len(steps), dtype=np.intp)
    order = np.argsort(steps, kind="stable")
    jumps = np.diff(steps[order]) > SAME_STEP * largest
    label = np.empty(len(steps), dtype=np.intp)
    label[order] = np.concatenate(([0], np.cumsum(jumps)))
    _, first, which = np.unique(label, return_index=True, return_inverse=True)
    means = np.bincount(label, weights=steps) / np.bincount(label)
    appearance = np.argsort(first, kind="stable")
    rank = np.empty_like(appearance)
    rank[appearance] = np.arange(len(appearance))
    return means[appearance], rank[which.reshape(-1)].astype(np.intp)


def _fill(table: FloatArray, p: FloatArray, d: FloatArray) -> None:
    """Equal steps from the first row on: with P, P², P⁴, … the rows known so far are doubled each time."""
    known, (n, m), k = 1, table.shape[:2], len(d)
    while known < n:
        bend = d.reshape(k * m, m)
        more = min(known, n - known)
        block = table[:more]
        new = table[known : known + more]
        new[:] = p @ block
        new[:, :, 1:] += (bend @ block[:, :, 0].T).reshape(k, m, more).transpose(2, 1, 0)
        known += more
        if known < n:
            p, d = squared(p, d)
