"""A correction as it can really be mounted: pieces in holes, all planes together."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import ArrayLike

from balancing.coefficients.baseline import match_speeds, starting_point
from balancing.coefficients.influence import Influence
from balancing.correction.correct import Correction
from balancing.correction.stack_errors import stack_errors
from balancing.data.trials import Trials
from balancing.mounting.discrete import Discrete, solve_discrete
from balancing.mounting.holes import Holes, Mounting
from balancing.mounting.split import split
from balancing.solvers.error_propagation import prediction_covariance
from rotorid.base.arrays import ComplexArray, FloatArray

if TYPE_CHECKING:
    import pandas as pd


AGAINST = 3.0
"""Pieces that weigh more than this times what they make are said to act against each other."""


@dataclass(frozen=True, eq=False)
class Mounted:
    """Pieces in holes that leave the least vibration.

    Attributes
    ----------
    correction
        The continuous one, in the same planes.
    holes
        Of each plane; None: any weight at any angle.
    found
        Pieces of each plane, and how near the optimum they are known to be.
    after
        Predicted vibration with them, (S, C).
    after_covariance
        Of a reading in a check run around it, (S, C, 2, 2); None where errors are unknown.
    on_top_of
        Run whose weights stay mounted; None: everything is removed before.
    """

    correction: Correction
    holes: tuple[Holes | None, ...]
    found: Discrete
    after: ComplexArray
    after_covariance: FloatArray | None
    on_top_of: str | None = None

    @property
    def warnings(self) -> tuple[str, ...]:
        """Planes in which pieces act mostly against each other, for a gain that may be nothing."""
        labels, said = self.correction.labels, []
        for plane, chosen in zip(self.correction.planes, self.found.mountings, strict=True):
            if chosen is None:
                continue
            total, made = float(chosen.amounts.sum()), abs(chosen.vector)
            if total > AGAINST * made:
                shown = [labels.weight(value)[0] for value in (total + 0j, made + 0j)]
                said.append(
                    f"plane {plane}: pieces of {float(shown[0]):.4g} {labels.weight_unit} together make "
                    f"{float(shown[1]):.4g} {labels.weight_unit}, they act against each other: state a "
                    "stock, or fewer pieces per hole, if fewer would do"
                )
        return tuple(said)

    @property
    def weights(self) -> ComplexArray:
        """What the pieces of each plane add up to, (P,)."""
        return self.found.weights

    def to_dict(self) -> dict[str, Any]:
        """As JSON types, in the job's units and conventions."""
        from balancing.mounting.mounted_text import mounted_dict

        return mounted_dict(self)

    def to_frame(self) -> pd.DataFrame:
        """One row per hole that gets something: plane, action, hole, angle_deg, mass, unit, pieces."""
        import pandas as pd

        columns = ["plane", "action", "hole", "angle_deg", "mass", "unit", "pieces"]
        return pd.DataFrame(self.to_dict()["holes"], columns=columns)

    def summary(self) -> str:
        """Text: hole by hole, what is left of the vibration, and how sure the optimum is."""
        from balancing.mounting.mounted_text import summary

        return summary(self)


def mount(
    correction: Correction,
    influence: Influence,
    baseline: Trials | ArrayLike | None,
    holes: Mapping[str, Holes],
    *,
    row_weights: FloatArray | None = None,
    time_limit: float = 5.0,
    on_top: bool = False,
) -> Mounted:
    """Choose pieces for all planes together that leave the least vibration.

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
        own,
        method="minmax" if correction.method == "minmax" else "least-squares",
        row_weights=rows,
        limits=correction.limits,
        time_limit=time_limit,
        names=planes,
    )
    found = replace(found, mountings=tuple(map(_fewest, found.mountings, own)))
    after = Y + (W @ found.weights).reshape(Y.shape)
    after_covariance = None if errors is None else errors.check_run(total + found.weights, after)
    return Mounted(correction, own, found, after, after_covariance, None if stays is None else stays[0])


def _fewest(chosen: Mounting | None, holes: Holes | None) -> Mounting | None:
    """The same vector with the fewest pieces: opposite ones that cancel are left out."""
    if chosen is None or holes is None or holes.free_amounts:
        return chosen
    same = split(chosen.vector, holes)
    if abs(same.error) > 1e-9 * max(abs(chosen.vector), float(holes.pieces.min())):
        return chosen
    return same.mounting if same.pieces < int(chosen.counts.sum()) else chosen
