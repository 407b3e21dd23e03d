"""Pieces in holes: the vector nearest to a target, by meeting in the middle.

The free holes, in order of their angle, are dealt alternately to two halves (regular holes then repeat the
same sums most often). `_listed` makes all sums of a half, hole by hole; sums that are equal and use the same
are kept once, with the fewest pieces. What is limited (a stock, the number of pieces) is counted along, and
only partners that fit together are joined.

Where the plane's total is limited and the target lies outside, the nearest allowed vector is looked for
around c, the point of the disc nearest to the target: with an allowed vector at the distance d of the target,
every better one lies in the lens of |v − T| ≤ d and the disc, whose corner is its point farthest from c.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from itertools import product
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from balancing.mounting.holes import Holes
from balancing.mounting.split_amounts import nearest_allowed
from rotorid.base.arrays import ComplexArray, FloatArray, IndexArray, IntArray

if TYPE_CHECKING:
    from scipy.spatial import KDTree


MOST_SUMS = 600_000
"""Of one half."""
_MOST_PAIRS = 2_000_000
_TIE = 1e-10
_EQUAL = 1e-11
_MIX = np.int64(6364136223846793005)
_FULL = 150_000
"""Sums of one half where not all holes can vary; a tenth where a stock makes it slower."""


@dataclass(frozen=True, eq=False)
class Half:
    """Sums (n,) of some holes, number of pieces (n,), what is used of each limit (n, r), counts (n, H, K)."""

    sums: ComplexArray
    pieces: IntArray
    used: IntArray
    counts: NDArray[np.int16]


@dataclass(frozen=True, eq=False)
class _Group:
    """Sums of one half, as points of the plane, and the tree of those of the other that fit them."""

    ours: IndexArray
    points: FloatArray
    theirs: IndexArray
    tree: KDTree


@dataclass(frozen=True, eq=False)
class _Task:
    """What is wanted; contents of a hole (m, K), what they use of each limit (m, r), limits (r,)."""

    target: complex
    holes: Holes
    options: IntArray
    used: IntArray
    limits: IntArray
    scale: float


def nearest_pieces(target: complex, holes: Holes, most_pieces: int | None) -> tuple[IntArray, float]:
    """Counts (H, K) of the nearest vector, and a lower bound of the distance of all others.

    Raises
    ------
    ValueError
        Where nothing is admissible, not even to mount nothing.
    """
    K, free = len(holes.pieces), np.flatnonzero(holes.free)
    options = _options(K, holes.per_hole, holes.stock, most_pieces)
    capacity = holes.per_hole * len(free)
    rows, limits = [], []
    if holes.stock is not None:
        for k in np.flatnonzero(holes.stock < capacity):
            rows.append(options[:, k])
            limits.append(int(holes.stock[k]))
    if most_pieces is not None and most_pieces < capacity:
        rows.append(options.sum(axis=1))
        limits.append(most_pieces)
    if not rows:
        options = _shortest(options, holes.pieces)
    used = (
        np.array(rows, dtype=np.int64).reshape(len(rows), -1).T if rows else np.zeros((len(options), 0), int)
    )
    scale = max(abs(target), float((options @ holes.pieces).max()))
    task = _Task(target, holes, options, used, np.array(limits, dtype=np.int64), scale)
    order = free[np.argsort(np.mod(holes.angles[free], 2 * np.pi), kind="stable")]
    first, second = (_listed(task, order[start::2], MOST_SUMS) for start in (0, 1))
    if first is not None and second is not None:
        found = _nearest_pair(task, first, second)
        if found is None:
            raise ValueError(
                "no admissible weight at all: what is mounted already exceeds the largest weight of the "
                "plane, and nothing that fits these holes makes it small enough"
            )
        counts, complete = found
        return counts, np.inf if complete else _bound(task, free)
    return _restricted(task, free)


def _options(K: int, per_hole: int, stock: IntArray | None, most: int | None) -> IntArray:
    """What one hole can hold: counts (m, K) with at most `per_hole` pieces, nothing first."""
    top = min(per_hole, per_hole if most is None else most)
    ends = [top if stock is None else min(top, int(stock[k])) for k in range(K)]
    size = float(np.prod([e + 1.0 for e in ends]))
    if size > 1e5:
        raise ValueError(
            f"{per_hole} pieces of {K} sizes in one hole make too many combinations: allow fewer in one "
            "hole, or free amounts with a step"
        )
    rows = [row for row in product(*(range(e + 1) for e in ends)) if sum(row) <= top]
    rows.sort(key=sum)
    return np.array(rows, dtype=np.int64).reshape(-1, K)


def _shortest(options: IntArray, pieces: FloatArray) -> IntArray:
    """Of contents of equal weight only the one with the fewest pieces (the first)."""
    weight = np.round((options @ pieces) / (pieces.max() * _EQUAL))
    return np.asarray(options[np.sort(np.unique(weight, return_index=True)[1])])


def _listed(task: _Task, where: IndexArray, most: int, base: IntArray | None = None) -> Half | None:
    """All sums of the holes `where`, on top of counts `base` (H, K); None: more than `most`."""
    H, K = len(task.holes.angles), len(task.holes.pieces)
    m = len(task.options)
    start = np.zeros((1, H, K), dtype=np.int16) if base is None else base[None].astype(np.int16)
    weights = task.options @ task.holes.pieces
    fixed = start[0] @ task.holes.pieces
    half = Half(
        np.array([fixed @ np.exp(1j * task.holes.angles)], dtype=complex),
        np.array([int(start.sum())]),
        _use(task, start[0])[None],
        start,
    )
    for h in where:
        n = len(half.sums)
        if n * m > 12 * most:
            return None
        sums = (half.sums[:, None] + weights * np.exp(1j * task.holes.angles[h])).ravel()
        pieces = (half.pieces[:, None] + task.options.sum(axis=1)).ravel()
        used = (half.used[:, None] + task.used).reshape(n * m, -1)
        fits = np.flatnonzero((used <= task.limits).all(axis=1))
        keep = fits[_different(sums[fits], pieces[fits], used[fits], task.scale * _EQUAL)]
        if len(keep) > most:
            return None
        counts = half.counts[keep // m]
        counts[:, h] = task.options[keep % m]
        half = Half(sums[keep], pieces[keep], used[keep], counts)
    return half


def _use(task: _Task, counts: NDArray[np.int16]) -> IntArray:
    """What counts (H, K) use of each limit, (r,)."""
    total = np.zeros(len(task.limits), dtype=np.int64)
    for row in counts:
        if row.any():
            total += task.used[np.flatnonzero((task.options == row).all(axis=1))[0]]
    return total


def _different(sums: ComplexArray, pieces: IntArray, used: IntArray, step: float) -> IndexArray:
    """Indices of sums that differ or use something else, each with the fewest pieces."""
    keys = [np.round(z / step).astype(np.int64) for z in (sums.real, sums.imag)] + [*used.T]
    # a hash makes equal sums neighbours, which is quicker than to sort by all keys; it decides nothing else
    mixed = np.zeros(len(sums), dtype=np.int64)
    for key in keys:
        mixed = (mixed ^ key) * _MIX
    order = np.argsort(pieces.astype(np.int16), kind="stable")
    order = order[np.argsort(mixed[order], kind="stable")]
    new = np.ones(len(order), dtype=bool)
    new[1:] = np.any([key[order][1:] != key[order][:-1] for key in keys], axis=0)
    return np.asarray(order[new])


def _nearest_pair(task: _Task, a: Half, b: Half) -> tuple[IntArray, bool] | None:
    """Counts of the nearest sum of two, and whether nothing was left out; None where none is allowed."""
    centre = nearest_allowed(task.target, task.holes)
    aside = abs(centre - task.target)
    groups = list(_groups(task, a, b))
    there = np.array([centre.real, centre.imag])
    near = [np.asarray(group.tree.query(there - group.points)[0]) for group in groups]
    radius = min(float(d.min()) for d in near)
    reach = 2 * (np.abs(a.sums).max() + np.abs(b.sums).max() + abs(centre))
    slack, complete = task.scale * _TIE, True
    while True:
        ours, theirs, whole = _pairs(groups, near, there, radius + slack)
        complete &= whole
        vectors = a.sums[ours] + b.sums[theirs]
        allowed = task.holes.allows(vectors)
        if allowed.any():
            d = float(np.abs(vectors[allowed] - task.target).min())
            lens = _lens(task, d) if aside > slack else d
            if lens <= radius + slack or not whole:
                break
            radius = lens
        elif radius > reach or not whole:
            return None
        else:
            radius = max(2 * radius, 1e-6 * task.scale)
    ours, theirs, vectors = ours[allowed], theirs[allowed], vectors[allowed]
    error = np.abs(vectors - task.target)
    tied = np.flatnonzero(error <= error.min() + slack)
    # fewest pieces, then the least weight, which stands nearest to the target's direction
    pieces = a.pieces[ours[tied]] + b.pieces[theirs[tied]]
    tied = tied[pieces == pieces.min()][:10_000]
    counts = (a.counts[ours[tied]] + b.counts[theirs[tied]]).astype(np.int64)
    amounts = counts @ task.holes.pieces
    spread = amounts @ np.abs(np.exp(1j * task.holes.angles) - np.exp(1j * np.angle(task.target))) ** 2
    best = np.lexsort((np.round(spread / task.scale, 9), np.round(amounts.sum(axis=1) / task.scale, 9)))[0]
    return counts[best], complete


def _groups(task: _Task, a: Half, b: Half) -> Iterator[_Group]:
    """Parts of both halves that may be joined."""
    from scipy.spatial import KDTree

    trees: dict[tuple[int, ...], tuple[IndexArray, KDTree]] = {}
    kinds, which = np.unique(a.used, axis=0, return_inverse=True)
    most = b.used.max(axis=0, initial=0)
    for g, kind in enumerate(kinds):
        left = tuple(int(v) for v in np.minimum(task.limits - kind, most))
        if left not in trees:
            fits = np.flatnonzero((b.used <= np.array(left, dtype=np.int64)).all(axis=1))
            trees[left] = fits, KDTree(_plane(b.sums[fits]))
        ours = np.flatnonzero(which.ravel() == g)
        yield _Group(ours, _plane(a.sums[ours]), *trees[left])


def _pairs(
    groups: list[_Group], near: list[FloatArray], there: FloatArray, radius: float
) -> tuple[IndexArray, IndexArray, bool]:
    """Indices (n,) of sums of both halves that meet within a radius of a point; whether these are all."""
    ours, theirs, count, whole = [], [], 0, True
    for group, distance in zip(groups, near, strict=True):
        close = np.flatnonzero(distance <= radius)
        close = close[np.argsort(distance[close], kind="stable")]
        number = group.tree.query_ball_point(there - group.points[close], radius, return_length=True)
        fits = int(np.searchsorted(np.cumsum(number), _MOST_PAIRS - count, side="right"))
        whole &= fits == len(close)
        close, number = close[:fits], number[:fits]
        for i, partners in zip(
            close, group.tree.query_ball_point(there - group.points[close], radius), strict=True
        ):
            ours.append(np.full(len(partners), group.ours[i]))
            theirs.append(group.theirs[partners])
        count += int(np.sum(number))
    none = np.zeros(0, dtype=np.intp)
    return np.concatenate([none, *ours]), np.concatenate([none, *theirs]), whole


def _plane(z: ComplexArray) -> FloatArray:
    return np.column_stack((z.real, z.imag))


def _lens(task: _Task, d: float) -> float:
    """Distance from c to the corner of the lens |v − T| ≤ d, |v + mounted| ≤ R."""
    R = task.holes.max_weight * (1 + 1e-9)
    away = abs(task.target + task.holes.mounted)
    x = (R * R - d * d + away * away) / (2 * away)
    if abs(x) >= R:  # one circle inside the other
        return 2 * min(d, R)
    return float(np.hypot(R - x, np.sqrt(R * R - x * x)))


def _bound(task: _Task, free: IndexArray) -> float:
    """No allowed vector is nearer: neither do free amounts come nearer, nor does the disc reach nearer."""
    aside = abs(nearest_allowed(task.target, task.holes) - task.target)
    return max(_relaxed(task, free, task.target)[0] - 1e-9 * task.scale, aside, 0.0)


def _relaxed(task: _Task, free: IndexArray, point: complex) -> tuple[float, FloatArray]:
    """Distance of a point from free amounts up to each hole's largest content, and these (F,)."""
    from scipy.optimize import lsq_linear

    ways = np.exp(1j * task.holes.angles[free])
    most = float((task.options @ task.holes.pieces).max())
    rows = np.vstack((ways.real, ways.imag))
    found = lsq_linear(rows, [point.real / most, point.imag / most], bounds=(0.0, 1.0), method="bvls")
    return float(abs(found.x @ ways * most - point)), found.x * most


def _restricted(task: _Task, free: IndexArray) -> tuple[IntArray, float]:
    """The best where only so many holes as can be listed vary about the rounded continuous answer."""
    amounts = _relaxed(task, free, nearest_allowed(task.target, task.holes))[1]
    weights = task.options @ task.holes.pieces
    most = weights.max()
    # partly filled holes vary, then holes evenly around the disc
    unsettled = np.argsort(-np.minimum(amounts, most - amounts), kind="stable")[:2]
    around = [k for step in (8, 4, 2, 1) for k in range(0, len(free), step)]
    order = list(dict.fromkeys([*unsettled.tolist(), *around]))
    full = _FULL / 10 if len(task.limits) else _FULL
    number = 2 * max(1, int(np.log(full) / np.log(len(task.options))))
    chosen, rest = order[:number], order[number:]
    base = np.zeros((len(task.holes.angles), len(task.holes.pieces)), dtype=np.int64)
    used = np.zeros(len(task.limits), dtype=np.int64)
    for k in sorted(rest, key=lambda k: -amounts[k]):
        fits = np.flatnonzero((used + task.used <= task.limits).all(axis=1))
        best = fits[int(np.argmin(np.abs(weights[fits] - amounts[k])))]
        base[free[k]] = task.options[best]
        used += task.used[best]
    halves = [_listed(task, free[chosen[start::2]], MOST_SUMS, b) for start, b in ((0, base), (1, None))]
    first, second = halves
    assert first is not None  # `number` was chosen so
    assert second is not None
    found = _nearest_pair(task, first, second)
    if found is None:
        raise ValueError(
            "no weight was found that the largest weight of the plane admits: there are too many "
            "combinations; allow fewer pieces or fewer holes"
        )
    return found[0], _bound(task, free)
