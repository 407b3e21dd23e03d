"""What a job says besides its tables, put together with them: limits, holes, model, check runs."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace
from pathlib import Path

import numpy as np

from balancing.data.trials import Trials
from rotorid.base.suggestions import did_you_mean
from rotorid.base.text import listing
from rotorid.tables.job.job_data import Job
from rotorid.tables.job.job_limits import make_limits, make_row_weights
from rotorid.tables.job.job_model import Model, complain_about_places, read_check, weight_unit_without_weights
from rotorid.tables.job.keys import PlaneKeys, SensorKeys
from rotorid.tables.job.plane_holes import make_holes
from rotorid.tables.job.settings import Extra, Settings
from rotorid.tables.reader import units
from rotorid.tables.reader.problems import Problems
from rotorid.tables.reader.toml_file import Section
from rotorid.tables.runs.slow_roll import make_slow_roll, subtract_slow_roll


def completed(
    job: Job,
    model: Model,
    extra: Extra,
    settings: Settings,
    top: Section,
    plane_keys: Mapping[str, PlaneKeys],
    sensor_keys: Mapping[str, SensorKeys],
    problems: Problems,
) -> Job:
    """The job with limits, weights, holes, model and check runs.

    Parameters
    ----------
    job
        As its tables say, with the conventions settled.
    model
        The rotor model with the places of planes and sensors.
    extra, settings, plane_keys, sensor_keys
        What else the job says.
    top
        The job's settings, for complaints.
    problems
        Collects them.
    """
    trials, roll = job.trials, None
    if extra.slow_roll is not None:
        roll = make_slow_roll(extra.slow_roll, trials, job.conventions, problems)
        trials = trials if roll is None else subtract_slow_roll(trials, roll)
    radii = {name: keys.radius for name, keys in plane_keys.items() if keys.radius is not None}
    planes = (*job.planes, *(name for name in model.plane_nodes if name not in job.planes))
    if not job.planes and model.rotor is not None:
        complain_about_places(trials.sensors, model, top, plane_keys)
        trials = weight_unit_without_weights(trials, planes, radii)
    if planes:
        _complain_about_names(top, "planes", tuple(plane_keys), planes, problems)
    _complain_about_names(top, "sensors", tuple(sensor_keys), trials.sensors, problems)
    trials = at_correction_radius(trials, plane_keys)
    left_out = tuple(name for name in planes if name in plane_keys and not plane_keys[name].use)
    if planes and len(left_out) == len(planes):
        top.complain("planes", "at least one plane without use = false", value=False)
    tolerance = settings.speed_tolerance_percent
    limits = make_limits(trials, planes, plane_keys, sensor_keys, tolerance)
    holes = make_holes(trials.labels, planes, plane_keys, limits)
    row_weights = make_row_weights(trials, sensor_keys, top, extra.speed_weights, tolerance)
    check = None
    if extra.check is not None:
        tables, known = (extra.check, extra.check_weights), job.conventions
        check = read_check(*tables, known, settings.errors, trials, planes, problems)
    if check is not None and roll is not None:
        check = subtract_slow_roll(check, roll)
        check = replace(check, warnings=tuple(w for w in check.warnings if w not in trials.warnings))
    slow_file = None if extra.slow_roll is None else extra.slow_roll.path
    named = (extra.check, extra.check_weights, slow_file)
    more = (*model.files, *(file for file in named if isinstance(file, Path)))
    return replace(
        job,
        trials=trials,
        files=job.files + more,
        planes=planes,
        limits=limits,
        row_weights=row_weights,
        left_out=left_out,
        check=check,
        check_mounted=check is not None and extra.check_weights is not None,
        rotor=model.rotor,
        plane_nodes=model.plane_nodes,
        sensor_places=model.sensor_places,
        sensor_angles={
            name: job.conventions.labels.with_rotation(keys.angle_deg)
            for name, keys in sensor_keys.items()
            if keys.angle_deg is not None
        },
        radii=radii,
        holes=holes,
        remove=frozenset(name for name in planes if name in plane_keys and plane_keys[name].remove),
        trial_radii={
            name: keys.trial_radius.si
            for name, keys in plane_keys.items()
            if name in planes and keys.trial_radius is not None
        },
        slow_roll=None if roll is None else roll.vectors,
        key_phasor=job.conventions.labels.with_rotation(extra.key_phasor),
    )


def _complain_about_names(
    top: Section, key: str, named: Sequence[str], known: Sequence[str], problems: Problems
) -> None:
    for name in named:
        if name not in known:
            expected = f"one of the job's {key}, {listing(known, 'and')}{did_you_mean(name, known)}"
            source, row, column = top.place(f"{key}.{name}")
            problems.add(source, row, column, name, expected)


def at_correction_radius(trials: Trials, planes: Mapping[str, PlaneKeys]) -> Trials:
    """Weights mounted at a trial radius r, as the weights at the correction radius R that do the same.

    What acts is the unbalance, mass × radius: m r = m' R, so a mass m counts as m r / R. Weights that are
    written as unbalances are the same at every radius. Problems are noted with the sections.
    """
    if units.weight(trials.labels.weight_unit).kind != "mass":
        return trials
    factors = np.ones(len(trials.planes))
    for name, plane in planes.items():
        if plane.trial_radius is None:
            continue
        if plane.radius is None:
            expected = "the correction radius too, radius_mm, to which the trial weights are converted"
            plane.section.complain(plane.trial_radius.key, expected)
        elif name in trials.planes:
            factors[trials.planes.index(name)] = plane.trial_radius.si / plane.radius
    return replace(trials, weights=trials.weights * factors)
