"""Check runs of a job, fitted to its speeds, units and names."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import replace

import numpy as np

from balancing import Holes, Trials
from rotorid.base.arrays import FloatArray
from rotorid.base.suggestions import did_you_mean
from rotorid.base.text import listing
from rotorid.files import units
from rotorid.files.columns import Source, source_name
from rotorid.files.problems import Problems
from rotorid.files.runs import make_trials, nearest_speed, show_speed, show_speeds
from rotorid.files.slow_roll import subtract_slow_roll
from rotorid.files.weights import read_weights
from rotorid.tables.job.job_planes import Planes
from rotorid.tables.job.readings import Readings

IN_HOLE = 1e-3
"""Relative distance of a weight from the hole that it is in."""


def read_check(
    tables: Mapping[str, Source], readings: Readings, planes: Planes, problems: Problems
) -> Trials | None:
    """Read the check runs, or None and problems.

    Parameters
    ----------
    tables
        Of the job: `check`, and `check_weights` where other weights were mounted than the proposed ones.
    readings, planes
        Of the job: every speed, sensor and plane of the check runs must be among them.
    problems
        Collects the complaints.
    """
    runs, weights = tables["check"], tables.get("check_weights")
    own = Problems()  # of the tables: those of the job must not hide what is wrong with the names
    check = make_trials(runs, weights, readings.conventions, readings.errors, own)
    problems.extend(own)
    if check is None:
        return None
    trials, names = planes.trials, planes.names
    before = len(problems)
    _complain_about_units(check, trials, runs, weights, problems)
    for found, known, what, table in (
        (check.sensors, trials.sensors, "sensor", runs),
        (check.planes, names, "plane", runs if weights is None else weights),
    ):
        for name in found:
            if name not in known:
                hint = did_you_mean(name, known)
                expected = f"a {what} of the job{hint}; there are {listing(known, 'and')}"
                problems.add(source_name(table), None, what, name, expected)
    speeds = _speeds(check, trials, readings.conventions.speed_tolerance_percent, source_name(runs), problems)
    if len(problems) > before:
        return None
    shown, mounted = check.planes, check.weights
    if weights is not None:
        # All planes of the job: a weights table without rows says that nothing was mounted.
        shown, mounted = names, np.zeros((len(check.runs), len(names)), dtype=complex)
        mounted[:, [names.index(name) for name in check.planes]] = check.weights
    check = replace(check, speeds=speeds, labels=trials.labels, planes=shown, weights=mounted)
    if readings.slow_roll is None:
        return check
    check = subtract_slow_roll(check, readings.slow_roll)
    return replace(check, warnings=tuple(w for w in check.warnings if w not in trials.warnings))


def holes_taken(
    weights: Source, check: Trials, readings: Readings, holes: Mapping[str, Holes]
) -> dict[str, Holes]:
    """The holes with what stands in them since the last check run, where the job does not say what is taken.

    A plane whose weights are not all in its holes, or fill all of them, stays as it is.
    """
    read = read_weights(weights, check.runs, readings.conventions, Problems())
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


def _speeds(
    check: Trials, trials: Trials, tolerance_percent: float, source: str, problems: Problems
) -> FloatArray:
    """The speeds of the job that those of the check runs are."""
    speeds: list[float] = []
    unit = units.SPEED[check.labels.speed_unit]
    for speed in check.speeds:
        near = nearest_speed(trials.speeds, float(speed), tolerance_percent)
        meant = math.nan if near is None else float(trials.speeds[near])
        expected = ""
        if near is None:
            expected = f"a speed of the job; there are {show_speeds(trials.speeds, unit)}"
        elif meant in speeds:
            expected = f"each speed of the job once; {show_speed(meant, unit)} is meant twice"
        if expected:
            problems.add(source, None, "speed", show_speed(float(speed), unit), expected)
        speeds.append(meant)
    return np.array(speeds)


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
