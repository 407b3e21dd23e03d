"""Modes from amplitudes around resonances, the measurements that [S] lesson 7 begins with.

At every point X = e (Σ_r R_r / (1 − (ω/ω_r)² + 2 i ζ_r ω/ω_r) + a + b / ω²): all points have the same ω_r and
ζ_r; e is the excitation, a and b stand for modes above and below the range. R, a and b are linear and
eliminated (variable projection), so the search has two parameters a mode.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from rotorid.base.arrays import AnyArray, ComplexArray, FloatArray


@dataclass(frozen=True, eq=False)
class Readings:
    """Amplitudes Z (n, P) under excitations (n,), and what whitens them (n, P, 2, 2)."""

    omega: FloatArray
    excitation: ComplexArray
    Z: ComplexArray
    root: FloatArray

    def basis(self, q: FloatArray) -> tuple[ComplexArray, ComplexArray]:
        """What R, a and b multiply (n, k + 2), and its slopes by q = (ω_r, ζ_r), (n, 2k)."""
        own, damping = np.split(q, 2)
        u, e = self.omega[:, None] / own, self.excitation[:, None]
        g = 1 / (1 - u**2 + 2j * damping * u)
        slopes = -np.tile(g**2, 2) * np.hstack(((2 * u**2 - 2j * damping * u) / own, 2j * u))
        return e * np.hstack((g, u[:, :1] ** 0, u[:, :1] ** -2)), e * slopes

    def point(self, p: int, q: FloatArray) -> tuple[AnyArray, ...]:
        """Of a point what R, a and b do not explain, its slopes, R, a and b, and their covariances."""
        seen = ~np.isnan(self.Z[:, p])

        def real(z: ComplexArray) -> FloatArray:
            parts = self.root[seen, p] @ np.stack((z[seen].real, z[seen].imag), axis=1)
            return np.asarray(parts.reshape(-1, z.shape[1]))

        columns, slopes = self.basis(q)
        design = real(np.stack((columns, 1j * columns), axis=-1).reshape(len(seen), -1))
        y, size = real(self.Z[:, [p]])[:, 0], design.shape[1]
        Q, R = np.linalg.qr(design, mode="complete")
        rest, inverse = Q[:, size:].T, np.linalg.inv(R[:size])
        c = (inverse @ (Q[:, :size].T @ y)).reshape(-1, 2) @ (1, 1j)
        spread = np.einsum("iaib->iab", (inverse @ inverse.T).reshape(len(c), 2, -1, 2))
        return rest @ y, -rest @ real(slopes * np.tile(c[: len(c) - 2], 2)), c, spread

    def without(self, omega: float, least: int) -> Readings:
        """Those but for the frequency next to this one; all, where a point would have fewer than `least`."""
        rest = self.omega != self.omega[np.abs(self.omega - omega).argmin()]
        if min(np.count_nonzero(~np.isnan(self.Z[rest]), axis=0)) < least:
            return self
        return Readings(self.omega[rest], self.excitation[rest], self.Z[rest], self.root[rest])

    def each(self, what: int, q: FloatArray) -> list[AnyArray]:
        """One of these for every point."""
        return [self.point(p, q)[what] for p in range(self.Z.shape[1])]

    def rows(self, what: int, q: FloatArray) -> AnyArray:
        """One of these of all points together."""
        return np.concatenate(self.each(what, q))
