"""Choice of influence coefficients that a job is balanced with: measured, stored, computed, or combined."""

from __future__ import annotations

from typing import TYPE_CHECKING

from rotorid.base.text import listing

if TYPE_CHECKING:
    from collections.abc import Mapping, Sequence

    from balancing import Influence, Trials
    from rotorid.files import Job

KINDS = ("measured", "computed", "combined")
MODEL_ERROR = 20.0
"""Percent of a computed coefficient, one standard deviation, unless its rotor is calibrated."""


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
    from balancing import UndeterminedError, combine, estimate_influence, mapped, refine, unknowns
    from rotorid.commands.one_shot import counted_before
    from rotorid.files.job_planes import in_planes

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
    if refined and check is None:
        raise ValueError('there are no check runs to refine with: check = "check.csv" in the job file')
    if check is not None and (kind == "computed" or job.influence is not None):
        raise ValueError("check runs refine coefficients from trial runs, not stored or computed ones")
    if kind == "computed":
        return computed(job, 0.0), in_planes(job.trials, job.groups)
    baseline = None if job.influence is None else job.trials
    measured = job.influence or (refine(job.trials, check) if check else estimate_influence(job.trials))
    if kind == "combined":
        calibrated = job.rotor is not None and job.rotor.calibration
        model = computed(job, 0.0 if calibrated else MODEL_ERROR)
        of = unknowns(job.groups, measured.planes, model.planes)
        measured = combine(measured, mapped(model, of.names, of.shares) if of.constrained else model)
    return measured, baseline


def counted(job: Job) -> Trials | None:
    """The check runs with weights in what the trial runs have theirs in; None: there are none.

    Raises
    ------
    ValueError
        Where what was mounted is beside the groups of the trial weights.
    """
    from balancing import unknowns

    if job.check is None or job.groups.keys().isdisjoint(job.trials.planes):
        return job.check
    return unknowns(job.groups, job.trials.planes).of_runs(job.check)


def of_planes(
    job: Job, coefficients: tuple[Influence, Trials | None], names: Sequence[str] = ()
) -> tuple[Influence, Trials | None]:
    """Coefficients of groups, and their runs, as those of planes: right for weights of these groups alone.

    Raises
    ------
    ValueError
        Where planes or other groups of these names are asked for.
    """
    import numpy as np

    from balancing import mapped, unknowns
    from rotorid.files.job_planes import in_planes

    influence, runs = coefficients
    if job.groups.keys().isdisjoint(influence.planes):
        return coefficients
    of = unknowns(job.groups, influence.planes)
    asked = unknowns(job.groups, names or of.names)
    whole = of.over(asked.planes)
    shares = dict(zip(asked.planes, asked.shares, strict=True))
    nothing = 0 * asked.shares[0]
    if whole.beside(np.array([shares.get(plane, nothing) for plane in whole.planes]).T) > 1e-9:
        raise ValueError(
            f"the trial weights were in {listing(map(repr, of.names), 'and')} only, which does not tell what "
            f"{listing(map(repr, asked.names), 'and')} would do: choose of these, or add trial runs"
        )
    return mapped(influence, of.planes, of.inverse), runs and in_planes(runs, job.groups)


def _separate(trials: Trials) -> bool:
    """Whether the runs tell baseline and planes apart, so that there are measured coefficients to combine."""
    from balancing import UndeterminedError, check_runs

    try:
        check_runs(trials.runs, trials.planes, trials.weights)
    except UndeterminedError:
        return False
    return True


def as_measured(job: Job, influence: Influence) -> Influence:
    """Coefficients of planes as those of the groups that the trial weights tell alone."""
    from balancing import mapped, unknowns

    stated = job.trials.planes if job.influence is None else job.influence.planes
    if job.groups.keys().isdisjoint(stated):
        return influence
    of = unknowns(job.groups, stated, influence.planes)
    return mapped(influence, of.names, of.shares)


def used_planes(job: Job, influence: Influence) -> list[str]:
    """Planes and groups of these coefficients of which the job does not leave out a plane."""
    left_out = job.planes.keys() - job.used
    return [name for name in influence.planes if left_out.isdisjoint(job.groups.get(name, (name,)))]


def computed(job: Job, error_percent: float, stations: Mapping[str, int] | None = None) -> Influence:
    """Coefficients from the rotor model of the job, at its planes, or per unbalance at given stations.

    Those of a calibrated rotor have its errors.

    Raises
    ------
    ValueError
        As `model_places`.
    """
    from dataclasses import replace

    from balancing import model_influence
    from rotorid.commands.model_places import model_places
    from rotorid.commands.one_shot import calibrated

    places = model_places(job, stations)
    assert job.rotor is not None
    labels = job.trials.labels
    if stations is not None:
        labels = replace(labels, weight_unit="g_mm", weight_scale=1e6)
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
    return computed if job.rotor.calibration is None else calibrated(computed, job, places)
