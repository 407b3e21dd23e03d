"""Amplitudes around resonances, over their errors, and what modes explain of them.

At every point X = Σ_r R_r g_r + a g_∞ + b g_0: all points have the same ω_r and ζ_r, on which the answers g_r
depend; g_∞ and g_0 are those of modes above and below the range. R, a and b are linear and eliminated: with
the whitened columns K = Q (T; 0) only the rows of Qᵀ x below T count, and the slopes of these by ω_r and ζ_r
are −Qᵀ K' c, c = T⁻¹ Qᵀ x above (variable projection, Kaufman 1975). So the search has two parameters a mode.
"""

from __future__ import annotations

from dataclasses import dataclass, field, replace

import numpy as np

from balancing import Labels
from rotorid.base.arrays import ComplexArray, FloatArray, IntArray
from rotorid.base.unit_words import SPEEDS
from rotorid.identify.amplitudes import real_matrices

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
        shares = np.array(self.shares or (1.0, 1.0))
        size = np.fmax(np.abs(amplitudes), SMALL * np.nanmedian(np.abs(amplitudes), axis=0))
        errors = np.multiply.outer(size, np.maximum(shares, THIN * shares.max()))
        turn = real_matrices(np.exp(-1j * np.angle(np.nan_to_num(amplitudes))))
        return np.asarray(turn / errors[..., None])


def projected(
    basis: tuple[ComplexArray, ComplexArray], vectors: ComplexArray, root: FloatArray
) -> tuple[FloatArray, FloatArray, ComplexArray, FloatArray]:
    """What modes explain of vectors (N, C), by the inverse roots of their covariances (N, C, 2, 2).

    Parameters
    ----------
    basis
        Answers (N, k + 2), and their slopes by ω_r and ζ_r (N, 2k).
    vectors, root
        The readings, NaN where there is none.

    Returns
    -------
    What R, a and b do not explain (m,), its slopes by ω_r and ζ_r (m, 2k), R, a and b (C, k + 2), and their
    covariances, (C, k + 2, 2, k + 2, 2).
    """
    from scipy.linalg import lapack

    columns, slopes = basis
    design = np.stack((columns, 1j * columns), axis=-1).reshape(len(columns), -1)
    size, parts = design.shape[1], []
    for x, over in zip(vectors.T, np.swapaxes(root, 0, 1), strict=True):
        seen = ~np.isnan(x)

        def real(z: ComplexArray, seen: FloatArray = seen, over: FloatArray = over) -> FloatArray:
            whitened = over[seen] @ np.stack((z[seen].real, z[seen].imag), axis=1)
            return np.asarray(whitened.reshape(-1, z.shape[1]))

        triangle, tau, *_ = lapack.dgeqrf(real(design))
        y = lapack.dormqr("L", "T", triangle, tau, real(x[:, None]), 64)[0][:, 0]
        inverse = np.linalg.inv(np.triu(triangle[:size]))
        linear = (inverse @ y[:size]).reshape(-1, 2) @ (1, 1j)
        turned = real(slopes * np.tile(linear[:-2], 2))
        turned = lapack.dormqr("L", "T", triangle, tau, turned, 64 * turned.shape[1])[0]
        spread = (inverse @ inverse.T).reshape(size // 2, 2, -1, 2)
        parts.append((y[size:], -turned[size:], linear, spread))
    rest, by_q, *others = zip(*parts, strict=True)
    return np.concatenate(rest), np.concatenate(by_q), np.array(others[0]), np.array(others[1])
