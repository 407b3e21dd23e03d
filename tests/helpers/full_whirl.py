"""Whirl of the full model without reduction: slow, the check of the fast way."""

from __future__ import annotations

import numpy as np

from fem import reference, solve_modes
from fem.assembly import Planes, project
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
        whirl = solve_modes(Q, speeds, n, scale)
        there = np.isfinite(whirl.values[0])
        shapes = Q.expand(whirl.vectors[0, there])
        return whirl.values[0, there], shapes, whirl.real[0], int(whirl.still[0])
    return _arnoldi(P, speed, n, scale)


def _arnoldi(
    P: Planes, speed: float, n: int, scale: float
) -> tuple[ComplexArray, ComplexArray, FloatArray, int]:
    """Largest μ of the inverse form by Arnoldi's method, with sparse factors."""
    from scipy.sparse import csc_array
    from scipy.sparse.linalg import LinearOperator, eigs, splu

    Q = project(P, np.eye(P.A.size))
    D, K = Q.at(np.array([speed]))
    M, D, K = (csc_array(matrix) for matrix in (Q.M, D[0], K[0]))
    M, D = scale * scale * M, scale * D
    R = M.shape[0]
    lu = splu(csc_array(K + _SHIFT * D + _SHIFT**2 * M))
    D = D + 2 * _SHIFT * M

    def times(state: AnyArray) -> AnyArray:
        u, v = state[:R], state[R:]
        return np.concatenate((v, -lu.solve(np.asarray(M @ u + D @ v))))

    operator = LinearOperator((2 * R, 2 * R), matvec=times, dtype=K.dtype)
    wanted = (3 - P.planes if P.planes == 1 else 2) * n + 8
    while True:
        wanted = min(wanted, 2 * R - 2)
        start = np.cos(np.arange(2 * R)).astype(K.dtype)
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
