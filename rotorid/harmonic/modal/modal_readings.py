"""Modes from amplitudes around resonances, the measurements that [S] lesson 7 begins with.

At every point X = Σ_r R_r g_r + a g_∞ + b g_0: all points have the same ω_r and ζ_r, on which the answers g_r
depend; g_∞ and g_0 are those of modes above and below the range. R, a and b are linear and eliminated
(variable projection), so the search has two parameters a mode.
"""

from __future__ import annotations

from dataclasses import dataclass, field, replace
from typing import Protocol

import numpy as np

from rotorid.base.arrays import AnyArray, ComplexArray, FloatArray, IntArray


class Answers(Protocol):
    """What modes answer to an excitation, reading by reading."""

    @property
    def omega(self) -> FloatArray:
        """Frequencies or speeds (n,), rad/s."""

    @property
    def reference(self) -> ComplexArray | float:
        """What amplitudes are compared to where peaks and circles are looked for, (n,)."""

    @property
    def damping(self) -> tuple[float, float]:
        """Lowest and highest ζ that the answers are known for."""

    def basis(self, q: FloatArray) -> tuple[ComplexArray, ComplexArray]:
        """What R, a and b multiply (n, k + 2), and its slopes by q = (ω_r, ζ_r), (n, 2k)."""

    def take(self, rows: IntArray) -> Answers:
        """Those of some readings."""

    def at(self, omega: FloatArray) -> Answers:
        """Those at other frequencies between them."""


@dataclass(frozen=True, eq=False)
class SteadyAnswers:
    """g = e / (1 − (ω/ω_r)² + 2 i ζ_r ω/ω_r), e and e/ω² under an excitation e (n,) at frequencies ω (n,).

    The excitation is, but for a factor, what a displacement far below all resonances follows.
    """

    omega: FloatArray
    excitation: ComplexArray
    damping: tuple[float, float] = (-1.0, 1.0)

    @property
    def reference(self) -> ComplexArray:
        """The excitation."""
        return self.excitation

    def basis(self, q: FloatArray) -> tuple[ComplexArray, ComplexArray]:
        """See `Answers`."""
        own, damping = np.split(q, 2)
        u, e = self.omega[:, None] / own, self.excitation[:, None]
        g = 1 / (1 - u**2 + 2j * damping * u)
        slopes = -np.tile(g**2, 2) * np.hstack(((2 * u**2 - 2j * damping * u) / own, 2j * u))
        return e * np.hstack((g, u[:, :1] ** 0, u[:, :1] ** -2)), e * slopes

    def take(self, rows: IntArray) -> SteadyAnswers:
        """Those of some readings."""
        return replace(self, omega=self.omega[rows], excitation=self.excitation[rows])

    def at(self, omega: FloatArray) -> SteadyAnswers:
        """Those at other frequencies; excitations lie on lines over ω², as the force of an unbalance does."""
        order = np.argsort(self.omega)
        excitation = np.interp(omega**2, self.omega[order] ** 2, self.excitation[order])
        return replace(self, omega=omega, excitation=excitation)


@dataclass(frozen=True, eq=False)
class Readings:
    """Amplitudes Z (n, P), what they are made of, and what whitens them (n, P, 2, 2)."""

    answers: Answers
    Z: ComplexArray
    root: FloatArray
    _last: dict[bytes, tuple[ComplexArray, ComplexArray]] = field(default_factory=dict)

    def basis(self, q: FloatArray) -> tuple[ComplexArray, ComplexArray]:
        """Of the answers: all points have the same."""
        key = q.tobytes()
        if key not in self._last:
            self._last.clear()
            self._last[key] = self.answers.basis(q)
        return self._last[key]

    def point(self, p: int, q: FloatArray) -> tuple[AnyArray, ...]:
        """Of a point what R, a and b do not explain, its slopes, R, a and b, and their covariance."""
        from scipy.linalg import lapack

        seen = ~np.isnan(self.Z[:, p])

        def real(z: ComplexArray) -> FloatArray:
            parts = self.root[seen, p] @ np.stack((z[seen].real, z[seen].imag), axis=1)
            return np.asarray(parts.reshape(-1, z.shape[1]))

        columns, slopes = self.basis(q)
        design = real(np.stack((columns, 1j * columns), axis=-1).reshape(len(seen), -1))
        y, size = real(self.Z[:, [p]]), design.shape[1]
        triangle, tau, *_ = lapack.dgeqrf(design)

        def turned(x: FloatArray) -> FloatArray:
            """Qᵀ x: in its first `size` rows what the columns explain."""
            return np.asarray(lapack.dormqr("L", "T", triangle, tau, x, max(1, 64 * x.shape[1]))[0])

        own, inverse = turned(y)[:, 0], np.linalg.inv(np.triu(triangle[:size]))
        c = (inverse @ own[:size]).reshape(-1, 2) @ (1, 1j)
        spread = (inverse @ inverse.T).reshape(len(c), 2, -1, 2)
        return own[size:], -turned(real(slopes * np.tile(c[: len(q) // 2], 2)))[size:], c, spread

    def without(self, omega: float, least: int) -> Readings:
        """Those but for the frequency next to this one; all, where a point would have fewer than `least`."""
        all_of = self.answers.omega
        rest = np.flatnonzero(all_of != all_of[np.abs(all_of - omega).argmin()])
        if min(np.count_nonzero(~np.isnan(self.Z[rest]), axis=0)) < least:
            return self
        return Readings(self.answers.take(rest), self.Z[rest], self.root[rest])

    def each(self, what: int, q: FloatArray) -> list[AnyArray]:
        """One of these for every point."""
        return [self.point(p, q)[what] for p in range(self.Z.shape[1])]

    def rows(self, what: int, q: FloatArray) -> AnyArray:
        """One of these of all points together."""
        return np.concatenate(self.each(what, q))
