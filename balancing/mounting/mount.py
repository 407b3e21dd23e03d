"""Mounting a correction: pieces in holes, chosen for all planes together."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np
from numpy.typing import ArrayLike

from balancing.coefficients.baseline import match_speeds, starting_point
from balancing.coefficients.influence import Influence
from balancing.correction.correction_errors import stack_errors
from balancing.correction.correction_result import Correction
from balancing.data.result_columns import rms
from balancing.data.trials import Trials
from balancing.mounting.discrete_weights import solve_discrete
from balancing.mounting.fewest_pieces import FEW, LITTLE
from balancing.mounting.holes import Holes
from balancing.mounting.mount_result import Mounted
from balancing.solvers.error_propagation import prediction_covariance
from rotorid.base.arrays import FloatArray


def mount(
    correction: Correction,
    influence: Influence,
    baseline: Trials | ArrayLike | None,
    holes: Mapping[str, Holes],
    *,
    row_weights: FloatArray | None = None,
    time_limit: float = 5.0,
    on_top: bool = False,
    within: float = FEW,
) -> Mounted:
    """Choose the fewest pieces, for all planes together, that leave little more than the least vibration.

    Parameters
    ----------
    correction
        The continuous correction; its method decides what "least" means (by errors: rows count by the inverse
        of their errors at the continuous correction).
    influence, baseline, row_weights
        As they were given to `correct`.
    holes
        By plane; planes without get any weight at any angle.
    time_limit
        s, for the proof of the optimum.
    within
        So many times the least vibration (what the method minimises) is good enough, and so is what a check
        run with the exact weights hides (95 %), or a fifth of the present vibration; 1: the least.
    on_top
        Whether what is mounted in the last run stays, and pieces are added to it; otherwise it is removed.

    Raises
    ------
    ValueError
        Where no plane has holes, nothing that can be mounted keeps the limits, or weights stay in holes that
        nobody names (`Holes.taken`).
    """
    planes = correction.planes
    own = tuple(holes.get(plane) for plane in planes)
    if not any(own):
        raise ValueError("no plane has holes: holes = N or holes_deg = [...] in [planes.NAME] of the job")
    start = starting_point(influence, baseline)
    at = match_speeds(correction.speeds, influence.speeds)
    chosen = [influence.planes.index(plane) for plane in planes]
    W = influence.W[at][..., chosen].reshape(-1, len(chosen))
    Y = correction.before
    stays = correction.mounted if on_top else None
    total = np.zeros(len(planes), dtype=complex)
    if stays is not None:
        there = dict(zip(stays[1], stays[2], strict=True))
        unnamed = [
            p for p, h in zip(planes, own, strict=True) if h and there.get(p, 0.0) and not h.taken.any()
        ]
        if unnamed:
            raise ValueError(
                f"the holes in which weights of run {stays[0]!r} stand are not named, and must stay free: "
                f'taken = {{ "3" = 10 }} (hole and weight) in [planes.{unnamed[0]}] of the job'
            )
        total = np.array([there.get(plane, 0.0) for plane in planes])
        Y = Y + influence.W[at] @ np.array([there.get(plane, 0.0) for plane in influence.planes])
    errors = stack_errors(influence, start, at, chosen)
    rows = None if row_weights is None else row_weights[at].ravel()
    if correction.method == "weighted" and errors is not None:
        each = prediction_covariance(correction.weights, errors.channels)
        variance = np.trace(each, axis1=1, axis2=2) / 2
        rows = (1.0 if rows is None else rows) / np.sqrt(np.maximum(variance, 1e-6 * variance.max()))
    found = solve_discrete(
        W,
        Y.ravel(),
        dict(zip(planes, own, strict=True)),
        method="minmax" if correction.method == "minmax" else "least-squares",
        row_weights=rows,
        limits=correction.limits,
        time_limit=time_limit,
        within=(within, max(LITTLE, (correction.check_rms or 0.0) / rms(Y)) if Y.any() else 0.0),
    )
    after = Y + (W @ found.weights).reshape(Y.shape)
    after_covariance = None if errors is None else errors.check_run(total + found.weights, after)
    return Mounted(correction, own, found, after, after_covariance, None if stays is None else stays[0])
