"""Critical speeds beside the operating range: which are too near, and what was not searched.

Peaks of several readings at one critical speed are one; what keeps one from saying that all are far enough is
said with what to do.
"""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from fem import CRITICALLY_DAMPED, LARGEST_MARGINS, Peak, Peaks, separation
from rotorid.base.json import plain
from rotorid.base.tables import Column, Table
from rotorid.base.text import RPM, listing, rpm_text

_NARROW = 0.01  # half of the half-power band, relative, of a peak that shows no end of it, beside others


def critical_peaks(names: Sequence[str], peaks: Sequence[Peaks]) -> list[tuple[str, Peak]]:
    """One peak of each critical speed, ascending, with the name of the reading that shows it.

    Peaks of different readings belong to one critical speed where each lies in the half-power band of the
    other. Shown is one that is not far enough, if any, else the largest with an amplification factor.

    Parameters
    ----------
    names, peaks
        Of each reading: its name and its peaks.

    Returns
    -------
    Name of the reading and peak, by rising speed.
    """
    every = [(name, peak) for name, each in zip(names, peaks, strict=False) for peak in each.peaks]
    groups, low, high = list[dict[str, Peak]](), np.inf, 0.0
    for name, peak in sorted(every, key=lambda one: one[1].speed):
        below, above = (None, None) if peak.undamped else (peak.below, peak.above)  # which are rounding
        beside = low >= (below or peak.speed * (1 - _NARROW)) and peak.speed <= high
        if not beside or name in groups[-1]:
            groups.append({})
        groups[-1][name], low = peak, peak.speed
        high = above or low * (1 + _NARROW)

    def rank(one: tuple[str, Peak]) -> tuple[bool, bool, float]:
        return one[1].enough is not False, not one[1].amplification, -one[1].amplitude

    return [min(group.items(), key=rank) for group in groups]


def open_question(peaks: Iterable[Peak], first: float, last: float, operating: tuple[float, float]) -> str:
    """Why one cannot say that all critical speeds are far enough from the operating range, and what to do.

    Empty where one can. Speeds were searched from `first` to `last`; all in rad/s.

    Parameters
    ----------
    peaks
        One of each critical speed.
    first, last
        Between which speeds was searched, rad/s.
    operating
        Operating range, rad/s.

    Returns
    -------
    Clauses; empty where one can say it.
    """
    reasons = [unsearched(first, last, operating)]
    ends = [
        first,
        last,
        operating[0] * (1 - LARGEST_MARGINS[0] / 100),
        operating[1] * (1 + LARGEST_MARGINS[1] / 100),
    ]
    for peak in peaks:
        if peak.enough is None and separation(peak.speed, operating) < LARGEST_MARGINS[1]:
            reasons.append(f"no amplification factor at {rpm_text(peak.speed)}")
            # What has not fallen to 0.707 over this distance is critically damped.
            sides = {-1: peak.below, 1: peak.above}
            ends += [peak.speed * (1 + way / CRITICALLY_DAMPED) for way in sides if sides[way] is None]
    advice = f"give speeds from {min(ends) * RPM:.0f} to {max(ends) * RPM:.0f} rpm"
    if (first, last) == (min(ends), max(ends)):
        advice = "read it where it stands alone"
    return "; ".join(filter(None, [*reasons, advice])) if any(reasons) else ""


@dataclass(frozen=True)
class Separation:
    """Critical speeds beside the operating range, all in rad/s, and why more may lie in it.

    Attributes
    ----------
    speeds
        Critical speeds, rad/s.
    operating
        Lowest and highest operating speed, rad/s.
    doubt
        Why more may lie in the range; else empty.
    """

    speeds: Iterable[float]
    operating: tuple[float, float]
    doubt: str = ""

    @property
    def away(self) -> list[tuple[float, float]]:
        """How far each is from the range, in percent of its nearest end, and the speed; the nearest first."""
        return sorted((separation(speed, self.operating), speed) for speed in self.speeds)

    def to_dict(self) -> dict[str, Any]:
        """Which speeds lie in the range, and how far off the others are, in percent of its nearest end."""
        rows = [
            {"speed_rad_s": speed, "inside": away == 0, "separation_percent": away}
            for away, speed in sorted(self.away, key=lambda row: row[1])
        ]
        return plain({"range_rad_s": self.operating, "critical_speeds": rows})

    def tables(self) -> tuple[Table, ...]:
        """How far each is from the range, the nearest first."""
        columns = (
            Column("rpm", [speed * RPM for _, speed in self.away], "{:.6g}".format),
            Column("away, %", [away for away, _ in self.away], "{:.1f}".format),
        )
        return (Table("how far each is from the operating range", columns),)

    def sentence(self) -> str:
        """Whether one lies in the range, and which is nearest."""
        low, high = self.operating
        within = f"the operating range {low * RPM:.6g} to {rpm_text(high)}"
        inside = [rpm_text(speed) for away, speed in self.away if away == 0]
        if inside:
            return f"INSIDE {within}: {listing(inside, 'and')}."
        if self.doubt:
            return f"NOT KNOWN whether a critical speed lies in {within}: {self.doubt}."
        if not self.away:
            return f"No critical speed was found beside {within}."
        away, nearest = self.away[0]
        return f"None lies in {within}; the nearest, {rpm_text(nearest)}, is {away:.1f} % away."


def unsearched(first: float, last: float, operating: tuple[float, float]) -> str:
    """What keeps one from saying that nothing is in an operating range: speeds that were not searched.

    Parameters
    ----------
    first, last
        Between which speeds was searched, rad/s.
    operating
        Operating range, rad/s.

    Returns
    -------
    A clause; empty where all of the range was searched.
    """
    if first <= operating[0] * (1 + 1e-6) and operating[1] <= last * (1 + 1e-6):
        return ""
    return f"only speeds from {first * RPM:.6g} to {rpm_text(last)} were searched"
