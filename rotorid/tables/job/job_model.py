"""The rotor model that a job names, where its planes and sensors are in it, and the runs of a check."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from balancing.data.conventions import Labels
from balancing.data.trials import Trials
from fem.model.sensors import Sensor
from rotorid.base.suggestions import did_you_mean
from rotorid.base.text import listing
from rotorid.tables.job.job_data import Source, source_name
from rotorid.tables.job.keys import PlaneKeys, SensorKeys
from rotorid.tables.reader import units
from rotorid.tables.reader.problems import InputError, Problems
from rotorid.tables.reader.toml_file import Section
from rotorid.tables.runs.conventions import Conventions, StatedErrors
from rotorid.tables.runs.speeds import same_speed, show_speed
from rotorid.tables.runs.trials import make_trials

if TYPE_CHECKING:
    from fem.model.rotor import Rotor


@dataclass(frozen=True)
class Model:
    """A rotor model with the places of planes and sensors in it; files that were read."""

    rotor: Rotor | None = None
    plane_nodes: Mapping[str, int] = field(default_factory=dict)
    sensor_places: Mapping[str, Sensor] = field(default_factory=dict)
    files: tuple[Path, ...] = ()


def read_model(
    path: Path | None,
    planes: Mapping[str, PlaneKeys],
    sensors: Mapping[str, SensorKeys],
    labels: Labels,
    problems: Problems,
    *,
    named: bool,
) -> Model:
    """Read the rotor of a job and find the nodes of its planes and sensors.

    Parameters
    ----------
    path
        Of the rotor table or file, or None.
    planes, sensors
        As the job says.
    labels
        How the job counts angles: `angle_deg` of a sensor, too.
    problems
        Collects the complaints, those about the rotor's files too.
    named
        Whether the job has a key `rotor`; without it no plane or sensor may have a node.
    """
    everything: list[PlaneKeys | SensorKeys] = [*planes.values(), *sensors.values()]
    if path is None:
        for keys in everything:
            if keys.place is not None and not named:
                key = "station" if isinstance(keys.place, str) else "node"
                keys.section.complain(key, f'the rotor model of this {key} too, rotor = "rotor.toml"')
        return Model()
    from rotorid.tables.rotor.rotor_file import read_rotor, rotor_files

    try:
        rotor = read_rotor(path)
    except InputError as error:
        collect(error, problems)
        return Model()
    plane_nodes = {name: node for name, keys in planes.items() if (node := _node(keys, rotor)) is not None}
    places = {
        name: Sensor(node, labels.with_rotation(keys.angle_deg or 0.0))
        for name, keys in sensors.items()
        if (node := _node(keys, rotor)) is not None
    }
    return Model(rotor, plane_nodes, places, rotor_files(path))


def collect(error: InputError, problems: Problems) -> None:
    """Note the problems of an error with others."""
    for problem in error.problems:
        problems.add(problem.file, problem.row, problem.column, problem.value, problem.expected)


def _node(keys: PlaneKeys | SensorKeys, rotor: Rotor) -> int | None:
    place = keys.place
    if isinstance(place, str):
        if place in rotor.stations:
            return rotor.stations[place]
        known = listing(map(repr, rotor.stations), "and") or "none"
        hint = did_you_mean(place, rotor.stations)
        keys.section.complain("station", f"a station of the rotor model{hint}; its stations are {known}")
        return None
    if place is not None and place > rotor.n_nodes:
        keys.section.complain("node", f"a node of the rotor model, from 1 to {rotor.n_nodes}")
        return None
    return place


def complain_about_places(
    sensors: Sequence[str], model: Model, top: Section, planes: Mapping[str, PlaneKeys]
) -> None:
    """A job without weights and coefficients rests on the model: every sensor and some plane need a node."""
    if not any(name in model.plane_nodes and keys.use for name, keys in planes.items()):
        expected = "a plane with a node of the rotor model ([planes.NAME], node = 3), or a weights table"
        top.complain("planes", expected, value=False)
    for name in sensors:
        if name not in model.sensor_places:
            expected = f"a node of the rotor model for sensor {name!r} ([sensors.{name}], node = 3)"
            top.complain("sensors", expected, value=False)


def weight_unit_without_weights(trials: Trials, planes: Sequence[str], radii: Mapping[str, float]) -> Trials:
    """Label the weights of a job that rests on its model: masses if all planes have radii, else g·mm."""
    unit = units.MASS["g"] if all(p in radii for p in planes) else units.UNBALANCE["g_mm"]
    labels = replace(trials.labels, weight_unit=unit.name, weight_scale=unit.scale)
    return replace(trials, labels=labels)


def read_check(
    runs: Source,
    weights: Source | None,
    conventions: Conventions,
    errors: StatedErrors | None,
    trials: Trials,
    planes: Sequence[str],
    problems: Problems,
) -> Trials | None:
    """Check runs, fitted to the job's speeds, units and names; or None and problems.

    Parameters
    ----------
    runs, weights
        Tables; weights None where the proposed corrections were mounted.
    conventions, errors
        Those of the job.
    trials, planes
        Of the job: every speed, sensor and plane of the check runs must be among them.
    problems
        Collects the complaints.
    """
    own = Problems()  # of the tables: those of the job must not hide what is wrong with the names
    check = make_trials(runs, weights, conventions, errors, own)
    try:
        own.stop()
    except InputError as error:
        collect(error, problems)
        return None
    assert check is not None
    before = len(problems)
    _complain_about_units(check, trials, runs, weights, problems)
    source = source_name(runs)
    mounted_source = source if weights is None else source_name(weights)
    for names, known, what, table in (
        (check.sensors, trials.sensors, "sensor", source),
        (check.planes, planes, "plane", mounted_source),
    ):
        for name in names:
            if name not in known:
                hint = did_you_mean(name, known)
                expected = f"a {what} of the job{hint}; there are {listing(known, 'and')}"
                problems.add(table, None, what, name, expected)
    speeds = []
    unit = units.SPEED[check.labels.speed_unit]
    for speed in check.speeds:
        near = float(trials.speeds[int(np.argmin(np.abs(trials.speeds - speed)))])
        if not same_speed(near, float(speed), conventions.speed_tolerance_percent):
            known = listing((show_speed(float(value), unit) for value in trials.speeds), "and")
            expected = f"a speed of the job; there are {known}"
            problems.add(source, None, "speed", show_speed(float(speed), unit), expected)
        elif near in speeds:
            expected = f"each speed of the job once; {show_speed(near, unit)} is meant twice"
            problems.add(source, None, "speed", show_speed(float(speed), unit), expected)
        speeds.append(near)
    if len(problems) > before:
        return None
    if weights is None:
        return replace(check, speeds=np.array(speeds), labels=trials.labels)
    # All planes of the job: a weights table without rows says that nothing was mounted.
    mounted = np.zeros((len(check.runs), len(planes)), dtype=complex)
    mounted[:, [planes.index(name) for name in check.planes]] = check.weights
    return replace(
        check, speeds=np.array(speeds), labels=trials.labels, planes=tuple(planes), weights=mounted
    )


def _complain_about_units(
    check: Trials, trials: Trials, runs: Source, weights: Source | None, problems: Problems
) -> None:
    """What does not convert into the units of the job."""
    ours, theirs = trials.labels, check.labels
    if units.vibration(ours.vibration_unit).kind != units.vibration(theirs.vibration_unit).kind:
        expected = (
            f"readings in {ours.vibration_unit or 'no unit'}, as in the runs table, or converting to it"
        )
        problems.add(source_name(runs), None, "amplitude", theirs.vibration_unit or "no unit", expected)
    if weights is not None and (units.weight(ours.weight_unit).kind != units.weight(theirs.weight_unit).kind):
        expected = f"weights in {ours.weight_unit}, as the job has, or in a unit that converts to it"
        problems.add(source_name(weights), None, "weight", theirs.weight_unit, expected)
