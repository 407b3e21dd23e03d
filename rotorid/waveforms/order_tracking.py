"""Vectors of orders along a record: a Vold–Kalman filter over turns.

x = Σ_k Re(A_k(u) e^{2πiku}), u turns: the mean of the waveform (k = 0), 1×, 2× and so on, all together, so
that no order leaks into another. Each A_k is a penalised spline (rotorid.waveforms.penalised_spline): where
nothing moves its stiffness makes of it a mean over all turns, with a slope; where the speed passes a
resonance it follows.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import dataclass
from functools import cached_property
from typing import TYPE_CHECKING

import numpy as np
from scipy.linalg import cho_solve_banded, cholesky_banded

from rotorid.base.arrays import BoolArray, ComplexArray, FloatArray
from rotorid.waveforms.penalised_spline import (
    ROUNDS,
    SOFTEST,
    Smoothing,
    band_of,
    moments,
    smooth,
    spline,
    sums_of,
    third_differences,
    times,
)

if TYPE_CHECKING:
    from scipy.interpolate import BSpline

KNOT, FINE, MOST_KNOTS = 2.0, 1.0, 8000
"""Turns between two knots, and where 1× moves too fast for these; a longer record has more between."""
VAGUE, PLACES = 0.03, 100
"""Share of the largest vector; where its error is more at one of so many places, it may move too fast."""
PARTS = 16
"""Of a steady record, whose means are compared."""
PASSES = 2
"""Penalties of all orders are chosen so often, each time with what the others explain taken off."""
Parts = Callable[[], Iterator[tuple[FloatArray, FloatArray]]]
"""Gives the record part by part: turns (L,), increasing, and samples (L, C)."""


@dataclass(frozen=True, eq=False)
class Orders:
    """Complex amplitudes of orders 0 … K of C sensors along turns.

    Attributes
    ----------
    first, knot
        Turn of the first knot, and turns from knot to knot.
    coefficients
        Of the splines, (n + 3, K + 1, C).
    smoothings
        How stiff each is, [sensor][order].
    density
        Samples a turn, (n,).
    raw
        Means of some turns around each coefficient, without any penalty, (n + 3, K + 1, C).
    """

    first: float
    knot: float
    coefficients: ComplexArray
    smoothings: tuple[tuple[Smoothing, ...], ...]
    density: FloatArray
    raw: ComplexArray

    @property
    def last(self) -> float:
        """Turn of the last knot."""
        return self.first + self.knot * len(self.density)

    @cached_property
    def spline(self) -> BSpline:
        """Over turns: amplitudes (P, K + 1, C), and by `(turns, 1)` their change in a turn."""
        return spline(self.first, self.knot, self.coefficients)

    def deviation(self, turns: FloatArray, order: int) -> FloatArray:
        """Standard deviation of the real part, and of the imaginary one, (P, C), of one order."""
        s = (turns - self.first) / self.knot
        return np.transpose([sensor[order].deviation(s) for sensor in self.smoothings])

    def mean(self) -> tuple[ComplexArray, FloatArray]:
        """Means over the record, and their standard deviations in each direction, (K + 1, C).

        Those of the filter, or of the means of parts of the record where these scatter more: noise beside an
        order, slower than two turns, looks like a vector that moves.
        """
        n = len(self.density)
        row = np.convolve(np.ones(n), (1 / 24, 11 / 24, 11 / 24, 1 / 24)) / n
        filtered = [[curve.of_sums(row[:, None])[0] for curve in sensor] for sensor in self.smoothings]
        parts = np.stack([part.mean(axis=0) for part in np.array_split(self.raw, min(PARTS, n))])
        scatter = np.sqrt(
            np.mean(np.abs(parts - parts.mean(axis=0)) ** 2, axis=0) / 2 / max(len(parts) - 1, 1)
        )
        return np.tensordot(row, self.coefficients, 1), np.maximum(np.transpose(filtered), scatter)

    def width(self, turns: FloatArray, order: int = 1) -> FloatArray:
        """Turns that count around these, (P,): as many, evenly weighed, would leave the same error."""
        noise = np.array([2 * own[order].variance for own in self.smoothings])
        samples = np.median(noise / self.deviation(turns, order) ** 2, axis=1)
        at = ((turns - self.first) / self.knot).astype(np.int64)
        return np.asarray(samples / self.density[np.clip(at, 0, len(self.density) - 1)])

    def vague(self) -> BoolArray:
        """Sensors whose largest 1× has a large error, (C,): of noise, or as it moves too fast."""
        places = np.linspace(self.first, self.last, PLACES)
        size, error = np.abs(self.spline(places)[:, 1]), self.deviation(places, 1)
        largest = size.argmax(axis=0), np.arange(size.shape[1])
        return np.asarray(error[largest] > VAGUE * size[largest])

    def too_fast(self) -> bool:
        """Whether 1× may move faster than these splines: it is vague, or means are over less than a turn."""
        places = np.linspace(self.first, self.last, PLACES)
        return bool(self.width(places).min() < 1 or self.vague().any())


def track_orders(parts: Parts, first: float, last: float, highest: int, knot: float = KNOT) -> Orders:
    """Fit orders 0 to `highest` to a record between two turns.

    Parameters
    ----------
    parts
        See `Parts`.
    first, last
        Turns.
    highest
        Order.
    knot
        Turns between two knots; smaller ones let more of what is between the orders through.
    """
    fine = knot <= FINE
    n = int(np.clip(np.ceil((last - first) / knot), 1, MOST_KNOTS))
    knot = (last - first) / n

    def with_columns() -> Iterator[tuple[FloatArray, FloatArray, FloatArray]]:
        for turns, samples in parts():
            yield np.clip((turns - first) / knot, 0, n), _columns(turns, highest), samples

    blocks, samples = moments(with_columns(), n)
    of_mean = blocks[:, :: 2 * highest + 1, :: 2 * highest + 1]
    band, alone, right = band_of(blocks), band_of(of_mean), sums_of(samples)
    loose = np.full(n, alone[0].mean() * np.exp(SOFTEST / 2))
    M = 2 * highest + 1
    start = _solved(band, [loose] * M, right)
    # parabolas, which no penalty changes, are taken off: stiff penalties would round them
    parabolas = np.linalg.qr(np.vander(np.linspace(-1, 1, n + 3), 3))[0]
    trend = np.tensordot(parabolas, np.tensordot(parabolas.T, start, 1), 1)
    start, right = start - trend, right - times(band, trend.reshape(len(band.T), -1)).reshape(right.shape)
    coefficients, raw, smoothings = [], [], list[tuple[Smoothing, ...]]()
    total = times(alone, np.ones(n + 3))
    for sensor in range(right.shape[2]):
        c, b, own = start[:, :, sensor], right[:, :, sensor], list[Smoothing]()
        for turn in range(PASSES):
            left, own, means = b - times(band, c.reshape(-1)).reshape(c.shape), [], []
            for k in range(highest + 1):
                columns = slice(0, 1) if k == 0 else slice(2 * k - 1, 2 * k + 1)
                gram = alone if k == 0 else alone / 2  # mean squares of cosine and sine
                y = np.ascontiguousarray(left[:, columns] + times(gram, c[:, columns]))
                own.append(smooth(gram, y, rounds=1 if turn == 0 else ROUNDS)[0])
                full = y + times(gram, trend[:, columns, sensor])
                means.append(full @ ((1.0,) if k == 0 else (2.0, 2.0j)) / total)
            c = _solved(band, [own[(m + 1) // 2].penalty for m in range(M)], b)
        coefficients.append(c + trend[:, :, sensor])
        smoothings.append(tuple(own))
        raw.append(np.stack(means, axis=-1))
    c = np.stack(coefficients, axis=-1)
    complex_ones = np.concatenate((c[:, :1] + 0j, c[:, 1::2] + 1j * c[:, 2::2]), axis=1)
    density = of_mean.sum(axis=(1, 2)) / knot
    found = Orders(first, knot, complex_ones, tuple(smoothings), density, np.stack(raw, axis=-1))
    return found if fine or not found.too_fast() else track_orders(parts, first, last, highest, FINE)


def _columns(turns: FloatArray, highest: int) -> FloatArray:
    """What mean, real and imaginary parts of orders multiply, (L, 2 K + 1)."""
    out = np.ones((len(turns), 2 * highest + 1))
    once = np.exp(2j * np.pi * (turns % 1.0))
    power = once
    for k in range(1, highest + 1):
        out[:, 2 * k - 1], out[:, 2 * k] = power.real, -power.imag
        power = power * once
    return out


def _solved(band: FloatArray, penalties: list[FloatArray], right: FloatArray) -> FloatArray:
    """Coefficients (n + 3, M, …) of all columns together, each with its penalty (n,)."""
    M = len(penalties)
    matrix = band.copy()
    for m, penalty in enumerate(penalties):
        for below, line in enumerate(third_differences(penalty)):
            matrix[below * M, m::M] += line
    factor = cholesky_banded(matrix, lower=True)
    flat = right.reshape(len(right) * M, -1)
    return np.asarray(cho_solve_banded((factor, True), flat).reshape(right.shape))
