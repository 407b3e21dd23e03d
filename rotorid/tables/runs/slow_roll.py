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

from collections.abc import Iterator, Mapping
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from balancing import Labels, ReadingErrors, Trials
from rotorid.base.arrays import ComplexArray, FloatArray
from rotorid.base.suggestions import did_you_mean
from rotorid.base.text import counted, listing
from rotorid.files import units
from rotorid.files.columns import Source, source_name
from rotorid.files.conventions import Conventions
from rotorid.files.problems import Problems
from rotorid.files.runs import make_trials
from rotorid.files.speeds import nearest_speed, show_speed, show_speeds

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
    said: Source | Mapping[str, Vector], trials: Trials, conventions: Conventions, problems: Problems
) -> SlowRoll | None:
    """Slow-roll vectors for the sensors of a job, or None and problems.

    Parameters
    ----------
    said
        A runs table, or by sensor `amplitude` (in its unit, or without one in that of the readings) and
        `phase_deg`.
    trials
        Its readings, for names, units and speeds.
    conventions
        What phases mean, and which speeds count as one.
    problems
        Collects the complaints.
    """
    before = len(problems)
    if isinstance(said, Mapping):
        found: _Found | None = _from_vectors(said, trials, conventions, problems)
    else:
        found = _from_file(said, trials, conventions, problems)
    if found is None or len(problems) > before:
        return None
    vectors, speeds, given, words = found
    lacking = [name for name in trials.sensors if name not in given]
    if lacking:
        many = len(lacking) > 1
        words = (
            *words,
            f"there is no slow-roll vector for sensor{'s' if many else ''} "
            f"{listing(map(repr, lacking), 'and')}: {'their' if many else 'its'} readings are used as they "
            "are (amplitude = 0 says that nothing is to be subtracted)",
        )
    return SlowRoll(trials.sensors, vectors, speeds, words)


class _Found(NamedTuple):
    """Vectors (C,) or (S, C), their speeds, names of the sensors that have one, and warnings."""

    vectors: ComplexArray
    speeds: FloatArray | None
    given: tuple[str, ...]
    warnings: tuple[str, ...] = ()


def _from_vectors(
    said: Mapping[str, Vector], trials: Trials, conventions: Conventions, problems: Problems
) -> _Found:
    """Vectors of the job file, for all speeds."""
    own = units.vibration(trials.labels.vibration_unit)
    vectors = np.zeros(len(trials.sensors), dtype=complex)
    for name, vector in said.items():
        amplitude, phase = vector.amplitude, vector.phase
        if name not in trials.sensors:
            expected = (
                f"a sensor of the runs table, not {name!r}{did_you_mean(name, trials.sensors)}; "
                f"its sensors are {listing(trials.sensors, 'and')}"
            )
            vector.complain(problems, "", expected)
        else:
            unit = amplitude.unit if amplitude.unit.name else own
            if unit.kind != own.kind:
                vector.complain(problems, "amplitude", _other_unit(own.name))
                continue
            size, angle = np.array([unit.to_si(amplitude.value)]), np.array([np.radians(phase)])
            vectors[trials.sensors.index(name)] = conventions.labels.vibration_from(size, angle)[0]
    return _Found(vectors, None, tuple(said))


def _from_file(table: Source, trials: Trials, conventions: Conventions, problems: Problems) -> _Found | None:
    """Vectors of a runs table."""
    own = Problems()  # what is wrong with the job must not hide what is wrong with this file, nor the reverse
    runs = make_trials(table, None, conventions, None, own)
    problems.extend(own)
    if runs is None:
        return None
    before, source = len(problems), source_name(table)
    ours, its = (units.vibration(one.labels.vibration_unit) for one in (trials, runs))
    if its.kind != ours.kind:
        problems.add(source, None, "amplitude", its.name or "no unit", _other_unit(ours.name))
    if len(runs.runs) > 1:
        expected = f"one run, at slow speed; there are {listing(map(repr, runs.runs), 'and')}"
        problems.add(source, None, "run", runs.runs[1], expected)
    for name in runs.sensors:
        if name not in trials.sensors:
            expected = (
                f"a sensor of the job{did_you_mean(name, trials.sensors)}; "
                f"its sensors are {listing(trials.sensors, 'and')}"
            )
            problems.add(source, None, "sensor", name, expected)
    rows = _rows(runs, source, trials, conventions, problems) if len(runs.speeds) > 1 else None
    if len(problems) > before:
        return None
    all_sensors = np.zeros((len(runs.speeds), len(trials.sensors)), dtype=complex)
    all_sensors[:, [trials.sensors.index(name) for name in runs.sensors]] = runs.mean[0]
    if rows is not None:
        return _Found(all_sensors[rows], trials.speeds, runs.sensors)
    speed, lowest = float(runs.speeds[0]), float(trials.speeds.min())
    words: tuple[str, ...] = ()
    if speed > SLOW * lowest:
        unit = units.SPEED[trials.labels.speed_unit]
        words = (
            f"the slow-roll vectors were read at {show_speed(speed, unit)}, which is not slow against "
            f"{show_speed(lowest, unit)}: vibration that is subtracted with them is left unbalanced",
        )
    return _Found(all_sensors[0], None, runs.sensors, words)


def _rows(
    runs: Trials, source: str, trials: Trials, conventions: Conventions, problems: Problems
) -> list[int]:
    """Which row of the slow run belongs to each speed of the job, where there are several."""
    rows = []
    unit = units.SPEED[trials.labels.speed_unit]
    for speed in trials.speeds:
        near = nearest_speed(runs.speeds, float(speed), conventions.speed_tolerance_percent)
        if near is None:
            expected = (
                f"one slow speed, whose vectors hold for all speeds, or vectors at every speed of the job: "
                f"{show_speed(float(speed), unit)} is not among {show_speeds(runs.speeds, unit)}"
            )
            problems.add(source, None, "speed", None, expected)
            break
        rows.append(near)
    return rows


def _other_unit(name: str) -> str:
    return f"an amplitude in {name or 'no unit'}, as the readings have, or in a unit that converts to it"


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
    errors, words = _widened(trials.errors, float(np.abs(S).max(initial=0.0)), trials.labels)
    warnings = (*trials.warnings, *roll.warnings, *_larger(trials, S), *words)
    steps = None if trials.steps is None else _turned(trials.steps, trials.readings, trials.readings - S)
    return replace(trials, readings=trials.readings - S, errors=errors, warnings=warnings, steps=steps)


def _turned(steps: FloatArray, measured: ComplexArray, left: ComplexArray) -> FloatArray:
    """Steps of the difference that give the same variances along and across it as those of the measured one.

    The measured amplitude was rounded in its own direction, the phase across; what is left points elsewhere.
    """
    amplitude, phase = steps[0] ** 2, (steps[1] * np.abs(measured)) ** 2
    cos = np.cos(np.angle(left) - np.angle(measured)) ** 2
    along, across = cos * amplitude + (1 - cos) * phase, (1 - cos) * amplitude + cos * phase
    size = np.maximum(np.abs(left), 1e-12 * np.abs(measured)) + np.finfo(float).tiny
    return np.array([np.sqrt(along), np.sqrt(across) / size])


def _widened(
    errors: ReadingErrors | None, largest: float, labels: Labels
) -> tuple[ReadingErrors | None, tuple[str, ...]]:
    """Errors of the difference, and what to say about them."""
    relative = 0.0 if errors is None else max(errors.amplitude, errors.phase)
    share = relative * largest
    if errors is None or share == 0.0:
        return errors, ()
    words = (
        "the stated errors hold for the amplitudes as measured: of the slow-roll vectors, up to "
        f"{_shown(largest, labels)}, they add {_shown(share, labels)} to the floor"
    )
    return replace(errors, floor=float(np.hypot(errors.floor, share))), (words,)


def _larger(trials: Trials, S: ComplexArray) -> Iterator[str]:
    """A sentence for each sensor that reads less than its slow-roll vector, about the worst reading."""
    size = np.abs(trials.mean)
    unit = units.SPEED[trials.labels.speed_unit]
    for c, sensor in enumerate(trials.sensors):
        less = size[:, :, c] < np.abs(S[:, c]) * (1.0 - 1e-12)
        if not less.any():
            continue
        excess = np.where(less, np.abs(S[:, c]) - size[:, :, c], -np.inf)
        r, s = np.unravel_index(int(np.argmax(excess)), excess.shape)
        speed = show_speed(float(trials.speeds[s]), unit)
        own, read = _shown(abs(S[s, c]), trials.labels), _shown(size[r, s, c], trials.labels)
        others = int(less.sum()) - 1
        more = f", and than {counted(others, 'other reading')}" if others else ""
        yield (
            f"the slow-roll vector of sensor {sensor!r}, {own}, is larger than its reading in run "
            f"{trials.runs[r]!r} at {speed}, {read}{more}: check its unit, and that the readings have not "
            "been corrected already"
        )


def _shown(amplitude: float, labels: Labels) -> str:
    return f"{amplitude * labels.vibration_scale:.3g} {labels.vibration_in}".rstrip()
