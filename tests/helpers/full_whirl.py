"""Whirl of the full model without reduction: slow, the check of the fast way."""

from __future__ import annotations

import itertools
from typing import Any

import numpy as np

from fem._new.assembly import Planes, project
from fem._new.whirl import reference, solve
from rotorid.base.arrays import AnyArray, ComplexArray, FloatArray

_DENSE = 400  # unknowns of both planes up to which all eigenvalues are computed
_SHIFT = 0.3


def exact_modes(P: Planes, speed: float, n: int) -> tuple[ComplexArray, ComplexArray, FloatArray, int]:
    """The n oscillating modes of lowest frequency.

    Returns
    -------
    values, vectors
        Shapes (n,) and (n, planes, size); fewer where fewer oscillate.
    real
        Eigenvalues of motions that do not oscillate; of large models those near the lowest modes.
    still
        Number of rigid-body motions.
    """
    speeds = np.array([speed])
    scale = reference(P, speeds, 1)[1]
    if P.planes * P.A.size <= _DENSE:
        Q = project(P, np.eye(P.A.size))
        whirl = solve(Q, speeds, n, scale)
        there = np.isfinite(whirl.values[0])
        shapes = Q.expand(whirl.vectors[0, there])
        return whirl.values[0, there], shapes, whirl.real[0], int(whirl.still[0])
    return _arnoldi(P, speed, n, scale)


def _arnoldi(
    P: Planes, speed: float, n: int, scale: float
) -> tuple[ComplexArray, ComplexArray, FloatArray, int]:
    """Largest μ of the inverse form by Arnoldi's method, with sparse factors."""
    from scipy.sparse import coo_array, csc_array
    from scipy.sparse.linalg import LinearOperator, eigs, splu

    M, D, K = (csc_array(coo_array(matrix)) for matrix in _sparse(P, speed))
    M, D = scale * scale * M, scale * D
    R = M.shape[0]
    lu = splu(csc_array(K + _SHIFT * D + _SHIFT**2 * M))
    D = D + 2 * _SHIFT * M

    def times(state: AnyArray) -> AnyArray:
        u, v = state[:R], state[R:]
        return np.concatenate((v, -lu.solve(np.asarray(M @ u + D @ v))))

    operator = LinearOperator((2 * R, 2 * R), matvec=times, dtype=P.dtype)
    wanted = (3 - P.planes if P.planes == 1 else 2) * n + 8
    while True:
        wanted = min(wanted, 2 * R - 2)
        start = np.cos(np.arange(2 * R)).astype(P.dtype)
        mu, states = eigs(
            operator, k=wanted, which="LM", v0=start, ncv=min(2 * R, 3 * wanted + 20), maxiter=10000
        )
        lam = scale * (_SHIFT + 1 / mu)
        reach = np.abs(lam - _SHIFT * scale).max()  # all eigenvalues nearer to the shift than this are known
        still = np.abs(lam) < 1e-6 * scale
        oscillates = ~still & (np.abs(lam.imag) > 0.1 * np.abs(lam))
        keep = np.flatnonzero(oscillates & (lam.imag > 0) if P.planes == 2 else oscillates)
        keep = keep[np.argsort(np.abs(lam[keep].imag))]
        enough = len(keep) >= n and np.abs(lam[keep[:n]] - _SHIFT * scale).max() < 0.7 * reach
        if enough or wanted == 2 * R - 2:
            break
        wanted = 2 * wanted
    keep = keep[:n]
    size = P.planes * P.A.size
    vectors = states[:size, keep].T.reshape(len(keep), P.planes, P.A.size)
    real = lam.real[~still & ~oscillates]
    return lam[keep], np.asarray(vectors), np.sort(real)[::-1], int(still.sum())


def _sparse(P: Planes, speed: float) -> tuple[Any, Any, Any]:
    """M, D and K of the full model."""
    from scipy.sparse import block_array, coo_array

    A, p, f, n = P.A, P.planes, len(P.pedestals), P.A.size

    M, G, B, K = (_full(band) for band in (A.mass, A.gyroscopic, A.material, A.shaft))
    feet = P.pedestal_mass, P.pedestal_damping, P.pedestal_stiffness
    across = [D * speed for D in (0 * M, G, B)]
    out = []
    k, c = (matrix[0] for matrix in P.supports(np.array([speed])))
    for along, cross, foot, tie in zip((M, B, K), across, feet, (0 * k, c, k), strict=True):
        blocks = [[along, cross], [-cross, along]] if p == 2 else [[along - 1j * cross]]
        shaft = block_array(blocks)
        entries: list[tuple[int, int, complex]] = []
        standing = {int(i): j for j, i in enumerate(P.pedestals)}
        for i, node in enumerate(P.rows):
            # Motion of the node, and against it that of the foot.
            ends = [(1.0, [plane * n + int(node) for plane in range(p)])]
            if i in standing:
                ends.append((-1.0, [p * n + plane * f + standing[i] for plane in range(p)]))
            for (s, at), (t, other) in itertools.product(ends, ends):
                for a, b in itertools.product(range(p), range(p)):
                    entries.append((at[a], other[b], s * t * tie[i, a, b]))
        for j, plane in itertools.product(range(f), range(p)):
            own = p * n + plane * f + j
            entries.append((own, own, foot[j, plane]))
        size = p * (n + f)
        row, column, entry = zip(*entries, strict=True) if entries else ((), (), ())
        attached = coo_array((np.array(entry, dtype=P.dtype), (row, column)), shape=(size, size))
        shaft = coo_array(shaft)
        shaft = coo_array((shaft.data, (shaft.row, shaft.col)), shape=(size, size))
        out.append(shaft + attached)
    return out[0], out[1], out[2]


def _full(band: FloatArray) -> Any:
    """Sparse symmetric matrix of an upper band."""
    from scipy.sparse import diags_array

    width, size = len(band) - 1, band.shape[1]
    width = min(width, size - 1)
    rows = [band[len(band) - 1 - above, above:] for above in range(width + 1)]
    offsets = list(range(width + 1))
    return diags_array(rows + rows[1:], offsets=offsets + [-k for k in offsets[1:]], shape=(size, size))
