"""The tacho: edges of its marks, turns counted over missing and double pulses, the shaft's angle over time.

Edges are where the signal leaves a band of hysteresis, between two samples by straight lines. Their times are
smoothed over the number of the pulse: a sampled mark is off by up to half a sample, a worn one by more, and
the curve takes the mean over as many turns as the speed stays smooth. Where a turn has several pulses, each
has an offset of its own, which is estimated: marks need not be even.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from scipy.interpolate import CubicSpline
from scipy.ndimage import median_filter

from rotorid.base.arrays import AnyArray, FloatArray, IntArray
from rotorid.base.text import counted
from rotorid.waveforms.record import Channel, Edge, TachoSettings
from rotorid.waveforms.smoothing import smooth

HYSTERESIS = 0.15
"""Half of the band, over the height of the pulses."""
SHARP = 0.9
"""Edges from one sample to the next are higher than this share of the pulses."""
EXTREMES = (0.2, 99.8)
"""Per cent of the samples between which the levels are."""
MOST_LEFT_OUT = 0.3
"""Share of pulses too many; more do not belong to a mark a turn."""
UNEVEN = 0.005
"""Turns, and half a sample: pulses that scatter by more are worn, of several marks, or of no mark."""
RESTING = 0.5
"""Share of the samples that are within the band where the level is no edge but where the signal rests."""
LEAST_PULSES, LEAST_TURNS = 8, 2
WINDOW = 25
"""The median of so many periods is the usual one there."""
SKIPPED, OFF = 4, 0.25
"""At most so many pulses in a row are too many; a period that is off a whole number of usual ones by so much
is as bad as a pulse too many or a missing one."""
NEAR, UNCOUNTED, SILENT = 4, 0.3, 12.5
"""Where pulses are missing a period is a whole number of usual ones, of so many turns on both sides, but for
this; not more than so many."""
LONGEST_MARK = (0.45, 0.55)
"""Between these shares of a turn the mark may be either level."""
ROUNDS = 3
"""In which offsets of pulses, how they scatter, and the angle are found by turns."""
RARE, CLEARLY, EVEN = 0.3, 5.0, 0.02
"""A tooth that shows in fewer turns is not there; a gap is the longest if it is longer by so many standard
deviations of the mean, and so much of an even one."""
EXACT, OUTLYING, WIDE = 1e-8, 15.0, 5.0
"""No pulse counts as more exact, turns; squares count for no more, over their median, in their scatter, and
distances of a mark's edges not at all beyond so many times theirs."""
CHUNK = 1 << 20


@dataclass(frozen=True, eq=False)
class Tacho:
    """The angle of a shaft over time, as a tacho tells.

    Attributes
    ----------
    times, turns
        Of the pulses that count, s, and the turn that each begins (a fraction within a turn), (P,).
    missing, double
        Turns of pulses that are not there, and times of those that are too many.
    level
        Of the edges, in the numbers of the record.
    jitter_deg
        Standard deviation of a pulse, degrees of a turn (median over the record).
    offset_s
        Standard deviation of all pulses together, that of their mean: sharp edges are somewhere between two
        samples, and at a speed that goes with the sampling rate many pulses tell no more than a few: it is
        that of the widest part of a sample in which there is no edge.
    warnings
        What the user should know.
    angle
        Turns over time, s.
    errors, widths
        Standard deviation of the angle, turns, at its knots, and over how many turns it is a mean.
    indexed
        Whether angle 0 is the same in every record: not with several even pulses a turn.
    """

    times: FloatArray
    turns: FloatArray
    missing: FloatArray
    double: FloatArray
    level: float
    jitter_deg: float
    offset_s: float
    warnings: tuple[str, ...]
    angle: CubicSpline
    errors: FloatArray
    widths: FloatArray
    indexed: bool

    @property
    def span(self) -> tuple[float, float]:
        """Times between which turns are known, s."""
        return float(self.times[0]), float(self.times[-1])

    def turn_at(self, t: FloatArray) -> FloatArray:
        """Turns (whole where the mark passes) at times within the span, s."""
        return np.asarray(self.angle(t))

    def time_at(self, turns: FloatArray) -> FloatArray:
        """Times of turns, s."""
        return np.asarray(np.interp(turns, self.turn_at(self.angle.x), self.angle.x))

    def speed_at(self, t: FloatArray) -> FloatArray:
        """Turns per s."""
        return np.asarray(self.angle(t, 1))

    def error_at(self, t: FloatArray, over: FloatArray | float = 0.0) -> FloatArray:
        """Standard deviation, turns; of the mean over some turns less: squares of widths of means add."""
        error, width = (np.interp(t, self.angle.x, each) for each in (self.errors, self.widths))
        return np.asarray(error / (1 + (over / width) ** 2) ** 0.25)


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
    pulses = settings.pulses
    level, band = _levels(channel, settings)
    rising, falling, sharp = _edges(channel.samples, level, band)
    count, least = min(len(rising), len(falling)), max(LEAST_PULSES, LEAST_TURNS * pulses + 1)
    if count < least:
        raise ValueError(
            f"the tacho {channel.name!r} has {count} pulses across {level:.4g}: "
            f"at least {least} are needed (is this the tacho's channel, and the level right?)"
        )
    every, words = _marks(rising / rate, falling / rate, settings.edge)
    kept, index = _counted(every, pulses, channel.name)
    times, kind, double = every[kept], index % pulses, np.delete(every, kept)
    edges = np.sort(np.concatenate((rising, falling))) / rate
    other = edges[np.minimum(np.searchsorted(edges, times, "right"), len(edges) - 1)]
    fit = _fitted(times, other, index, pulses, sharp / (12 * rate**2))
    speed = fit.angle(times, 1)
    jitter = float(np.sqrt(np.median(fit.variance)))
    many = np.bincount(kind, minlength=pulses)
    present = np.flatnonzero(many >= RARE * many.max())
    # the turn begins after the longest gap, of a tooth that is not there, say
    marks = present / pulses + fit.offsets[present]
    gaps = np.diff(marks, append=marks[0] + 1)
    second, first = np.sort(np.append(gaps, 0))[-2:]
    clear = EVEN / pulses + CLEARLY * jitter * np.sqrt(2 / many[present].min())
    indexed = pulses == 1 or bool(first - second > clear)
    begin = marks[(gaps.argmax() + 1) % len(marks)] if indexed else 0.0
    fit.angle.c[-1] -= begin
    lost = np.setdiff1d(np.arange(index[-1] + 1), index)
    lost = lost[np.isin(lost % pulses, present)]
    places = np.sort((fit.ahead / speed * rate)[kind == present[0]] % 1)
    unseen = sharp * np.diff(places, append=places[0] + 1).max() / rate / np.sqrt(12)
    if jitter > UNEVEN + np.median(speed) / rate / 2:
        words.append(
            f"the tacho's pulses scatter by {360 * jitter:.2g}° around even turns: are there other marks "
            f"than {counted(pulses, 'pulse')} a turn (pulses), is a mark worn, or is it noise (tacho_level)? "
            f"Along the record phases of 1× are uncertain by ± {360 * np.median(fit.errors):.2g}°"
        )
    damage = (len(lost), "missing, which were bridged"), (len(double), "too many, which were left out")
    if damaged := " and ".join(f"{counted(n, 'pulse')} of the tacho {verb}" for n, verb in damage if n):
        share = 100 * (len(lost) + len(double)) / len(index)
        words.append(f"{damaged} ({share:.2g} % of {len(index)})")
    if not indexed:
        words.append(
            f"the tacho's {pulses} pulses a turn are alike: phases are known but for multiples of "
            f"{360 / pulses:.4g}°, and those of different records cannot be compared"
        )
    return Tacho(
        times=times,
        turns=index / pulses + fit.offsets[kind] - begin,
        missing=lost / pulses - begin,
        double=double,
        level=level,
        jitter_deg=360 * jitter,
        offset_s=float(np.hypot(unseen, np.sqrt(fit.worn / len(times)) / np.median(speed))),
        warnings=tuple(words),
        angle=fit.angle,
        errors=fit.errors,
        widths=fit.widths,
        indexed=indexed,
    )


class _Fit(NamedTuple):
    """The angle, its errors and widths; offsets of a turn's pulses; pulses less the angle and their variance.

    In turns²; and the variance of worn marks.
    """

    angle: CubicSpline
    errors: FloatArray
    widths: FloatArray
    offsets: FloatArray
    ahead: FloatArray
    variance: FloatArray
    worn: float


def _fitted(times: FloatArray, other: FloatArray, index: IntArray, pulses: int, sampled: float) -> _Fit:
    """The angle of pulses with these numbers; `sampled` is the variance of their times, s².

    `other` are the marks' other edges, which tell as much, where they keep their distance.
    """
    grid, kind = np.arange(index[-1] + 1), index % pulses
    many = np.maximum(np.bincount(kind, minlength=pulses), 1)
    angle = trend = np.polynomial.Polynomial.fit(times, index / pulses, 2)
    place, offsets = np.interp(grid, index, times), np.zeros(pulses)
    variance = np.full(len(times), np.mean(trend.deriv()(times) ** 2))
    weights, data = np.zeros((2, len(grid)))
    for _ in range(ROUNDS):
        apart = angle(other) - angle(times)
        apart -= np.median(apart)
        usual = np.abs(apart) < WIDE * np.median(np.abs(apart)) + EXACT
        early, late = np.array_split(apart[usual], 2)
        if np.abs(early.mean() - late.mean()) > WIDE * np.std(apart[usual]) / np.sqrt(len(early)):
            usual[:] = False
        ahead = index / pulses + offsets[kind] - trend(times)
        weights[index], data[index] = 1 / variance, ahead - usual * apart / 2
        curve = smooth(weights, data)
        angle = CubicSpline(place, curve.curve + trend(place))
        ahead -= curve.curve[index]
        offsets -= np.bincount(kind, ahead, pulses) / many
        offsets -= offsets[0]
        edge = sampled * angle(times, 1) ** 2
        worn = max(0.0, np.minimum(ahead**2, OUTLYING * np.median(ahead**2)).mean() - edge.mean())
        variance = edge + worn + EXACT**2
    widths = 1 / (pulses * np.maximum(curve.shares, EXACT))
    return _Fit(angle, curve.errors, widths, offsets, ahead, variance, worn)


def _levels(channel: Channel, settings: TachoSettings) -> tuple[float, float]:
    """Where edges are, and half the band of hysteresis, in the numbers of the record."""
    some = np.asarray(channel.samples[:: max(1, len(channel.samples) // CHUNK)], dtype=np.float64)
    low, high = np.percentile(some, EXTREMES)
    if not high > low:
        raise ValueError(f"the tacho {channel.name!r} has no pulses: it reads {low:.4g} throughout")
    at = float((low + high) / 2 if settings.level is None else settings.level)
    if not low < at < high:
        raise ValueError(f"tacho_level must be between {low:.4g} and {high:.4g}, the levels of the pulses")
    band = float(HYSTERESIS * (high - low))
    if np.mean(np.abs(some - at) < band) > RESTING and settings.edge not in ("rising", "falling"):
        raise ValueError(
            f"the tacho {channel.name!r} rests near {at:.4g} and its pulses go both ways, as of a magnetic "
            "pickup: say edge = rising or falling, whichever is the steeper, or another tacho_level"
        )
    return at, band


def _edges(samples: AnyArray, level: float, band: float) -> tuple[FloatArray, FloatArray, bool]:
    """Places (in samples, with fractions) where the signal rises and falls through the level, for good.

    And whether the edges are so sharp that the samples do not say where between two of them they are.
    """
    above = samples > level
    clear = np.flatnonzero((samples > level + band) | (samples < level - band))
    change = np.flatnonzero(above[clear[1:]] != above[clear[:-1]]) + 1
    place = clear[change]
    crossed = np.flatnonzero(above[1:] != above[:-1])
    before = crossed[np.searchsorted(crossed, place) - 1]
    x, y = (samples[before + k].astype(np.float64) for k in (0, 1))
    at, up = before + (level - x) / (y - x), above[place]
    sharp = len(at) > 0 and bool(np.median(np.abs(y - x)) > SHARP * band / HYSTERESIS)
    return at[up], at[~up], sharp


def _marks(rising: FloatArray, falling: FloatArray, edge: Edge) -> tuple[FloatArray, list[str]]:
    """Where each pulse has its angle 0, and what to say where its mark may be either level."""
    if edge in ("rising", "falling"):
        return rising if edge == "rising" else falling, []
    after = falling[falling > rising[0]][:-1]
    share = float(np.median((after - rising[: len(after)]) / np.diff(rising)[: len(after)]))
    begins, ends = (rising, falling) if share < LONGEST_MARK[1] else (falling, rising)
    words = []
    if LONGEST_MARK[0] < share < LONGEST_MARK[1]:
        words.append(
            f"the tacho is high for {100 * share:.0f} % of the time, so that either level may be the mark: "
            "high is taken (say edge = rising or falling)"
        )
    ends = ends[ends > begins[0]]
    middles = (begins[: len(ends)] + ends) / 2
    return {"leading": begins, "trailing": ends, "centre": middles}[edge], words


def _counted(begin: FloatArray, pulses: int, name: str) -> tuple[IntArray, IntArray]:
    """Which pulses count, and the number of each.

    The chain of pulses whose periods are best made of whole usual ones, with the fewest left out and missing.
    """
    turn = (begin[pulses:] - begin[:-pulses]) / pulses
    usual = np.pad(median_filter(turn, WINDOW, mode="nearest"), (0, pulses - 1), "edge")
    usual, back = np.append(usual, np.inf), np.arange(1, SKIPPED + 2)
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
    chain = [int(np.argmin(best + np.arange(len(begin))[::-1]))]
    while link[chain[-1]] >= 0:
        chain.append(int(link[chain[-1]]))
    kept = np.array(chain[::-1])
    if len(begin) - len(kept) > MOST_LEFT_OUT * len(begin):
        raise ValueError(
            f"only {len(kept)} of {len(begin)} pulses of the tacho {name!r} follow each other as "
            f"{counted(pulses, 'pulse')} a turn do: is that number right, and the tacho_level (where marks "
            "bounce, or differ in height)?"
        )
    times = begin[kept]
    apart = np.diff(times)
    count = np.maximum(np.rint(apart / usual[kept[:-1]]), 1)
    index = np.append(0, np.cumsum(count)).astype(np.int64)
    # the usual period beside each, by these numbers: a wheel that lacks a tooth has fewer pulses a turn
    here = np.arange(len(apart))
    low, high = np.maximum(here - NEAR * pulses, 0), np.minimum(here + 1 + NEAR * pulses, len(apart))
    ratio = apart * (index[high] - index[low] - count) / (times[high] - times[low] - apart)
    unclear = (count > 1) & (np.abs(ratio - count) > UNCOUNTED) | (count > SILENT)
    if unclear.any():
        i = int(unclear.argmax())
        raise ValueError(
            f"the tacho {name!r} is silent from {times[i]:.4g} to {times[i + 1]:.4g} s, about "
            f"{ratio[i]:.1f} pulses: turns cannot be counted over this, so that phases before and after "
            "do not belong together; cut the record there"
        )
    return kept, index
