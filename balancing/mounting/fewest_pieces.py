"""The fewest pieces that leave little more than the least vibration, or little enough.

For one number of pieces after the other, the best choice of so many is searched: vectors of few pieces can be
listed where all of them cannot. The first number of which a choice is good enough is the fewest.
"""

from __future__ import annotations

import time
from collections.abc import Iterator, Sequence
from contextlib import suppress
from itertools import combinations, islice, pairwise

import numpy as np

from balancing.mounting.discrete_bounds import Form
from balancing.mounting.discrete_search import Found, Squares, polish, rounded, search
from balancing.mounting.mountable_vectors import MOST, Attainable

__all__ = ["FEW", "LITTLE", "Choice", "fewest"]

FEW = 1.2
"""So many times the least is good enough for fewer pieces."""
LITTLE = 0.2
"""So large a share of the present vibration, or of a given weight, is good enough for fewer pieces."""
_SHARES = 40  # ways to share pieces among planes that are tried, the most even first
Choice = tuple[Found, Sequence[Attainable]]
"""What was found, in which sets."""


def fewest(
    form: Form,
    sets: Sequence[Attainable],
    squares: Squares,
    enough: float,
    pieces: int,
    until: float,
    chunk: int,
) -> tuple[Choice | None, bool]:
    """The best choice of the fewest pieces whose square is at most `enough`, and whether that is sure.

    Parameters
    ----------
    form, sets, squares, until, chunk
        As for `search`.
    enough
        Squared objective.
    pieces
        Of a choice that is known to be good enough; None is returned where no fewer do.
    """
    least = _least(form, sets, enough, pieces)

    def up_to(number: int) -> list[Attainable]:
        return [one.few(own + number - sum(least)) for one, own in zip(sets, least, strict=True)]

    choice, most = None, pieces
    for number in range(sum(least), pieces):
        choice = _near(form, sets, squares, least, number - sum(least))
        if choice is not None and choice[0].square <= enough:
            most = number
            break
        choice = None
    sure = True
    for number in range(sum(least), most + (choice is not None)):
        few = up_to(number)
        start = Found(enough, np.zeros(len(sets), dtype=complex), np.zeros((len(sets), 3), dtype=np.int64))
        now = time.perf_counter()
        if now > until:
            return choice, False
        left = search(form, few, squares, start, now + (until - now) / 3, chunk, number)
        complete = left >= start.square and all(one.complete for one in few)
        sure &= complete
        # What depends on the time that there was counts only where it saves pieces.
        if start.square < enough and (complete or number < most):
            return (start, few), sure
    return choice, sure


def _near(
    form: Form, sets: Sequence[Attainable], squares: Squares, least: Sequence[int], spare: int
) -> Choice | None:
    """The best choice near the exact weights, by rounding and exchange, of so many spare pieces."""
    best: Choice | None = None
    for more in islice(_shares(spare, len(sets)), _SHARES):
        few = [one.few(own + each) for one, own, each in zip(sets, least, more, strict=True)]
        with suppress(ValueError):  # where so few are too heavy for a plane
            tried = rounded(few, squares, form.D0[np.argsort(form.order)])
            polish(few, squares, tried, np.inf)
            taken = sum(int(one.pieces(key[None])[0]) for one, key in zip(few, tried.keys, strict=True))
            if taken <= sum(least) + spare and (best is None or tried.square < best[0].square):
                best = tried, few
    return best


def _shares(pieces: int, planes: int) -> Iterator[tuple[int, ...]]:
    """Every way to share pieces among planes, the most even first."""
    ends = combinations(range(pieces + planes - 1), planes - 1)
    each = ((b - a - 1 for a, b in pairwise((-1, *bars, pieces + planes - 1))) for bars in ends)
    return iter(sorted(map(tuple, each), key=lambda share: sum(n * n for n in share)))


def _least(form: Form, sets: Sequence[Attainable], enough: float, most: int) -> list[int]:
    """How many pieces each plane needs at least: its part of q ≤ enough is a disc."""
    least = [0] * len(sets)
    if np.linalg.matrix_rank(form.R) < len(form.R):
        return least
    room = np.sqrt(max(enough - form.const - float(form.m.sum()), 0.0))
    radii = room * np.linalg.norm(np.linalg.inv(form.R), axis=1) * (1 + 1e-9)
    for p, z, radius in zip(form.order, form.D0, radii, strict=True):
        while least[p] < most:
            few = sets[p].few(least[p])
            hit = few.near(complex(z), -1.0, float(radius), MOST)
            if hit is None or (few.pieces(hit[1]) <= least[p]).any():
                break
            least[p] += 1
    return least
