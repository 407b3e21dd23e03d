"""What data tell apart: runs the planes, readings their weights; and if they do not, why, in words.

Columns are compared after scaling to length 1 (`separation`). Where coefficients have errors, `resolution`
asks whether the weakest combination of the planes has an effect at all, or only errors.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike

from balancing.coefficients.repeatability import tail
from balancing.data.reading_errors import hermitian
from rotorid.base.arrays import ComplexArray, FloatArray
from rotorid.regression import RCOND, WORD_TOLERANCE

LEVEL, SINGLE_LEVEL = 0.95, 0.99
HOPELESS = 1e3
"""No instrument supports planes that act alike up to so large a condition number."""
REMEDY = "; their weights are not determined: leave one out, or add sensors or speeds"

_STEPS = 30


class UndeterminedError(ValueError):
    """The data do not determine the influence coefficients, or the weights."""


class Separation(NamedTuple):
    """What equations with the columns of K (N, P), scaled to length 1, tell of their P unknowns.

    `lengths` (P,) of the columns; `singular_values` (P,), the largest first, zeros where N < P; `directions`
    (P, P), a column for each: the combination of scaled columns that it belongs to.
    """

    lengths: FloatArray
    singular_values: FloatArray
    directions: ComplexArray

    @property
    def rank(self) -> int:
        """Number of combinations that are determined."""
        return int(np.count_nonzero(self.singular_values > RCOND * self.singular_values[0]))

    @property
    def condition_number(self) -> float:
        """Largest by smallest singular value; infinite where columns are dependent."""
        s = self.singular_values
        return float(s[0] / s[-1]) if self.rank == len(s) else float("inf")

    @property
    def weakest(self) -> ComplexArray:
        """The combination (P,) of the least effect."""
        return self.directions[:, -1]

    @property
    def undetermined(self) -> list[int]:
        """Unknowns that the equations leave open; empty at full rank."""
        known = self.directions[:, : self.rank]
        outside = np.linalg.norm(np.eye(len(known)) - known @ known.conj().T, axis=0)
        return [int(p) for p in np.flatnonzero(outside > WORD_TOLERANCE)]


def scaled_columns(K: ComplexArray) -> tuple[ComplexArray, FloatArray]:
    """Columns of K (N, P) divided by their lengths (P,), and these; columns of zeros stay."""
    lengths = np.linalg.norm(K, axis=0)
    return K / np.where(lengths > 0, lengths, 1.0), lengths


def separation(K: ArrayLike) -> Separation:
    """Singular values of a finite matrix (N, P) with scaled columns, and what they mean."""
    scaled, lengths = scaled_columns(np.asarray(K, dtype=complex))
    N, P = scaled.shape
    _, s, Vh = np.linalg.svd(scaled, full_matrices=N < P)
    return Separation(lengths, np.pad(s, (0, P - len(s))), Vh.conj().T)


class Resolution(NamedTuple):
    """Test of the hypothesis that a combination of the planes, `direction`, has no effect at all.

    `each` (N,): χ² of each reading; `n` degrees of freedom over all of them; `direction` (P,) for planes
    scaled to equal effect.
    """

    each: FloatArray
    n: int
    direction: ComplexArray

    @property
    def chi_square(self) -> float:
        """Over all readings."""
        return float(self.each.sum())

    @property
    def ratio(self) -> float:
        """Effect of the weakest combination in units of its errors."""
        return float(np.sqrt(self.chi_square / self.n))

    def significant(self, dof: float | None) -> bool:
        """Whether some reading tells the planes apart, for errors of so many degrees of freedom."""
        return significant(self.each, self.n, dof)


def significant(each: FloatArray, n: int, dof: float | None = None) -> bool:
    """Whether χ² of readings (N,), n degrees of freedom, shows an effect: all at 95 %, or one at 99 %."""
    if n <= 0:
        return False
    if tail(float(each.sum()), n, dof) < 1 - LEVEL:
        return True
    return len(each) * tail(float(each.max()), 2, dof) < 1 - SINGLE_LEVEL


def resolution(W: ComplexArray, covariance: FloatArray) -> Resolution:
    """Minimise the χ² of the effect W v over all combinations v of the planes.

    Parameters
    ----------
    W
        Stacked coefficients, shape (N, P).
    covariance
        Of (Re W₁, Im W₁, …) of each reading, shape (N, 2P, 2P).

    Notes
    -----
    χ²(v) = Σ |w v|² / σ²(v) over the readings w with the variance σ²(v) = vᴴ S v of each in one direction;
    its minimum has 2N − 2(P − 1) degrees of freedom where the true effects are dependent. Stationary v solve
    A(v) v = B(v) v with A = Σ w wᴴ/σ², B = Σ |w v|² S/σ⁴; the iteration takes the mean of S/σ² for B.
    """
    N, P = W.shape
    told = separation(W)
    scaled, v, n = W / told.lengths, told.weakest, 2 * (N - P + 1)
    S = hermitian(covariance) / np.outer(told.lengths, told.lengths)
    best: tuple[FloatArray, ComplexArray] | None = None
    for _ in range(_STEPS):
        variance = np.einsum("p,npq,q->n", v, S, v.conj()).real
        variance = np.maximum(variance, 1e-9 * variance.max())
        if not variance.max() > 0:
            return Resolution(np.full(N, np.inf), n, v)
        each = np.abs(scaled @ v) ** 2 / variance
        if best is not None and each.sum() > best[0].sum() * (1 - 1e-9):
            break
        best = each, v
        A = np.einsum("np,nq->pq", scaled.conj(), scaled / variance[:, None])
        B = np.einsum("npq,n->qp", S, 1 / variance) / N
        v = _smallest(A, B)
    assert best is not None
    return Resolution(best[0], n, best[1])


def _smallest(A: ComplexArray, B: ComplexArray) -> ComplexArray:
    """Eigenvector of A v = λ B v with the smallest λ, of length 1."""
    values, vectors = np.linalg.eigh(B)
    root = vectors / np.sqrt(np.maximum(values, 1e-12 * values.max()))
    v = root @ np.linalg.eigh(root.conj().T @ A @ root)[1][:, 0]
    return np.asarray(v / np.linalg.norm(v))


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
    A = np.column_stack((np.ones(len(runs)), weights)).astype(complex)
    lost = separation(A).undetermined
    if not lost:
        return
    alone = separation(np.vstack((A, np.eye(1, A.shape[1])))).undetermined
    if lost[0] == 0 and not alone:
        raise UndeterminedError(
            "the runs do not determine the vibration without weights: add a baseline run, a run that has no "
            "rows in the weights table (or one more run with other weights)"
        )
    missing = " and no run without weights is there either" if lost[0] == 0 else ""
    raise UndeterminedError(_unseparated(alone, planes, weights) + missing + _states(weights))


def _unseparated(columns: list[int], planes: Sequence[str], weights: ComplexArray) -> str:
    named = [f"plane {planes[i - 1]!r}" for i in columns]
    if len(named) == 2:
        return (
            f"no run separates {named[0]} from {named[1]}: their weights always stand in the same "
            "proportion; add a run with a weight in only one of them"
        )
    return (
        f"the runs do not separate {', '.join(named)}: add runs with a weight in only one of them, "
        "for each of them but one"
    )


def _states(weights: ComplexArray) -> str:
    states = len(np.unique(weights, axis=0))
    if states > weights.shape[1]:
        return ""
    return (
        f" (the runs have {states} different sets of weights; {weights.shape[1]} planes need "
        f"at least {weights.shape[1] + 1}, with the one without weights)"
    )


def check_planes(W: ComplexArray, planes: Sequence[str]) -> None:
    """Refuse planes that the readings cannot tell apart.

    Parameters
    ----------
    W
        Influence coefficients stacked over speeds and sensors, shape (N, P).
    planes
        Names.

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
    told = separation(W)
    check_effect(told, planes)
    if lost := told.undetermined:
        raise UndeterminedError(alike_words(W, lost, planes) + REMEDY)


def check_effect(told: Separation, planes: Sequence[str]) -> None:
    """Refuse planes without any effect (`UndeterminedError`)."""
    for p in np.flatnonzero(told.lengths == 0):
        raise UndeterminedError(f"plane {planes[int(p)]!r} has no effect on any reading: leave it out")


def refusal(
    words: str, warnings: Sequence[str], contradictions: Sequence[str] = (), remedies: Sequence[str] = ()
) -> UndeterminedError:
    """The error: its cause, what follows, what to do instead, and the warnings that would be lost with it.

    Parameters
    ----------
    words
        What is not determined, and why.
    warnings
        All that was found.
    contradictions
        Those of them that are the likely cause.
    remedies
        Sentences.
    """
    rest = [w for w in warnings if w not in contradictions]
    follows = f"so {words}" if contradictions else words
    return UndeterminedError(
        "\n".join((*contradictions, follows, *remedies, *(f"Warning: {w}" for w in rest)))
    )


def acting_alike(W: ComplexArray) -> list[int]:
    """The planes that the weakest combination of W (N, P) is made of."""
    return large(separation(W).weakest)


def large(direction: ComplexArray) -> list[int]:
    """Which planes a combination (P,) is made of."""
    share = np.abs(direction) / np.linalg.norm(direction)
    # of two or more planes at least two
    return [int(p) for p in np.flatnonzero(share >= min(0.3, float(np.sort(share)[-2])))]


def alike_words(W: ComplexArray, lost: list[int], planes: Sequence[str]) -> str:
    """That some planes, columns of W (N, P), act alike, and how."""
    group = [planes[i] for i in lost]
    if len(lost) == 2:
        ratio = complex(np.vdot(W[:, lost[1]], W[:, lost[0]]) / np.vdot(W[:, lost[1]], W[:, lost[1]]))
        return (
            f"planes {group[0]!r} and {group[1]!r} act alike at every sensor and speed "
            f"(a weight in {group[0]!r} does what {abs(ratio):.4g} times that weight does in {group[1]!r})"
        )
    return f"planes {', '.join(map(repr, group))} act alike: the effect of each follows from the others"
