"""Limits and row weights of a job: from its planes and sensors, or in place of what these say."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import replace
from typing import TYPE_CHECKING

import numpy as np

from balancing.data.limits import Limits
from balancing.data.trials import Trials
from rotorid.base.arrays import FloatArray
from rotorid.base.text import listing
from rotorid.tables.job.keys import PlaneKeys, SensorKeys
from rotorid.tables.job.quantity import Quantity, to_job_weight
from rotorid.tables.reader import units
from rotorid.tables.reader.number import parse_number
from rotorid.tables.reader.toml_file import Section
from rotorid.tables.runs.speeds import same_speed, show_speed

if TYPE_CHECKING:
    from rotorid.tables.job.job_data import Job


def make_limits(
    trials: Trials,
    planes: Sequence[str],
    plane_keys: Mapping[str, PlaneKeys],
    sensor_keys: Mapping[str, SensorKeys],
    tolerance_percent: float,
) -> Limits | None:
    """Limits in SI with the rotation, in the order of `trials.speeds`, `trials.sensors` and `planes`.

    None where nothing is limited. Problems are noted with the sections.
    """
    labels = trials.labels
    amount, arcs = {}, {}
    for name, plane in plane_keys.items():
        if name not in planes:
            continue
        if plane.max_weight is not None:
            value = to_job_weight(plane.max_weight, labels.weight_unit, plane.radius)
            if value is None:
                plane.section.complain(plane.max_weight.key, _other_kind(labels.weight_unit))
            else:
                amount[name] = value
        if plane.forbidden:
            arcs[name] = tuple(labels.arc_from(*pair, opposite=plane.remove) for pair in plane.forbidden)
    residual: dict[str, float | FloatArray] = {}
    for name, sensor in sensor_keys.items():
        if name in trials.sensors and sensor.limits:
            rows = at_speeds(sensor.section, "limit", sensor.limits, trials, tolerance_percent, math.inf)
            residual[name] = rows / labels.vibration_scale
    made = Limits.of(
        len(trials.speeds), trials.sensors, planes, max_weight=amount, residual=residual, forbidden=arcs
    )
    return made if made.any else None


def make_row_weights(
    trials: Trials,
    sensor_keys: Mapping[str, SensorKeys],
    top: Section,
    speed_weights: Mapping[str, float],
    tolerance_percent: float,
) -> FloatArray | None:
    """Weight of each reading in the fit, (S, C): that of its speed times that of its sensor; None: all 1."""
    sensors = np.array([sensor_keys[s].weight if s in sensor_keys else 1.0 for s in trials.sensors])
    speeds = at_speeds(top, "speed_weights", speed_weights, trials, tolerance_percent, 1.0)
    if not sensors.any():
        top.complain("sensors", "at least one sensor with a weight above 0", value=False)
    if not speeds.any():
        top.complain("speed_weights", "at least one speed with a weight above 0", value=False)
    if (sensors == 1.0).all() and (speeds == 1.0).all():
        return None
    return np.asarray(speeds[:, None] * sensors)


def at_speeds(
    section: Section,
    key: str,
    numbers: Mapping[str, float],
    trials: Trials,
    tolerance_percent: float,
    default: float,
) -> FloatArray:
    """Numbers by speed (in the job's unit; "" for all speeds) as an array (S,); `default` where none is."""
    unit = units.SPEED[trials.labels.speed_unit]
    out = np.full(len(trials.speeds), numbers.get("", default))
    seen: dict[int, str] = {}
    for word, number in numbers.items():
        if not word:
            continue
        speed = unit.to_si(parse_number(word))
        near = int(np.argmin(np.abs(trials.speeds - speed)))
        if not same_speed(float(trials.speeds[near]), speed, tolerance_percent):
            known = listing((show_speed(float(value), unit) for value in trials.speeds), "and")
            section.complain(key, f"speeds of the runs table, not {word}: there are {known}")
        elif near in seen:
            section.complain(key, f"each speed once; {seen[near]} and {word} count as one")
        else:
            seen[near] = word
            out[near] = number
    return out


def _other_kind(weight_unit: str) -> str:
    mass = units.weight(weight_unit).kind == "mass"
    key, are = ("max_mass_g", "masses") if mass else ("max_unbalance_g_mm", "unbalances (mass × radius)")
    return f"{key}, because the weights of the job are {are}, or radius_mm too, to convert"


def with_limits(job: Job, weights: Mapping[str, Quantity], amplitudes: Mapping[str, Quantity]) -> Job:
    """The job with other limits, each in place of what the job itself says there.

    Parameters
    ----------
    job
        As read.
    weights
        Largest weights by plane; a mass where the job's weights are unbalances (or the reverse) needs the
        plane's `radius_mm`. The key is what complaints begin with.
    amplitudes
        Largest amplitudes by sensor, at all speeds.

    Returns
    -------
    Job
        With new `limits`; holes keep to the largest weight of their plane.

    Raises
    ------
    ValueError
        For a weight that does not convert to those of the job, and one that the holes cannot keep to.
    """
    if not weights and not amplitudes:
        return job
    trials, own = job.trials, job.trials.labels.weight_unit
    old = job.limits or Limits.none(len(trials.speeds), len(trials.sensors), len(job.planes))
    most, residual = old.max_weight.copy(), old.residual.copy()
    for plane, weight in weights.items():
        size = to_job_weight(weight, own, job.radii.get(plane))
        if size is None:
            raise ValueError(
                f"{weight.key}: the weights of the job are in {own}, to which {weight.unit.name} converts "
                f"only with a radius_mm of plane {plane!r} in the job"
            )
        most[job.planes.index(plane)] = size
    for sensor, amplitude in amplitudes.items():
        residual[:, trials.sensors.index(sensor)] = amplitude.si
    holes = {}
    for name, its in job.holes.items():
        try:
            holes[name] = replace(its, max_weight=float(most[job.planes.index(name)]))
        except ValueError as error:
            raise ValueError(f"{weights[name].key}: plane {name!r}: {error}") from None
    return replace(job, limits=Limits(most, residual, old.forbidden), holes=holes)
