"""Does a job end as well as it begins? Drawn machines are balanced to the end, as a fitter would.

Trial runs, the pieces that `balance --split` proposes, a check run of exactly these, the trim as pieces
beside them, a check run again. A machine: 2 or 3 planes of 8–24 holes, coarse or fine pieces, 3–6 sensors, 1
or 2 speeds, errors of 1–3 % in each reading, stated or estimated by two spare runs; half of them with limits
of 5–40 % of the largest reading. Machines of which nothing can be promised are drawn anew.
"""

from contextlib import suppress
from dataclasses import replace
from typing import NamedTuple

import numpy as np
import pytest
from coverage_balance import normal
from repetitions import FULL, highest_share, lowest_share

from balancing import Limits, ReadingErrors, Trials, UndeterminedError, equal_holes, from_list, real_parts
from balancing.influence import Whitening
from rotorid.commands.balance import BalanceOptions, balance
from rotorid.files import Job
from rotorid.files.job_keys import Plane
from rotorid.files.table_layouts import Conventions

MISTAKES = ("mirrored", "one hole off", "forgotten")
MATTERS = 4.0
"""Distance of what a mistake does from zero, in deviations of a check run: less no reading can tell."""
SPLIT = BalanceOptions(split=True)
NOTHING = np.zeros((1, 0), dtype=complex)


class Machine(NamedTuple):
    """Truth: coefficients (S, C, P), the right weights (P,) in kg, relative error; and what a job says."""

    W: np.ndarray
    D: np.ndarray
    error: float
    job: Job

    def left(self, weights):
        """The vibration with these weights, (…, S, C)."""
        return np.einsum("scp,...p->...sc", self.W, weights - self.D)

    def read(self, rng, weights):
        exact = self.left(weights)
        return exact * (1 + self.error * normal(rng, *exact.shape))

    def check(self, rng, mounted):
        """A check run, in which the proposed weights are thought to be there."""
        read = self.read(rng, mounted[None])[None]
        return replace(self.job.trials, runs=("check",), readings=read, planes=(), weights=NOTHING)


def draw(rng):
    P, S, C = int(rng.integers(2, 4)), int(rng.integers(1, 3)), int(rng.integers(3, 7))
    W = 0.1 * normal(rng, S, C, P)  # about 1 mm/s by 10 g
    D = 1e-2 * rng.uniform(0.5, 1.5, P) * np.exp(2j * np.pi * rng.random(P))
    trial = 1e-2 * rng.uniform(0.5, 1.2, P) * np.exp(2j * np.pi * rng.random(P))
    T, error, stated = (
        np.vstack((0 * trial, np.diag(trial))),
        float(rng.uniform(0.01, 0.03)),
        rng.random() < 0.5,
    )
    T = T if stated else np.vstack((T, T[:2]))
    names, speeds = tuple("ABC"[:P]), 100.0 * np.arange(1, S + 1)
    runs, sensors = tuple(f"run {r}" for r in range(len(T))), tuple(f"S{c}" for c in range(C))
    errors = ReadingErrors(error, error) if stated else None
    machine = Machine(W, D, error, None)
    trials = Trials(runs, speeds, sensors, names, machine.read(rng, T)[None], T, errors=errors)
    limits = None
    if rng.random() < 0.5:
        most = np.full((S, C), rng.uniform(0.05, 0.4) * abs(W @ D).max())
        limits = Limits(np.full(P, np.inf), most, ((),) * P)
    sizes = 1e-3 * np.array([0.5, 1.0, 2.0, 5.0] if rng.random() < 0.5 else [2.0, 4.0])
    holes = {name: from_list(equal_holes(int(rng.integers(8, 25))), sizes) for name in names}
    planes = {name: Plane() for name in names}
    job = Job(trials, None, Conventions(trials.labels), (), planes, limits=limits, holes=holes)
    return machine._replace(job=job)


def proposed(rng):
    """A machine of which `balance --split` promises something, and its pieces."""
    while True:
        machine = draw(rng)
        with suppress(ValueError):
            answer = balance(machine.job, SPLIT)
            if answer.result.sound and answer.mounted is not None and answer.mounted.weights.any():
                return machine, answer.mounted


def amounts(pieces):
    """What is mounted in the holes of each plane."""
    return [mounting.amounts for mounting in pieces.discrete.mountings]


class Way(NamedTuple):
    """Of both check runs: as predicted, and what is left to do; whether the refined region holds the truth.

    `kept`: whether the last readings are within their limits, None without; `twice`: whether anything was
    mounted twice; `left`: vibration truly left, of that before.
    """

    explained: tuple
    words: tuple
    covered: bool | None
    kept: bool | None
    twice: bool
    left: list


def play(seed):
    rng = np.random.default_rng([1, seed])
    machine, pieces = proposed(rng)
    job, there = machine.job, pieces.weights
    check = machine.check(rng, there)
    first = balance(replace(job, check=check), SPLIT)
    now, twice = there + first.left.trim, False
    if first.left.pieces is not None and first.left.trim.any():
        both = zip(amounts(pieces), amounts(first.left.pieces), strict=True)
        twice = any((full[more > 0] > 0).any() for full, more in both)
    again = machine.check(rng, now)
    checks = replace(
        check,
        runs=("check", "again"),
        readings=np.concatenate((check.readings, again.readings), axis=1),
        planes=tuple(job.planes),
        weights=np.array([there, now]),
    )
    final = replace(job, check=checks, check_mounted=True)
    last, covered = balance(final), None
    with suppress(UndeterminedError):  # more runs may show that planes act alike
        covered = balance(final, BalanceOptions(refine=True)).result.region().holds(machine.D)
    kept = None if job.limits is None else bool((abs(again.mean[0]) <= job.limits.residual).all())
    before, *left = (np.linalg.norm(machine.left(weights)) for weights in (0 * there, there, now))
    return Way(
        (first.check.explained, last.check.explained),
        (first.left.word, last.left.word),
        covered,
        kept,
        twice or any("Mount these" in one.answer.judgement for one in (first, last)),
        [size / before for size in left],
    )


@pytest.fixture(scope="module")
def ways():
    return [play(seed) for seed in range(60 if FULL else 12)]


def test_the_check_run_of_exactly_the_proposed_pieces_is_as_predicted(ways):
    for one in (0, 1):
        strange = [way.explained[one] is False for way in ways]
        assert np.mean(strange) <= highest_share(len(ways), 0.05)


def test_readings_within_their_limits_are_the_end(ways):
    last = [way.words[1] for way in ways if way.kept]
    assert len(last) >= len(ways) // 12
    assert set(last) == {"done"}


def test_nothing_is_mounted_twice_and_a_trim_makes_it_better(ways):
    assert not any(way.twice for way in ways)
    trims = np.array([way.left for way in ways if way.words[0] == "trim"])
    assert len(trims) > len(ways) // 6
    assert np.mean(trims[:, 1] < trims[:, 0]) > 0.9
    assert np.median(trims[:, 1] / trims[:, 0]) < 0.5


def test_refined_regions_hold_the_truth(ways):
    covered = [way.covered for way in ways if way.covered is not None]
    assert len(covered) > 0.9 * len(ways)
    assert np.mean(covered) >= lowest_share(len(covered), 0.93)


def mistaken(seed):
    """After a mistake in one plane: whether its plane is named alone; None where no reading can tell."""
    rng, kind = np.random.default_rng([2, seed]), MISTAKES[seed % 3]
    machine, pieces = proposed(rng)
    p = int(rng.choice(np.flatnonzero(pieces.weights)))
    angles, put, wrong = (
        machine.job.holes[machine.job.trials.planes[p]].angles,
        amounts(pieces)[p],
        pieces.weights.copy(),
    )
    h = int(rng.choice(np.flatnonzero(put)))
    if kind == "mirrored":
        wrong[p] = np.conj(wrong[p])
    else:
        beside = np.exp(1j * angles[(h + 1) % len(angles)]) if kind == "one hole off" else 0.0
        wrong[p] += put[h] * (beside - np.exp(1j * angles[h]))
    check = machine.check(rng, wrong)
    answer = balance(replace(machine.job, check=check), SPLIT)
    W, effect = answer.influence, machine.W @ (wrong - pieces.weights)
    noise = W.difference_noise(replace(check, planes=W.planes, weights=pieces.weights[None]))
    white = Whitening(noise, W.errors.sizes).white(real_parts(effect[..., None])[..., None])
    if np.linalg.norm(white) < MATTERS:
        return None
    change = answer.check.change
    return change is not None and bool((abs(np.delete(change, p)) < 0.1 * abs(change[p])).all())


def test_mistakes_that_matter_are_named_with_their_plane():
    named = [one for seed in range(60 if FULL else 12) if (one := mistaken(seed)) is not None]
    assert len(named) > 6
    assert np.mean(named) >= lowest_share(len(named), 0.9)
