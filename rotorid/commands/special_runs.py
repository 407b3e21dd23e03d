"""Runs with trial weights that nobody knows, and with the rotor turned on its arbor, for `balance`."""

from __future__ import annotations

from collections.abc import Mapping
from typing import TYPE_CHECKING, Any

from rotorid.commands.coefficients import stored

if TYPE_CHECKING:
    from balancing import Correction
    from rotorid.files import Job

_ABSOLUTE = ["influence", "coefficients", "machine_type", "max_mass", "ridge", "split", "refine", "grade"]
_OF_ONE_INDEX = ["machine_type", "refine"]


def refuse(job: Job, options: Mapping[str, Any]) -> None:
    """Refuse options that need known weights, or a rotor that stays as it is on its shaft."""
    relative, index = job.trials.relative, job.trials.index
    for name in _ABSOLUTE if relative else _OF_ONE_INDEX if index is not None else ():
        if options[name]:
            option = "type" if name == "machine_type" else name.replace("_", "-")
            why = "the trial weights of this job are not known (?)" if relative else "this job has an index"
            raise ValueError(f"--{option} does not go with it: {why}")
    if relative and relative.angle and job.limits and any(job.limits.forbidden):
        raise ValueError("forbidden_deg does not go with it: the places of trial weights are not known (?)")
    if index is not None and options["coefficients"] == "combined":
        raise ValueError("--coefficients combined does not go with it: this job has an index")
    if relative and index is not None:
        raise ValueError("runs at several indices need trial weights that are known, without ?")


def special(result: Correction, job: Job, kind: str | None) -> Correction:
    """A correction as multiples of the trial weights, or with the unbalance of the arbor."""
    from balancing import relative_to, rotor_and_arbor, with_arbor

    if job.trials.relative is not None:
        return relative_to(result, job.trials.relative)
    if job.trials.index is None:
        return result
    return with_arbor(result, rotor_and_arbor(job.trials, stored(job, kind)))
