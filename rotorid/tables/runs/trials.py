"""Runs and weights tables together: what `balancing` works on."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

from balancing import Labels, ReadingErrors, Trials
from rotorid.base.complex_numbers import off_axis
from rotorid.tables.reader.columns import Source
from rotorid.tables.reader.problems import Problems
from rotorid.tables.runs.runs_table import read_runs
from rotorid.tables.runs.stated_conventions import DEFAULT_TOLERANCE, Angles, Conventions, Phase, StatedErrors
from rotorid.tables.runs.weights_table import read_weights


def read_trials(
    runs: str | Path,
    weights: str | Path | None,
    *,
    phase: Phase | None = None,
    angles: Angles | None = None,
    speed_tolerance_percent: float = DEFAULT_TOLERANCE,
    errors: StatedErrors | ReadingErrors | None = None,
) -> Trials:
    """Read a runs table and a weights table.

    Parameters
    ----------
    runs, weights
        Files (`.csv`, `.xlsx`); weights may be None where influence coefficients are known.
    phase
        Whether a positive phase in the runs table leads or lags; None: lead, which the labels call assumed.
    angles
        Whether angles in the weights table count with or against the rotation; None: with, which the labels
        call assumed where an angle other than 0° and 180° is mounted.
    speed_tolerance_percent
        Speeds of different runs that differ by less count as one, their mean.
    errors
        One standard deviation of a reading.

    Returns
    -------
    balancing.Trials
        In SI (readings without a known unit as they are), phase lead, angles with the rotation.

    Raises
    ------
    InputError
        With all problems of both files.
    ValueError
        If an argument is none of the allowed values.
    """
    problems = Problems()
    labels = Labels(phase=phase or "lead", angles=angles or "with rotation")
    conventions = Conventions(labels, speed_tolerance_percent)
    trials = make_trials(runs, weights, conventions, errors, problems)
    problems.stop()
    assert trials is not None
    assumed: tuple[str, ...] = ("phase",) if phase is None else ()
    if angles is None and off_axis(trials.weights):
        assumed += ("angles",)
    return replace(trials, labels=replace(trials.labels, assumed=assumed))


def make_trials(
    runs: Source,
    weights: Source | None,
    conventions: Conventions,
    errors: StatedErrors | ReadingErrors | None,
    problems: Problems,
) -> Trials | None:
    """Put both tables together, or None and problems."""
    names, read = read_runs(runs, conventions, problems)
    mounted = None if weights is None else read_weights(weights, names, conventions, problems)
    if read is None or (mounted is None and weights is not None) or len(problems):
        return None
    labels = read.labels
    if isinstance(errors, StatedErrors):
        read = errors.stated_in(read)
    elif errors is not None:
        read = replace(read, errors=errors)
    planes, placed = read.planes, read.weights
    if mounted is not None:
        planes, placed = mounted.planes, mounted.weights
        labels = replace(labels, weight_unit=mounted.unit.name, weight_scale=mounted.unit.scale)
    return replace(read, planes=planes, weights=placed, labels=labels)
