"""Coordinates that move no mass: how to find them, and which of them damping holds."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from rotorid.base.arrays import ComplexArray, FloatArray, IndexArray

ZERO = 1e-13  # share of the dynamic stiffness below which the damping of a massless coordinate is rounding
_SINGULAR = 1e-12
_FAR = 1e2  # ratio of neighbouring eigenvalues from which both ends are computed apart


def massive_first(M: FloatArray) -> tuple[IndexArray, int]:
    """The order that puts coordinates without mass last, and how many move mass.

    Raises
    ------
    ValueError
        If combinations of the others move no mass.
    """
    massive = M.any(axis=0) | M.any(axis=1)
    one, two = np.flatnonzero(massive), np.flatnonzero(~massive)
    block = M[np.ix_(one, one)]
    s = _equilibrating(np.abs(block))
    if np.linalg.matrix_rank(s[:, None] * block * s, tol=_SINGULAR) < one.size:
        raise ValueError(
            "the mass matrix is singular without a zero row (as with shear but without rotary inertia): "
            "there is no state space of it; give every combination of its coordinates mass"
        )
    return np.concatenate((one, two)), one.size


def eigenvalues(A: FloatArray) -> ComplexArray:
    """Of a matrix whose eigenvalues may lie far apart, from A and from A⁻¹, so that both ends keep digits.

    Little damping on a massless coordinate makes a very fast motion; from A alone the slow eigenvalues would
    have an error of 1e-16 of the fastest.
    """
    values = np.linalg.eigvals(A).astype(complex)
    values = values[np.argsort(np.abs(values), kind="stable")]
    size = np.abs(values)
    if len(size) < 2 or size[0] == 0:
        return values
    steps = size[1:] / size[:-1]
    slow = int(np.argmax(steps)) + 1
    if steps[slow - 1] < _FAR:
        return values
    row = 1 / np.abs(A).max(axis=1)
    inverse = np.linalg.eigvals(np.linalg.solve(row[:, None] * A, np.diag(row))).astype(complex)
    inverse = inverse[np.argsort(-np.abs(inverse), kind="stable")]
    return np.concatenate((1 / inverse[:slow], values[slow:]))


@dataclass(frozen=True, eq=False)
class Split:
    """Massless coordinates q₂ = Va a + Vb b, and the rows Uaᵀ, Ubᵀ that go with them.

    Attributes
    ----------
    Va, Vb, Ua, Ub
        Shapes (m, damped), (m, undamped), the same.
    names
        Of the damped ones.
    """

    Va: FloatArray
    Vb: FloatArray
    Ua: FloatArray
    Ub: FloatArray
    names: tuple[str, ...]


def split_by_damping(C: FloatArray, scale: FloatArray, omega: float, names: Sequence[str]) -> Split:
    """Split massless coordinates by the null spaces of their damping C, all scaled by `scale`, at `omega`."""
    block = omega * scale[:, None] * C * scale
    size = np.abs(block)
    touched = np.maximum(size, size.T).max(axis=1, initial=0.0) > ZERO
    on, off = np.flatnonzero(touched), np.flatnonzero(~touched)
    unit = np.diag(scale)
    W, sigma, Vt = np.linalg.svd(block[np.ix_(on, on)])
    rank = int(np.count_nonzero(sigma > ZERO))
    if rank == on.size:  # damped one by one: they stay what they are
        own = np.eye(len(scale))[:, on]
        return Split(own, unit[:, off], own, unit[:, off], tuple(names[int(i)] for i in on))
    V, U = (unit[:, on] @ np.where(np.abs(X) > ZERO, X, 0.0) for X in (Vt.T, W))
    return Split(
        V[:, :rank],
        np.hstack((V[:, rank:], unit[:, off])),
        U[:, :rank],
        np.hstack((U[:, rank:], unit[:, off])),
        tuple(f"damped{i + 1}" for i in range(rank)),
    )


def solved(inner: FloatArray, right: FloatArray) -> FloatArray:
    """The undamped massless coordinates b: inner b = right, where 1 is the scale of `inner`."""
    if inner.size and np.linalg.svd(inner, compute_uv=False)[-1] <= _SINGULAR:
        raise ValueError(
            "some massless coordinates are held neither by stiffness nor by damping, or move only with "
            "derivatives of the forces (an index above 1): there is no state space; give them mass, damping "
            "or stiffness"
        )
    return np.asarray(np.linalg.solve(inner, right))


def scales(M: FloatArray, C: FloatArray, K: FloatArray) -> tuple[FloatArray, float]:
    """Factors sᵢ that make the dynamic stiffness sᵢ sⱼ (|K| + ω |C| + ω² |M|) of order 1, and such an ω."""
    m, c, k = (np.abs(np.diag(matrix)) for matrix in (M, C, K))
    omega = 1.0
    for low, high, power in ((m, k, 0.5), (m, c, 1.0), (c, k, 1.0)):
        both = (low > 0) & (high > 0)
        if both.any():
            omega = float(np.median((high[both] / low[both]) ** power))
            break
    return _equilibrating(np.abs(K) + omega * np.abs(C) + omega**2 * np.abs(M)), omega


def _equilibrating(size: FloatArray) -> FloatArray:
    """Factors sᵢ for which the largest sᵢ sⱼ sizeᵢⱼ of each row or column is near 1 (Ruiz's iteration)."""
    size = np.maximum(size, size.T)
    s = np.ones(len(size))
    for _ in range(10):
        largest = (s[:, None] * size * s).max(axis=1, initial=0.0)
        s = s / np.sqrt(np.where(largest > 0, largest, 1.0))
    return s
