"""Limits, holes and weights of readings of a job: from its models to SI, with the rotation.

Where material is removed, a hole drilled at the angle φ acts like a weight added at φ + 180°. Holes and
forbidden arcs then have the angles of these equivalent weights: amounts are positive, and Σ amounts e^{iφ} is
the correction. Against the rotation an angle a of the job is −a here, and an arc begins where it ended there.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import replace

import numpy as np

from balancing import Holes, Labels, Limits, Trials, from_list
from rotorid.base.arrays import FloatArray
from rotorid.files import units
from rotorid.files.columns import Source
from rotorid.files.conventions import Conventions
from rotorid.files.decimal_numbers import NotANumber, parse_number
from rotorid.files.job_models import SAME_DEG, JobSettings, Plane
from rotorid.files.problems import Problems
from rotorid.files.runs import nearest_speed, show_speeds
from rotorid.files.settings import Settings
from rotorid.files.units import Quantity
from rotorid.files.weights import read_weights
from rotorid.files.weights_with_units import in_job_units

IN_HOLE = 1e-3
"""Relative distance of a weight from the hole that it is in."""
Arc = tuple[float, float]
"""First angle and width, rad."""


def make_limits(
    settings: JobSettings, planes: Mapping[str, Plane], trials: Trials, problems: Problems
) -> Limits | None:
    """In the order of speeds, sensors and planes; None: nothing limited."""
    labels, vibration = trials.labels, units.vibration(trials.labels.vibration_unit)
    most = [(_sizes(plane, "max_weight", labels, problems) or (np.inf,))[0] for plane in planes.values()]
    arcs = tuple(tuple(_arc(plane, labels, *pair) for pair in plane.forbidden) for plane in planes.values())
    residual = np.full((len(trials.speeds), len(trials.sensors)), np.inf)
    for name, sensor in settings.sensors.items():
        if name in trials.sensors and sensor.limit is not None:
            unit = sensor.limit.unit if sensor.limit.unit.name else vibration
            if unit.kind != vibration.kind:
                expected = f"an amplitude in a unit that converts to {vibration.name}, as the readings have"
                sensor.complain(problems, "limit", expected)
            rows = _at_speeds(sensor, "limit", sensor.limit.value, trials, settings, math.inf, problems)
            residual[:, trials.sensors.index(name)] = rows / unit.scale
    limits = Limits(np.array(most), residual, arcs)
    return limits if limits.any else None


def _sizes(plane: Plane, field: str, labels: Labels, problems: Problems) -> tuple[float, ...]:
    """Weights that a plane states, as those of the job are (kg or kg·m); empty where it states none."""
    stated: Quantity | None = getattr(plane, field)
    if stated is None:
        return ()
    sizes = in_job_units(stated, labels.weight_unit, plane.radius)
    if sizes is None:
        kind = "unbalances (mass × radius)" if labels.unbalances else "masses"
        plane.complain(
            problems, field, f"{kind}, as the weights of the job are, or radius_mm too, to convert"
        )
    return sizes or ()


def _arc(plane: Plane, labels: Labels, first: float, last: float) -> Arc:
    """Of the degrees from → to as the job writes them."""
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
    return None if (columns == 1.0).all() and (rows == 1.0).all() else np.asarray(rows[:, None] * columns)


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
    unit = units.SPEED[trials.labels.speed_unit]
    out = np.full(len(trials.speeds), numbers.get("", default))
    seen = set[int]()
    for word in filter(None, numbers):
        try:
            speed = unit.to_si(parse_number(word, comma="," in word))
            near = nearest_speed(trials.speeds, speed, settings.speed_tolerance_percent)
        except NotANumber:
            near = None
        if near is None or near in seen:
            known = show_speeds(trials.speeds, unit)
            part.complain(
                problems, field, f"speeds of the runs table, each once, not {word}: there are {known}"
            )
        else:
            seen.add(near)
            out[near] = numbers[word]
    return out


def make_holes(
    planes: Mapping[str, Plane], labels: Labels, limits: Limits | None, problems: Problems
) -> dict[str, Holes]:
    """Of each plane that has some; those inside a forbidden arc are left out."""
    near, out = math.radians(SAME_DEG), dict[str, Holes]()
    for k, (plane_name, plane) in enumerate(planes.items()):
        at = plane.hole_angles()
        arcs = () if limits is None else limits.forbidden[k]
        turn = 180.0 if plane.remove else 0.0
        angles = {
            name: math.radians((labels.with_rotation(angle) + turn) % 360.0) for name, angle in at.items()
        }
        kept = [
            name
            for name, angle in angles.items()
            if name in plane.taken
            or not any(near < (angle - start) % (2 * math.pi) < width - near for start, width in arcs)
        ]
        before = len(problems)
        pieces, step = (_sizes(plane, field, labels, problems) for field in ("available", "step"))
        if not at or len(problems) > before:
            continue
        try:
            out[plane_name] = from_list(
                [angles[name] for name in kept],
                pieces,
                per_hole=plane.per_hole,
                step=(step or (0.0,))[0],
                taken=[plane.taken.get(name, 0.0) / labels.weight_scale for name in kept],
                stock=None if plane.stock is None else np.array(plane.stock),
                names=kept,
                max_weight=np.inf if limits is None else float(limits.max_weight[k]),
            )
        except ValueError as error:
            field = "holes" if plane.holes is not None else "holes_at"
            wanted = "holes outside forbidden_deg in which something can be mounted"
            plane.complain(problems, field, f"{wanted}: {error}")
    return out


def with_taken(
    holes: Mapping[str, Holes], weights: Source, check: Trials, conventions: Conventions
) -> dict[str, Holes]:
    """The holes with what stands in them since the last check run, where the job does not say what is taken.

    A plane whose weights are not all in its holes, or fill all of them, stays as it is.
    """
    read = read_weights(weights, check.runs, conventions, Problems())
    rows = () if read is None else read.rows
    out = dict(holes)
    for plane, free in holes.items():
        mounted = np.array([w for run, name, w in rows if (run, name) == (check.runs[-1], plane)])
        if not len(mounted) or free.taken.any():
            continue
        unit = np.exp(1j * free.angles)
        hole = np.argmax((unit.conj() * mounted[:, None]).real, axis=1)
        taken = np.zeros(len(unit))
        np.add.at(taken, hole, np.abs(mounted))
        off = np.abs(mounted - np.abs(mounted) * unit[hole])
        if (off <= IN_HOLE * np.abs(mounted)).all() and not taken.all():
            out[plane] = replace(free, taken=taken)
    return out
