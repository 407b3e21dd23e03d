"""Types of machines whose truth is drawn: do first shots hold what they say, are odd machines found?

Each of 20 types has 50 machines whose coefficients differ by 15 % and 20° (one standard deviation), measured
with 3 % from run to run. A further machine of the type is balanced from its baseline alone, then with a trial
run in one plane, then in all. Three kinds: each coefficient for itself, planes alike (the sensors' gains and
delays differ), the whole machine alike. Of odd machines there are three in each type.

    python tests/coverage/coverage_fleet.py [TYPES [SEED [MACHINES]]]
"""

from __future__ import annotations

import sys
from typing import NamedTuple

import numpy as np
from coverage_balance import normal
from numpy.typing import NDArray

from balancing import (
    Labels,
    ReadingErrors,
    Trials,
    UndeterminedError,
    correct,
)
from balancing.regions import NORMAL_RADIUS
from rotorid.fleet.machine_type import LEVEL, MachineRecord, fit_type, update
from rotorid.regression import stretch

ComplexArray = NDArray[np.complex128]
KINDS = {"each coefficient": (1, 1, 1, 1), "planes alike": (1, 1, 1, 0), "machine alike": (1, 0, 0, 0)}
"""Along which axes (machine, speed, sensor, plane) deviations are drawn anew."""
ALONG, ACROSS, RUN = 0.15, np.radians(20.0), 0.03
MACHINES, FURTHER = 50, 20
ODD = {"lag for lead": "lag", "another keyphasor mark": "mark", "two sensors exchanged": "sensors S1 and S2"}
"""What is wrong with odd machines, and a word of the reason that is to be found."""


class Shot(NamedTuple):
    """What a correction left, relative to the vibration; which intervals held; what was said."""

    left: float
    weights: bool
    readings: float
    rms: bool
    warned: bool
    foreign: bool


class Type(NamedTuple):
    """A drawn type: true coefficients (M, S, C, P) of machines, and records of all but the last `FURTHER`."""

    W: ComplexArray
    records: list[MachineRecord]
    speeds: NDArray[np.float64]
    sensors: tuple[str, ...]
    planes: tuple[str, ...]


def draw(rng, kind, machines=MACHINES):
    """A type of 1 to 3 planes, 1 to 3 speeds, 2 to 4 sensors."""
    S, C, P = (int(rng.integers(*ends)) for ends in ((1, 4), (2, 5), (1, 4)))
    C = max(C, P // S + 1)
    shape = machines + FURTHER, S, C, P
    own = tuple(n if free else 1 for n, free in zip(shape, KINDS[kind], strict=True))
    differ = (1 + ALONG * rng.standard_normal(own)) * np.exp(1j * ACROSS * rng.standard_normal(own))
    W = normal(rng, S, C, P) * differ
    W = np.broadcast_to(W, shape)
    names = tuple(f"S{c + 1}" for c in range(C)), tuple("ABC"[:P])
    measured = W[:machines] * (1 + RUN * normal(rng, machines, *shape[1:]))
    records = [record(m, measured[m]) for m in range(machines)]
    return Type(W, records, 100.0 * np.arange(1, S + 1), *names)


def record(m, W):
    """Coefficients as they were measured, and their covariance."""
    return MachineRecord(f"M{m + 1}", str(m), W, RUN * abs(W))


def shots(rng, drawn, kind, m):
    """Machine m from its baseline, with one trial run, and with all of them; None: refused."""
    prior, W = kind.influence(Labels()), drawn.W[m]
    D = normal(rng, len(drawn.planes))
    T = np.zeros((len(D) + 1, len(D)), dtype=complex)
    T[np.arange(1, len(T)), np.arange(len(D))] = 0.5 * np.exp(2j * np.pi * rng.random(len(D)))
    Y = read(rng, np.einsum("scp,rp->rsc", W, T - D))
    found = []
    for runs in (1, 2, len(T)):
        trials = Trials(
            tuple(map(str, range(runs))),
            *drawn[2:],
            Y[:runs],
            T[:runs],
            errors=ReadingErrors(RUN, RUN),
        )
        try:
            known, chance = update(prior, trials)
            answer = correct(known, refuse=False)
        except UndeterminedError:
            found.append(None)
            continue
        after = W @ (answer.weights - D)
        left = np.linalg.norm(after) / np.linalg.norm(W @ D)
        found.append(judged(answer, D, left, read(rng, after), chance < LEVEL))
    return found


def read(rng, Y):
    """Readings with their errors."""
    return np.asarray(Y * (1 + RUN * normal(rng, *Y.shape)))


def judged(
    found,
    D,
    left,
    check,
    foreign,
):
    """Against the truth, and a check run."""
    off = stretch((check - found.after).ravel()).reshape(-1, 2, 1)
    far = (np.swapaxes(off, 1, 2) @ np.linalg.solve(found.after_covariance.reshape(-1, 2, 2), off)).ravel()
    size = np.sqrt(np.mean(abs(check) ** 2))
    readings = np.mean(far < NORMAL_RADIUS**2)
    weights = found.region().holds(D)
    return Shot(left, weights, readings, size < found.check_rms, bool(found.warnings), foreign)


def odd_machines(rng, drawn):
    """Of three odd machines: what is wrong, found, reason found; of the others: called odd."""
    records, chosen = list(drawn.records), rng.choice(len(drawn.records), len(ODD), replace=False).tolist()
    C = len(drawn.sensors)
    for what, m in zip(ODD, chosen, strict=True):
        W = records[m].W
        order = np.arange(C)
        order[:2] = 1, 0
        turned = W * np.exp(1j * rng.uniform(np.pi / 4, 7 * np.pi / 4))
        other = {"lag for lead": np.conj(W), "another keyphasor mark": turned}.get(what, W[:, order])
        records[m] = record(m, other)
    kind = fit_type(records, *drawn[2:])
    odd = {each.job: kind.why_odd(each) or "" for each, _ in kind.odd}
    told = [
        (what, str(m) in odd, word in odd.get(str(m), ""))
        for (what, word), m in zip(ODD.items(), chosen, strict=True)
    ]
    return told, [each.job in odd for m, each in enumerate(records) if m not in chosen]


def line(name, shots):
    """One of the first table."""
    if shots:
        left, *held = np.array([shot[:4] for shot in shots], dtype=float).T
        shares = [100 * np.mean(each) for each in held]
        print(
            f"{name:<52}{len(shots):>6}{np.median(left):>8.3f}{shares[0]:>9.1f}{shares[1]:>10.1f}{shares[2]:>8.1f}"
        )


def main(types=20, seed=1, machines=MACHINES):
    """Print the tables."""
    stages = "baseline alone", "one trial run", "all trial runs"
    print("a. Corrections of further machines: median of what is left; 95 % regions that hold the truth, %")
    print(f"{'':<52}{'number':>6}{'left':>8}{'weights':>9}{'readings':>10}{'rms <':>8}")
    for kind in KINDS:
        rng = np.random.default_rng([seed, list(KINDS).index(kind)])
        rows = []
        for _ in range(types):
            drawn = draw(rng, kind, machines)
            known = fit_type(drawn.records, *drawn[2:])
            rows += [shots(rng, drawn, known, m) for m in range(machines, machines + FURTHER)]
        for stage, each in zip(stages, zip(*rows, strict=True), strict=True):
            answered = [shot for shot in each if shot is not None]
            for said in (False, True):
                line(
                    f"{kind}, {stage}{', warned' if said else ''}", [s for s in answered if s.warned == said]
                )
            other = sum(shot.foreign for shot in answered)
            if other:
                print(f"{f'{kind}, {stage}, called of another type':<52}{other:>6}")
            if len(answered) < len(each):
                print(f"{f'{kind}, {stage}, refused':<52}{len(each) - len(answered):>6}")
    print("\nb. Odd machines, three in each type: found, and with the right reason, %; others called odd, %")
    for kind in KINDS:
        rng = np.random.default_rng([seed, 9, list(KINDS).index(kind)])
        each = [odd_machines(rng, draw(rng, kind, machines)) for _ in range(types)]
        told = [one for found, _ in each for one in found]
        for what in ODD:
            own = np.array([one[1:] for one in told if one[0] == what], dtype=float).mean(axis=0) * 100
            print(f"{kind + ', ' + what:<52}{own[0]:>8.1f}{own[1]:>8.1f}")
        print(f"{kind + ', called odd':<52}{100 * np.mean([one for _, rest in each for one in rest]):>8.1f}")


if __name__ == "__main__":
    main(*(int(word) for word in sys.argv[1:]))
