"""Holes of one plane: positions, pieces, what is mounted there already.

Angles count with the rotation, in rad; weights are kg (mass at the plane's radius) or kg·m (unbalance).
A hole in which something is mounted cannot be used further. What is mounted is part of the readings already,
therefore not of the correction D; it counts only where the plane's total is limited.
"""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import ArrayLike

from rotorid.base.arrays import BoolArray, FloatArray, IntArray

SAME_ANGLE = float(np.radians(1e-3))
"""Holes nearer to each other than this are one place, and a hole this near to an arc's end is on it."""
KEPT = 1 + 1e-9
"""A limit is kept within rounding."""


@dataclass(frozen=True, eq=False)
class Holes:
    """Positions and pieces of one plane; checked when it is made.

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
    max_weight
        Largest |Σ weights e^{iφ}| of the plane, what is taken included.

    Raises
    ------
    ValueError
        Where numbers are not finite, negative, repeated or do not fit, or nothing at all can be mounted.
    """

    angles: FloatArray
    pieces: FloatArray
    per_hole: int = 1
    step: float = 0.0
    taken: FloatArray = field(default_factory=lambda: np.zeros(0))
    stock: IntArray | None = None
    names: tuple[str, ...] = ()
    max_weight: float = np.inf

    def __post_init__(self) -> None:
        def put(name: str, value: object) -> None:
            object.__setattr__(self, name, value)  # the class is frozen

        put("angles", _numbers(self.angles, "angles of the holes"))
        put("pieces", _numbers(self.pieces, "pieces"))
        put("taken", _numbers(self.taken, "weights already mounted"))
        count = len(self.angles)
        if not self.taken.size:
            put("taken", np.zeros(count))
        put("names", tuple(self.names) or tuple(str(k + 1) for k in range(count)))
        _check_positions(self)
        _check_pieces(self)
        if self.stock is not None:
            stock = np.asarray(self.stock, dtype=np.float64)
            if stock.shape != self.pieces.shape:
                raise ValueError(f"the stock must be one number for each of the {len(self.pieces)} pieces")
            if not ((stock >= 0) & (stock == np.rint(stock)) & np.isfinite(stock)).all():
                raise ValueError("the stock must be whole numbers ≥ 0, how many of each piece there are")
            put("stock", stock.astype(np.int64))
        _check_something_fits(self)

    @property
    def free(self) -> BoolArray:
        """Holes that can be used, shape (H,)."""
        return np.asarray(self.taken <= 0)

    @property
    def free_amounts(self) -> bool:
        """Whether amounts are free (in steps, perhaps) instead of sums of pieces."""
        return not len(self.pieces)

    @property
    def mounted(self) -> complex:
        """Vector Σ taken e^{iφ} of what is there already."""
        return complex(self.taken @ np.exp(1j * self.angles))

    def allows(self, vector: ArrayLike) -> BoolArray:
        """Whether the plane's total stays within `max_weight` with these vectors added."""
        total = np.abs(self.mounted + np.asarray(vector, dtype=complex))
        return np.asarray(total <= self.max_weight * KEPT)

    def outside(self, arcs: Sequence[tuple[float, float]]) -> BoolArray:
        """Free holes that stand in none of the arcs (first angle, width; ends are allowed), shape (H,)."""
        kept = self.free
        for first, width in arcs:
            after = np.mod(self.angles - first, 2 * np.pi)
            kept &= ~((after > SAME_ANGLE) & (after < width - SAME_ANGLE))
        return kept


@dataclass(frozen=True, eq=False)
class Mounting:
    """What goes where in one plane.

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
    if isinstance(n, bool) or n != int(n) or n < 1:
        raise ValueError(f"the number of holes must be a whole number of 1 or more; got {n}")
    if not np.isfinite(first):
        raise ValueError("the angle of the first hole must be a finite number")
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
    max_weight: float = np.inf,
) -> Holes:
    """Holes from plain lists.

    Parameters
    ----------
    angles, pieces, per_hole, step, taken, stock, names, max_weight
        The attributes of `Holes`, which says what it raises.
    """
    return Holes(
        np.asarray(angles),
        np.asarray(pieces),
        per_hole,
        float(step),
        np.asarray(taken),
        None if stock is None else np.asarray(stock),
        tuple(names),
        float(max_weight),
    )


def mounting(holes: Holes, counts: ArrayLike | None = None, amounts: ArrayLike | None = None) -> Mounting:
    """The mounting of `counts` (H, K) of the pieces or, where amounts are free, of `amounts` (H,)."""
    shape = (len(holes.angles), len(holes.pieces))
    number = np.zeros(shape, dtype=np.int64) if counts is None else np.asarray(counts, dtype=np.int64)
    weight = number @ holes.pieces if amounts is None else np.asarray(amounts, dtype=np.float64)
    return Mounting(number, weight, complex(weight @ np.exp(1j * holes.angles)))


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


def _numbers(values: ArrayLike, what: str) -> FloatArray:
    array = np.array(values, dtype=np.float64)
    if array.ndim != 1:
        raise ValueError(f"the {what} must be a plain list of numbers")
    if not np.isfinite(array).all():
        raise ValueError(f"the {what} must be finite numbers; number {_first(~np.isfinite(array))} is not")
    return array


def _check_positions(holes: Holes) -> None:
    angles, names, count = holes.angles, holes.names, len(holes.angles)
    if not count:
        raise ValueError("the plane has no holes: give at least one angle")
    if len(names) != count or len(set(names)) != count:
        raise ValueError(f"the names of the holes must be {count} different names, one for each hole")
    outside = (angles < -2 * np.pi * KEPT) | (angles > 4 * np.pi * KEPT)
    if outside.any():
        name = names[int(np.argmax(outside))]
        raise ValueError(
            f"hole {name} stands outside −360° … 720°: give its angle in degrees within one turn"
        )
    order = np.argsort(np.mod(angles, 2 * np.pi), kind="stable")
    after = np.mod(np.roll(angles[order], -1) - angles[order], 2 * np.pi)
    near = np.minimum(after, 2 * np.pi - after)
    if count > 1 and near.min() < SAME_ANGLE:
        k = int(np.argmin(near))
        one, other = sorted((order[k], order[(k + 1) % count]))
        raise ValueError(f"holes {names[one]} and {names[other]} stand at the same angle: list each once")
    if holes.taken.shape != (count,):
        raise ValueError(
            f"there must be one weight already mounted for each of the {count} holes (0 where it is free)"
        )
    if (holes.taken < 0).any():
        name = names[int(np.argmax(holes.taken < 0))]
        raise ValueError(f"the weight already mounted in hole {name} is negative: give 0 where it is free")


def _check_pieces(holes: Holes) -> None:
    pieces = holes.pieces
    if (pieces <= 0).any():
        raise ValueError(f"pieces must weigh more than 0; number {_first(pieces <= 0)} does not")
    if len(np.unique(pieces)) != len(pieces):
        raise ValueError("a piece is listed twice: list each size once and give how many there are as stock")
    if isinstance(holes.per_hole, bool) or holes.per_hole != int(holes.per_hole) or holes.per_hole < 1:
        raise ValueError(f"the number of pieces in one hole must be a whole number ≥ 1; got {holes.per_hole}")
    if not (np.isfinite(holes.step) and holes.step >= 0):
        raise ValueError("the smallest step of a weight must be a finite number ≥ 0 (0 for any amount)")
    if len(pieces) and holes.step > 0:
        raise ValueError("give either pieces or a smallest step of free amounts, not both")
    if not holes.max_weight >= 0:  # NaN is not ≥ 0
        raise ValueError("the largest weight of the plane must be a number ≥ 0")
    if not len(pieces) and holes.stock is not None:
        raise ValueError("a stock needs pieces: list the pieces, or leave the stock out")


def _check_something_fits(holes: Holes) -> None:
    usable = holes.pieces if holes.stock is None else holes.pieces[holes.stock > 0]
    why = ""
    if not holes.free.any():
        why = "something is mounted in every hole already"
    elif holes.max_weight <= 0:
        why = "the largest weight of the plane is 0"
    elif not holes.free_amounts and not len(usable):
        why = "the stock is empty"
    if why:
        raise ValueError(f"nothing can be mounted: {why}")


def _first(where: BoolArray) -> int:
    return int(np.argmax(where)) + 1
