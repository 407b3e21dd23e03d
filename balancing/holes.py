"""Holes of one plane: positions, pieces, what is mounted there already.

Angles count with the rotation, in rad; weights are kg (mass at the plane's radius) or kg·m (unbalance).
A hole in which something is mounted cannot be used further. What is mounted is part of the readings already,
therefore not of the correction D; it counts only where the plane's total is limited (`Limits.max_weight`).
"""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike

from rotorid.base.arrays import AnyArray, BoolArray, FloatArray, IntArray

SAME_ANGLE = float(np.radians(1e-3))
"""Holes nearer to each other than this are one place, and a hole this near to an arc's end is on it."""
KEPT = 1 + 1e-9
"""A limit is kept within rounding."""


@dataclass(frozen=True, eq=False)
class Holes:
    """Positions and pieces of one plane, as `from_list` makes and checks them.

    Attributes
    ----------
    angles
        Of the holes, rad with the rotation, −2π … 4π, in any order, at least `SAME_ANGLE` apart, shape (H,).
    pieces
        Weights of which each can be mounted, > 0, each size listed once, shape (K,). Empty: amounts are free,
        in multiples of `step` (or any where that is 0), in one hole or in two neighbouring free ones not more
        than 120° apart (farther apart, amounts would be larger than what they make).
    per_hole
        Pieces in one hole at most; has no meaning for free amounts.
    step
        Smallest step of a free amount; 0 for any amount.
    taken
        Weight that is in each hole already, shape (H,); a hole with more than 0 cannot be used.
    stock
        How many of each piece there are for the whole plane, shape (K,); None: enough.
    names
        Of the holes; "1", "2", … by default.
    """

    angles: FloatArray
    pieces: FloatArray
    per_hole: int
    step: float
    taken: FloatArray
    stock: IntArray | None
    names: tuple[str, ...]

    @property
    def free(self) -> BoolArray:
        """Holes that can be used, shape (H,)."""
        return self.taken <= 0

    @property
    def free_amounts(self) -> bool:
        """Whether amounts are free (in steps, perhaps) instead of sums of pieces."""
        return not len(self.pieces)

    @property
    def mounted(self) -> complex:
        """Vector Σ taken e^{iφ} of what is there already."""
        return complex(self.taken @ np.exp(1j * self.angles))

    def outside(self, arcs: Sequence[tuple[float, float]]) -> BoolArray:
        """Free holes that stand in none of the arcs (first angle, width; ends are allowed), shape (H,)."""
        kept = self.free
        for first, width in arcs:
            after = np.mod(self.angles - first, 2 * np.pi)
            kept &= ~((after > SAME_ANGLE) & (after < width - SAME_ANGLE))
        return kept


@dataclass(frozen=True, eq=False)
class Mounting:
    """Pieces or amounts in each hole of one plane.

    Attributes
    ----------
    counts
        Pieces of each size in each hole, shape (H, K); (H, 0) where amounts are free.
    amounts
        Weight added in each hole, shape (H,).
    vector
        Σ amounts e^{iφ}.
    """

    counts: IntArray
    amounts: FloatArray
    vector: complex


def equal_holes(n: int, first: float = 0.0) -> FloatArray:
    """Angles of n equally spaced holes, 0 … 2π, shape (n,).

    Parameters
    ----------
    n
        Number of holes.
    first
        Angle of hole 1, rad.

    Returns
    -------
    In rad, 0 … 2π, in the order of the numbers, which grow as angles are counted.

    Raises
    ------
    ValueError
        For fewer than one hole, an angle that is not finite.
    """
    if n != int(n) or n < 1 or not np.isfinite(first):
        raise ValueError(
            f"the number of holes must be whole, 1 or more, the first angle finite; got {n}, {first}"
        )
    angles = np.mod(first + 2 * np.pi * np.arange(int(n)) / int(n), 2 * np.pi)
    return np.where(angles >= 2 * np.pi, 0.0, angles)


def from_list(
    angles: ArrayLike,
    pieces: ArrayLike = (),
    *,
    per_hole: int = 1,
    step: float = 0.0,
    taken: ArrayLike = (),
    stock: ArrayLike | None = None,
    names: Sequence[str] = (),
) -> Holes:
    """Holes from plain lists, checked.

    Parameters
    ----------
    angles, pieces, per_hole, step, taken, stock, names
        The attributes of `Holes`; nothing is taken by default, and names are "1", "2", …

    Raises
    ------
    ValueError
        Where numbers are not finite, negative, repeated or do not fit, or nothing at all can be mounted.
    """
    phi, sizes, there = (np.array(values, dtype=np.float64) for values in (angles, pieces, taken))
    count, there = len(phi), there if there.size else np.zeros(len(phi))
    named = tuple(names) or tuple(str(k + 1) for k in range(count))
    number = np.ones(len(sizes)) if stock is None else np.asarray(stock, dtype=np.float64)
    fits = 0 < count == len(named) == len(set(named)) and there.shape == phi.shape
    apart = np.abs(np.exp(1j * phi[:, None]) - np.exp(1j * phi)) + 3 * np.tri(count)
    same = [named[k] for k in np.argwhere(apart < SAME_ANGLE)[:1].ravel()] if fits else []
    whole = (np.array([*number, per_hole]) % 1 == 0).all()
    rules = (
        (fits, f"{count} holes: there must be some, each with a name of its own and what is mounted there"),
        (
            np.isfinite((*phi, *sizes, *there, step)).all(),
            "angles, pieces and weights must be finite numbers",
        ),
        (not (np.abs(phi - np.pi) > 3 * np.pi * KEPT).any(), "angles of holes must be from −360° to 720°"),
        (not same, f"holes {' and '.join(same)} stand at the same angle: list each once"),
        (
            min((*there, step, *number)) >= 0 and (sizes > 0).all() and per_hole >= 1 and whole,
            "pieces must weigh more than 0, their numbers be whole, one or more in a hole; what is mounted "
            "and the smallest step must not be negative",
        ),
        (
            len(set(sizes)) == len(sizes) and number.shape == sizes.shape,
            f"a piece is listed twice, or the stock is not one number for each of the {len(sizes)} pieces",
        ),
        (not (len(sizes) and step), "give either pieces or a smallest step of free amounts, not both"),
        (
            not (there > 0).all() and (number.any() or not len(sizes)),
            "nothing can be mounted: something is mounted in every hole already, or the stock is empty",
        ),
    )
    for right, words in rules:
        if not right:
            raise ValueError(words)
    left = None if stock is None else number.astype(np.int64)
    return Holes(phi, sizes, int(per_hole), float(step), there, left, named)


def mounting(holes: Holes, counts: AnyArray, sizes: FloatArray) -> Mounting:
    """The mounting of `counts` (H, K) of pieces, or of amounts, of these sizes (K,)."""
    amounts = counts @ sizes
    return Mounting(counts[:, : len(holes.pieces)], amounts, complex(amounts @ np.exp(1j * holes.angles)))


def contents(holes: Holes, mounting: Mounting, scale: float) -> list[tuple[int, complex, str]]:
    """Every hole in use, its weight, and what goes into it in units of 1 / scale: "2 × 150 + 50"."""
    used, weights = [], mounting.amounts * np.exp(1j * holes.angles)
    for h in np.flatnonzero(mounting.amounts).tolist():
        each = zip(mounting.counts[h], holes.pieces * scale, strict=False)
        parts = [f"{n} × {size:.6g}" if n > 1 else f"{size:.6g}" for n, size in each if n]
        words = " + ".join(parts) or f"{mounting.amounts[h] * scale:.6g}"
        used.append((h, complex(weights[h]), words))
    return used


def lightest(holes: Holes, usable: BoolArray, z: complex, most: float) -> FloatArray:
    """Amounts (H,) of least sum, up to `most` in each usable hole, that come nearest to z."""
    from scipy.optimize import lsq_linear

    ways, amounts, size = np.exp(1j * holes.angles[usable]), np.zeros(len(holes.angles)), abs(z) or 1.0
    rows = np.vstack((ways.real, ways.imag, np.full(len(ways), 1e-4)))
    wanted = [z.real / size, z.imag / size, 0.0]
    amounts[usable] = lsq_linear(rows, wanted, bounds=(0.0, most / size), method="bvls", tol=1e-14).x * size
    return amounts


def equal_together(contents: Iterable[tuple[str, str]]) -> list[str]:
    """What is in each hole in words, equal contents once.

    >>> equal_together([("10 g", "3"), ("2 × 10 g", "5"), ("10 g", "7")])
    ['10 g in holes 3, 7', '2 × 10 g in hole 5']
    """
    same: dict[str, list[str]] = {}
    for content, hole in contents:
        same.setdefault(content, []).append(hole)
    return [f"{what} in {'holes' if at[1:] else 'hole'} {', '.join(at)}" for what, at in same.items()]
