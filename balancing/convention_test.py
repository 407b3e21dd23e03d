"""Whether the runs themselves confirm or contradict the stated phase and angle conventions.

Runs obey Y_run = Y₀ + W T_run. Phases that lag, taken for leading ones, are the conjugates of the readings,
and conj(Y_run) = Ȳ₀ + W̄ T̄_run: such runs fit the conjugate weights, as where angles count the other way.
Runs are therefore fitted twice, with T and with T̄, and the sums of squared residuals compared. Both fits are
one where the columns of (1 T) and of (1 T̄) span the same space: without a redundant run, and where the
weights of each plane stand on one line through the shaft.
"""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass
from typing import Literal

import numpy as np

from balancing.conditioning import chance
from balancing.conventions import Labels
from balancing.reading_errors import mean_variance, reading_of
from balancing.trials import Trials
from rotorid.base.arrays import ComplexArray
from rotorid.regression import gain

ConventionVerdict = Literal["confirmed", "contradicted", "not told", "no redundant run", "weights in line"]

UNLIKELY, FITS = 1e-3, 0.01
"""Probability of χ² below which a reading of the runs is contradicted, and above which it fits."""
FAR = 10.0
"""Ratio of both χ² from which on the smaller one counts whatever the errors are."""
_SAME = 1e-6
_WHY = {
    "no redundant run": "The runs cannot tell: none is more than the planes need.",
    "weights in line": (
        "The runs cannot tell: the weights of each plane stand on one line through the shaft; one run with a "
        "weight at another angle would decide."
    ),
    "confirmed": "The runs themselves confirm ",
    "contradicted": "The runs contradict ",
    "not told": "The runs cannot tell from its opposite ",
}


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

    def contradiction(self, labels: Labels) -> tuple[str, ...]:
        """The warning where the runs contradict their conventions, stated or assumed."""
        if self.verdict != "contradicted":
            return ()
        than = "is assumed" if labels.assumed else "the job says"
        return (
            f"these runs contradict {_compared(self, labels)}. Phases or angles count the other way than "
            f"{than}, and the weights would go to wrong places",
        )


def convention_test(trials: Trials) -> ConventionTest:
    """Ask the runs whether phases and angles go together as they were read.

    One reading of them is contradicted where its χ² is beyond what errors explain (p < 0.001) while the other
    one fits (p > 0.01) and leaves less than half; or where the other one leaves less than a tenth, which
    errors of any size hardly do (F test, 0.001). Errors are those of `balancing.reading_errors`; unknown
    ones are taken as 2 % and 2°.

    Parameters
    ----------
    trials
        All runs that are known, with what was mounted in them.
    """
    R, trials = len(trials.runs), trials.turned
    mounted = trials.weights[:, trials.weights.any(axis=0)]
    A = np.column_stack((np.ones(R), mounted / np.abs(mounted).max(axis=0, initial=0.0)))
    rank = int(np.linalg.matrix_rank(A, _SAME))
    if rank == R:
        return ConventionTest("no redundant run")
    if np.linalg.matrix_rank(np.hstack((A, A.conj())), _SAME) == rank:
        return ConventionTest("weights in line")
    variance = mean_variance(reading_of(trials).covariance(trials))
    used = variance.any(axis=0)
    Y, variance = trials.mean[:, used].T, variance[:, used].T
    # a reading near zero would otherwise count infinitely much
    root = 1 / np.sqrt(np.maximum(variance, 1e-4 * variance.max(axis=1, keepdims=True)))
    dof = 2 * (R - rank) * len(Y)

    def left(B: ComplexArray) -> float:
        K, y = root[..., None] * B, (root * Y)[..., None]
        return float(np.sum(np.abs(y - K @ (gain(K) @ y)) ** 2))

    stated, other = left(A), left(A.conj())
    verdict: ConventionVerdict = "confirmed" if _refuted(other, stated, dof) else "not told"
    if _refuted(stated, other, dof):
        verdict = "contradicted"
    return ConventionTest(verdict, stated, other, dof)


def _refuted(one: float, other: float, dof: int) -> bool:
    clearly = chance(one, dof) < UNLIKELY and chance(other, dof) > FITS and one > 2 * other
    ratio = one / max(other, _SAME * dof)
    return clearly or bool(ratio > FAR and chance(ratio * dof, dof, dof) < UNLIKELY)


def assumptions(labels: Labels, test: ConventionTest | None, others: Iterable[str]) -> tuple[str, ...]:
    """The first sentences of an answer: what is assumed, what the runs say to it, what to do otherwise.

    `others`: what is otherwise where the same numbers give other weights, such as "lag or against".
    """
    if not labels.assumed:
        return ()
    words = [labels.assumed_in_words()]
    if test is not None:
        words.append(_WHY[test.verdict])
        if test.chi_square is not None:
            words[-1] += f"{_compared(test, labels)}."
    words += [f"If it is {other}, the weights go to the angles under “if {other}”." for other in others]
    return tuple(words)


def _compared(test: ConventionTest, labels: Labels) -> str:
    """Both readings of the runs: how angles count where that alone is assumed, else phases."""
    angles = labels.assumed == ("angles",)
    turned = labels.otherwise(("angles",) if angles else ("phase",))
    stated, other = (each.angles if angles else each.phase for each in (labels, turned))
    both = f" for angles {labels.angle_words}" if len(labels.assumed) == 2 else ""
    return (
        f"{stated!r}{both}: χ² {test.chi_square:.3g} of {test.degrees_of_freedom}; {other!r}: "
        f"{test.chi_square_other:.3g}"
    )
