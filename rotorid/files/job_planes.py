"""Planes of a job in its tables and its model, their limits and holes.

Where material is removed, a hole drilled at the angle φ acts like a weight added at φ + 180°. Holes and
forbidden arcs then have the angles of these equivalent weights: amounts are positive, and Σ amounts e^{iφ} is
the correction. Against the rotation an angle a of the job is −a here, and an arc begins where it ended there.
"""

from __future__ import annotations

import math
import re
from collections.abc import Mapping
from contextlib import suppress
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from balancing import (
    TRIAL_WEIGHTS,
    Holes,
    Influence,
    Labels,
    Limits,
    Trials,
    from_list,
    held,
    in_planes,
    unknowns,
)
from rotorid.base.arrays import FloatArray
from rotorid.base.choices import did_you_mean
from rotorid.base.text import listing
from rotorid.files import units
from rotorid.files.cells import NotANumber, parse_number
from rotorid.files.columns import Source
from rotorid.files.input_problems import InputError, Problems
from rotorid.files.job_keys import JobSettings, Plane, Sensor
from rotorid.files.runs import nearest_speed, show_speeds
from rotorid.files.settings import Settings
from rotorid.files.table_layouts import Conventions
from rotorid.files.units import Quantity, in_job_units
from rotorid.files.weights import read_weights

if TYPE_CHECKING:
    from fem import Rotor

_PIECES = re.compile(r"(?:(\d+) *[×x*] *)?(\d+(?:\.\d+)?)")
IN_HOLE = 1e-3
"""Relative distance of a weight from the hole that it is in."""


def in_model(
    settings: JobSettings, folder: Path, problems: Problems
) -> tuple[JobSettings, Rotor | None, tuple[Path, ...]]:
    """The settings with stations as nodes, the rotor model, and its files."""
    rotor: Rotor | None = None
    files: tuple[Path, ...] = ()
    if settings.rotor is not None:
        from rotorid.files.rotor import read_rotor, rotor_files

        path = folder / settings.rotor
        try:
            rotor, files = read_rotor(path), rotor_files(path)
        except InputError as error:
            problems.extend(error.problems)
            return settings, None, ()
    placed = {
        kind: {name: _placed(part, rotor, problems) for name, part in getattr(settings, kind).items()}
        for kind in ("planes", "sensors")
    }
    return settings.model_copy(update=placed), rotor, files


def _placed(part: Plane | Sensor, rotor: Rotor | None, problems: Problems) -> Plane | Sensor:
    """A plane or sensor with its station as a node."""
    node, station, key = part.node, part.station, "node" if part.station is None else "station"
    if node is None and station is None:
        return part
    if rotor is None:
        part.complain(problems, key, f'the rotor model of this {key} too, rotor = "rotor.toml"')
    elif station is not None and station not in rotor.stations:
        stations = listing(map(repr, rotor.stations), "and") or "none"
        hint = did_you_mean(station, rotor.stations)
        part.complain(problems, key, f"a station of the rotor model{hint}; its stations are {stations}")
    elif (node := node or rotor.stations[str(station)]) > rotor.n_nodes:
        part.complain(problems, key, f"a node of the rotor model, from 1 to {rotor.n_nodes}")
    return part.model_copy(update={"node": node})


def planes_of(
    settings: JobSettings,
    trials: Trials,
    influence: Influence | None,
    rotor: Rotor | None,
    problems: Problems,
) -> tuple[Trials, dict[str, Plane]]:
    """Readings with weights at the correction radius, and planes: of the tables, then of the model alone.

    The weights are those of planes, or of groups where they do not tell planes apart.
    """
    stated, groups = settings.planes, settings.shares(trials.labels)
    trials, of = in_planes(trials, groups), held(groups, trials.planes)
    measured = unknowns(groups, influence.planes).planes if influence else trials.planes
    every = rotor is None and not measured  # or what a type knows
    more = [name for name, plane in stated.items() if every or plane.node is not None]
    planes = {name: stated.get(name, Plane.model_construct()) for name in (*measured, *more)}
    if not measured:
        masses = not rotor or all(plane.radius for plane in planes.values())
        unit = units.MASS["g"] if masses else units.UNBALANCE["g_mm"]
        labels = replace(trials.labels, weight_unit=unit.name, weight_scale=unit.scale)
        trials = replace(trials, labels=labels)
    if planes and not any(plane.use for plane in planes.values()):
        settings.complain(problems, "planes", "at least one plane without use = false")
    for kind, there in (("planes", [*planes]), ("sensors", trials.sensors)):
        for name, part in getattr(settings, kind).items() if there else ():
            if name not in there:
                expected = f"one of the job's {kind}, {listing(there, 'and')}{did_you_mean(name, there)}"
                if kind == "planes":
                    expected += f"; there is no trial weight in plane {name!r}: is its row missing?"
                problems.append(replace(part.problem("", expected), value=name))
    for group in settings.groups.values() if planes else ():
        if lost := [plane for plane in group.planes if plane not in planes]:
            expected = f"planes of the job, {listing(planes, 'and')}, not {lost[0]!r}"
            group.complain(problems, "planes", expected + did_you_mean(lost[0], planes))
    if not trials.labels.unbalances:
        trials = replace(trials, weights=trials.weights * [planes[name].lever for name in trials.planes])
    try:
        trials = of.of_runs(trials, 0.0) if of else trials
    except ValueError as error:
        settings.complain(problems, "groups", f"planes with the same trial_radius_mm / radius_mm: {error}")
    return trials, planes


def make_limits(
    settings: JobSettings, planes: Mapping[str, Plane], trials: Trials, problems: Problems
) -> Limits | None:
    """In the order of speeds, sensors and planes; None: nothing limited."""
    labels = trials.labels
    most = [(*_sizes(plane, "max_weight", labels, problems), np.inf)[0] for plane in planes.values()]
    arcs = tuple(tuple(_arc(plane, labels, *pair) for pair in plane.forbidden) for plane in planes.values())
    residual = np.full((len(trials.speeds), len(trials.sensors)), np.inf)
    for k, name in enumerate(trials.sensors):
        sensor = settings.sensors.get(name)
        if not (sensor and sensor.limit):
            continue
        unit = _of_readings(sensor, "limit", sensor.limit, labels, problems)
        rows = _at_speeds(sensor, "limit", sensor.limit.value, trials, settings, math.inf, problems)
        residual[:, k] = rows / unit.scale
    limits = Limits(np.array(most), residual, arcs)
    return limits if limits.any else None


def make_zones(settings: JobSettings, trials: Trials, problems: Problems) -> dict[str, tuple[float, ...]]:
    """Boundaries of zones of each sensor that has some, as amplitudes of its readings inside."""
    boundaries = dict[str, tuple[float, ...]]()
    for name in trials.sensors:
        each = (settings.sensors.get(name), "zones"), (settings.zones, "boundaries")
        for part, field in each:
            if name not in boundaries and part and (stated := getattr(part, field)):
                unit = _of_readings(part, field, stated, trials.labels, problems)
                boundaries[name] = tuple(map(unit.to_si, stated.value))
    return boundaries


def _of_readings(
    part: Settings, field: str, stated: Quantity, labels: Labels, problems: Problems
) -> units.Unit:
    """The unit of amplitudes that are stated; a problem where readings do not convert to it."""
    vibration = units.vibration(labels.vibration_unit)
    unit = stated.unit if stated.unit.name else vibration
    if unit.kind != vibration.kind:
        expected = f"an amplitude in a unit that converts to {vibration.name}, as the readings have"
        part.complain(problems, field, expected)
    elif unit.name in units.VELOCITY and vibration.name.endswith("_rms"):
        expected = f"{field}_{unit.name}_rms, as the readings are, or {field}_{unit.name}_pp"
        part.complain(problems, field, expected)
    return unit


def _sizes(plane: Plane, field: str, labels: Labels, problems: Problems) -> tuple[float, ...]:
    """Weights that a plane states, as those of the job are (kg or kg·m); empty where it states none."""
    stated = getattr(plane, field)
    if stated and labels.weight_unit == TRIAL_WEIGHTS:
        plane.complain(problems, field, "trial weights without ?, since this is no multiple of them")
        return ()
    sizes = in_job_units(stated, labels.weight_unit, plane.radius) if stated else ()
    if sizes is None:
        kind = "unbalances (mass × radius)" if labels.unbalances else "masses"
        expected = f"{kind}, as the weights of the job are, or radius_mm too, to convert"
        plane.complain(problems, field, expected)
    return sizes or ()


def _arc(plane: Plane, labels: Labels, first: float, last: float) -> tuple[float, float]:
    """First angle and width, rad, of the degrees from → to as the job writes them."""
    start = (first if labels.angle_sign > 0 else -last) + (180.0 if plane.remove else 0.0)
    return math.radians(start % 360.0), math.radians((last - first) % 360.0)


def row_weights(settings: JobSettings, trials: Trials, problems: Problems) -> FloatArray | None:
    """Of each reading, (S, C): that of its speed times that of its sensor; None: all 1."""
    stated = settings.sensors
    columns = np.array([stated[name].weight if name in stated else 1.0 for name in trials.sensors])
    rows = _at_speeds(settings, "speed_weights", settings.speed_weights, trials, settings, 1.0, problems)
    for field, weights in (("sensors", columns), ("speed_weights", rows)):
        if not weights.any():
            settings.complain(problems, field, "at least one weight above 0")
    weights = rows[:, None] * columns
    return None if (weights == 1.0).all() else weights


def _at_speeds(
    part: Settings,
    field: str,
    numbers: Mapping[str, float],
    trials: Trials,
    settings: JobSettings,
    default: float,
    problems: Problems,
) -> FloatArray:
    """Numbers by speed (in the job's unit; "" for all speeds) as an array (S,); `default` where none is."""
    unit, near = units.SPEED[trials.labels.speed_unit], dict[int | None, float]()
    for word in filter(None, numbers):
        k = None
        with suppress(NotANumber):
            speed = unit.to_si(parse_number(word, comma="," in word))
            k = nearest_speed(trials.speeds, speed, settings.speed_tolerance_percent)
        if k is None or k in near:
            there = show_speeds(trials.speeds, trials.labels)
            expected = f"speeds of the runs table, each once, not {word}: there are {there}"
            part.complain(problems, field, expected)
        near[k] = numbers[word]
    return np.array([near.get(k, numbers.get("", default)) for k in range(len(trials.speeds))])


def make_holes(planes: Mapping[str, Plane], labels: Labels, problems: Problems) -> dict[str, Holes]:
    """Of each plane that has some; those inside a forbidden arc are left out."""
    out = dict[str, Holes]()
    for plane_name, plane in planes.items():
        before, turn, angles = len(problems), 180.0 if plane.remove else 0.0, plane.open_holes()
        pieces, step = (_sizes(plane, field, labels, problems) for field in ("available", "step"))
        if not plane.hole_angles() or len(problems) > before:
            continue
        try:
            out[plane_name] = from_list(
                [math.radians((labels.with_rotation(angle) + turn) % 360.0) for angle in angles.values()],
                pieces,
                per_hole=plane.per_hole,
                step=(*step, 0.0)[0],
                taken=[plane.taken.get(name, 0.0) / labels.weight_scale for name in angles],
                stock=None if plane.stock is None else np.array(plane.stock),
                names=[*angles],
            )
        except ValueError as error:
            field = "holes_at" if plane.holes is None else "holes"
            wanted = "holes outside forbidden_deg in which something can be mounted"
            plane.complain(problems, field, f"{wanted}: {error}")
    return out


def with_taken(
    holes: Mapping[str, Holes], weights: Source, check: Trials, conventions: Conventions
) -> dict[str, Holes]:
    """The holes with what stands in them since the last check run, beside what the job says is taken.

    Pieces that the table names, "2 × 150 + 50", are no longer in stock.

    A plane whose weights are not all in its holes, or fill all of them, stays as it is.
    """
    read, out = read_weights(weights, check.runs, conventions, Problems()), dict(holes)
    rows = read.rows if read else ()
    for plane, free in holes.items():
        here = [row for row in rows if row[:2] == (check.runs[-1], plane)]
        mounted = np.array([row[2] for row in here])
        size, holes_at = abs(mounted), np.exp(1j * free.angles)
        off = abs(mounted[:, None] - size[:, None] * holes_at)
        taken = np.bincount(off.argmin(axis=1), size, len(holes_at)).astype(float)
        in_holes = (off.min(axis=1) <= IN_HOLE * size).all()
        if in_holes and taken.any() and not taken.all():
            sizes = free.pieces * check.labels.weight_scale
            named = _PIECES.findall(" + ".join(row[3] for row in here))
            used = sum(int(n or 1) * np.isclose(sizes, float(piece)) for n, piece in named)
            stock = None if free.stock is None else np.maximum(free.stock - used, 0)
            out[plane] = replace(free, taken=np.maximum(taken, free.taken), stock=stock)
    return out
