"""Curves on even steps that move as slowly as the data allow, with their errors.

Data z of a curve, which weigh (c − z)ᵀ G (c − z), G banded: c minimises this and λ Σ w |Δ³c|². The penalty λ
is the most likely one (restricted maximum likelihood: log|G + λP| − n log λ + N log s² is least), w follows
how fast the curve moves: near a resonance it is bent more easily. Errors are those of the Bayesian curve
(Wahba 1983), s² (G + λP)⁻¹, which hold on the average along it.
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
TRACE = 1e-10
"""Of λ, which keeps steps solvable that have no data."""


@dataclass(frozen=True, eq=False)
class Smoothing:
    """How stiff a curve is, and how noisy its data.

    Attributes
    ----------
    variance
        s²: of data that weigh 1.
    factor
        Of G + λP: Cholesky, lower band (4, n).
    """

    variance: float
    factor: FloatArray

    @cached_property
    def covariance(self) -> FloatArray:
        """Covariances of each value with itself and the next three, (4, n).

        Within the band the inverse follows from the factor, from its end on (Takahashi 1973).
        """
        out, window = np.zeros_like(self.factor), np.zeros((3, 3))
        for j in range(len(out.T) - 1, -1, -1):
            below = self.factor[1:, j] / self.factor[0, j]
            near = -window @ below
            out[0, j] = 1 / self.factor[0, j] ** 2 - below @ near
            out[1:, j] = near
            window[1:, 1:] = window[:-1, :-1].copy()
            window[0], window[:, 0] = out[:3, j], out[:3, j]
        return self.variance * out

    def of_sum(self, row: FloatArray) -> float:
        """Standard deviation of a sum of the values with these weights, (n,)."""
        return float(np.sqrt(self.variance * (row @ cho_solve_banded((self.factor, True), row))))


def stiffness(penalty: FloatArray) -> FloatArray:
    """P with these penalties of third differences (n − 3,), lower band (4, n)."""
    n, d = len(penalty), (-1.0, 3.0, -3.0, 1.0)
    band = np.zeros((4, n + 3))
    for p in range(4):
        for q in range(p + 1):
            band[p - q, q : q + n] += d[p] * d[q] * penalty
    return band


def times(band: FloatArray, c: AnyArray) -> AnyArray:
    """A symmetric matrix, given by its lower band, times vectors (n, …)."""
    out = (band[0] * c.T).T
    for below, line in enumerate(band[1:], start=1):
        out[below:] += (line[:-below] * c[:-below].T).T
        out[:-below] += (line[:-below] * c[below:].T).T
    return np.asarray(out)


def smooth(gram: FloatArray, right: AnyArray) -> tuple[Smoothing, AnyArray]:
    """Choose the penalty of one curve, and draw it.

    Parameters
    ----------
    gram
        G, lower band (4, n); its diagonal is 0 where there are no data.
    right
        G z, real or complex, (n,).
    """
    n, real = len(right) - 3, np.ascontiguousarray(right).view(np.float64).reshape(len(right), -1)
    per, columns = float(gram[0].mean()), real.shape[1]

    def solved(penalty: FloatArray, y: FloatArray) -> tuple[FloatArray, FloatArray]:
        factor = cholesky_banded(gram + stiffness(penalty), lower=True)
        return factor, cho_solve_banded((factor, True), y)

    data = solved(np.full(n, TRACE * per), real)[1]
    # parabolas, which no penalty changes, are taken off: stiff penalties would round them
    parabolas = np.linalg.qr(np.vander(np.linspace(-1, 1, n + 3), 3))[0]
    trend = parabolas @ (parabolas.T @ data)
    y, left = real - times(gram, trend), data - trend
    count = max((int(np.count_nonzero(gram[0])) - 3) * columns, 1)
    tiny = 1e-30 * np.vdot(data, real) + 1e-300

    def fitted(log: float) -> tuple[float, FloatArray, Smoothing]:
        """Twice the negative log likelihood, the curve, and how it was made."""
        penalty = per * np.exp(log) * w
        factor, c = solved(penalty, y)
        rest = np.vdot(left - c, times(gram, left - c)) + penalty @ (np.diff(c, 3, axis=0) ** 2).sum(axis=1)
        variance = float(rest + tiny) / count
        value = columns * (2 * np.log(factor[0]).sum() - n * log) + count * np.log(variance)
        return float(value), c, Smoothing(variance, factor)

    log, w = MIDDLE, np.ones(n)
    for step in STEPS:
        places = log - step, log, log + step
        trials = [fitted(at) for at in places]
        best = int(np.argmin([value for value, _, _ in trials]))
        log, (_, c, smoothing) = places[best], trials[best]
        bend = uniform_filter1d((np.diff(c, 3, axis=0) ** 2).sum(axis=1), NEIGHBOURS, mode="constant")
        likely = columns * smoothing.variance / (per * np.exp(log))
        w = 1 / (bend + EVENING * (bend.mean() + FEW * likely) + 1e-300)
        w /= np.exp(np.log(w).mean())
    return smoothing, np.ascontiguousarray(c + trend).view(right.dtype)[:, 0]
