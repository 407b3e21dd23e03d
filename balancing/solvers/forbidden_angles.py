"""Weights at allowed angles only: forbidden arcs become sectors, and branch and bound chooses among them.

What is left of the circle is a union of arcs; one of up to π is a convex sector, a wider one is the union of
two half planes. The program without sectors comes first. Where a weight of its solution stands at a forbidden
angle, that plane is tried in each of its sectors, the one with the smallest bound first, until no bound is
left below the best weights found: exact, with the smallest bound of all that were set aside as certificate.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from heapq import heappop, heappush
from itertools import count

import numpy as np

from balancing.data.limits import Arc
from balancing.solvers.certificate import Problem
from balancing.solvers.cone import Cone, InfeasibleError, relative_gap, solve_cone
from rotorid.base.arrays import ComplexArray

_TOUCHING = 1e-9
_ENOUGH = 1e-9
_ON_EDGE = 1e-9


def allowed_sectors(forbidden: Sequence[Arc]) -> tuple[Arc, ...] | None:
    """Convex sectors that together are what forbidden arcs leave of the circle.

    Parameters
    ----------
    forbidden
        Arcs (start, width), rad, 0 < width ≤ 2π; they may overlap and pass 0. Arcs that touch leave nothing
        between them.

    Returns
    -------
    Arcs of width ≤ π with starts in [0, 2π); empty where the whole circle is forbidden (only weight zero is
    left); None where nothing is.

    Examples
    --------
    >>> allowed_sectors([(0.0, np.pi)])
    ((3.141592653589793, 3.141592653589793),)
    >>> allowed_sectors([(0.0, 4.0), (3.0, 4.0)])
    ()
    """
    if not forbidden:
        return None
    turn, pieces = 2 * np.pi, []
    for first, width in forbidden:
        start = float(np.mod(first, turn))
        pieces.append([start, min(start + width, turn)])
        if start + width > turn:
            pieces.append([0.0, start + width - turn])
    closed: list[list[float]] = []
    for start, end in sorted(pieces):
        if closed and start <= closed[-1][1] + _TOUCHING:
            closed[-1][1] = max(closed[-1][1], end)
        else:
            closed.append([start, end])
    sectors: list[Arc] = []
    for i, (_, end) in enumerate(closed):
        following = closed[i + 1][0] if i + 1 < len(closed) else closed[0][0] + turn
        width = following - end
        if width > np.pi:
            sectors += [(end % turn, np.pi), ((following - np.pi) % turn, np.pi)]
        elif width > _TOUCHING:
            sectors.append((end % turn, width))
    return tuple(sectors)


def stands_in(weight: complex, sectors: Sequence[Arc] | None) -> bool:
    """Whether a weight is zero or stands in one of the sectors (None: anywhere)."""
    if weight == 0 or sectors is None:
        return True
    turn = 2 * np.pi
    beyond = [np.mod(np.angle(weight) - start + _ON_EDGE, turn) - width for start, width in sectors]
    return any(b <= 2 * _ON_EDGE for b in beyond)


def meets(problem: Problem, sectors: Sequence[Sequence[Arc] | None], weights: ComplexArray) -> bool:
    """Whether weights are within every limit of a problem, and stand in one of their plane's sectors each."""
    return bool(
        (np.abs(weights) <= problem.max_weight).all()
        and (np.abs(problem.Y + problem.W @ weights) <= problem.residual).all()
        and all(stands_in(complex(v), s) for v, s in zip(weights, sectors, strict=True))
    )


def solve_sectors(problem: Problem, sectors: Sequence[Sequence[Arc] | None]) -> Cone:
    """Weights of the smallest objective that stand in one of their plane's sectors each, or are zero.

    Parameters
    ----------
    problem
        Its own sectors are not looked at.
    sectors
        For each plane what `allowed_sectors` returns.

    Raises
    ------
    InfeasibleError
        Where no weights are within the limits.
    """
    if all(s is None for s in sectors):
        return solve_cone(replace(problem, sectors=tuple(None for _ in sectors)))
    empty = np.array([s is not None and len(s) == 0 for s in sectors])
    whole = replace(
        problem,
        sectors=(None,) * len(sectors),
        max_weight=np.where(empty, 0.0, problem.max_weight),
    )
    order, best, aside = count(), None, np.inf
    relaxed = solve_cone(whole)
    heap = [(relaxed.bound, next(order), relaxed, whole)]
    while heap:
        bound, _, found, part = heappop(heap)
        if best is not None and bound >= best.objective * (1 - _ENOUGH):
            aside = min(aside, bound)
            break
        plane = _worst(found, part, sectors)
        if plane is None:
            aside = min(aside, bound)
            if best is None or found.objective < best.objective:
                best = found
            continue
        for sector in sectors[plane] or ():
            chosen = (*part.sectors[:plane], sector, *part.sectors[plane + 1 :])
            branch = replace(part, sectors=chosen)
            try:
                one = solve_cone(branch)
            except InfeasibleError:
                continue
            heappush(heap, (max(one.bound, bound), next(order), one, branch))
    if best is None:
        raise InfeasibleError("no weights at allowed angles are within the limits")
    lower = min(best.objective, aside)
    return replace(
        best,
        bound=lower,
        gap=relative_gap(problem, best.objective, lower),
        active_weights=best.active_weights & ~(empty & (problem.max_weight > 0)),
    )


def _worst(found: Cone, part: Problem, sectors: Sequence[Sequence[Arc] | None]) -> int | None:
    """The plane whose weight at a forbidden angle does most; None where all stand where they may."""
    effect = np.abs(found.weights) * np.linalg.norm(part.W, axis=0)
    wrong = [p for p, s in enumerate(sectors) if not stands_in(found.weights[p], s)]
    return max(wrong, key=lambda p: float(effect[p])) if wrong else None
