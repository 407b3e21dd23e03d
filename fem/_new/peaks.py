"""Peaks of a response after API 684: critical speed, amplification factor, separation margin.

Definitions of API Recommended Practice 684 (2nd edition, 2005, standard paragraphs SP6.8.2) and API 617: the
critical speed N_c is that of the peak; the amplification factor is AF = N_c / (N₂ − N₁), N₁ and N₂ the speeds
at 0.707 of the peak's amplitude; AF < 2.5 counts as critically damped, and needs no margin. Otherwise the
separation margin, in percent of the nearest operating speed, must be at least

    below the lowest operating speed    17 (1 − 1 / (AF − 1.5)), at most 16,
    above the highest                   10 + 17 (1 − 1 / (AF − 1.5)), at most 26.

A summit of a reading at the speeds that were asked for is the start; the model is evaluated between them: for
the maximum, for the half-power points, and wherever a reading bends as a curve in the complex plane, so that the
steps asked for do not matter. A sharp peak may hide between two steps; the undamped critical speeds say where.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, Any

import numpy as np

from fem._new.response import Response, Told, judged
from fem._new.rotor import SensorLike
from fem._new.undamped import critical_speeds_below
from rotorid.base.answer import Answer
from rotorid.base.arrays import AnyArray, FloatArray
from rotorid.base.json import plain
from rotorid.base.rpm import RPM, rpm_text
from rotorid.base.tables import Column, Table, terminal
from rotorid.base.text import listing

if TYPE_CHECKING:
    import pandas as pd

UNDAMPED = "practically undamped peaks: what is largest beside them depends on the speeds asked for"
UNLIMITED = 1e300  # amplitude of what nothing limits; infinities have no differences
LARGEST = (16.0, 26.0)  # percent: margins that are enough whatever the amplification, below and above
_CRITICALLY_DAMPED = 2.5  # AF below which no margin is required
_NO_DAMPING = 1e5  # AF beyond which damping is none
_FINEST = 1e-7  # relative step; finer ones would show rounding
_BEND, _SHORT = np.radians(10), 0.05  # of a curve in the plane, and of its distance from the origin
_ROUNDS, _MOST = 14, 30_000  # of halving steps, and speeds
_AROUND = np.array([-1e-2, -1e-3, -1e-4, 1e-4, 1e-3, 1e-2])  # of a critical speed, relative
_OVER_SPEED = ("speeds", "amplitudes", "backward", "largest", "largest_node")


def api617_limit(speed: float) -> float:
    """Limit of shaft vibration by API 617 (7th edition, 2002), 25.4 √(12,000 / N) µm with N in rpm.

    Parameters
    ----------
    speed
        Highest continuous speed, rad/s, above 0.

    Returns
    -------
    Displacement, m peak to peak: twice the amplitudes of a `Response`. In the shop test the standard allows no
    more than 25.4 µm at lower speeds either; this is not part of the number.

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


@dataclass(frozen=True)
class Peak:
    """One peak of a response curve.

    Attributes
    ----------
    speed
        Critical speed N_c, rad/s.
    amplitude
        There, in the unit of the curve, half of peak to peak.
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


@dataclass(frozen=True, repr=False)
class Peaks(Told):
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
        return plain({"operating_rad_s": self.operating, "peaks": list(map(_document, self.peaks))})

    def tables(self) -> tuple[Table, ...]:
        """One row per peak."""
        return (Table("peaks", peak_columns(self.peaks)),)

    def to_frame(self) -> pd.DataFrame:
        """One row per peak, columns as in the JSON document."""
        import pandas as pd

        return pd.DataFrame(self.to_dict()["peaks"])

    @property
    def answer(self) -> Answer:
        """Where they are."""
        if not self.peaks:
            return Answer("no peak in this range of speeds")
        notes = tuple(f"{rpm_text(peak.speed)}: {peak.note}" for peak in self.peaks if peak.note)
        where = listing([rpm_text(peak.speed) for peak in self.peaks], "and")
        return Answer(f"peaks at {where}", terminal(self.tables()[0]), notes=notes)

    def summary(self, unit: str = "", scale: float = 1.0) -> str:
        """The peaks as text, amplitudes times `scale` with the name of their unit."""
        table = Table("peaks", peak_columns(self.peaks, unit, scale))
        text = terminal(table) if self.peaks else self.sentence()
        return "\n".join([text, *(f"    {note}" for note in self.answer.notes)])


def _document(peak: Peak) -> dict[str, Any]:
    return {
        "speed_rad_s": peak.speed,
        "speed_rpm": peak.speed * RPM,
        "amplitude": None if peak.undamped else peak.amplitude,
        "half_power_rad_s": (peak.below, peak.above),
        "amplification_factor": peak.amplification,
        "separation_margin_percent": peak.margin,
        "required_margin_percent": peak.required,
        "enough": peak.enough,
        "note": peak.note,
    }


def peak_columns(peaks: Sequence[Peak], unit: str = "", scale: float = 1.0) -> tuple[Column, ...]:
    """The table of peaks, amplitudes times `scale` with the name of their unit."""
    one = "{:.1f}".format
    sizes = [None if p.undamped else scale * p.amplitude for p in peaks]
    words = {True: "enough", False: "NOT ENOUGH", None: None}
    return (
        Column("rpm", [p.speed * RPM for p in peaks], "{:.2f}".format),
        Column("rad/s", [p.speed for p in peaks], "{:.4f}".format),
        Column(f"amplitude, {unit} peak" if unit else "amplitude", sizes, "{:.4g}".format),
        Column("AF", [p.amplification for p in peaks], "{:.2f}".format),
        Column("margin, %", [p.margin for p in peaks], one),
        Column("required, %", [p.required for p in peaks], one),
        Column("", [words[p.enough] for p in peaks]),
    )


def critical_peaks(names: Sequence[str], peaks: Sequence[Peaks]) -> list[tuple[str, Peak]]:
    """One peak of each critical speed, ascending, with the name of the reading that shows it.

    Peaks of different readings belong to one critical speed where each lies in the half-power band of the
    other. Shown is one that is not far enough, if any, else the largest with an amplification factor.
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

    Empty where one can. Speeds were searched from `first` to `last`; all in rad/s.
    """
    uncertain = [peak for peak in peaks if peak.open]
    reasons = [unsearched(first, last, operating)]
    if uncertain:
        where = listing([rpm_text(peak.speed) for peak in uncertain], "and")
        reasons.insert(0, f"no amplification factor at {where}")
    # A half-power band that is wider than this is critically damped.
    share = 1 / _CRITICALLY_DAMPED
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
    if operating is not None and not 0 < operating[0] <= operating[1]:
        raise ValueError(f"operating must be a lowest and a highest speed above 0, not {operating!r}")
    summits = np.flatnonzero((A[1:-1] > A[:-2]) & (A[1:-1] >= A[2:]) & (A[1:-1] > 0)) + 1
    return Peaks(tuple(_peak(omega, A, k, evaluate, operating) for k in summits.tolist()), operating)


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
    if AF < _CRITICALLY_DAMPED:
        return 0.0
    return min(LARGEST[above], 10.0 * above + 17 * (1 - 1 / (AF - 1.5)))


def _peak(
    omega: FloatArray,
    A: FloatArray,
    k: int,
    curve: Callable[[float], float],
    operating: tuple[float, float] | None,
) -> Peak:
    """The peak near speed k."""
    from scipy.optimize import brentq, minimize_scalar

    bounds = omega[k - 1], omega[k + 1]
    top = minimize_scalar(
        lambda w: -curve(w), bounds=bounds, method="bounded", options={"xatol": 1e-10 * bounds[1]}
    )
    speed, amplitude = (float(top.x), -float(top.fun)) if -top.fun >= A[k] else (float(omega[k]), float(A[k]))
    level, notes, ends = math.sqrt(0.5) * amplitude, [], []
    for side, way in (("below", -1), ("above", 1)):
        at, size = omega[k::way], A[k::way]
        outside = (at - speed) * way > 0
        at, size = np.append(speed, at[outside]), np.append(amplitude, size[outside])
        over = size > amplitude * (1 + 1e-9)
        n = int(np.argmax(over | (size <= level)))
        ends.append(None)
        if amplitude >= UNLIMITED:
            continue
        if not n:
            notes.append(
                f"the half-power point {side} lies outside the speeds, which end at {at[-1]:.6g} rad/s"
            )
        elif over[n]:
            notes.append(f"the curve rises to another peak before it falls to 0.707 {side}")
        else:
            ends[-1] = float(
                brentq(lambda w: curve(w) - level, at[n - 1], at[n], xtol=1e-13 * speed, rtol=1e-14)
            )
    below, above = ends
    AF = np.inf if amplitude >= UNLIMITED else None
    if below is not None and above is not None:
        AF = speed / max(above - below, 1e-300)
    undamped = AF is not None and AF > _NO_DAMPING
    if undamped:
        notes.append("practically undamped: AF exceeds 100000, damping does not limit the amplitude")
    margin = required = None
    if operating is not None:
        margin = separation(speed, operating)
        # Inside the range any margin is missing; the smaller requirement is then shown.
        required = None if AF is None else required_margin(AF, above=speed > operating[1])
    factor = None if undamped else AF
    return Peak(speed, amplitude, below, above, factor, margin, required, "; ".join(notes), undamped)


def response_peaks(
    response: Response,
    sensor: SensorLike,
    *,
    operating: tuple[float, float] | None = None,
) -> Peaks:
    """Find the peaks of one reading, evaluated by the model between the speeds of the response.

    Parameters
    ----------
    response
        At speeds between which no peak is hidden; those without a steady response do not count.
    sensor
        Where it is read.
    operating
        As in `find_peaks`.

    Raises
    ------
    ValueError
        As `find_peaks`.
    """

    def reading(speed: float) -> float:
        try:
            return float(np.abs(response.solve(np.array([speed])).at(sensor)[0]))
        except ValueError:
            return UNLIMITED  # undamped, and critical

    size, counts = np.abs(response.at(sensor)), response.steady & (response.speeds > 0)
    parts = np.split(np.arange(size.size), np.flatnonzero(np.diff(counts)) + 1)
    each = [
        find_peaks(response.speeds[part], size[part], reading, operating=operating)
        for part in parts
        if counts[part[0]]
    ]
    return Peaks(tuple(peak for part in each for peak in part.peaks), operating)


def resolve_peaks(
    response: Response,
    sensors: Sequence[SensorLike],
    *,
    operating: tuple[float, float] | None = None,
) -> tuple[Response, list[Peaks]]:
    """Find the peaks of readings whatever the steps between the speeds of the response are.

    Parameters
    ----------
    response
        At ascending speeds.
    sensors
        Where it is read.
    operating
        As in `find_peaks`.

    Returns
    -------
    The response with speeds added around its peaks, judged for stability, and the peaks of each sensor; the
    same response and no peaks where fewer than three speeds above 0 are known.

    Raises
    ------
    ValueError
        As `response_peaks`.
    """
    asked = response.speeds
    if np.count_nonzero(asked) < 3:  # rest is no part of a peak
        return response, []
    try:
        criticals = critical_speeds_below(response.rotor, asked[-1] / (1 + _AROUND[0]), 32)
    except ValueError:  # fewer modes than one asks for, or none inside the tables
        criticals = np.empty(0)
    near = np.multiply.outer(criticals, 1 + _AROUND)
    finer = _with(response, near[(near > asked[0]) & (near < asked[-1])])
    finer = judged(smooth_curves(finer, sensors))
    peaks = [response_peaks(finer, place, operating=operating) for place in sensors]
    every = [peak for each in peaks for peak in each.peaks]
    finer = _with(finer, np.array([peak.speed for peak in every if not peak.undamped]))
    undamped = np.array([peak.speed for peak in every if peak.undamped])
    if undamped.size:  # there the amplitude has no limit and no meaning
        beside = np.abs(finer.speeds[:, None] - undamped) <= 1e-2 * undamped
        keep = ~beside.any(axis=1) | np.isin(finer.speeds, asked)
        finer = _over_speed(lambda values: values[keep], finer)
        finer = replace(finer, warnings=(*finer.warnings, UNDAMPED))
    return finer, peaks


def smooth_curves(response: Response, sensors: Sequence[SensorLike]) -> Response:
    """The response with speeds added where a reading, as a curve in the plane, bends by more than 10° a step.

    Steps of less than 5 % of the distance from the origin may do so.
    """
    for _ in range(_ROUNDS):
        omega, Z = response.speeds[response.steady], response.readings(sensors)[response.steady]
        steps, size = np.diff(Z, axis=0), np.abs(Z)
        bends = np.pad(np.abs(np.angle(steps[1:] * steps[:-1].conj())) > _BEND, ((1, 1), (0, 0)))
        long = np.abs(steps) > _SHORT * np.maximum(size[1:], size[:-1]) + 1e-9 * size.max(initial=0.0)
        long &= bends[1:] | bends[:-1]
        finer = _with(response, ((omega[1:] + omega[:-1]) / 2)[long.any(axis=1)])
        if not response.speeds.size < finer.speeds.size < _MOST:
            break
        response = finer
    return response


def _with(response: Response, extra: FloatArray) -> Response:
    """The response at more speeds, but for those too near, and where the rotor cannot run (undamped, critical)."""
    extra = np.unique(extra)
    extra = extra[np.diff(extra, prepend=-np.inf) > _FINEST * extra]
    if extra.size and response.speeds.size:
        gaps = np.abs(response.speeds - extra[:, None]).min(axis=1)
        extra = extra[gaps > _FINEST * extra]
    if not extra.size:
        return response
    try:
        more = response.solve(extra)
    except ValueError:
        return response
    order = np.argsort(np.concatenate((response.speeds, extra)), kind="stable")
    return _over_speed(lambda one, other: np.concatenate((one, other))[order], response, more)


def _over_speed(function: Callable[..., AnyArray], *responses: Response) -> Response:
    values = {name: function(*(getattr(one, name) for one in responses)) for name in _OVER_SPEED}
    return replace(responses[0], **values)  # type: ignore[arg-type]


def separation(speed: float, operating: tuple[float, float]) -> float:
    """Distance of a speed from the operating range, percent of its nearest end; 0 inside."""
    low, high = operating
    if speed > high:
        return 100 * (speed - high) / high
    return max(0.0, 100 * (low - speed) / low) if low > 0 else 0.0


@dataclass(frozen=True, repr=False)
class Separation(Told):
    """Critical speeds beside the operating range, all in rad/s, and why more may lie in it."""

    speeds: Iterable[float]
    operating: tuple[float, float]
    doubt: str = ""

    def to_dict(self) -> dict[str, Any]:
        """Which speeds lie in the range, and how far off the others are, in percent of its nearest end."""
        low, high = self.operating
        rows = [
            {
                "speed_rad_s": speed,
                "inside": low <= speed <= high,
                "separation_percent": separation(speed, self.operating),
            }
            for speed in self.speeds
        ]
        return {"range_rad_s": [low, high], "critical_speeds": rows}

    def tables(self) -> tuple[Table, ...]:
        """How far each is from the range, the nearest first; none without any."""
        rows = sorted(self.to_dict()["critical_speeds"], key=lambda row: float(row["separation_percent"]))
        columns = (
            Column("rpm", [row["speed_rad_s"] * RPM for row in rows], "{:.2f}".format),
            Column("away, %", [row["separation_percent"] for row in rows], "{:.1f}".format),
            Column("", ["INSIDE" if row["inside"] else "outside" for row in rows]),
        )
        return (Table("how far each is from the operating range", columns),) if rows else ()

    @property
    def answer(self) -> Answer:
        """For an engineer."""
        low, high = self.operating
        within = f"the operating range {low * RPM:.6g} to {rpm_text(high)}"
        tables = self.tables()
        rows = tables[0].rows if tables else []
        inside = [f"{rpm:.6g} rpm" for rpm, _, where in rows if where == "INSIDE"]
        shown, more = tuple(map(terminal, tables)), "how far each is from the operating range"
        if inside:
            return Answer(f"INSIDE {within}: {listing(inside, 'and')}.")
        if self.doubt:
            answer = f"NOT KNOWN whether a critical speed lies in {within}: {self.doubt}."
            return Answer(answer, tables=shown, more=more)
        if not rows:
            return Answer(f"No critical speed was found beside {within}.")
        rpm, away, _ = rows[0]
        nearest = f"{rpm:.6g} rpm, is {away:.1f} % away"
        return Answer(f"None lies in {within}; the nearest, {nearest}.", tables=shown, more=more)


def unsearched(first: float, last: float, operating: tuple[float, float] | None) -> str:
    """What keeps one from saying that nothing is in an operating range: speeds that were not searched."""
    if operating is None or (first <= operating[0] * (1 + 1e-6) and operating[1] <= last * (1 + 1e-6)):
        return ""
    return f"only speeds from {first * RPM:.6g} to {rpm_text(last)} were searched"
