"""Amplitudes around resonances, over their errors, and what modes explain of them.

At every point X = Σ_r R_r g_r + a g_∞ + b g_0: all points have the same ω_r and ζ_r, on which the answers g_r
depend; g_∞ and g_0 are those of modes above and below the range. R, a and b are linear and eliminated: with
the whitened columns K = Q (T; 0) only the rows of Qᵀ x below T count, and the slopes of these by ω_r and ζ_r
are −Qᵀ K' c, c = T⁻¹ Qᵀ x above (variable projection, Kaufman 1975). So the search has two parameters a mode.
"""

from __future__ import annotations

from dataclasses import dataclass, field, replace
from typing import NamedTuple

import numpy as np

from balancing import Labels
from rotorid.base.arrays import ComplexArray, FloatArray, IntArray
from rotorid.base.unit_words import SPEEDS
from rotorid.identify.answers import Answers

THIN, SMALL = 0.01, 1e-3
"""No direction of a reading is more exact than this share of the other; an amplitude counts as this share of
its sensor's median at least."""


@dataclass(frozen=True, eq=False)
class Readings:
    """Vectors of some sensors over frequency or speed, of one run.

    Attributes
    ----------
    run
        Its name.
    time
        Rising, s, shape (N,), while the speed changes; None: nobody says.
    speeds
        Or frequencies, rad/s, (N,).
    sensors
        Names, length C.
    vectors
        Complex, in the unit of the readings inside, phase lead, (N, C); NaN where there is none.
    covariances
        Of their real and imaginary parts, (N, C, 2, 2); None: not stated.
    labels
        Units and conventions to print them in.
    shares
        Standard deviations of all amplitudes, as a share, and of all phases, rad, instead of covariances.
    """

    run: str
    time: FloatArray | None
    speeds: FloatArray
    sensors: tuple[str, ...]
    vectors: ComplexArray
    covariances: FloatArray | None = None
    labels: Labels = field(default_factory=Labels)
    shares: tuple[float, float] | None = None

    def take(self, rows: IntArray, columns: IntArray | slice = slice(None)) -> Readings:
        """Some of the vectors, by rising time, of some sensors."""
        return replace(
            self,
            time=None if self.time is None else self.time[rows],
            speeds=self.speeds[rows],
            sensors=tuple(np.array(self.sensors)[columns].tolist()),
            vectors=self.vectors[rows][:, columns],
            covariances=None if self.covariances is None else self.covariances[rows][:, columns],
        )

    @property
    def noise(self) -> FloatArray:
        """Standard deviation of each vector, (N, C): stated, or by differences of neighbours in speed."""
        if self.covariances is not None:
            return np.asarray(np.sqrt(np.trace(self.covariances, axis1=-2, axis2=-1)))
        second = np.diff(self.vectors[np.argsort(self.speeds, kind="stable")], 2, axis=0)
        return np.tile(np.nanmedian(np.abs(second), axis=0) / np.sqrt(6 * np.log(2)), (len(self.speeds), 1))

    def words(self, omega: float) -> str:
        """A frequency in its unit."""
        unit, scale = SPEEDS[self.labels.speed_unit]
        return f"{scale * omega:.5g} {unit}"

    def inverse_roots(self, amplitudes: ComplexArray) -> FloatArray:
        """Of the covariances at these amplitudes (N, C), (N, C, 2, 2)."""
        if self.covariances is not None:
            variances, axes = np.linalg.eigh(np.nan_to_num(self.covariances, nan=1.0))
            variances = np.maximum(variances, THIN**2 * variances[..., 1:])
            return np.asarray(np.swapaxes(axes, -1, -2) / np.sqrt(variances)[..., None])
        along, across = self.shares or (1.0, 1.0)
        least = THIN * max(along, across)
        z = np.where(np.isnan(amplitudes), 1.0, amplitudes)
        z = np.where(z == 0, np.finfo(float).tiny, z)
        floor = SMALL * np.nanmedian(np.abs(amplitudes), axis=0)
        size, u = np.maximum(np.abs(z), floor), z / np.abs(z)
        turn = np.stack((np.stack((u.real, u.imag), -1), np.stack((-u.imag, u.real), -1)), -2)
        errors = np.multiply.outer(size, (max(along, least), max(across, least)))
        return np.asarray(turn / errors[..., None])


class Projected(NamedTuple):
    """What R, a and b do not explain (m,), its slopes by ω_r and ζ_r (m, 2k), R, a and b (C, k + 2), and
    their covariances, (C, k + 2, 2, k + 2, 2).
    """

    rest: FloatArray
    slopes: FloatArray
    linear: ComplexArray
    spread: FloatArray


@dataclass(frozen=True, eq=False)
class Whitened:
    """Vectors (N, C), what they are made of, and inverse roots of their covariances (N, C, 2, 2)."""

    answers: Answers
    vectors: ComplexArray
    root: FloatArray
    _last: dict[bytes, Projected] = field(default_factory=dict)

    def at(self, q: FloatArray) -> Projected:
        """What modes of these ω_r and ζ_r explain."""
        key = q.tobytes()
        if key not in self._last:
            columns, slopes = self.answers.basis(q)
            design = np.stack((columns, 1j * columns), axis=-1).reshape(len(columns), -1)
            each = zip(*(self._sensor(c, design, slopes) for c in range(self.root.shape[1])), strict=True)
            rest, by_q, linear, spread = each
            self._last.clear()
            self._last[key] = Projected(
                np.concatenate(rest),
                np.concatenate(by_q),
                np.array(linear, dtype=np.complex128),
                np.array(spread),
            )
        return self._last[key]

    def _sensor(self, c: int, columns: ComplexArray, slopes: ComplexArray) -> Projected:
        """The same of one sensor."""
        from scipy.linalg import lapack

        seen = ~np.isnan(self.vectors[:, c])

        def real(z: ComplexArray) -> FloatArray:
            parts = self.root[seen, c] @ np.stack((z[seen].real, z[seen].imag), axis=1)
            return np.asarray(parts.reshape(-1, z.shape[1]))

        def turned(x: FloatArray) -> FloatArray:
            return np.asarray(lapack.dormqr("L", "T", triangle, tau, x, max(1, 64 * x.shape[1]))[0])

        size = columns.shape[1]
        triangle, tau, *_ = lapack.dgeqrf(real(columns))
        y, inverse = turned(real(self.vectors[:, [c]]))[:, 0], np.linalg.inv(np.triu(triangle[:size]))
        linear = np.asarray((inverse @ y[:size]).reshape(-1, 2) @ (1, 1j), dtype=np.complex128)
        by_q = -turned(real(slopes * np.tile(linear[:-2], 2)))[size:]
        return Projected(y[size:], by_q, linear, (inverse @ inverse.T).reshape(size // 2, 2, -1, 2))

    def rest(self, q: FloatArray) -> FloatArray:
        """What they leave."""
        return self.at(q).rest

    def slopes(self, q: FloatArray) -> FloatArray:
        """Its derivatives."""
        return self.at(q).slopes

    def model(self, q: FloatArray, answers: Answers | None = None) -> ComplexArray:
        """The vectors (N, C) that explain these best; with other answers those of the same modes there."""
        return np.asarray((answers or self.answers).basis(q)[0] @ self.at(q).linear.T)

    def without(self, omega: float, least: int) -> Whitened:
        """All but those next to a frequency; all, where a sensor would have fewer than `least`."""
        gap = np.abs(self.answers.omega - omega)
        rest = np.flatnonzero(self.answers.omega != self.answers.omega[gap.argmin()])
        if min(np.count_nonzero(~np.isnan(self.vectors[rest]), axis=0)) < least:
            return self
        return Whitened(self.answers.take(rest), self.vectors[rest], self.root[rest])
