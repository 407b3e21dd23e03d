"""Planes of a job in its tables and its model, their limits and holes, and its check runs.

Where material is removed, a hole drilled at the angle φ acts like a weight added at φ + 180°. Holes and
forbidden arcs then have the angles of these equivalent weights: amounts are positive, and Σ amounts e^{iφ} is
the correction. Against the rotation an angle a of the job is −a here, and an arc begins where it ended there.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from balancing import Holes, Influence, Labels, Limits, Trials, from_list
from rotorid.base.arrays import FloatArray
from rotorid.base.suggestions import did_you_mean
from rotorid.base.text import listing
from rotorid.files import units
from rotorid.files.columns import Source, source_name
from rotorid.files.conventions import Conventions
from rotorid.files.decimal_numbers import NotANumber, parse_number
from rotorid.files.job_models import SAME_DEG, Errors, JobSettings, Plane, Sensor
from rotorid.files.problems import InputError, Problems
from rotorid.files.runs import make_trials, nearest_speed, show_speed, show_speeds
from rotorid.files.settings import Settings
from rotorid.files.slow_roll import SlowRoll, subtract_slow_roll
from rotorid.files.units import Quantity
from rotorid.files.weights import read_weights
from rotorid.files.weights_with_units import in_job_units

if TYPE_CHECKING:
    from fem import Rotor

IN_HOLE = 1e-3
"""Relative distance of a weight from the hole that it is in."""
Arc = tuple[float, float]
"""First angle and width, rad."""


class Readings(NamedTuple):
    """What the tables of a job say, with its conventions settled and slow roll subtracted."""

    trials: Trials
    influence: Influence | None
    conventions: Conventions
    errors: Errors | None
    slow_roll: SlowRoll | None


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
    key = "node" if part.station is None else "station"
    if part.node is None and part.station is None:
        return part
    if rotor is None:
        part.complain(problems, key, f'the rotor model of this {key} too, rotor = "rotor.toml"')
        return part
    node = part.node if part.station is None else rotor.stations.get(part.station)
    if node is None:
        known = listing(map(repr, rotor.stations), "and") or "none"
        hint = did_you_mean(str(part.station), rotor.stations)
        part.complain(problems, key, f"a station of the rotor model{hint}; its stations are {known}")
    elif node > rotor.n_nodes:
        part.complain(problems, key, f"a node of the rotor model, from 1 to {rotor.n_nodes}")
    return part.model_copy(update={"node": node})


def planes_of(
    settings: JobSettings,
    trials: Trials,
    influence: Influence | None,
    rotor: Rotor | None,
    problems: Problems,
) -> tuple[Trials, dict[str, Plane]]:
    """Readings with weights at the correction radius, and planes: of the tables, then of the model alone."""
    stated = settings.planes
    measured = trials.planes if influence is None else influence.planes
    every = rotor is None and not measured  # or what a type knows
    more = [name for name, plane in stated.items() if every or plane.node is not None]
    planes = {name: stated.get(name, Plane()) for name in (*measured, *more)}
    if not measured:
        masses = rotor is None or all(plane.radius is not None for plane in planes.values())
        unit = units.MASS["g"] if masses else units.UNBALANCE["g_mm"]
        labels = replace(trials.labels, weight_unit=unit.name, weight_scale=unit.scale)
        trials = replace(trials, labels=labels)
    if planes and not any(plane.use for plane in planes.values()):
        settings.complain(problems, "planes", "at least one plane without use = false")
    for noun, parts, known in (
        ("plane", stated, tuple(planes)),
        ("sensor", settings.sensors, trials.sensors),
    ):
        for name, part in parts.items():
            if known and name not in known:
                expected = f"one of the job's {noun}s, {listing(known, 'and')}{did_you_mean(name, known)}"
                if noun == "plane":
                    expected += (
                        f"; there is no trial weight in plane {name!r}: is its row missing in the weights?"
                    )
                problems.extend([replace(part.problem("", expected), value=name)])
    # what acts is the unbalance, mass × radius: a mass m at the radius r counts as m r / R at R
    factors = np.ones(len(trials.planes))
    for k, name in enumerate(() if trials.labels.unbalances else trials.planes):
        plane = planes.get(name, Plane())
        if plane.trial_radius is not None and plane.radius is not None:
            factors[k] = plane.trial_radius / plane.radius
        elif plane.trial_radius is not None:
            expected = "the correction radius too, radius_mm, to which the trial weights are converted"
            plane.complain(problems, "trial_radius", expected)
    return replace(trials, weights=trials.weights * factors), planes


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
            elif unit.name in units.VELOCITY and vibration.name.endswith("_rms"):
                expected = f"limit_{unit.name}_rms, as the readings are, or limit_{unit.name}_pp"
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


def check_runs(
    tables: Mapping[str, Source],
    readings: Readings,
    trials: Trials,
    planes: tuple[str, ...],
    problems: Problems,
) -> Trials | None:
    """Check runs, fitted to the speeds, units and names of the job, or None and problems."""
    runs, weights, labels = tables["check"], tables.get("check_weights"), trials.labels
    check = make_trials(runs, weights, readings.conventions, readings.errors, problems)
    if check is None:
        return None
    before, mounting = len(problems), runs if weights is None else weights
    for table, column, kinds in (
        (runs, "amplitude", [units.vibration(one.labels.vibration_unit) for one in (check, trials)]),
        (weights, "weight", [units.weight(one.labels.weight_unit) for one in (check, trials)]),
    ):
        if table is not None and kinds[0].kind != kinds[1].kind:
            expected = (
                f"{column}s in {kinds[1].name or 'no unit'}, as the job has, or in one that converts to it"
            )
            problems.add(source_name(table), None, column, kinds[0].name or "no unit", expected)
    for table, noun, names, known in (
        (runs, "sensor", check.sensors, trials.sensors),
        (mounting, "plane", check.planes, planes),
    ):
        for name in (name for name in names if name not in known):
            expected = f"a {noun} of the job{did_you_mean(name, known)}; there are {listing(known, 'and')}"
            problems.add(source_name(table), None, noun, name, expected)
    unit, speeds = units.SPEED[check.labels.speed_unit], list[float]()
    for speed in check.speeds.tolist():
        near = nearest_speed(trials.speeds, speed, readings.conventions.speed_tolerance_percent)
        if near is None or float(trials.speeds[near]) in speeds:
            expected = f"each speed of the job once; there are {show_speeds(trials.speeds, unit)}"
            problems.add(source_name(runs), None, "speed", show_speed(speed, unit), expected)
        else:
            speeds.append(float(trials.speeds[near]))
    if len(problems) > before:
        return None
    shown, mounted = check.planes, check.weights
    if weights is not None:
        # all planes of the job: a weights table without rows says that nothing was mounted
        shown, mounted = planes, np.zeros((len(check.runs), len(planes)), dtype=complex)
        mounted[:, [planes.index(name) for name in check.planes]] = check.weights
    check = replace(check, speeds=np.array(speeds), labels=labels, planes=shown, weights=mounted)
    if readings.slow_roll is None:
        return check
    check = subtract_slow_roll(check, readings.slow_roll)
    return replace(check, warnings=tuple(w for w in check.warnings if w not in trials.warnings))
