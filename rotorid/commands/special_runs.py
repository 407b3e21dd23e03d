"""Runs with trial weights that nobody knows, and with the rotor turned on its arbor, for `balance`."""

from __future__ import annotations

from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from balancing import Correction, Influence
    from rotorid.commands.balance_solution import BalanceOptions
    from rotorid.files import Job

_ABSOLUTE = ["influence", "coefficients", "machine_type", "max_mass", "ridge", "split", "refine", "grade"]
_OF_BARE_RUNS = ["machine_type", "refine"]


def refuse(job: Job, options: BalanceOptions) -> None:
    """Refuse options that need known weights, or runs of a rotor that stays as it is on its shaft."""
    relative, index = job.trials.relative is not None, job.trials.index is not None
    for name in _ABSOLUTE if relative else _OF_BARE_RUNS if index else ():
        if getattr(options, name):
            option = "type" if name == "machine_type" else name.replace("_", "-")
            why = "the trial weights of this job are not known (?)" if relative else "this job has an index"
            raise ValueError(f"--{option} does not go with it: {why}")
    if job.trials.relative and job.trials.relative.angle and job.limits and any(job.limits.forbidden):
        raise ValueError("forbidden_deg does not go with it: the places of trial weights are not known (?)")
    if relative and index:
        raise ValueError("runs at several indices need trial weights that are known, without ?")


def coefficients(job: Job, kind: str | None) -> Influence | None:
    """Those of unknown trial weights, or of a rotor without its arbor; None: they are ordinary ones."""
    from balancing import estimate_influence, rotor_and_arbor

    if job.trials.relative is not None:
        return estimate_influence(job.trials, relative=True)
    if job.trials.index is None:
        return None
    return rotor_and_arbor(job.trials, _stored(job, kind)).rotor


def _stored(job: Job, kind: str | None) -> Influence | None:
    from rotorid.commands.coefficients import MODEL_ERROR, computed

    if kind != "computed":
        return job.influence
    return computed(job, 0.0 if job.rotor and job.rotor.calibration else MODEL_ERROR)


def special(result: Correction, job: Job, kind: str | None) -> Correction:
    """A correction as multiples of the trial weights, or with the unbalance of the arbor."""
    from balancing import relative_to, rotor_and_arbor, with_arbor

    if job.trials.relative is not None:
        return relative_to(result, job.trials.relative)
    if job.trials.index is None:
        return result
    return with_arbor(result, rotor_and_arbor(job.trials, _stored(job, kind)))
