"""How well the readings tell the planes apart: singular values, rank, planes that act alike, in words."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from balancing.coefficients.identifiability import scaled_columns, separation
from rotorid.base.arrays import ComplexArray, FloatArray
from rotorid.base.json import plain
from rotorid.base.result import Column, rows
from rotorid.base.text import counted, sentence, wrap
from rotorid.regression import solution

ALIKE = 0.1
"""Planes are named that do the same but for this share of their effect (two such: condition number 20)."""
NOTHING = 1e-9
"""A share below this is rounding."""


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
        but = f", but for {100 * self.share:.2g} % of the effect" if self.share > NOTHING else ""
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

    def summary(self) -> str:
        """Text of 80 columns."""
        P = len(self.planes)
        condition = (
            f"condition number {self.condition_number:.3g}"
            if np.isfinite(self.condition_number)
            else "no condition number"
        )
        lines = [
            f"{counted(P, 'plane')}, {counted(self.readings, 'reading')}: "
            f"rank {self.rank} of {P}, {condition}.",
            "Singular values: " + ", ".join(f"{s:.3g}" for s in self.singular_values) + ".",
        ]
        lines += [f"Plane {p!r} has no effect on any reading." for p in self.without_effect]
        lines += [sentence(a.words) for a in self.alike]
        if not self.alike and not self.without_effect and P > 1:
            lines.append(
                f"No planes act alike: each does more than {100 * ALIKE:g} % that the others cannot do."
            )
        return "\n".join(wrap(line, "  ") for line in lines)

    def to_dict(self) -> dict[str, Any]:
        """As JSON types; an infinite condition number is None, ratios count angles with the rotation."""
        alike = (
            Column("plane", [a.plane for a in self.alike]),
            Column("others", [a.others for a in self.alike]),
            Column("ratios", [np.abs(a.ratios) for a in self.alike]),
            Column("turned_deg", [np.degrees(np.angle(a.ratios)) for a in self.alike]),
            Column("share_not_alike", [a.share for a in self.alike]),
            Column("words", [a.words for a in self.alike]),
        )
        return plain({**vars(self), "alike": rows(alike)})


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
    >>> print(conditioning([[1, 2.0j], [1, 2.02j], [1, 1.98j]], ["A", "B"]).summary())
    2 planes, 3 readings: rank 2 of 2, condition number 245.
    Singular values: 1.41, 0.00577.
    Planes 'A' and 'B' act alike: 2 times a weight in 'A', turned by 90° with the
      rotation, does what a weight does in 'B', but for 0.82 % of the effect.
    """
    K, _, w = check_stack(W, np.zeros(len(np.atleast_1d(W))), row_weights)
    P = K.shape[1]
    if len(planes) != P or len(set(planes)) != P:
        raise ValueError(f"{P} different names of planes are needed; got {list(planes)}")
    K = w[:, None] * K
    told = separation(K)
    there = np.flatnonzero(told.lengths)
    return Conditioning(
        planes=tuple(planes),
        readings=int(np.count_nonzero(w)),
        singular_values=told.singular_values,
        condition_number=told.condition_number,
        rank=told.rank,
        without_effect=tuple(planes[p] for p in range(P) if p not in there),
        alike=_groups(K, [int(p) for p in there], planes),
    )


def check_stack(
    W: ArrayLike, Y: ArrayLike, row_weights: ArrayLike | None = None
) -> tuple[ComplexArray, ComplexArray, FloatArray]:
    """W (N, P), Y (N,) and row weights (N,; default 1) as arrays; NaN and shapes that do not fit are refused.

    Raises
    ------
    ValueError
        In plain words.
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
    w = np.ones(len(y)) if row_weights is None else np.asarray(row_weights, dtype=np.float64)
    if w.shape != y.shape or not np.isfinite(w).all() or (w < 0).any() or not w.any():
        raise ValueError(f"the row weights must be {len(y)} finite numbers ≥ 0, not all zero")
    return K, y, w


def check_channels(channels: ArrayLike, W: ComplexArray) -> FloatArray:
    """Covariances of (Re Y, Im Y, Re W₁, …) of each reading, as arrays that fit W (N, P)."""
    C = np.asarray(channels, dtype=np.float64)
    N, P = W.shape
    if C.shape != (N, 2 * P + 2, 2 * P + 2):
        raise ValueError(f"the covariances must have shape {(N, 2 * P + 2, 2 * P + 2)}; got {C.shape}")
    if not np.isfinite(C).all():
        raise ValueError("the covariances must be finite; found NaN or infinity")
    return C


def _groups(K: ComplexArray, left: list[int], planes: Sequence[str]) -> tuple[Alike, ...]:
    found = []
    while len(left) > 1:
        others, plane = _most_alike_pair(K, left)
        ratios, share = _stand_in(K, others, plane)
        if share > ALIKE:
            plane = min(left, key=lambda p: _stand_in(K, [q for q in left if q != p], p)[1])
            others = [q for q in left if q != plane]
            ratios, share = _stand_in(K, others, plane)
            if share > ALIKE:
                break
            # what adds less than the share that is left over is not worth a word
            part = np.abs(ratios) * np.linalg.norm(K[:, others], axis=0) / np.linalg.norm(K[:, plane])
            few = [q for q, size in zip(others, part, strict=True) if size > max(share, NOTHING)]
            if few and _stand_in(K, few, plane)[1] <= ALIKE:
                others = few
                ratios, share = _stand_in(K, others, plane)
        found.append(Alike(planes[plane], tuple(planes[q] for q in others), ratios, share))
        left = [p for p in left if p != plane]
    return tuple(found)


def _most_alike_pair(K: ComplexArray, left: list[int]) -> tuple[list[int], int]:
    B = scaled_columns(K[:, left])[0]
    cosine = np.triu(np.abs(B.conj().T @ B), 1)
    first, second = np.unravel_index(int(np.argmax(cosine)), cosine.shape)
    return [left[first]], left[second]


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
