"""Whether the runs themselves confirm or contradict the stated phase and angle conventions.

Runs obey Y_run = Y₀ + W T_run. Phases that lag, taken for leading ones, are the conjugates of the readings,
and conj(Y_run) = Ȳ₀ + W̄ T̄_run: such runs fit the conjugate weights, as where angles count the other way.
Runs are therefore fitted twice, with T and with T̄, and the sums of squared residuals compared. Both fits are
one where the columns of (1 T) and of (1 T̄) span the same space: without a redundant run, and where the
weights of each plane stand on one line through the shaft.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal

import numpy as np

from balancing.coefficients.repeatability import tail
from balancing.data.reading_errors import error_model, mean_covariance, mean_variance
from balancing.data.trials import Trials
from rotorid.base.arrays import ComplexArray, FloatArray
from rotorid.regression import gain

ConventionVerdict = Literal["confirmed", "contradicted", "not told", "no redundant run", "weights in line"]

UNLIKELY, FITS = 1e-3, 0.01
"""Probability of χ² below which a reading of the runs is contradicted, and above which it fits."""
FAR = 10.0
"""Ratio of both χ² from which on the smaller one counts whatever the errors are."""
_SAME = 1e-6


@dataclass(frozen=True)
class ConventionTest:
    """What the runs say about the relation of phases to angles.

    Attributes
    ----------
    verdict
        "confirmed", "contradicted" or "not told" by the data; otherwise why they cannot tell.
    chi_square, chi_square_other, degrees_of_freedom
        Of the runs as they were read, and with phases (or angles) taken the other way; None: not told.
    """

    verdict: ConventionVerdict
    chi_square: float | None = None
    chi_square_other: float | None = None
    degrees_of_freedom: int | None = None

    @property
    def other_fits(self) -> bool:
        """Whether the errors explain what the other reading leaves."""
        other, dof = self.chi_square_other, self.degrees_of_freedom
        return other is not None and dof is not None and tail(other, dof) > FITS


def convention_test(trials: Trials) -> ConventionTest:
    """Ask the runs whether phases and angles go together as they were read.

    One reading of them is contradicted where its χ² is beyond what errors explain (p < 0.001) while the other
    one fits (p > 0.01) and leaves less than half; or where the other one leaves less than a tenth, which
    errors of any size hardly do (F test, 0.001). Errors are those of `balancing.data.reading_errors`; unknown
    ones are taken as 2 % and 2°.

    Parameters
    ----------
    trials
        All runs that are known, with what was mounted in them.
    """
    R = len(trials.runs)
    mounted = trials.weights[:, trials.weights.any(axis=0)]
    A = np.column_stack((np.ones(R), mounted / np.abs(mounted).max(axis=0, initial=0.0)))
    rank = int(np.linalg.matrix_rank(A, _SAME))
    if rank == R:
        return ConventionTest("no redundant run")
    if np.linalg.matrix_rank(np.hstack((A, A.conj())), _SAME) == rank:
        return ConventionTest("weights in line")
    variance = mean_variance(mean_covariance(trials, error_model(trials)))
    used = variance.any(axis=0)
    Y, variance = trials.mean[:, used].T, variance[:, used].T
    # a reading near zero would otherwise count infinitely much
    root = 1 / np.sqrt(np.maximum(variance, 1e-4 * variance.max(axis=1, keepdims=True)))
    dof = 2 * (R - rank) * len(Y)
    own, other = (_residual(B, Y, root) for B in (A, A.conj()))
    verdict: ConventionVerdict = "not told"
    if _refuted(own, other, dof):
        verdict = "contradicted"
    elif _refuted(other, own, dof):
        verdict = "confirmed"
    return ConventionTest(verdict, own, other, dof)


def _residual(A: ComplexArray, Y: ComplexArray, root: FloatArray) -> float:
    """Weighted sum of squared residuals of all channels, Y and root of shape (N, R)."""
    K, y = root[..., None] * A, (root * Y)[..., None]
    return float(np.sum(np.abs(y - K @ (gain(K) @ y)) ** 2))


def _refuted(own: float, other: float, dof: int) -> bool:
    clearly = tail(own, dof) < UNLIKELY and tail(other, dof) > FITS and own > 2 * other
    ratio = own / max(other, _SAME * dof)
    return clearly or bool(ratio > FAR and tail(ratio * dof, dof, dof) < UNLIKELY)
