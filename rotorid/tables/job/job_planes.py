"""Planes of a job: which there are and are used, their radii, and weights at the correction radius."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np

from balancing import Trials
from rotorid.base.suggestions import did_you_mean
from rotorid.base.text import listing
from rotorid.files import units
from rotorid.files.problems import Problems
from rotorid.files.settings_keys import Said
from rotorid.tables.job.job_model import Model
from rotorid.tables.job.readings import Readings


@dataclass(frozen=True, eq=False)
class Planes:
    """Attributes are those of `Job`; `trials` have their weights at the correction radius."""

    trials: Trials
    names: tuple[str, ...]
    left_out: tuple[str, ...]
    radii: Mapping[str, float]
    trial_radii: Mapping[str, float]
    remove: frozenset[str]


def read_planes(said: Said, readings: Readings, model: Model, problems: Problems) -> Planes:
    """Planes of the tables, then those that only the rotor model knows; other names are problems."""
    top, planes, trials = said.section, said["planes"], readings.trials
    own = trials.planes if readings.influence is None else readings.influence.planes
    more = model.plane_nodes if own or model.rotor is not None else planes  # or what a type knows
    names = (*own, *(name for name in more if name not in own))
    radii = {name: plane["radius_mm"].si for name, plane in planes.items() if plane["radius_mm"]}
    if not own:
        masses = model.rotor is None or all(p in radii for p in names)
        unit = units.MASS["g"] if masses else units.UNBALANCE["g_mm"]
        if model.rotor is not None:
            _complain_about_places(said, trials.sensors, model)
        labels = replace(trials.labels, weight_unit=unit.name, weight_scale=unit.scale)
        trials = replace(trials, labels=labels)
    if names:
        _complain_about_names(said, "planes", names, problems)
    _complain_about_names(said, "sensors", trials.sensors, problems)
    left_out = tuple(name for name in names if name in planes and not planes[name]["use"])
    if names and len(left_out) == len(names):
        top.complain("planes", "at least one plane without use = false", value=False)
    trial_radii = {
        name: planes[name]["trial_radius_mm"].si
        for name in names
        if name in planes and planes[name]["trial_radius_mm"]
    }
    remove = frozenset(name for name in names if name in planes and planes[name]["remove"])
    return Planes(_at_correction_radius(trials, planes), names, left_out, radii, trial_radii, remove)


def _complain_about_places(said: Said, sensors: Sequence[str], model: Model) -> None:
    """A job without weights and coefficients rests on the model: every sensor and some plane need a node."""
    top = said.section
    if not any(name in model.plane_nodes and plane["use"] for name, plane in said["planes"].items()):
        expected = "a plane with a node of the rotor model ([planes.NAME], node = 3), or a weights table"
        top.complain("planes", expected, value=False)
    for name in sensors:
        if name not in model.sensor_places:
            expected = f"a node of the rotor model for sensor {name!r} ([sensors.{name}], node = 3)"
            top.complain("sensors", expected, value=False)


def _complain_about_names(said: Said, key: str, known: Sequence[str], problems: Problems) -> None:
    for name in said[key]:
        if name not in known:
            expected = f"one of the job's {key}, {listing(known, 'and')}{did_you_mean(name, known)}"
            if key == "planes":
                expected += f" (no trial weight in plane {name!r}: is a row of the weights table missing?)"
            source, row, column = said.section.place(f"{key}.{name}")
            problems.add(source, row, column, name, expected)


def _at_correction_radius(trials: Trials, planes: Mapping[str, Said]) -> Trials:
    """Weights mounted at a trial radius r, as the weights at the correction radius R that do the same.

    What acts is the unbalance, mass × radius: m r = m' R, so a mass m counts as m r / R. Weights that are
    written as unbalances are the same at every radius. Problems are noted with the sections.
    """
    if units.weight(trials.labels.weight_unit).kind != "mass":
        return trials
    factors = np.ones(len(trials.planes))
    for name, plane in planes.items():
        radius, trial = plane["radius_mm"], plane["trial_radius_mm"]
        if trial is not None and radius is None:
            expected = "the correction radius too, radius_mm, to which the trial weights are converted"
            plane.section.complain(trial.key, expected)
        elif trial is not None and name in trials.planes:
            factors[trials.planes.index(name)] = trial.si / radius.si
    return replace(trials, weights=trials.weights * factors)
