"""Vectors that free amounts in steps can make in one plane: a lattice in every pair of neighbouring holes."""

from __future__ import annotations

import numpy as np

from balancing.mounting.discrete_sets import (
    DIRECTIONS,
    LONGEST,
    SAME,
    Attainable,
    PieceSums,
    disc_lowest,
    distinct,
)
from balancing.mounting.holes import WIDEST, Holes, Mounting, mounting
from rotorid.base.arrays import BoolArray, ComplexArray, FloatArray, IntArray

__all__ = ["StepSums", "attainable"]


def attainable(
    holes: Holes, usable: BoolArray, max_weight: float, reach: float, longest: int = LONGEST
) -> Attainable:
    """The set of one plane, of pieces or of free amounts.

    Parameters
    ----------
    holes
        Positions and pieces.
    usable
        Which holes can be used, shape (H,).
    max_weight
        Largest |mounted + d|.
    reach
        Free amounts: no vector larger than this is needed.
    longest
        Pieces: sums of one half of the holes that are listed at most.
    """
    if holes.free_amounts:
        return StepSums(holes, usable, max_weight, reach)
    return PieceSums(holes, usable, max_weight, longest)


class StepSums:
    """Free amounts in steps, in one hole or two neighbouring ones."""

    def __init__(self, holes: Holes, usable: BoolArray, max_weight: float, reach: float) -> None:
        self.holes, self.max_weight, self.mounted = holes, max_weight, holes.mounted
        self.complete = holes.step > 0
        self.reach = min(reach, max_weight + abs(holes.mounted)) * (1 + 1e-9)
        self.step = holes.step or 1e-4 * self.reach
        self.spacing = self.step
        where = np.flatnonzero(usable)
        where = where[np.argsort(np.mod(holes.angles[where], 2 * np.pi))]
        angle = np.mod(holes.angles[where], 2 * np.pi)
        after = np.diff(angle, append=angle[0] + 2 * np.pi)
        pairs: list[tuple[int, int]] = []
        for k, gap in enumerate(after):
            following = int(where[(k + 1) % len(where)])
            close = len(where) > 1 and gap <= WIDEST
            pairs.append((int(where[k]), following if close else -1))
        self.pairs = pairs
        self.directions = np.exp(1j * holes.angles[where])

    def near(self, z: complex, low: float, high: float, most: int) -> tuple[ComplexArray, IntArray] | None:
        """See `Attainable`."""
        found, keys, total = [], [], 0.0
        for n, (p, q) in enumerate(self.pairs):
            e = np.exp(1j * self.holes.angles[p]) * self.step
            f = np.exp(1j * self.holes.angles[q]) * self.step if q >= 0 else 1j * e
            sine = (np.conj(e) * f).imag / abs(e)
            middle = (np.conj(z) * f).imag / (np.conj(e) * f).imag
            a0, a1 = max(0, np.ceil(middle - high / sine)), np.floor(middle + high / sine)
            if a1 - a0 > most:
                return None
            a = np.arange(a0, a1 + 1)
            b, count, row = _chords(a * e, f, z, low, high, most if q >= 0 else 0)
            total += count
            if total > most:
                return None
            found.append(a[row] * e + b * f)
            keys.append(np.column_stack((np.full(len(b), n), a[row], b)).astype(np.int64))
        d, key = np.concatenate(found), np.concatenate(keys)
        distance = np.abs(d - z)
        good = (distance > low) & (distance <= high)
        if np.isfinite(self.max_weight):
            good &= np.abs(d + self.holes.mounted) <= self.max_weight * (1 + 1e-9)
        d, key, distance = d[good], key[good], distance[good]
        one = distinct(d, max(1e-7 * self.step, SAME * float(np.abs(d).max(initial=0.0))))
        one = one[np.argsort(distance[one], kind="stable")]
        return d[one], key[one]

    def lowest(self, g: complex) -> float:
        """See `Attainable`."""
        along = (np.conj(g) * self.directions).real
        cone = 0.0 if along.min() >= 0 else -abs(g) * self.reach
        return max(cone, disc_lowest(g, self.max_weight, self.holes.mounted))

    def _pointed(self) -> bool:
        return any(q < 0 for _, q in self.pairs)

    def normals(self) -> ComplexArray:
        """See `Attainable`."""
        edges = np.concatenate((1j * self.directions, -1j * self.directions)) if self._pointed() else ()
        return np.concatenate((DIRECTIONS, edges))

    def mount(self, key: IntArray) -> Mounting:
        """See `Attainable`."""
        amounts = np.zeros(len(self.holes.angles))
        p, q = self.pairs[int(key[0])]
        amounts[p] += key[1] * self.step
        if q >= 0:
            amounts[q] += key[2] * self.step
        return mounting(self.holes, amounts=amounts)

    def place(self, d: complex) -> Mounting:
        """Any amounts whose vector is d, where neighbours are less than 180° apart all around."""
        amounts = np.zeros(len(self.holes.angles))
        for p, q in self.pairs:
            e, f = np.exp(1j * self.holes.angles[[p, q]])
            area = (np.conj(e) * f).imag
            a, b = (np.conj(d) * f).imag / area, (np.conj(e) * d).imag / area
            if min(a, b) >= -1e-12 * abs(d):
                amounts[p], amounts[q] = max(a, 0.0), max(b, 0.0)
                break
        return mounting(self.holes, amounts=amounts)

    @property
    def surround(self) -> bool:
        """Whether any vector can be made of any amounts."""
        return not self._pointed()


def _chords(
    start: ComplexArray, f: complex, z: complex, low: float, high: float, most: int
) -> tuple[FloatArray, float, IntArray]:
    """Whole b ≥ 0 (0 alone if `most` is 0) with low < |start + b f − z| ≤ high: b, how many, index of start.

    The ends are taken a little too far; none are returned where there are more than `most`.
    """
    u, size = (start - z) * np.conj(f) / abs(f), abs(f)
    outer = np.sqrt(np.maximum(high**2 - u.imag**2, 0.0))
    inner = np.sqrt(np.maximum(max(low, 0.0) ** 2 - u.imag**2, 0.0))
    first = np.ceil(np.concatenate((-u.real - outer, -u.real + inner)) / size - 1e-6)
    last = np.floor(np.concatenate((-u.real - inner, -u.real + outer)) / size + 1e-6)
    half = len(u)
    first[half:] = np.maximum(first[half:], last[:half] + 1)
    first = np.maximum(first, 0.0)
    if not most:
        last = np.minimum(last, 0.0)
    counts = np.maximum(last - first + 1, 0.0).astype(np.int64)
    total = int(counts.sum())
    if total > max(most, 2 * half):
        return np.zeros(0), float(total), np.zeros(0, dtype=np.int64)
    row = np.repeat(np.arange(2 * half), counts)
    b = first[row] + np.arange(total) - np.repeat(np.cumsum(counts) - counts, counts)
    return np.asarray(b), float(total), row % max(half, 1)
