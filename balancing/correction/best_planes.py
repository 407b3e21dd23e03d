"""The best k planes of many: every choice tried, ranked by what it leaves of the vibration."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from itertools import combinations
from math import comb
from typing import TYPE_CHECKING, Any, Literal

import numpy as np
from numpy.typing import ArrayLike

from balancing.coefficients.baseline import match_speeds, starting_point
from balancing.coefficients.identifiability import UndeterminedError, scaled_columns
from balancing.coefficients.influence import Influence
from balancing.correction.selected_planes import plane_indices, rows_of
from balancing.data.conventions import Labels
from balancing.data.result_columns import rms, three_figures, weight_rows
from balancing.data.trials import Trials
from balancing.solvers.conditioning import check_stack
from balancing.solvers.error_propagation import error_form
from rotorid.base.answer import Answer, Answered
from rotorid.base.arrays import ComplexArray, FloatArray, IntArray
from rotorid.base.json import plain
from rotorid.base.result import Column, frame, rows, text
from rotorid.base.text import counted
from rotorid.regression import RCOND, gain

if TYPE_CHECKING:
    import pandas as pd

Criterion = Literal["rms", "max"]

MOST = 20_000
"""More choices of planes than this are not tried."""

_BATCH = 2**20
_NAMED = 3


@dataclass(frozen=True, eq=False)
class Subsets(Answered):
    """Choices of k planes, the best first, each with its own best weights.

    Attributes
    ----------
    planes
        Names of each choice, M tuples of k.
    weights
        Shape (M, k).
    rms, largest
        Of the predicted readings, shape (M,).
    expected
        Root mean square in a check run, (M,): with the errors of coefficients and of the vibration before.
    objective
        What they are ranked by: rms or largest of the readings times their row weights, and their errors (in
        quadrature), shape (M,).
    condition_number
        Of each choice, shape (M,).
    criterion
        "rms": least squares; "max": the largest reading made as small as it can be.
    rms_before, largest_before
        Of the readings without weights.
    choices
        How many were compared.
    dependent
        How many more were not: their planes act alike exactly, so that the weights are not determined.
    labels
        Units and conventions to print in.
    weighted
        Whether the readings count differently.
    """

    planes: tuple[tuple[str, ...], ...]
    weights: ComplexArray
    rms: FloatArray
    largest: FloatArray
    expected: FloatArray
    objective: FloatArray
    condition_number: FloatArray
    criterion: Criterion
    rms_before: float
    largest_before: float
    choices: int
    dependent: int
    labels: Labels
    weighted: bool = False

    def to_dict(self) -> dict[str, Any]:
        """As JSON types, in the job's own units and conventions."""
        scale = self.labels.vibration_scale
        weights = [weight_rows(self.labels, *pair) for pair in zip(self.planes, self.weights, strict=True)]
        return plain(
            {
                "criterion": self.criterion,
                "conventions": self.labels.conventions(),
                "rms_before": self.rms_before * scale,
                "max_before": self.largest_before * scale,
                "choices": self.choices,
                "dependent_choices": self.dependent,
                "rows": rows((*self._columns(), Column("weights", weights))),
            }
        )

    def to_frame(self) -> pd.DataFrame:
        """One row per choice: planes ("A, C"), rms_after, rms_expected, max_after, largest_weight, …"""
        return frame((Column("planes", list(map(", ".join, self.planes))), *self._columns()[1:]))

    @property
    def answer(self) -> Answer:
        """The best choices in words; then their table."""
        scale, unit = self.labels.vibration_scale, self.labels.vibration_in
        nothing = (("(none)",), self.rms_before * scale, None, self.largest_before * scale, None, None)
        shown = [
            replace(column, values=[first, *column.values])
            for first, column in zip(nothing, self._columns(), strict=True)
        ]
        choices = f"{counted(self.choices, 'choice')} of {counted(self.weights.shape[1], 'plane')}"
        by = criterion_words(self.criterion, weighted=self.weighted) + " after correction"
        by += f" ({unit})" if unit else ""
        size = self.largest if self.criterion == "max" else self.rms
        each = [
            f"{', '.join(planes)}: {three_figures(value * scale)}"
            for planes, value in zip(self.planes[:_NAMED], size, strict=False)
        ]
        lines = [f"The best of {choices}, by {by}", text(shown)]
        if self.dependent:
            lines.append(
                f"{self.dependent} more choices have planes that act alike: no weights are determined."
            )
        best = f"The best of {choices}, by {by}: {'; '.join(each)}."
        return Answer(best, tables=("\n".join(lines),), more="choices of planes")

    def _columns(self) -> tuple[Column, ...]:
        labels, scale = self.labels, self.labels.vibration_scale
        heaviest = "largest weight" + (f", {labels.weight_in}" if labels.weight_in else "")
        mass = np.abs(self.weights).max(axis=1) * labels.weight_scale
        return (
            Column("planes", self.planes, ", ".join),
            Column("rms_after", self.rms * scale, three_figures, "rms"),
            Column("rms_expected", self.expected * scale, three_figures, "expected"),
            Column("max_after", self.largest * scale, three_figures, "largest"),
            Column("largest_weight", mass, three_figures, heaviest),
            Column("condition_number", self.condition_number, three_figures, "condition"),
        )


def criterion_words(criterion: Criterion, *, weighted: bool) -> str:
    """What is made small; `weighted`: where readings count differently."""
    word = "weighted " if weighted else ""
    return f"{word}rms" if criterion == "rms" else f"largest {word}amplitude"


def best_subsets(  # noqa: PLR0913
    W: ArrayLike,
    Y: ArrayLike,
    planes: Sequence[str],
    k: int,
    *,
    criterion: Criterion = "rms",
    row_weights: ArrayLike | None = None,
    covariance: FloatArray | None = None,
    show: int = 10,
    labels: Labels | None = None,
) -> Subsets:
    """Compare all choices of k planes, each with its own best weights.

    Parameters
    ----------
    W, Y
        Stacked influence coefficients (N, P) and vibration (N,).
    planes
        Names, P.
    k
        How many to use, 1 … P, at most N.
    criterion
        "rms": least squares; "max": the smallest largest amplitude (a cone program for every choice that can
        still be among the best).
    row_weights
        How much each reading counts, (N,), ≥ 0; default all alike.
    covariance
        Of (Re Y, Im Y, Re W₁, …) of each reading, (N, 2P + 2, 2P + 2): weights that fight each other count by
        the errors they bring. None: no errors.
    show
        How many of the best to return.
    labels
        Units to print in.

    Raises
    ------
    ValueError
        For k out of range, more than `MOST` choices, an unknown criterion, NaN, shapes that do not fit.
    UndeterminedError
        If the planes of every choice act alike.

    Notes
    -----
    With the QR factorisation of diag(w) W the residual of every choice follows from P rows instead of N. The
    largest amplitude a choice can reach is at least its least rms: choices are looked at in this order, until
    no further one can be among the best `show`. So the ranking is exact for both criteria.
    """
    K, y, w = check_stack(W, Y, row_weights)
    N, P = K.shape
    _check(planes, P, int(np.count_nonzero(w)), k, criterion, show)
    chosen = np.array(list(combinations(range(P), k)), dtype=np.int64)
    reduced, right, outside = _reduced(w[:, None] * K, w * y)
    D, misfit, condition = _least_squares(reduced, right, chosen)
    solid = np.isfinite(condition)
    if not solid.any():
        raise UndeterminedError(
            f"the planes of every choice of {k} act alike: choose fewer, or add readings or speeds"
        )
    F = np.zeros((P + 1, P + 1), dtype=complex) if covariance is None else error_form(covariance, w) / N
    least = (misfit + outside) / N
    rank = least if criterion == "max" else least + _errors(F, chosen, D)
    order = np.flatnonzero(solid)[np.argsort(rank[solid], kind="stable")]
    if criterion == "max":
        order, D = _by_maximum((K, y, w), chosen, order, np.sqrt(least), D, show, F)
    order = order[:show]
    after = y + np.einsum("nmk,mk->mn", K[:, chosen[order]], D[order])
    weighted = np.abs(after) * w
    size = weighted.max(axis=1) if criterion == "max" else np.sqrt(np.mean(weighted**2, axis=1))
    plain = F if covariance is None else error_form(covariance) / N
    square = np.mean(np.abs(after) ** 2, axis=1)
    return Subsets(
        planes=tuple(tuple(planes[p] for p in chosen[m]) for m in order),
        weights=D[order],
        rms=np.sqrt(square),
        largest=np.abs(after).max(axis=1),
        expected=np.sqrt(square + _errors(plain, chosen[order], D[order])),
        objective=np.sqrt(size**2 + _errors(F, chosen[order], D[order])),
        condition_number=condition[order],
        criterion=criterion,
        rms_before=rms(y),
        largest_before=float(np.abs(y).max()),
        choices=int(np.count_nonzero(solid)),
        dependent=int(np.count_nonzero(~solid)),
        labels=labels or Labels(),
        weighted=bool(np.ptp(w) > 0),
    )


def compare_planes(
    influence: Influence,
    baseline: Trials | ArrayLike | None,
    planes: Sequence[str],
    k: int,
    *,
    speeds: ArrayLike | None = None,
    criterion: Criterion = "rms",
    row_weights: FloatArray | None = None,
) -> Subsets:
    """Compare all choices of k of these planes, without limits.

    Parameters
    ----------
    influence, baseline, speeds, row_weights
        As `balancing.correct` takes them.
    planes, k, criterion
        As `best_subsets` does.
    """
    start = starting_point(influence, baseline)
    used = list(range(len(influence.speeds))) if speeds is None else match_speeds(speeds, influence.speeds)
    known = replace(influence, baseline=start.readings, covariance=start.covariance)
    part = known.part(used, None, plane_indices(influence, planes))
    P, covariance = len(part.planes), part.covariance
    return best_subsets(
        part.W.reshape(-1, P),
        start.readings[used].ravel(),
        part.planes,
        k,
        criterion=criterion,
        row_weights=rows_of(row_weights, start.readings.shape, used),
        covariance=None if covariance is None else covariance.reshape(-1, 2 * P + 2, 2 * P + 2),
        labels=start.labels,
    )


def _check(planes: Sequence[str], P: int, N: int, k: int, criterion: str, show: int) -> None:
    if len(planes) != P or len(set(planes)) != P:
        raise ValueError(f"{P} different names of planes are needed; got {list(planes)}")
    if criterion not in ("rms", "max"):
        raise ValueError(f"planes are chosen by 'rms' or by 'max', not by {criterion!r}")
    if not 1 <= k <= P:
        raise ValueError(f"choose between 1 and {P} planes; got {k}")
    if k > N:
        raise ValueError(
            f"{k} planes need at least {k} readings (sensors × speeds); there are {N}: choose fewer planes"
        )
    if show < 1:
        raise ValueError(f"show at least one choice; got {show}")
    if comb(P, k) > MOST:
        raise ValueError(
            f"there are {comb(P, k)} choices of {k} out of {P} planes, more than the {MOST} that are tried: "
            "leave planes out first, or choose fewer (or nearly all) of them"
        )


def _reduced(A: ComplexArray, y: ComplexArray) -> tuple[ComplexArray, ComplexArray, float]:
    """R (K, P) and right side (K,) with |y + A D|² = |right + R D|² + outside."""
    Q, R = np.linalg.qr(A)
    right = Q.conj().T @ y
    return np.asarray(R), np.asarray(right), float(np.linalg.norm(y - Q @ right) ** 2)


def _least_squares(
    R: ComplexArray, right: ComplexArray, chosen: IntArray
) -> tuple[ComplexArray, FloatArray, FloatArray]:
    """Weights (M, k), squared residual (M,) and condition number (M,; infinite: dependent planes)."""
    M, k = chosen.shape
    B = scaled_columns(R)[0]
    D, misfit, condition = np.zeros((M, k), dtype=complex), np.zeros(M), np.full(M, np.inf)
    size = max(_BATCH // (R.shape[0] * k), 1)
    for start in range(0, M, size):
        part = slice(start, start + size)
        s = np.linalg.svd(np.moveaxis(B[:, chosen[part]], 1, 0), compute_uv=False)
        solid = s[:, -1] > RCOND * s[:, 0]
        index = np.arange(M)[part][solid]
        columns = np.moveaxis(R[:, chosen[index]], 1, 0)
        D[index] = -gain(columns) @ right
        misfit[index] = np.linalg.norm(right + np.einsum("mrk,mk->mr", columns, D[index]), axis=1) ** 2
        condition[index] = s[solid, 0] / s[solid, -1]
    return D, misfit, condition


def _errors(F: ComplexArray, chosen: IntArray, D: ComplexArray) -> FloatArray:
    """Mean square errors (M,) that the weights (M, k) bring, zᴴ F z with z = (1, D)."""
    z = np.zeros((len(D), len(F)), dtype=complex)
    z[:, 0] = 1.0
    np.put_along_axis(z, chosen + 1, D, axis=1)
    return np.asarray(np.maximum(np.einsum("mp,pq,mq->m", z.conj(), F, z).real, 0.0))


def _by_maximum(
    readings: tuple[ComplexArray, ComplexArray, FloatArray],
    chosen: IntArray,
    order: IntArray,
    bound: FloatArray,
    D: ComplexArray,
    show: int,
    F: ComplexArray,
) -> tuple[IntArray, ComplexArray]:
    """The best choices by the largest weighted reading and the errors; weights (M, k), theirs replaced."""
    from balancing.solvers.cone import problem, solve_cone

    K, y, w = readings
    D = D.copy()
    best: list[tuple[float, int]] = []
    for m in order:
        if len(best) == show and bound[m] >= best[-1][0]:
            break
        found = solve_cone(problem(K[:, chosen[m]], y, w, minmax=True))
        D[m] = found.weights
        errors = float(_errors(F, chosen[[m]], D[[m]])[0])
        best = sorted([*best, (float(np.hypot(found.objective, np.sqrt(errors))), int(m))])[:show]
    return np.array([m for _, m in best], dtype=np.int64), D
