"""The full model at one complex frequency: a banded factorisation of both planes together.

The unknowns of x and y alternate, so that the band is twice as wide as in one plane. Pedestals are condensed
into their bearings.
"""

from __future__ import annotations

import numpy as np

from fem.matrices.banded_matrices import multiply
from fem.matrices.lateral_planes import Planes
from rotorid.base.arrays import AnyArray, ComplexArray, FloatArray


class WholeBand:
    """Banded templates of the full model, made once for all speeds."""

    def __init__(self, P: Planes) -> None:
        self.P = P
        A, p = P.A, P.planes
        self.reach = p * A.width + p - 1  # entries beside the diagonal
        self.size = p * A.size
        self.M, self.B = self._along(A.mass), self._along(A.material)
        self.K = self._along(A.shaft)
        self.G = self._across(A.gyroscopic) if A.gyroscopic.any() else None
        self.circulating = self._across(A.material) if A.material.any() else None

    def factor(self, value: complex, speed: float) -> Factored:
        """LU factors of λ² M + λ D + K at one λ and speed."""
        from scipy.linalg.lapack import zgbtrf

        band = value * value * self.M + value * self.B + self.K
        if self.G is not None:
            band += value * speed * self.G
        if self.circulating is not None:
            band += speed * self.circulating
        p = self.P.planes
        for matrix, row in zip(self._supports(value, speed), self.P.rows, strict=True):
            for a in range(p):
                for b in range(p):
                    band[2 * self.reach + a - b, p * row + b] += matrix[a, b]
        lu, pivots, info = zgbtrf(band, self.reach, self.reach)
        if info > 0:  # singular to the last bit: an eigenvalue
            lu[2 * self.reach, info - 1] = 1e-16 * np.abs(self.K).max()
        return Factored(self.reach, lu, pivots)

    def inertia(self, X: AnyArray) -> ComplexArray:
        """M x of shaft motions (planes, size), in the order of the band."""
        return self.interleaved(multiply(self.P.A.mass, X.T).T)

    def interleaved(self, X: AnyArray) -> ComplexArray:
        """From (…, planes, size) to the order of the band, (…, planes · size)."""
        return np.asarray(np.swapaxes(X, -1, -2).reshape(*X.shape[:-2], self.size).astype(complex))

    def planes(self, X: AnyArray) -> AnyArray:
        """Back to (…, planes, size)."""
        p = self.P.planes
        return np.asarray(np.swapaxes(X.reshape(*X.shape[:-1], self.size // p, p), -1, -2))

    def _supports(self, value: complex, speed: float) -> ComplexArray:
        """Dynamic stiffness of the supports with pedestals at λ, shape (s, p, p)."""
        P = self.P
        K, C = P.supports(np.array([speed]))
        k = K[0] + value * C[0]
        for j, i in enumerate(P.pedestals):
            stand = np.diag(
                P.pedestal_stiffness[j] + value * P.pedestal_damping[j] + value**2 * P.pedestal_mass[j]
            )
            k[i] = k[i] - k[i] @ np.linalg.solve(k[i] + stand, k[i])
        return np.asarray(k)

    def _along(self, band: FloatArray) -> ComplexArray:
        full = self._empty()
        for plane in range(self.P.planes):
            self._set(full, band, plane, plane, 1.0)
        return full

    def _across(self, band: FloatArray) -> ComplexArray:
        full = self._empty()
        if self.P.planes == 1:
            self._set(full, band, 0, 0, -1j)
        else:
            self._set(full, band, 0, 1, 1.0)
            self._set(full, band, 1, 0, -1.0)
        return full

    def _empty(self) -> ComplexArray:
        # Fortran order: what LAPACK takes without a copy.
        return np.zeros((3 * self.reach + 1, self.size), dtype=complex, order="F")

    def _set(self, full: ComplexArray, band: FloatArray, a: int, b: int, factor: complex) -> None:
        """Put a symmetric band into block (a, b)."""
        p, width, n = self.P.planes, self.P.A.width, self.P.A.size
        for off in range(-width, width + 1):  # row − column, in one plane
            entries = band[width - abs(off)]
            values = np.zeros(n)
            if off <= 0:
                values[-off:] = entries[-off:]
            else:
                values[: n - off] = entries[off:]
            full[2 * self.reach + p * off + a - b, b::p] += factor * values


class Factored:
    """Solutions with one factored matrix."""

    def __init__(self, reach: int, lu: ComplexArray, pivots: AnyArray) -> None:
        self._reach, self._lu, self._pivots = reach, lu, pivots

    def solve(self, b: ComplexArray, *, transposed: bool = False) -> ComplexArray:
        """P⁻¹ b, or P⁻ᵀ b, for b of shape (size,) or (size, m)."""
        from scipy.linalg.lapack import zgbtrs

        x, _ = zgbtrs(self._lu, self._reach, self._reach, b, self._pivots, trans=int(transposed))
        return np.asarray(x)
