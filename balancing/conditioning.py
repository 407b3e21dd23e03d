"""What data determine: singular values of scaled columns, planes that act alike, the remedy, in one place.

Columns are compared after scaling to length 1. Where coefficients have errors, the question is whether the
weakest combination v of the planes has an effect at all, or only errors: χ² = Σ |w v|² / σ²(v) over the
readings, with σ²(v) = vᴴ S v in one direction, has 2N − 2(P − 1) degrees of freedom where v has none.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import ArrayLike

from balancing.trials import Trials
from rotorid.base.arrays import ComplexArray, FloatArray
from rotorid.base.json import plain
from rotorid.base.tables import Column, Table
from rotorid.base.text import counted
from rotorid.base.text import sentence as written
from rotorid.regression import RCOND, WORD_TOLERANCE, solution

ALIKE = 0.1
"""Planes are named that do the same but for this share of their effect (two such: condition number 20)."""
ROUNDING = 1e-9
"""A share below this is rounding."""
HOPELESS = 1e3
"""No instrument supports planes that act alike up to so large a condition number."""
CLEAR = 5.0
"""Effect of a good trial weight in units of its errors."""
LEVEL, SINGLE_LEVEL = 0.95, 0.99
"""Of the tests whether there is an effect: in all readings together, and in one of them."""
ENGINEERS_AMPLITUDE, ENGINEERS_PHASE = 0.30, np.deg2rad(30)
"""A good trial weight changes a reading by 30 % of its amplitude or by 30°."""
REMEDY = "; their weights are not determined: leave one out, or add sensors or speeds"


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
        determined = self.directions[:, : self.rank]
        outside = np.linalg.norm(np.eye(len(determined)) - determined @ determined.conj().T, axis=0)
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


def chance(chi_square: float, n: int, dof: int | None = None) -> float:
    """Probability of a larger χ² of n degrees of freedom; relative to one of `dof`, by F."""
    from scipy.special import chdtrc, fdtrc

    if n <= 0:
        return 1.0
    return float(chdtrc(n, chi_square) if dof is None else fdtrc(n, dof, chi_square / n))


def significant(each: FloatArray, n: int) -> bool:
    """Whether χ² of readings (N,), n degrees of freedom, shows an effect: all at 95 %, or one at 99 %."""
    if n <= 0:
        return False
    alone = len(each) * chance(float(each.max()), 2)
    return chance(float(each.sum()), n) < 1 - LEVEL or alone < 1 - SINGLE_LEVEL


def hermitian(covariance: FloatArray) -> ComplexArray:
    """S[p, q] = E[dz_p conj(dz_q)] / 2 from covariances (N, 2P, 2P); half: the variance in one direction."""
    N, n, _ = covariance.shape
    C = covariance.reshape(N, n // 2, 2, n // 2, 2)
    real = C[:, :, 0, :, 0] + C[:, :, 1, :, 1]
    return np.asarray((real + 1j * (C[:, :, 1, :, 0] - C[:, :, 0, :, 1])) / 2)


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
    named = [f"plane {planes[i - 1]!r}" for i in alone]
    words = f"the runs do not separate {', '.join(named)}: add runs with a weight in only one of them, "
    words += "for each of them but one"
    if len(named) == 2:
        words = f"no run separates {named[0]} from {named[1]}: their weights always stand in the same "
        words += "proportion; add a run with a weight in only one of them"
    if lost[0] == 0:
        words += " and no run without weights is there either"
    states = len(np.unique(weights, axis=0))
    if states <= weights.shape[1]:
        words += f" (the runs have {states} different sets of weights; {weights.shape[1]} planes need "
        words += f"at least {weights.shape[1] + 1}, with the one without weights)"
    raise UndeterminedError(words)


def check_planes(W: ComplexArray, planes: Sequence[str]) -> None:
    """Refuse planes that the readings W (N, P) cannot tell apart.

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
    apart = separation(W)
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
    if K.ndim != 2 or 0 in K.shape:
        raise ValueError(
            f"the influence coefficients must have shape (readings, planes), not empty; got {K.shape}"
        )
    if y.shape != K.shape[:1]:
        raise ValueError(f"the vibration must have shape {K.shape[:1]}; got {y.shape}")
    if not (np.isfinite(K).all() and np.isfinite(y).all()):
        raise ValueError("influence coefficients and vibration must be finite; found NaN or infinity")
    if row_weights is None:
        return K, y, np.ones(len(K))
    w = np.asarray(row_weights, dtype=np.float64)
    if w.shape != y.shape or not np.isfinite(w).all() or (w < 0).any() or not w.any():
        raise ValueError(f"the row weights must be {len(K)} finite numbers ≥ 0, not all zero")
    return K, y, w


def acting_alike(W: ComplexArray) -> list[int]:
    """The planes that the weakest combination of W (N, P) is made of."""
    return large(separation(W).weakest)


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
    apart = separation(W)
    if covariance.any():
        v = apart.weakest / apart.lengths
        variance = np.einsum("p,npq,q->n", v, hermitian(covariance), v.conj()).real
        each = np.abs(W @ v) ** 2 / np.maximum(variance, 1e-9 * variance.max())
        n = 2 * (len(W) - len(planes) + 1)
        if significant(each, n):
            return ""
        ratio = np.sqrt(each.sum() / n)
        within = f"within the errors of the readings (told apart by {ratio:.2g} times the errors)"
        return f"{alike_words(W, large(apart.weakest), planes)} {within}{REMEDY}"
    if apart.condition_number <= HOPELESS:
        return ""
    within = f": no instrument supports a condition number of {apart.condition_number:.2g}"
    return alike_words(W, large(apart.weakest), planes) + within + REMEDY


def large(direction: ComplexArray) -> list[int]:
    """Which planes a combination (P,) is made of, of two or more at least two."""
    share = np.abs(direction) / np.linalg.norm(direction)
    return [int(p) for p in np.flatnonzero(share >= min(0.3, float(np.sort(share)[-2])))]


def alike_words(W: ComplexArray, lost: list[int], planes: Sequence[str]) -> str:
    """That some planes, columns of W (N, P), act alike, and how."""
    group = [planes[i] for i in lost]
    if len(lost) == 2:
        ratio = abs(complex(solution(W[:, [lost[1]]], W[:, lost[0]])[0]))
        return (
            f"planes {group[0]!r} and {group[1]!r} act alike at every sensor and speed "
            f"(a weight in {group[0]!r} does what {ratio:.4g} times that weight does in {group[1]!r})"
        )
    return f"planes {', '.join(map(repr, group))} act alike: the effect of each follows from the others"


@dataclass(frozen=True, eq=False)
class Alike:
    """A plane that does what weights in other planes do.

    Attributes
    ----------
    plane, others
        Names.
    ratios
        Weights in the others that do what the weight 1 does in `plane`, as nearly as they can: complex, the
        angle with the rotation.
    share
        Of the effect of `plane`, what they do not do: |w − Σ ratio · w_other| / |w|, 0 … 1.
    """

    plane: str
    others: tuple[str, ...]
    ratios: ComplexArray
    share: float

    @property
    def words(self) -> str:
        """As an engineer reads it; angles as turned with or against the rotation."""
        parts = [_part(r, other) for r, other in zip(self.ratios, self.others, strict=True)]
        names = ", ".join(map(repr, self.others))
        do = "does" if len(parts) == 1 else "together do"
        but = f", but for {100 * self.share:.2g} % of the effect" if self.share > ROUNDING else ""
        return (
            f"planes {names} and {self.plane!r} act alike: {' and '.join(parts)} {do} "
            f"what a weight does in {self.plane!r}{but}"
        )


@dataclass(frozen=True, eq=False)
class Conditioning:
    """What the readings can tell about weights in the planes.

    Attributes
    ----------
    planes
        Names, P.
    readings
        Their number, N.
    singular_values
        Of W with columns scaled to length 1, shape (P,), largest first; zeros where N < P.
    condition_number
        Largest over smallest; infinite where the planes are dependent.
    rank
        Number of combinations of planes that the readings determine.
    without_effect
        Planes that no reading responds to.
    alike
        Planes that others can stand in for, most alike first. Leaving each `Alike.plane` out leaves planes
        that differ.
    """

    planes: tuple[str, ...]
    readings: int
    singular_values: FloatArray
    condition_number: float
    rank: int
    without_effect: tuple[str, ...]
    alike: tuple[Alike, ...]

    def sentence(self) -> str:
        """What is determined, which planes act alike, and what to do."""
        text = (
            f"{counted(len(self.planes), 'plane')}, {counted(self.readings, 'reading')}: rank {self.rank} of "
            f"{len(self.planes)}, condition number {self.condition_number:.3g}"
        )
        words = [f"plane {p!r} has no effect on any reading" for p in self.without_effect]
        words += [each.words for each in self.alike]
        out = dict.fromkeys((*self.without_effect, *(each.plane for each in self.alike)))
        if out:
            words[-1] += f": leave out {', '.join(map(repr, out))}, or add sensors or speeds"
        return " ".join(map(written, [text, *words]))

    def tables(self) -> tuple[Table, ...]:
        """Singular values, and planes that act alike."""
        values = Table("singular values", (Column("singular value", self.singular_values, "{:.3g}".format),))
        alike = (
            Column("plane", [each.plane for each in self.alike]),
            Column("others", [", ".join(each.others) for each in self.alike]),
            Column("share not alike, %", [100 * each.share for each in self.alike], "{:.2g}".format),
        )
        return values, Table("planes that act alike", alike)

    def to_dict(self) -> dict[str, Any]:
        """As JSON types; an infinite condition number is None, ratios count angles with the rotation."""
        alike = [
            {
                "plane": each.plane,
                "others": each.others,
                "ratios": np.abs(each.ratios),
                "turned_deg": np.degrees(np.angle(each.ratios)),
                "share_not_alike": each.share,
                "words": each.words,
            }
            for each in self.alike
        ]
        return plain({**vars(self), "alike": alike})


def conditioning(W: ArrayLike, planes: Sequence[str], row_weights: ArrayLike | None = None) -> Conditioning:
    """Look at stacked influence coefficients.

    Parameters
    ----------
    W
        Shape (N, P).
    planes
        Names, P.
    row_weights
        How much each reading counts, (N,), ≥ 0; default all alike.

    Raises
    ------
    ValueError
        For NaN, shapes that do not fit, negative weights.

    Notes
    -----
    Pairs come first, the most alike one; of each the later plane is set aside. Then planes that several
    others together can stand in for, until more than `ALIKE` of the effect of every plane left is its own.

    Examples
    --------
    >>> result = conditioning([[1, 2.0j], [1, 2.02j], [1, 1.98j]], ["A", "B"])
    >>> print(round(result.condition_number), result.alike[0].plane, result.alike[0].ratios.round(3))
    245 B [0.+2.j]
    """
    K, _, w = check_stack(W, np.zeros(len(np.atleast_1d(W))), row_weights)
    P = K.shape[1]
    if len(planes) != P or len(set(planes)) != P:
        raise ValueError(f"{P} different names of planes are needed; got {list(planes)}")
    K = w[:, None] * K
    apart = separation(K)
    there = [int(p) for p in np.flatnonzero(apart.lengths)]
    return Conditioning(
        planes=tuple(planes),
        readings=int(np.count_nonzero(w)),
        singular_values=apart.singular_values,
        condition_number=apart.condition_number,
        rank=apart.rank,
        without_effect=tuple(planes[p] for p in range(P) if p not in there),
        alike=_groups(K, there, planes),
    )


def _groups(K: ComplexArray, left: list[int], planes: Sequence[str]) -> tuple[Alike, ...]:
    groups = []
    while len(left) > 1:
        unit = K[:, left] / np.linalg.norm(K[:, left], axis=0)
        cosine = np.triu(np.abs(unit.conj().T @ unit), 1)
        first, second = np.unravel_index(int(np.argmax(cosine)), cosine.shape)
        others, plane = [left[first]], left[second]
        ratios, share = _stand_in(K, others, plane)
        if share > ALIKE:
            plane = min(left, key=lambda p: _stand_in(K, [q for q in left if q != p], p)[1])
            others = [q for q in left if q != plane]
            ratios, share = _stand_in(K, others, plane)
            if share > ALIKE:
                break
            # what adds less than the share that is left over is not worth a word
            part = np.abs(ratios) * np.linalg.norm(K[:, others], axis=0) / np.linalg.norm(K[:, plane])
            few = [q for q, size in zip(others, part, strict=True) if size > max(share, ROUNDING)]
            if few and _stand_in(K, few, plane)[1] <= ALIKE:
                others = few
                ratios, share = _stand_in(K, others, plane)
        groups.append(Alike(planes[plane], tuple(planes[q] for q in others), ratios, share))
        left = [p for p in left if p != plane]
    return tuple(groups)


def _stand_in(K: ComplexArray, others: list[int], plane: int) -> tuple[ComplexArray, float]:
    """Weights in the others that do most nearly what 1 does in the plane, and the share they leave."""
    x = solution(K[:, others], K[:, plane])
    share = np.linalg.norm(K[:, plane] - K[:, others] @ x) / np.linalg.norm(K[:, plane])
    return np.asarray(x), min(float(share), 1.0)


def _part(ratio: complex, plane: str) -> str:
    degrees = round(float(np.degrees(np.angle(ratio))))
    size = f"{abs(ratio):.2g}"
    text = f"{'' if size == '1' else f'{size} times '}a weight in {plane!r}"
    if degrees == 0:
        return text
    turn = "" if abs(degrees) == 180 else f" {'with' if degrees > 0 else 'against'} the rotation"
    return f"{text}, turned by {abs(degrees)}°{turn},"


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
    for p, plane in enumerate(trials.planes):
        run = int(np.argmax(np.abs(trials.weights[:, p])))
        words = f"the trial weight in plane {plane!r} (run {trials.runs[run]!r})"
        w, size = W[..., p].ravel(), abs(trials.weights[run, p])
        if (np.abs(w) * size <= ROUNDING * np.abs(trials.mean).max(axis=0).ravel()).all():
            raise UndeterminedError(
                f"{words} changed no reading: its effect is not determined; "
                "check that it was mounted and that the run was measured anew"
            )
        block = covariance[..., 2 + 2 * p : 4 + 2 * p, 2 + 2 * p : 4 + 2 * p].reshape(-1, 2, 2)
        variance = np.trace(block, axis1=1, axis2=2) / 2
        there = variance > 0
        each = np.abs(w[there]) ** 2 / variance[there]
        if there.any() and not significant(each, 2 * len(each)):
            larger = size * CLEAR * np.sqrt(2 * variance.sum() / np.sum(np.abs(w) ** 2))
            least = trials.labels.weight_words(float(f"{larger:.2g}"))
            remedy = f"repeat the run with a larger trial weight, at least {least}"
            words += (
                " changed the readings by no more than their errors explain: its effect is not determined; "
            )
            words += (
                "mend the table, or measure these runs again until they agree" if contradictions else remedy
            )
            raise UndeterminedError("\n".join((*contradictions, words)))


def clear_change(before: complex, after: complex) -> bool:
    """Whether a reading changed enough, by the engineers' rule.

    Parameters
    ----------
    before, after
        The reading without and with a trial weight.

    Returns
    -------
    bool
        By 30 % of its amplitude or by 30°, or from rest.
    """
    if not before:
        return True
    ratio = after / before
    return bool(abs(abs(ratio) - 1) >= ENGINEERS_AMPLITUDE or abs(np.angle(ratio)) >= ENGINEERS_PHASE)
