"""Which planes and readings take part in a correction."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import ArrayLike

from balancing.coefficients.influence import Influence
from rotorid.base.arrays import FloatArray
from rotorid.base.suggestions import did_you_mean


def rows_of(given: ArrayLike | None, shape: tuple[int, ...], used: list[int]) -> FloatArray | None:
    """Weights of the readings at the speeds used, relative to the largest; None where all are alike.

    Raises
    ------
    ValueError
        Another shape than (speeds, sensors), weights below 0, and where nothing is left.
    """
    if given is None:
        return None
    weights = np.asarray(given, dtype=np.float64)
    if weights.shape != shape or not (np.isfinite(weights) & (weights >= 0)).all():
        raise ValueError(
            f"the weights of the readings must be numbers ≥ 0 of shape {shape} (speeds, sensors)"
        )
    chosen = weights[used].ravel()
    if not chosen.any():
        raise ValueError("all readings have the weight 0: nothing is left to be minimised")
    return None if (chosen == chosen[0]).all() else chosen / chosen.max()


def plane_indices(influence: Influence, planes: Sequence[str] | None) -> list[int]:
    """Where the chosen planes stand.

    Raises
    ------
    ValueError
        Unknown or repeated planes, or none.
    """
    if planes is None:
        return list(range(len(influence.planes)))
    if isinstance(planes, str):
        planes = [planes]
    unknown = [p for p in planes if p not in influence.planes]
    if unknown:
        asked = ", ".join(f"{name!r}{did_you_mean(str(name), influence.planes)}" for name in unknown)
        raise ValueError(
            f"there is no plane {asked}; the planes are {', '.join(map(repr, influence.planes))}"
        )
    if not planes or len(set(planes)) < len(planes):
        raise ValueError("choose at least one plane, each once")
    return [influence.planes.index(p) for p in planes]
