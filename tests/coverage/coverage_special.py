"""Do 95 % regions hold the truth where trial weights are unknown, and where the rotor is turned on its arbor?

Run `python tests/coverage/coverage_special.py [jobs]`, jobs of each row (1000). They are those of
`coverage_balance`, errors of all kinds between runs. The trial weights of relative answers are 1 in the job,
or stand at 0°, whatever they are. A rotor stands at two, three or four indices without weights, and at any of
them with a trial weight for each plane, unless coefficients are stored (of errors 2 %) or exact.
"""

from __future__ import annotations

import sys
from collections.abc import Callable
from dataclasses import replace

import numpy as np
from coverage_balance import (
    KINDS,
    SOURCES,
    ComplexArray,
    Outcome,
    between_runs,
    draw,
    line,
    normal,
    ordinary,
)

from balancing import (
    Gaussian,
    Influence,
    ReadingErrors,
    RunScatter,
    Trials,
    UndeterminedError,
    correct,
    estimate_influence,
    reading_of,
    rotor_and_arbor,
    usual_run_errors,
)

RELATIVE = "relative: mass and place unknown", "relative: mass known, spare runs"
INDEX = {
    "index: 0° and 180°, trial weights": (2, None),
    "index: 3 positions, trial weights": (3, None),
    "index: 4 positions, trial weights": (4, None),
    "index: 0° and 180°, stored coefficients": (2, 0.02),
    "index: 4 positions, calibrated machine": (4, 0.0),
}


def inside(found: Influence, truth: ComplexArray) -> tuple[bool, tuple[str, ...]]:
    """Whether the joint region holds the truth, and the warnings."""
    correction = correct(found)
    return correction.region().holds(truth), correction.warnings


def relative(rng: np.random.Generator, kind: str) -> Outcome:
    """One job whose trial weights are taken as 1, or at 0°; truth: factors."""
    known = RELATIVE.index(kind)
    job = draw(rng, SOURCES[known], str(rng.choice(KINDS)), ordinary(rng))
    T = job.trials.weights
    first = np.array([column[np.flatnonzero(column)[0]] for column in T.T])
    unit = first / np.abs(first) if known else first
    # each run of a plane has a weight of its own in these jobs, which is known relative to the first
    trials = replace(job.trials, weights=T / unit)
    try:
        return Outcome(*inside(estimate_influence(trials), job.D / unit), job.redundant)
    except UndeterminedError as error:
        return Outcome(None, (str(error),), job.redundant)


def turned(rng: np.random.Generator, kind: str) -> Outcome:
    """One job of a rotor on its arbor; truth: what corrects the rotor, and (by turns) the arbor."""
    count, stored = INDEX[kind]
    reading, run = ordinary(rng)
    P, S = int(rng.integers(1, 4)), int(rng.integers(1, 4))
    C = max(int(rng.integers(2, 7)), P // S + 1)
    if stored == 0.0:
        C = P
    W = normal(rng, S, C, P) if stored != 0.0 else np.broadcast_to(np.eye(P, dtype=complex), (S, P, P))
    D, arbor = normal(rng, P), normal(rng, P)
    position = 2 * np.pi * np.arange(count) / count
    index = np.append(position, [] if stored is not None else rng.choice(position, P))
    T = np.zeros((len(index), P), dtype=complex)
    if stored is None:
        size = np.exp(rng.uniform(np.log(0.3), np.log(1.5), P)) * np.abs(D)
        T[count:] = np.diag(size * np.exp(2j * np.pi * rng.random(P)))
    turn = np.exp(1j * index)[:, None, None]
    Y = -W @ arbor + np.einsum("scp,rp->rsc", W, T - D) * turn
    among = str(rng.choice(KINDS[:-1]))
    Y = Y + run * between_runs(rng, among, Y, W)
    a, b = rng.standard_normal((2, 1, *Y.shape))
    trials = Trials(
        runs=tuple(f"run {r}" for r in range(len(T))),
        speeds=100.0 * np.arange(1, S + 1),
        sensors=tuple(f"S{c}" for c in range(C)),
        planes=tuple("ABC"[:P]) if stored is None else (),
        readings=Y * (1 + reading * a) * np.exp(1j * reading * b),
        weights=T if stored is None else T[:, :0],
        errors=ReadingErrors(reading, reading),
        run_errors=RunScatter(run),
        index=index,
    )
    influence = None if stored is None else coefficients(rng, trials, W, stored)
    which = int(rng.integers(2))
    try:
        part = rotor_and_arbor(trials, influence)[which]
        return Outcome(*inside(part, (D, arbor)[which]), 0)
    except UndeterminedError as error:
        return Outcome(None, (str(error),), 0)


def coefficients(rng: np.random.Generator, trials: Trials, W: ComplexArray, error: float) -> Influence:
    """Stored coefficients with an error of each, relative to their root mean square."""
    S, C, P = W.shape
    size = error * np.sqrt(np.mean(np.abs(W) ** 2))
    blocks = np.zeros((S, C, 2 * P + 2, 2 * P + 2))
    blocks[..., 2:, 2:] = size**2 * np.eye(2 * P)
    none = np.zeros((0, S, C, P + 1), dtype=complex)
    errors = Gaussian(blocks, none, reading_of(trials), usual_run_errors(trials))
    names = trials.speeds, trials.sensors, tuple("ABC"[:P])
    return Influence(*names, W + size * normal(rng, S, C, P), np.full((S, C), np.nan + 0j), errors)


def simulate(jobs: int, kind: str, one: Callable[[np.random.Generator, str], Outcome]) -> list[Outcome]:
    """So many jobs of a row."""
    rng = np.random.default_rng([11, len(kind), sum(map(ord, kind))])
    return [one(rng, kind) for _ in range(jobs)]


def main(jobs: int = 1000) -> None:
    """Print the table."""
    print(f"{'':<44}{'silent':>15}{'warned':>17}{'refused':>9}")
    for kinds, one in ((RELATIVE, relative), (INDEX, turned)):
        for kind in kinds:
            print(line(kind, simulate(jobs, kind, one)), flush=True)


if __name__ == "__main__":
    main(*(int(word) for word in sys.argv[1:]))
