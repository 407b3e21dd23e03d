"""Weights within limits: second-order cone programs, and what to do where no weights are within them.

With weights D = D₀ + T y (stretched), every limit is a disc: |r₀ᵢ + Wᵢ T y| ≤ Lᵢ for the amplitude of a
reading, |D₀ₚ + Tₚ y| ≤ Mₚ for a weight; in min–max wᵢ |r₀ᵢ + Wᵢ T y| ≤ t, t the smallest. A sector in which
a weight must stand is two half planes. T makes what is minimised a length: |y| for `nearest`, and for min–max
the columns of all scaled rows orthogonal; so the solver's tolerances mean the same in any unit. The program
starts from the few discs that D₀ is farthest out of (for min–max the largest amplitudes that least squares
leaves, with rows reweighted by these a few times: C. L. Lawson, 1961) and adds those that its solution
violates, hence the dual value of the last program is a lower bound for all. Weights are within every limit
exactly: limits are made tighter by 3e-9 of themselves, more where many digits cancel, and what that costs is
in the gap. Where a plane may stand in several sectors, branch and bound chooses among them.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import NamedTuple

import numpy as np

from balancing.trials import Arc, Limits
from rotorid.base.arrays import AnyArray, BoolArray, ComplexArray, FloatArray, IntArray
from rotorid.base.text import listing
from rotorid.regression import solution, stretch, unstretch

Sectors = tuple[Arc, ...] | None
"""Convex arcs (width ≤ π) where a weight may stand; None: anywhere."""
Words = Callable[[float], str]
"""Write an amplitude or a weight, with its unit."""
PLAIN: Words = "{:.4g}".format

TOLERANCE = 1e-9
TIGHTER = (0.3, 3.0, 30.0, 300.0, 3000.0)
"""By how many tolerances limits are tightened, one after the other until all are kept."""
AT_LIMIT = 2e-3
"""A limit is reached where less than this share of it is left: solvers stay a little inside."""
PRICED = 1e-5
"""A limit takes part in a conflict if its share in the price of all is above this."""
MORE = 3
"""Discs a plane that a program starts from, and that are added to it."""
STEPS = 4
"""Of reweighting before min–max."""
TURN, TINY = 2 * np.pi, 1e-300


class InfeasibleError(ValueError):
    """Limits that no weights meet."""


class Bounds(NamedTuple):
    """W (N, P), Y (N,); largest amplitudes (N,), weights (P,), infinite for none; each plane's sectors."""

    W: ComplexArray
    Y: ComplexArray
    residual: FloatArray
    max_weight: FloatArray
    sectors: tuple[Sectors, ...]

    def stacked(self) -> tuple[ComplexArray, ComplexArray, FloatArray]:
        """E (N + P, P), e (N + P,) and limits: amplitudes and weights are |e + E D|."""
        P = len(self.max_weight)
        E = np.concatenate((self.W, np.eye(P, dtype=complex)))
        return E, np.append(self.Y, np.zeros(P)), np.append(self.residual, self.max_weight)


class Optimum(NamedTuple):
    """Weights (P,), what was minimised, its relative distance from a lower bound; prices of limits (N + P,).

    The objective falls, at first, by the price times ε where the limit of a reading, or of a plane's weight,
    grows by the share ε; for min–max also each reading's share in the maximum. Of any unit.
    """

    weights: ComplexArray
    objective: float
    gap: float
    prices: FloatArray


class _Goal(NamedTuple):
    """D₀ (P,), T (2P, 2P), wᵢ of min–max (N,) or zeros; the objective of weights, and of a dual value."""

    start: ComplexArray
    transform: FloatArray
    shares: FloatArray
    objective: Callable[[ComplexArray], float]
    bound: Callable[[float], float]


def bounds_of(W: ComplexArray, Y: ComplexArray, limits: Limits | None) -> Bounds:
    """Limits of a job for its equations, none where there are none."""
    N, P = W.shape
    limits = limits or Limits.none(1, N, P)
    if limits.residual.size != N or len(limits.max_weight) != P:
        raise ValueError(
            f"the limits are for {limits.residual.size} readings and {len(limits.max_weight)} planes; "
            f"there are {N} and {P}"
        )
    sectors = tuple(map(allowed_sectors, limits.forbidden))
    return Bounds(W, Y, limits.residual.reshape(N), limits.max_weight, sectors)


def allowed_sectors(forbidden: Sequence[Arc]) -> Sectors:
    """Convex sectors that together are what forbidden arcs leave of the circle.

    Parameters
    ----------
    forbidden
        Arcs (start, width), rad, 0 < width ≤ 2π; they may overlap and pass 0. Arcs that touch leave nothing
        between them.

    Returns
    -------
    Arcs of width ≤ π, starts in [0, 2π); empty where the whole circle is forbidden, None where nothing is.

    Examples
    --------
    >>> allowed_sectors([(0.0, np.pi)])
    ((3.141592653589793, 3.141592653589793),)
    >>> allowed_sectors([(0.0, 4.0), (3.0, 4.0)])
    ()
    """
    if not forbidden:
        return None
    edges = sorted({edge % TURN for start, width in forbidden for edge in (start, start + width)})
    sectors = []
    for first, last in zip(edges, [*edges[1:], edges[0] + TURN], strict=True):
        middle = (first + last) / 2
        if last - first < 1e-9 or any((middle - start) % TURN < width for start, width in forbidden):
            continue
        if last - first > np.pi:
            sectors += [(first, np.pi), ((last - np.pi) % TURN, np.pi)]
        else:
            sectors.append((first, last - first))
    return tuple(sectors)


def project(weight: complex, sector: Arc | None) -> complex:
    """Nearest complex number of a sector (start, width ≤ π) from the origin; `weight` itself for None."""
    if sector is None or weight == 0:
        return weight
    start, width = sector
    if (np.angle(weight) - start) % TURN <= width:
        return weight
    rays = np.exp(1j * np.array([start, start + width]))
    along = np.maximum((rays.conj() * weight).real, 0.0)
    return complex((along * rays)[along.argmax()])


def stands_in(weight: complex, sectors: Sectors) -> bool:
    """Whether a weight is zero or stands in one of the sectors (None: anywhere)."""
    if weight == 0 or sectors is None:
        return True
    return any((np.angle(weight) - start + 1e-9) % TURN <= width + 2e-9 for start, width in sectors)


def within(bounds: Bounds, weights: ComplexArray) -> bool:
    """Whether weights are within every limit."""
    return bool(
        (np.abs(weights) <= bounds.max_weight).all()
        and (np.abs(bounds.Y + bounds.W @ weights) <= bounds.residual).all()
        and all(map(stands_in, weights.tolist(), bounds.sectors))
    )


def nearest(
    bounds: Bounds, target: ComplexArray, root: AnyArray, floor: float = 0.0, tolerance: float = TOLERANCE
) -> Optimum:
    """Weights within limits that minimise √(floor² + |root (x − target)|²), x stretched.

    Parameters
    ----------
    bounds
        Of planes that may all carry a weight.
    target
        The best weights without limits, (P,).
    root
        Regular, (2P, 2P), in the stretched weights.
    floor
        What stays without limits.
    tolerance
        Of the solver, relative.

    Raises
    ------
    InfeasibleError
        Where no weights are within the limits.
    """

    def objective(weights: ComplexArray) -> float:
        return float(np.hypot(floor, np.linalg.norm(root @ stretch(weights - target))))

    def bound(value: float) -> float:
        return float(np.sqrt(floor**2 + 2 * max(value, 0.0)))

    goal = _Goal(target, np.linalg.inv(root), np.zeros(len(bounds.Y)), objective, bound)
    return _best(bounds, goal, tolerance)


def smallest_maximum(bounds: Bounds, shares: FloatArray, tolerance: float = TOLERANCE) -> Optimum:
    """Weights within limits that minimise max wᵢ |Yᵢ + Wᵢ D|.

    Parameters
    ----------
    bounds
        Of planes that may all carry a weight.
    shares
        w ≥ 0 of the readings, (N,).
    tolerance
        Of the solver, relative.

    Raises
    ------
    InfeasibleError
        Where no weights are within the limits.
    """
    W, Y, none = bounds.W, bounds.Y, np.zeros(bounds.W.shape[1], dtype=complex)
    rows = shares[:, None] * W

    def objective(weights: ComplexArray) -> float:
        return float((shares * np.abs(Y + W @ weights)).max())

    start = min(none, _shortened(_levelled(rows, shares * Y), bounds.max_weight), key=objective)
    unit = objective(start)
    if unit <= 1e-12 * objective(none):
        if within(bounds, start):  # nothing is left to minimise
            return Optimum(start, unit, 0.0, (shares * np.abs(Y + W @ start) >= unit).astype(float))
        unit = objective(none)
    E, e, limit = bounds.stacked()
    limited, size = np.isfinite(limit), np.maximum(np.maximum(limit, np.abs(e + E @ start)), TINY)
    scaled = np.concatenate((rows / unit, (E / size[:, None])[limited]))
    values, vectors = np.linalg.eigh(scaled.conj().T @ scaled)
    transform = stretch(vectors * np.sqrt(len(scaled) / np.maximum(values, 1e-12 * values[-1])))
    return _best(bounds, _Goal(start, transform, shares / unit, objective, lambda t: unit * t), tolerance)


def _levelled(rows: ComplexArray, right: ComplexArray) -> ComplexArray:
    """Unknowns x that leave nearly the least maximum of |right + rows x|."""
    Q, R = np.linalg.qr(rows)
    x, counts = -(Q.conj().T @ right), np.ones(len(rows))
    for _ in range(STEPS):
        counts = counts * np.abs(right + Q @ x) ** 2
        counts = counts / counts.max(initial=TINY) + 1e-8
        weighed = counts * Q.conj().T
        x = np.linalg.solve(weighed @ Q, -(weighed @ right))
    return np.asarray(solution(R, x))


def _best(bounds: Bounds, goal: _Goal, tolerance: float) -> Optimum:
    """Branch and bound: a plane whose weight stands at a forbidden angle is tried in each of its sectors."""
    best: Optimum | None = None
    branches: list[tuple[Arc | None, ...]] = [(None,) * len(goal.start)]
    while branches:
        chosen = branches.pop()
        try:
            optimum = _convex(bounds, chosen, goal, tolerance)
        except InfeasibleError:
            continue
        if best is not None and optimum.objective * (1 - optimum.gap) >= best.objective:
            continue
        inside = map(stands_in, optimum.weights.tolist(), bounds.sectors)
        plane = next((p for p, stands in enumerate(inside) if not stands), None)
        if plane is None:
            best = optimum
            continue
        sectors = reversed(bounds.sectors[plane] or ())
        branches += [(*chosen[:plane], sector, *chosen[plane + 1 :]) for sector in sectors]
    if best is None:
        raise InfeasibleError("no weights are within the limits")
    if best.gap > 1e-3:
        raise ValueError(
            "the solver did not come near the best weights: leave out a plane that acts like another, "
            "or relax the limits"
        )
    return best


def _convex(bounds: Bounds, chosen: tuple[Arc | None, ...], goal: _Goal, tolerance: float) -> Optimum:
    """The best weights with at most one sector for each plane."""
    E, e, limit = bounds.stacked()
    start, T, shares = goal.start, goal.transform, goal.shares
    P, left = len(start), e + E @ start
    index = np.concatenate((np.flatnonzero(shares), np.flatnonzero(np.isfinite(limit))))
    rises = np.arange(len(index)) < np.count_nonzero(shares)
    # discs |centres + rows y| ≤ head, or t where it rises, each divided by its size
    size = np.maximum(limit, np.abs(left))[index]
    size[rises] = 1 / shares[shares > 0]
    size = np.maximum(size, TINY)
    head, centres = np.where(rises, 0.0, limit[index]) / size, left[index] / size
    rows = (stretch(E) @ T).reshape(-1, 2, 2 * P)[index] / size[:, None, None]
    sides, right = _sides(chosen, start, T)
    excess, scale = np.where(rises, 0.0, np.abs(centres) - head), 1.0
    if not rises.any():  # the way to go is about as long as the way to the farthest disc or side
        reach = np.linalg.norm(rows, axis=(1, 2))
        steps = excess / np.maximum(reach, 1e-9 * reach.max(initial=0.0))
        scale = float(np.concatenate((steps, -right)).max(initial=0.0))
        if not scale > 0:
            return Optimum(start, goal.objective(start), 0.0, np.zeros(len(e)))
        rows, sides, T = scale * rows, scale * sides, scale * T
    active = excess > 0
    active[np.argsort(-np.abs(centres[rises]))[: MORE * P]] = True
    for tighter in TIGHTER:
        inner = head * (1 - tighter * tolerance)
        while True:
            discs = rows[active], centres[active], inner[active], rises[active]
            y, t, prices, value = _program(*discs, sides, right, tolerance)
            out = np.abs(centres + unstretch((rows @ y).ravel())) - inner - rises * t * (1 + tolerance)
            more = np.flatnonzero(~active & (out > 0))
            if not len(more):
                break
            active[more[np.argsort(-out[more])[: MORE * P]]] = True
        weights = np.array(list(map(project, (start + unstretch(T @ y)).tolist(), chosen)))
        weights = _shortened(weights, bounds.max_weight)
        if (np.abs(e + E @ weights) <= limit).all():
            break
    else:
        raise InfeasibleError("the limits can be met only to within rounding")
    prices = prices * np.where(rises, t, head)[active]
    spent = tighter * tolerance * float(prices[~rises[active]].sum())
    lower, objective = goal.bound(scale**2 * (value - spent)), goal.objective(weights)
    least = 1e3 * tolerance * goal.objective(np.zeros_like(start))
    gap = max(objective - lower, 0.0) / max(objective, least, TINY)
    return Optimum(weights, objective, gap, np.bincount(index[active], prices, len(e)).astype(float))


def _shortened(weights: ComplexArray, most: FloatArray) -> ComplexArray:
    """Weights of at most some size."""
    size = np.maximum(np.abs(weights), TINY)
    return weights * np.where(size > most, most * (1 - 1e-15) / size, 1.0)


def _sides(
    chosen: tuple[Arc | None, ...], start: ComplexArray, T: FloatArray
) -> tuple[FloatArray, FloatArray]:
    """Rows, of length 1, with right + rows y ≥ 0: left of a sector's start and right of its end."""
    if not any(chosen):
        return np.zeros((0, len(T))), np.zeros(0)
    inward = [
        unit * (np.arange(len(start)) == p)
        for p, arc in enumerate(chosen)
        for unit in (() if arc is None else (-1j * np.exp(-1j * arc[0]), 1j * np.exp(-1j * sum(arc))))
    ]
    normals = np.reshape(np.array(inward, dtype=complex), (-1, len(start)))
    rows = stretch(normals)[::2] @ T
    length = np.linalg.norm(rows, axis=1)
    return rows / length[:, None], (normals @ start).real / length


class _Columns(NamedTuple):
    """A sparse matrix by columns, as much of scipy's as clarabel reads, made in a tenth of the time."""

    data: FloatArray
    indices: IntArray
    indptr: IntArray
    shape: tuple[int, ...]
    has_canonical_format: bool = True


def _columns(A: FloatArray) -> _Columns:
    """What is not 0 of a matrix (m, n)."""
    column, row = A.T.nonzero()
    return _Columns(A[row, column], row, np.searchsorted(column, np.arange(A.shape[1] + 1)), A.shape)


def _program(
    rows: FloatArray,
    centres: ComplexArray,
    head: FloatArray,
    rises: BoolArray,
    sides: FloatArray,
    right: FloatArray,
    tolerance: float,
) -> tuple[FloatArray, float, FloatArray, float]:
    """Minimise t, or |y|²/2 where nothing rises: y, t, dual values of the heads, and the dual objective."""
    import clarabel

    m, _, n = rows.shape
    s, width = len(right), n + int(rises.any())
    A, q = np.zeros((s + 3 * m, width)), np.zeros(width)
    A[:s, :n] = -sides
    A[s:].reshape(m, 3, width)[:, 1:, :n] = -rows
    A[s::3, n:], q[n:] = -1.0 * rises[:, None], 1.0
    curvature = np.eye(width) * (width == n)
    b = np.concatenate((right, np.stack((head, centres.real, centres.imag), axis=1).ravel()))
    cones = [clarabel.NonnegativeConeT(s)] * bool(s) + [clarabel.SecondOrderConeT(3)] * m
    settings = clarabel.DefaultSettings()
    settings.verbose, settings.presolve_enable, settings.max_threads = False, False, 1
    settings.tol_gap_abs = settings.tol_gap_rel = settings.tol_feas = tolerance
    for refined in (False, True):  # steps of full accuracy take half as long again, and are hardly needed
        settings.iterative_refinement_enable = refined
        solved = clarabel.DefaultSolver(_columns(curvature), q, _columns(A), b, cones, settings).solve()
        if str(solved.status) == "Solved":
            break
    if "PrimalInfeasible" in str(solved.status):
        raise InfeasibleError("no weights are within the limits")
    x = np.append(solved.x, 0.0)
    return x[:n], float(x[n]), np.array(solved.z)[s::3], float(solved.obj_val_dual)


def explain(
    bounds: Bounds,
    planes: Sequence[str],
    readings: Sequence[str] = (),
    amplitude: Words = PLAIN,
    weight: Words = PLAIN,
) -> str:
    """Say which limits conflict, and what would be possible.

    Parameters
    ----------
    bounds
        Limits that no weights meet, some of them of amplitudes.
    planes, readings
        Names (P) and labels (N), such as "sensor 'B' at 3000 rpm"; default "reading 1", ….
    amplitude, weight
        Write a number with its unit.
    """
    L, M = bounds.residual, bounds.max_weight
    readings = readings or [f"reading {i + 1}" for i in range(len(L))]
    relaxed = smallest_maximum(bounds._replace(residual=L + np.inf), 1 / L)
    factor, best = relaxed.objective, np.abs(bounds.Y + bounds.W @ relaxed.weights)
    if factor < 1 - PRICED:
        return "the limits can be met only to within rounding: relax a limit of the amplitudes"
    order = np.argsort(-relaxed.prices)
    priced = order[relaxed.prices[order] > PRICED * relaxed.prices.sum()]
    heavy, high = priced[priced >= len(L)] - len(L), priced[priced < len(L)]
    conditions = [f"at most {weight(M[p])} in plane {planes[p]!r}" for p in heavy]
    of_arcs = zip(planes, bounds.sectors, strict=True)
    conditions += [f"the forbidden angles of plane {name!r}" for name, arcs in of_arcs if arcs is not None]
    stays = [f"{readings[i]} (limit {amplitude(L[i])}) stays at {amplitude(best[i])}" for i in high[:3]]
    digits = 10.0 ** (2 - int(np.floor(np.log10(factor))))
    enough = np.ceil((1 + 1e-4) * factor * digits) / digits  # three digits that leave room for the weights
    return (
        f"the limits cannot be met: {'with ' if conditions else 'whatever the weights'}"
        f"{listing(conditions, 'and')}, {listing(stays, 'and')} at best; "
        f"relaxing all amplitude limits {enough:.6g} times works"
    )
