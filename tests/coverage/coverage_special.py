"""Do 95 % regions hold the truth where trial weights are unknown, and where the rotor is turned on its arbor?

Run `python tests/coverage/coverage_special.py [jobs]`, jobs of each row (1000). Errors are those of
`coverage_balance`. Unknown trial weights are 1 in the job, whatever they are. A rotor stands at two to four
indices without weights, and at any of them with a trial weight for each plane; or these runs are of another
day, when it was not turned. What counts is the region of the rotor's correction, or of its arbor's.
"""

from __future__ import annotations

import sys
from dataclasses import replace

import numpy as np
from coverage_balance import KINDS, ComplexArray, Outcome, between_runs, draw, line, normal, ordinary

from balancing import (
    Influence,
    ReadingErrors,
    RunScatter,
    Trials,
    UndeterminedError,
    correct,
    estimate_influence,
    rotor_and_arbor,
)

ROWS = {
    "trial weights of unknown mass and place": (0, False),
    "index: 0° and 180°": (2, False),
    "index: 3 positions": (3, False),
    "index: 4 positions": (4, False),
    "index: 0° and 180°, trial weights before": (2, True),
}


def relative(rng: np.random.Generator) -> tuple[Influence, ComplexArray]:
    """Coefficients of one job whose trial weights are taken as 1, and the factors that are true."""
    job = draw(rng, "stated", str(rng.choice(KINDS)), ordinary(rng))
    trial = job.trials.weights.sum(axis=0)
    trials = replace(job.trials, weights=job.trials.weights / trial)
    return estimate_influence(trials), job.D / trial


def turned(rng: np.random.Generator, count: int, *, before: bool) -> tuple[Influence, ComplexArray]:
    """Coefficients of the rotor, or of its arbor, in one job, and what is true of it."""
    reading, run = ordinary(rng)
    P, S = int(rng.integers(1, 4)), int(rng.integers(1, 4))
    C = max(int(rng.integers(2, 7)), P // S + 1)
    W, kind = normal(rng, S, C, P), str(rng.choice(KINDS[:-1]))
    rotor, arbor = normal(rng, P), normal(rng, P)
    size = np.exp(rng.uniform(np.log(0.3), np.log(1.5), P)) * abs(rotor)
    T = np.diag(size * np.exp(2j * np.pi * rng.random(P)))
    position = 2 * np.pi * np.arange(count) / count

    def runs(index: np.ndarray, T: ComplexArray) -> Trials:
        turn = np.exp(1j * index)[:, None, None]
        Y = np.einsum("scp,rp->rsc", W, T - rotor) * turn - W @ arbor
        Y = Y + run * between_runs(rng, kind, Y, W)
        a, b = rng.standard_normal((2, *Y.shape))
        names = [tuple(f"{name}{k}" for k in range(n)) for name, n in (("r", len(T)), ("s", C), ("p", P))]
        Y = Y * (1 + reading * a) * np.exp(1j * reading * b)
        errors = ReadingErrors(reading, reading), RunScatter(run)
        trials = Trials(names[0], 100.0 * np.arange(1, S + 1), *names[1:], Y, T, errors[0], index=index)
        return replace(trials, run_errors=errors[1])

    bare = np.zeros((count, P), dtype=complex)
    if before:
        first = runs(np.zeros(P + 1), np.vstack((bare[:1], T)))
        stored = estimate_influence(replace(first, index=None))
        both = rotor_and_arbor(runs(position, bare), stored)
    else:
        index = np.append(position, rng.choice(position, P))
        both = rotor_and_arbor(runs(index, np.vstack((bare, T))))
    which = int(rng.integers(2))
    return both[which], (rotor, arbor)[which]


def outcome(rng: np.random.Generator, count: int, *, before: bool) -> Outcome:
    """Whether the joint region of one job holds the truth."""
    try:
        influence, truth = turned(rng, count, before=before) if count else relative(rng)
        correction = correct(influence)
    except UndeterminedError as error:
        return Outcome(None, (str(error),), 0)
    return Outcome(correction.region().holds(truth), correction.warnings, 0)


def main(jobs: int = 1000) -> None:
    """Print the table."""
    print(f"{'':<44}{'silent':>15}{'warned':>17}{'refused':>9}")
    for k, (name, (count, before)) in enumerate(ROWS.items()):
        rng = np.random.default_rng([11, k])
        print(line(name, [outcome(rng, count, before=before) for _ in range(jobs)]), flush=True)


if __name__ == "__main__":
    main(*(int(word) for word in sys.argv[1:]))
