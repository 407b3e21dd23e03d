"""The matrix exponential and its derivatives, for many matrices at once.

Scaling and squaring with the Padé approximant of degree 13, differentiated by the product rule (Al-Mohy and
Higham, "Computing the Fréchet derivative of the matrix exponential", 2009): exact to rounding.
"""

from __future__ import annotations

import math

import numpy as np

from rotorid.base.arrays import FloatArray

Pair = tuple[FloatArray, FloatArray]
"""A matrix and its derivatives."""

_B = (
    64764752532480000.0, 32382376266240000.0, 7771770303897600.0, 1187353796428800.0, 129060195264000.0,
    10559470521600.0, 670442572800.0, 33522128640.0, 1323241920.0, 40840800.0, 960960.0, 16380.0, 182.0, 1.0,
)  # fmt: skip
_LARGEST = 4.74
"""Norm up to which degree 13 gives the exponential and its derivative to rounding."""


def expm_and_derivatives(matrix: FloatArray, direction: FloatArray) -> tuple[FloatArray, FloatArray]:
    """e^A and its derivatives in directions E.

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
    with np.errstate(all="ignore"):
        norm = float(np.abs(matrix).sum(axis=-2).max(initial=0.0))
        if not math.isfinite(norm) or not np.isfinite(direction).all():
            return np.full_like(matrix, np.nan), np.full_like(direction, np.nan)
        squarings = max(0, math.ceil(math.log2(norm / _LARGEST))) if norm > _LARGEST else 0
        if squarings > 1000:
            return np.full_like(matrix, np.nan), np.full_like(direction, np.nan)
        a, e = matrix / 2.0**squarings, direction / 2.0**squarings
        p, d = _pade(a, e)
        for _ in range(squarings):
            p, d = squared(p, d)
    return p, d


def squared(p: FloatArray, d: FloatArray) -> tuple[FloatArray, FloatArray]:
    """P² and its derivatives, from P and its derivatives."""
    return _product((p, d), (p, d))


def _product(
    x: tuple[FloatArray, FloatArray], y: tuple[FloatArray, FloatArray]
) -> tuple[FloatArray, FloatArray]:
    return x[0] @ y[0], x[1] @ y[0][..., None, :, :] + x[0][..., None, :, :] @ y[1]


def _pade(a: FloatArray, e: FloatArray) -> tuple[FloatArray, FloatArray]:
    n = a.shape[-1]
    one = np.eye(n)
    a2 = _product((a, e), (a, e))
    a4 = _product(a2, a2)
    a6 = _product(a2, a4)
    powers = (a2, a4, a6)

    def combine(b0: float, b2: float, b4: float, b6: float) -> tuple[FloatArray, FloatArray]:
        """A polynomial in A², and its derivatives."""
        value, slope = (sum(b * p[i] for b, p in zip((b2, b4, b6), powers, strict=True)) for i in (0, 1))
        return np.asarray(value + b0 * one), np.asarray(slope)

    def plus(x: Pair, y: Pair) -> Pair:
        return x[0] + y[0], x[1] + y[1]

    odd = plus(_product(a6, combine(0.0, _B[9], _B[11], _B[13])), combine(_B[1], _B[3], _B[5], _B[7]))
    u, du = _product((a, e), odd)
    v, dv = plus(_product(a6, combine(0.0, _B[8], _B[10], _B[12])), combine(_B[0], _B[2], _B[4], _B[6]))
    inverse = np.linalg.inv(v - u)  # well conditioned below the largest norm
    p = inverse @ (v + u)
    d = inverse[..., None, :, :] @ (du + dv - (dv - du) @ p[..., None, :, :])
    return p, d
