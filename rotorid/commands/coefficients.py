"""Choice of influence coefficients that a job is balanced with: measured, stored, computed, or combined."""

from __future__ import annotations

from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from collections.abc import Mapping

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

    Raises
    ------
    ValueError
        Where the job has no rotor, or no place in it for a plane or sensor.
    UndeterminedError
        Where the runs do not determine the coefficients.
    """
    from balancing import UndeterminedError, combine, estimate_influence, refine, rotor_and_arbor
    from rotorid.commands.one_shot import counted_before

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
    check = job.check if refined else None
    if refined and check is None:
        raise ValueError('there are no check runs to refine with: check = "check.csv" in the job file')
    if check is not None and (kind == "computed" or job.influence is not None):
        raise ValueError("check runs refine coefficients from trial runs, not stored or computed ones")
    if kind == "computed":
        return computed(job, 0.0), job.trials
    baseline = None if job.influence is None else job.trials
    measured = job.influence or (refine(job.trials, check) if check else estimate_influence(job.trials))
    if kind == "combined":
        calibrated = job.rotor is not None and job.rotor.calibration
        measured = combine(measured, computed(job, 0.0 if calibrated else MODEL_ERROR))
    return measured, baseline


def stored(job: Job, kind: str | None) -> Influence | None:
    """Coefficients that no runs of the job need tell: stored ones, or computed ones where these are meant."""
    if kind != "computed":
        return job.influence
    return computed(job, 0.0 if job.rotor and job.rotor.calibration else MODEL_ERROR)


def _separate(trials: Trials) -> bool:
    """Whether the runs tell baseline and planes apart, so that there are measured coefficients to combine."""
    from balancing import UndeterminedError, check_runs

    try:
        check_runs(trials.runs, trials.planes, trials.weights)
    except UndeterminedError:
        return False
    return True


def used_planes(job: Job, influence: Influence) -> list[str]:
    """Planes of these coefficients that the job does not leave out."""
    return [plane for plane in influence.planes if plane in job.used or plane not in job.planes]


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
