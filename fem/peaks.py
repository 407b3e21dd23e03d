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
from collections.abc import Sequence
from contextlib import suppress
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from fem.response import Response, judged
from fem.result import Result
from fem.rotor import SensorLike
from fem.undamped import critical_speeds_below
from rotorid.base.arrays import FloatArray
from rotorid.base.json import plain
from rotorid.base.tables import Column, Table
from rotorid.base.text import RPM, listing, rpm_text

UNDAMPED = "practically undamped peaks: what is largest beside them depends on the speeds asked for"
LARGEST_MARGINS = (16.0, 26.0)  # percent: margins that are enough whatever the amplification, below and above
CRITICALLY_DAMPED = 2.5  # AF below which no margin is required
_NO_DAMPING = 1e5  # AF beyond which damping is none
_BEND, _SHORT = np.radians(10), 0.05  # of a curve in the plane, and of its distance from the origin
_ROUNDS, _MANY = 14, 30_000  # of halving steps, and speeds
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
        return self.margin >= self.required


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

    @property
    def warnings(self) -> tuple[str, ...]:
        """Why peaks have no amplification factor, a sentence each."""
        return tuple(f"{rpm_text(peak.speed)}: {peak.note}" for peak in self.peaks if peak.note)

    def to_dict(self) -> dict[str, Any]:
        """Plain data for JSON."""
        columns = peak_columns(self.peaks)
        peaks = [
            {column.key: column.values[k] for column in columns}
            | {"half_power_rad_s": (peak.below, peak.above), "note": peak.note}
            for k, peak in enumerate(self.peaks)
        ]
        return plain({"operating_rad_s": self.operating, "peaks": peaks})

    def tables(self) -> tuple[Table, ...]:
        """One row per peak."""
        return (Table("peaks", peak_columns(self.peaks)),)

    def sentence(self) -> str:
        """Speeds of the peaks, in one sentence."""
        where = listing([rpm_text(peak.speed) for peak in self.peaks], "and")
        return f"peaks at {where}" if where else "no peak in this range of speeds"


def peak_columns(peaks: Sequence[Peak], unit: str = "", scale: float = 1.0) -> tuple[Column, ...]:
    """The table of peaks, amplitudes times `scale` with the name of their unit; keys as in `to_dict`.

    Parameters
    ----------
    peaks
        One a row.
    unit, scale
        Of the amplitudes: its name, and what one of the curve's is in it.

    Returns
    -------
    Columns of a `rotorid.base.tables.Table`: speed, amplitude, amplification factor, margins, verdict.
    """
    sizes = [None if p.undamped else scale * p.amplitude for p in peaks]
    size, one = f"amplitude, {unit} peak" if unit else "amplitude", "{:.1f}".format
    return (
        Column("rpm", [p.speed * RPM for p in peaks], "{:.2f}".format, "speed_rpm"),
        Column("rad/s", [p.speed for p in peaks], "{:.4f}".format, "speed_rad_s"),
        Column(size, sizes, "{:.4g}".format, "amplitude"),
        Column("AF", [p.amplification for p in peaks], "{:.2f}".format, "amplification_factor"),
        Column("margin, %", [p.margin for p in peaks], one, "separation_margin_percent"),
        Column("required, %", [p.required for p in peaks], one, "required_margin_percent"),
        Column("", [p.enough for p in peaks], lambda good: "enough" if good else "NOT ENOUGH", "enough"),
    )


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
    return min(LARGEST_MARGINS[int(above)], 10.0 * above + 17 * (1 - 1 / (AF - 1.5)))


def response_peaks(
    response: Response,
    sensor: SensorLike,
    *,
    operating: tuple[float, float] | None = None,
) -> Peaks:
    """Find the peaks of one reading, their amplification factors and separation margins.

    Parameters
    ----------
    response
        At ascending speeds, which show the peaks; those without a steady response do not count. The model
        is evaluated between them.
    sensor
        Where it is read.
    operating
        Lowest and highest operating speed, rad/s.

    Raises
    ------
    ValueError
        For an impossible range of operating speeds.
    """
    from scipy.optimize import brentq, minimize_scalar

    if operating is not None and not 0 < operating[0] <= operating[1]:
        raise ValueError(f"operating must be a lowest and a highest speed above 0, not {operating!r}")

    def short(more: float, speed: float, level: float) -> float:
        """By how much the reading stays below a level; a sharp peak needs all digits of what is added."""
        try:
            return level - float(abs(response.solve(np.array([speed + more])).at(sensor)[0]))
        except ValueError:
            return -1e300  # undamped, and critical

    omega, peaks = response.speeds, []
    A = np.where(response.steady & (omega > 0), abs(response.at(sensor)), np.nan)
    for k in np.flatnonzero((A[1:-1] > A[:-2]) & (A[1:-1] >= A[2:])) + 1:
        middle = float(omega[k])
        bounds, options = omega[[k - 1, k + 1]] - middle, {"xatol": 1e-12 * middle}
        top = minimize_scalar(short, bounds=bounds, args=(middle, 0.0), options=options)
        amplitude, speed = max((-float(top.fun), middle + float(top.x)), (float(A[k]), middle))
        level, notes, ends = math.sqrt(0.5) * amplitude, [], []
        for side, way in (("below", -1), ("above", 1)):
            beyond = np.flatnonzero((omega - speed) * way > 0)[::way]
            leaves = (A[beyond] <= level) | (A[beyond] > amplitude * (1 + 1e-9))
            end = next(iter(beyond[leaves]), k)
            if A[end] <= level:
                xtol = 1e-13 * speed
                ends.append(speed + brentq(short, 0.0, omega[end] - speed, (speed, level), xtol=xtol))
                continue
            first = "the steady speeds end" if end == k else "another peak stands"
            notes.append(f"{first} before the curve falls to 0.707 {side}")
            ends.append(None)
        below, above = ends
        AF = None if None in ends else speed / max(above - below, 1e-300)
        undamped = AF is not None and AF > _NO_DAMPING
        if undamped:
            notes.append("practically undamped: AF exceeds 100000, damping does not limit the amplitude")
        margin = operating and separation(speed, operating)
        # Inside the range any margin is missing; the smaller requirement is then shown.
        required = operating and AF and required_margin(AF, above=speed > operating[1])
        factor, note = None if undamped else AF, "; ".join(notes)
        peaks.append(Peak(speed, amplitude, below, above, factor, margin, required, note, undamped))
    return Peaks(tuple(peaks), operating)


def resolve_peaks(
    response: Response,
    sensors: Sequence[SensorLike],
    *,
    operating: tuple[float, float] | None = None,
    criticals: FloatArray | None = None,
) -> tuple[Response, list[Peaks]]:
    """Find the peaks of readings whatever the steps between the speeds of the response are.

    Parameters
    ----------
    response
        At ascending speeds.
    sensors
        Where it is read.
    operating
        As in `response_peaks`.
    criticals
        Critical speeds, rad/s, of a model that is no `Rotor` and whose response is judged for stability; by
        default those of the rotor.

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
    speeds = np.empty(0) if criticals is None else criticals
    if criticals is None:
        with suppress(ValueError):  # fewer modes than one asks for, or none inside the tables
            speeds = critical_speeds_below(response.rotor, 1.01 * asked[-1], 32)
    near = np.multiply.outer(speeds, 1 + _AROUND).clip(asked[0], asked[-1])
    finer = smooth_curves(_with(response, near), sensors)
    finer = judged(finer) if criticals is None else finer
    peaks = [response_peaks(finer, place, operating=operating) for place in sensors]
    every = [peak for each in peaks for peak in each.peaks]
    undamped = np.array([peak.speed for peak in every if peak.undamped])
    added = np.append(finer.speeds, [peak.speed for peak in every])
    # Beside undamped peaks the amplitude has no limit and no meaning.
    near = (abs(added[:, None] - undamped) <= 1e-2 * undamped).any(axis=1)
    warnings = (*finer.warnings, *[UNDAMPED] * bool(undamped.size))
    return _with(replace(response, windows=finer.windows, warnings=warnings), added[~near]), peaks


def smooth_curves(response: Response, sensors: Sequence[SensorLike]) -> Response:
    """The response with speeds added where a reading, as a curve in the plane, bends by more than 10° a step.

    Steps of less than 5 % of the distance from the origin may do so.
    """
    for _ in range(_ROUNDS):
        omega, Z = response.speeds[response.steady], response.readings(sensors)[response.steady]
        steps, size = np.diff(Z, axis=0), abs(Z)
        bends = np.pad(abs(np.angle(steps[1:] * steps[:-1].conj())) > _BEND, ((1, 1), (0, 0)))
        long = abs(steps) > _SHORT * np.maximum(size[1:], size[:-1]) + 1e-9 * size.max(initial=0.0)
        wanted = (long & (bends[1:] | bends[:-1])).any(axis=1)
        coarse, response = response, _with(response, ((omega[1:] + omega[:-1]) / 2)[wanted])
        if response is coarse or response.speeds.size > _MANY:
            break
    return response


def _with(response: Response, speeds: FloatArray) -> Response:
    """The response at more speeds; the same without any, and if the rotor cannot run at one (critical)."""
    extra = np.setdiff1d(speeds, response.speeds)
    try:
        more = response.solve(extra)
    except ValueError:
        return response
    at, both = np.searchsorted(response.speeds, extra), {}
    for name in ("speeds", "amplitudes", "backward", "largest", "largest_node"):
        both[name] = np.insert(getattr(response, name), at, getattr(more, name), axis=0)
    return replace(response, **both)


def separation(speed: float, operating: tuple[float, float]) -> float:
    """Distance of a speed from the operating range, percent of its nearest end.

    Parameters
    ----------
    speed
        rad/s.
    operating
        Lowest and highest operating speed, rad/s.

    Returns
    -------
    Percent; 0 inside the range.
    """
    low, high = operating
    return 100 * max(0.0, (speed - high) / high, (low - speed) / max(low, 1e-300))
