"""Does a job end as well as it begins? Drawn machines are balanced to the end, as a fitter would.

Run `python tests/coverage/whole_way.py [machines] [mistakes]` (400, 200). Trial runs, the pieces that
`balance --split` proposes, a check run of exactly these, the trim as pieces beside them, a check run again.
A machine: 2 or 3 planes of 8–24 holes, coarse or fine pieces, 2–6 sensors, 1 or 2 speeds, errors of 1–3 % in
each reading, stated, estimated by two spare runs, or assumed; half of them with limits of 5–40 % of the
largest reading. A mistake is one plane's pieces mirrored, one hole's pieces in the next hole, or forgotten.
It matters where it moves the readings by more than `MATTERS` of their errors in a check run: less than that
no reading can tell. Machines of which nothing can be promised (no weights keep the limits, planes that act
alike) leave the way at once, and others are drawn.
"""

from __future__ import annotations

import sys
from collections import Counter
from collections.abc import Iterator, Sequence
from contextlib import suppress
from dataclasses import dataclass, replace
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from balancing import Holes, Limits, Mounted, ReadingErrors, Trials, UndeterminedError, equal_holes, from_list
from balancing.influence import Whitening
from rotorid.commands.balance import BalanceOptions, balance
from rotorid.files import Job
from rotorid.files.layout import Conventions

ComplexArray = NDArray[np.complex128]

SOURCES = ("stated", "stated, spare runs", "spare runs", "assumed")
"""Where the errors come from."""
MISTAKES = ("mirrored", "one hole off", "forgotten")
MATTERS = 4.0
"""Distance of what a mistake does from zero, in standard deviations of a check run (all readings)."""
KEPT = {None: "no limits", True: "last readings within their limits", False: "last readings above a limit"}
SPLIT = BalanceOptions(split=True)
REFINED = BalanceOptions(refine=True)


@dataclass(frozen=True)
class Machine:
    """Truth: coefficients (S, C, P), the right weights (P,) in kg, relative error; and what a job says."""

    W: ComplexArray
    D: ComplexArray
    error: float
    source: str
    job: Job

    def read(self, rng: np.random.Generator, weights: ComplexArray) -> ComplexArray:
        """Readings (R, S, C) with these weights (R, P) mounted."""
        exact = np.einsum("scp,rp->rsc", self.W, weights - self.D)
        a, b = rng.standard_normal((2, *exact.shape))
        return np.asarray(exact * (1 + self.error * a) * np.exp(1j * self.error * b))

    def checked(self, rng: np.random.Generator, mounted: ComplexArray, *, truly: ComplexArray) -> Trials:
        """A check run in which `mounted` (P,) is thought to be there."""
        read = self.read(rng, truly[None])[None]
        return replace(self.job.trials, runs=("check",), readings=read, weights=mounted[None])


class Way(NamedTuple):
    """What was said on the way of one machine, after the first check run and after the last.

    `explained`, `words`: of both; `covered`: whether the refined region holds the truth, None where it is
    refused; `kept`: whether the
    last readings are within their limits, None without; `twice`: whether anything was mounted twice; `left`:
    root mean square of the vibration truly left, of that before.
    """

    machine: Machine
    explained: tuple[bool | None, bool | None]
    words: tuple[str, str]
    covered: bool | None
    kept: bool | None
    twice: bool
    left: tuple[float, float]


class Mistaken(NamedTuple):
    """What is said after a mistake in one plane.

    `distance` of what it does, in standard deviations; whether it is noticed, and its plane named alone.
    """

    kind: str
    distance: float
    noticed: bool
    named: bool
    word: str
    shape: tuple[int, ...]

    @property
    def matters(self) -> bool:
        """Whether readings can tell."""
        return self.distance > MATTERS


def draw(rng: np.random.Generator) -> Machine:
    """A machine with a job of trial runs."""
    P, S = int(rng.integers(2, 4)), int(rng.integers(1, 3))
    C = int(rng.integers(2, 7))
    C = C if S * C >= P else P
    W = rng.standard_normal((S, C, P)) + 1j * rng.standard_normal((S, C, P))
    W *= 1e-3 / 1e-2  # about 1 mm/s by 10 g
    W *= np.exp(0.3 * rng.standard_normal((S, 1, 1)) + 0.2 * rng.standard_normal((1, C, 1)))
    D = 1e-2 * rng.uniform(0.5, 1.5, P) * np.exp(2j * np.pi * rng.random(P))
    source, error = SOURCES[int(rng.integers(len(SOURCES)))], float(rng.uniform(0.01, 0.03))
    spare = 2 if "spare" in source else 0
    T = np.zeros((1 + P + spare, P), dtype=complex)
    T[range(1, P + 1), range(P)] = 1e-2 * rng.uniform(0.5, 1.2, P) * np.exp(2j * np.pi * rng.random(P))
    T[-1] = T[1] if spare else T[-1]  # one spare run of the bare rotor, one of the first trial weight
    names = tuple("ABC"[:P])
    trials = Trials(
        runs=tuple(f"run {r}" for r in range(len(T))),
        speeds=100.0 * np.arange(1, S + 1),
        sensors=tuple(f"S{c + 1}" for c in range(C)),
        planes=names,
        readings=np.zeros((len(T), S, C), dtype=complex),
        weights=T,
        errors=ReadingErrors(error, error) if "stated" in source else None,
    )
    limits = None
    if rng.random() < 0.5:
        most = rng.uniform(0.05, 0.4) * np.abs(W @ D).max()
        limits = Limits(np.full(P, np.inf), np.full((S, C), most), ((),) * P)
    sizes = np.array([0.5, 1.0, 2.0, 5.0] if rng.random() < 0.5 else [2.0, 4.0]) * 1e-3
    holes = {
        name: from_list(equal_holes(int(rng.integers(8, 25))), sizes, per_hole=int(rng.integers(1, 3)))
        for name in names
    }
    conventions = Conventions(trials.labels)
    job = Job(trials, None, conventions, (), names, limits=limits, holes=holes)
    machine = Machine(W, D, error, source, job)
    return replace(machine, job=replace(job, trials=replace(trials, readings=machine.read(rng, T)[None])))


def proposed(rng: np.random.Generator) -> tuple[Machine, Mounted]:
    """A machine of which `balance --split` promises something, and its pieces."""
    while True:
        machine = draw(rng)
        try:
            answer = balance(machine.job, SPLIT)
        except ValueError:
            continue
        if answer.result.sound and answer.mounted is not None and answer.mounted.weights.any():
            return machine, answer.mounted


def taken(holes: Holes, amounts: NDArray[np.float64]) -> Holes | None:
    """Holes with pieces in some of them; None where none is left."""
    try:
        return replace(holes, taken=holes.taken + amounts)
    except ValueError:
        return None


def amounts(pieces: Mounted, plane: int) -> NDArray[np.float64]:
    """What is mounted in each hole of a plane."""
    mounting = pieces.discrete.mountings[plane]
    assert mounting is not None
    return mounting.amounts


def play(rng: np.random.Generator) -> Way:
    """The whole way of one machine."""
    machine, pieces = proposed(rng)
    job, planes = machine.job, machine.job.planes
    holes = [job.holes[plane] for plane in planes]
    there = pieces.weights
    check = machine.checked(rng, there, truly=there)
    checked = replace(job, check=replace(check, planes=(), weights=np.zeros((1, 0), dtype=complex)))
    first = balance(checked, SPLIT)
    assert first.left is not None
    trim, twice = first.left.trim, False
    full = [amounts(pieces, p) for p in range(len(planes))]
    if first.left.pieces is not None and trim.any():
        more = [amounts(first.left.pieces, p) for p in range(len(planes))]
        twice = any((a[b > 0] > 0).any() for a, b in zip(full, more, strict=True))
        full = [a + b for a, b in zip(full, more, strict=True)]
    now = there + trim
    again = machine.checked(rng, now, truly=now)
    both = replace(
        check,
        runs=("check", "again"),
        readings=np.concatenate((check.readings, again.readings), axis=1),
        weights=np.array([there, now]),
    )
    left = {plane: taken(h, a) for plane, h, a in zip(planes, holes, full, strict=True)}
    final = replace(
        job, check=both, check_mounted=True, holes={plane: h for plane, h in left.items() if h is not None}
    )
    last = balance(final)
    assert last.left is not None
    covered = None
    with suppress(UndeterminedError):  # more runs may show that planes act alike
        covered = balance(final, REFINED).result.region().holds(machine.D)
    kept = None if job.limits is None else bool((np.abs(again.mean[0]) <= job.limits.residual).all())
    twice |= any("Mount these" in one.answer.judgement for one in (first, last))
    read = [machine.W @ (weights - machine.D) for weights in (0 * there, there, now)]
    before, *left = (float(np.linalg.norm(vibration)) for vibration in read)
    assert first.check is not None
    assert last.check is not None
    return Way(
        machine,
        (first.check.explained, last.check.explained),
        (first.left.word, last.left.word),
        covered,
        kept,
        twice,
        (left[0] / before, left[1] / before),
    )


def mistake(rng: np.random.Generator, kind: str) -> Mistaken:
    """A machine whose pieces are mounted with a mistake in one plane."""
    while True:
        machine, pieces = proposed(rng)
        planes = [p for p, w in enumerate(pieces.weights) if w]
        p = int(rng.choice(planes))
        angles, put = machine.job.holes[machine.job.planes[p]].angles, amounts(pieces, p)
        wrong = pieces.weights.copy()
        h = int(rng.choice(np.flatnonzero(put)))
        if kind == "mirrored":
            wrong[p] = np.conj(wrong[p])
        elif kind == "one hole off":
            wrong[p] += put[h] * (np.exp(1j * angles[(h + 1) % len(angles)]) - np.exp(1j * angles[h]))
        else:
            wrong[p] -= put[h] * np.exp(1j * angles[h])
        if abs(wrong[p] - pieces.weights[p]) > 1e-9:
            break
    check = machine.checked(rng, pieces.weights, truly=wrong)
    job = replace(machine.job, check=replace(check, planes=(), weights=np.zeros((1, 0), dtype=complex)))
    found = balance(job, SPLIT)
    assert found.check is not None
    assert found.left is not None
    known, effect = found.influence, machine.W @ (wrong - pieces.weights)
    as_read = replace(check, planes=known.planes, weights=pieces.weights[None])
    noise = known.difference_noise(as_read)
    distance = float(np.sqrt(Whitening(noise, known.errors.sizes).chi_square(effect[..., None])))
    change = found.check.change
    named = change is not None and bool((np.abs(np.delete(change, p)) < 0.1 * abs(change[p])).all())
    return Mistaken(kind, distance, found.check.explained is False, named, found.left.word, machine.W.shape)


def ways(count: int, seed: int = 1) -> Iterator[Way]:
    """So many machines to their end."""
    return (play(np.random.default_rng([seed, k])) for k in range(count))


def mistakes(count: int, seed: int = 2) -> Iterator[Mistaken]:
    """So many mistakes, of every kind in turn."""
    return (mistake(np.random.default_rng([seed, k]), MISTAKES[k % 3]) for k in range(count))


def main(machines: int = 400, wrong: int = 200) -> None:
    """Print the tables."""
    every = list(ways(machines))
    print(
        f"a. {machines} machines: not as predicted, first and last check; the refined region holds the truth"
    )
    for name in (*SOURCES, "all"):
        some = [way for way in every if name in (way.machine.source, "all")]
        first, last = (sum(w.explained[k] is False for w in some) for k in (0, 1))
        covered = 100 * np.mean([way.covered for way in some if way.covered is not None])
        print(f"{name:<24}{first:4d}{last:4d} of {len(some):3d}{covered:7.1f} %")
    print(f"something was mounted twice: {sum(way.twice for way in every)}")
    print("\nb. What is left to do after the first check run, and after the last")
    for kept, name in KEPT.items():
        some = [way for way in every if way.kept is kept]
        each = (", ".join(_counts([way.words[k] for way in some])) for k in (0, 1))
        print(f"{name}, {len(some)}\n  first: {next(each)}\n  last: {next(each)}")
    found = list(mistakes(wrong))
    print(
        f"\nc. {wrong} mistakes: how many matter; of these noticed, and named with the plane; what is to do"
    )
    for kind in MISTAKES:
        some = [one for one in found if one.kind == kind and one.matters]
        noticed, named = sum(one.noticed for one in some), sum(one.named for one in some)
        every_one = sum(one.kind == kind for one in found)
        words = ", ".join(_counts([one.word for one in some]))
        print(f"{kind:<16}{len(some):3d} of {every_one:3d}{noticed:4d}{named:4d}  {words}")


def _counts(words: Sequence[str]) -> list[str]:
    return [f"{word} {count}" for word, count in Counter(words).most_common()]


if __name__ == "__main__":
    main(*(int(word) for word in sys.argv[1:]))
