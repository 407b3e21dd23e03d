"""Further runs of a job: slow-roll vectors, which are subtracted from all readings, and check runs.

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

from collections.abc import Iterable, Iterator, Sequence
from dataclasses import replace
from typing import TYPE_CHECKING

import numpy as np

from balancing import Groups, Influence, Trials, in_planes
from rotorid.base.arrays import ComplexArray, FloatArray
from rotorid.base.choices import did_you_mean
from rotorid.base.text import listing
from rotorid.files import units
from rotorid.files.columns import Source, source_name
from rotorid.files.input_problems import Problems
from rotorid.files.runs import make_trials, nearest_speed, show_speeds
from rotorid.files.table_layouts import Conventions

if TYPE_CHECKING:
    from rotorid.files.job_keys import Errors

SLOW = 0.5
"""A slow-roll run faster than this share of the lowest speed of the job gets a warning."""


def outside(
    part: Trials, whole: Trials | Influence, planes: Sequence[str], tolerance_percent: float = np.inf
) -> Iterator[tuple[str, str, str]]:
    """What readings have and the whole lacks: column, how it stands there, and what the whole has.

    Sensors, planes (of these), units that do not convert, and speeds.
    """
    for column, names, there in (
        ("sensor", part.sensors, whole.sensors),
        ("plane", part.planes, planes),
    ):
        for name in (name for name in names if name not in there):
            yield column, name, f"{listing(there, 'and')}{did_you_mean(name, there)}"
    labels, others = part.labels, whole.labels
    pairs = [("amplitude", units.vibration(labels.vibration_unit), units.vibration(others.vibration_unit))]
    if part.planes:
        pairs.append(("weight", units.weight(labels.weight_unit), units.weight(others.weight_unit)))
    for column, unit, other in pairs:
        if unit.kind != other.kind:
            yield column, unit.name or "no unit", f"{other.name or 'no unit'}, or a unit that converts to it"
    for speed in part.speeds.tolist():
        if nearest_speed(whole.speeds, speed, tolerance_percent) is None:
            yield "speed", labels.speed_words(speed), show_speeds(whole.speeds, labels)


def make_slow_roll(
    source: Source, trials: Trials, conventions: Conventions, problems: Problems
) -> tuple[ComplexArray, tuple[str, ...]] | None:
    """Slow-roll vectors for the sensors of a job and what to say of them, or None and problems.

    Parameters
    ----------
    source
        A runs table.
    trials
        Its readings, for names, units and speeds.
    conventions
        What phases mean, and which speeds count as one.
    problems
        Collects the complaints.

    Returns
    -------
    Complex, in the unit of the readings inside, phase lead: shape (C,), for all speeds, or (S, C); zero for a
    sensor that has none.
    """
    before, words, sensors = len(problems), list[str](), trials.sensors
    its = Problems()  # those of the job must not hide what is wrong here
    runs = make_trials(source, None, replace(conventions, run="slow roll"), None, its)
    problems.extend(its)
    if runs is None:
        return None
    place, band = source_name(source), conventions.speed_tolerance_percent
    _complain(outside(runs, trials, ()), place, place, problems)
    if len(runs.runs) > 1:
        expected = f"one run, at slow speed; there are {listing(map(repr, runs.runs), 'and')}"
        problems.add(expected, place, None, "run", runs.runs[1])
    given, vectors, lowest = runs.sensors, runs.with_phases().mean[0], float(trials.speeds.min())
    near = [nearest_speed(runs.speeds, speed, band) for speed in trials.speeds.tolist()]
    if len(runs.speeds) == 1:
        vectors = vectors[0]
        if runs.speeds[0] > SLOW * lowest:
            slow = trials.labels.speed_words(float(runs.speeds[0]))
            words.append(
                f"the slow-roll vectors were read at {slow}, which is not slow against "
                f"{trials.labels.speed_words(lowest)}: vibration that is subtracted with them is left "
                "unbalanced"
            )
    elif None in near:
        missing = trials.labels.speed_words(trials.speeds[near.index(None)])
        expected = "one slow speed, whose vectors hold for all speeds, or vectors at every speed of the "
        expected += f"job: {missing} is not among {show_speeds(runs.speeds, trials.labels)}"
        problems.add(expected, place, None, "speed")
    else:
        vectors = vectors[near]
    if len(problems) > before:
        return None
    if lacking := [repr(name) for name in sensors if name not in given]:
        words.append(
            f"there is no slow-roll vector for {listing(lacking, 'and')}: what is read there is used as it "
            "is (an amplitude of 0 says that nothing is to be subtracted)"
        )
    at = [given.index(name) if name in given else len(given) for name in sensors]
    return np.insert(vectors, len(given), 0.0, axis=-1)[..., at], tuple(words)


def _complain(more: Iterable[tuple[str, str, str]], runs: str, weights: str, problems: Problems) -> None:
    """Note what is `outside` the job in the files of further runs and their weights."""
    for column, shown, there in more:
        file = weights if column in ("plane", "weight") else runs
        problems.add(f"what the job has: {there}", file, None, column, shown)


def subtract_slow_roll(trials: Trials, vectors: ComplexArray) -> Trials:
    """Readings less the slow-roll vectors, (C,) or (S, C), with honest errors."""
    left, errors = trials.with_phases().readings - vectors, trials.errors
    if errors is not None:
        share = max(errors.amplitude, errors.phase) * float(abs(vectors).max(initial=0.0))
        errors = replace(errors, floor=float(np.hypot(errors.floor, share)))
    steps = None if trials.steps is None else _turned(trials.steps, trials.readings, left)
    return replace(trials, readings=left, errors=errors, steps=steps)


def _turned(steps: FloatArray, measured: ComplexArray, left: ComplexArray) -> FloatArray:
    """Steps of the difference that give the same variances along and across it as those of the measured one.

    The measured amplitude was rounded in its own direction, the phase across; what is left points elsewhere.
    """
    amplitude, phase = steps[0] ** 2, (steps[1] * abs(measured)) ** 2
    cos = np.cos(np.angle(left) - np.angle(measured)) ** 2
    along, across = cos * amplitude + (1 - cos) * phase, (1 - cos) * amplitude + cos * phase
    size = np.maximum(abs(left), 1e-12 * abs(measured)) + np.finfo(float).tiny
    return np.array([np.sqrt(along), np.sqrt(across) / size])


def check_runs(
    sources: tuple[Source, Source | None],
    job: Trials,
    planes: Sequence[str],
    groups: Groups,
    conventions: Conventions,
    errors: Errors | None,
    slow_roll: ComplexArray | None,
    problems: Problems,
) -> Trials | None:
    """Check runs at the speeds and with the labels of a job, and of its planes, or None and problems.

    `sources` are tables of runs and weights, these of planes or groups.
    """
    check = make_trials(*sources, replace(conventions, run="check"), errors, problems)
    if not check:
        return None
    check = in_planes(check, groups)
    before, band, runs = len(problems), conventions.speed_tolerance_percent, source_name(sources[0])
    weights = source_name(sources[1] or sources[0])
    if check.amplitudes_only and not job.amplitudes_only:
        problems.add("phases, as the runs of the job have", runs, None, "phase")
    check = replace(check, amplitudes_only=job.amplitudes_only)
    _complain(outside(check, job, planes, band), runs, weights, problems)
    near = [nearest_speed(job.speeds, v, band) for v in check.speeds.tolist()]
    for k, at in enumerate(near):
        if at is not None and at in near[:k]:
            shown = check.labels.speed_words(check.speeds[k])
            problems.add("each speed of the job once", runs, None, "speed", shown)
    if len(problems) > before:
        return None
    rows = [at or 0 for at in near]
    check = replace(check, speeds=job.speeds[rows], labels=job.labels)
    if sources[1] is not None:
        # all planes of the job: a weights table without rows says that nothing was mounted
        mounted = np.zeros((len(check.runs), len(planes)), dtype=complex)
        mounted[:, [planes.index(name) for name in check.planes]] = check.weights
        check = replace(check, planes=tuple(planes), weights=mounted)
    if slow_roll is not None:
        columns = [job.sensors.index(name) for name in check.sensors]
        vectors = np.broadcast_to(slow_roll, (len(job.speeds), len(job.sensors)))[np.ix_(rows, columns)]
        check = subtract_slow_roll(check, vectors)
    return replace(check, warnings=tuple(words for words in check.warnings if words not in job.warnings))
