"""Limits and row weights of a job: from its planes and sensors, and from the command line."""

from __future__ import annotations

import math
import re
from collections.abc import Mapping, Sequence
from dataclasses import replace
from typing import TYPE_CHECKING

import numpy as np

from balancing.data.limits import Arc, Limits
from balancing.data.trials import Trials
from rotorid.base.arrays import FloatArray
from rotorid.base.suggestions import did_you_mean
from rotorid.base.text import listing
from rotorid.tables.job.keys import Pair, PlaneKeys, SensorKeys
from rotorid.tables.job.quantity import Quantity, to_job_weight
from rotorid.tables.reader import units
from rotorid.tables.reader.number import LARGEST_STATED, NotANumber, check_size, parse_number
from rotorid.tables.reader.toml_file import Section
from rotorid.tables.reader.units import Unit, UnitError
from rotorid.tables.runs.speeds import same_speed, show_speed

if TYPE_CHECKING:
    from rotorid.tables.job.job_file import Job


_WORD = re.compile(r"([+-]?[0-9.,]+(?:[eE][+-]?[0-9]+)?)\s*(\D.*)?")
_OPTION_MASS = "--max-mass"
_OPTION_LIMIT = "--limit"


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
            arcs[name] = tuple(arc(pair, labels.angle_sign, remove=plane.remove) for pair in plane.forbidden)
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


def arc(pair: Pair, sign: int, *, remove: bool = False) -> Arc:
    """A pair of degrees, from → to in the job's direction, as first angle and width in rad with the rotation.

    Against the rotation an angle a of the job is −a here, and what begins there ends here. Where material is
    removed the arc says where nothing can be taken away; the weight that would have to be added instead
    stands opposite, and so does the arc of the correction (`remove`).
    """
    first, last = pair
    start = (first if sign > 0 else -last) + (180.0 if remove else 0.0)
    return math.radians(start % 360.0), math.radians((last - first) % 360.0)


def _other_kind(weight_unit: str) -> str:
    mass = units.weight(weight_unit).kind == "mass"
    key, are = ("max_mass_g", "masses") if mass else ("max_unbalance_g_mm", "unbalances (mass × radius)")
    return f"{key}, because the weights of the job are {are}, or radius_mm too, to convert"


def with_limits(job: Job, max_mass: str | None, limits: Sequence[str]) -> Job:
    """The job with the limits of the command line, each in place of what the job itself says there.

    Parameters
    ----------
    job
        As read.
    max_mass
        `5g`: of every plane that is not left out; `left=5g,right=3g`: of these. Without a unit in that of
        the job's weights; a mass where these are unbalances (or the reverse) needs the plane's `radius_mm`.
    limits
        Each `SENSOR=VALUE`, at all speeds, or `VALUE` for every sensor; in the job's amplitude unit, or with
        one that converts to it.

    Returns
    -------
    Job
        With new `limits`; holes keep to the largest weight of their plane.

    Raises
    ------
    ValueError
        Naming the option and what is wrong with it.
    """
    if max_mass is None and not limits:
        return job
    trials = job.trials
    old = job.limits or Limits.none(len(trials.speeds), len(trials.sensors), len(job.planes))
    weight, residual = old.max_weight.copy(), old.residual.copy()
    for name, text in _assignments(max_mass, _OPTION_MASS, "plane", job.planes):
        value = _mass(text, job, job.used if name is None else (name,))
        for plane, size in value.items():
            weight[job.planes.index(plane)] = size
    for option in limits:
        for name, text in _assignments(option, _OPTION_LIMIT, "sensor", trials.sensors, several=False):
            at = slice(None) if name is None else trials.sensors.index(name)
            residual[:, at] = _amplitude(text, trials.labels.vibration_unit)
    holes = {}
    for name, own in job.holes.items():
        try:
            holes[name] = replace(own, max_weight=float(weight[job.planes.index(name)]))
        except ValueError as error:
            raise ValueError(f"{_OPTION_MASS} {max_mass!r}: plane {name!r}: {error}") from None
    return replace(job, limits=Limits(weight, residual, old.forbidden), holes=holes)


Keys = dict[str, tuple[str, float]]


def limit_keys(job: Job, max_mass: str | None, limits: Sequence[str]) -> tuple[Keys, Keys]:
    """The limits of the command line as a job file would write them, key and number by plane and by sensor.

    Parameters
    ----------
    job, max_mass, limits
        As `with_limits` takes them; it has accepted them already.

    Returns
    -------
    planes, sensors
        Numbers of sensors in the unit of the readings.
    """
    own = job.trials.labels
    planes: Keys = {}
    for name, text in _assignments(max_mass, _OPTION_MASS, "plane", job.planes):
        value, word = _split(text, _OPTION_MASS, "5g")
        unit = units.weight(word or own.weight_unit)
        kind = "max_mass" if unit.kind == "mass" else "max_unbalance"
        planes |= dict.fromkeys(job.used if name is None else (name,), (f"{kind}_{unit.name}", value))
    sensors: Keys = {}
    for option in limits:
        for name, text in _assignments(option, _OPTION_LIMIT, "sensor", job.trials.sensors, several=False):
            value, word = _split(text, _OPTION_LIMIT, "20")
            if word and units.spelt(word) != own.vibration_unit:
                value = units.vibration(word).to_si(value) * own.vibration_scale
            sensors |= dict.fromkeys(job.trials.sensors if name is None else (name,), ("limit", value))
    return planes, sensors


def _assignments(
    option: str | None, what: str, kind: str, names: Sequence[str], *, several: bool = True
) -> list[tuple[str | None, str]]:
    """`a=1,b=2` as pairs, and `1` as (None, "1")."""
    if option is None:
        return []
    out: list[tuple[str | None, str]] = []
    for part in option.split(",") if several else [option]:
        name, separator, text = part.rpartition("=")
        name = name.strip()
        if not text.strip() or (separator and not name):
            example = "5g or left=5g,right=3g" if what == _OPTION_MASS else "SENSOR=20"
            raise ValueError(f"{what} {option!r}: write {example}")
        if separator and name not in names:
            raise ValueError(
                f"{what} {option!r}: there is no {kind} {name!r}{did_you_mean(name, names)}; "
                f"there are {listing(map(repr, names), 'and')}"
            )
        out.append((name if separator else None, text.strip()))
    named = [name for name, _ in out]
    if len(set(named)) < len(named) or (None in named and len(named) > 1):
        raise ValueError(
            f"{what} {option!r}: give one value for all {kind}s, or each {kind} once "
            "(a decimal sign is a point)"
        )
    return out


def _mass(text: str, job: Job, planes: Sequence[str]) -> dict[str, float]:
    """A largest weight of these planes, as the job's weights are."""
    own = job.trials.labels.weight_unit
    what = f"{_OPTION_MASS} {text!r}"
    value, word = _split(text, what, "5g")
    try:
        unit = units.weight(word) if word else units.weight(own)
    except UnitError as error:
        raise ValueError(f"{what}: expected {error}") from None
    out = {}
    for plane in planes:
        size = to_job_weight(Quantity(_OPTION_MASS, value, unit), own, job.radii.get(plane))
        if size is None:
            raise ValueError(
                f"{what}: the weights of the job are in {own}, to which {unit.name} converts only with a "
                f"radius_mm of plane {plane!r} in the job"
            )
        out[plane] = size
    return out


def _amplitude(text: str, own: str) -> float:
    """An amplitude in SI."""
    what = f"{_OPTION_LIMIT} {text!r}"
    value, word = _split(text, what, "20")
    try:
        unit: Unit = units.vibration(word or own)
    except UnitError as error:
        raise ValueError(f"{what}: expected {error}") from None
    if unit.kind != units.vibration(own).kind:
        raise ValueError(f"{what}: the readings are in {own or 'no unit'}, to which {word} does not convert")
    return unit.to_si(value)


def _split(text: str, what: str, example: str) -> tuple[float, str]:
    match = _WORD.fullmatch(text)
    try:
        value = parse_number(match[1] if match else text)
        check_size(value, LARGEST_STATED)
    except NotANumber as error:
        raise ValueError(f"{what}: expected {error}, such as {example}") from None
    if value <= 0:
        hint = "; to use no weight at all, leave the plane out" if _OPTION_MASS in what else ""
        raise ValueError(f"{what}: expected a value above 0, such as {example}{hint}")
    return value, (match[2] or "").strip() if match else ""
