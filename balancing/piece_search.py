"""Pieces in holes: the vectors that one plane can take, and the choice for all planes together.

**One plane.** The vectors Σ_h a_h e^{iφ_h}, a_h what stands in hole h, are sums of two lists, one for each
half of the holes. Pairs near a point come from two trees, so that the nearest vector is exact unless a list
is too long (some thirty holes at odd angles with several sizes of pieces): then those sums stay that come
near their share of the wanted weight and waste little of theirs. A free amount is so many steps in two
neighbouring holes.

**All planes.** Minimise J = sqrt(Σ w_i² |Y_i + W_i D|²) or max w_i |Y_i + W_i D| over what can be mounted,
for every number of pieces. With weights g_i of rows and Q R = sqrt(g) W, Σ g_i |Y_i + W_i D|² is

    const + Σ_k |R_kk|² |D_k − c_k|²,    c_k = −(q_k + Σ_{j>k} R_kj D_j) / R_kk,    q = Qᴴ sqrt(g) Y:

plane after plane, from the last, the vectors nearest to c_k are taken for every number of pieces, and the
best partial choices of every number go on (K-best sphere decoding). For min–max and limits, g are weights
for which least squares is min–max (Lawson's iteration), mixed with equal ones. Of what is left at the end the
best by J is taken. Nothing is proven; 115 drawn jobs whose optimum branch and bound could certify all came
within 1 % of it.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any, Literal, NamedTuple

import numpy as np
from numpy.typing import ArrayLike

from balancing.conditioning import check_stack
from balancing.holes import KEPT, Holes, Mounting, equal_holes, from_list, lightest, mounting
from balancing.trials import Limits
from rotorid.base.arrays import BoolArray, ComplexArray, FloatArray, IndexArray, IntArray
from rotorid.regression import solution

FEW = 1.2
"""So many times the least is good enough for fewer pieces."""
LITTLE = 0.2
"""So large a share of the present vibration, or of a given weight, is good enough for fewer pieces."""
HEAVIER = 1.5
"""So many times the least sum that makes a weight its pieces may weigh together; two pieces may always."""
SPARE = 4
"""So many pieces are tried beyond those that the least sum needs."""
WIDEST = 2 * np.pi / 3 + 1e-6
"""Angle between two holes that share a free amount, at most."""
NOTHING = (
    "no admissible weight at all: what is mounted already exceeds the largest weight of the plane, "
    "and nothing that fits these holes makes it small enough"
)
SAME = 1e-9
"""Vectors are equal within this share of the largest one."""
_LONGEST, _PAIRS, _CONTENTS = 20_000, 1_000_000, 100_000
_LISTED, _BEST, _BRANCHES = 1000, (300, 60), (40, 8)
"""Vectors of a plane for every number; choices of every number that are kept, and branches: last, before."""


class Vectors(NamedTuple):
    """Vectors that can be mounted (n,), the pieces of each (n,), and what stands in every hole (n, H, K)."""

    d: ComplexArray
    number: FloatArray
    put: IntArray


class _Half(NamedTuple):
    """Sums of some holes (n,), their pieces of each size (n, K), and the content of each hole (n, holes)."""

    sums: ComplexArray
    used: FloatArray
    picks: IntArray


class PlaneVectors:
    """Vectors that can be mounted in one plane.

    Parameters
    ----------
    holes
        Positions and pieces.
    wanted
        The weight that is wanted: where not all sums can be listed, those stay that do most for it; free
        amounts without a step are thousandths of it.
    arcs
        First angle and width of arcs in which no hole is used.
    max_weight
        Largest |mounted + d|.
    heavier
        More than two pieces weigh at most so many times the least sum that makes what is wanted; there are at
        most four more than that sum needs.

    Raises
    ------
    ValueError
        Where no hole can be used, and for more ways to fill one than can be listed.
    """

    def __init__(
        self,
        holes: Holes,
        wanted: complex,
        arcs: Sequence[tuple[float, float]] = (),
        max_weight: float = np.inf,
        heavier: float = np.inf,
    ) -> None:
        self.holes, self.wanted, self.max_weight = holes, wanted, max_weight
        self.usable, self.heaviest = holes.outside(arcs), np.inf
        where = np.flatnonzero(self.usable)
        if not len(where):
            raise ValueError("every hole is taken or at a forbidden angle, nothing can be mounted")
        self.toward = np.conj(wanted) / (abs(wanted) or 1.0)
        if holes.free_amounts:
            size = abs(wanted) + 2 * abs(holes.mounted) or 1.0
            self.sizes = np.array([holes.step or 1e-3 * size])
            steps = int(1.2 * size / self.sizes[0]) + 4
            self.most, self.parts = 2 * steps, _neighbours(holes.angles, where)
        else:
            self.sizes, largest = holes.pieces, holes.pieces.max()
            least = float(lightest(holes, self.usable, wanted, holes.per_hole * largest).sum())
            self.heaviest = heavier * (least or 1e-300)
            self.most = int(
                min(
                    holes.per_hole * len(where),
                    np.ceil(least / largest - SAME) + SPARE,
                    np.inf if np.isinf(heavier) else max(2.0, self.heaviest // self.sizes.min()),
                    np.inf if holes.stock is None else float(holes.stock.sum()),
                )
            )
            if not self.most:
                raise ValueError("no piece is left in stock")
            steps = min(holes.per_hole, self.most)
            # holes 60°, 120° and 180° apart add up or cancel: the list of a half with both is shorter
            turned = np.round(np.mod(holes.angles[where] + 1e-7, np.pi / 3), 5)
            self.parts = [where[np.argsort(turned, kind="stable")]]
        # amounts of any size in holes all around, and no largest weight
        free = holes.free_amounts and not holes.step and np.isinf(max_weight)
        self.any_weight = free and all(len(pair) == 2 for pair in self.parts)
        self.contents = _contents(len(self.sizes), steps)
        self.stock = np.full(len(self.sizes), self.most) if holes.stock is None else holes.stock
        self.reach = self.most * float(self.sizes.max())
        self.halves = [
            [self._listed(half, (self.stock + k) // 2) for k, half in enumerate(np.array_split(part, 2))]
            for part in self.parts
        ]

    def _listed(self, where: IndexArray, share: IntArray) -> _Half:
        """All sums of some holes, or of so many pieces (K,) those that do most."""
        m = len(self.contents)
        half = _Half(np.zeros(1, complex), self.contents[:1], np.zeros((1, 0), int))
        for n, way in enumerate(np.exp(1j * self.holes.angles[where]), start=1):
            row, pick = (each.ravel() for each in np.indices((len(half.sums), m)))
            used = half.used[row] + self.contents[pick]
            sums = half.sums[row] + (self.contents @ self.sizes)[pick] * way
            along = (self.toward * sums).real
            kept = np.flatnonzero(self._fits(used))
            kept = kept[self._distinct(sums[kept], used[kept])]
            if len(kept) > _LONGEST:
                kept = kept[(used[kept] <= share).all(axis=1)]
                aim = abs(self.wanted) * n / len(where) / 2
                lost = used @ self.sizes - along + np.abs(along - aim)
                lost[_number(used) <= 2] = -1.0
                kept = kept[np.argsort(lost[kept])[:_LONGEST]]
            picks = np.column_stack((half.picks[row[kept]], pick[kept]))
            half = _Half(sums[kept], used[kept], picks)
        return half

    def _fits(self, used: FloatArray) -> BoolArray:
        """Whether so many pieces are there, and are not too heavy."""
        number = _number(used)
        light = (number <= 2) | (used @ self.sizes <= self.heaviest * KEPT)
        return np.asarray(light & (number <= self.most) & (used <= self.stock).all(axis=1))

    def _distinct(self, sums: ComplexArray, used: FloatArray) -> IndexArray:
        """Of equal sums (that use the same of a stock) those of the fewest pieces, then the lightest."""
        places = np.rint(np.array((sums.real, sums.imag)) / (SAME * self.reach))
        keys = np.vstack((places, used[:, self.stock < self.most].T))
        cost = used @ (1 + 0.5 * self.sizes / self.reach)
        order = np.lexsort((cost, *keys))
        return np.asarray(order[(np.diff(keys[:, order], prepend=np.nan) != 0).any(axis=0)])

    def near(self, z: complex, count: int, number: int | None = None) -> Vectors:
        """About `count` vectors near z, the nearest first, of so many pieces or (None) of any number."""
        from scipy.spatial import cKDTree

        nearest = []
        most, everything = self.most if number is None else number, 2 * (abs(z) + self.reach)
        apart = 0.0 if number is None else 2 * everything  # another number is far away
        for where, (first, second) in zip(self.parts, self.halves, strict=True):
            tree = cKDTree(_points(z - first.sums, (most - _number(first.used)) * apart))
            other = cKDTree(_points(second.sums, _number(second.used) * apart))
            # along the wanted weight both halves make so much at most
            short = (self.toward * z).real - sum(
                (half.sums * self.toward).real.max() for half in (first, second)
            )
            asked, beyond = count, self.reach * np.sqrt(count / (tree.n * other.n)) / 8
            while True:
                radius = min(max(short, 0.0) + beyond, everything)
                near = int(tree.count_neighbors(other, radius))
                if radius < everything and near < asked:
                    beyond *= min(max(np.sqrt(asked / (near + 1)), 1.1), 4.0)
                    continue
                met = tree.sparse_distance_matrix(other, radius, output_type="ndarray")
                i, j = met["i"], met["j"]
                d, used = first.sums[i] + second.sums[j], first.used[i] + second.used[j]
                allowed = np.abs(d + self.holes.mounted) <= self.max_weight * KEPT
                kept = np.flatnonzero(self._fits(used) & allowed)
                kept = kept[self._distinct(d[kept], used[kept])]
                if 8 * len(kept) * asked > count**2 or radius == everything or asked > _PAIRS:
                    break
                asked *= 8  # the limits leave few of many
            put = np.zeros((len(kept), len(self.holes.angles), len(self.sizes)), dtype=np.int64)
            put[:, where] = self.contents[np.column_stack((first.picks[i[kept]], second.picks[j[kept]]))]
            nearest.append((d[kept], used[kept], put))
        d, used, put = (np.concatenate(parts) for parts in zip(*nearest, strict=True))
        order = np.lexsort((used @ self.sizes, _number(used), np.rint(np.abs(d - z) / (SAME * self.reach))))[
            :count
        ]
        return Vectors(d[order], _number(used[order]) * (not self.holes.free_amounts), put[order])

    def listed(self, z: complex) -> Vectors:
        """Vectors near a point, of every number of pieces, for `around`."""
        from scipy.spatial import cKDTree

        few = max(0.7 * (self.most - SPARE) - 2, 0)  # fewer than these are not near it
        numbers = (
            [None]
            if self.holes.free_amounts
            else np.unique(np.append(np.linspace(few, self.most, 13).astype(int), 0))
        )
        each = [self.near(z, _LISTED, number) for number in numbers]
        d, number, put = (np.concatenate(parts) for parts in zip(*each, strict=True))
        if not len(d):
            raise ValueError(NOTHING)
        self.numbers, self.apart = np.unique(number), 1e4 * float(np.abs(d).max() + abs(z) or 1.0)
        self.tree = cKDTree(_points(d, number * self.apart))
        return Vectors(d, number, put)

    def around(self, z: ComplexArray, count: int) -> tuple[IndexArray, IndexArray]:
        """Rows of `count` listed vectors near points, of every number, and the points they are near."""
        each, of = (m.ravel() for m in np.meshgrid(self.numbers, np.arange(len(z))))
        rows = self.tree.query(
            _points(z[of], each * self.apart), k=range(1, count + 1), distance_upper_bound=self.apart / 2
        )[1]
        there = rows < self.tree.n
        return rows[there], np.broadcast_to(of[:, None], rows.shape)[there]

    def place(self, z: complex) -> Mounting:
        """Amounts of any size that make z."""
        return mounting(self.holes, lightest(self.holes, self.usable, z, np.inf)[:, None], np.ones(1))


def _number(used: FloatArray) -> FloatArray:
    return used @ np.ones(used.shape[1])


def _points(d: ComplexArray, height: FloatArray) -> FloatArray:
    return np.column_stack((d.real, d.imag, height))


def _neighbours(angles: FloatArray, where: IndexArray) -> list[IndexArray]:
    """Pairs of holes that share a free amount, or one alone that is too far from the next."""
    where = where[np.argsort(np.mod(angles[where], 2 * np.pi))]
    pairs = np.column_stack((where, np.roll(where, -1)))
    wide = np.mod(angles[pairs[:, 1]] - angles[pairs[:, 0]], 2 * np.pi)
    return [pair if 0 < angle <= WIDEST else pair[:1] for pair, angle in zip(pairs, wide, strict=True)]


def _contents(K: int, most: int) -> FloatArray:
    """Pieces of each of K sizes that one hole can hold, (m, K), nothing first."""
    if (most + 1) ** K > _CONTENTS:
        raise ValueError("too many combinations in one hole: allow fewer pieces, or take a larger step")
    grid = np.indices((most + 1,) * K).reshape(K, -1).T
    return np.asarray(grid[grid.sum(axis=1) <= most], dtype=np.float64)


@dataclass(frozen=True, eq=False)
class Discrete:
    """Pieces chosen for all planes together.

    Attributes
    ----------
    mountings
        Of each plane; None for a plane without holes.
    weights
        Vectors that are added, shape (P,).
    residual
        Y + W D, shape (N,).
    objective
        sqrt(Σ wᵢ² |residualᵢ|²), or the largest wᵢ |residualᵢ|.
    enough
        Whether it is what was asked for.
    fewer
        The best of fewer pieces, the fewest first, each better than the one before.
    """

    mountings: tuple[Mounting | None, ...]
    weights: ComplexArray
    residual: ComplexArray
    objective: float
    enough: bool = True
    fewer: tuple[Discrete, ...] = ()

    @property
    def pieces(self) -> int:
        """How many pieces all planes take together; free amounts do not count."""
        return sum(int(one.counts.sum()) for one in self.mountings if one is not None)


def solve_discrete(
    W: ArrayLike,
    Y: ArrayLike,
    planes: Mapping[str, Holes | None] | Sequence[Holes | None],
    enough: Callable[[ComplexArray], bool] | None = None,
    *,
    wanted: ArrayLike | None = None,
    method: Literal["least-squares", "minmax"] = "least-squares",
    row_weights: ArrayLike | None = None,
    limits: Limits | None = None,
) -> Discrete:
    """The mounting of all planes that leaves the least vibration, or of the fewest pieces that are enough.

    Parameters
    ----------
    W, Y
        Influence coefficients (N, P) and readings (N,), complex.
    planes
        What each plane can take, perhaps by its name for messages; None for a plane that takes any weight. It
        takes at most four pieces more than the least number that weighs enough for its wanted weight.
    enough
        Whether weights (P,) are enough: the fewest pieces of all planes together are taken whose best choice
        is. In each plane they weigh at most 1.5 times the least sum with which its free holes make the wanted
        weight, or are two. Where nothing is enough: the fewest that leave at most 1.2 times the least. None:
        the least vibration.
    wanted
        Exact weights (P,); None: the best of any weights.
    method
        What is minimised.
    row_weights
        wᵢ ≥ 0, shape (N,); default 1.
    limits
        Largest amplitudes (S·C = N, speed by speed), largest weights of the planes (of what is mounted and
        added together) and arcs in which no hole is used.

    Raises
    ------
    ValueError
        For NaN, shapes that do not fit, planes in which nothing can be mounted, and where no mounting that
        keeps the limits is found.
    """
    W, Y, w = check_stack(W, Y, row_weights)
    N, P = W.shape
    named = planes if isinstance(planes, Mapping) else dict(enumerate(planes, 1))
    if len(named) != P:
        raise ValueError(f"there must be holes, or None, for each of the {P} planes")
    limits, heavier = limits or Limits.none(1, N, P), HEAVIER if enough else np.inf
    guides = _guides(W, Y, w, limits.residual.ravel(), minmax=method == "minmax")
    z = _optimum(guides[-1], W, Y)
    exact = np.asarray(z if wanted is None else wanted, dtype=complex)
    sets = _planes(named, limits, exact, heavier)
    fixed = [p for p in np.argsort(np.linalg.norm(W, axis=0)) if not sets[p].any_weight]
    free = [p for p in range(P) if p not in fixed]
    # planes of any weight cancel what they can of what the others leave
    system = np.column_stack((W[:, fixed], Y))
    follow = _optimum(guides[-1], W[:, free], system)
    system = system + W[:, free] @ follow
    lists = [(sets[p], sets[p].listed(complex(z[p]))) for p in fixed]
    leaves = [_leaves(np.sqrt(guide)[:, None] * system, lists) for guide in guides]
    rows, D, number = (np.concatenate(parts) for parts in zip(*leaves, strict=True))
    value = np.zeros(len(D))
    for part in np.array_split(np.arange(len(D)), 1 + len(D) * N // _PAIRS):
        left = np.abs(system[:, -1] + D[part] @ system[:, :-1].T)
        size = (left * w).max(axis=1) if method == "minmax" else np.linalg.norm(left * w, axis=1)
        value[part] = np.where((left <= limits.residual.ravel() * KEPT).all(axis=1), size, np.inf)
    kept = np.flatnonzero(value < np.inf)
    if not len(kept):
        raise ValueError("no mounting that keeps every limit was found: relax one, or add pieces")
    order = kept[np.lexsort((value[kept], number[kept]))]
    best = order[np.diff(np.minimum.accumulate(value[order]), prepend=np.inf) < 0]  # of every number

    def choice(n: int) -> Discrete:
        weights = np.zeros(P, dtype=complex)
        weights[fixed], weights[free] = D[n], follow @ np.append(D[n], 1.0)
        each = zip(fixed, rows[n], lists, strict=True)
        made = {p: mounting(one.holes, vectors.put[row], one.sizes) for p, row, (one, vectors) in each}
        made |= {p: sets[p].place(complex(weights[p])) for p in free if list(named.values())[p]}
        mountings = tuple(map(made.get, range(P)))
        return Discrete(mountings, weights, Y + W @ weights, float(value[n]))

    each = [choice(n) for n in best]
    if enough is None:
        return each[-1]
    first = next((k for k, one in enumerate(each) if enough(one.weights)), None)
    last = next(k for k, one in enumerate(each) if one.objective <= FEW * each[-1].objective)
    chosen = last if first is None else first
    return replace(each[chosen], enough=first is not None, fewer=tuple(each[:chosen]))


def _leaves(
    system: ComplexArray, lists: Sequence[tuple[PlaneVectors, Vectors]]
) -> tuple[IntArray, ComplexArray, FloatArray]:
    """Choices with the least |A D + b|² for every number, `system` = [A b]: rows of the lists, D, number."""
    P = len(lists)
    little = 1e-12 * (np.abs(system).max() or 1.0) * np.eye(P, P + 1)  # for full rank
    R = np.asarray(np.linalg.qr(np.vstack((system, little)), mode="r"))
    rows, D = np.zeros((1, P), dtype=int), np.zeros((1, P), dtype=complex)
    number, cost = np.zeros(1), np.zeros(1)
    for k in range(P - 1, -1, -1):
        one, vectors = lists[k]
        centre = -(R[k, P] + D[:, k + 1 :] @ R[k, k + 1 : P]) / R[k, k]
        hit, of = one.around(centre, 60 if k == P - 1 else _BRANCHES[k > 0])
        rows, D = rows[of], D[of]
        rows[:, k], D[:, k] = hit, vectors.d[hit]
        number = number[of] + vectors.number[hit]
        cost = cost[of] + np.abs(R[k, k] * (D[:, k] - centre[of])) ** 2
        best = np.lexsort((cost, number))
        _, first, at = np.unique(number[best], return_index=True, return_inverse=True)
        best = best[np.arange(len(best)) - first[at] < _BEST[k > 0]]
        rows, D, number, cost = rows[best], D[best], number[best], cost[best]
    return rows, D, number


def _guides(
    W: ComplexArray, Y: ComplexArray, w: FloatArray, most: FloatArray, *, minmax: bool
) -> list[FloatArray]:
    """Weights g of the rows whose least squares lead to what is wanted."""
    guides = [w**2 * (_prices(w[:, None] * W, w * Y) + 1 / len(w) if minmax else 1.0)]
    limited = np.isfinite(most)
    if limited.any():
        at, price = np.maximum(most[limited], 1e-300), np.zeros(len(w))
        price[limited] = _prices(W[limited] / at[:, None], Y[limited] / at) / at**2
        size = 0.03 * guides[0] @ np.abs(Y) ** 2
        guides += [guides[0] / size + share * price for share in (30.0, 3.0, 0.3)]
    return guides


def _planes(
    named: Mapping[Any, Holes | None], limits: Limits, exact: ComplexArray, heavier: float
) -> list[PlaneVectors]:
    """Vectors that each plane can take, with its limits."""
    sets = []
    for (name, holes), arcs, largest, d in zip(
        named.items(), limits.forbidden, limits.max_weight, exact, strict=True
    ):
        if holes is None and arcs:
            raise ValueError(f"plane {name} has forbidden angles but no holes: list its holes")
        try:
            sets.append(PlaneVectors(holes or from_list(equal_holes(4)), complex(d), arcs, largest, heavier))
        except ValueError as error:
            raise ValueError(f"plane {name}: {error}") from None
    return sets


def _optimum(guide: FloatArray, A: ComplexArray, y: ComplexArray) -> ComplexArray:
    """The x, for every column of y, with the least Σ g |y + A x|²."""
    root = np.sqrt(guide)
    return -np.asarray(solution(root[:, None] * A, (root * y.T).T), dtype=complex)


def _prices(A: ComplexArray, y: ComplexArray) -> FloatArray:
    """Weights of rows, 1 together, of which least squares minimise max |y + A x| (Lawson's iteration)."""
    price = np.full(len(y), 1.0 / len(y))
    for _ in range(50):
        left = np.abs(y + A @ _optimum(price, A, y))
        price = price * left / (price @ left or 1.0)
    return price
