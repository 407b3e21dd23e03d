"""What `balance` proposes for a job as it stands, and what of it was mounted where nobody says."""

from __future__ import annotations

from contextlib import suppress
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from balancing import Correction, Influence, Mounted, Trials
    from rotorid.tables import Job


def proposed(job: Job, influence: Influence, runs: Trials | None = None) -> Correction:
    """What `balance` proposes for a job with these coefficients, and no option changes it.

    Parameters
    ----------
    job
        With its limits, the planes it uses, and what is removed.
    influence, runs
        As of `correct`.
    """
    from balancing import correct

    return correct(
        influence,
        runs,
        [plane for plane in influence.planes if plane not in job.left_out],
        limits=job.limits_of(influence.planes),
        row_weights=job.row_weights,
        remove=job.removed,
    )


def pieces_mounted(
    job: Job, correction: Correction, influence: Influence, runs: Trials | None
) -> Mounted | None:
    """The pieces that `--split` proposes for a correction; None where others or none were mounted.

    Parameters
    ----------
    job
        With check runs, whose weights nobody states.
    correction, influence, runs
        Before the check runs.
    """
    from balancing import mount

    if job.check_mounted or job.check_of_weights or not set(correction.planes) & set(job.holes):
        return None
    with suppress(ValueError):  # no pieces can be proposed: the weights were
        return mount(correction, influence, runs, job.holes)
    return None
