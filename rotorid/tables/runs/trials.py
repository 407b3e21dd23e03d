"""Runs and weights tables together: what `balancing` works on."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np

from balancing.data.conventions import Labels
from balancing.data.trials import ReadingErrors, Trials, off_axis
from rotorid.tables.reader.grid import Grid
from rotorid.tables.reader.problems import Problems
from rotorid.tables.reader.units import Unit
from rotorid.tables.runs.conventions import DEFAULT_TOLERANCE, Angles, Conventions, Phase, StatedErrors
from rotorid.tables.runs.runs_table import read_runs
from rotorid.tables.runs.weights_table import Weights, read_weights


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
    said = ("lead" if phase is None else phase, "with rotation" if angles is None else angles)
    conventions = Conventions(*said, speed_tolerance_percent)
    trials = make_trials(runs, weights, conventions, errors, problems)
    problems.stop()
    assert trials is not None
    assumed: tuple[str, ...] = ("phase",) if phase is None else ()
    if angles is None and off_axis(trials.weights):
        assumed += ("angles",)
    return replace(trials, labels=replace(trials.labels, assumed=assumed))


def make_trials(
    runs: str | Path | Grid,
    weights: str | Path | Grid | None,
    conventions: Conventions,
    errors: StatedErrors | ReadingErrors | None,
    problems: Problems,
) -> Trials | None:
    """Put both tables together, or None and problems."""
    read = read_runs(runs, conventions, problems)
    if weights is None:
        names = read.runs if read else ()
        mounted: Weights | None = Weights(
            (), np.zeros((len(names), 0), dtype=complex), Unit("g", "mass", 1.0, 1e3)
        )
    else:
        mounted = read_weights(weights, read.runs if read else None, conventions, problems)
    if read is None or mounted is None or len(problems):
        return None
    labels = Labels(
        vibration_unit=read.unit.name,
        vibration_scale=read.unit.scale,
        weight_unit=mounted.unit.name,
        weight_scale=mounted.unit.scale,
        phase=conventions.phase,
        angles=conventions.angles,
        speed_unit=read.speed_unit.name,
    )
    return Trials(
        runs=read.runs,
        speeds=read.speeds,
        sensors=read.sensors,
        planes=mounted.planes,
        readings=read.readings,
        weights=mounted.weights,
        errors=errors.in_si(labels) if isinstance(errors, StatedErrors) else errors,
        labels=labels,
        warnings=read.warnings,
        steps=read.steps,
        run_errors=errors.between_runs(labels) if isinstance(errors, StatedErrors) else None,
    )
