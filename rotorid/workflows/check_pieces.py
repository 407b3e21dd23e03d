"""Pieces that are taken to have been mounted in the check runs of a job with holes."""

from __future__ import annotations

from contextlib import suppress
from dataclasses import replace
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from balancing import Correction, Influence, Mounted, Trials
    from rotorid.tables import Job


def pieces_mounted(
    job: Job, correction: Correction, influence: Influence, runs: Trials | None, time_limit: float = 5.0
) -> Mounted | None:
    """The pieces that `--split` proposes for a correction; None where others or none were mounted.

    Parameters
    ----------
    job
        With check runs, whose weights nobody states.
    correction, influence, runs
        Before the check runs.
    time_limit
        As of `mount`.
    """
    from balancing.mounting.mount import mount

    if job.check is None or job.check_mounted or not set(correction.planes) & set(job.holes):
        return None
    with suppress(ValueError):  # no pieces can be proposed: the weights were
        return mount(
            correction, influence, runs, job.holes, row_weights=job.row_weights, time_limit=time_limit
        )
    return None


def with_pieces(job: Job, pieces: Mounted) -> Job:
    """The job with these pieces as the weights of its check runs; they are in its holes, and not in stock."""
    import numpy as np

    assert job.check is not None
    weights = np.tile(pieces.weights, (len(job.check.runs), 1))
    check, holes = replace(job.check, planes=pieces.correction.planes, weights=weights), dict(job.holes)
    for plane, mounting in zip(pieces.correction.planes, pieces.found.mountings, strict=True):
        if mounting is not None:
            old = holes[plane]
            stock = None if old.stock is None else old.stock - mounting.counts.sum(axis=0)
            try:
                holes[plane] = replace(old, taken=old.taken + mounting.amounts, stock=stock)
            except ValueError:  # no hole or no piece is left: more only elsewhere
                del holes[plane]
    return replace(job, check=check, check_pieces=pieces, holes=holes)
