"""Limits and row weights of a job: from its planes and sensors, or in place of what these say."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import replace
from typing import TYPE_CHECKING

import numpy as np

from balancing import Labels, Limits, Trials
from rotorid.base.arrays import FloatArray
from rotorid.files import units
from rotorid.files.decimal_numbers import parse_number
from rotorid.files.runs import nearest_speed, show_speeds
from rotorid.files.settings_keys import Quantity, Said
from rotorid.files.toml_file import Section
from rotorid.files.weights_with_units import in_job_units, other_kind
from rotorid.tables.job.job_keys import FORBIDDEN
from rotorid.tables.job.job_planes import Planes

if TYPE_CHECKING:
    from rotorid.tables.job.job_data import Job


def read_limits(said: Said, planes: Planes) -> tuple[Limits | None, FloatArray | None]:
    """Limits of planes and sensors, and weights of the readings in the fit; problems are noted.

    Returns
    -------
    Limits
        In SI with the rotation, in the order of speeds, sensors and planes of the job; None: nothing limited.
    ndarray
        Of each reading, (S, C): that of its speed times that of its sensor; None: all 1.
    """
    return _limits(said, planes), _row_weights(said, planes.trials)


def _arc(labels: Labels, first: float, last: float, *, opposite: bool) -> tuple[float, float]:
    """First angle and width, rad with the rotation, of the degrees from → to as the job writes them.

    Against the rotation an angle a of the job is −a here, and what begins there ends here. Where material
    is removed a job says where nothing can be taken away; the weight that would have to be added instead
    stands `opposite`, and so does the arc of the correction.
    """
    start = (first if labels.angle_sign > 0 else -last) + (180.0 if opposite else 0.0)
    return math.radians(start % 360.0), math.radians((last - first) % 360.0)


def _limits(said: Said, planes: Planes) -> Limits | None:
    trials, labels = planes.trials, planes.trials.labels
    amount, arcs = {}, {}
    for name, plane in said["planes"].items():
        if name not in planes.names:
            continue
        most = plane["max_mass_g"]
        if most is not None:
            value = in_job_units(most, labels.weight_unit, planes.radii.get(name))
            if value is None:
                plane.section.complain(most.key, other_kind("max", labels.weight_unit))
            else:
                amount[name] = value[0]
        forbidden = plane[FORBIDDEN.name]
        if forbidden:
            arcs[name] = tuple(_arc(labels, *pair, opposite=plane["remove"]) for pair in forbidden)
    residual: dict[str, float | FloatArray] = {}
    for name, sensor in said["sensors"].items():
        if name in trials.sensors and sensor["limit"]:
            rows = at_speeds(said, sensor.section, "limit", sensor["limit"], trials, math.inf)
            residual[name] = rows / labels.vibration_scale
    free = np.full(len(trials.speeds), np.inf)
    made = Limits(
        np.array([amount.get(name, np.inf) for name in planes.names]),
        np.column_stack([residual.get(name, free) for name in trials.sensors]),
        tuple(arcs.get(name, ()) for name in planes.names),
    )
    return made if made.any else None


def _row_weights(said: Said, trials: Trials) -> FloatArray | None:
    top, named = said.section, said["sensors"]
    sensors = np.array([named[name]["weight"] if name in named else 1.0 for name in trials.sensors])
    speeds = at_speeds(said, top, "speed_weights", said["speed_weights"], trials, 1.0)
    if not sensors.any():
        top.complain("sensors", "at least one sensor with a weight above 0", value=False)
    if not speeds.any():
        top.complain("speed_weights", "at least one speed with a weight above 0", value=False)
    if (sensors == 1.0).all() and (speeds == 1.0).all():
        return None
    return np.asarray(speeds[:, None] * sensors)


def at_speeds(
    said: Said, section: Section, key: str, numbers: Mapping[str, float], trials: Trials, default: float
) -> FloatArray:
    """Numbers by speed (in the job's unit; "" for all speeds) as an array (S,); `default` where none is."""
    unit = units.SPEED[trials.labels.speed_unit]
    out = np.full(len(trials.speeds), numbers.get("", default))
    seen: dict[int, str] = {}
    for word, number in numbers.items():
        if not word:
            continue
        speed = unit.to_si(parse_number(word))
        near = nearest_speed(trials.speeds, speed, said["speed_tolerance_percent"])
        if near is None:
            known = show_speeds(trials.speeds, unit)
            section.complain(key, f"speeds of the runs table, not {word}: there are {known}")
        elif near in seen:
            section.complain(key, f"each speed once; {seen[near]} and {word} count as one")
        else:
            seen[near] = word
            out[near] = number
    return out


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
        size = in_job_units(weight, own, job.radii.get(plane))
        if size is None:
            raise ValueError(
                f"{weight.key}: the weights of the job are in {own}, to which {weight.unit.name} converts "
                f"only with a radius_mm of plane {plane!r} in the job"
            )
        most[job.planes.index(plane)] = size[0]
    for sensor, amplitude in amplitudes.items():
        residual[:, trials.sensors.index(sensor)] = amplitude.si
    holes = {}
    for name, its in job.holes.items():
        try:
            holes[name] = replace(its, max_weight=float(most[job.planes.index(name)]))
        except ValueError as error:
            raise ValueError(f"{weights[name].key}: plane {name!r}: {error}") from None
    return replace(job, limits=Limits(most, residual, old.forbidden), holes=holes)
