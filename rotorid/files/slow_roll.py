"""Slow-roll vectors: what a sensor reads at slow speed, subtracted from all readings before anything else.

A probe on a shaft reads the run-out of its track with the vibration: measured = vibration + S, with the same
S at every speed, and S alone at slow speed, where unbalance does nothing. S is read with the same mark,
sensor and phase convention as the readings, so subtraction needs no knowledge of either. Influence
coefficients are differences of runs, in which S cancels; the vibration to be balanced is not. Derivation:
docs/conventions.md.

Stated errors in percent of the amplitude and degrees of phase hold for the *measured* amplitude |Y + S|. Of
the difference only |Y| is left, so the share of S goes to the floor: with e the larger of the relative
amplitude and the phase error, floor'² = floor² + (e max|S|)².
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING

import numpy as np

from balancing import Trials
from rotorid.base.arrays import ComplexArray, FloatArray
from rotorid.base.choices import did_you_mean
from rotorid.base.text import counted, listing
from rotorid.files import units
from rotorid.files.columns import Source, source_name
from rotorid.files.conventions import Conventions
from rotorid.files.problems import Problems
from rotorid.files.runs import make_trials, nearest_speed, show_speed, show_speeds

if TYPE_CHECKING:
    from rotorid.files.job_models import Vector

SLOW = 0.5
"""A slow-roll run faster than this share of the lowest speed of the job gets a warning."""


@dataclass(frozen=True, eq=False)
class SlowRoll:
    """Slow-roll vectors of C sensors.

    Attributes
    ----------
    sensors
        Names (C,).
    vectors
        Complex, in the unit of the readings inside, phase lead: shape (C,), for all speeds, or (S, C); zero
        for a sensor that has none.
    speeds
        rad/s, shape (S,), where the vectors differ by speed; else None.
    warnings
        What the user should know.
    """

    sensors: tuple[str, ...]
    vectors: ComplexArray
    speeds: FloatArray | None = None
    warnings: tuple[str, ...] = ()

    def at(self, speeds: FloatArray, sensors: tuple[str, ...]) -> ComplexArray:
        """Vectors (S, C) at some of these speeds (the nearest counts) and of some of these sensors."""
        columns = [self.sensors.index(name) for name in sensors]
        if self.speeds is None:
            return np.tile(self.vectors[columns], (len(speeds), 1))
        rows = [int(np.argmin(np.abs(self.speeds - speed))) for speed in speeds]
        return np.asarray(self.vectors[np.ix_(rows, columns)])


def make_slow_roll(
    source: Source | Mapping[str, Vector], trials: Trials, conventions: Conventions, problems: Problems
) -> SlowRoll | None:
    """Slow-roll vectors for the sensors of a job, or None and problems.

    Parameters
    ----------
    source
        A runs table, or by sensor `amplitude` (in its unit, or without one in that of the readings) and
        `phase_deg`.
    trials
        Its readings, for names, units and speeds.
    conventions
        What phases mean, and which speeds count as one.
    problems
        Collects the complaints.
    """
    before, words, speeds = len(problems), list[str](), None
    own, sensors = units.vibration(trials.labels.vibration_unit), trials.sensors
    if isinstance(source, Mapping):
        given, vectors = tuple(source), np.zeros((1, len(source)), dtype=complex)
        for k, (name, vector) in enumerate(source.items()):
            unit = vector.amplitude.unit if vector.amplitude.unit.name else own
            if name not in sensors:
                vector.complain(
                    problems, "", f"a sensor of the runs table, not {name!r}{_known(name, sensors)}"
                )
            elif unit.kind != own.kind:
                vector.complain(problems, "amplitude", _other_unit(own.name))
            reading = np.array([unit.to_si(vector.amplitude.value)]), np.radians([vector.phase])
            vectors[:, k] = conventions.labels.vibration_from(*reading)
    else:
        its = Problems()  # those of the job must not hide what is wrong here
        runs = make_trials(source, None, conventions, None, its)
        problems.extend(its)
        if runs is None:
            return None
        place, given, vectors = source_name(source), runs.sensors, runs.mean[0]
        rows = _fitting(runs, place, trials, conventions.speed_tolerance_percent, problems)
        if len(runs.speeds) > 1:
            vectors, speeds = vectors[rows], trials.speeds
        elif runs.speeds[0] > SLOW * trials.speeds.min():
            slow, lowest = (trials.labels.speed_words(float(one.speeds.min())) for one in (runs, trials))
            words.append(
                f"the slow-roll vectors were read at {slow}, which is not slow against {lowest}: vibration "
                "that is subtracted with them is left unbalanced"
            )
    if len(problems) > before:
        return None
    whole = np.zeros((len(vectors), len(sensors)), dtype=complex)
    there = [name for name in given if name in sensors]
    whole[:, [sensors.index(name) for name in there]] = vectors[:, [given.index(name) for name in there]]
    if lacking := [name for name in sensors if name not in given]:
        which, whose = ("sensors", "their") if len(lacking) > 1 else ("sensor", "its")
        words.append(
            f"there is no slow-roll vector for {which} {listing(map(repr, lacking), 'and')}: {whose} "
            "readings are used as they are (amplitude = 0 says that nothing is to be subtracted)"
        )
    return SlowRoll(sensors, whole if speeds is not None else whole[0], speeds, tuple(words))


def _known(name: str, sensors: tuple[str, ...]) -> str:
    return f"{did_you_mean(name, sensors)}; its sensors are {listing(sensors, 'and')}"


def _other_unit(name: str) -> str:
    return f"an amplitude in {name or 'no unit'}, as the readings have, or in a unit that converts to it"


def _fitting(runs: Trials, place: str, trials: Trials, band: float, problems: Problems) -> list[int]:
    """Which speed of a slow run belongs to each speed of the job; problems where it is no slow run of it."""
    name, ours = runs.labels.vibration_unit, trials.labels.vibration_unit
    if units.vibration(name).kind != units.vibration(ours).kind:
        problems.add(place, None, "amplitude", name or "no unit", _other_unit(ours))
    if len(runs.runs) > 1:
        expected = f"one run, at slow speed; there are {listing(map(repr, runs.runs), 'and')}"
        problems.add(place, None, "run", runs.runs[1], expected)
    for sensor in runs.sensors:
        if sensor not in trials.sensors:
            expected = f"a sensor of the job{_known(sensor, trials.sensors)}"
            problems.add(place, None, "sensor", sensor, expected)
    near = [nearest_speed(runs.speeds, speed, band) for speed in trials.speeds.tolist()]
    if len(runs.speeds) > 1 and None in near:
        unit = units.SPEED[trials.labels.speed_unit]
        missing = show_speed(float(trials.speeds[near.index(None)]), unit)
        expected = "one slow speed, whose vectors hold for all speeds, or vectors at every speed of the "
        expected += f"job: {missing} is not among {show_speeds(runs.speeds, unit)}"
        problems.add(place, None, "speed", None, expected)
    return [row or 0 for row in near]


def subtract_slow_roll(trials: Trials, roll: SlowRoll) -> Trials:
    """Readings less the slow-roll vectors, with honest errors, and warnings.

    Parameters
    ----------
    trials
        Readings as they were measured, shape (K, R, S, C).
    roll
        Vectors of (at least) their sensors.
    """
    S = roll.at(trials.speeds, trials.sensors)
    left, labels, errors = trials.readings - S, trials.labels, trials.errors
    words = list(roll.warnings)

    def shown(amplitude: float) -> str:
        return f"{amplitude * labels.vibration_scale:.3g} {labels.vibration_in}".rstrip()

    size = np.abs(trials.mean)
    excess = np.abs(S) * (1.0 - 1e-12) - size
    if (excess > 0).any():
        r, s, c = np.unravel_index(int(np.nanargmax(excess)), excess.shape)
        others = int((excess > 0).sum()) - 1
        more = f", and than {counted(others, 'other reading')}" if others else ""
        words.append(
            f"the slow-roll vector of sensor {trials.sensors[c]!r}, {shown(abs(S[s, c]))}, is larger than "
            f"its reading in run {trials.runs[r]!r} at {labels.speed_words(float(trials.speeds[s]))}, "
            f"{shown(size[r, s, c])}{more}: check its unit, and that the readings have not been "
            "corrected already"
        )
    largest = float(np.abs(S).max(initial=0.0))
    share = 0.0 if errors is None else max(errors.amplitude, errors.phase) * largest
    if errors is not None and share:
        errors = replace(errors, floor=float(np.hypot(errors.floor, share)))
        words.append(
            "the stated errors hold for the amplitudes as measured: of the slow-roll vectors, up to "
            f"{shown(largest)}, they add {shown(share)} to the floor"
        )
    steps = None if trials.steps is None else _turned(trials.steps, trials.readings, left)
    return replace(trials, readings=left, errors=errors, warnings=(*trials.warnings, *words), steps=steps)


def _turned(steps: FloatArray, measured: ComplexArray, left: ComplexArray) -> FloatArray:
    """Steps of the difference that give the same variances along and across it as those of the measured one.

    The measured amplitude was rounded in its own direction, the phase across; what is left points elsewhere.
    """
    amplitude, phase = steps[0] ** 2, (steps[1] * np.abs(measured)) ** 2
    cos = np.cos(np.angle(left) - np.angle(measured)) ** 2
    along, across = cos * amplitude + (1 - cos) * phase, (1 - cos) * amplitude + cos * phase
    size = np.maximum(np.abs(left), 1e-12 * np.abs(measured)) + np.finfo(float).tiny
    return np.array([np.sqrt(along), np.sqrt(across) / size])
