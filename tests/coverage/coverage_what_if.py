"""Does what is predicted for given weights hold? Drawn jobs whose truth is known, each with a check run.

Run `python tests/coverage/coverage_what_if.py [jobs]`, jobs in all (1000).
The jobs are those of `coverage_balance`. The weights are the true correction, each off by 0.1–1 of its size
in any direction. The check run has the errors of every other run. Corrections that may make it worse are
those of the first speed; at the others there is unbalance outside the planes, 0.3–3 times what these hold.
"""

from __future__ import annotations

import sys
from collections.abc import Sequence
from dataclasses import replace
from typing import NamedTuple

import coverage_balance as balance
import numpy as np

from balancing import UndeterminedError, correct, estimate_influence, what_if
from balancing.errors import rms


class Outcome(NamedTuple):
    """Of one job: which readings are within ±, whether the rms is, and below its bound.

    `truly`: whether the word is that of the truth, None for "hardly different".
    `rises`: whether a correction makes a reading worse at other speeds, by a tenth of the largest and more;
    whether it says so, and wrongly, of a reading that does not rise. None: it has all speeds.
    """

    readings: Sequence[bool]
    width: bool
    below: bool
    truly: bool | None
    rises: tuple[bool, bool, bool] | None


def outcome(rng: np.random.Generator, source: str, kind: str) -> Outcome | None:
    """Predict a check run, and read it; None where coefficients are refused."""
    errors = balance.ordinary(rng)
    job = balance.draw(rng, source, kind, errors)
    trials, D, W = job.trials, job.D, job.W
    try:
        influence = estimate_influence(trials)
    except UndeterminedError:
        return None
    P = len(D)
    off = np.exp(rng.uniform(np.log(0.1), 0.0)) * balance.normal(rng, P) / np.sqrt(2)
    M = D * (1 + off)
    made = what_if(influence, dict(zip(trials.planes, M, strict=True)))
    true = W @ (M - D)
    effect = W * np.sqrt(np.mean(np.abs(D) ** 2))
    read = true + errors[1] * balance.between_runs(rng, kind, true[None], effect)[0]
    a, b = errors[0] * rng.standard_normal((2, *read.shape))
    read = read * (1 + a) * np.exp(1j * b)
    inside = np.abs(read - made.after) * made.labels.vibration_scale <= made.within
    size, before = rms(read), rms(W @ D)
    truly = {"better": rms(true) < before, "worse": rms(true) > before}.get(made.word)
    return Outcome(
        inside.ravel().tolist(),
        bool(abs(size - rms(made.after)) <= made.rms_within),
        bool(size <= made.check_rms),
        truly,
        rises(rng, job),
    )


def rises(rng: np.random.Generator, job: balance.Job) -> tuple[bool, bool, bool] | None:
    """As of `Outcome`."""
    trials, D, W = job.trials, job.D, job.W
    S, C, P = W.shape
    if S < 2 or C < P:
        return None
    further = balance.normal(rng, S, C) * np.exp(rng.uniform(np.log(0.3), np.log(3.0))) * rms(W @ D)
    further[0] = 0
    try:
        influence = estimate_influence(replace(trials, readings=trials.readings + further))
        made = correct(influence, speeds=trials.speeds[:1])
    except UndeterminedError:
        return None
    old, new = np.abs(further - W @ D), np.abs(further + W @ (made.weights - D))
    said = " ".join(made.decision.elsewhere)
    at = [f"at {made.labels.speed_words(speed)} " in said for speed in trials.speeds]
    named = np.array([[here and f": {name} " in said for name in trials.sensors] for here in at])
    return bool((new[1:] - old[1:]).max() > 0.1 * old.max()), bool(said), bool((named & (new < old)).any())


def simulate(jobs: int, source: str, seed: int = 3) -> list[Outcome]:
    """So many jobs of a source of errors, of all kinds in turn."""
    rng = np.random.default_rng([seed, balance.SOURCES.index(source)])
    kinds = [balance.KINDS[k % len(balance.KINDS)] for k in range(jobs)]
    return [one for kind in kinds if (one := outcome(rng, source, kind)) is not None]


def line(name: str, found: Sequence[Outcome]) -> str:
    """Shares of what holds, per cent."""
    truly = [one.truly for one in found if one.truly is not None]
    rising = np.array([one.rises for one in found if one.rises is not None]).T
    cells = (
        [inside for one in found for inside in one.readings],
        [one.width for one in found],
        [one.below for one in found],
        truly,
        rising[1][rising[0]],
        rising[2],
    )
    return f"{name:<24}" + "".join(f"{balance.percent(cell):>10}" for cell in cells) + f"{len(found):8d}"


def main(jobs: int = 1000) -> None:
    """Print the table."""
    heads = ("reading ±", "rms ±", "rms below", "word true", "rise seen", "wrongly")
    print(" " * 24 + "".join(f"{head:>10}" for head in heads) + f"{'jobs':>8}")
    every: list[Outcome] = []
    for source in balance.SOURCES:
        found = simulate(jobs // len(balance.SOURCES), source)
        every += found
        print(line(source, found))
    print(line("all", every))


if __name__ == "__main__":
    main(*(int(word) for word in sys.argv[1:]))
