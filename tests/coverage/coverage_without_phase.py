"""Balancing without phases: do the regions of the solutions hold, and is what is mounted worth it?

Run `python tests/coverage/coverage_without_phase.py [jobs]`, jobs of each line (1000). One plane whose
correction is 1 at any angle; a baseline and equal trial weights at equal angles, 0.3–1.5 of the correction,
from any angle on; amplitudes scatter from run to run, each for itself. Two planes: coefficients normal.
"""

from __future__ import annotations

import sys
from typing import NamedTuple

import numpy as np

from balancing import ReadingErrors, Trials, balance_without_phase, real_parts

LINES = (
    ("two trial weights, 10 %", 3, 1, 1, 0.1, True),
    ("four runs, 10 %", 4, 1, 1, 0.1, True),
    ("four runs, 2 %", 4, 1, 1, 0.02, True),
    ("four runs of three sensors, 10 %", 4, 1, 3, 0.1, True),
    ("seven runs, 10 %", 7, 1, 1, 0.1, True),
    ("seven runs, 10 %, estimated", 7, 1, 1, 0.1, False),
    ("seven runs, 2 %", 7, 1, 1, 0.02, True),
    ("two planes, seven runs, 2 %", 7, 2, 3, 0.02, True),
)
"""Runs, planes, sensors, scatter, and whether it is stated."""


class Outcome(NamedTuple):
    """Whether a region, and intervals, hold the truth; whether to mount, and the share of vibration left.

    `sizes`, `angles`: shares of the planes; `width`: ± of the angle by the least possible.
    """

    inside: bool
    sizes: float
    angles: float
    mount: bool
    left: float
    width: float


def draw(rng, runs, planes, sensors, scatter, stated):
    """A job, and its correction."""
    D = np.exp(2j * np.pi * rng.random(planes))
    T, each = np.zeros((runs, planes), dtype=complex), (runs - 1) // planes
    for p in range(planes):
        size = np.exp(rng.uniform(np.log(0.3), np.log(1.5)))
        first, step = 2j * np.pi * rng.random(), 1 / max(each, 3)
        T[1 + p * each : 1 + (p + 1) * each, p] = size * np.exp(first + 2j * np.pi * step * np.arange(each))
    W = rng.standard_normal((sensors, planes)) + 1j * rng.standard_normal((sensors, planes))
    W = W / np.abs(W) if planes == 1 else W
    truth = np.abs((T - D) @ W.T)
    read = np.abs(truth * (1 + scatter * rng.standard_normal(truth.shape)))
    names = [tuple(map(str, range(n))) for n in (runs, sensors, planes)]
    errors = ReadingErrors(scatter) if stated else None
    return Trials(names[0], [100.0], *names[1:], read[:, None], T, errors, amplitudes_only=True), D, W


def held(solution, D):
    """Whether the intervals of a solution hold size and angle of each plane's weight, (2, P)."""
    low, high, angle = solution.intervals
    off = np.abs(np.angle(D * solution.weights.conj()))
    return np.array([(low <= np.abs(D)) & (np.abs(D) <= high), off <= angle])


def within(answer, solution, D):
    """Whether the region of a solution holds the truth: it misses no more, or is no further away than draws."""
    if len(D) > 1:
        off = real_parts(np.vstack((D, solution.region)) - solution.weights)
        far = (off @ np.linalg.inv(np.cov(off[1:].T)) * off).sum(axis=1)
        return far[0] <= far[1:].max()
    places = np.array([D, solution.weights])[:, None]
    a, g = (np.abs(of) / answer.errors for of in (answer.trials.mean[:, 0], answer.trials.weights - places))
    more, less = ((g * a).sum(axis=1) ** 2 / (g * g).sum(axis=1)).sum(axis=1)
    return less - more <= answer.scatter.limit(2, 0.95)


def least_width(T, D, sensors, scatter):
    """Least 95 % of the angle: ln of readings is that of distances from one weight, and one constant."""
    q = (D / (T - D))[:, 0]
    J = np.column_stack((q.real, q.imag))
    J -= J.mean(axis=0)
    return 1.96 * scatter * np.sqrt(np.linalg.inv(J.T @ J * sensors)[1, 1])


def outcome(rng, *line):
    """Balance a job and see."""
    trials, D, W = draw(rng, *line)
    answer = balance_without_phase(trials)
    left = np.linalg.norm(W @ (answer.weights - D)) / np.linalg.norm(W @ D)
    sizes, angles = np.any([held(one, D) for one in answer.solutions], axis=0).mean(axis=1)
    inside = any(within(answer, one, D) for one in answer.solutions)
    width = answer.solutions[0].intervals[2][0] / least_width(trials.weights, D, *line[2:4])
    return Outcome(inside, sizes, angles, answer.sound, float(left), width)


def simulate(jobs, *line, seed=1):
    """So many jobs."""
    rng = np.random.default_rng(seed)
    return [outcome(rng, *line) for _ in range(jobs)]


def shares(found):
    """Of jobs: what holds, together and each, mounted; of those mounted, worse than before; median width."""
    mounted = [one.left for one in found if one.mount]
    worse = np.mean(np.array(mounted) > 1.0) if mounted else 0.0
    return *np.mean([one[:4] for one in found], axis=0), worse, np.median([one.width for one in found])


def main(jobs=1000):
    """Print the table."""
    print(" " * 43 + "holds   sizes  angles   mount   worse   ±/C–R")
    for name, *line in LINES:
        *each, width = shares(simulate(jobs, *line))
        words = "".join(f"{100 * share:>8.1f}" for share in each)
        print(f"{name:<40}{words}{width if line[1] == 1 else np.nan:>8.2f}".replace("nan", "  –"), flush=True)


if __name__ == "__main__":
    main(*(int(word) for word in sys.argv[1:]))
