"""Coverage of the 95 % region of the weights: where it is too small, in words.

First-order regions hold where errors of the weights are small against the weights: D goes as 1/W, and what a
large error does to it is no ellipse. The fit by errors ("weighted") therefore goes by the relative error of
the weights, that of the worst combination of planes over the root mean square weight. Regions of errors that
spare runs tell are wide enough (by F), and are left alone.

Least squares is shifted as well, towards zero by about 1/ρ² where ρ is the effect of the weakest combination
of the planes in units of its errors (√(χ²/n) of `balancing.coefficients.identifiability`); its standard
deviation falls with the number of readings N, so that it is optimistic below a ρ that grows as √N.

The shares below are those of table d of `tests/coverage/coverage_balance.py`.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import ArrayLike

from balancing.coefficients.identifiability import large, resolution, separation
from rotorid.base.arrays import ComplexArray, FloatArray

WEIGHTED_LEVELS = ((1.0, "40 to 60 %"), (0.3, "65 to 90 %"))
"""Relative error of the weights above which regions of the fit by errors hold so many truths."""

LEAST_SQUARES_LEVELS = ((1.0, "40 to 65 %"), (2.0, "80 to 90 %"))
"""ρ/√N below which regions of least squares do."""


def uncertain(D: ArrayLike, covariance: ArrayLike) -> str:
    """Warn of a 95 % region of the weighted fit that is too small; empty where it is honest.

    Parameters
    ----------
    D
        Weights, shape (P,).
    covariance
        Of (Re D₁, Im D₁, …), shape (2P, 2P).
    """
    error = relative_error(D, covariance)
    share = next((words for limit, words in WEIGHTED_LEVELS if error > limit), "")
    return share and (
        f"the stated 95 % region of the weights is optimistic: errors of the weights reach {100 * error:.0f} "
        f"% of their size, and regions like this one contained the truth in {share} of simulated jobs; use "
        "larger trial weights, add runs, sensors or speeds, or leave a plane out"
    )


def relative_error(D: ArrayLike, covariance: ArrayLike) -> float:
    """Standard deviation of the worst combination of planes over the root mean square weight."""
    size = float(np.mean(np.abs(np.asarray(D)) ** 2))
    return float(np.sqrt(np.linalg.eigvalsh(np.asarray(covariance))[-1] / size)) if size else np.inf


def too_small(W: ArrayLike, covariance: ArrayLike, planes: Sequence[str]) -> str:
    """Warn of a 95 % region of least squares that is too small; empty where it is honest.

    Parameters
    ----------
    W
        Coefficients stacked over speeds and sensors, shape (N, P).
    covariance
        Of (Re W₁, Im W₁, …) of each reading, shape (N, 2P, 2P).
    planes
        Names, P.
    """
    w, C = np.asarray(W, dtype=complex), np.asarray(covariance, dtype=np.float64)
    share = _share(w, C)
    if not share or not C.any():
        return ""
    own = [(w[:, [p]], C[:, 2 * p : 2 * p + 2, 2 * p : 2 * p + 2]) for p in range(len(planes))]
    weak = [p for p, (column, variance) in enumerate(own) if _share(column, variance)]
    if weak:
        p = min(weak, key=lambda q: clearness(*own[q]))
        ratio = clearness(*own[p])
        cause = f"the effect of plane {planes[p]!r} is only {ratio:.2g} times the errors of the readings"
        remedy = f"repeat the trial run of plane {planes[p]!r} with a larger weight"
    else:
        told = separation(w)
        named = " and ".join(repr(planes[q]) for q in large(told.weakest))
        cause = (
            f"planes {named} act so much alike (condition number {told.condition_number:.2g}) that the "
            f"readings tell them apart by only {clearness(w, C):.2g} times their errors"
        )
        remedy = "use larger trial weights, add sensors or speeds, or leave a plane out"
    return (
        f"the stated 95 % region of the weights is optimistic: {cause}, and regions like this one contained "
        f"the truth in {share} of simulated jobs; use the weighted method, which is more honest here, or "
        f"{remedy}"
    )


def clearness(W: ArrayLike, covariance: ArrayLike) -> float:
    """ρ of the weakest combination of the planes; infinite where nothing has errors.

    Parameters
    ----------
    W
        Shape (N, P).
    covariance
        Of (Re W₁, Im W₁, …) of each reading, shape (N, 2P, 2P).
    """
    w, C = np.asarray(W, dtype=complex), np.asarray(covariance, dtype=np.float64)
    if not C.any():
        return np.inf
    return resolution(w, C).ratio


def _share(W: ComplexArray, covariance: FloatArray) -> str:
    ratio = clearness(W, covariance) / np.sqrt(len(W))
    return next((words for limit, words in LEAST_SQUARES_LEVELS if ratio < limit), "")
