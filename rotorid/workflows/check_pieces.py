"""Pieces that are taken to have been mounted in the check runs of a job with holes."""

from __future__ import annotations

from dataclasses import replace
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from collections.abc import Mapping

    from balancing import Correction, Influence, Trials
    from balancing.mounting.holes import Holes
    from rotorid.tables import Job

UNPROVEN = (
    "the pieces that are taken to have been mounted were not proven in time to be the ones that --split "
    "proposes each time: state what was mounted, check_weights, a table"
)


def asked(job: Job) -> bool:
    """Whether pieces were mounted in the check runs, and nobody says which."""
    return bool(job.holes and job.check is not None and not (job.check.planes or job.check_exact)) and not (
        job.check_mounted
    )


def with_pieces(
    job: Job,
    correction: Correction,
    influence: Influence,
    runs: Trials | None,
    *,
    time_limit: float = 5.0,
    within: float | None = None,
) -> Job:
    """The job whose check runs have the pieces that `--split` proposes for a correction, where nobody says.

    Parameters
    ----------
    job
        With check runs; as it is where it says what was mounted, or has no holes in these planes.
    correction, influence, runs
        Before the check runs.
    time_limit, within
        As of `mount`; within None: as `--split` without `--best`.
    """
    import numpy as np

    from balancing.mounting.fewest_pieces import FEW
    from balancing.mounting.mount import mount

    if not asked(job) or not set(correction.planes) & set(job.holes):
        return job
    assert job.check is not None
    try:
        pieces = mount(
            correction,
            influence,
            runs,
            job.holes,
            row_weights=job.row_weights,
            time_limit=time_limit,
            within=within or FEW,
        )
    except ValueError:  # no pieces can be proposed: the weights were
        return job
    weights = np.tile(pieces.weights, (len(job.check.runs), 1))
    warnings = job.check.warnings + (() if pieces.found.proven else (UNPROVEN,))
    check = replace(job.check, planes=correction.planes, weights=weights, warnings=warnings)
    return replace(job, check=check, check_pieces=pieces)


def free_holes(job: Job) -> Mapping[str, Holes]:
    """Holes and pieces that are left beside those of the check run.

    Raises
    ------
    ValueError
        Where nothing more can be mounted.
    """
    if job.check_pieces is None:
        return job.holes
    left = dict(job.holes)
    mountings = job.check_pieces.found.mountings
    for plane, mounting in zip(job.check_pieces.correction.planes, mountings, strict=True):
        if plane in left and mounting is not None:
            holes = left[plane]
            stock = None if holes.stock is None else holes.stock - mounting.counts.sum(axis=0)
            left[plane] = replace(holes, taken=holes.taken + mounting.amounts, stock=stock)
    return left


def mounted_words(job: Job) -> str:
    """What is taken to have been mounted in the check runs, and how to say otherwise; empty: as written."""
    other = 'check_weights = "weights" or a table says otherwise'
    if job.check_pieces is not None:
        return f"{job.check_pieces.in_holes()}, the pieces of --split ({other})"
    if job.check is None or job.check_mounted or not job.holes:
        return ""
    if job.check_exact:
        return "the proposed weights, as check_weights says"
    return "the proposed weights (check_weights, a table, says otherwise)"
