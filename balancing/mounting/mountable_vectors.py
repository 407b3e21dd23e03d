"""Vectors that can be mounted in one plane: what every such set offers, and the search for the nearest ones.

`balancing.mounting.piece_sums` makes them of pieces in holes, `balancing.mounting.free_amounts` of free
amounts in steps. One given weight (`balancing.mounting.split`) and the joint search over planes
(`balancing.mounting.discrete_weights`) look them up here.
"""

from __future__ import annotations

from typing import Protocol

import numpy as np

from balancing.mounting.holes import Holes, Mounting
from rotorid.base.arrays import ComplexArray, FloatArray, IndexArray, IntArray

__all__ = [
    "DIRECTIONS",
    "MOST",
    "NOTHING",
    "SAME",
    "Attainable",
    "apart",
    "disc_lowest",
    "distinct",
    "lens",
    "nearest",
    "nearest_allowed",
    "places",
]

MOST = 1_500_000
"""Sums that are looked at together, at most."""
SAME = 1e-9
"""Vectors are equal within this share of the largest one."""
DIRECTIONS = np.exp(2j * np.pi * np.arange(72) / 72)
NOTHING = (
    "no admissible weight at all: what is mounted already exceeds the largest weight of the plane, "
    "and nothing that fits these holes makes it small enough"
)
_MIX = np.int64(6364136223846793005)
_THIN = 1e-12


class Attainable(Protocol):
    """A set of vectors, and how each is mounted."""

    holes: Holes
    complete: bool
    reach: float
    """No vector is larger."""
    mounted: complex
    """Vector of what is there already."""
    spacing: float
    """Rough distance between vectors where they are dense."""

    def aim(self, z: complex) -> None:
        """Get ready to look vectors up; where not all can be, those near z."""

    def near(
        self, z: complex, low: float, high: float, most: int, *, fitting: bool = False
    ) -> tuple[ComplexArray, IntArray] | None:
        """Vectors with low < |d − z| ≤ high, nearest first, and keys (n, 3); None if there may be > most.

        `fitting` counts only what fits the limits of pieces, which takes longer.
        """

    def few(self, pieces: int) -> Attainable:
        """The vectors of so many pieces, or all, whichever can be looked up with less."""

    def pieces(self, keys: IntArray) -> IntArray:
        """How many each vector takes at least, shape (n,); 0 where amounts are free."""

    def lowest(self, g: complex) -> float:
        """Lower bound of Re(ḡ d) over the set (also over what was left out)."""

    def normals(self) -> ComplexArray:
        """Directions in which the set is bounded well by `lowest`."""

    def mount(self, key: IntArray) -> Mounting:
        """What goes where for a vector's key."""


def nearest(one: Attainable, z: complex, slack: float = 0.0) -> tuple[ComplexArray, IntArray]:
    """The vectors nearest to z, all within `slack` of the smallest distance, and their keys.

    Raises
    ------
    ValueError
        Where the set is empty, or too dense for a search.
    """
    low, fitting = apart(one, z), False
    radius = max(low, 0.0) + one.spacing
    furthest = abs(z) + abs(one.mounted) + one.reach
    while radius < 4 * furthest:
        hit = one.near(z, low, radius, MOST, fitting=fitting)
        inner = max(low, 0.0)
        if hit is None and radius - inner >= _THIN * furthest:
            radius = inner + (radius - inner) / 8
        elif hit is None and not fitting:  # what fits no stock may crowd the way
            fitting, radius = True, inner + one.spacing
        elif hit is None:
            raise ValueError(
                "there are too many combinations near this weight: allow fewer pieces or fewer holes, or "
                "take a larger step"
            )
        elif len(hit[0]):
            least = float(np.abs(hit[0][0] - z))
            if least + slack > radius:
                hit = one.near(z, low, least + slack, MOST, fitting=fitting) or hit
            tied = np.abs(hit[0] - z) <= least + slack
            return hit[0][tied], hit[1][tied]
        else:
            low, radius = radius, radius + 2 * (radius - inner)
    if one.complete:
        raise ValueError(NOTHING)
    raise ValueError(
        "no weight was found that the largest weight of the plane admits: there are too many combinations; "
        "allow fewer pieces or fewer holes"
    )


def apart(one: Attainable, z: complex) -> float:
    """A distance from z (or −1) within which there are no vectors."""
    far = -1.0
    for towards in (z, z + one.mounted):
        if towards != 0:
            n = towards / abs(towards)
            far = max(far, float((np.conj(n) * z).real) + one.lowest(-n))
    return far - 1e-9 * (abs(z) + one.spacing) if far > 0 else -1.0


def disc_lowest(g: complex, max_weight: float, mounted: complex) -> float:
    """Lowest Re(ḡ d) in the disc |mounted + d| ≤ max_weight."""
    if not np.isfinite(max_weight):
        return -np.inf
    return float(-abs(g) * max_weight * (1 + 1e-9) - (np.conj(g) * mounted).real)


def lens(p: ComplexArray | complex, r: float, q: complex, R: float) -> tuple[ComplexArray, FloatArray]:
    """Smallest disc around what the discs |v − p| ≤ r and |v − q| ≤ R have in common: centre and radius."""
    way = q - np.asarray(p)
    far = np.maximum(np.abs(way), 1e-100)
    chord = (far + (r - R) * ((r + R) / far)) / 2  # its distance from p
    share = np.clip(chord / far, 0.0, 1.0)
    half = np.sqrt(np.maximum(r * r - (share * far) ** 2, 0.0))
    return p + share * way, np.where(chord <= 0, r, np.where(chord >= far, R, half))


def nearest_allowed(z: complex, mounted: complex, max_weight: float) -> complex:
    """The vector nearest to z for which the plane's total stays within its largest weight."""
    total = mounted + z
    return z if abs(total) <= max_weight else total / abs(total) * max_weight - mounted


def distinct(cost: FloatArray, keys: list[IntArray]) -> IndexArray:
    """Indices of the rows that differ in their keys (n,), of equal ones that of the least cost."""
    # a hash makes equal rows neighbours, which is quicker than to sort by all keys; it decides nothing else
    mixed = np.zeros(len(cost), dtype=np.int64)
    for key in keys:
        mixed = (mixed ^ key) * _MIX
    order = np.lexsort((cost, mixed))
    new = np.ones(len(order), dtype=bool)
    new[1:] = np.any([np.diff(key[order]) != 0 for key in keys], axis=0)
    return np.asarray(order[new])


def places(d: ComplexArray, quantum: float) -> list[IntArray]:
    """Whole quanta of vectors in both directions, keys for `distinct`."""
    return [np.rint(part / quantum).astype(np.int64) for part in (d.real, d.imag)]
