"""Peaks of a response after API 684: critical speed, amplification factor, separation margin.

Definitions of API Recommended Practice 684 (2nd edition, 2005, standard paragraphs SP6.8.2) and API 617: the
critical speed N_c is that of the peak; the amplification factor is AF = N_c / (N₂ − N₁), N₁ and N₂ the speeds
at 0.707 of the peak's amplitude; AF < 2.5 counts as critically damped, and needs no margin. Otherwise the
separation margin, in percent of the nearest operating speed, must be at least

    below the lowest operating speed    17 (1 − 1 / (AF − 1.5)), at most 16,
    above the highest                   10 + 17 (1 − 1 / (AF − 1.5)), at most 26.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np

from rotorid.base.arrays import FloatArray
from rotorid.base.json import plain
from rotorid.base.result import Column, frame, rows, text
from rotorid.base.rpm import RPM, rpm_text
from rotorid.base.tables import Column as Told
from rotorid.base.text import listing

if TYPE_CHECKING:
    import pandas as pd

LARGEST = (16.0, 26.0)  # percent: margins that are enough whatever the amplification, below and above
HALF_POWER = float(np.sqrt(0.5))
_UNDAMPED = 1e5  # an AF beyond which damping is none
UNLIMITED = 1e300  # amplitude of what nothing limits; infinities have no differences
_NO_LIMIT = "practically undamped: AF exceeds 100000, damping does not limit the amplitude"


@dataclass(frozen=True)
class Peak:
    """One peak of a response curve.

    Attributes
    ----------
    speed
        Critical speed N_c, rad/s.
    amplitude
        There, in the unit of the curve.
    below, above
        Speeds N₁ and N₂ at 0.707 of it, rad/s; None where the curve does not show them.
    amplification
        AF; None where N₁ or N₂ is not known, or damping is practically none.
    margin
        Distance to the operating range in percent of its nearest end, 0 inside; None without a range.
    required
        What is required; None where AF is not known or there is no range.
    note
        What is missing, and why; else empty.
    undamped
        Whether AF exceeds 1e5: practically nothing limits the amplitude, which then says nothing.
    """

    speed: float
    amplitude: float
    below: float | None
    above: float | None
    amplification: float | None
    margin: float | None
    required: float | None
    note: str = ""
    undamped: bool = False

    @property
    def enough(self) -> bool | None:
        """Whether the margin is as required; None where this is not known."""
        if self.margin is None or self.required is None:
            return None
        return self.required == 0 or self.margin >= self.required

    @property
    def open(self) -> bool:
        """Whether the margin may be too small although its amplification factor is not known."""
        return self.enough is None and (self.margin is None or self.margin < LARGEST[1])


@dataclass(frozen=True)
class Peaks:
    """All peaks of a response curve, by rising speed.

    Attributes
    ----------
    peaks
        The peaks.
    operating
        Operating range, rad/s, or None.
    """

    peaks: tuple[Peak, ...]
    operating: tuple[float, float] | None

    def to_dict(self) -> dict[str, Any]:
        """Plain data for JSON."""
        return plain({"operating_rad_s": self.operating, "peaks": rows(self._columns())})

    def to_frame(self) -> pd.DataFrame:
        """One row per peak."""
        return frame(self._columns())

    def _columns(self) -> tuple[Column, ...]:
        rpm, speed, *rest = _columns_of(self.peaks)
        return (speed, rpm, *rest)

    def summary(self, unit: str = "", scale: float = 1.0) -> str:
        """The peaks as text, amplitudes times `scale` with the name of their unit."""
        if not self.peaks:
            return "no peak in this range of speeds"
        notes = [f"    {p.speed * RPM:.2f} rpm: {p.note}" for p in self.peaks if p.note]
        return "\n".join([text(_columns_of(self.peaks, unit, scale)), *notes])


def _columns_of(peaks: Sequence[Peak], unit: str = "", scale: float = 1.0) -> tuple[Column, ...]:
    """The table of peaks, amplitudes times `scale` with the name of their unit."""
    one = "{:.1f}".format
    sizes = [None if p.undamped else scale * p.amplitude for p in peaks]
    return (
        Column("speed_rpm", [p.speed * RPM for p in peaks], "{:.2f}".format, "rpm"),
        Column("speed_rad_s", [p.speed for p in peaks], "{:.4f}".format, "rad/s"),
        Column("amplitude", sizes, "{:.4g}".format, f"amplitude, {unit}" if unit else None),
        Column("half_power_rad_s", [(p.below, p.above) for p in peaks]),
        Column("amplification_factor", [p.amplification for p in peaks], "{:.2f}".format, "AF"),
        Column("separation_margin_percent", [p.margin for p in peaks], one, "margin, %"),
        Column("required_margin_percent", [p.required for p in peaks], one, "required, %"),
        Column("enough", [p.enough for p in peaks], _verdict, ""),
        Column("note", [p.note for p in peaks]),
    )


def _verdict(enough: bool) -> str:
    return "enough" if enough else "NOT ENOUGH"


def find_peaks(
    omega: FloatArray,
    A: FloatArray,
    evaluate: Callable[[float], float],
    *,
    operating: tuple[float, float] | None = None,
) -> Peaks:
    """Find the peaks of a response to unbalance, their amplification factors and separation margins.

    Parameters
    ----------
    omega, A
        Speeds, rad/s, ascending, and the amplitude there, shape (S,): they show the peaks.
    evaluate
        The amplitude at any speed between: it says where the peaks and their half-power points are.
    operating
        Lowest and highest operating speed, rad/s.

    Raises
    ------
    ValueError
        For an impossible range of operating speeds.
    """
    if operating is not None:
        low, high = (float(v) for v in operating)
        if not 0 < low <= high:
            raise ValueError(f"operating must be a lowest and a highest speed above 0, not {operating!r}")
        operating = low, high
    inside = (A[1:-1] > A[:-2]) & (A[1:-1] >= A[2:]) & (A[1:-1] > 0)
    found = [_peak(omega, A, int(k) + 1, evaluate, operating) for k in np.flatnonzero(inside)]
    return Peaks(tuple(found), operating)


def required_margin(amplification: float, *, above: bool) -> float:
    """Separation margin required by API 684, percent.

    Parameters
    ----------
    amplification
        AF of the critical speed.
    above
        Whether the critical speed lies above the operating range, else below.

    Returns
    -------
    Percent of the operating speed next to it; 0 below an amplification of 2.5.

    Examples
    --------
    >>> required_margin(5.0, above=False), required_margin(50.0, above=True)
    (12.142857142857142, 26.0)
    """
    AF = float(amplification)
    if AF < 2.5:
        return 0.0
    margin = 17 * (1 - 1 / (AF - 1.5))
    return min(26.0, 10 + margin) if above else min(16.0, margin)


def api617_limit(speed: float) -> float:
    """Limit of shaft vibration by API 617 (7th edition, 2002), 25.4 √(12,000 / N) µm with N in rpm.

    Parameters
    ----------
    speed
        Highest continuous speed, rad/s, above 0.

    Returns
    -------
    Displacement, m peak to peak: twice the amplitudes of a `Response`. In the shop test the standard allows
    no more than 25.4 µm at lower speeds either; this is not part of the number.

    Examples
    --------
    >>> round(1e6 * api617_limit(12000 / RPM), 9)
    25.4
    """
    return 25.4e-6 * math.sqrt(12000.0 / (speed * RPM))


def api_unbalance(load: float, speed: float) -> float:
    """Unbalance for a damped response analysis, 4 W / N oz·in with W in lb: 6,350 W / N g·mm with W in kg.

    As in API 617 (7th edition, 2002) and API 684 (2nd edition, 2005), which put it at each plane of the mode.

    Parameters
    ----------
    load
        Static load of the journal next to the plane, or the mass of an overhang, W, kg.
    speed
        Highest continuous speed, rad/s, above 0.

    Returns
    -------
    kg·m in one plane.

    Examples
    --------
    >>> round(1e6 * api_unbalance(200.0, 6350 / RPM), 9)  # g·mm
    200.0
    """
    return 6350e-6 * load / (speed * RPM)


def peak_columns(peaks: Sequence[Peak], unit: str = "", scale: float = 1.0) -> tuple[Told, ...]:
    """The table of peaks: speed, amplitude, amplification factor, margins, verdict.

    Parameters
    ----------
    peaks
        One a row.
    unit, scale
        Of the amplitudes: its name, and what one of the curve's is in it.

    Returns
    -------
    Columns of a `rotorid.base.tables.Table`.
    """
    one = "{:.1f}".format
    sizes = [None if p.undamped else scale * p.amplitude for p in peaks]
    words = {True: "enough", False: "NOT ENOUGH", None: None}
    return (
        Told("rpm", [p.speed * RPM for p in peaks], "{:.2f}".format),
        Told("rad/s", [p.speed for p in peaks], "{:.4f}".format),
        Told(f"amplitude, {unit} peak" if unit else "amplitude", sizes, "{:.4g}".format),
        Told("AF", [p.amplification for p in peaks], "{:.2f}".format),
        Told("margin, %", [p.margin for p in peaks], one),
        Told("required, %", [p.required for p in peaks], one),
        Told("", [words[p.enough] for p in peaks]),
    )


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
    groups: list[list[tuple[str, Peak]]] = []
    every = [(name, peak) for name, each in zip(names, peaks, strict=False) for peak in each.peaks]
    for name, peak in sorted(every, key=lambda one: one[1].speed):
        last = groups[-1] if groups else []
        if last and name not in dict(last) and _one_critical(last[-1][1], peak):
            last.append((name, peak))
        else:
            groups.append([(name, peak)])

    def rank(one: tuple[str, Peak]) -> tuple[bool, bool, float]:
        peak = one[1]
        return peak.enough is not False, peak.amplification is None, -peak.amplitude

    return [min(group, key=rank) for group in groups]


def _one_critical(one: Peak, other: Peak) -> bool:
    widths = (
        max([1e-3 * peak.speed, *(abs(end - peak.speed) for end in (peak.below, peak.above) if end)])
        for peak in (one, other)
    )
    return abs(one.speed - other.speed) <= min(widths)


def open_question(peaks: Iterable[Peak], first: float, last: float, operating: tuple[float, float]) -> str:
    """Why one cannot say that all critical speeds are far enough from the operating range, and what to do.

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
    uncertain = [peak for peak in peaks if peak.open]
    reasons = [_unsearched(first, last, operating)]
    if uncertain:
        where = listing([rpm_text(peak.speed) for peak in uncertain], "and")
        reasons.insert(0, f"no amplification factor at {where}")
    # A half-power band that is wider than this is critically damped.
    share = 1 / 2.5
    low = min(
        [operating[0] * (1 - LARGEST[0] / 100), *((1 - share) * p.speed for p in uncertain if not p.below)]
    )
    high = max(
        [operating[1] * (1 + LARGEST[1] / 100), *((1 + share) * p.speed for p in uncertain if not p.above)]
    )
    if not any(reasons):
        return ""
    if low < first or last < high:
        what = f"give speeds from {min(low, first) * RPM:.0f} to {max(high, last) * RPM:.0f} rpm"
    else:
        what = "judge it by a sensor that shows the peak alone"
    return "; ".join(filter(None, [*reasons, what]))


def _unsearched(first: float, last: float, operating: tuple[float, float]) -> str:
    if first <= operating[0] * (1 + 1e-6) and operating[1] <= last * (1 + 1e-6):
        return ""
    return f"only speeds from {first * RPM:.6g} to {rpm_text(last)} were searched"


def _peak(
    omega: FloatArray,
    A: FloatArray,
    k: int,
    curve: Callable[[float], float],
    operating: tuple[float, float] | None,
) -> Peak:
    """The peak near speed k."""
    speed = _maximum(curve, float(omega[k - 1]), float(omega[k]), float(omega[k + 1]))
    amplitude = curve(speed)
    below = above = AF = None
    notes = []
    if amplitude >= UNLIMITED:
        amplitude = AF = np.inf
    else:
        below, why_below = _half_power(omega, A, k, -1, curve, speed, amplitude)
        above, why_above = _half_power(omega, A, k, 1, curve, speed, amplitude)
        notes = [why for why in (why_below, why_above) if why]
        if below is not None and above is not None:
            AF = speed / max(above - below, 1e-300)
    undamped = AF is not None and AF > _UNDAMPED
    if undamped:
        notes.append(_NO_LIMIT)
    margin, required = _margins(speed, AF, operating)
    known = None if undamped else AF
    return Peak(speed, amplitude, below, above, known, margin, required, "; ".join(notes), undamped)


def _margins(
    speed: float, AF: float | None, operating: tuple[float, float] | None
) -> tuple[float | None, float | None]:
    """Separation margin, and what is required, percent."""
    if operating is None:
        return None, None
    low, high = operating
    over = speed > high
    margin = 100 * (speed - high) / high if over else max(0.0, 100 * (low - speed) / low)
    # Inside the range any margin is missing; the smaller requirement is then said.
    return margin, None if AF is None else required_margin(AF, above=over)


def _maximum(curve: Callable[[float], float], a: float, b: float, c: float) -> float:
    """Maximum between a and c, b inside: where the curve's symmetric difference changes sign."""
    from scipy.optimize import brentq, minimize_scalar

    step = 1e-4 * (c - a)

    def slope(speed: float) -> float:
        return curve(speed + step) - curve(speed - step)

    left, right = a + step, c - step
    if slope(left) > 0 > slope(right):
        return float(brentq(slope, left, right, xtol=1e-12 * c, rtol=1e-14))
    found = minimize_scalar(
        lambda speed: -curve(speed), bounds=(a, c), method="bounded", options={"xatol": 1e-10 * c}
    )
    return float(found.x) if curve(float(found.x)) >= curve(b) else b


def _half_power(
    omega: FloatArray,
    A: FloatArray,
    k: int,
    way: int,
    curve: Callable[[float], float],
    speed: float,
    amplitude: float,
) -> tuple[float | None, str]:
    """Speed where the curve has fallen to 0.707 on one side of peak k, or why there is none."""
    from scipy.optimize import brentq

    level = HALF_POWER * amplitude
    side = "below" if way < 0 else "above"
    near, i = speed, k
    while 0 <= i < omega.size:
        if (omega[i] - speed) * way > 0:
            if A[i] <= level:
                root = brentq(lambda w: curve(w) - level, near, omega[i], xtol=1e-13 * speed, rtol=1e-14)
                return float(root), ""
            if A[i] > amplitude * (1 + 1e-9):
                return None, f"the curve rises to another peak before it falls to 0.707 {side}"
            near = float(omega[i])
        i += way
    end = omega[0] if way < 0 else omega[-1]
    return None, f"the half-power point {side} lies outside the speeds, which end at {end:.6g} rad/s"
