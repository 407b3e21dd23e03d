"""What data determine: singular values of scaled columns, planes that act alike, the remedy, in one place.

Columns are compared after scaling to length 1. Where coefficients have errors, the question is whether the
weakest combination v of the planes has an effect at all, or only errors: χ² = Σ |w v|² / σ²(v) over the
readings, with σ²(v) = vᴴ S v in one direction, has 2N − 2(P − 1) degrees of freedom where v has none.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike

from balancing.regions import LEVEL, mean_variances
from balancing.trials import Trials
from rotorid.base.arrays import ComplexArray, FloatArray
from rotorid.base.text import listing
from rotorid.regression import RCOND, WORD_TOLERANCE, solution, stretch

NEARLY_ALIKE = 30.0
"""Planes with a larger condition number are named."""
ROUNDING = 1e-9
"""An effect below this share is rounding."""
HOPELESS = 1e3
"""No instrument supports planes that act alike up to so large a condition number."""
CLEAR = 5.0
"""Effect of a good trial weight in units of its errors."""
SINGLE_LEVEL = 0.99
"""Of the test whether there is an effect in one of the readings."""
REMEDY = "; their weights are not determined: leave one out, or add sensors or speeds"


class UndeterminedError(ValueError):
    """The data do not determine the influence coefficients, or the weights."""


@dataclass(frozen=True, eq=False)
class Conditioning:
    """What equations with one column a plane tell of the weights in the planes.

    Attributes
    ----------
    planes
        Names, P.
    lengths
        Of the columns, shape (P,).
    singular_values
        Of the columns scaled to length 1, shape (P,), the largest first; zeros where N < P.
    directions
        A column for each singular value, shape (P, P): the combination of scaled columns it belongs to.
    """

    planes: tuple[str, ...]
    lengths: FloatArray
    singular_values: FloatArray
    directions: ComplexArray

    @property
    def rank(self) -> int:
        """Number of combinations of planes that are determined."""
        return int(np.count_nonzero(self.singular_values > RCOND * self.singular_values[0]))

    @property
    def condition_number(self) -> float:
        """Largest by smallest singular value; infinite where planes are dependent."""
        s = self.singular_values
        return float(s[0] / s[-1]) if self.rank == len(s) else float("inf")

    @property
    def weakest(self) -> list[int]:
        """The planes that the combination of the least effect is made of, of two or more at least two."""
        share = np.abs(self.directions[:, -1])
        return [int(p) for p in np.flatnonzero(share >= min(0.3, *np.sort(share)[-2:]))]

    @property
    def undetermined(self) -> list[int]:
        """Planes that the equations leave open; empty at full rank."""
        open_ = np.linalg.norm(self.directions[:, self.rank :], axis=1)
        return [int(p) for p in np.flatnonzero(open_ > WORD_TOLERANCE)]

    def sentence(self) -> str:
        """What is determined, which planes act alike, and what to do."""
        P, condition = len(self.planes), self.condition_number
        of = f"rank {self.rank} of {P}, condition number {condition:.3g}"
        words = f"Exact coefficients determine every plane ({of})."
        if self.rank < P:
            words = f"Rank {self.rank} of {P}: not all planes are determined."
        if condition <= NEARLY_ALIKE:
            return words
        alike = ", ".join(repr(self.planes[p]) for p in self.weakest)
        return f"{words} Planes {alike} act alike or nearly so: leave one out, or add sensors or speeds."


def conditioning(W: ArrayLike, planes: Sequence[str]) -> Conditioning:
    """Look at stacked influence coefficients.

    Parameters
    ----------
    W
        Finite, shape (N, P).
    planes
        Names, P.

    Examples
    --------
    >>> print(f"{conditioning([[1, 2.0j], [1, 2.02j], [1, 1.98j]], ['A', 'B']).condition_number:.0f}")
    245
    """
    K = np.asarray(W, dtype=complex)
    N, P = K.shape
    lengths = np.linalg.norm(K, axis=0)
    _, s, Vh = np.linalg.svd(K / np.where(lengths > 0, lengths, 1.0), full_matrices=N < P)
    return Conditioning(tuple(planes), lengths, np.pad(s, (0, P - len(s))), Vh.conj().T)


def chance(chi_square: float, n: int, dof: int | None = None) -> float:
    """Probability of a larger χ² of n degrees of freedom; relative to one of `dof`, by F."""
    if n <= 0:
        return 1.0
    if dof is None and n % 2 == 0:  # Poisson's sum: scipy takes long to load
        half = np.clip(chi_square / 2, 1e-300, 1e300)
        k = np.append(half, np.arange(1, n // 2))
        return float(np.exp(np.log(half / k).cumsum() - half).sum())
    from scipy.special import chdtrc, fdtrc

    return float(chdtrc(n, chi_square) if dof is None else fdtrc(n, dof, chi_square / n))


def significant(each: FloatArray, n: int) -> bool:
    """Whether χ² of readings (N,), n degrees of freedom, shows an effect: all at 95 %, or one at 99 %."""
    if n <= 0:
        return False
    alone = len(each) * chance(float(each.max()), 2)
    return chance(float(each.sum()), n) < 1 - LEVEL or alone < 1 - SINGLE_LEVEL


def check_runs(runs: Sequence[str], planes: Sequence[str], weights: ComplexArray) -> None:
    """Refuse runs that do not determine the baseline and the effect of every plane.

    Parameters
    ----------
    runs, planes
        Names, R and P.
    weights
        Shape (R, P).

    Raises
    ------
    UndeterminedError
        Naming the planes, and the run to add.
    """
    for p, plane in enumerate(planes):
        if not weights[:, p].any():
            raise UndeterminedError(
                f"no run has a weight greater than zero in plane {plane!r}: "
                "make a run with a trial weight there, or leave the plane out"
            )
    A = np.column_stack((np.ones(len(runs)), weights))
    lost = conditioning(A, ("", *planes)).undetermined
    if not lost:
        return
    with_baseline = np.vstack((A, np.eye(1, A.shape[1])))
    alone = [f"plane {planes[i - 1]!r}" for i in conditioning(with_baseline, ("", *planes)).undetermined]
    words = f"no run separates {listing(alone, 'from')}: add runs with a weight in only one of them"
    if lost[0] == 0:
        words = f"{words}; and " if alone else "the vibration without weights is unknown: "
        words += "add a baseline run, a run that has no rows in the weights table"
    raise UndeterminedError(words)


def check_planes(W: ComplexArray, planes: Sequence[str]) -> None:
    """Refuse planes that the readings W (N, P) do not tell apart.

    Raises
    ------
    UndeterminedError
        Naming the planes that act alike.
    """
    N, P = W.shape
    if N < P:
        raise UndeterminedError(
            f"{P} planes need at least {P} readings (sensors × speeds) of a run, and there "
            f"{'is' if N == 1 else 'are'} {N}: add sensors or speeds, or choose fewer planes"
        )
    apart = conditioning(W, planes)
    for p in np.flatnonzero(apart.lengths == 0):
        raise UndeterminedError(f"plane {planes[int(p)]!r} has no effect on any reading: leave it out")
    if lost := apart.undetermined:
        raise UndeterminedError(alike_words(W, lost, planes) + REMEDY)


def check_stack(
    W: ArrayLike, Y: ArrayLike, row_weights: ArrayLike | None = None
) -> tuple[ComplexArray, ComplexArray, FloatArray]:
    """Coefficients (N, P), vibration (N,) and weights of readings (N,), ≥ 0, default 1, as arrays.

    Raises
    ------
    ValueError
        For NaN, infinity, shapes that do not fit, negative weights and none but zero.
    """
    K, y = np.asarray(W, dtype=complex), np.asarray(Y, dtype=complex)
    w = np.ones(len(K)) if row_weights is None else np.asarray(row_weights, dtype=np.float64)
    if K.ndim != 2 or 0 in K.shape or y.shape != K.shape[:1]:
        raise ValueError(
            f"coefficients (readings, planes) and vibration (readings,) are needed; got {K.shape}, {y.shape}"
        )
    if not np.isfinite(K.sum() + y.sum()):
        raise ValueError("influence coefficients and vibration must be finite; found NaN or infinity")
    if w.shape != y.shape or not (w.min() >= 0 and 0 < w.max() < np.inf):
        raise ValueError(f"the row weights must be {len(K)} finite numbers ≥ 0, not all zero")
    return K, y, w


def unresolved(W: ComplexArray, planes: Sequence[str], covariance: FloatArray) -> str:
    """Which planes act alike within their errors; empty where none do.

    Parameters
    ----------
    W
        Stacked coefficients of full rank, (N, P).
    planes
        Names.
    covariance
        Of (Re W₁, Im W₁, …) of each reading, (N, 2P, 2P); zero: no errors are known, and only a condition
        number that no instrument supports counts.
    """
    if len(planes) < 2:
        return ""
    apart, n = conditioning(W, planes), 2 * (len(W) - len(planes) + 1)
    alike = alike_words(W, apart.weakest, planes)
    if covariance.any():
        v = apart.directions[:, -1] / apart.lengths
        real = stretch(v[None])
        variance = np.einsum("ik,nkl,il->n", real, covariance, real) / 2
        each = np.abs(W @ v) ** 2 / np.maximum(variance, 1e-9 * variance.max())
        if significant(each, n):
            return ""
        ratio = np.sqrt(each.sum() / n)
        return (
            f"{alike} within the errors of the readings (told apart by {ratio:.2g} times the errors){REMEDY}"
        )
    if apart.condition_number <= HOPELESS:
        return ""
    return f"{alike}: no instrument supports a condition number of {apart.condition_number:.2g}{REMEDY}"


def alike_words(W: ComplexArray, lost: list[int], planes: Sequence[str]) -> str:
    """Which planes, columns of W (N, P), act alike, and how, in words."""
    names = [repr(planes[p]) for p in lost]
    if len(lost) != 2:
        return f"planes {', '.join(names)} act alike: the effect of each follows from the others"
    ratio = complex(solution(W[:, [lost[1]]], W[:, lost[0]])[0])
    return (
        f"planes {names[0]} and {names[1]} act alike at every sensor and speed "
        f"(a weight in {names[0]} does what {abs(ratio):.4g} times that weight does in {names[1]}, turned by "
        f"{np.degrees(np.angle(ratio)):.0f}° with the rotation)"
    )


def check_effects(
    trials: Trials, W: ComplexArray, covariance: FloatArray, contradictions: tuple[str, ...]
) -> None:
    """Refuse a trial weight that changed nothing, or nothing beyond its errors (all at 95 %, or one at 99 %).

    Parameters
    ----------
    trials
        The runs.
    W, covariance
        Coefficients (S, C, P), and of (Re Y₀, Im Y₀, Re W₁, …) of each reading what is stated or measured.
    contradictions
        That runs disagree: no larger trial weight helps then.

    Raises
    ------
    UndeterminedError
        Naming plane and run.
    """
    variances = mean_variances(covariance).reshape(-1, 1 + len(trials.planes))
    for p, plane in enumerate(trials.planes):
        run = np.argmax(np.abs(trials.weights[:, p]))
        words = f"the trial weight in plane {plane!r} (run {trials.runs[run]!r})"
        w, size = W[..., p].ravel(), abs(trials.weights[run, p])
        if (np.abs(w) * size <= ROUNDING * np.abs(trials.mean).max(axis=0).ravel()).all():
            raise UndeterminedError(
                f"{words} changed no reading: its effect is not determined; "
                "check that it was mounted and that the run was measured anew"
            )
        variance = variances[:, 1 + p]
        each = np.abs(w[variance > 0]) ** 2 / variance[variance > 0]
        if len(each) and not significant(each, 2 * len(each)):
            larger = size * CLEAR * np.sqrt(2 * variance.sum() / np.sum(np.abs(w) ** 2))
            remedy = "repeat the run with a larger trial weight, at least "
            remedy += trials.labels.weight_words(float(f"{larger:.2g}"))
            if contradictions:
                remedy = "mend the table, or measure these runs again until they agree"
            words += (
                " changed the readings by no more than their errors explain: its effect is not determined; "
            )
            raise UndeterminedError("\n".join((*contradictions, words + remedy)))
