"""Vectors of orders along a record: least squares over blocks of whole turns, smoothed.

In a block x ≈ Re Σ_k A_k e^{ikθ}, θ the angle of the shaft: the mean of the waveform (k = 0), 1×, 2× and so
on, all together; whole turns hold no other order, nor halves of them where there are two. The A_k of the
blocks are smoothed order by order (rotorid.waveforms.smoothing): where nothing moves this is a mean over all;
where the speed passes a resonance it follows. The noise of an order is what its blocks scatter by, so that
its colour counts; where the curve follows each block that says little, and the noise is at least that share
of what the blocks leave of their samples. Where A moves in a block, by A′ s, s from −½ to ½, it leaks L A′
into itself and other orders, which is taken off with A′ of the curve; so is, at last, what the mean over a
block differs by, A″/24.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from itertools import pairwise

import numpy as np
from scipy.interpolate import CubicSpline

from rotorid.base.arrays import BoolArray, ComplexArray, FloatArray
from rotorid.waveforms.record import WaveformRecord
from rotorid.waveforms.smoothing import smooth
from rotorid.waveforms.tacho import Tacho

TURNS, LEAST, MOST = 2.0, 4, 8000
"""Of a block; how many blocks there are: those of longer records have more turns."""
FINER, FAST = 0.01, 0.03
"""Where A″/24, or the error, is more, of the largest, blocks are of one turn; beyond that it is said."""
PASSES = 2
"""The second takes off what the first says that leaks."""
PARTS = 16
"""Of a record, whose means are compared."""


@dataclass(frozen=True, eq=False)
class Orders:
    """Complex amplitudes of orders 0 … K of C sensors along turns.

    Attributes
    ----------
    centres
        Of the blocks, turns, (n,).
    curve
        Amplitudes over turns (P, K + 1, C), and by `(turns, 1)` their change in a turn.
    errors
        Standard deviation of the real part, and of the imaginary one, at the centres, (n, K + 1, C).
    width
        Turns that count for 1×: those of a block over its share in the curve there, (n,).
    mean, mean_errors
        Over the record, and their standard deviations in each direction, (K + 1, C).
    fast
        Whether 1× moves too fast for blocks of a turn, or is in noise, (C,).
    """

    centres: FloatArray
    curve: CubicSpline
    errors: FloatArray
    width: FloatArray
    mean: ComplexArray
    mean_errors: FloatArray
    fast: BoolArray

    def averaged(self, ends: FloatArray) -> Orders:
        """The mean throughout, between two turns."""
        curve, errors = CubicSpline(ends, [self.mean] * 2), np.array([self.mean_errors] * 2)
        return replace(self, centres=ends, curve=curve, errors=errors, width=np.full(2, np.ptp(ends)))


def track_orders(record: WaveformRecord, tacho: Tacho, highest: int, size: float = TURNS) -> Orders:
    """Find orders 0 to `highest` between the first and the last pulse, in blocks of so many turns."""
    first, last = tacho.turn_at(np.array(tacho.span))
    n, C = int(np.clip((last - first) / size, LEAST, MOST)), len(record.sensors)
    places = np.linspace(first, last, n + 1)
    ends = np.rint(tacho.time_at(places) * record.rate).astype(np.int64)
    centres, length, M = (places[1:] + places[:-1]) / 2, places[1] - places[0], 2 * highest + 1
    leak, blocks, noise = np.empty((n, M, M)), np.empty((n, M, C)), np.empty((n, C))
    for j, (begin, end) in enumerate(pairwise(ends)):
        turns = tacho.turn_at(np.arange(begin, end) / record.rate)
        waves = np.exp(-2j * np.pi * turns)[:, None] ** np.arange(1, highest + 1)
        columns = np.column_stack((np.ones(len(turns)), waves.view(np.float64)))
        moving = columns * ((turns - centres[j]) / length)[:, None]
        samples = np.column_stack([sensor.samples[begin:end] * sensor.factor for sensor in record.sensors])
        both = np.linalg.lstsq(columns, np.hstack((moving, samples)), rcond=None)[0]
        leak[j], blocks[j] = np.split(both, [M], axis=1)
        noise[j] = ((samples - columns @ blocks[j]) ** 2).sum(axis=0) / max(len(turns) - M, 1)
    weights = np.diff(ends) / 2  # mean squares of cosine and sine
    curve = np.zeros((n, highest + 1, C), dtype=complex)
    for _ in range(PASSES):
        slope: ComplexArray = np.asarray(np.gradient(curve, axis=0))
        moves = np.stack((slope.real, slope.imag), axis=2).reshape(n, M + 1, C)
        still = _complex(blocks - leak @ np.delete(moves, 1, axis=1))
        fits = [[smooth(weights, z) for z in order.T] for order in still.swapaxes(0, 1)]
        curve = np.array([[fit.curve for fit in order] for order in fits]).transpose(2, 0, 1)
    errors, mean_errors = np.empty(curve.shape), np.empty(curve.shape[1:])
    for k, c in np.ndindex(mean_errors.shape):
        fit = fits[k][c]
        least = float(fit.shares.mean() * np.median(noise[:, c]))
        errors[:, k, c] = fit.errors * np.sqrt(max(1.0, least / fit.variance))
        mean_errors[k, c] = fit.mean_error
    # noise beside an order, slower than a block, looks like a vector that moves: parts scatter by it
    parts = [part.mean(axis=0) for part in np.array_split(still, min(PARTS, n))]
    mean_errors = np.maximum(mean_errors, np.std(parts, axis=0) / np.sqrt(2 * (len(parts) - 1)))
    bend, largest = np.diff(curve, 2, axis=0) / 24, np.abs(curve[:, 1]).max(axis=0)
    curved = np.abs(bend[:, 1]).max(axis=0)
    unclear = np.take_along_axis(errors[:, 1], np.abs(curve[:, 1]).argmax(axis=0)[None], 0)[0]
    if size > 1 and (np.maximum(curved, unclear) > FINER * largest).any():
        return track_orders(record, tacho, highest, 1.0)
    mean = curve.mean(axis=0)
    curve[1:-1] -= bend
    errors[1:-1] = np.hypot(errors[1:-1], np.abs(bend) / 2)  # what is not taken off, of A⁗
    return Orders(
        centres=centres,
        curve=CubicSpline(centres, curve),
        errors=errors,
        width=length / np.median([fit.shares for fit in fits[1]], axis=0),
        mean=mean,
        mean_errors=mean_errors,
        fast=np.maximum(curved, unclear) > FAST * largest,
    )


def _complex(c: FloatArray) -> ComplexArray:
    """Amplitudes (n, K + 1, C) of those of columns, (n, M, C)."""
    return np.concatenate((c[:, :1] + 0j, c[:, 1::2] + 1j * c[:, 2::2]), axis=1)
