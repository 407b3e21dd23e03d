"""Choice of influence coefficients that a job is balanced with: measured, stored, computed, or combined."""

from __future__ import annotations

from contextlib import suppress
from dataclasses import replace
from typing import TYPE_CHECKING

from rotorid.base.text import listing
from rotorid.files.disk import sha256

if TYPE_CHECKING:
    from collections.abc import Mapping, Sequence

    from balancing import Influence, Trials
    from rotorid.files import Job

KINDS = ("measured", "computed", "combined")
MODEL_ERROR = 20.0
"""Percent of a computed coefficient, one standard deviation, unless its rotor is calibrated."""
NEEDS_TRIAL = "the calibrated model does not explain the data it was calibrated with"
"""Why the coefficients of a calibrated model alone are not enough."""


def choose(job: Job, kind: str | None = None, *, refined: bool = False) -> tuple[Influence, Trials | None]:
    """Coefficients of a job, and the runs that give its vibration; None: those of the coefficients.

    Parameters
    ----------
    job
        Its runs, stored coefficients or rotor.
    kind
        One of `KINDS`; None: measured where there are trial weights or stored coefficients.
    refined
        By the check runs of the job.

    Returns
    -------
    Of groups where the trial weights tell these alone, else of planes.

    Raises
    ------
    ValueError
        Where the job has no rotor, or no place in it for a plane or sensor.
    UndeterminedError
        Where the runs do not determine the coefficients.
    """
    from balancing import (
        UndeterminedError,
        combine,
        estimate_influence,
        in_planes,
        refine,
        rotor_and_arbor,
        unknowns,
    )

    if job.trials.relative is not None:
        return estimate_influence(job.trials, relative=True), None
    if job.trials.index is not None:
        return rotor_and_arbor(job.trials, stored(job, kind)).rotor, None
    has_trials = bool(job.trials.weights.any())
    nothing = not has_trials and job.influence is None and job.rotor is None
    if nothing and kind is None and job.settings.machine_type:
        raise UndeterminedError(
            "no run has a trial weight: balance it from its type (rotorid balance --type "
            f"FLEET:{job.settings.machine_type}), or add runs with trial weights"
        )
    if kind is None:
        kind = "measured" if has_trials or job.influence is not None or job.rotor is None else "computed"
        if has_trials and job.rotor is not None and job.rotor.calibration and job.plane_nodes:
            kind = "computed" if counted_before(job) or not _separate(job.trials) else "combined"
    check = counted(job) if refined else None
    if check is not None and (kind == "computed" or job.influence is not None):
        raise ValueError("check runs refine coefficients from trial runs, not stored or computed ones")
    if kind == "computed":
        return computed(job, 0.0), in_planes(job.trials, job.groups)
    baseline = None if job.influence is None else job.trials
    if job.influence is not None and job.groups.keys() & job.influence.planes:
        baseline = unknowns(job.groups, job.influence.planes).of_runs(job.trials)
    measured = job.influence or (refine(job.trials, check) if check else estimate_influence(job.trials))
    if kind == "combined":
        measured = combine(measured, as_measured(job, _with_errors(job)))
    return measured, baseline


def counted(job: Job) -> Trials | None:
    """The check runs, with weights of what the trial weights are of; None: there are none."""
    return job.held.of_runs(job.check) if job.check and job.held else job.check


def of_planes(
    job: Job, coefficients: tuple[Influence, Trials | None], names: Sequence[str] = ()
) -> tuple[Influence, Trials | None]:
    """Coefficients and runs of groups as those of planes; refuses names of which the groups do not tell."""
    import numpy as np

    from balancing import in_planes, mapped, unknowns

    influence, runs = coefficients
    if job.groups.keys().isdisjoint(influence.planes):
        return coefficients
    of = unknowns(job.groups, influence.planes)
    only = f"the trial weights were in {listing(map(repr, of.names), 'and')} only"
    if of.constrained and (lost := [name for name in names if name not in of.names]):
        raise ValueError(
            f"{only}, which does not tell what {lost[0]!r} would do: choose of these, or add trial runs"
        )
    influence = mapped(influence, of.planes, of.inverse)
    if of.constrained:
        unknown = f"{only}: what weights beside these do, such as the rounding of pieces, is not known"
        notes = *influence.remarks.notes, unknown
        influence = replace(influence, remarks=influence.remarks._replace(notes=notes))
    if job.check is not None and job.check.planes and influence.mounted.run == job.check.runs[-1]:
        there = dict(zip(job.check.planes, job.check.weights[-1], strict=True))
        weights = np.array([there.get(plane, 0.0) for plane in of.planes])  # all of it, whatever counted
        mounted = influence.mounted._replace(weights=weights)
        influence = replace(influence, errors=influence.errors._replace(mounted=mounted))
    return influence, runs and in_planes(runs, job.groups)


def stored(job: Job, kind: str | None) -> Influence | None:
    """Coefficients that no runs of the job need tell: stored ones, or computed ones where these are meant."""
    return _with_errors(job) if kind == "computed" else job.influence


def _with_errors(job: Job) -> Influence:
    """Computed coefficients with the errors of a calibration, else those of a model."""
    return computed(job, 0.0 if job.rotor and job.rotor.calibration else MODEL_ERROR)


def _separate(trials: Trials) -> bool:
    """Whether the runs tell baseline and planes apart, so that there are measured coefficients to combine."""
    from balancing import UndeterminedError, check_runs

    try:
        check_runs(trials.runs, trials.planes, trials.weights)
    except UndeterminedError:
        return False
    return True


def counted_before(job: Job) -> bool:
    """Whether the calibration of the job's rotor was made from its own runs: they must not count twice."""
    calibration = None if job.rotor is None else job.rotor.calibration
    job_and_runs = job.files[:2]  # the job, then its runs
    return calibration is not None and any(sha256(file) in calibration.data.values() for file in job_and_runs)


def needs_trial_run(job: Job, influence: Influence) -> bool:
    """Whether these coefficients are those of a model alone that contradicts its own data."""
    calibration = None if job.rotor is None else job.rotor.calibration
    if calibration is None or influence is job.influence or job.trials.weights.any():
        return False
    return calibration.needs_trial_run


def as_measured(job: Job, influence: Influence) -> Influence:
    """Coefficients of planes as those of the groups that do not tell planes apart."""
    from balancing import mapped

    of = job.held
    return influence if of is None else mapped(influence, of.names, of.shares)


def used_planes(job: Job, influence: Influence) -> list[str]:
    """Planes and groups of these coefficients of which the job does not leave out a plane."""
    left_out = job.planes.keys() - job.used
    return [name for name in influence.planes if left_out.isdisjoint(job.groups.get(name, (name,)))]


def unknowns_of(job: Job, influence: Influence) -> list[str]:
    """The groups of the job, where they are as many as the planes in use and tell them apart; else these."""
    from balancing import unknowns

    planes, names = used_planes(job, influence), [*job.groups]
    with suppress(ValueError):
        of = unknowns(job.groups, names, planes)
        if names and not of.constrained and of.planes == tuple(planes):
            return names
    return planes


def computed(job: Job, error_percent: float, stations: Mapping[str, int] | None = None) -> Influence:
    """Coefficients from the rotor model of the job, at its planes, or per unbalance at given stations.

    Those of a calibrated rotor have its errors.

    Raises
    ------
    ValueError
        As `model_places`.
    UndeterminedError
        For a calibrated rotor that its data contradict and that is not stable.
    """
    from balancing import UndeterminedError, model_influence
    from rotorid.commands.model_places import model_places
    from rotorid.commands.one_shot import calibrated

    places = model_places(job, stations)
    assert job.rotor is not None
    labels = job.trials.labels
    if stations is not None:
        labels = replace(labels, weight_unit="g_mm", weight_scale=1e6)
    calibration = job.rotor.calibration
    why = f"{NEEDS_TRIAL}: " if calibration and calibration.needs_trial_run else ""
    try:
        computed = model_influence(
            job.rotor,
            places.nodes,
            places.sensors,
            job.trials.speeds,
            radii=places.radii,
            relative_error=error_percent / 100,
            quantity=places.quantity,
            key_phasor=job.key_phasor,
            labels=labels,
        )
    except ValueError as problem:
        raise UndeterminedError(f"{why}{problem}") if why else problem from None
    if calibration is None:
        return computed
    computed = calibrated(computed, job, places)
    warnings = computed.remarks.warnings
    if why:
        warnings = *warnings, f"{why}make a trial run, which is combined with it"
    return replace(computed, remarks=computed.remarks._replace(warnings=warnings))
