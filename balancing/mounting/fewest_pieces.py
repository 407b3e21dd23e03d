"""The fewest pieces that leave little more than the least vibration.

For one number of pieces after the other, from the least that every plane needs, the best choice of so many is
searched (`balancing.mounting.discrete_search`): vectors of few pieces can be listed where all cannot. The first
number with a choice that is good enough is the fewest, and what that search found is the best of so many.
"""

from __future__ import annotations

import time
from collections.abc import Sequence

import numpy as np

from balancing.mounting.discrete_bounds import Form
from balancing.mounting.discrete_search import Found, Squares, search
from balancing.mounting.mountable_vectors import MOST, Attainable

__all__ = ["FEW", "fewest"]

FEW = 1.2
"""So many times the least is good enough for fewer pieces."""


def fewest(
    form: Form,
    sets: Sequence[Attainable],
    squares: Squares,
    enough: float,
    pieces: int,
    until: float,
    chunk: int,
) -> tuple[Found | None, bool]:
    """The best choice of the fewest pieces whose squared objective is at most `enough`, and whether it is sure.

    Parameters
    ----------
    form, sets, squares, until, chunk
        As for `search`.
    enough
        Squared objective.
    pieces
        Of a choice that is known to be good enough; None is returned where no fewer do.
    """
    least, sure = _least(form, sets, enough, pieces), True
    for number in range(sum(least), pieces):
        found = Found(enough, np.zeros(len(sets), dtype=complex), np.zeros((len(sets), 3), dtype=np.int64))
        now = time.perf_counter()
        left = search(form, sets, squares, found, now + (until - now) / 2, chunk, number, least)
        sure &= left >= found.square and all(one.lists_all(number) for one in sets)
        if found.square < enough:
            return found, sure
    return None, sure


def _least(form: Form, sets: Sequence[Attainable], enough: float, pieces: int) -> list[int]:
    """How many pieces each plane needs at least, in the order of the form: its part of q ≤ enough is a disc."""
    size = np.sqrt(max(enough - form.const - float(form.m.sum()), 0.0))
    with np.errstate(all="ignore"):
        across = np.linalg.norm(np.linalg.pinv(form.R), axis=1)
    whole = np.linalg.matrix_rank(form.R) == len(form.R)
    least = [0] * len(sets)
    for k, p in enumerate(form.order if whole else ()):
        radius = float(size * across[k]) * (1 + 1e-9)
        while least[k] < pieces:
            hit = sets[p].near(complex(form.D0[k]), -1.0, radius, MOST, pieces=least[k])
            if hit is None or len(hit[0]):
                break
            least[k] += 1
    return least
