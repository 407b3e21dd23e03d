"""Penalised cubic splines: curves that move as slowly as the data allow, with their errors.

Samples x_i ≈ Σ_m E_im c_m(s_i), where each c_m is a cubic spline with knots at the whole numbers of s and E
holds known columns: ones for a curve, cosines and sines of the shaft's angle for orders. Then this is the
Vold–Kalman filter of second generation (Feldbauer, Höldrich 2000) with splines in place of sample values. The
penalty λ Σ w |Δ³c|² is chosen by restricted maximum likelihood, where the noise is that of the
neighbourhood of each order: as its residual tells, with its colour. w follows how fast the curve moves:
near a resonance the filter is wider. The errors are those of the Bayesian curve (Wahba 1983), which hold on
the average along it.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable
from dataclasses import dataclass
from itertools import pairwise

import numpy as np
from scipy.interpolate import BSpline
from scipy.linalg import cho_solve_banded, cholesky_banded
from scipy.ndimage import uniform_filter1d

from rotorid.base.arrays import AnyArray, FloatArray

TRACE, SOFTEST, STEP = -22.0, -10.0, 0.28
"""log λ, relative to the samples between two knots: what keeps knots solvable between which there are none,
and the first and the step of the values among which one is chosen."""
FIBONACCI = (1, 2, 3, 5, 8, 13, 21, 34, 55, 89)
"""The last two add up to the number of these values."""
LEAST_GAIN = 0.01
"""Twice the gain in log likelihood, for 1 of log λ, at which the search still goes for more."""
ROUNDS, NEIGHBOURS = 3, 12
"""The weights of the penalty are found again so often, each from so many knots on either side."""
CELLS = 1 << 20
"""Numbers of a right-hand side that are solved for at a time."""
EVENING, FEW = 0.1, 0.1
"""Share of the mean jump that is added to each, so that the weights stay finite, and share of the jump that
is likely for λ: of a curve that hardly bends the weights are even, and not those of rounding."""


def weights(f: FloatArray) -> FloatArray:
    """What the four splines around s = j + f weigh, (…, 4), for 0 ≤ f ≤ 1."""
    g = 1.0 - f
    return np.stack((g**3, 4 - 6 * f**2 + 3 * f**3, 4 - 6 * g**2 + 3 * g**3, f**3), axis=-1) / 6


def spline(start: float, step: float, c: AnyArray) -> BSpline:
    """The curve with coefficients c (n + 3, …) and n intervals of a step between its knots."""
    return BSpline(start + step * np.arange(-3, len(c) + 1), c, 3)


def moments(
    parts: Iterable[tuple[FloatArray, FloatArray, FloatArray]], n: int
) -> tuple[FloatArray, FloatArray]:
    """All that samples say about splines: sums over the n intervals between knots.

    Parts of a record are places s (L,), increasing, from 0 to n; columns (L, M); samples (L, C). The sums are
    Gram matrices (n, 4 M, 4 M) of the columns, spline by spline, and columns by samples (n, 4 M, C).
    """
    gram, right = np.zeros((n, 0, 0)), np.zeros((n, 0, 0))
    for s, columns, samples in parts:
        if not gram.size:
            size = 4 * columns.shape[1]
            gram, right = np.zeros((n, size, size)), np.zeros((n, size, samples.shape[1]))
        j = np.minimum(s.astype(np.int64), n - 1)
        design = (weights(s - j)[:, :, None] * columns[:, None, :]).reshape(len(s), -1)
        first, last = int(j[0]), int(j[-1])
        ends = np.searchsorted(j, np.arange(first, last + 2))
        for at, (low, high) in enumerate(pairwise(ends), start=first):
            rows = design[low:high]
            gram[at] += rows.T @ rows
            right[at] += rows.T @ samples[low:high]
    return gram, right


def band_of(gram: FloatArray) -> FloatArray:
    """The matrix of all coefficients (knot by knot, column by column) of blocks (n, 4 M, 4 M), lower band."""
    n, size = gram.shape[:2]
    M = size // 4
    band = np.zeros((size, (n + 3) * M))
    for p in range(size):
        for q in range(p + 1):
            band[p - q, q : q + n * M : M] += gram[:, p, q]
    return band


def sums_of(right: FloatArray) -> FloatArray:
    """Right-hand sides of all coefficients, (n + 3, M, C), of blocks (n, 4 M, C)."""
    n, size, C = right.shape
    M = size // 4
    out = np.zeros(((n + 3) * M, C))
    for p in range(size):
        out[p : p + n * M : M] += right[:, p]
    return out.reshape(n + 3, M, C)


@dataclass(frozen=True, eq=False)
class Smoothing:
    """How stiff one curve is, and how noisy its neighbourhood.

    Attributes
    ----------
    penalty
        λ w of each third difference, (n,), over the variance of the samples.
    variance
        Of a sample, as the noise near this curve tells.
    factor
        Of Gram and penalty together, over the variance: Cholesky, banded, (4, n + 3).
    """

    penalty: FloatArray
    variance: float
    factor: FloatArray

    def deviation(self, s: FloatArray) -> FloatArray:
        """Standard deviation of the curve at places s (P,), in knots from the first one."""
        j = np.clip(s.astype(np.int64), 0, self.factor.shape[1] - 4)
        rows, out = weights(s - j), np.empty(len(s))
        size = max(1, CELLS // self.factor.shape[1])
        for part in range(0, len(s), size):
            some = rows[part : part + size]
            sums = np.zeros((self.factor.shape[1], len(some)))
            np.put_along_axis(sums, (j[part : part + size, None] + np.arange(4)).T, some.T, axis=0)
            out[part : part + size] = self.of_sums(sums)
        return out

    def of_sums(self, sums: FloatArray) -> FloatArray:
        """Standard deviation of sums of the coefficients with weights (n + 3, P), (P,)."""
        solved = cho_solve_banded((self.factor, True), sums)
        return np.asarray(np.sqrt(self.variance * np.einsum("np,np->p", sums, solved)))


def third_differences(penalty: FloatArray) -> FloatArray:
    """Dᵀ diag(penalty) D, lower band (4, n + 3), D of third differences."""
    d = np.array((-1.0, 3.0, -3.0, 1.0))
    return band_of(np.multiply.outer(penalty, np.outer(d, d)))


def times(band: FloatArray, c: AnyArray) -> AnyArray:
    """A symmetric matrix, given by its lower band, times vectors (n, …)."""
    out = (band[0] * c.T).T
    for below, line in enumerate(band[1:], start=1):
        out[below:] += (line[:-below] * c[:-below].T).T
        out[:-below] += (line[:-below] * c[below:].T).T
    return np.asarray(out)


def smooth(
    gram: FloatArray, right: AnyArray, total: float | None = None, count: int = 0, rounds: int = ROUNDS
) -> tuple[Smoothing, AnyArray]:
    """Choose the penalty of one curve by restricted maximum likelihood.

    Parameters
    ----------
    gram
        Its Gram matrix, lower band (4, n + 3).
    right
        Right-hand side, real or complex, (n + 3,).
    total, count
        Sum of squares and number of the samples, whose noise is that of the curve; None: only the noise that
        splines can follow counts, the one around an order.
    rounds
        How often the weights of the penalty are found.

    Returns
    -------
    Smoothing
        See there.
    ndarray
        Coefficients (n + 3,).
    """
    n = gram.shape[1] - 3
    real = right.view(np.float64).reshape(n + 3, -1)
    per = float(gram[0].mean())
    if total is None:
        # a trace of penalty keeps intervals solvable that hold little
        loose = cholesky_banded(gram + third_differences(np.full(n, per * np.exp(TRACE))), lower=True)
        total, count = float(np.vdot(real, cho_solve_banded((loose, True), real))), n * real.shape[1]
    size, w = float(total), np.ones(n)

    def solved(log: float) -> tuple[FloatArray, FloatArray, float]:
        matrix = gram + third_differences(per * np.exp(log) * w)
        factor = cholesky_banded(matrix, lower=True)
        c = cho_solve_banded((factor, True), real)
        # differences, for the stiff penalty would round what it takes of a curve that is nearly a parabola
        bent = per * np.exp(log) * float(w @ (np.diff(c, 3, axis=0) ** 2).sum(axis=1))
        rest = size - 2 * np.vdot(c, real) + np.vdot(c, times(gram, c)) + bent
        return factor, c, max(float(rest), 1e-30 * size + 1e-300) / count

    def likelihood(log: float) -> float:
        factor, _, variance = solved(log)
        return LEAST_GAIN * log + float(
            real.shape[1] * (2 * np.log(np.abs(factor[0])).sum() - n * log) + count * np.log(variance)
        )

    for turn in range(rounds):
        log = _stiffness(likelihood)
        factor, c, variance = solved(log)
        if turn < rounds - 1:
            jump = (np.diff(c, 3, axis=0) ** 2).sum(axis=1)
            near = uniform_filter1d(jump, 2 * NEIGHBOURS + 1, mode="constant")
            likely = (2 * NEIGHBOURS + 1) * real.shape[1] * variance / (per * np.exp(log))
            w = 1 / (near + EVENING * (near.mean() + FEW * likely) + 1e-300)
            w /= np.exp(np.log(w).mean())
    coefficients = np.ascontiguousarray(c).view(right.dtype)[:, 0]
    return Smoothing(per * np.exp(log) * w, variance, factor), coefficients


def _stiffness(likelihood: Callable[[float], float]) -> float:
    """Fibonacci's search for log λ among fixed values: another machine's rounding chooses the same one."""
    values: dict[int, float] = {}

    def at(place: int) -> float:
        if place not in values:
            values[place] = likelihood(SOFTEST + STEP * place)
        return values[place]

    low = 0
    for step, further in reversed([*pairwise(FIBONACCI)]):
        if at(low + step) > at(low + further):
            low += step
    return SOFTEST + STEP * min(values, key=lambda place: (values[place], place))
