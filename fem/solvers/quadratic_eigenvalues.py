"""Eigenvalues of small quadratic problems λ² M + λ D + K, many at a time.

Low frequencies are wanted, and some mass may be zero (a massless pedestal, a massless shaft). Hence the
inverse form: with λ = σ + 1/μ the problem is μ² K_σ + μ D_σ + M with K_σ = K + σ D + σ² M and
D_σ = D + 2 σ M, and the slowest modes are the largest μ, which come out with all digits. The shift σ > 0
leaves room for the rigid-body modes of a free rotor.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from fem.matrices.lateral_planes import Quadratic
from rotorid.base.arrays import AnyArray, BoolArray, ComplexArray, FloatArray, IndexArray

NONE = complex(np.nan, np.nan)  # no mode: neither part of it may pass for a number
_SHIFT = 0.3  # σ in units of the reference frequency
_STILL = 1e-6  # |λ| below this part of the reference frequency is a rigid-body motion
_REAL = 0.1  # |Im λ| below this part of |λ| is no oscillation: log decrement above 62
_INFINITE = 1e-6  # |μ| below this part of the largest: no mass moves, or too little to be of interest
_QUIET = 1e-6  # |Re λ| below this part of |λ| comes from work, not from the eigenvalue, which has rounding
_CLOSE = 1e-6  # relative gap of eigenvalues whose vectors inverse iteration would mix


@dataclass(frozen=True, eq=False)
class Solutions:
    """Oscillating modes at each speed, by rising frequency; padded with NaN where there are fewer.

    What decays to nothing within a fraction of a turn (damping ratio above 0.995) does not oscillate: such
    motions are overdamped but for rounding, or at rest in the turning shaft, where its material damps them.

    Attributes
    ----------
    values
        λ, rad/s, shape (S, m). In two planes Im λ > 0; of a complex coordinate Im λ < 0 is backward whirl.
    vectors
        In the basis, scaled to length 1, shape (S, m, R).
    left
        Left vectors, where they are no mirror images of the right ones and were asked for; else None.
    real
        Eigenvalues of motions that do not oscillate, rad/s, slowest first, one array per speed.
    still
        How many rigid-body motions without stiffness there are at each speed, shape (S,).
    """

    values: ComplexArray
    vectors: ComplexArray
    left: ComplexArray | None
    real: tuple[FloatArray, ...]
    still: IndexArray


def solve(Q: Quadratic, speeds: FloatArray, m: int, scale: float, *, left: bool = False) -> Solutions:
    """The m modes of lowest frequency at each speed.

    Parameters
    ----------
    Q
        The problem.
    speeds
        rad/s, shape (S,).
    m
        How many modes.
    scale
        A frequency of the order of the lowest, rad/s.
    left
        Find left vectors, too, unless they are mirror images.
    """
    D, K = Q.at(speeds)
    A = _companion(Q.M, D, K, scale)
    mu = np.asarray(np.linalg.eigvals(A), dtype=complex)
    values, real, still = _sorted(mu, scale, m, Q.P.planes)
    there = np.isfinite(values)
    vectors = np.full((*values.shape, Q.size), NONE)
    vectors[there] = _inverse_iteration(Q.M, D, K, values, there)
    others = None
    if left and not Q.P.mirrored(speeds):
        others = np.full_like(vectors, NONE)
        others[there] = _inverse_iteration(Q.M, np.swapaxes(D, 1, 2), np.swapaxes(K, 1, 2), values, there)
    for k in _degenerate(values):
        vectors[k] = _by_elimination(A[k], values[k], scale, Q.size)
    values[there] = _by_work(Q.M, D, K, np.nonzero(there)[0], values[there], vectors[there])
    return Solutions(values, vectors, others, real, still)


def all_values(Q: Quadratic, speeds: FloatArray, scale: float) -> tuple[ComplexArray, BoolArray]:
    """All eigenvalues at each speed, shape (S, 2 R), and which of them belong to motions that oscillate.

    Motions without mass, and rigid-body motions without stiffness, count as −scale.
    """
    D, K = Q.at(speeds)
    lam, finite = _values(np.asarray(np.linalg.eigvals(_companion(Q.M, D, K, scale)), dtype=complex), scale)
    size = np.abs(lam)
    moving = finite & (size >= _STILL * scale)
    oscillates = moving & (np.abs(lam.imag) > _REAL * size)
    quiet = oscillates & (np.abs(lam.real) < _QUIET * size)
    for k in np.flatnonzero(quiet.any(axis=1)):
        one = slice(k, k + 1)
        vectors = _inverse_iteration(Q.M, D[one], K[one], lam[one], quiet[one])
        lam[k, quiet[k]] = _by_work(
            Q.M, D[one], K[one], np.zeros(len(vectors), int), lam[k, quiet[k]], vectors
        )
    return np.where(moving, lam, -scale), oscillates


def polish(
    Q: Quadratic,
    speeds: FloatArray,
    at: IndexArray,
    values: ComplexArray,
    vectors: ComplexArray,
    steps: int,
    left: ComplexArray | None = None,
) -> tuple[ComplexArray, ComplexArray, FloatArray]:
    """Improve single eigenpairs by inverse iteration.

    Parameters
    ----------
    Q, speeds
        The problem, rad/s.
    at
        Which speed each pair belongs to, shape (B,).
    values, vectors
        Shapes (B,) and (B, R).
    steps
        How many; each squares the error, or more where left vectors are known.
    left
        Left vectors, shape (B, R); not needed where they are mirror images.

    Returns
    -------
    values, vectors
        Improved; vectors of length 1.
    last
        Relative change of the values by the last step, shape (B,).
    """
    used, at = np.unique(at, return_inverse=True)
    D, K = Q.at(speeds[used])
    step = np.zeros(values.shape, dtype=complex)
    mirrored = Q.P.mirrored(speeds[used])
    for _ in range(steps):
        P = _dynamic(Q.M, D, K, at, values)
        right = _rows(D, at, vectors) + 2 * values[:, None] * (vectors @ Q.M)
        new = _nearly_singular(P, right[:, :, None])[:, :, 0]
        test = vectors.conj()
        if mirrored:
            left = Q.mirror(vectors)
        if left is not None:
            test = _rows(np.swapaxes(D, 1, 2), at, left) + 2 * values[:, None] * (left @ Q.M)
        step = np.einsum("br,br->b", test, vectors) / np.einsum("br,br->b", test, new)
        values = values - step
        vectors = new / np.linalg.norm(new, axis=1)[:, None]
    return _by_work(Q.M, D, K, at, values, vectors), vectors, np.abs(step) / np.abs(values)


def _by_work(
    M: FloatArray, D: AnyArray, K: AnyArray, at: IndexArray, values: ComplexArray, vectors: ComplexArray
) -> ComplexArray:
    """Values whose small real parts have the digits of what damps and drives them, however little that is.

    With λ = σ + iω the imaginary part of xᴴ (λ² M + λ D + K) x = 0 is 2 σ ω m + ω Re d + σ Im d + Im k = 0:
    what does no work over an orbit, however large, is not in it.
    """
    values = values.copy()
    quiet = np.abs(values.real) < _QUIET * np.abs(values)
    for k in np.unique(at[quiet]):
        mine = np.flatnonzero(quiet & (at == k))
        X, omega = vectors[mine], values[mine].imag

        def form(A: AnyArray, X: ComplexArray = X) -> ComplexArray:
            return np.asarray(np.einsum("br,br->b", X.conj(), X @ A.T))

        damping, driving = form((D[k] + D[k].conj().T) / 2).real, form((K[k] - K[k].conj().T) / 2).imag
        inertia = 2 * omega * form(M).real + form((D[k] - D[k].conj().T) / 2).imag
        values[mine] = -(omega * damping + driving) / inertia + 1j * omega
    return values


def _dynamic(M: FloatArray, D: AnyArray, K: AnyArray, at: IndexArray, values: ComplexArray) -> ComplexArray:
    """λ² M + λ D + K for each pair, shape (B, R, R)."""
    R = len(M)
    P = np.empty((values.size, R, R), dtype=complex)
    square = values * values
    if np.iscomplexobj(D):
        for b, k in enumerate(at):
            np.multiply(D[k], values[b], out=P[b])
            P[b] += K[k]
            P[b] += square[b] * M
        return P
    # Real matrices: half of the work in real and imaginary parts, and products that stay in the cache.
    for k in range(len(D)):
        mine = np.flatnonzero(at == k)
        terms = np.stack((M.ravel(), D[k].ravel(), K[k].ravel()))
        lam, lam2 = values[mine], square[mine]
        P.real[mine] = (np.stack((lam2.real, lam.real, np.ones(mine.size)), axis=1) @ terms).reshape(-1, R, R)
        P.imag[mine] = (np.stack((lam2.imag, lam.imag), axis=1) @ terms[:2]).reshape(-1, R, R)
    return P


def _rows(D: AnyArray, at: IndexArray, vectors: ComplexArray) -> ComplexArray:
    """D x for each pair."""
    out = np.empty_like(vectors)
    for k in range(len(D)):
        mine = at == k
        out[mine] = vectors[mine] @ D[k].T
    return out


def _companion(M: FloatArray, D: AnyArray, K: AnyArray, scale: float) -> AnyArray:
    R = len(M)
    M, D = scale * scale * M, scale * D
    X = np.linalg.solve(
        K + _SHIFT * D + _SHIFT**2 * M,
        np.concatenate((np.broadcast_to(M, D.shape), D + 2 * _SHIFT * M), axis=2),
    )
    A = np.zeros((len(D), 2 * R, 2 * R), dtype=D.dtype)
    A[:, :R, R:] = np.eye(R)
    A[:, R:] = -X
    return A


def _values(mu: ComplexArray, scale: float) -> tuple[ComplexArray, BoolArray]:
    """λ from μ, and which are finite."""
    # Motions without mass have μ = 0, as double eigenvalues that rounding turns into the root of its size.
    finite = np.abs(mu) > _INFINITE * np.abs(mu).max(axis=1)[:, None]
    return np.asarray(scale * (_SHIFT + 1 / np.where(finite, mu, 1.0))), np.asarray(finite)


def _sorted(
    mu: ComplexArray, scale: float, m: int, planes: int
) -> tuple[ComplexArray, tuple[FloatArray, ...], IndexArray]:
    """Values of the m lowest oscillating modes, and what does not oscillate."""
    lam, finite = _values(mu, scale)
    size = np.abs(lam)
    still = finite & (size < _STILL * scale)
    oscillates = finite & ~still & (np.abs(lam.imag) > _REAL * size)
    at_rest = finite & ~still & ~oscillates
    if planes == 2:
        oscillates &= lam.imag > 0
    key = np.where(oscillates, np.abs(lam.imag), np.inf)
    order = np.argsort(key, axis=1, kind="stable")[:, :m]
    values = np.take_along_axis(lam, order, axis=1)
    values[~np.isfinite(np.take_along_axis(key, order, axis=1))] = NONE
    if values.shape[1] < m:
        values = np.pad(values, ((0, 0), (0, m - values.shape[1])), constant_values=NONE)
    real = tuple(np.asarray(np.sort(lam.real[k, at_rest[k]])[::-1], dtype=float) for k in range(len(mu)))
    return np.asarray(values), real, np.asarray(still.sum(axis=1), dtype=np.intp)


def _inverse_iteration(
    M: FloatArray,
    D: AnyArray,
    K: AnyArray,
    values: ComplexArray,
    there: BoolArray,
) -> ComplexArray:
    k, _ = np.nonzero(there)
    P = _dynamic(M, D, K, k, values[there])
    R = len(M)
    # Something of every unknown, so that no mode is left out.
    start = np.exp(1j * np.arange(R) ** 1.5)[None, :, None]
    x = _nearly_singular(P, np.broadcast_to(start, (len(k), R, 1)))[:, :, 0]
    return np.asarray(x / np.linalg.norm(x, axis=1)[:, None])


def _nearly_singular(P: ComplexArray, b: ComplexArray) -> ComplexArray:
    """Solve with matrices at an eigenvalue; one that is singular to the last bit is moved by rounding."""
    try:
        return np.asarray(np.linalg.solve(P, b))
    except np.linalg.LinAlgError:
        R = P.shape[-1]
        size = np.abs(P).max(axis=(1, 2))[:, None, None]
        return np.asarray(np.linalg.solve(P + 1e-14 * size * np.eye(R), b))


def _degenerate(values: ComplexArray) -> list[int]:
    """Speeds at which two eigenvalues nearly coincide."""
    gap = np.abs(values[:, :, None] - values[:, None, :])
    size = np.abs(values)[:, :, None]
    m = values.shape[1]
    near = (gap < _CLOSE * size) & ~np.eye(m, dtype=bool)
    return [int(k) for k in np.flatnonzero(near.any(axis=(1, 2)))]


def _by_elimination(A: AnyArray, values: ComplexArray, scale: float, R: int) -> ComplexArray:
    """Vectors from all eigenvectors of the companion matrix, independent even where values coincide."""
    mu, X = np.linalg.eig(A)
    vectors = np.full((len(values), R), NONE)
    free = np.ones(len(mu), dtype=bool)
    for j, value in enumerate(values):
        if not np.isfinite(value):
            continue
        distance = np.abs(mu - 1 / (value / scale - _SHIFT))
        i = int(np.argmin(np.where(free, distance, np.inf)))
        free[i] = False
        # The half with the factor μ is as good; the larger one is more accurate.
        x = X[:R, i] if np.linalg.norm(X[:R, i]) >= np.linalg.norm(X[R:, i]) else X[R:, i]
        vectors[j] = x / np.linalg.norm(x)
    return vectors
