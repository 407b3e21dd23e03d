"""Timing and comparing, the same for every benchmark."""

from __future__ import annotations

import gc
import time
from collections.abc import Callable
from dataclasses import dataclass
from functools import cache
from typing import TypeVar

import numpy as np
from numpy.typing import ArrayLike

T = TypeVar("T")
R = TypeVar("R")


@dataclass(frozen=True)
class Row:
    """One line of the table."""

    task: str
    ours: str
    our_seconds: float
    peer: str
    peer_seconds: float
    difference: float  # relative, between the two answers
    allowed: float
    required_ratio: float
    note: str = ""
    goal: float = 0.0
    """A ratio that is aimed at: below it the row says so, and nothing fails."""

    @property
    def ratio(self) -> float:
        return self.peer_seconds / self.our_seconds

    @property
    def agrees(self) -> bool:
        return bool(self.difference <= self.allowed)

    @property
    def fast_enough(self) -> bool:
        return self.ratio >= self.required_ratio


def best_of(make: Callable[[], T], call: Callable[[T], object], repeat: int) -> float:
    """Shortest of `repeat` calls, s, each on a fresh model; the first one, untimed, warms up."""
    call(make())
    times = []
    for _ in range(repeat):
        model = make()
        gc.disable()
        try:
            start = time.perf_counter()
            call(model)
            times.append(time.perf_counter() - start)
        finally:
            gc.enable()
    return min(times)


def once(make: Callable[[], T], call: Callable[[T], R]) -> tuple[float, R]:
    """Duration of one call that takes seconds, s, and its answer."""
    model = make()
    start = time.perf_counter()
    answer = call(model)
    return time.perf_counter() - start, answer


@cache
def numpy_lstsq() -> float:
    """Duration of `numpy.linalg.lstsq`, 1,000 equations with 60 unknowns, s: a unit without a peer."""
    rng = np.random.default_rng(0)
    A, b = rng.standard_normal((1000, 60)), rng.standard_normal(1000)
    return best_of(lambda: None, lambda _: np.linalg.lstsq(A, b, rcond=None), 30)


def against_numpy(
    task: str, seconds: float, calls: int, difference: float, allowed: float, note: str = ""
) -> Row:
    """Work without a peer against so many calls of `numpy_lstsq`, which it must not exceed."""
    peer = f"{calls} × numpy lstsq"
    return Row(task, "rotorid", seconds, peer, calls * numpy_lstsq(), difference, allowed, 1.0, note)


def scaling(task: str, seconds: dict[int, float], few: int, many: int) -> Row:
    """Cost at `many` elements against that at `few`: no faster than linear, so the ratio is at least 1."""
    return Row(
        task=task,
        ours=f"{many} elements",
        our_seconds=seconds[many],
        peer=f"{many / few:g} × {few} elements",
        peer_seconds=many / few * seconds[few],
        difference=0.0,
        allowed=0.0,
        required_ratio=1.0,
    )


def relative_difference(a: ArrayLike, b: ArrayLike) -> float:
    """Largest |a − b| / |b| over all entries."""
    a, b = np.asarray(a), np.asarray(b)
    if a.shape != b.shape or not (np.isfinite(a).all() and np.isfinite(b).all()):
        return float("inf")
    return float((np.abs(a - b) / np.abs(b)).max())
