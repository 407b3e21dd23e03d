"""Curves on even steps that move as slowly as the data allow, with their errors.

Data z of a curve, n values that weigh g each: c minimises Σ g |c − z|² + λ Σ w |Δ³c|². The stiffness λ is the
most likely one (restricted maximum likelihood: log|G + λP| − n log λ + N log s² is least), w follows how fast
the curve moves: near a resonance it is bent more easily.

The Bayesian variance s² (G + λP)⁻¹ (Wahba 1983) is that of noise and of bias. Curves of machines are
smoother than third differences expect, and this λ leaves them hardly any bias: errors are those of the noise
alone, 5/6 of that variance but for the three numbers of a parabola, which have no bias.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np
from scipy.linalg import cho_solve_banded, cholesky_banded
from scipy.ndimage import uniform_filter1d

from rotorid.base.arrays import AnyArray, FloatArray

MIDDLE, STEPS = 10.0, (8.0, 4.0, 2.0, 1.0, 0.5)
"""log λ, relative to the weight of a step: where the search begins, and what it goes up and down by. After
each of these the weights w are found again."""
NEIGHBOURS, EVENING, FEW = 25, 0.1, 0.1
"""w is of so many steps around, with this share of the mean bend added, and this share of what is
likely by λ: a curve that hardly bends has even ones."""
BIAS = 1 / 6
"""Of the Bayesian variance, by third differences."""
TRACE = 1e-10
"""Of λ, which keeps steps solvable that have no data."""


@dataclass(frozen=True, eq=False)
class Smoothed:
    """A curve.

    Attributes
    ----------
    curve
        Real or complex, (n,).
    weights
        g of the data, (n,).
    variance
        s²: of data that weigh 1.
    factor
        Of G + λP: Cholesky, lower band (4, n).
    """

    curve: AnyArray
    weights: FloatArray
    variance: float
    factor: FloatArray

    @cached_property
    def inverse(self) -> FloatArray:
        """Diagonal of (G + λP)⁻¹, (n,).

        Within the band it follows from the factor, from its end on (Takahashi 1973).
        """
        out, window = np.zeros(len(self.factor.T)), np.zeros((3, 3))
        for j in range(len(out) - 1, -1, -1):
            below = self.factor[1:, j] / self.factor[0, j]
            near = -window @ below
            out[j] = 1 / self.factor[0, j] ** 2 - below @ near
            window[1:, 1:] = window[:-1, :-1].copy()
            window[0], window[:, 0] = (out[j], *near[:2]), (out[j], *near[:2])
        return out

    @property
    def shares(self) -> FloatArray:
        """Of each datum in the curve there, (n,)."""
        return self.weights * self.inverse

    @property
    def noise(self) -> float:
        """Share of the Bayesian variance that is not bias."""
        return 1 - BIAS * (1 - 3 / max(float(self.shares.sum()), 3.0))

    @property
    def errors(self) -> FloatArray:
        """Standard deviation of each value, of its real part where it is complex, (n,)."""
        return np.asarray(np.sqrt(self.variance * self.noise * self.inverse))

    @property
    def mean_error(self) -> float:
        """Standard deviation of the mean of all values."""
        even = np.full(len(self.weights), 1 / len(self.weights))
        return float(np.sqrt(self.variance * (even @ cho_solve_banded((self.factor, True), even))))


def stiffness(penalty: FloatArray) -> FloatArray:
    """P with these penalties of third differences (n − 3,), lower band (4, n)."""
    n, d = len(penalty), (-1.0, 3.0, -3.0, 1.0)
    band = np.zeros((4, n + 3))
    for p in range(4):
        for q in range(p + 1):
            band[p - q, q : q + n] += d[p] * d[q] * penalty
    return band


def smooth(weights: FloatArray, data: AnyArray) -> Smoothed:
    """Choose the stiffness of a curve through data (n,) of these weights (n,), 0 where there are none."""
    n, columns = len(data) - 3, 2 if np.iscomplexobj(data) else 1
    per, count = float(weights.mean()), max((int(np.count_nonzero(weights)) - 3) * columns, 1)

    def solved(penalty: FloatArray, right: FloatArray) -> tuple[FloatArray, FloatArray]:
        band = stiffness(penalty)
        band[0] += weights
        factor = cholesky_banded(band, lower=True)
        return factor, cho_solve_banded((factor, True), right)

    real = np.ascontiguousarray(data).view(np.float64).reshape(len(data), -1)
    bridged = solved(np.full(n, TRACE * per), weights[:, None] * real)[1]
    # parabolas, which no penalty changes, are taken off: stiff penalties would round them
    parabolas = np.linalg.qr(np.vander(np.linspace(-1, 1, n + 3), 3))[0]
    trend = parabolas @ (parabolas.T @ bridged)
    left = bridged - trend
    y = weights[:, None] * (real - trend)
    tiny = 1e-30 * np.vdot(bridged, weights[:, None] * bridged) + 1e-300

    def fitted(log: float) -> tuple[float, FloatArray, float, FloatArray]:
        """Twice the negative log likelihood, the curve, s², the factor."""
        penalty = per * np.exp(log) * w
        factor, c = solved(penalty, y)
        rest = weights @ ((left - c) ** 2).sum(axis=1) + penalty @ (np.diff(c, 3, axis=0) ** 2).sum(axis=1)
        variance = float(rest + tiny) / count
        value = columns * (2 * np.log(factor[0]).sum() - n * log) + count * np.log(variance)
        return float(value), c, variance, factor

    log, w = MIDDLE, np.ones(n)
    for step in STEPS:
        places = log - step, log, log + step
        trials = [fitted(at) for at in places]
        best = int(np.argmin([trial[0] for trial in trials]))
        log, (_, c, variance, factor) = places[best], trials[best]
        bend = uniform_filter1d((np.diff(c, 3, axis=0) ** 2).sum(axis=1), NEIGHBOURS, mode="constant")
        likely = columns * variance / (per * np.exp(log))
        w = 1 / (bend + EVENING * (bend.mean() + FEW * likely) + 1e-300)
        w /= np.exp(np.log(w).mean())
    return Smoothed(np.ascontiguousarray(c + trend).view(data.dtype)[:, 0], weights, variance, factor)
