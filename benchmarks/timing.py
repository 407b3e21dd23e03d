"""Timing and comparing, the same for every benchmark."""

from __future__ import annotations

import gc
import time
from collections.abc import Callable
from dataclasses import dataclass
from typing import TypeVar

import numpy as np
from numpy.typing import ArrayLike

T = TypeVar("T")
R = TypeVar("R")


@dataclass(frozen=True)
class Row:
    """One line of the table."""

    task: str
    our_seconds: float
    peer: str
    peer_seconds: float
    difference: float  # relative, between the two answers
    allowed: float = 1e-6
    required_ratio: float = 1.0
    note: str = ""
    goal: float = 0.0
    """A ratio that is aimed at: below it the row says so, and nothing fails."""

    @property
    def ratio(self) -> float:
        return self.peer_seconds / self.our_seconds

    @property
    def failure(self) -> str:
        """What is wrong, or nothing."""
        if not self.difference <= self.allowed:
            return f"ANSWERS DIFFER by more than {self.allowed:.0e}"
        return "TOO SLOW" if self.ratio < self.required_ratio else ""


def best_of(make: Callable[[], T], call: Callable[[T], object], repeat: int) -> float:
    """Shortest of `repeat` calls, s, each on a fresh model; the first one, untimed, warms up."""
    call(make())
    times = []
    for _ in range(repeat):
        model = make()
        gc.disable()
        start = time.perf_counter()
        call(model)
        times.append(time.perf_counter() - start)
        gc.enable()
    return min(times)


def once(make: Callable[[], T], call: Callable[[T], R]) -> tuple[float, R]:
    """Duration of one call that takes seconds, s, and its answer."""
    model = make()
    start = time.perf_counter()
    answer = call(model)
    return time.perf_counter() - start, answer


def relative_difference(a: ArrayLike, b: ArrayLike) -> float:
    """Largest |a − b| / |b| over all entries."""
    a, b = np.asarray(a), np.asarray(b)
    if a.shape != b.shape or not (np.isfinite(a).all() and np.isfinite(b).all()):
        return float("inf")
    return float((np.abs(a - b) / np.abs(b)).max())
