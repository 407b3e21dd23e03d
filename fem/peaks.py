"""Peaks of a response after API 684: critical speed, amplification factor, separation margin.

Definitions of API Recommended Practice 684 (2nd edition, 2005, standard paragraphs SP6.8.2) and API 617: the
critical speed N_c is that of the peak; the amplification factor is AF = N_c / (N₂ − N₁), N₁ and N₂ the speeds
at 0.707 of the peak's amplitude; AF < 2.5 counts as critically damped, and needs no margin. Otherwise the
separation margin, in percent of the nearest operating speed, must be at least

    below the lowest operating speed    17 (1 − 1 / (AF − 1.5)), at most 16,
    above the highest                   10 + 17 (1 − 1 / (AF − 1.5)), at most 26.

A summit of a reading at the speeds that were asked for is the start; the model is evaluated between them: for
the maximum, for the half-power points, and wherever a reading bends as a curve in the complex plane, so that
the steps asked for do not matter. A sharp peak may hide between two steps; the undamped critical speeds say
where.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, Any

import numpy as np

from fem.response import Response, judged
from fem.rotor import SensorLike
from fem.undamped import Result, critical_speeds_below
from rotorid.base.answer import Answer
from rotorid.base.arrays import FloatArray
from rotorid.base.json import plain
from rotorid.base.rpm import RPM, rpm_text
from rotorid.base.tables import Column, Table, frame, terminal
from rotorid.base.text import listing

if TYPE_CHECKING:
    import pandas as pd

UNDAMPED = "practically undamped peaks: what is largest beside them depends on the speeds asked for"
LARGEST = (16.0, 26.0)  # percent: margins that are enough whatever the amplification, below and above
CRITICALLY_DAMPED = 2.5  # AF below which no margin is required
_SHARP = 50.0  # AF of a peak that shows none, beside others
_NO_DAMPING = 1e5  # AF beyond which damping is none
_FINEST = 1e-7  # relative step; finer ones would show rounding
_BEND, _SHORT = np.radians(10), 0.05  # of a curve in the plane, and of its distance from the origin
_ROUNDS, _MOST = 14, 30_000  # of halving steps, and speeds
_AROUND = np.array([-1e-2, -1e-3, -1e-4, 1e-4, 1e-3, 1e-2])  # of a critical speed, relative


def api617_limit(speed: float) -> float:
    """Limit of shaft vibration by API 617 (7th edition, 2002), 25.4 √(12,000 / N) µm with N in rpm.

    Parameters
    ----------
    speed
        Highest continuous speed, rad/s, above 0.

    Returns
    -------
    Displacement, m peak to peak: twice the amplitudes of a `Response`. In the shop test the standard allows
    no more than 25.4 µm at low speeds either; this is not part of the number.

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


@dataclass(frozen=True, repr=False)
class Peaks(Result):
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
        peaks = [
            {
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
            for peak in self.peaks
        ]
        return plain({"operating_rad_s": self.operating, "peaks": peaks})

    def tables(self, unit: str = "", scale: float = 1.0) -> tuple[Table, ...]:
        """One row per peak, amplitudes times `scale` with the name of their unit."""
        return (Table("peaks", peak_columns(self.peaks, unit, scale)),)

    def to_frame(self) -> pd.DataFrame:
        """The table."""
        return frame(self.tables()[0])

    def sentence(self) -> str:
        """Where they are."""
        where = listing([rpm_text(peak.speed) for peak in self.peaks], "and")
        return f"peaks at {where}" if where else "no peak in this range of speeds"

    def summary(self, unit: str = "", scale: float = 1.0) -> str:
        """The peaks as text, amplitudes times `scale` with the name of their unit."""
        if not self.peaks:
            return self.sentence()
        notes = [f"    {rpm_text(peak.speed)}: {peak.note}" for peak in self.peaks if peak.note]
        return "\n".join([*map(terminal, self.tables(unit, scale)), *notes])


def peak_columns(peaks: Sequence[Peak], unit: str = "", scale: float = 1.0) -> tuple[Column, ...]:
    """The table of peaks, amplitudes times `scale` with the name of their unit."""
    one = "{:.1f}".format
    sizes = [None if p.undamped else scale * p.amplitude for p in peaks]
    return (
        Column("rpm", [p.speed * RPM for p in peaks], "{:.2f}".format),
        Column("rad/s", [p.speed for p in peaks], "{:.4f}".format),
        Column(f"amplitude, {unit} peak" if unit else "amplitude", sizes, "{:.4g}".format),
        Column("AF", [p.amplification for p in peaks], "{:.2f}".format),
        Column("margin, %", [p.margin for p in peaks], one),
        Column("required, %", [p.required for p in peaks], one),
        Column("", [p.enough for p in peaks], lambda enough: "enough" if enough else "NOT ENOUGH"),
    )


def critical_peaks(names: Sequence[str], peaks: Sequence[Peaks]) -> list[tuple[str, Peak]]:
    """One peak of each critical speed, ascending, with the name of the reading that shows it.

    Peaks of different readings belong to one critical speed where each lies in the half-power band of the
    other. Shown is one that is not far enough, if any, else the largest with an amplification factor.
    """
    groups: list[dict[str, Peak]] = []
    last = None
    every = [(name, peak) for name, each in zip(names, peaks, strict=False) for peak in each.peaks]
    for name, peak in sorted(every, key=lambda one: one[1].speed):
        sharper = max(one.amplification or _SHARP for one in (peak, last or peak))
        if last is None or name in groups[-1] or peak.speed - last.speed > last.speed / (2 * sharper):
            groups.append({})
        groups[-1][name] = last = peak
    return [
        min(
            group.items(),
            key=lambda one: (one[1].enough is not False, not one[1].amplification, -one[1].amplitude),
        )
        for group in groups
    ]


def open_question(peaks: Iterable[Peak], first: float, last: float, operating: tuple[float, float]) -> str:
    """Why one cannot say that all critical speeds are far enough from the operating range, and what to do.

    Empty where one can. Speeds were searched from `first` to `last`; all in rad/s.
    """
    low, high = (
        end * (1 + share / 100) for end, share in zip(operating, (-LARGEST[0], LARGEST[1]), strict=True)
    )
    reasons = [unsearched(first, last, operating)]
    for peak in peaks:
        if peak.enough is None and (peak.margin is None or peak.margin < LARGEST[1]):
            reasons.append(f"no amplification factor at {rpm_text(peak.speed)}")
            # What has not fallen to 0.707 over this distance is critically damped.
            low = low if peak.below else min(low, peak.speed * (1 - 1 / CRITICALLY_DAMPED))
            high = high if peak.above else max(high, peak.speed * (1 + 1 / CRITICALLY_DAMPED))
    if not any(reasons):
        return ""
    advice = f"give speeds from {min(low, first) * RPM:.0f} to {max(high, last) * RPM:.0f} rpm"
    if first <= low and high <= last:
        advice = "read it where it stands alone"
    return "; ".join(filter(None, [*reasons, advice]))


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
    if AF < CRITICALLY_DAMPED:
        return 0.0
    return min(LARGEST[int(above)], 10.0 * above + 17 * (1 - 1 / (AF - 1.5)))


def _peak(
    omega: FloatArray,
    A: FloatArray,
    k: int,
    curve: Callable[[float], float],
    operating: tuple[float, float] | None,
) -> Peak:
    """The peak near speed k."""
    from scipy.optimize import brentq, minimize_scalar

    middle, options = float(omega[k]), {"xatol": 1e-12 * omega[k]}
    bounds = omega[k - 1] - middle, omega[k + 1] - middle  # of what is added: a sharp peak needs all digits
    top = minimize_scalar(
        lambda more: -curve(middle + more), bounds=bounds, method="bounded", options=options
    )
    amplitude, speed = max((-float(top.fun), middle + float(top.x)), (float(A[k]), middle))
    level, notes, ends = math.sqrt(0.5) * amplitude, list[str](), list[float | None]()
    for side, way in (("below", -1), ("above", 1)):
        beyond = (omega - speed) * way > 0
        at, size = omega[beyond][::way], A[beyond][::way]
        n = int(np.argmax(np.append(size <= level, True)))
        ends.append(None)
        if (size[:n] > amplitude * (1 + 1e-9)).any():
            notes.append(f"the curve rises to another peak before it falls to 0.707 {side}")
        elif n == size.size:
            end = f"lies outside the speeds, which end at {at[-1]:.6g} rad/s"
            notes.append(f"the half-power point {side} {end}")
        else:
            ends[-1] = brentq(lambda speed: curve(speed) - level, speed, at[n], xtol=1e-13 * speed)
    AF = margin = required = None
    below, above = ends
    if below is not None and above is not None:
        AF = speed / max(above - below, 1e-300)
    undamped = AF is not None and AF > _NO_DAMPING
    if undamped:
        notes.append("practically undamped: AF exceeds 100000, damping does not limit the amplitude")
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
            return 1e300  # undamped, and critical

    size = np.where(response.steady & (response.speeds > 0), np.abs(response.at(sensor)), np.nan)
    return find_peaks(response.speeds, size, reading, operating=operating)


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
    undamped = np.array([peak.speed for peak in every if peak.undamped])
    added = np.concatenate((finer.speeds, [peak.speed for peak in every if not peak.undamped]))
    # Beside undamped peaks the amplitude has no limit and no meaning.
    far = (np.abs(added[:, None] - undamped) > 1e-2 * undamped).all(axis=1)
    warnings = (*finer.warnings, UNDAMPED) if undamped.size else finer.warnings
    return _with(replace(response, windows=finer.windows, warnings=warnings), added[far]), peaks


def smooth_curves(response: Response, sensors: Sequence[SensorLike]) -> Response:
    """The response with speeds added where a reading, as a curve in the plane, bends by more than 10° a step.

    Steps of less than 5 % of the distance from the origin may do so.
    """
    for _ in range(_ROUNDS):
        omega, Z = response.speeds[response.steady], response.readings(sensors)[response.steady]
        steps, size = np.diff(Z, axis=0), np.abs(Z)
        bends = np.pad(np.abs(np.angle(steps[1:] * steps[:-1].conj())) > _BEND, ((1, 1), (0, 0)))
        long = np.abs(steps) > _SHORT * np.maximum(size[1:], size[:-1]) + 1e-9 * size.max(initial=0.0)
        wanted = (long & (bends[1:] | bends[:-1])).any(axis=1) & (np.diff(omega) > _FINEST * omega[1:])
        finer = _with(response, ((omega[1:] + omega[:-1]) / 2)[wanted])
        if not response.speeds.size < finer.speeds.size < _MOST:
            break
        response = finer
    return response


def _with(response: Response, speeds: FloatArray) -> Response:
    """The response at more speeds, unless the rotor cannot run at one of them (undamped, critical)."""
    extra = np.setdiff1d(speeds, response.speeds)
    try:
        more = response.solve(extra) if extra.size else response
    except ValueError:
        more = response
    if more is response:
        return response
    order = np.argsort(np.concatenate((response.speeds, extra)), kind="stable")
    fields = ("speeds", "amplitudes", "backward", "largest", "largest_node")
    both = {name: np.concatenate((getattr(response, name), getattr(more, name)))[order] for name in fields}
    return replace(response, **both)  # type: ignore[arg-type]


def separation(speed: float, operating: tuple[float, float]) -> float:
    """Distance of a speed from the operating range, percent of its nearest end; 0 inside."""
    low, high = operating
    if speed > high:
        return 100 * (speed - high) / high
    return max(0.0, 100 * (low - speed) / low) if low > 0 else 0.0


@dataclass(frozen=True, repr=False)
class Separation(Result):
    """Critical speeds beside the operating range, all in rad/s, and why more may lie in it."""

    speeds: Iterable[float]
    operating: tuple[float, float]
    doubt: str = ""

    @property
    def nearest(self) -> list[float]:
        """The speeds, the nearest to the range first."""
        return sorted(self.speeds, key=lambda speed: separation(speed, self.operating))

    def to_dict(self) -> dict[str, Any]:
        """Which speeds lie in the range, and how far off the others are, in percent of its nearest end."""
        rows = [
            {"speed_rad_s": speed, "inside": away == 0, "separation_percent": away}
            for speed in self.speeds
            for away in (separation(speed, self.operating),)
        ]
        return {"range_rad_s": list(self.operating), "critical_speeds": rows}

    def tables(self) -> tuple[Table, ...]:
        """How far each is from the range, the nearest first."""
        columns = (
            Column("rpm", [speed * RPM for speed in self.nearest], "{:.6g}".format),
            Column("away, %", [separation(speed, self.operating) for speed in self.nearest], "{:.1f}".format),
        )
        return (Table("how far each is from the operating range", columns),)

    def sentence(self) -> str:
        """Whether one lies in the range, and which is nearest."""
        low, high = self.operating
        within, nearest = f"the operating range {low * RPM:.6g} to {rpm_text(high)}", self.nearest
        inside = [rpm_text(speed) for speed in nearest if separation(speed, self.operating) == 0]
        if inside:
            return f"INSIDE {within}: {listing(inside, 'and')}."
        if self.doubt:
            return f"NOT KNOWN whether a critical speed lies in {within}: {self.doubt}."
        if not nearest:
            return f"No critical speed was found beside {within}."
        away = f"{rpm_text(nearest[0])}, is {separation(nearest[0], self.operating):.1f} % away"
        return f"None lies in {within}; the nearest, {away}."

    @property
    def answer(self) -> Answer:
        """For an engineer."""
        shown = tuple(map(terminal, self.tables()))
        return Answer(self.sentence(), tables=shown, more="how far each is from the operating range")


def unsearched(first: float, last: float, operating: tuple[float, float] | None) -> str:
    """What keeps one from saying that nothing is in an operating range: speeds that were not searched."""
    if operating is None or (first <= operating[0] * (1 + 1e-6) and operating[1] <= last * (1 + 1e-6)):
        return ""
    return f"only speeds from {first * RPM:.6g} to {rpm_text(last)} were searched"
