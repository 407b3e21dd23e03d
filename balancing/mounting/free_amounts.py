"""Vectors that free amounts make in one hole of a plane or in two neighbouring ones, of any size or in steps.

In neighbouring holes less than half a turn apart, amounts a e^{iα} + b e^{iβ}, a, b ≥ 0, fill the sector
between them; with a step they are a lattice in it.
"""

from __future__ import annotations

import numpy as np

from balancing.mounting.holes import WIDEST, Holes, Mounting, mounting
from balancing.mounting.mountable_vectors import (
    DIRECTIONS,
    NOTHING,
    SAME,
    disc_lowest,
    distinct,
    lens,
    nearest_allowed,
    places,
)
from rotorid.base.arrays import BoolArray, ComplexArray, FloatArray, IntArray

__all__ = ["FreeAmounts"]

_ROUNDING = 1e-12


class FreeAmounts:
    """Free amounts in one hole or two neighbouring ones; with a step an `Attainable` set.

    Parameters
    ----------
    holes
        Positions.
    usable
        Which holes can be used, shape (H,).
    max_weight
        Largest |mounted + d|.
    reach
        No vector larger than this is needed; where no step is given, 1e-4 of it is one.
    """

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
        close = (after <= WIDEST) & (len(where) > 1)
        self.pairs = np.column_stack((where, np.where(close, np.roll(where, -1), -1)))
        self.directions = np.exp(1j * holes.angles[where])

    @property
    def surround(self) -> bool:
        """Whether any vector can be made of any amounts: no two neighbours are too far apart."""
        return bool((self.pairs >= 0).all())

    def aim(self, z: complex) -> None:
        """See `Attainable`; nothing needs to be listed."""

    def near(
        self, z: complex, low: float, high: float, most: int, *, fitting: bool = False
    ) -> tuple[ComplexArray, IntArray] | None:
        """See `Attainable`."""
        middle, radius = lens(z, high, -self.mounted, self.max_weight * (1 + 1e-9))
        inner = low if middle == z else -1.0
        found, keys, total = [], [], 0.0
        for n, (p, q) in enumerate(self.pairs):
            e = np.exp(1j * self.holes.angles[p]) * self.step
            f = np.exp(1j * self.holes.angles[q]) * self.step if q >= 0 else 1j * e
            sine = (np.conj(e) * f).imag / abs(e)
            at = (np.conj(middle) * f).imag / (np.conj(e) * f).imag
            a0, a1 = max(0, np.ceil(at - radius / sine)), np.floor(at + radius / sine)
            if a1 - a0 > most:
                return None
            a = np.arange(a0, a1 + 1)
            b, count, row = _chords(a * e, f, complex(middle), inner, float(radius), most if q >= 0 else 0)
            total += count
            if total > most:
                return None
            found.append(a[row] * e + b * f)
            keys.append(np.column_stack((np.full(len(b), n), a[row], b)).astype(np.int64))
        d, key = np.concatenate(found), np.concatenate(keys)
        distance = np.abs(d - z)
        good = (
            (distance > low) & (distance <= high) & (np.abs(d + self.mounted) <= self.max_weight * (1 + 1e-9))
        )
        d, key, distance = d[good], key[good], distance[good]
        quantum = max(1e-7 * self.step, SAME * float(np.abs(d).max(initial=0.0)))
        one = distinct((key[:, 1:] > 0).sum(axis=1), places(d, quantum))
        one = one[np.argsort(distance[one], kind="stable")]
        return d[one], key[one]

    def few(self, pieces: int) -> FreeAmounts:
        """See `Attainable`."""
        return self

    def pieces(self, keys: IntArray) -> IntArray:
        """See `Attainable`."""
        return np.zeros(len(keys), dtype=np.int64)

    def lowest(self, g: complex) -> float:
        """See `Attainable`."""
        along = (np.conj(g) * self.directions).real
        cone = 0.0 if along.min() >= 0 else -abs(g) * self.reach
        return max(cone, disc_lowest(g, self.max_weight, self.holes.mounted))

    def normals(self) -> ComplexArray:
        """See `Attainable`."""
        edges = () if self.surround else np.concatenate((1j * self.directions, -1j * self.directions))
        return np.concatenate((DIRECTIONS, edges))

    def mount(self, key: IntArray) -> Mounting:
        """See `Attainable`."""
        amounts = np.zeros(len(self.holes.angles))
        for hole, number in zip(self.pairs[key[0]], key[1:], strict=True):
            amounts[hole] += number * self.step if hole >= 0 else 0.0
        return mounting(self.holes, amounts=amounts)

    def place(self, d: complex) -> Mounting | None:
        """Any amounts whose vector is d; None: it does not lie between two neighbours."""
        amounts = np.zeros(len(self.holes.angles))
        for p, q in self.pairs[self.pairs[:, 1] >= 0]:
            alpha, beta = self.holes.angles[[p, q]]
            across = np.array([-(d * np.exp(-1j * beta)).imag, (d * np.exp(-1j * alpha)).imag])
            both = across / np.sin(beta - alpha)
            both[np.abs(both) <= _ROUNDING * abs(d)] = 0.0
            if (both >= 0).all():
                amounts[[p, q]] = both
                return mounting(self.holes, amounts=amounts)
        return None

    def place_nearest(self, z: complex) -> Mounting:
        """Any amounts whose vector is the nearest to z within the largest weight.

        Between two neighbours it is the nearest vector of the plane's disc, otherwise it stands in one hole:
        the amounts a there with |m + a e| ≤ R, m what is mounted, are an interval, from a quadratic equation.

        Raises
        ------
        ValueError
            Where nothing is within the largest weight.
        """
        whole = self.place(nearest_allowed(z, self.mounted, self.max_weight))
        if whole is not None:
            return whole
        m = self.mounted * np.conj(self.directions)
        inside = (self.max_weight * (1 + _ROUNDING)) ** 2 - m.imag**2
        root = np.sqrt(np.maximum(inside, 0.0))
        low, high = np.maximum(-m.real - root, 0.0), -m.real + root
        amount = np.clip((z * np.conj(self.directions)).real, low, np.maximum(low, high))
        error = np.where((inside >= 0) & (high >= low), np.abs(amount * self.directions - z), np.inf)
        best = int(np.argmin(error))
        if np.isinf(error[best]):
            raise ValueError(NOTHING)
        amounts = np.zeros(len(self.holes.angles))
        amounts[self.pairs[best, 0]] = amount[best]
        return mounting(self.holes, amounts=amounts)


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
