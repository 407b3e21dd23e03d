"""Vectors of a record: 1× and other orders with their errors, at a steady speed or along a run-up."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace

import numpy as np
from scipy.interpolate import CubicSpline, interp1d

from rotorid.base.arrays import AnyArray, BoolArray, ComplexArray, FloatArray
from rotorid.waveforms.filters_and_delays import before_path, response
from rotorid.waveforms.order_tracking import Orders, track_orders
from rotorid.waveforms.record import Channel, TachoSettings, WaveformRecord
from rotorid.waveforms.tacho import Tacho, read_tacho

STEADY, WINDOWS, CALM = 0.01, 20, 8
"""A record whose speed, in so many windows, stays within this share of it has one vector; windows are so long
that jitter of the tacho is that much less."""
HIGHEST = 0.45
"""Of the sampling rate: beyond, an order is not what the samples hold."""
PILED = 10
"""A channel is clipped where so many samples, and more than half of those in the uppermost hundredth of the
range, are equal."""
LEAST_TURNS = 2.0
"""Over which the overall level is taken."""
MOVES, TOLD = 0.1, 3.0
"""A vector that moves by more, of its size, at a steady speed is worth a word, beside so many times the
jitter of the tacho; one that is less than so many deviations is noise."""


@dataclass(frozen=True, eq=False)
class Vectors:
    """What C sensors read of K orders at P instants of a record.

    Attributes
    ----------
    run
        Name of the record.
    sensors, orders
        Names, and numbers of the orders.
    times, speeds
        s from the beginning of the record, and rad/s, (P,).
    vectors
        x = Re(A e^{ikθ}), θ the angle since the mark: complex, phase lead, SI (peak), (P, C, K).
    radial, tangential
        Standard deviations along and across them, the tacho's errors included, (P, C, K).
    turns
        Over which they are means, (P,).
    overall
        Half the range of the waveform there, and √2 times its root mean square, (P, C, 2); NaN where
        sensors measure something else than is written.
    gap
        Mean of the waveform, (P, C), NaN without any.
    end
        Whether the beginning or the end of the record is nearer than half those turns, (P,).
    steady
        Whether there is one vector for the record.
    range
        Lowest and highest speed of the record, rad/s, (2,).
    tacho
        See there.
    warnings
        What the user should know.
    """

    run: str
    sensors: tuple[str, ...]
    orders: tuple[int, ...]
    times: FloatArray
    speeds: FloatArray
    vectors: ComplexArray
    radial: FloatArray
    tangential: FloatArray
    turns: FloatArray
    overall: FloatArray
    gap: FloatArray
    end: BoolArray
    steady: bool
    range: FloatArray
    tacho: Tacho
    warnings: tuple[str, ...]


def find_vectors(
    record: WaveformRecord,
    settings: TachoSettings,
    orders: Sequence[int] = (1,),
    *,
    derivative: int | None = None,
    speeds: FloatArray | None = None,
) -> Vectors:
    """Find the vectors of a record.

    Parameters
    ----------
    record
        With a tacho.
    settings
        Of the tacho.
    orders
        Which are wanted, 1 first.
    derivative
        0, 1, 2: displacements, velocities, accelerations are wanted; None: as each sensor measures.
    speeds
        rad/s: where vectors are wanted, each where the speed passes it first. None: one for a steady speed,
        else as many along the run-up as are independent of each other.

    Raises
    ------
    ValueError
        Without a tacho, for what the tacho does not tell, sensors that read nothing, orders beyond the
        sampling rate, and speeds that do not occur; with the name of the record.
    """
    try:
        return _vectors_at(record, settings, tuple(orders), derivative, speeds)
    except ValueError as error:
        raise ValueError(f"{record.source}: {error}") from None


def _vectors_at(
    record: WaveformRecord,
    settings: TachoSettings,
    orders: tuple[int, ...],
    derivative: int | None,
    speeds: FloatArray | None,
) -> Vectors:
    if record.tacho is None:
        raise ValueError("a tacho channel is needed: without one there are no turns, and no phase")
    tacho = read_tacho(record.tacho, record.rate, settings)
    clipped = [word for sensor in record.sensors for word in _checked(sensor)]
    means, ends = _means(tacho, settings.pulses), tacho.turn_at(np.array(tacho.span))
    steady = bool(np.ptp(means) < STEADY * means.mean())
    course = means if steady else tacho.speed_at(np.linspace(*tacho.span, 2 + len(tacho.times)))
    if max(orders) * course.max() > HIGHEST * record.rate:
        raise ValueError(
            f"{max(orders)}× is {max(orders) * course.max():.4g} Hz at the highest speed, beyond "
            f"{HIGHEST:g} of the {record.rate:.6g} samples a second"
        )
    tracked = track_orders(record, tacho, max(orders))
    times = None if speeds is None else np.array([_passed(tacho, course, speed) for speed in speeds])
    if steady:
        times = np.full(1 if times is None else len(times), np.mean(tacho.span))
        along, shaft = (
            tracked.averaged(ends),
            replace(tacho, angle=CubicSpline(tacho.span, ends), errors=np.zeros(2), widths=np.ones(2)),
        )
    else:
        along, shaft, times = tracked, tacho, _independent(tacho, tracked, ends) if times is None else times
    turns, speed = shaft.turn_at(times), shaft.speed_at(times)
    wide = np.interp(turns, along.centres, along.width)
    around = np.clip(times + np.multiply.outer((-0.5, 0.5), wide / speed), *tacho.span)
    rise = np.diff(shaft.speed_at(around), axis=0)[0] / np.diff(around, axis=0)[0]
    read, change = along.curve(turns), along.curve(turns, 1) * speed[:, None, None]
    inside, wanted = np.clip(turns, along.centres[0], along.centres[-1]), list(orders)
    radial = interp1d(along.centres, along.errors[:, wanted], axis=0)(inside)
    w, vectors = 2 * np.pi * np.multiply.outer(speed, orders), read[:, wanted]
    for c, sensor in enumerate(record.sensors):
        more = 0 if derivative is None or sensor.derivative is None else sensor.derivative - derivative
        H, rates = response(sensor.path, more), w * (rise / speed)[:, None]
        vectors[:, :, c], factor = before_path(H, vectors[:, :, c], change[:, wanted, c], w, rates)
        radial[:, :, c] *= factor
    vectors, radial = vectors.swapaxes(1, 2), radial.swapaxes(1, 2)
    angle = 2 * np.pi * np.hypot(shaft.error_at(times, wide), tacho.offset_s * speed)
    same = np.array([derivative in (None, sensor.derivative) for sensor in record.sensors])
    direct = np.array([sensor.path.high_pass_rad_s is None for sensor in record.sensors])
    spans = zip(times, np.maximum(wide, LEAST_TURNS) / speed, strict=True)
    overall = np.array([_overall(record, *each) for each in spans])
    doubts = _doubts(record, vectors[:, :, 0], radial[:, :, 0], tracked, tacho.jitter_deg if steady else None)
    return Vectors(
        run=record.run,
        sensors=tuple(sensor.name for sensor in record.sensors),
        orders=orders,
        times=times,
        speeds=2 * np.pi * speed,
        vectors=vectors,
        radial=radial,
        tangential=np.hypot(radial, np.abs(vectors) * np.multiply.outer(angle, orders)[:, None]),
        turns=wide,
        overall=np.where(same[:, None], overall, np.nan),
        gap=np.where(same & direct, read[:, 0].real, np.nan),
        end=np.minimum(turns - ends[0], ends[1] - turns) < wide / 2 * (1 - 1e-9),
        steady=steady,
        range=2 * np.pi * np.array([course.min(), course.max()]),
        tacho=tacho,
        warnings=(*tacho.warnings, *clipped, *doubts),
    )


def _means(tacho: Tacho, pulses: int) -> FloatArray:
    """Mean speeds of windows, turns per s."""
    jitter = CALM / STEADY * np.sqrt(2) * tacho.jitter_deg / 360 * pulses
    step = max(1, len(tacho.times) // WINDOWS, min(int(jitter), len(tacho.times) // 3))
    return np.asarray(np.diff(tacho.turns[::step]) / np.diff(tacho.times[::step]))


def _independent(tacho: Tacho, tracked: Orders, ends: FloatArray) -> FloatArray:
    """Times of vectors that share no turns, the first and the last half their turns from the ends."""
    blocks = np.linspace(ends[0], ends[1], len(tracked.width) + 1)
    number = np.append(0.0, np.cumsum(np.diff(blocks) / tracked.width))
    count = max(2, int(number[-1]))
    return tacho.time_at(np.interp((np.arange(count) + 0.5) * number[-1] / count, number, blocks))


def _passed(tacho: Tacho, course: FloatArray, speed: float) -> float:
    """The time at which the speed first is this, rad/s; of turns per s between which the record runs."""
    wanted = speed / (2 * np.pi)
    if not course.min() * (1 - STEADY / 2) <= wanted <= course.max() * (1 + STEADY / 2):
        raise ValueError(
            f"there is no speed of {wanted * 60:.6g} rpm: the record runs from {course.min() * 60:.6g} to "
            f"{course.max() * 60:.6g} rpm"
        )
    passed = tacho.angle.derivative().solve(wanted, extrapolate=False)
    if len(passed):
        return float(passed[0])
    times = np.linspace(*tacho.span, len(course))
    return float(times[np.abs(course - wanted).argmin()])


def _overall(record: WaveformRecord, time: float, around: float) -> FloatArray:
    """Half the range, and √2 times the root mean square, of each sensor so many s around a time, (C, 2)."""
    first = max(0, int((time - around / 2) * record.rate))
    part = slice(first, max(first + 2, int((time + around / 2) * record.rate)))
    samples = [sensor.samples[part] * sensor.factor for sensor in record.sensors]
    return np.array([(np.ptp(x) / 2, np.sqrt(2.0) * x.std()) for x in samples])


def _doubts(
    record: WaveformRecord,
    vectors: ComplexArray,
    deviation: FloatArray,
    tracked: Orders,
    jitter: float | None,
) -> Iterator[str]:
    """What 1× (P, C) does not tell; with the jitter of the tacho, degrees, where the speed is steady."""
    moves = np.abs(tracked.curve(tracked.centres)[:, 1] / tracked.mean[1] - 1).max(axis=0)
    for c, sensor in enumerate(record.sensors):
        if not (np.abs(vectors[:, c]) > TOLD * deviation[:, c]).any():
            yield (
                f"1× of {sensor.name!r} cannot be told from noise: is the sensor connected, and are the "
                "pulses a turn right?"
            )
        elif jitter is not None and moves[c] > MOVES + TOLD * np.radians(jitter):
            yield (
                f"1× of {sensor.name!r} moves by up to {100 * moves[c]:.0f} % while the speed is steady: the "
                "mean is given; has the machine settled?"
            )
        elif jitter is None and tracked.fast[c]:
            yield (
                f"1× of {sensor.name!r} is hardly told along the run-up: there is strong noise near it, or "
                "the speed passes a resonance within so few turns that vectors there are too small"
            )


def _checked(sensor: Channel) -> Iterator[str]:
    """Refuse a channel that reads nothing; say that one is clipped."""
    x: AnyArray = sensor.samples
    low, high = x.min(), x.max()
    if not (np.isfinite(low) and np.isfinite(high)):
        raise ValueError(f"sensor {sensor.name!r} has samples that are no finite numbers")
    if low == high:
        raise ValueError(
            f"sensor {sensor.name!r} reads {low:.6g} throughout: it is dead or not connected; leave it out"
        )
    reach = (float(high) - float(low)) / 100
    for end, near in ((high, x >= high - reach), (low, x <= low + reach)):
        at = int(np.count_nonzero(x == end))
        if at > PILED and 2 * at > np.count_nonzero(near) > at:
            yield (
                f"sensor {sensor.name!r} is clipped at {float(end) * sensor.factor:.4g}, {at} samples: "
                "its vectors are too small there; choose a wider range"
            )
