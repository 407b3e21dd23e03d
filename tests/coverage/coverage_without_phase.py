"""Balancing without phases: do the regions of the solutions hold, and is what is mounted worth it?

Run `python tests/coverage/coverage_without_phase.py [jobs]`, jobs of each line (1000). One plane whose
correction is 1 at any angle; a baseline and equal trial weights at equal angles, 0.3–1.5 of the correction,
from any angle on; amplitudes scatter from run to run, each for itself. Two planes (a fifth of the jobs):
coefficients normal.
"""

from __future__ import annotations

import sys
from typing import NamedTuple

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


class Outcome(NamedTuple):
    """Whether a region holds the truth; whether to mount, and the share of the vibration that is left."""

    inside: bool
    mount: bool
    left: float


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
    names = [
        tuple(f"{letter}{k + 1}" for k in range(n))
        for letter, n in zip("rsp", (runs, sensors, planes), strict=True)
    ]
    errors = ReadingErrors(scatter) if stated else None
    speeds = np.array([100.0])
    return Trials(names[0], speeds, names[1], names[2], read[:, None], T, errors, amplitudes_only=True), D, W


def outcome(rng, *line):
    """Balance a job and see."""
    trials, D, W = draw(rng, *line)
    answer = balance_without_phase(trials)
    left = np.linalg.norm(W @ (answer.weights - D)) / np.linalg.norm(W @ D)
    return Outcome(answer.holds(D), answer.sound, float(left))


def simulate(jobs, *line, seed=1):
    """So many jobs."""
    rng = np.random.default_rng(seed)
    return [outcome(rng, *line) for _ in range(jobs)]


def shares(found):
    """Of jobs: regions that hold, mounted; of those mounted, worse than before."""
    mounted = [one.left for one in found if one.mount]
    worse = np.mean(np.array(mounted) > 1.0) if mounted else 0.0
    return np.mean([one.inside for one in found]), len(mounted) / len(found), worse


def main(jobs=1000):
    """Print the table."""
    print(f"{'':<40}{'holds':>8}{'mount':>8}{'worse':>8}")
    for name, *line in LINES:
        found = simulate(jobs if line[1] == 1 else max(jobs // 5, 1), *line)
        inside, mount, worse = shares(found)
        print(f"{name:<40}{100 * inside:>8.1f}{100 * mount:>8.1f}{100 * worse:>8.1f}", flush=True)


if __name__ == "__main__":
    main(*(int(word) for word in sys.argv[1:]))
