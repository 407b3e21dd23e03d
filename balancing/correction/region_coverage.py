"""Where the 95 % region of the weights is too small, in words.

First-order regions hold where the coefficients are far larger than their errors, for every combination of the
planes. The weakest combination decides (`balancing.coefficients.resolution`): its χ² over n degrees of
freedom gives

- the ratio ρ = √(χ²/n), effect in units of the errors, and
- the clearness t = (χ² − n) / √(2 n + 4 (χ² − n)), effect in units of what ρ² itself is uncertain by.

Errors in W shift least squares towards zero by about 1/ρ², and its standard deviation falls with the number
of readings N, so that least squares is optimistic below a ρ that grows as √N. The fit by errors ("weighted")
is not shifted; its region is too small where the weak combination is hardly seen at all, at small t.

The shares below are those of `examples/coverage_balance.py` (two planes, twelve readings); similar ones were
found for 4 to 60 readings and one to four planes.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import ArrayLike

from balancing.coefficients.identifiability import acting_alike
from balancing.coefficients.resolution import resolution
from rotorid.base.arrays import ComplexArray, FloatArray

WEIGHTED_LEVELS = ((3.0, "25 to 90 %"),)
"""Clearness t of the weakest combination below which regions of the fit by errors hold so many truths.

Above it, all in all, 94 %; from 3 to 6, 91 to 92 %.
"""

LEAST_SQUARES_LEVELS = ((1.0, "5 to 75 %"), (2.0, "80 to 90 %"))
"""The same for least squares, by ρ/√N."""


def optimism(W: ArrayLike, covariance: ArrayLike, planes: Sequence[str], *, method: str = "weighted") -> str:
    """Warn of a 95 % region of the weights that is too small; empty where it is honest.

    Parameters
    ----------
    W
        Coefficients stacked over speeds and sensors, shape (N, P).
    covariance
        Of (Re W₁, Im W₁, …) of each reading, shape (N, 2P, 2P).
    planes
        Names, P.
    method
        "weighted", or anything else for a solution that does not look at the errors of W.
    """
    w, C = np.asarray(W, dtype=complex), np.asarray(covariance, dtype=np.float64)
    share = _share(w, C, method)
    if not share or not C.any():
        return ""
    own = [(w[:, [p]], C[:, 2 * p : 2 * p + 2, 2 * p : 2 * p + 2]) for p in range(len(planes))]
    weak = [p for p, (column, variance) in enumerate(own) if _share(column, variance, method)]
    if weak:
        p = min(weak, key=lambda q: clearness(*own[q]))
        ratio = clearness(*own[p])[0]
        cause = f"the effect of plane {planes[p]!r} is only {ratio:.2g} times the errors of the readings"
        remedy = f"repeat the trial run of plane {planes[p]!r} with a larger weight"
    else:
        singular = np.linalg.svd(w / np.linalg.norm(w, axis=0), compute_uv=False)
        named = " and ".join(repr(planes[q]) for q in acting_alike(w))
        cause = (
            f"planes {named} act so much alike (condition number {singular[0] / singular[-1]:.2g}) that the "
            f"readings tell them apart by only {clearness(w, C)[0]:.2g} times their errors"
        )
        remedy = "use larger trial weights, add sensors or speeds, or leave a plane out"
    better = "" if method == "weighted" else "use the weighted method, which is more honest here, or "
    return (
        f"the stated 95 % region of the weights is optimistic: {cause}, and regions like this one contained "
        f"the truth in {share} of simulated jobs; {better}{remedy}"
    )


def clearness(W: ArrayLike, covariance: ArrayLike) -> tuple[float, float]:
    """ρ and t of the weakest combination of the planes; infinite where nothing has errors.

    Parameters
    ----------
    W
        Shape (N, P).
    covariance
        Of (Re W₁, Im W₁, …) of each reading, shape (N, 2P, 2P).
    """
    w, C = np.asarray(W, dtype=complex), np.asarray(covariance, dtype=np.float64)
    if not C.any():
        return np.inf, np.inf
    found = resolution(w, C)
    if not np.isfinite(found.chi_square):
        return np.inf, np.inf
    excess = found.chi_square - found.n
    ratio = float(np.sqrt(found.chi_square / found.n))
    return ratio, float(excess / np.sqrt(2 * found.n + 4 * max(excess, 0.0)))


def _share(W: ComplexArray, covariance: FloatArray, method: str) -> str:
    ratio, clear = clearness(W, covariance)
    levels, value = (
        (WEIGHTED_LEVELS, clear) if method == "weighted" else (LEAST_SQUARES_LEVELS, ratio / np.sqrt(len(W)))
    )
    return next((words for limit, words in levels if value < limit), "")
