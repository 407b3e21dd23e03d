"""Refined speeds around the peaks of a response, so that the steps asked for do not matter."""

from __future__ import annotations

import dataclasses
from collections.abc import Sequence
from typing import Any

import numpy as np

from fem.api684_peaks import Peaks
from fem.critical import critical_speeds_below
from fem.model.sensors import SensorLike
from fem.response import judged, response_peaks
from fem.response_result import Response
from rotorid.base.arrays import BoolArray, FloatArray

UNDAMPED = "practically undamped peaks: what is largest beside them depends on the speeds asked for"
_INSIDE = 2  # speeds within the half-power band on either side of a summit: five with the summit
_FINEST = 2e-7  # relative step; finer ones would show rounding
_ROUNDS = 14
_BEND, _SHORT = np.radians(10), 0.005  # of a curve in the plane, and of its largest reading
_MOST = 30_000  # speeds
_AROUND = np.array([-1e-2, -1e-3, -1e-4, 1e-4, 1e-3, 1e-2])  # of a critical speed, relative
_CRITICALS = 32  # around which speeds are added
_OVER_SPEED = ("speeds", "amplitudes", "backward", "largest", "largest_node")


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
    if np.count_nonzero(response.speeds) < 3:  # rest is no part of a peak
        return response, []
    finer = judged(_refine(response, sensors))
    peaks = [response_peaks(finer, place, operating=operating) for place in sensors]
    finer = _settle(finer, peaks, response.speeds)
    if any(peak.undamped for found in peaks for peak in found.peaks):
        finer = dataclasses.replace(finer, warnings=(*finer.warnings, UNDAMPED))
    return finer, peaks


def smooth_curves(response: Response, sensors: Sequence[SensorLike]) -> Response:
    """The response with speeds added where a reading, as a curve in the plane, bends by more than 10° a step.

    Steps of less than 0.5 % of the largest reading may do so.
    """
    for _ in range(_ROUNDS):
        omega, Z = response.speeds[response.steady], response.readings(sensors)[response.steady]
        steps = np.diff(Z, axis=0)
        bends = np.abs(np.angle(steps[1:] * steps[:-1].conj())) > _BEND
        long = np.abs(steps) > _SHORT * np.abs(Z).max(initial=0.0)
        long &= np.pad(bends, ((1, 0), (0, 0))) | np.pad(bends, ((0, 1), (0, 0)))
        extra = ((omega[1:] + omega[:-1]) / 2)[long.any(axis=1)]
        finer = _with(response, extra)
        if finer is None or finer.speeds.size == response.speeds.size:
            break
        response = finer
    return response


def _refine(result: Response, places: Sequence[SensorLike]) -> Response:
    """The response with at least five speeds in the half-power band of each peak of each reading.

    Speeds near the undamped critical speeds come first, as a sharp peak between two steps may not show at
    all. Bounded: what is not resolved with steps of 2e-7 of the speed counts as undamped.
    """
    omega = result.speeds
    try:
        criticals = critical_speeds_below(result.rotor, omega[-1] / (1 + _AROUND[0]), _CRITICALS)
    except ValueError:  # fewer modes than one asks for, or none inside the tables
        criticals = np.empty(0)
    near = np.multiply.outer(criticals, 1 + _AROUND)
    extra = near[(near > omega[0]) & (near < omega[-1])]
    for _ in range(_ROUNDS):
        merged = _with(result, extra)
        if merged is None:
            break
        result = merged
        moving = result.steady & (result.speeds > 0)
        readings = [np.abs(result.at(place))[moving] for place in places]
        extra = np.array([speed for A in readings for speed in _closer(result.speeds[moving], A)])
        if not extra.size or result.speeds.size + extra.size > _MOST:
            break
    return result


def _settle(result: Response, peaks: Sequence[Peaks], asked: FloatArray) -> Response:
    """With the speeds of the peaks, but without those added beside undamped peaks.

    There the amplitude has no limit and no meaning.
    """
    tops = []
    keep = np.ones(result.speeds.size, dtype=bool)
    for found in peaks:
        for peak in found.peaks:
            if peak.undamped:
                keep &= np.abs(result.speeds - peak.speed) > 1e-2 * peak.speed
            else:
                tops.append(peak.speed)
    kept = _at(result, keep | np.isin(result.speeds, asked))
    return _with(kept, np.array(tops)) or kept


def _with(result: Response, extra: FloatArray) -> Response | None:
    """The response at more speeds; None where the rotor cannot run at one of them (undamped, critical)."""
    omega = result.speeds
    # Speeds that differ by rounding alone would make summits of rounding.
    extra = np.unique(extra)
    extra = extra[np.diff(extra, prepend=-np.inf) > _FINEST / 2 * extra]
    if extra.size:
        right = np.searchsorted(omega, extra)
        gaps = np.minimum(
            np.abs(extra - omega[right - 1]), np.abs(omega[np.minimum(right, omega.size - 1)] - extra)
        )
        extra = extra[gaps > _FINEST / 2 * extra]
    if not extra.size:
        return result
    try:
        more = result.solve(extra)
    except ValueError:
        return None
    order = np.argsort(np.concatenate((omega, extra)), kind="stable")

    both: dict[str, Any] = {
        name: np.concatenate((getattr(result, name), getattr(more, name)))[order] for name in _OVER_SPEED
    }
    return dataclasses.replace(result, **both)


def _closer(omega: FloatArray, A: FloatArray) -> list[float]:
    """Speeds beside each summit of one reading whose half-power band holds too few."""
    wanted: list[float] = []
    for k in np.flatnonzero((A[1:-1] > A[:-2]) & (A[1:-1] >= A[2:])) + 1:
        high = A[k - _INSIDE if k >= _INSIDE else 0 : k + _INSIDE + 1] >= np.sqrt(0.5) * A[k]
        if high.all() and high.size == 2 * _INSIDE + 1:
            continue
        for a, b in ((omega[k - 1], omega[k]), (omega[k], omega[k + 1])):
            if b - a > _FINEST * b:
                wanted += np.linspace(a, b, 10)[1:-1].tolist()
    return wanted


def _at(result: Response, keep: BoolArray) -> Response:
    return dataclasses.replace(result, **{name: getattr(result, name)[keep] for name in _OVER_SPEED})
