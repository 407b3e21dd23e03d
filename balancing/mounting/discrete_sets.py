"""Vectors that pieces in the holes of one plane can make, found near a point without listing them all.

The holes are divided in two halves whose sums are listed (equal sums once); every attainable vector is a sum
a + b. Those in a disc around z are found by looking, for every a, for the b near z − a in a grid (meet in
the middle). Holes that cancel or add up to each other (180°, 120°, 72° apart) go into the same half, whose
list is so much shorter. Free amounts: `balancing.mounting.discrete_steps`.
"""

from __future__ import annotations

from itertools import product
from typing import Protocol

import numpy as np
from numpy.typing import NDArray

from balancing.mounting.holes import Holes, Mounting, mounting
from rotorid.base.arrays import BoolArray, ComplexArray, FloatArray, IntArray

__all__ = ["DIRECTIONS", "LONGEST", "SAME", "Attainable", "PieceSums", "disc_lowest", "distinct"]

LONGEST = 540_000
"""Sums of one half at most; where there are more, some of them are left out."""
SAME = 1e-9
DIRECTIONS = np.exp(2j * np.pi * np.arange(72) / 72)
_MOST_OPTIONS = 5000


class Attainable(Protocol):
    """A set of vectors, and how each is mounted."""

    complete: bool
    reach: float
    """No vector is larger."""
    mounted: complex
    """Vector of what is there already."""
    spacing: float
    """Rough distance between vectors where they are dense."""

    def near(self, z: complex, low: float, high: float, most: int) -> tuple[ComplexArray, IntArray] | None:
        """Vectors with low < |d − z| ≤ high, nearest first, and keys (n, 3); None if there may be > most."""

    def lowest(self, g: complex) -> float:
        """Lower bound of Re(ḡ d) over the set (also over what was left out)."""

    def normals(self) -> ComplexArray:
        """Directions in which the set is bounded well by `lowest`."""

    def mount(self, key: IntArray) -> Mounting:
        """What goes where for a vector's key."""


class PieceSums:
    """Sums of pieces."""

    def __init__(self, holes: Holes, usable: BoolArray, max_weight: float, longest: int = LONGEST) -> None:
        self.holes, self.max_weight, self.complete, self.mounted = holes, max_weight, True, holes.mounted
        options, self.used_of = _options(holes)
        self.amounts_of = options @ holes.pieces
        self.options, self.stock = options, holes.stock if self.used_of.shape[1] else None
        self.which = np.flatnonzero(usable)
        self.reach = float(len(self.which) * self.amounts_of.max(initial=0.0)) or 1.0
        self._lowest_of = self._halves(longest)
        self.B0 = self.B.mean()
        self.B_radius = float(np.abs(self.B - self.B0).max())
        self._grids: dict[int, tuple[IntArray, FloatArray, float]] = {}
        spread = float(np.var(self.A) + np.var(self.B))
        self.spacing = float(np.sqrt(np.pi * max(spread, (0.1 * self.reach) ** 2) / self._number()))

    def _number(self) -> float:
        return float(len(self.A)) * float(len(self.B))

    def _halves(self, longest: int) -> ComplexArray:
        """List the sums of both halves, in the order of the holes that makes them shortest."""
        turned = self.holes.angles[self.which]
        best: tuple[int, list[IntArray], list[_Half]] | None = None
        for period in (np.pi / 3, np.pi / 5, np.pi):
            rest = np.round(np.mod(turned + 1e-7, period), 5)
            if best is not None and len(np.unique(rest)) == len(rest):
                continue  # no order is better than another
            order = self.which[np.lexsort((turned, rest))]
            parts = [order[: (len(order) + 1) // 2], order[(len(order) + 1) // 2 :]]
            halves = [self._sums(part, longest) for part in parts]
            size = sum(len(half.sums) for half in halves)
            if best is None or size < best[0]:
                best = size, parts, halves
        assert best is not None  # there are three periods
        _, self.parts, (first, second) = best
        if len(first.sums) * len(second.sums) <= longest and self.stock is None:
            whole = self._sums(np.concatenate(self.parts), longest)
            self.parts, first, second = [np.concatenate(self.parts), self.which[:0]], whole, _Half.empty(self)
        first = first.sorted()  # neighbours are looked up one after the other
        self.A, self.B, self.halves = first.sums, second.sums, (first, second)
        self.complete = first.complete and second.complete
        return np.asarray(np.exp(1j * turned))

    def _sums(self, part: IntArray, longest: int) -> _Half:
        half, quantum = _Half.empty(self), self.reach * SAME
        for hole in part:
            step = self.amounts_of * np.exp(1j * self.holes.angles[hole])
            most = longest if half.complete else longest // 10 + 1
            if len(half.sums) * len(step) > 3 * most:
                half = half.some(3 * most // len(step) + 1)
            sums = (half.sums[:, None] + step).ravel()
            used = (half.used[:, None] + self.used_of).reshape(len(sums), -1)
            row, option = np.divmod(np.arange(len(sums)), len(step))
            fits = np.ones(len(sums), dtype=bool) if self.stock is None else (used <= self.stock).all(axis=1)
            totals = (half.totals[:, None] + self.amounts_of).ravel()
            kept = np.flatnonzero(fits)
            kept = kept[np.argsort(totals[kept], kind="stable")]  # the lightest of equal ones
            kept = kept[distinct(sums[kept], quantum, used[kept])]
            picks = np.column_stack((half.picks[row[kept]], option[kept].astype(np.int16)))
            half = _Half(sums[kept], used[kept], picks, totals[kept], half.complete)
            if len(kept) > most:
                half = half.some(most)
        return half

    def near(self, z: complex, low: float, high: float, most: int) -> tuple[ComplexArray, IntArray] | None:
        """See `Attainable`."""
        order, keys, h = self._grid(high)
        along = np.conj(z) / (abs(z) or 1.0)  # vectors near z are as far out as |z| − high
        ahead = (along * self.A).real + float((along * self.B).real.max())
        close = np.abs(z - self.A - self.B0) <= self.B_radius + high
        rows = np.flatnonzero(close & (ahead >= (abs(z) - high) * (1 - 1e-12)))
        around = z - self.A[rows] - self._origin
        width = self._width
        pad = 1e-14 * (abs(keys[-1]) + width)
        first_row = np.floor((around.imag - high) / h)
        starts, counts = [], []
        for k in range(3):
            line = first_row + k
            x0 = np.clip(around.real - high - pad, -pad, width)
            x1 = np.clip(around.real + high + pad, -pad, width)
            inside = line * h <= around.imag + high
            a = np.searchsorted(keys, line * 2 * width + x0, side="left")
            b = np.searchsorted(keys, line * 2 * width + x1, side="right")
            starts.append(a)
            counts.append(np.where(inside, b - a, 0))
        start, count = np.concatenate(starts), np.concatenate(counts)
        total = int(count.sum())
        if total > most:
            return None
        i = np.repeat(np.tile(rows, 3), count)
        j = order[np.arange(total) - np.repeat(np.cumsum(count) - count, count) + np.repeat(start, count)]
        return self._kept(z, low, high, i, j)

    def _kept(
        self, z: complex, low: float, high: float, i: IntArray, j: IntArray
    ) -> tuple[ComplexArray, IntArray]:
        d = self.A[i] + self.B[j]
        distance = np.abs(d - z)
        good = (distance > low) & (distance <= high)
        if np.isfinite(self.max_weight):
            good &= np.abs(d + self.holes.mounted) <= self.max_weight * (1 + 1e-9)
        if self.stock is not None:
            good &= (self.halves[0].used[i] + self.halves[1].used[j] <= self.stock).all(axis=1)
        light = np.argsort(self.halves[0].totals[i[good]] + self.halves[1].totals[j[good]], kind="stable")
        one = np.flatnonzero(good)[light]
        i, j, d, distance = i[one], j[one], d[one], distance[one]
        one = distinct(d, self.reach * SAME)
        one = one[np.argsort(distance[one], kind="stable")]
        return d[one], np.column_stack((i[one], j[one], np.zeros(len(one), dtype=np.int64)))

    def _grid(self, radius: float) -> tuple[IntArray, FloatArray, float]:
        """B sorted by rows of height h ≥ radius and by its real part within them."""
        self._origin = complex(self.B.real.min(), self.B.imag.min())
        self._width = max(float(np.ptp(self.B.real)), 1e-6 * self.reach)
        tall = max(float(np.ptp(self.B.imag)), 1e-6 * self.reach)
        h0 = tall / 2**16
        level = int(np.ceil(np.log2(max(radius / h0, 1.0))))
        if level not in self._grids:
            h = h0 * 2.0**level
            moved = self.B - self._origin
            keys = np.floor(moved.imag / h) * 2 * self._width + moved.real
            order = np.argsort(keys, kind="stable")
            self._grids[level] = order, keys[order], h
        return self._grids[level]

    def lowest(self, g: complex) -> float:
        """See `Attainable`."""
        # without stock and largest weight every hole is chosen alone
        ahead = np.minimum((np.conj(g) * self._lowest_of).real, 0.0) * self.amounts_of.max(initial=0.0)
        return max(float(ahead.sum()), disc_lowest(g, self.max_weight, self.holes.mounted))

    def normals(self) -> ComplexArray:
        """See `Attainable`."""
        return np.asarray(DIRECTIONS)

    def mount(self, key: IntArray) -> Mounting:
        """See `Attainable`."""
        counts = np.zeros((len(self.holes.angles), len(self.holes.pieces)), dtype=np.int64)
        for part, half, row in zip(self.parts, self.halves, key[:2], strict=True):
            counts[part] = self.options[half.picks[row]]
        return mounting(self.holes, counts)


class _Half:
    """Sums of one half of the holes (n,).

    With the pieces of limited stock used (n, K or 0), the option of each hole (n, holes), total weights (n,).
    """

    def __init__(
        self, sums: ComplexArray, used: IntArray, picks: NDArray[np.int16], totals: FloatArray, complete: bool
    ) -> None:
        self.sums, self.used, self.picks, self.totals, self.complete = sums, used, picks, totals, complete

    def some(self, count: int) -> _Half:
        """A random part, with the outermost sums in every direction."""
        if count >= len(self.sums):
            return self
        chosen = np.random.default_rng(count).permutation(len(self.sums))[:count]
        ends = [int(np.argmax((self.sums * d.conj()).real)) for d in DIRECTIONS]
        kept = np.unique(np.concatenate((chosen, ends, [int(np.argmin(np.abs(self.sums)))])))
        return _Half(self.sums[kept], self.used[kept], self.picks[kept], self.totals[kept], False)

    def sorted(self) -> _Half:
        order = np.argsort(-self.sums.imag)
        n = order
        return _Half(self.sums[n], self.used[n], self.picks[n], self.totals[n], self.complete)

    @classmethod
    def empty(cls, of: PieceSums) -> _Half:
        used = np.zeros((1, of.used_of.shape[1]), dtype=np.int64)
        return cls(np.zeros(1, dtype=complex), used, np.zeros((1, 0), dtype=np.int16), np.zeros(1), True)


def _options(holes: Holes) -> tuple[IntArray, IntArray]:
    """Pieces of each size in one hole (n, K), and those of them that the stock limits (n, K or 0)."""
    K = len(holes.pieces)
    if (holes.per_hole + 1.0) ** K > 5e6:
        raise ValueError("there are too many sizes of pieces for so many in one hole: list fewer of either")
    all_counts = np.array(
        [c for c in product(range(holes.per_hole + 1), repeat=K) if sum(c) <= holes.per_hole], dtype=np.int64
    ).reshape(-1, K)
    all_counts = all_counts[np.argsort(all_counts.sum(axis=1), kind="stable")]
    most = holes.per_hole * int(holes.free.sum())
    if holes.stock is not None and (holes.stock < most).any():
        all_counts = all_counts[(all_counts <= holes.stock).all(axis=1)]
        options, used = all_counts, all_counts
    else:
        amounts = np.round(all_counts @ holes.pieces / holes.pieces.max(), 12)
        options = all_counts[np.sort(np.unique(amounts, return_index=True)[1])]
        used = options[:, :0]
    if len(options) > _MOST_OPTIONS:
        raise ValueError("there are too many ways to fill one hole: list fewer pieces, or fewer per hole")
    return options, used


def distinct(d: ComplexArray, quantum: float, used: IntArray | None = None) -> IntArray:
    """Indices of one of each group of equal vectors (and used pieces); |d| ≤ 1e9 quanta."""
    key = np.rint(d.real / quantum).astype(np.int64) * 2**32 + np.rint(d.imag / quantum).astype(np.int64)
    if used is not None and used.shape[1]:
        key = np.unique(key, return_inverse=True)[1].reshape(-1)
        for column in used.T:
            key = np.unique(key * (int(column.max(initial=0)) + 1) + column, return_inverse=True)[1].reshape(
                -1
            )
    return np.asarray(np.unique(key, return_index=True)[1], dtype=np.int64)


def disc_lowest(g: complex, max_weight: float, mounted: complex) -> float:
    """Lowest Re(ḡ d) in the disc |mounted + d| ≤ max_weight."""
    if not np.isfinite(max_weight):
        return -np.inf
    return float(-abs(g) * max_weight * (1 + 1e-9) - (np.conj(g) * mounted).real)
