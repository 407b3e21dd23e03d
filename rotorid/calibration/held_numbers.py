"""Numbers that a calibration takes as they stand: whether the data contradict that.

Held numbers that are off by δ deviations move the residuals r of data and priors by H δ, of which the numbers
that are estimated take over all but S δ, S = (1 − K K⁺) H. Where the held ones are right, the score

    T = rᵀ S (1 + Sᵀ S)⁻¹ Sᵀ r = Σ w y²,    S = U s Vᵀ,  y = Uᵀ r,  w = s² / (1 + s²)

is a sum of weighted χ² of one degree of freedom each; a χ² of the same mean and variance tells how probable a
larger one is. No test sees δ of about 1 more often: it is the ratio of likelihoods. χ² of all residuals
spreads what a few numbers do over all degrees of freedom, and sees it half as often.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from rotorid.base.arrays import FloatArray
from rotorid.base.text import counted
from rotorid.regression import solution


@dataclass(frozen=True, eq=False)
class HeldNumbers:
    """What the data say of held numbers.

    Attributes
    ----------
    names
        Of the held numbers, h.
    away
        By how many deviations each is most likely off, (h,).
    chance
        Probability of a larger score if they are right.
    """

    names: tuple[str, ...]
    away: FloatArray
    chance: float

    @property
    def words(self) -> str:
        """That they are contradicted, and the most likely one."""
        i = int(np.argmax(np.abs(self.away)))
        side = "higher" if self.away[i] > 0 else "lower"
        return (
            f"the data contradict {counted(len(self.names), 'number')} taken as exact (probability "
            f"{self.chance:.1g}), most of all {self.names[i]}: {abs(self.away[i]):.2g} of its usual standard "
            f"deviations {side} would explain more"
        )


def held_numbers(names: Sequence[str], K: FloatArray, H: FloatArray, r: FloatArray) -> HeldNumbers:
    """Test held numbers.

    Parameters
    ----------
    names
        Of the held numbers, h.
    K
        Derivatives of residuals and priors by the estimated numbers, (m, n).
    H
        By the held numbers, times the standard deviation that each might be off by, (m, h).
    r
        Residuals of data and priors where χ² is smallest, in standard deviations, (m,).
    """
    from scipy.special import chdtrc

    S = H - K @ solution(K, H)
    U, s, Vt = np.linalg.svd(S, full_matrices=False)
    w, y = s**2 / (1 + s**2), U.T @ r
    unit = float(np.sum(w**2) / np.sum(w)) if w.any() else 1.0
    chance = float(chdtrc(np.sum(w) / unit, w @ y**2 / unit)) if w.any() else 1.0
    return HeldNumbers(tuple(names), -Vt.T @ (s / (1 + s**2) * y), chance)
