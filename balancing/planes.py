"""Choices of planes: what weights in some of them leave, and the best k of many.

With A = (Y₀ W), rows times their weights, and z = (1, D) the weights D leave |A z|², and the errors of A add
zᴴ F z on average, F = Σ E[dAᴴ dA]: it grows with the weights, so that weights that fight each other cost more
than their residual says.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from itertools import combinations
from math import comb
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from balancing.conditioning import UndeterminedError, check_stack
from balancing.conventions import Labels
from balancing.influence import Influence
from balancing.tables import rms, three_figures, weight_rows
from rotorid.base.answer import Answer, Answered
from rotorid.base.arrays import ComplexArray, FloatArray, IntArray
from rotorid.base.choices import did_you_mean
from rotorid.base.json import plain
from rotorid.base.tables import Column, records, text
from rotorid.base.text import counted
from rotorid.regression import RCOND, gain

MOST = 20_000
"""More choices of planes than this are not tried."""
_NAMED = 3


def error_form(covariance: FloatArray, row_weights: FloatArray) -> ComplexArray:
    """F (P + 1, P + 1) from covariances (N, 2P + 2, 2P + 2) of (Re Y, Im Y, Re W₁, …), row weights (N,)."""
    n = covariance.shape[-1]
    total = np.einsum("n,nij->ij", row_weights**2, covariance).reshape(n // 2, 2, n // 2, 2)
    real = total[:, 0, :, 0] + total[:, 1, :, 1]
    return np.asarray(real + 1j * (total[:, 0, :, 1] - total[:, 1, :, 0]))


def error_square(F: ComplexArray, chosen: IntArray, D: ComplexArray) -> FloatArray:
    """zᴴ F z (M,) of weights D (M, k) in the planes `chosen` (M, k)."""
    z = np.zeros((len(D), len(F)), dtype=complex)
    z[:, 0] = 1.0
    np.put_along_axis(z, chosen + 1, D, axis=1)
    return np.asarray(np.maximum(np.einsum("mp,pq,mq->m", z.conj(), F, z).real, 0.0))


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
        What they are ranked by: rms of the readings times their row weights, and of their errors, shape (M,).
    condition_number
        Of each choice, shape (M,).
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
                "criterion": "rms",
                "conventions": self.labels.conventions(),
                "rms_before": self.rms_before * scale,
                "max_before": self.largest_before * scale,
                "choices": self.choices,
                "dependent_choices": self.dependent,
                "rows": records((*self._columns(), Column("weights", weights))),
            }
        )

    @property
    def answer(self) -> Answer:
        """The best choices in words; then their table."""
        scale, of = self.labels.vibration_scale, "weighted " if self.weighted else ""
        unit = f" ({self.labels.vibration_in})" if self.labels.vibration_in else ""
        choices = f"{counted(self.choices, 'choice')} of {counted(self.weights.shape[1], 'plane')}"
        head = f"The best of {choices}, by {of}rms after correction{unit}"
        best = list(zip(self.planes, self.rms, strict=True))[:_NAMED]
        each = [f"{', '.join(planes)}: {three_figures(size * scale)}" for planes, size in best]
        before = three_figures(self.rms_before * scale), three_figures(self.largest_before * scale)
        lines = [head, text(self._columns()), f"Before: rms {before[0]}, largest {before[1]}."]
        if self.dependent:
            lines.append(
                f"{self.dependent} more choices have planes that act alike: no weights are determined."
            )
        return Answer(f"{head}: {'; '.join(each)}.", tables=("\n".join(lines),), more="choices of planes")

    def _columns(self) -> tuple[Column, ...]:
        labels, scale = self.labels, self.labels.vibration_scale
        heaviest = "largest weight" + (f", {labels.weight_in}" if labels.weight_in else "")
        mass = np.abs(self.weights).max(axis=1) * labels.weight_scale
        return (
            Column("planes", self.planes, ", ".join),
            Column("rms_after", self.rms * scale, three_figures, title="rms"),
            Column("rms_expected", self.expected * scale, three_figures, title="expected"),
            Column("max_after", self.largest * scale, three_figures, title="largest"),
            Column("largest_weight", mass, three_figures, title=heaviest),
            Column("condition_number", self.condition_number, three_figures, title="condition"),
        )


def best_subsets(
    W: ArrayLike,
    Y: ArrayLike,
    planes: Sequence[str],
    k: int,
    *,
    row_weights: ArrayLike | None = None,
    covariance: FloatArray | None = None,
    show: int = 10,
    labels: Labels | None = None,
) -> Subsets:
    """Compare all choices of k planes, each with its own weights by least squares.

    Parameters
    ----------
    W, Y
        Stacked influence coefficients (N, P) and vibration (N,).
    planes
        Names, P.
    k
        How many to use, 1 … P, at most N.
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
        For k out of range, more than `MOST` choices, NaN, shapes that do not fit.
    UndeterminedError
        If the planes of every choice act alike.

    Notes
    -----
    With the QR factorisation of diag(w) (W Y) the residual of every choice follows from P + 1 rows.
    """
    K, y, w = check_stack(W, Y, row_weights)
    N, P = K.shape
    if len(planes) != P or len(set(planes)) != P:
        raise ValueError(f"{P} different names of planes are needed; got {list(planes)}")
    if not 1 <= k <= P:
        raise ValueError(f"choose between 1 and {P} planes; got {k}")
    if k > np.count_nonzero(w):
        raise ValueError(
            f"{k} planes need at least {k} readings (sensors × speeds); there are {np.count_nonzero(w)}"
        )
    if comb(P, k) > MOST:
        raise ValueError(
            f"there are {comb(P, k)} choices of {k} out of {P} planes, more than the {MOST} that are tried: "
            "leave planes out first, or choose fewer (or nearly all) of them"
        )
    chosen = np.array(list(combinations(range(P), k)))
    R = np.asarray(np.linalg.qr(w[:, None] * np.column_stack((K, y)), mode="r"))
    right, columns = R[:, P], np.moveaxis(R[:, chosen], 1, 0)
    lengths = np.linalg.norm(columns, axis=1, keepdims=True)
    s = np.linalg.svd(columns / np.where(lengths > 0, lengths, 1.0), compute_uv=False)
    solid = s[:, -1] > RCOND * s[:, 0]
    if not solid.any():
        raise UndeterminedError(
            f"the planes of every choice of {k} act alike: choose fewer, or add readings or speeds"
        )
    chosen, columns, s = chosen[solid], columns[solid], s[solid]
    D = -gain(columns) @ right
    F, unweighted = (
        np.zeros((P + 1, P + 1), dtype=complex) if covariance is None else error_form(covariance, each) / N
        for each in (w, np.ones(N))
    )
    left = np.linalg.norm(right + np.einsum("mrk,mk->mr", columns, D), axis=1) ** 2 / N
    rank = left + error_square(F, chosen, D)
    order = np.argsort(rank, kind="stable")[:show]
    chosen, D = chosen[order], D[order]
    after = y + np.einsum("nmk,mk->mn", K[:, chosen], D)
    square = np.mean(np.abs(after) ** 2, axis=1)
    return Subsets(
        planes=tuple(tuple(planes[p] for p in each) for each in chosen),
        weights=D,
        rms=np.sqrt(square),
        largest=np.abs(after).max(axis=1),
        expected=np.sqrt(square + error_square(unweighted, chosen, D)),
        objective=np.sqrt(rank[order]),
        condition_number=s[order, 0] / s[order, -1],
        rms_before=rms(y),
        largest_before=float(np.abs(y).max()),
        choices=len(rank),
        dependent=int(np.count_nonzero(~solid)),
        labels=labels or Labels(),
        weighted=bool(np.ptp(w) > 0),
    )


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
    if weights.shape != shape or not (weights >= 0).all():
        raise ValueError(
            f"the weights of the readings must be numbers ≥ 0 of shape {shape} (speeds, sensors)"
        )
    chosen = weights[used].ravel()
    if not chosen.any():
        raise ValueError("all readings have the weight 0: nothing is left to be minimised")
    return None if (chosen == chosen[0]).all() else chosen / chosen.max()


def plane_indices(influence: Influence, planes: Sequence[str] | None) -> list[int]:
    """Indices of the chosen planes.

    Raises
    ------
    ValueError
        Unknown or repeated planes, or none.
    """
    if planes is None:
        return list(range(len(influence.planes)))
    for name in planes:
        if name not in influence.planes:
            raise ValueError(
                f"there is no plane {name!r}{did_you_mean(str(name), influence.planes)}; "
                f"the planes are {', '.join(map(repr, influence.planes))}"
            )
    if not planes or len(set(planes)) < len(planes):
        raise ValueError("choose at least one plane, each once")
    return [influence.planes.index(p) for p in planes]
