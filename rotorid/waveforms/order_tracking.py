"""Vectors of orders along a record: least squares over blocks of whole turns, smoothed.

In a block x ≈ Re Σ_k A_k e^{ikθ}, θ the angle of the shaft: the mean of the waveform (k = 0), 1×, 2× and so
on, all together; whole turns hold no other order, nor halves of them where there are two. The A_k of the
blocks are smoothed order by order (rotorid.waveforms.smoothing): where nothing moves this is a mean over all;
where the speed passes a resonance it follows. The noise of an order is what its blocks scatter by, so that
its colour counts. Where A moves in a block, by A′ s, s from −½ to ½, it leaks L A′ into itself and other
orders, which is taken off with A′ of the curve; so is, at last, what the mean over a block differs by, A″/24.
"""

from __future__ import annotations

from dataclasses import dataclass
from itertools import pairwise

import numpy as np
from scipy.interpolate import CubicSpline

from rotorid.base.arrays import BoolArray, ComplexArray, FloatArray
from rotorid.waveforms.record import WaveformRecord
from rotorid.waveforms.smoothing import smooth
from rotorid.waveforms.tacho import Tacho

TURNS, LEAST, MOST = 2.0, 4, 8000
"""Of a block; how many blocks there are: those of longer records have more turns."""
PASSES, FAST = 2, 0.03
"""How often leaks are taken off; where A″/24 is more, of the largest, blocks are too long."""
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
        Turns that count for 1×: as many, evenly weighed, would leave the same error, (n,).
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


def track_orders(record: WaveformRecord, tacho: Tacho, highest: int, size: float = TURNS) -> Orders:
    """Find orders 0 to `highest` between the first and the last pulse, in blocks of so many turns."""
    first, last = tacho.turn_at(np.array(tacho.span))
    n, C = int(np.clip((last - first) / size, LEAST, MOST)), len(record.sensors)
    places = np.linspace(first, last, n + 1)
    times = np.interp(places, tacho.turn_at(tacho.angle.x), tacho.angle.x)
    ends, centres = np.rint(times * record.rate).astype(np.int64), (places[1:] + places[:-1]) / 2
    length, M = places[1] - places[0], 2 * highest + 1
    leak, blocks = np.empty((n, M, M)), np.empty((n, M, C))
    for j, (begin, end) in enumerate(pairwise(ends)):
        turns = tacho.turn_at(np.arange(begin, end) / record.rate)
        waves = np.exp(-2j * np.pi * turns)[:, None] ** np.arange(1, highest + 1)
        columns = np.column_stack((np.ones(len(turns)), waves.view(np.float64)))
        moving = columns * ((turns - centres[j]) / length)[:, None]
        samples = [sensor.samples[begin:end] * sensor.factor for sensor in record.sensors]
        both = np.column_stack((moving, *samples))
        leak[j], blocks[j] = np.split(np.linalg.lstsq(columns, both, rcond=None)[0], [M], axis=1)
    gram, width = np.zeros((4, n)), np.empty((n, C))
    gram[0] = np.diff(ends) / 2  # mean squares of cosine and sine
    curve = np.zeros((n, highest + 1, C), dtype=complex)
    errors, mean_errors = np.empty(curve.shape), np.empty(curve.shape[1:])
    for _ in range(PASSES):
        slope: ComplexArray = np.asarray(np.gradient(curve, axis=0))
        moves = np.stack((slope.real, slope.imag), axis=2).reshape(n, M + 1, C)
        still = _complex(blocks - leak @ np.delete(moves, 1, axis=1))
        for k, c in np.ndindex(highest + 1, C):
            smoothing, curve[:, k, c] = smooth(gram, gram[0] * still[:, k, c])
            errors[:, k, c] = np.sqrt(smoothing.covariance[0])
            mean_errors[k, c] = smoothing.of_sum(np.full(n, 1 / n))
            if k == 1:
                width[:, c] = smoothing.variance / errors[:, k, c] ** 2 / gram[0] * length
    # noise beside an order, slower than a block, looks like a vector that moves: parts scatter by it
    parts = [part.mean(axis=0) for part in np.array_split(still, min(PARTS, n))]
    mean_errors = np.maximum(mean_errors, np.std(parts, axis=0) / np.sqrt(2 * (len(parts) - 1)))
    mean, bend = curve.mean(axis=0), np.diff(curve, 2, axis=0) / 24
    once = np.abs(curve[:, 1])
    unclear = np.take_along_axis(errors[:, 1], once.argmax(axis=0)[None], 0)[0]
    fast = np.maximum(np.abs(bend[:, 1]).max(axis=0), unclear) > FAST * once.max(axis=0)
    if fast.any() and size > 1:
        return track_orders(record, tacho, highest, 1.0)
    curve[1:-1] -= bend
    errors[1:-1] = np.hypot(errors[1:-1], np.abs(bend) / 2)  # what is not taken off, of A⁗
    width = np.median(width, axis=1)
    return Orders(centres, CubicSpline(centres, curve), errors, width, mean, mean_errors, fast)


def _complex(c: FloatArray) -> ComplexArray:
    """Amplitudes (n, K + 1, C) of those of columns, (n, M, C)."""
    return np.concatenate((c[:, :1] + 0j, c[:, 1::2] + 1j * c[:, 2::2]), axis=1)
