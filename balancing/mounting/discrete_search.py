"""Branch and bound over planes for the joint discrete problem (sphere decoding).

The form q (`balancing.mounting.discrete_bounds.Form`) is triangular: with the planes of the last columns
fixed, the next one adds |R_kk|² |D_k − c_k|² and its linear term, and the planes before it at least their m.
So only vectors in a disc around a known point can lead to something better than what is known; they are
looked up in rings around it, nearest first, and the disc shrinks with every better mounting. What time leaves
unexplored is known by its bounds.
"""

from __future__ import annotations

import time
from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np

from balancing.mounting.discrete_bounds import Form
from balancing.mounting.mountable_vectors import MOST, Attainable, apart, nearest
from rotorid.base.arrays import ComplexArray, FloatArray, IntArray

__all__ = ["Found", "Squares", "polish", "rounded", "search"]

Squares = Callable[[ComplexArray, FloatArray, float], FloatArray]
"""Squared objectives (M,) of vectors (M, P), given lower bounds (M,) and the best known square."""

_FIRST = 24.0
_ROUNDING = 1e-9
_NEAR = 400
_NEAR_PAIRS = 40


@dataclass(eq=False)
class Found:
    """Best vectors so far: squared objective, vectors (P,) and keys (P, 3) in the order of the planes."""

    square: float
    D: ComplexArray
    keys: IntArray


def rounded(sets: Sequence[Attainable], squares: Squares, D: ComplexArray) -> Found:
    """Every plane by itself: the nearest vectors that can be mounted."""
    picks = [nearest(s, complex(z)) for s, z in zip(sets, D, strict=True)]
    near = np.array([vectors[0] for vectors, _ in picks])
    square = float(squares(near[None], np.zeros(1), np.inf)[0])
    return Found(square, near, np.array([keys[0] for _, keys in picks]))


def polish(sets: Sequence[Attainable], squares: Squares, best: Found, until: float) -> None:
    """Improve a mounting by exchanging vectors of one plane, and of two planes, for near ones."""
    P, gain = len(sets), True
    while gain and time.perf_counter() < until:
        before = best.square
        around = [_around(one, d, _NEAR) for one, d in zip(sets, best.D, strict=True)]
        for p in range(P):
            for q in range(p, P):
                if time.perf_counter() > until:
                    return
                own, other = around[p], around[q]
                if p == q:
                    i, j = np.arange(len(own[0])), np.arange(len(own[0]))
                else:
                    i, j = (
                        m.ravel() for m in np.indices([min(len(x[0]), _NEAR_PAIRS) for x in (own, other)])
                    )
                D = np.repeat(best.D[None], len(i), axis=0)
                D[:, p], D[:, q] = own[0][i], other[0][j]
                found = squares(D, np.zeros(len(i)), best.square)
                n = int(np.argmin(found))
                if found[n] < best.square:
                    best.square, best.D = float(found[n]), D[n]
                    best.keys[p], best.keys[q] = own[1][i[n]], other[1][j[n]]
        gain = best.square < before * (1 - _ROUNDING)


def _around(one: Attainable, z: complex, count: int) -> tuple[ComplexArray, IntArray]:
    """About `count` vectors near z."""
    radius = one.spacing * float(np.sqrt(count / np.pi))
    for _ in range(60):
        hit = one.near(z, -1.0, radius, MOST)
        if hit is None:
            radius /= 2
        elif len(hit[0]) < count / 8 and radius < 4 * one.reach:
            radius *= 1.5
        else:
            return hit[0][:count], hit[1][:count]
    return np.zeros(0, dtype=complex), np.zeros((0, 3), dtype=np.int64)


def search(
    form: Form,
    sets: Sequence[Attainable],
    squares: Squares,
    start: Found,
    until: float,
    chunk: int = 4096,
    pieces: int = 1 << 30,
) -> float:
    """Improve `start` until nothing better can exist, or the time (`time.perf_counter`) is `until`.

    Parameters
    ----------
    form
        Lower bound of the squared objective.
    sets
        Attainable vectors of each plane, in the order of the planes.
    squares
        Squared objectives; infinite where a limit is broken.
    start
        Best mounting known; its square may be infinite.
    until
        When to stop.
    chunk
        How many objectives are asked for at a time.
    pieces
        Of all planes together, at most.

    Returns
    -------
    The lowest bound of what was not looked at, infinite if nothing was left out.
    """
    run = _Run(form, sets, squares, start, until, chunk)
    return run.descend(len(form.order) - 1, np.zeros(len(form.order), dtype=complex), form.bound, pieces)


class _Run:
    def __init__(
        self, form: Form, sets: Sequence[Attainable], squares: Squares, best: Found, until: float, chunk: int
    ) -> None:
        self.chunk = chunk
        self.form, self.squares, self.best, self.until = form, squares, best, until
        self.sets = [sets[p] for p in form.order]
        self.size = np.abs(np.diagonal(form.R)) ** 2
        self.keys = np.zeros((len(form.order), 3), dtype=np.int64)
        self.back = np.argsort(form.order)

    @property
    def target(self) -> float:
        """Squares from here on are no gain."""
        return self.best.square * (1 - _ROUNDING)

    def descend(self, k: int, D: ComplexArray, bound: float, pieces: int) -> float:
        """Look at everything below a node with planes k+1 … fixed; lowest bound of what was left out.

        `bound` counts the planes fixed exactly and m of the others; so many `pieces` are left for these.
        """
        c, size, shift = self._centre(k, D)
        # |R|²|d − c|² + linear(d) = |R|²|d − z|² + shift
        base = bound - self.form.m[k] + shift
        everything = 2 * self.sets[k].reach + abs(c)
        low, left = apart(self.sets[k], c), np.inf
        known = max(low, 0.0) + self.sets[k].spacing * float(np.sqrt(_FIRST))
        while True:
            needed = everything
            if np.isfinite(self.best.square):
                room = self.target - base
                if room < 0:
                    return left
                if size > 0:
                    needed = min(everything, float(np.sqrt(room / size)))
            if low >= needed:
                return left
            inner = max(low, 0.0)
            if time.perf_counter() > self.until:
                return min(left, float(max(bound, base + size * inner**2)))
            radius = min(max(known, 1e-9 * everything), needed)
            hit = self.sets[k].near(c, low, radius, MOST)
            if hit is None:
                thinner = inner + (radius - inner) / 4
                if thinner - inner < 1e-9 * everything or not thinner < radius:
                    return min(left, float(max(bound, base + size * inner**2)))
                known = thinner
                continue
            left = min(left, self._ring(k, D, c, base, size, hit, pieces))
            low = radius
            count = len(hit[0])
            known = inner + (radius - inner) * (2.0 if count < 200 else 1.3) if inner else radius * 2
            known = max(known, radius * 1.05)

    def _centre(self, k: int, D: ComplexArray) -> tuple[complex, float, float]:
        f, size = self.form, float(self.size[k])
        if size <= 1e-24 * float(self.size.max()):
            # nothing is known about this plane: no quadratic term; its linear one is ≥ m
            return 0j, 0.0, float(f.m[k])
        c = f.D0[k] - f.R[k, k + 1 :] @ (D[k + 1 :] - f.D0[k + 1 :]) / f.R[k, k]
        g = f.g[k]
        z = c - g / (2 * size)
        shift = -(abs(g) ** 2) / (4 * size) + float((np.conj(g) * (c - f.D0[k])).real)
        return complex(z), size, float(shift)

    def _ring(
        self,
        k: int,
        D: ComplexArray,
        z: complex,
        base: float,
        size: float,
        hit: tuple[ComplexArray, IntArray],
        pieces: int,
    ) -> float:
        """Look below the vectors of one ring, nearest first."""
        rest = pieces - self.sets[k].pieces(hit[1])
        points, keys, rest = hit[0][rest >= 0], hit[1][rest >= 0], rest[rest >= 0]
        bounds = np.maximum(base + size * np.abs(points - z) ** 2, 0.0)
        if not k:
            for first in range(0, len(points), self.chunk):
                if first and time.perf_counter() > self.until:
                    return float(bounds[first])
                part = slice(first, first + self.chunk)
                self._leaves(D, points[part], keys[part], bounds[part])
            return np.inf
        left = np.inf
        for n, (point, key, bound) in enumerate(zip(points, keys, bounds, strict=True)):
            if bound > self.target:
                break  # the others are further away
            if n and time.perf_counter() > self.until:
                return min(left, float(bound))
            D[k], self.keys[k] = point, key
            left = min(left, self.descend(k - 1, D, float(bound), int(rest[n])))
        return left

    def _leaves(self, D: ComplexArray, points: ComplexArray, keys: IntArray, bounds: FloatArray) -> None:
        good = bounds <= self.target
        if not good.any():
            return
        points, keys, bounds = points[good], keys[good], bounds[good]
        vectors = np.repeat(D[None], len(points), axis=0)
        vectors[:, 0] = points
        squares = self.squares(vectors[:, self.back], bounds, self.best.square)
        n = int(np.argmin(squares))
        if squares[n] < self.best.square:
            self.keys[0] = keys[n]
            self.best.square = float(squares[n])
            self.best.D, self.best.keys = vectors[n, self.back], self.keys[self.back].copy()
