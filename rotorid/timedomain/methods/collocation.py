"""Linear differential equations dW/dt = A(t) W + B(t) by Chebyshev collocation between samples.

All intervals are solved at once, and then joined. They are halved until the last coefficients of their
polynomials are negligible. Source: Trefethen, "Spectral Methods in MATLAB" (2000).
"""

from __future__ import annotations

from collections.abc import Callable
from functools import partial

import numpy as np
from numpy.polynomial import chebyshev

from rotorid.base.arrays import FloatArray
from rotorid.timedomain.models.simulation_errors import SimulationError

Curve = Callable[[FloatArray], FloatArray]
"""Values (*B, …) at times (*B,)."""
Equations = Callable[[FloatArray], tuple[FloatArray, FloatArray]]
"""A (*B, n, n), or (n, n) where it is constant, and B (*B, n, k) at times (*B,)."""

DEGREE = 12
HALVINGS = 6
"""Of the intervals, at most."""
TAIL = 1e-9
"""Of the last two coefficients, relative to the largest value over time."""
BATCH = 2**23
"""Numbers in the matrices that are solved at once."""
LARGEST = 2**26
"""Numbers in a solution, at most."""


def solve_linear(equations: Equations, t: FloatArray, first: FloatArray) -> tuple[FloatArray, Curve]:
    """Solution with W(t[0]) = `first`, at the times and as a function of time.

    Parameters
    ----------
    equations
        A and B, smooth between the times.
    t
        Shape (n_t,), increasing, two at least.
    first
        Shape (n, k).

    Raises
    ------
    SimulationError
        No finite solution, or one that varies too fast.
    """
    n, k = first.shape
    for halving in range(HALVINGS + 1):
        edges = np.interp(np.arange((len(t) - 1) * 2**halving + 1) / 2**halving, np.arange(len(t)), t)
        if len(edges) * DEGREE * n * (k + n) > LARGEST:
            break
        with np.errstate(all="ignore"):
            table = _intervals(equations, edges, first)
            resolved = _resolved(table)
        if not np.isfinite(table).all():
            raise SimulationError(
                "the linearised equations have no finite solution; start from another trajectory"
            )
        if resolved:
            samples = np.concatenate([table[:: 2**halving, 0], table[-1:, -1]])
            return samples, partial(_between, edges=edges, table=table)
    raise SimulationError(
        "the linearised equations vary too fast between the samples; use levenberg-marquardt, or give more"
    )


def _intervals(equations: Equations, edges: FloatArray, first: FloatArray) -> FloatArray:
    """W at the nodes of each interval, (N, DEGREE + 1, n, k)."""
    h, (n, k), degree = np.diff(edges), first.shape, DEGREE
    A, B = equations(edges[:-1, None] + h[:, None] * NODES[1:])
    joined = np.kron(-SLOPES[1:, :1], np.eye(n))
    loads = (h[:, None, None, None] * B).reshape(len(h), degree * n, k)
    inner = np.kron(SLOPES[1:, 1:], np.eye(n))
    solved = np.empty((len(h), degree * n, n + k))
    if A.ndim == 2:
        kinds, which = np.unique(np.round(h, 15 - int(np.ceil(np.log10(h.max())))), return_inverse=True)
        for i, size in enumerate(kinds):
            inverse = _inverse(inner - size * np.kron(np.eye(degree), A))
            solved[which == i, :, :n] = inverse @ joined
            solved[which == i, :, n:] = inverse @ loads[which == i]
    else:
        some = max(1, BATCH // (degree * n) ** 2)
        for begin in range(0, len(h), some):
            part = slice(begin, begin + some)
            blocks = np.repeat(inner[None], len(h[part]), axis=0).reshape(-1, degree, n, degree, n)
            for j in range(degree):
                blocks[:, j, :, j, :] -= h[part, None, None] * A[part, j]
            inverse = _inverse(blocks.reshape(-1, degree * n, degree * n))
            solved[part, :, :n], solved[part, :, n:] = inverse @ joined, inverse @ loads[part]
    table = np.empty((len(h), degree + 1, n, k))
    w = first
    for i in range(len(h)):
        table[i, 0] = w
        w = solved[i, -n:, :n] @ w + solved[i, -n:, n:]
    table[:, 1:] = (solved[:, :, :n] @ table[:, 0] + solved[:, :, n:]).reshape(len(h), degree, n, k)
    return table


def _inverse(matrices: FloatArray) -> FloatArray:
    if not np.isfinite(matrices).all():
        return np.full_like(matrices, np.nan)
    try:
        return np.asarray(np.linalg.inv(matrices))
    except np.linalg.LinAlgError:
        return np.full_like(matrices, np.nan)


def _polynomials(at: FloatArray) -> FloatArray:
    """Chebyshev polynomials up to DEGREE over an interval, at shares 0 … 1 of it, (*B, DEGREE + 1)."""
    return np.asarray(chebyshev.chebvander(2 * at - 1, DEGREE), dtype=float)


def _resolved(table: FloatArray) -> bool:
    """Whether the last two Chebyshev coefficients are negligible everywhere."""
    tail = np.abs(np.einsum("cj,ijnk->icnk", COEFFICIENTS[-2:], table)).max(axis=(0, 1))
    size = np.abs(table).max(axis=(0, 1))
    return bool((tail <= TAIL * np.maximum(size, 1e-6 * size.max(axis=0))).all())


def _between(at: FloatArray, edges: FloatArray, table: FloatArray) -> FloatArray:
    """The polynomials at any times inside, (*B, n, k)."""
    times = np.ravel(at)
    i = np.clip(np.searchsorted(edges, times, side="right") - 1, 0, len(edges) - 2)
    share = (times - edges[i]) / (edges[i + 1] - edges[i])
    values = np.einsum("bj,bjnk->bnk", _polynomials(share) @ COEFFICIENTS, table[i])
    return np.asarray(values.reshape(*np.shape(at), *table.shape[2:]))


NODES = (1 - np.cos(np.pi * np.arange(DEGREE + 1) / DEGREE)) / 2
"""Shares of an interval where the equations hold."""
COEFFICIENTS = np.linalg.inv(_polynomials(NODES))
"""From values at the nodes to coefficients."""
SLOPES = 2 * chebyshev.chebval(2 * NODES - 1, chebyshev.chebder(np.eye(DEGREE + 1))).T @ COEFFICIENTS
"""From values at the nodes to derivatives there."""
