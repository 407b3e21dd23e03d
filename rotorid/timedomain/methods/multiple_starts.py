"""Several starts: where to begin, and which ends are the same minimum."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np

from rotorid.base.arrays import FloatArray
from rotorid.timedomain.methods.iteration_history import Path

SAME = 1e-3
"""Relative difference of parameters below which two minima are one."""
MOST_STARTS = 10_000


@dataclass(frozen=True)
class Minimum:
    """Where one or more starts ended.

    Attributes
    ----------
    values
        Parameters, by name.
    cost
        Half the sum of squared weighted residuals.
    starts
        How many starts ended here.
    """

    values: dict[str, float]
    cost: float
    starts: int


def spread_starts(first: FloatArray, limits: FloatArray, count: int, seed: int) -> list[FloatArray]:
    """The first start, and others: a Latin hypercube over the bounds.

    Where a parameter has no bounds, it ranges from a tenth to ten times its first value (from −1 to 1 if that
    is 0), and not beyond the bound it has.

    Parameters
    ----------
    first
        Starting values (n,).
    limits
        Bounds (n, 2), ±inf for none.
    count
        Of all starts.
    seed
        Of the random numbers: the same starts every time.

    Raises
    ------
    ValueError
        For more starts than any record is worth.
    """
    if count > MOST_STARTS:
        raise ValueError(f"at most {MOST_STARTS:,} starts, not {count:,}")
    rng = np.random.default_rng(seed)
    n, m = len(first), count - 1
    if m < 1:
        return [first]
    cells = np.array([rng.permutation(m) for _ in range(n)]).T
    share = (cells + rng.random((m, n))) / m
    bounded = np.isfinite(limits).all(axis=1)
    with np.errstate(invalid="ignore", over="ignore"):
        inner = np.where(bounded, limits[:, 0] + share * (limits[:, 1] - limits[:, 0]), 0.0)
    around = np.where(first == 0, 2 * share - 1, first * 10 ** (2 * share - 1))
    table = np.clip(np.where(bounded, inner, around), limits[:, 0], limits[:, 1])
    return [first, *table]


def merge(paths: Sequence[Path], cost: Callable[[Path], float]) -> tuple[Minimum, ...]:
    """Different minima, the best first."""
    kept: list[tuple[FloatArray, float, int]] = []
    for path in sorted(paths, key=cost):
        reached, found = cost(path), path.estimate
        theta = found.solution
        for i, (other, least, count) in enumerate(kept):
            # parameters that are not determined may differ at the same cost
            near = np.abs(theta - other) <= SAME * np.maximum(np.abs(theta), np.abs(other)) + 1e-12
            if near.all() or (not found.full_rank and abs(reached - least) <= 1e-6 * least):
                kept[i] = other, least, count + 1
                break
        else:
            kept.append((theta, reached, 1))
    return tuple(
        Minimum(dict(zip(paths[0].names, theta.tolist(), strict=True)), least, count)
        for theta, least, count in kept
    )
