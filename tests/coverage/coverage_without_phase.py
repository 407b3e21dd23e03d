"""Balancing without phases: do the regions of the solutions hold, and is what is mounted worth it?

Run `python tests/coverage/coverage_without_phase.py [jobs]`, jobs of each line (1000). One plane whose
correction is 1 at any angle; a baseline and equal trial weights at equal angles, 0.3–1.5 of the correction,
from any angle on; amplitudes scatter from run to run, each for itself. Two planes: coefficients normal.
"""

from __future__ import annotations

import sys

import numpy as np

from balancing import ReadingErrors, Trials, balance_without_phase

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


def draw(rng, runs, planes, sensors, scatter, stated):
    """A job, and its correction."""
    D = np.exp(2j * np.pi * rng.random(planes))
    T, each = np.zeros((runs, planes), dtype=complex), (runs - 1) // planes
    for p in range(planes):
        size, first = 0.3 * 5 ** rng.random(), rng.random()
        turns = first + np.arange(each) / max(each, 3)
        T[1 + p * each : 1 + (p + 1) * each, p] = size * np.exp(2j * np.pi * turns)
    real, imaginary = rng.standard_normal((2, sensors, planes))
    W = real + 1j * imaginary
    truth = abs((T - D) @ W.T)
    read = abs(truth * (1 + scatter * rng.standard_normal(truth.shape)))
    names = [tuple(map(str, range(n))) for n in (runs, sensors, planes)]
    errors = ReadingErrors(scatter) if stated else None
    return Trials(names[0], [100.0], *names[1:], read[:, None], T, errors, amplitudes_only=True), D, W


def held(solution, D):
    """Whether the intervals of a solution hold size and angle of each plane's weight, (2, P)."""
    low, high, angle = solution.intervals
    off = abs(np.angle(D * solution.weights.conj()))
    return np.array([(low <= abs(D)) & (abs(D) <= high), off <= angle])


def least_width(T, D, sensors, scatter):
    """Least ± of the angle, by Cramér and Rao, for size and angle to hold together with 95 %.

    ln of readings is that of distances from one weight, and one constant.
    """
    q = (D / (T - D))[:, 0]
    covariance = scatter**2 * np.linalg.inv(np.cov(q.real, q.imag)) / (sensors * len(q[1:]))
    return 2.236 * covariance[1, 1] ** 0.5


def outcome(rng, *line):
    """Balance a job and see.

    Whether all intervals of one solution hold the truth; shares of the planes whose size, and angle, one
    holds; whether to mount, and the share of the vibration left; ± of the angle by the least possible.
    """
    trials, D, W = draw(rng, *line)
    answer = balance_without_phase(trials)
    left = np.linalg.norm(W @ (answer.weights - D)) / np.linalg.norm(W @ D)
    each = np.array([held(one, D) for one in answer.solutions])
    holds = each.all(axis=(1, 2)).any(), *each.any(axis=0).mean(axis=1)
    width = answer.solutions[0].intervals[2][0] / least_width(trials.weights, D, *line[2:4])
    return *holds, answer.sound, left, width


def shares(jobs, *line):
    """Of so many jobs: what holds, together and each, mounted; of those mounted, worse than before; width."""
    rng = np.random.default_rng(1)
    *holds, mount, left, width = np.array([outcome(rng, *line) for _ in range(jobs)]).T
    worse = (mount * (left > 1)).sum() / max(mount.sum(), 1)
    return *np.mean([*holds, mount], axis=1), worse, np.median(width)


def main(jobs=1000):
    """Print the table."""
    print(" " * 43 + "holds   sizes  angles   mount   worse   ±/C–R")
    for name, *line in LINES:
        *each, width = shares(jobs, *line)
        words = "".join(f"{100 * share:>8.1f}" for share in each)
        print(f"{name:<40}{words}{width if line[1] == 1 else np.nan:>8.2f}".replace("nan", "  –"), flush=True)


if __name__ == "__main__":
    main(*map(int, sys.argv[1:]))
