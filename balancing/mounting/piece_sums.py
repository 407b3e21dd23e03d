"""Vectors that pieces in the holes of one plane can make, found near a point by meeting in the middle.

The holes are divided in two halves whose sums are listed (equal sums that use the same once, with the fewest
pieces, then the lightest); every vector is a sum a + b. Those in a disc around z are found by looking, for
every a, for the b near z − a in a grid. What is limited (a stock, the number of pieces) is counted along, and
only sums that fit together are joined. Holes that cancel or add up to each other (180°, 120°, 60° apart) go
into the same half, whose list is so much shorter.

Where even the halves are too many (some thirty holes at odd angles with several sizes of pieces), only so
many holes vary about the rounded answer of the continuous problem.
"""

from __future__ import annotations

from dataclasses import dataclass
from math import comb

import numpy as np
from numpy.typing import NDArray

from balancing.mounting.holes import Holes, Mounting, mounting
from balancing.mounting.mountable_vectors import (
    DIRECTIONS,
    SAME,
    apart,
    disc_lowest,
    distinct,
    lens,
    nearest_allowed,
    places,
)
from rotorid.base.arrays import BoolArray, ComplexArray, FloatArray, IndexArray, IntArray

__all__ = ["LONGEST", "PieceSums"]

LONGEST = 600_000
"""Sums of one half at most; where there are more, not all holes vary."""
_RAW = 12
"""So many times more before equal ones are put together."""
_MOST_CONTENTS = 20_000
_WIDE = 0.3
"""Discs larger than this, by a half's size, are cut down to what they have in common with it."""


@dataclass(frozen=True, eq=False)
class _Contents:
    """What one hole can hold, nothing first.

    Pieces of each size (m, K), weights (m,), cost (m,): the number of pieces and a share of the weight; what
    they use (m, r) of the limits (r,).
    """

    counts: IntArray
    weights: FloatArray
    cost: FloatArray
    used: IntArray
    limits: IntArray


@dataclass(frozen=True, eq=False)
class _Half:
    """Sums of some holes (n,), their cost (n,), what they use (n, r), contents of each hole (n, holes)."""

    sums: ComplexArray
    cost: FloatArray
    used: IntArray
    picks: NDArray[np.int16]


class PieceSums:
    """Sums of pieces in the holes of one plane; an `Attainable` set.

    Parameters
    ----------
    holes
        Positions and pieces.
    usable
        Which holes can be used, shape (H,).
    max_weight
        Largest |mounted + d|.
    most_pieces
        Altogether, at most; None: as many as fit.
    longest
        Sums of one half of the holes that are listed at most.
    """

    def __init__(
        self,
        holes: Holes,
        usable: BoolArray,
        max_weight: float,
        most_pieces: int | None = None,
        longest: int = LONGEST,
    ) -> None:
        self.holes, self.max_weight, self.mounted, self.longest = holes, max_weight, holes.mounted, longest
        self.usable = usable
        where = np.flatnonzero(usable)
        self.where = where[np.argsort(np.mod(holes.angles[where], 2 * np.pi), kind="stable")]
        self.ways = np.exp(1j * holes.angles[self.where])
        self._heaviest = _heaviest(holes, len(self.where), most_pieces)
        self.reach = float(self._heaviest.sum()) or 1.0
        self.contents = _contents(holes, len(self.where), most_pieces, self.reach)

    def aim(self, z: complex) -> None:
        """See `Attainable`."""
        self._aimed = z
        self.limits, self.base = self.contents.limits, np.zeros(len(self.where), dtype=np.int64)
        found = self._halves(np.arange(len(self.where)))
        self.complete = found is not None
        if found is None:
            varying = self._fix(z)
            self.limits = self.limits - self.contents.used[self.base].sum(axis=0)
            found = self._halves(varying)
            assert found is not None  # so few vary
        self.parts, self.halves = found
        self.fixed = complex(self.contents.weights[self.base] @ self.ways)
        first, second = self.halves
        self._centre = second.sums.mean()
        self._radius = float(np.abs(second.sums - self._centre).max())
        self._grids: dict[int, tuple[IntArray, FloatArray, float, complex, float]] = {}
        spread = float(np.var(first.sums) + np.var(second.sums))
        number = float(len(first.sums)) * float(len(second.sums))
        self.spacing = float(np.sqrt(np.pi * max(spread, (0.1 * self.reach) ** 2) / number))

    def _halves(self, varying: IndexArray) -> tuple[list[IndexArray], tuple[_Half, _Half]] | None:
        """Both halves of some holes, and which holes these are; None: too many sums."""

        def listed(part: IndexArray) -> _Half | None:
            return _listed(self.ways[part], self.contents, self.limits, self.longest)

        turned = np.mod(np.angle(self.ways[varying]) + 1e-7, np.pi / 3)
        order = varying[np.argsort(np.round(turned, 5), kind="stable")]
        middle = (len(order) + 1) // 2
        parts = [order[:middle], order[middle:]]
        first = listed(parts[0])
        second = None if first is None else listed(parts[1])
        if first is None or second is None:
            return None
        return parts, (_sorted(first), second)

    def _fix(self, z: complex) -> IndexArray:
        """Which holes vary; the others hold what is nearest to the continuous answer within the limits."""
        contents, count = self.contents, len(self.where)
        amounts = self._relaxed(nearest_allowed(z, self.mounted, self.max_weight))[1]
        # partly filled holes vary, then holes evenly around the disc
        unsettled = np.argsort(-np.minimum(amounts, contents.weights.max() - amounts), kind="stable")[:2]
        around = [k for step in (8, 4, 2, 1) for k in range(0, count, step)]
        order = list(dict.fromkeys([*unsettled.tolist(), *around]))
        number = 2 * max(1, int(np.log(self.longest / 4) / np.log(len(contents.weights))))
        used = np.zeros(len(contents.limits), dtype=np.int64)
        for k in sorted(order[number:], key=lambda k: -amounts[k]):
            fits = np.flatnonzero((used + contents.used <= contents.limits).all(axis=1))
            self.base[k] = fits[np.argmin(np.abs(contents.weights[fits] - amounts[k]))]
            used += contents.used[self.base[k]]
        return np.array(order[:number])

    def _relaxed(self, z: complex) -> tuple[float, FloatArray]:
        """Distance of a point from free amounts up to each hole's largest content, and these amounts."""
        from scipy.optimize import lsq_linear

        most = float(self.contents.weights.max())
        rows = np.vstack((self.ways.real, self.ways.imag))
        found = lsq_linear(rows, [z.real / most, z.imag / most], bounds=(0.0, 1.0), method="bvls")
        return float(abs(found.x @ self.ways * most - z)), found.x * most

    def bound(self, z: complex) -> float:
        """No vector is nearer to z than this, also of those that were left out."""
        aside = abs(nearest_allowed(z, self.mounted, self.max_weight) - z)
        return max(self._relaxed(z)[0] - SAME * self.reach, apart(self, z), aside)

    def near(
        self, z: complex, low: float, high: float, most: int, *, fitting: bool = False
    ) -> tuple[ComplexArray, IntArray] | None:
        """See `Attainable`."""
        first, second = self.halves
        middle, radius = lens(z, high, -self.mounted, self.max_weight * (1 + 1e-9))
        along = np.conj(z) / (abs(z) or 1.0)  # vectors near z are as far out as |z| − high
        ahead = (along * (first.sums + self.fixed)).real + float((along * second.sums).real.max())
        close = np.abs(middle - self.fixed - first.sums - self._centre) <= self._radius + radius
        rows = np.flatnonzero(close & (ahead >= (abs(z) - high) * (1 - 1e-12)))
        to, reach = middle - self.fixed - first.sums[rows], np.full(len(rows), float(radius))
        if radius > _WIDE * self._radius:
            to, reach = lens(to, float(radius), self._centre, self._radius)
        pairs = self._fitting(rows, to, reach, most) if fitting else self._pairs(rows, to, reach, most)
        if pairs is None:
            return None
        i, j = pairs
        d = first.sums[i] + second.sums[j] + self.fixed
        distance = np.abs(d - z)
        good = (
            (distance > low) & (distance <= high) & (np.abs(d + self.mounted) <= self.max_weight * (1 + 1e-9))
        )
        good &= (first.used[i] + second.used[j] <= self.limits).all(axis=1)
        i, j, d, distance = i[good], j[good], d[good], distance[good]
        one = distinct(first.cost[i] + second.cost[j], places(d, self.reach * SAME))
        one = one[np.argsort(distance[one], kind="stable")]
        return d[one], np.column_stack((i[one], j[one], np.zeros(len(one), dtype=np.int64)))

    def _pairs(
        self,
        rows: IndexArray,
        to: ComplexArray,
        reach: FloatArray,
        most: int,
        partners: BoolArray | None = None,
    ) -> tuple[IndexArray, IndexArray] | None:
        """Rows of the first half with those of the second (`partners` alone) that may be within reach."""
        start, count, order = self._lines(to, reach, partners)
        total = int(count.sum())
        if total > most:
            return None
        there = np.arange(total) - np.repeat(np.cumsum(count) - count, count) + np.repeat(start, count)
        return np.repeat(np.tile(rows, 3), count), order[there]

    def _fitting(
        self, rows: IndexArray, to: ComplexArray, reach: FloatArray, most: int
    ) -> tuple[IndexArray, IndexArray] | None:
        """The same, of pairs alone that are within the limits together."""
        first, second = self.halves
        i, j = [], []
        kinds, which = np.unique(first.used[rows], axis=0, return_inverse=True)
        for n, used in enumerate(kinds):
            own = which.ravel() == n
            partners = (used + second.used <= self.limits).all(axis=1)
            pairs = self._pairs(rows[own], to[own], reach[own], most, partners)
            if pairs is None:
                return None
            i.append(pairs[0])
            j.append(pairs[1])
            most -= len(pairs[0])
        none = np.zeros(0, dtype=np.intp)
        return np.concatenate([none, *i]), np.concatenate([none, *j])

    def _lines(
        self, z: ComplexArray, radius: FloatArray, partners: BoolArray | None = None
    ) -> tuple[IntArray, IntArray, IntArray]:
        """Where, and how many, sums of the second half may be within a radius of points, on three lines each.

        They are sorted by lines of a height h ≥ radius and by their real part within them; `order` is that.
        `partners` (n,): only these sums.
        """
        order, keys, h, origin, width = self._grid(float(radius.max(initial=0.0)))
        z = z - origin
        pad = 1e-14 * (abs(keys[-1]) + width)
        if partners is not None:
            order, keys = order[partners[order]], keys[partners[order]]
        lowest = np.floor((z.imag - radius) / h)
        starts, counts = [], []
        x0 = np.clip(z.real - radius - pad, -pad, width)
        x1 = np.clip(z.real + radius + pad, -pad, width + pad)
        for line in (lowest, lowest + 1, lowest + 2):
            start = np.searchsorted(keys, line * 2 * width + x0, side="left")
            end = np.searchsorted(keys, line * 2 * width + x1, side="right")
            starts.append(start)
            counts.append(np.where(line * h <= z.imag + radius, end - start, 0))
        return np.concatenate(starts), np.concatenate(counts), order

    def _grid(self, radius: float) -> tuple[IntArray, FloatArray, float, complex, float]:
        """The second half sorted by rows of height h ≥ radius and by its real part within them."""
        sums = self.halves[1].sums
        origin = complex(sums.real.min(), sums.imag.min())
        width, tall = (max(float(np.ptp(part)), 1e-6 * self.reach) for part in (sums.real, sums.imag))
        h0 = tall / 2**16
        level = int(np.ceil(np.log2(max(radius / h0, 1.0))))
        if level not in self._grids:
            h = h0 * 2.0**level
            keys = np.floor((sums.imag - origin.imag) / h) * 2 * width + sums.real - origin.real
            order = np.argsort(keys, kind="stable")
            self._grids[level] = order, keys[order], h, origin, width
        return self._grids[level]

    def few(self, pieces: int) -> PieceSums:
        """See `Attainable`."""
        few = PieceSums(self.holes, self.usable, self.max_weight, max(pieces, 1), self.longest)
        few.aim(self._aimed)
        return min(
            (self, few), key=lambda one: (not one.complete, sum(len(half.sums) for half in one.halves))
        )

    def pieces(self, keys: IntArray) -> IntArray:
        """See `Attainable`."""
        first, second = self.halves
        there = self.contents.cost[self.base].sum()
        cost = first.cost[keys[:, 0]] + second.cost[keys[:, 1]] + there
        return np.asarray(np.floor(cost + SAME), dtype=np.int64)

    def lowest(self, g: complex) -> float:
        """See `Attainable`."""
        # the heaviest pieces stand where they reach farthest
        ahead = np.sort(np.maximum(-(np.conj(g) * self.ways).real, 0.0))[::-1]
        farthest = float(np.repeat(ahead, self.holes.per_hole)[: len(self._heaviest)] @ self._heaviest)
        return max(-farthest, disc_lowest(g, self.max_weight, self.holes.mounted))

    def normals(self) -> ComplexArray:
        """See `Attainable`."""
        return np.asarray(DIRECTIONS)

    def mount(self, key: IntArray) -> Mounting:
        """See `Attainable`."""
        picks = self.base.copy()
        for part, half, row in zip(self.parts, self.halves, key[:2], strict=True):
            picks[part] = half.picks[row]
        counts = np.zeros((len(self.holes.angles), len(self.holes.pieces)), dtype=np.int64)
        counts[self.where] = self.contents.counts[picks]
        return mounting(self.holes, counts)


def _heaviest(holes: Holes, count: int, most_pieces: int | None) -> FloatArray:
    """The heaviest pieces that can stand in so many holes together, heaviest first."""
    capacity = count * holes.per_hole
    available = np.full(len(holes.pieces), capacity) if holes.stock is None else holes.stock
    pieces = np.repeat(holes.pieces, np.minimum(available, capacity))
    return np.asarray(np.sort(pieces)[::-1][: min(capacity, most_pieces or capacity)])


def _contents(holes: Holes, count: int, most_pieces: int | None, reach: float) -> _Contents:
    """What one of so many holes can hold; where nothing is limited, of equal weights the fewest pieces."""
    K, capacity = len(holes.pieces), holes.per_hole * count
    most = capacity if most_pieces is None else most_pieces
    top = min(holes.per_hole, most)
    if comb(K + top, K) > _MOST_CONTENTS:
        raise ValueError(
            f"{holes.per_hole} pieces of {K} sizes in one hole make too many combinations: allow fewer in "
            "one hole, or free amounts with a step"
        )
    counts = np.zeros((1, 0), dtype=np.int64)
    for _ in range(K):
        counts = np.column_stack(
            (np.repeat(counts, top + 1, axis=0), np.tile(np.arange(top + 1), len(counts)))
        )
        counts = counts[counts.sum(axis=1) <= top]
    stock = np.full(K, capacity) if holes.stock is None else holes.stock
    scarce = stock < capacity
    used, limits = counts[:, scarce], stock[scarce]
    if most < capacity:
        used, limits = np.column_stack((used, counts.sum(axis=1))), np.append(limits, most)
    fits = (used <= limits).all(axis=1)
    counts, used = counts[fits], used[fits]
    weights = counts @ holes.pieces
    cost = counts.sum(axis=1) + weights / (2 * reach)
    kept = distinct(cost, [np.rint(weights / (reach * SAME)).astype(np.int64), *used.T])
    kept = kept[np.argsort(cost[kept], kind="stable")]
    return _Contents(counts[kept], weights[kept], cost[kept], used[kept], limits)


def _listed(ways: ComplexArray, contents: _Contents, limits: IntArray, most: int) -> _Half | None:
    """All sums of holes in these directions, within the limits; None: more than `most`."""
    m, quantum = len(contents.weights), SAME * (len(ways) or 1) * float(contents.weights.max())
    half = _Half(np.zeros(1, dtype=complex), np.zeros(1), contents.used[:1], np.zeros((1, 0), dtype=np.int16))
    for way in ways:
        n = len(half.sums)
        if n * m > _RAW * most:
            return None
        row, pick = np.repeat(np.arange(n), m), np.tile(np.arange(m), n)
        fits = np.flatnonzero((half.used[row] + contents.used[pick] <= limits).all(axis=1))
        row, pick = row[fits], pick[fits]
        used = half.used[row] + contents.used[pick]
        sums = half.sums[row] + contents.weights[pick] * way
        cost = half.cost[row] + contents.cost[pick]
        kept = distinct(cost, [*places(sums, quantum), *used.T])
        if len(kept) > most:
            return None
        picks = np.column_stack((half.picks[row[kept]], pick[kept].astype(np.int16)))
        half = _Half(sums[kept], cost[kept], used[kept], picks)
    return half


def _sorted(half: _Half) -> _Half:
    """By the imaginary part: neighbours are looked up one after the other."""
    n = np.argsort(-half.sums.imag)
    return _Half(half.sums[n], half.cost[n], half.used[n], half.picks[n])
