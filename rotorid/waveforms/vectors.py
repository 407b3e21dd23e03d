"""Vectors of a record: 1× and other orders with their errors, at a steady speed or along a run-up."""

from __future__ import annotations

import itertools
from collections.abc import Iterator, Sequence
from dataclasses import dataclass

import numpy as np
from scipy.integrate import cumulative_trapezoid

from rotorid.base.arrays import AnyArray, BoolArray, ComplexArray, FloatArray
from rotorid.base.logs import progress
from rotorid.base.text import listing
from rotorid.waveforms.order_tracking import Orders, track_orders
from rotorid.waveforms.record import Channel, TachoSettings, WaveformRecord
from rotorid.waveforms.signal_path import before_path, response
from rotorid.waveforms.tacho import Tacho, read_tacho

STEADY, WINDOWS, CALM = 0.01, 20, 8
"""A record whose speed, in so many windows, stays within this share of it has one vector; windows are so long
that jitter of the tacho is that much less."""
PART, MOST_PLACES = 1 << 16, 500
"""Samples at a time; places at which the turns that count are found."""
HIGHEST = 0.45
"""Of the sampling rate: beyond, an order is not what the samples hold."""
NEAR_TOP, PILED = 0.01, 0.65
"""So many of the samples in this uppermost share of the range are equal where a channel is clipped."""
LEAST_TURNS = 2.0
"""Over which the overall level is taken."""
MOVES = 0.1
"""A vector that moves by more, of its size, at a steady speed is worth a word, beside jitter of the tacho."""
TOLD = 3.0


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
        return _found(record, settings, tuple(orders), derivative, speeds)
    except ValueError as error:
        raise ValueError(f"{record.source}: {error}") from None


def _found(
    record: WaveformRecord,
    settings: TachoSettings,
    orders: tuple[int, ...],
    derivative: int | None,
    speeds: FloatArray | None,
) -> Vectors:
    if record.tacho is None:
        raise ValueError("a tacho channel is needed: without one there are no turns, and no phase")
    tacho = read_tacho(record.tacho, record.rate, settings)
    begin, end = (round(t * record.rate) for t in tacho.span)
    words = [*tacho.warnings, *(word for sensor in record.sensors for word in _checked(sensor))]
    own = tacho.angle.speed(np.linspace(*tacho.span, 2 + len(tacho.times)))
    if max(orders) * own.max() > HIGHEST * record.rate:
        raise ValueError(
            f"{max(orders)}× is {max(orders) * own.max():.4g} Hz at the highest speed, beyond "
            f"{HIGHEST:g} of the {record.rate:.6g} samples a second"
        )

    def parts() -> Iterator[tuple[FloatArray, FloatArray]]:
        for start in range(begin, end, PART):
            stop = min(end, start + PART)
            progress.info("%s at %.0f %%", record.run, 100 * (start - begin) / (end - begin))
            turns = tacho.turn_at(np.arange(start, stop) / record.rate)
            yield turns, np.stack([c.samples[start:stop] * c.factor for c in record.sensors], axis=1)

    first, last = tacho.turn_at(np.array([begin, end - 1]) / record.rate)
    tracked = track_orders(parts, float(first), float(last), max(orders))
    course = _course(tacho, settings.pulses)
    steady = bool(np.ptp(course) < STEADY * course.mean())
    own = np.clip(own, course.min(), course.max()) if steady else own
    places = np.linspace(tracked.first, tracked.last, min(len(tracked.density), MOST_PLACES) + 1)
    width = tracked.width(places)
    if speeds is not None:
        times = _passed(tacho, own, speeds)
    elif steady:
        times = np.array([np.mean(tacho.span)])
    else:
        times = _independent(tacho, places, width)
    turns = tacho.turn_at(times)
    wide = np.interp(turns, places, width)
    edge = np.minimum(turns - tracked.first, tracked.last - turns) < wide / 2 * (1 - 1e-9)
    rate = tacho.angle.speed(times)
    if steady:
        wide, edge = np.full(len(times), last - first), np.zeros(len(times), dtype=bool)
        rate = np.full(len(times), (last - first) * record.rate / (end - 1 - begin))
    nearby = np.stack((times, np.maximum(wide, LEAST_TURNS) / rate), axis=1)
    before, after = (np.clip(times + side * wide / rate, *tacho.span) for side in (-0.5, 0.5))
    rise = (tacho.angle.speed(after) - tacho.angle.speed(before)) / (after - before)
    vectors, deviation, gap = _before_paths(record, tracked, orders, derivative, turns, rate, rise, steady)
    drawn = np.zeros(len(times)) if steady else tacho.angle.deviation(times)
    angle = 2 * np.pi * np.hypot(drawn, tacho.offset_s * rate)
    across = np.hypot(deviation, np.abs(vectors) * np.multiply.outer(angle, orders)[:, None, :])
    moves = MOVES + TOLD * np.radians(tacho.jitter_deg) if steady else np.inf
    words += _said(record, vectors, deviation, tracked, moves)
    same = np.array([derivative in (None, sensor.derivative) for sensor in record.sensors])
    overall = np.where(same[:, None], [_overall(record, *each) for each in nearby], np.nan)
    return Vectors(
        run=record.run,
        sensors=tuple(sensor.name for sensor in record.sensors),
        orders=orders,
        times=times,
        speeds=2 * np.pi * rate,
        vectors=vectors,
        radial=deviation,
        tangential=across,
        turns=wide,
        overall=overall,
        gap=np.where(same, gap, np.nan),
        end=edge,
        steady=steady,
        range=2 * np.pi * np.array([own.min(), own.max()]),
        tacho=tacho,
        warnings=tuple(words),
    )


def _course(tacho: Tacho, pulses: int) -> FloatArray:
    """Mean speeds of windows, turns per s."""
    jitter = CALM / STEADY * np.sqrt(2) * tacho.jitter_deg / 360 * pulses
    step = max(1, len(tacho.times) // WINDOWS, min(int(jitter), len(tacho.times) // 3))
    return np.asarray(np.diff(tacho.turns[::step]) / np.diff(tacho.times[::step]))


def _passed(tacho: Tacho, own: FloatArray, speeds: FloatArray) -> FloatArray:
    """Times at which the speed first is each of these, rad/s."""
    at, times = np.linspace(*tacho.span, len(own)), []
    for speed in speeds / (2 * np.pi):
        if not own.min() * (1 - STEADY / 2) <= speed <= own.max() * (1 + STEADY / 2):
            raise ValueError(
                f"there is no speed of {speed * 60:.6g} rpm: the record runs from {own.min() * 60:.6g} to "
                f"{own.max() * 60:.6g} rpm"
            )
        above = own >= speed
        change = np.flatnonzero(above[1:] != above[:-1])
        if len(change):
            i = int(change[0])
            times.append(at[i] + (speed - own[i]) / (own[i + 1] - own[i]) * (at[i + 1] - at[i]))
        else:
            times.append(at[np.abs(own - speed).argmin()])
    return np.array(times)


def _independent(tacho: Tacho, places: FloatArray, width: FloatArray) -> FloatArray:
    """Times of vectors that share no turns, the first and the last half their turns from the ends."""
    counted = cumulative_trapezoid(1 / width, places, initial=0.0)
    number = max(2, int(counted[-1]))
    turns = np.interp((np.arange(number) + 0.5) * counted[-1] / number, counted, places)
    dense = np.linspace(*tacho.span, 4 * len(places))
    return np.asarray(np.interp(turns, tacho.turn_at(dense), dense))


def _before_paths(
    record: WaveformRecord,
    tracked: Orders,
    orders: tuple[int, ...],
    derivative: int | None,
    turns: FloatArray,
    speed: FloatArray,
    rate: FloatArray,
    steady: bool,
) -> tuple[ComplexArray, FloatArray, FloatArray]:
    """Vectors and their deviations, (P, C, K), and means (P, C), without what the channels' paths did."""
    read, change = tracked.spline(turns), tracked.spline(turns, 1) * speed[:, None, None]
    deviation = np.stack([tracked.deviation(turns, k) for k in orders], axis=2)
    if steady:
        means, deviations = tracked.mean()
        read = np.repeat(means[None], len(turns), 0)
        deviation = np.repeat(deviations[None, list(orders)].swapaxes(1, 2), len(turns), 0)
        change, rate = 0 * read, 0 * rate
    vectors = np.empty((len(turns), len(record.sensors), len(orders)), dtype=complex)
    errors, gap = np.empty(vectors.shape), read[:, 0].real.copy()
    for c, sensor in enumerate(record.sensors):
        more = 0 if derivative is None or sensor.derivative is None else sensor.derivative - derivative
        H = response(sensor.path, more)
        if more or sensor.path.high_pass_rad_s is not None:
            gap[:, c] = np.nan
        for place, k in enumerate(orders):
            w, dw = 2 * np.pi * k * speed, 2 * np.pi * k * rate
            vectors[:, c, place], scale = before_path(H, read[:, k, c], change[:, k, c], w, dw)
            errors[:, c, place] = deviation[:, c, place] * scale
    return vectors, errors, gap


def _overall(record: WaveformRecord, time: float, around: float) -> FloatArray:
    """Half the range, and √2 times the root mean square, of each sensor so many s around a time, (C, 2)."""
    first = max(0, int((time - around / 2) * record.rate))
    part = slice(first, max(first + 2, int((time + around / 2) * record.rate)))
    samples = [sensor.samples[part] * sensor.factor for sensor in record.sensors]
    return np.array([(np.ptp(x) / 2, np.sqrt(2.0) * x.std()) for x in samples])


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
    reach = NEAR_TOP * (float(high) - float(low))
    for end, near in ((high, x >= high - reach), (low, x <= low + reach)):
        close = x[near]
        at = int(np.count_nonzero(close == end))
        if at > PILED * len(close) and at > 10 and len(np.unique(close)) > 2:
            yield (
                f"sensor {sensor.name!r} is clipped at {float(end) * sensor.factor:.4g}, {at} samples: "
                "its vectors are too small there; choose a wider range"
            )


def _said(
    record: WaveformRecord, vectors: ComplexArray, deviation: FloatArray, tracked: Orders, moves: float
) -> Iterator[str]:
    """What vectors at 1× do not tell; by what share one of a steady record may move, else infinite."""
    steady = np.isfinite(moves)
    size, error = np.abs(vectors[:, :, 0]), deviation[:, :, 0]
    lost = [sensor.name for c, sensor in enumerate(record.sensors) if (size[:, c] < TOLD * error[:, c]).all()]
    if lost:
        names = listing(map(repr, lost), "and")
        yield (
            f"1× of {names} cannot be told from noise: is the sensor connected, and are the pulses a turn "
            "right?"
        )
    for sensor in () if steady else itertools.compress(record.sensors, tracked.vague()):
        if sensor.name not in lost:
            yield (
                f"1× of {sensor.name!r} is hardly told along the run-up: there is strong noise near it, or "
                "the speed passes a resonance within so few turns that vectors there are too small"
            )
    if steady:
        places = np.linspace(tracked.first, tracked.last, 21)[1:-1]
        course = np.abs(tracked.spline(places)[:, 1] - tracked.mean()[0][1]) / np.abs(tracked.mean()[0][1])
        for c, sensor in enumerate(record.sensors):
            if sensor.name not in lost and course[:, c].max() > moves:
                yield (
                    f"1× of {sensor.name!r} moves by up to {100 * course[:, c].max():.0f} % while the speed "
                    "is steady: the mean is given; has the machine settled?"
                )
