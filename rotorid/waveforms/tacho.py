"""The tacho: edges of its marks, turns counted over missing and double pulses, the shaft's angle over time.

Edges are where the signal leaves a band of hysteresis, between two samples by straight lines. The angle is a
penalised spline through them: a sampled mark is off by up to half a sample, a worn one by more, and the
spline takes the mean over as many turns as the speed stays smooth. Where a turn has several pulses, or a
mark two usable edges, each has an offset of its own, which is estimated: marks need not be even.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np
from scipy.ndimage import median_filter
from scipy.optimize import nnls

from rotorid.base.arrays import AnyArray, FloatArray, IntArray
from rotorid.base.text import counted
from rotorid.waveforms.penalised_spline import Smoothing, band_of, moments, smooth, spline, sums_of
from rotorid.waveforms.record import Channel, Edge, TachoSettings

if TYPE_CHECKING:
    from scipy.interpolate import BSpline

HYSTERESIS = 0.15
"""Half of the band, over the height of the pulses."""
SHARP = 0.9
"""Edges from one sample to the next are higher than this share of the pulses."""
EXTREMES = (1, 99)
"""Per cent of pulses between which sharp edges scatter: over a sample, but for an offset of all of them."""
MOST_LEFT_OUT = 0.3
"""Share of pulses too many; more do not belong to a mark a turn."""
UNEVEN = 0.015
"""Turns, and a sample; pulses that scatter by more are of several marks, or of no mark."""
RESTING = 0.5
"""Share of the samples that are within the band where the level is no edge but where the signal rests."""
LEAST_PULSES, LEAST_TURNS = 8, 2
WINDOW = 25
"""The median of so many intervals between pulses is the usual one there."""
SKIPPED, OFF = 4, 0.25
"""At most so many pulses in a row are too many; an interval that is off a whole number of usual ones by so
much is as bad as a pulse too many or a missing one."""
UNCOUNTED, SILENT = 0.3, 12.5
"""Where pulses are missing an interval is a whole number of usual ones, but for this; and not more than so
many."""
LONGEST_MARK = (0.45, 0.55)
"""Between these shares of a turn the mark may be either level."""
KNOT = 2.0
"""Turns between two knots of the angle, at the highest speed."""
BACKFITTING = 3
"""Rounds in which offsets of pulses, how pulses scatter, and the angle are found by turns."""
RARE, CLEARLY, EVEN = 0.3, 5.0, 0.02
"""A tooth that shows in fewer turns is not there; a gap is the longest if it is longer by so many standard
deviations of the mean, and so much of an even one."""
EXACT = 1e-8
"""Turns; no pulse counts as more exact."""
OUTLYING = 15.0
"""Squares count for no more, over their median, in the variance of pulses."""
PARTS, MOST_CHI_SQUARE = 10, 30.0
"""The distance of a mark's edges is compared between so many parts of the record."""
CHUNK = 1 << 20


@dataclass(frozen=True, eq=False)
class Angle:
    """Turns over time: a parabola and a penalised spline."""

    start: float
    step: float
    trend: FloatArray
    spline: BSpline
    smoothing: Smoothing

    def turns(self, t: FloatArray) -> FloatArray:
        """At these times."""
        return np.asarray(np.polyval(self.trend, t - self.start) + self.spline(t))

    def speed(self, t: FloatArray) -> FloatArray:
        """Turns per s."""
        return np.asarray(np.polyval(np.polyder(self.trend), t - self.start) + self.spline(t, 1))

    def deviation(self, t: FloatArray) -> FloatArray:
        """Standard deviation, turns."""
        return self.smoothing.deviation((t - self.start) / self.step)


@dataclass(frozen=True, eq=False)
class Tacho:
    """The angle of a shaft over time, as a tacho tells.

    Attributes
    ----------
    times, turns
        Of the pulses that count, s, and the turn that each begins (a fraction within a turn), (P,).
    missing, double
        Turns of pulses that are not there, and times of those that are too many.
    level, hysteresis
        In the numbers of the record: edges are at the level, and count beyond the band around it.
    jitter_deg
        Standard deviation of a pulse, degrees of a turn (median over the record).
    offset_s
        Standard deviation of all pulses together, that of their mean: sharp edges are somewhere between two
        samples, and at a speed that goes with the sampling rate no pulse tells more than another.
    warnings
        What the user should know.
    angle
        Over time.
    indexed
        Whether angle 0 is the same in every record: not with several even pulses a turn.
    """

    times: FloatArray
    turns: FloatArray
    missing: FloatArray
    double: FloatArray
    level: float
    hysteresis: float
    jitter_deg: float
    offset_s: float
    warnings: tuple[str, ...]
    angle: Angle
    indexed: bool = True

    @property
    def span(self) -> tuple[float, float]:
        """Times between which turns are known, s."""
        return float(self.times[0]), float(self.times[-1])

    def turn_at(self, t: FloatArray) -> FloatArray:
        """Turns (whole where the mark passes) at times within the span, s."""
        return self.angle.turns(t)


def read_tacho(channel: Channel, rate: float, settings: TachoSettings) -> Tacho:
    """Find the turns of a shaft.

    Parameters
    ----------
    channel
        The tacho.
    rate
        Samples a second.
    settings
        Pulses a turn, and where a mark begins.

    Raises
    ------
    ValueError
        For a signal without pulses, with too few, and with gaps over which turns cannot be counted.
    """
    level, band, rests = _levels(channel, settings)
    rising, falling, sharp = _edges(channel.samples, level, band)
    least = max(LEAST_PULSES, LEAST_TURNS * settings.pulses + 1)
    if min(len(rising), len(falling)) < least:
        raise ValueError(
            f"the tacho {channel.name!r} has {min(len(rising), len(falling))} pulses across {level:.4g}: "
            f"at least {least} are needed (is this the tacho's channel, and the level right?)"
        )
    every, ends, words = _marks(rising / rate, falling / rate, settings.edge, rests)
    kept, index = _counted(every, settings.pulses, channel.name)
    times, lost = every[kept], np.setdiff1d(np.arange(index[-1]), index).astype(np.float64)
    indexed = True
    if settings.pulses > 1:
        index, indexed, lost = _from_first_of_turn(times, index, lost, settings.pulses)
    turns, angle, jitter = _angle(times, ends[kept], index, settings)
    speed = angle.speed(times)
    apart = ((turns - angle.turns(times)) / speed)[index % settings.pulses == 0]
    seen = float(np.ptp(np.percentile(apart, EXTREMES)))
    worn = max(0.0, (jitter / np.median(speed)) ** 2 - sharp / (12 * rate**2)) / len(times)
    offset = float(np.hypot(sharp * max(0.0, 1 / rate - seen) / np.sqrt(12), np.sqrt(worn)))
    if jitter > UNEVEN + np.median(speed) / rate:
        words.append(
            f"the tacho's pulses scatter by {360 * jitter:.2g}° around even turns: are there other marks "
            f"than {counted(settings.pulses, 'pulse')} a turn (pulses), or is it noise (tacho_level)?"
        )
    words += _silent(times, speed, len(channel.samples) / rate)
    double = np.delete(every, kept)
    damage = (len(lost), "missing, which were bridged"), (len(double), "too many, which were left out")
    if damaged := " and ".join(f"{counted(n, 'pulse')} of the tacho {verb}" for n, verb in damage if n):
        share = 100 * (len(lost) + len(double)) / len(index)
        words.append(f"{damaged} ({share:.2g} % of {len(index)})")
    if not indexed:
        words.append(
            f"the tacho's {settings.pulses} pulses a turn are alike: phases are known but for multiples of "
            f"{360 / settings.pulses:.4g}°, and those of different records cannot be compared"
        )
    return Tacho(
        times,
        turns,
        lost / settings.pulses,
        double,
        level,
        band,
        360 * jitter,
        offset,
        tuple(words),
        angle,
        indexed,
    )


def _levels(channel: Channel, settings: TachoSettings) -> tuple[float, float, bool]:
    """Where edges are, and half the band of hysteresis, in the numbers of the record; and whether it is there
    that the signal rests.
    """
    some = np.asarray(channel.samples[:: max(1, len(channel.samples) // CHUNK)], dtype=np.float64)
    low, high = np.percentile(some, (0.2, 99.8))
    middle = (low + high) / 2

    def rests(at: float) -> bool:
        return bool(np.mean(np.abs(some - at) < HYSTERESIS * (high - low)) > RESTING)

    if high > low and not rests(middle):
        low, high = np.median(some[some < middle]), np.median(some[some >= middle])
    if not high > low:
        raise ValueError(f"the tacho {channel.name!r} has no pulses: it reads {low:.4g} throughout")
    at = float(middle if settings.level is None else settings.level)
    if not low < at < high:
        raise ValueError(f"tacho_level must be between {low:.4g} and {high:.4g}, the levels of the pulses")
    if rests(at) and settings.edge not in ("rising", "falling"):
        raise ValueError(
            f"the tacho {channel.name!r} rests near {at:.4g} and its pulses go both ways, as of a magnetic "
            "pickup: say edge = rising or falling, whichever is the steeper, or another tacho_level"
        )
    return at, float(HYSTERESIS * (high - low)), rests(at)


def _edges(samples: AnyArray, level: float, band: float) -> tuple[FloatArray, FloatArray, bool]:
    """Places (in samples, with fractions) where the signal rises and falls through the level, for good.

    And whether the edges are so sharp that the samples do not say where between two of them they are.
    """
    entered, state = [], []
    for high, beyond in ((True, samples > level + band), (False, samples < level - band)):
        places = np.flatnonzero(beyond[1:] & ~beyond[:-1]) + 1
        places = np.append(0, places) if beyond[0] else places
        entered.append(places)
        state.append(np.full(len(places), high))
    order = np.argsort(place := np.concatenate(entered))
    place, up = place[order], np.concatenate(state)[order]
    turn = np.flatnonzero(up[1:] != up[:-1]) + 1
    place, up, above = place[turn], up[turn], samples > level
    inside = np.flatnonzero(above[1:] != above[:-1])
    before = inside[np.searchsorted(inside, place) - 1]
    x, y = (samples[before + k].astype(np.float64) for k in (0, 1))
    at = before + (level - x) / (y - x)
    sharp = np.median(np.abs(y - x)) > SHARP * band / HYSTERESIS if len(at) else False
    return at[up], at[~up], bool(sharp)


def _marks(
    rising: FloatArray, falling: FloatArray, edge: Edge, rests: bool
) -> tuple[FloatArray, FloatArray, list[str]]:
    """Where each pulse has its angle 0, its other edge, and what to say about the polarity."""
    after = falling[falling > rising[0]]
    share = float(np.median((after - rising[: len(after)])[:-1] / np.diff(rising)[: len(after) - 1]))
    unclear = LONGEST_MARK[0] < share < LONGEST_MARK[1]
    high = unclear or share < LONGEST_MARK[0]
    words = []
    if edge in ("leading", "trailing", "centre") and unclear:
        words.append(
            f"the tacho is high for {100 * share:.0f} % of the time, so that either level may be the mark: "
            "high is taken (say edge = rising or falling)"
        )
    elif not (unclear or rests) and edge in ("rising", "falling") and (edge == "rising") != high:
        words.append(
            f"the tacho's marks are {'high' if high else 'low'} ({100 * min(share, 1 - share):.0f} % of the "
            f"time), and edge = {edge} is where they end"
        )
    first, second = (rising, falling) if high else (falling, rising)
    if (edge == "trailing") or edge == ("falling" if high else "rising"):
        first, second = second, first
    second = second[second > first[0]]
    first = first[: len(second)]
    if edge == "centre":
        first = second = (first + second) / 2
    return first, second, words


def _usual(begin: FloatArray, pulses: int) -> FloatArray:
    """The usual interval after each pulse but the last, (P − 1,): a turn's, over its pulses."""
    turn = (begin[pulses:] - begin[:-pulses]) / pulses
    return np.asarray(np.pad(median_filter(turn, WINDOW, mode="nearest"), (0, pulses - 1), "edge"))


def _counted(begin: FloatArray, pulses: int, name: str) -> tuple[IntArray, IntArray]:
    """Which pulses count, and the number of each.

    The chain of pulses whose intervals are best made of whole usual ones, with the fewest left out and
    missing.
    """
    back = np.arange(1, SKIPPED + 2)
    usual = np.concatenate((_usual(begin, pulses), [np.inf]))
    source = np.arange(len(begin))[:, None] - back
    apart = (begin[:, None] - begin[source]) / usual[source]
    number = np.maximum(np.rint(apart), 1.0)
    cost = ((apart - number) / OFF) ** 2 + (number - 1) + (back - 1)
    cost[source < 0] = np.inf
    best, link = np.arange(len(begin), dtype=np.float64), np.full(len(begin), -1)
    for i in range(1, len(begin)):
        some = best[source[i]] + cost[i]
        k = int(some.argmin())
        if some[k] < best[i]:
            best[i], link[i] = some[k], source[i, k]
    at = int(np.argmin(best + np.arange(len(begin))[::-1]))
    chain = [at]
    while link[at] >= 0:
        at = int(link[at])
        chain.append(at)
    kept = np.array(chain[::-1])
    if len(begin) - len(kept) > MOST_LEFT_OUT * len(begin):
        raise ValueError(
            f"only {len(kept)} of {len(begin)} pulses of the tacho {name!r} follow each other as "
            f"{counted(pulses, 'pulse')} a turn do: is that number right, and the tacho_level (where marks "
            "bounce, or differ in height)?"
        )
    interval = np.diff(begin[kept]) / usual[kept[:-1]]
    count = np.maximum(np.rint(interval), 1)
    unclear = (count > 1) & (np.abs(interval - count) > UNCOUNTED) | (count > SILENT)
    if unclear.any():
        i = int(unclear.argmax())
        raise ValueError(
            f"the tacho {name!r} is silent from {begin[kept[i]]:.4g} to {begin[kept[i + 1]]:.4g} s, about "
            f"{interval[i]:.1f} pulses: turns cannot be counted over this, so that phases before and after "
            "do not belong together; cut the record there"
        )
    return kept, np.concatenate(([0], np.cumsum(count))).astype(np.int64)


def _from_first_of_turn(
    begin: FloatArray, index: IntArray, lost: FloatArray, pulses: int
) -> tuple[IntArray, bool, FloatArray]:
    """Numbers from a pulse on that tells itself from the others of a turn, whether there is one, the missing.

    It is the one after a tooth that the wheel lacks (which then is not missing), or else after the longest
    gap.
    """
    kind = index % pulses
    present = np.bincount(kind, minlength=pulses)
    if present.min() < RARE * present.max():
        gone = int(present.argmin())
        return index - gone - 1, True, lost[lost % pulses != gone] - gone - 1
    single = np.flatnonzero(np.diff(index) == 1)
    turn = np.interp(index[single] + pulses, index, begin) - begin[single]
    inside = index[single] + pulses <= index[-1]
    gap, kinds = (np.diff(begin)[single] / turn)[inside], kind[single][inside]
    means = np.array([gap[kinds == k].mean() if (kinds == k).any() else 0.0 for k in range(pulses)])
    spread = np.sqrt(np.mean((gap - means[kinds]) ** 2) * pulses / max(len(gap), 1))
    order = np.argsort(means)
    told = bool(means[order[-1]] - means[order[-2]] > CLEARLY * spread + EVEN / pulses)
    first = int(order[-1]) + 1 if told else 0
    return index - first, told, lost - first


def _angle(
    begin: FloatArray, end: FloatArray, index: IntArray, settings: TachoSettings
) -> tuple[FloatArray, Angle, float]:
    """Turn of each pulse, the angle, and the error of a pulse in turns; by both edges of the marks, where
    these keep their distance.
    """
    kind, nominal = index % settings.pulses, index / settings.pulses
    slope = np.gradient(nominal, begin)
    times, base, kinds, rate = begin, nominal, kind, slope
    offsets = np.zeros(2 * settings.pulses)
    if settings.edge != "centre" and _keeps_distance((end - begin) * slope):
        times, base, rate = np.append(begin, end), np.tile(nominal, 2), np.interp(end, begin, slope)
        kinds, rate = np.append(kind, settings.pulses + kind), np.append(slope, rate)
        offsets[settings.pulses :] = np.median((end - begin) * slope)
    order, variance = np.argsort(times, kind="stable"), rate**2
    for _ in range(BACKFITTING):
        angle = _fitted(times[order], (base + offsets[kinds])[order], variance[order])
        left = base + offsets[kinds] - angle.turns(times)
        many = np.maximum(np.bincount(kinds, minlength=len(offsets)), 1)
        offsets -= np.bincount(kinds, left, len(offsets)) / many
        offsets -= offsets[0]
        jitter = float(np.sqrt(angle.smoothing.variance * np.median(variance)))
        variance = _variance(left, rate)
    return nominal + offsets[kind], angle, jitter


def _keeps_distance(apart: FloatArray) -> bool:
    """Whether the two edges of the marks are the same part of a turn apart throughout the record."""
    parts = np.array_split(apart, min(PARTS, len(apart)))
    means, errors = (np.array([f(part) for part in parts]) for f in (np.mean, np.std))
    errors = np.maximum(errors, 1e-9) / np.sqrt([len(part) for part in parts])
    return bool(np.sum(((means - means.mean()) / errors) ** 2) < MOST_CHI_SQUARE)


def _fitted(times: FloatArray, turns: FloatArray, variance: FloatArray) -> Angle:
    """The spline through pulses of these variances, but for a factor."""
    start, size = float(times[0]), np.sqrt(variance)
    trend = np.polyfit(times - start, turns, 2)
    left = (turns - np.polyval(trend, times - start)) / size
    fastest = np.percentile(np.gradient(turns, times), 99)
    intervals = max(1, int(np.ceil((times[-1] - start) * fastest / KNOT)))
    step = (float(times[-1]) - start) / intervals
    gram, right = moments([((times - start) / step, 1 / size[:, None], left[:, None])], intervals)
    smoothing, c = smooth(band_of(gram), sums_of(right)[:, 0, 0].copy(), float(left @ left), len(left))
    return Angle(start, step, trend, spline(start, step, c), smoothing)


def _variance(left: FloatArray, rate: FloatArray) -> FloatArray:
    """Of pulses in turns², from what is left of them: errors of the marks, and of the time they were seen
    at.
    """
    columns = np.stack((np.ones_like(rate), rate**2), axis=1)
    size = np.median(left**2) + EXACT**2
    found = nnls(columns / columns.mean(axis=0), np.minimum(left**2 / size, OUTLYING))[0]
    return np.asarray(np.maximum(columns / columns.mean(axis=0) @ found, 1e-3) * size)


def _silent(begin: FloatArray, speed: FloatArray, end: float) -> Iterator[str]:
    """Say where the record goes on without pulses, unless the machine, as its speed changes, stands there."""
    change = np.gradient(speed, begin)
    ends = (("first", begin[0], speed[0], change[0]), ("last", end - begin[-1], speed[-1], -change[-1]))
    for where, span, own, rise in ends:
        turns = own * span if rise <= 0 else min(own * span, own**2 / (2 * rise))
        if turns > SILENT:
            yield (
                f"the tacho is silent in the {where} {span:.3g} s, about {turns:.0f} turns, which are left "
                "out: are its pulses too low there (tacho_level)?"
            )
