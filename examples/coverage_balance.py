"""Are the 95 % regions of the correction weights honest? Drawn jobs whose truth is known.

Run `python examples/coverage_balance.py [jobs]`, jobs of each table (2000). An ordinary job: 1–4 planes, 2–8
sensors, 1–5 speeds, more readings than planes; coefficients normal, with different sensitivities of sensors
(30 %) and speeds (50 %); a trial weight for each plane, 0.3–1.5 of its correction; 0.5–5 % of error in each
reading, and errors between runs: none in a fifth of the jobs, else up to 5 %. Spare runs are one to four, the
bare rotor or one of the planes again. A region counts as it is stated: all planes jointly, by F or χ².
"""

from __future__ import annotations

import sys
from collections.abc import Callable, Iterable, Sequence
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray
from scipy.special import chdtri, fdtri

from balancing import Correction, ReadingErrors, Trials, UndeterminedError, correct, estimate_influence
from balancing.data.errors import ASSUMED
from balancing.data.trials import RunScatter
from rotorid.regression import stretch

ComplexArray = NDArray[np.complex128]

SOURCES = ("stated", "stated, spare runs", "readings stated, spare", "repeats, spare runs", "spare runs")
KINDS = ("independent", "half of each", "common at a speed", "common to a run", "further unbalance")
TIMES = (0.5, 1.0, 1.5, 2.5)


class Job(NamedTuple):
    """Runs, the truth (P,), and how many real readings the runs have more than unknowns."""

    trials: Trials
    D: ComplexArray
    redundant: int


class Outcome(NamedTuple):
    """Whether the region holds the truth, and the warnings; None and why for a job refused."""

    inside: bool | None
    warnings: tuple[str, ...]
    redundant: int
    source: str
    kind: str


def normal(rng: np.random.Generator, *shape: int) -> ComplexArray:
    """Complex, of variance 1 in each direction."""
    return np.asarray(rng.standard_normal(shape) + 1j * rng.standard_normal(shape))


def between_runs(rng: np.random.Generator, kind: str, Y: ComplexArray, effect: ComplexArray) -> ComplexArray:
    """Errors of size 1 of the readings (R, S, C); `effect` (S, C, P) is what the correction does by plane."""
    R, S, C = Y.shape
    if kind == "further unbalance":  # of each plane
        return np.asarray(np.einsum("scp,rp->rsc", effect, normal(rng, R, effect.shape[-1])))
    common = {"common at a speed": (R, S, 1), "independent": (R, S, C)}.get(kind, (R, 1, 1))
    factor = normal(rng, *common)
    if kind == "half of each":
        factor = (factor + normal(rng, R, S, C)) / np.sqrt(2)
    return np.asarray(factor * Y)


def draw(rng: np.random.Generator, source: str, kind: str, reading: float, run: float, told: float) -> Job:
    """An ordinary job; errors of the readings and between runs, `told` times as large as is stated of them."""
    P, S, C = int(rng.integers(1, 5)), int(rng.integers(1, 6)), int(rng.integers(2, 9))
    C = max(C, P // S + 1)
    W = normal(rng, S, C, P)
    W *= np.exp(0.5 * rng.standard_normal((S, 1, 1)) + 0.3 * rng.standard_normal((1, C, 1)))
    D = normal(rng, P)
    spare = int(rng.integers(1, 5)) if "spare" in source else 0
    planes = [-1, *range(P), *rng.choice([-1, *range(P)], spare)]
    T = np.zeros((len(planes), P), dtype=complex)
    for weights, plane in zip(T, planes, strict=True):
        if plane >= 0:
            size = np.exp(rng.uniform(np.log(0.3), np.log(1.5))) * abs(D[plane])
            weights[plane] = size * np.exp(2j * np.pi * rng.random())
    Y = np.einsum("scp,rp->rsc", W, T - D)
    effect = W * np.sqrt(np.mean(np.abs(D) ** 2))
    Y = Y + run * between_runs(rng, kind, Y, effect)
    floor = np.sqrt(np.mean(np.sum(np.abs(effect) ** 2, axis=-1)))
    scatter = RunScatter(0.0, run / told * floor) if kind == KINDS[-1] else RunScatter(run / told)
    a, b = rng.standard_normal((2, 3 if "repeats" in source else 1, *Y.shape))
    stated, between = "stated" in source, source in ("stated", "stated, spare runs") and run > 0
    trials = Trials(
        runs=tuple(f"run {r + 1}" for r in range(len(T))),
        speeds=100.0 * np.arange(1, S + 1),
        sensors=tuple(f"S{c + 1}" for c in range(C)),
        planes=tuple("ABCD"[:P]),
        readings=Y * (1 + reading * a) * np.exp(1j * reading * b),
        weights=T,
        errors=ReadingErrors(reading / told, reading / told) if stated else None,
        run_errors=scatter if between else None,
    )
    return Job(trials, D, 2 * (S * C * (spare + 1) - P))


def outcome(job: Job, source: str, kind: str) -> Outcome:
    """Balance a job and see."""
    try:
        found = correct(estimate_influence(job.trials))
    except UndeterminedError as error:
        return Outcome(None, (str(error),), job.redundant, source, kind)
    return Outcome(holds(found, job.D), found.warnings, job.redundant, source, kind)


def holds(found: Correction, D: ComplexArray) -> bool:
    """Whether the joint 95 % region of the weights holds D."""
    assert found.covariance is not None
    d, n = stretch(found.weights - D), 2 * len(D)
    bound = chdtri(n, 0.05) if found.dof is None else n * fdtri(n, found.dof, 0.95)
    return bool(d @ np.linalg.solve(found.covariance, d) < bound)
