"""Limits that cannot be met: which of them conflict, and the least relaxation that works, in words.

The least factor for the amplitudes is the optimum of the min–max problem of |rᵢ| / Lᵢ within the limits of
weights and angles; the least factor for the weights that of |D_p| / M_p within those of amplitudes and
angles. Both are certified optima. The limits in conflict are those with a price (dual value) in the first
problem: with these alone the factor would be the same (where angles are forbidden, in the best sectors).
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace

import numpy as np

from balancing.data.limits import Arc
from balancing.solvers.certificate import Problem
from balancing.solvers.cone_program import InfeasibleError, SolverError
from balancing.solvers.forbidden_angles import solve_sectors
from rotorid.base.arrays import FloatArray
from rotorid.base.text import listing

PRICED = 1e-5
"""A limit takes part in a conflict if its share in the price of all is above this."""

_NAMED = 3
_EXACT = 1e-9
_ROOM = 1e-4


@dataclass(frozen=True, eq=False)
class Relaxation:
    """What would make limits possible.

    Attributes
    ----------
    amplitudes
        Least factor by which all limits of amplitudes must grow, the others kept; infinite where one that
        is zero cannot be met.
    weights
        Least factor by which all limits of weights must grow, the others kept; infinite where that
        does not help.
    best
        Amplitudes at the least factor, shape (N,).
    readings, planes
        Indices of the limits of amplitudes and of weights that conflict, most important first.
    angles
        Planes whose forbidden arcs take part: without them the factor would be smaller.
    """

    amplitudes: float
    weights: float
    best: FloatArray
    readings: tuple[int, ...]
    planes: tuple[int, ...]
    angles: tuple[int, ...]


def relax(whole: Problem, sectors: Sequence[Sequence[Arc] | None]) -> Relaxation:
    """Least relaxation of the limits of a problem that no weights meet.

    Parameters
    ----------
    whole
        With finite limits of amplitudes; what it minimises does not matter.
    sectors
        What `balancing.solvers.forbidden_angles.allowed_sectors` returns for each plane.

    Raises
    ------
    ValueError
        Without any limit of amplitudes: zero weights are within all others.
    """
    L, M = whole.residual, whole.max_weight
    limited = np.isfinite(L)
    if not limited.any():
        raise ValueError("without limits of amplitudes zero weights meet every limit")
    zero = limited & (L == 0)
    positive = L[limited & ~zero]
    stand_in = 1e-6 * float(positive.min()) if positive.size else float(np.abs(whole.Y).max() or 1.0)
    share = np.zeros(len(L))
    share[limited] = 1.0 / np.where(L[limited] > 0, L[limited], stand_in)
    free = np.full(len(L), np.inf)
    found = solve_sectors(replace(whole, row_weights=share, residual=free, minmax=True), sectors)
    factor = found.objective
    best = np.abs(whole.Y + whole.W @ found.weights)
    readings = _priced(found.residual_prices)
    planes = tuple(p for p in _priced(found.weight_prices) if np.isfinite(M[p]))
    # planes left empty have no price: they take part if carrying a weight would lower the factor
    empty = [p for p in range(len(M)) if M[p] == 0]
    planes += tuple(p for p in empty if _helps(whole, sectors, share, p, factor, weight=True))
    angles = tuple(
        p for p, s in enumerate(sectors) if s is not None and _helps(whole, sectors, share, p, factor)
    )
    weights = np.inf if zero.any() else _weights(whole, sectors)
    if zero.any() and (best[zero] > _EXACT * np.abs(whole.Y).max()).any():
        factor = np.inf
    return Relaxation(factor, weights, best, readings, planes, angles)


def _priced(prices: FloatArray) -> tuple[int, ...]:
    order = np.argsort(-prices, kind="stable")
    return tuple(int(i) for i in order if prices[i] > PRICED * prices.sum())


def _helps(
    whole: Problem,
    sectors: Sequence[Sequence[Arc] | None],
    share: FloatArray,
    plane: int,
    factor: float,
    *,
    weight: bool = False,
) -> bool:
    """Whether the factor would be smaller without one plane's limit of weight, or of angles."""
    M, own = whole.max_weight.copy(), list(sectors)
    if weight:
        M[plane] = np.inf
    else:
        own[plane] = None
    other = replace(whole, row_weights=share, residual=np.full(len(share), np.inf), max_weight=M, minmax=True)
    return solve_sectors(other, own).objective < factor * (1 - PRICED)


def _weights(whole: Problem, sectors: Sequence[Sequence[Arc] | None]) -> float:
    """Least factor of the weights' limits, the optimum of max |D_p| / M_p within the others."""
    M = whole.max_weight
    rows = np.flatnonzero(np.isfinite(M) & (M > 0))
    if not len(rows):
        return np.inf
    N, P = whole.W.shape
    stacked = replace(
        whole,
        W=np.concatenate((np.eye(P, dtype=complex)[rows], whole.W)),
        Y=np.concatenate((np.zeros(len(rows), dtype=complex), whole.Y)),
        row_weights=np.concatenate((1.0 / M[rows], np.zeros(N))),
        residual=np.concatenate((np.full(len(rows), np.inf), whole.residual)),
        max_weight=np.where(M > 0, np.inf, 0.0),
        minmax=True,
    )
    try:
        return solve_sectors(stacked, sectors).objective
    except (InfeasibleError, SolverError):  # nothing is said of a factor that is not certain
        return np.inf


def explain(
    whole: Problem,
    sectors: Sequence[Sequence[Arc] | None],
    planes: Sequence[str],
    readings: Sequence[str],
    *,
    amplitude: Callable[[float], str] = "{:.4g}".format,
    weight: Callable[[float], str] = "{:.4g}".format,
) -> str:
    """Say which limits conflict and what would be possible.

    Parameters
    ----------
    whole, sectors
        As for `relax`.
    planes, readings
        Names (P) and labels (N), such as "sensor 'B' at 3000 rpm".
    amplitude, weight
        Write a number with its unit.
    """
    found = relax(whole, sectors)
    if found.amplitudes < 1 - PRICED or not found.readings:
        return "the limits can be met only to within rounding: relax a limit of the amplitudes a little"
    conditions = []
    for p in found.planes:
        limit = whole.max_weight[p]
        conditions.append(
            f"at most {weight(limit)} in plane {planes[p]!r}"
            if limit > 0
            else f"plane {planes[p]!r} left empty"
        )
    if found.angles:
        which = " and ".join(repr(planes[p]) for p in found.angles)
        conditions.append(f"the forbidden angles of plane{'s' if len(found.angles) > 1 else ''} {which}")
    named = found.readings[:_NAMED]
    more = len(found.readings) - len(named)
    stays = [
        f"{readings[i]} (limit {amplitude(whole.residual[i])}) stays at {amplitude(found.best[i])}"
        for i in named
    ]
    with_ = f"with {listing(conditions, 'and')}, " if conditions else "whatever the weights, "
    others = f" (and {more} more readings at their own)" if more > 1 else " (and 1 more reading at its own)"
    text = f"the limits cannot be met: {with_}{listing(stays, 'and')} at best{others if more else ''}"
    ways = []
    if np.isfinite(found.amplitudes):
        ways.append(f"relaxing all amplitude limits {_up(found.amplitudes)} times works")
    if np.isfinite(found.weights):
        ways.append(f"all weight limits {_up(found.weights)} times")
    if np.isfinite(found.amplitudes):
        return f"{text}; {', or '.join(ways)}"
    if ways:
        return f"{text}; relaxing {ways[0]} works"
    return f"{text}; an amplitude of zero cannot be reached, give a larger limit"


def _up(factor: float) -> str:
    """Three digits, rounded up so that the factor said leaves room for the weights."""
    factor *= 1 + _ROOM
    digits = 10.0 ** (2 - int(np.floor(np.log10(factor))))
    return f"{np.ceil(factor * digits) / digits:.6g}"
