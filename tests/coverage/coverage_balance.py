"""Are the 95 % regions of the correction weights honest? Drawn jobs whose truth is known.

Run `python tests/coverage/coverage_balance.py [jobs]`, jobs of each line (1000), of d. together.
An ordinary job: 1–4 planes, 2–8
sensors, 1–5 speeds, more readings than planes; coefficients normal, with different sensitivities of sensors
(30 %) and speeds (50 %); a trial weight for each plane, 0.3–1.5 of its correction; 0.5–5 % of error in each
reading, and errors between runs: none in a fifth of the jobs, else up to 5 %. Spare runs are one to four, the
bare rotor or one of the planes again. A region counts as it is stated: all planes jointly.
"""

from __future__ import annotations

import sys
from collections.abc import Callable, Iterable, Sequence
from itertools import pairwise
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from balancing import (
    Groups,
    ReadingErrors,
    RunScatter,
    Trials,
    UndeterminedError,
    correct,
    estimate_influence,
    unknowns,
)
from balancing.reading_errors import ASSUMED_RUN as ASSUMED

ComplexArray = NDArray[np.complex128]

Errors = Callable[[np.random.Generator], tuple[float, float]]

SOURCES = ("stated", "stated, spare runs", "repeats, spare runs", "spare runs", "readings stated, spare")
"""Where the errors come from; in the last the spare runs alone tell of errors between runs."""
OTHERS = ("drift", "placement")
"""Further kinds: of all runs in proportion to the time, and of what is mounted."""
KINDS = ("independent", "half of each", "common at a speed", "common to a run", "further unbalance")
PHASE = np.deg2rad(2.0) / 0.02
"""Phase error over amplitude error, as they are assumed."""
TIMES = (0.5, 1.0, 1.5, 2.5)
GROUPS = {"skew": {"A": 1.0, "C": -0.4j}, "B and C": {"B": 2.0, "C": 0.7 + 0.2j}}
"""Three planes whose weights are held together."""


class Job(NamedTuple):
    """Runs, the truth (P,), how many real readings the runs have more than unknowns, true coefficients.

    `bound`: least standard deviation of the weights that is possible, by Cramér and Rao.
    """

    trials: Trials
    D: ComplexArray
    redundant: int
    W: ComplexArray
    bound: float = np.nan


class Outcome(NamedTuple):
    """Whether the region holds the truth, None for a job refused; its warnings or why it was refused.

    `relative`: standard deviation of the worst combination of planes over the root mean square weight.
    `ratio`: stated standard deviation over the least one.
    """

    inside: bool | None
    words: tuple[str, ...]
    redundant: int
    relative: float = np.inf
    ratio: float = np.nan


def normal(rng: np.random.Generator, *shape: int) -> ComplexArray:
    """Complex, of variance 1 in each direction."""
    return np.asarray(rng.standard_normal(shape) + 1j * rng.standard_normal(shape))


def of_runs(kind: str, Y: ComplexArray, effect: ComplexArray) -> ComplexArray:
    """What errors of size 1 of runs do to readings (R, S, C), each by itself: (n, R, S, C).

    `effect` (S, C, P) is what the correction does by plane; the first run of "placement" has no weights.
    """
    R, S, C = Y.shape
    runs, speeds, sensors = np.eye(R), np.eye(S), np.eye(C)
    if kind == "further unbalance":  # of each plane
        return np.einsum("nr,scp->nprsc", runs, effect).reshape(-1, R, S, C)
    if kind == "drift":  # in proportion to the time
        return np.asarray(np.linspace(0, 1, R)[:, None, None] * Y)[None]
    if kind == "placement":  # of what is mounted
        return np.asarray(runs[:, :, None, None] * (Y - Y[0]))
    whole = runs[:, :, None, None] * Y
    each = np.einsum("nr,ms,lc,rsc->nmlrsc", runs, speeds, sensors, Y).reshape(-1, R, S, C)
    if kind == "half of each":
        return np.concatenate((whole, each)) / np.sqrt(2)
    if kind == "common at a speed":
        return np.einsum("nr,ms,rsc->nmrsc", runs, speeds, Y).reshape(-1, R, S, C)
    return each if kind == "independent" else whole


def between_runs(rng: np.random.Generator, kind: str, Y: ComplexArray, effect: ComplexArray) -> ComplexArray:
    """Drawn errors of size 1 of the readings (R, S, C)."""
    each = of_runs(kind, Y, effect)
    return np.asarray(np.tensordot(normal(rng, len(each)), each, 1))


def cramer_rao(
    W: ComplexArray,
    steps: ComplexArray,
    errors: tuple[float, float],
    of_all: ComplexArray,
    shares: ComplexArray,
) -> float:
    """Least standard deviation of the weights, root of the trace, by the true errors.

    `steps` is T − D (R, P); readings err along themselves and across, `of_all` (n, R, S, C) are errors of
    runs; `shares` (P, G) are what unknown weights have in each plane.
    """
    (S, C, P), R = W.shape, len(steps)
    real = lambda A: np.block([[A.real, -A.imag], [A.imag, A.real]])  # noqa: E731
    Y = np.einsum("scp,rp->rsc", W, steps).ravel()
    noise, runs = real(np.diag(Y)), real(of_all.reshape(len(of_all), -1).T)
    noise = noise * np.repeat(errors, len(Y))
    of_weights = np.tile(-W.reshape(S * C, P) @ shares, (R, 1))
    J = np.hstack((of_weights, np.kron(steps, np.eye(S * C))))
    information = real(J).T @ np.linalg.solve(noise @ noise.T + runs @ runs.T, real(J))
    G = np.r_[: shares.shape[1], J.shape[1] : J.shape[1] + shares.shape[1]]
    covariance = np.linalg.inv(information)[np.ix_(G, G)]
    return float(np.sqrt(np.trace(real(shares) @ covariance @ real(shares).T)))


def draw(
    rng: np.random.Generator,
    source: str,
    kind: str,
    errors: tuple[float, float],
    told: float = 1.0,
    trial: float = 0.3,
    shares: ComplexArray | None = None,
    apart: float | None = None,
) -> Job:
    """An ordinary job with errors of a reading and between runs, `told` times as large as stated.

    With `shares` the correction is one of groups, each of size 1. Two planes or more may act alike but for
    the part `apart`.
    """
    reading, run = errors
    tangential = reading * (PHASE if source == "assumed" else 1.0)
    P = int(rng.integers(2 if apart else 1, 5)) if shares is None else len(shares)
    S, C = int(rng.integers(1, 6)), int(rng.integers(2, 9))
    C = max(C, P // S + 1)
    W = normal(rng, S, C, P)
    W *= np.exp(0.5 * rng.standard_normal((S, 1, 1)) + 0.3 * rng.standard_normal((1, C, 1)))
    W = W[..., :1] + apart * W if apart else W
    D = normal(rng, P) if shares is None else shares @ normal(rng, shares.shape[1])
    spare = int(rng.integers(1, 5)) if "spare" in source else 0
    planes = [-1, *range(P), *rng.choice([-1, *range(P)], spare)]
    T = np.zeros((len(planes), P), dtype=complex)
    for weights, plane in zip(T, planes, strict=True):
        if plane >= 0:
            size = np.exp(rng.uniform(np.log(trial), np.log(1.5))) * abs(D[plane])
            weights[plane] = size * np.exp(2j * np.pi * rng.random())
    Y = np.einsum("scp,rp->rsc", W, T - D)
    effect = W * np.sqrt(np.mean(abs(D) ** 2))
    n = 3 if "repeats" in source else 1
    of_reading = reading / np.sqrt(n), tangential / np.sqrt(n)
    of_all = run * of_runs(kind, Y, effect)
    bound = cramer_rao(W, T - D, of_reading, of_all, np.eye(P) if shares is None else shares)
    Y = Y + run * between_runs(rng, kind, Y, effect)
    floor = np.sqrt(np.mean(np.sum(abs(effect) ** 2, axis=-1)))
    scatter = RunScatter(0.0, run / told * floor) if kind == KINDS[-1] else RunScatter(run / told)
    a, b = rng.standard_normal((2, n, *Y.shape))
    stated, between = "stated" in source, source in ("stated", "stated, spare runs")
    trials = Trials(
        runs=tuple(f"run {r + 1}" for r in range(len(T))),
        speeds=100.0 * np.arange(1, S + 1),
        sensors=tuple(f"S{c + 1}" for c in range(C)),
        planes=tuple("ABCD"[:P]),
        readings=Y * (1 + reading * a) * np.exp(1j * tangential * b),
        weights=T,
        errors=ReadingErrors(reading / told, reading / told) if stated else None,
        run_errors=scatter if between else None,
    )
    return Job(trials, D, 2 * (S * C * (spare + 1) - P), W, bound)


def outcome(job: Job, method: str | None = None, groups: Groups | None = None) -> Outcome:
    """Balance a job and see."""
    try:
        influence = estimate_influence(job.trials)
        found = correct(influence, method=method, planes=groups and [*groups], groups=groups or {})
    except UndeterminedError as error:
        return Outcome(None, (str(error),), job.redundant)
    size = np.sqrt(np.mean(abs(found.weights) ** 2))
    worst = float(np.sqrt(np.linalg.eigvalsh(found.covariance)[-1]) / size)
    ratio = float(np.sqrt(np.trace(found.covariance)) / job.bound)
    return Outcome(found.region().holds(job.D), found.warnings, job.redundant, worst, ratio)


def ordinary(rng: np.random.Generator) -> tuple[float, float]:
    """Errors of a reading and between runs."""
    reading = float(np.exp(rng.uniform(np.log(0.005), np.log(0.05))))
    return reading, 0.0 if rng.random() < 0.2 else float(rng.uniform(0.0, 0.05))


def simulate(
    jobs: int, source: str, kind: str, errors: Errors = ordinary, groups: Groups | None = None, **more: Any
) -> list[Outcome]:
    """So many jobs of a class; with `groups` of three planes, whose weights these hold together."""
    places = SOURCES.index(source) if source in SOURCES else 9, (*KINDS, *OTHERS).index(kind)
    rng, shares = np.random.default_rng([1, *places]), groups and unknowns(groups, [*groups], "ABC").shares
    drawn = (draw(rng, source, kind, errors(rng), shares=shares, **more) for _ in range(jobs))
    return [outcome(job, groups=groups) for job in drawn]


def every_kind(jobs: int, source: str, kinds: Sequence[str] = KINDS, **more: Any) -> list[Outcome]:
    """Jobs of all kinds of errors between runs."""
    return [one for kind in kinds for one in simulate(-(-jobs // len(kinds)), source, kind, **more)]


def line(name: str, found: Iterable[Outcome]) -> str:
    """Coverage of the regions of jobs without and with a warning, how many there are, ± over the least."""
    found = list(found)
    answered = [one for one in found if one.inside is not None]
    ratios = [one.ratio for one in answered if np.isfinite(one.ratio)]
    ratio = f"{np.median(ratios):9.2f}" if ratios else ""
    silent, warned = [[one.inside for one in answered if bool(one.words) == said] for said in (False, True)]
    return (
        f"{name:<44}{percent(silent):>6} of {len(silent):5d}{percent(warned):>9} of {len(warned):4d}"
        f"{len(found) - len(answered):9d}{ratio}"
    )


def told_of(found: Iterable[Outcome], least: int = 0) -> str:
    """Share of answers with a warning, of jobs with so many redundant readings."""
    said = [bool(one.words) for one in found if one.inside is not None and one.redundant >= least]
    return f"{percent(said)} % of {len(said)}"


def percent(values: Sequence[Any]) -> str:
    """Share of what is true."""
    return f"{100 * np.mean(np.array(values, dtype=float)):.1f}" if len(values) else "–"


def main(jobs: int = 1000) -> None:
    """Print the tables."""
    head = f"{'':<44}{'silent':>15}{'warned':>17}{'refused':>9}{'±/C–R':>9}"
    print(f"a. Joint 95 % regions that hold the truth, per cent; errors stated or estimated\n{head}")
    each = -(-jobs // len(KINDS))
    cells = {(source, kind): simulate(each, source, kind) for source in SOURCES for kind in KINDS}
    for place, names in enumerate((SOURCES, KINDS)):
        for name in names:
            print(line(f"all: {name}", [one for key in cells if key[place] == name for one in cells[key]]))
    print(line("all", [one for found in cells.values() for one in found]))
    good = [one for key, found in cells.items() if key[0] != SOURCES[-1] for one in found]
    print(f"warned, without the jobs '{SOURCES[-1]}': {told_of(good)}")

    print(f"\nb. Errors assumed, the true ones so many times as large\n{head}")
    for times in TIMES:
        print(line(f"{times:g} times", every_kind(jobs, "assumed", errors=assumed(times))))

    print("\nc. Warned, of jobs with 8 or more redundant readings whose errors are twice as large as taken")
    for names, words in ((KINDS[:1], "independent"), (KINDS[1:], "in common")):
        every = [(source, {"told": 2.0}) for source in (*SOURCES[:2], SOURCES[-1])]
        for source, how in (*every, ("assumed", {"errors": assumed(2.0)})):
            print(f"{source + ': ' + words:<44}{told_of(every_kind(jobs, source, names, **how), 8)}")

    print("\nd. Stated errors, trial weights 0.05–1.5 of the correction: regions that hold the truth, by")
    for method in ("weighted", "least-squares"):
        rng = np.random.default_rng(7)
        kinds = rng.choice(KINDS, jobs)
        drawn = [outcome(draw(rng, SOURCES[0], kind, ordinary(rng), trial=0.05), method) for kind in kinds]
        for low, high in pairwise((0.0, 0.1, 0.2, 0.3, 0.5, 1.0, np.inf)):
            at = [one.inside for one in drawn if one.inside is not None and low <= one.relative < high]
            name = f"{method}: relative error of the weights {low:g} … {high:g}"
            print(f"{name:<60}{percent(at):>6} of {len(at)}")

    print(f"\ne. Weights of three planes that two groups hold together; errors stated\n{head}")
    print(line("all", every_kind(jobs, SOURCES[0], groups=GROUPS)))

    print(f"\nf. Errors of other kinds, stated as of runs, and planes that act alike but for a tenth\n{head}")
    for name, kind, apart in (
        ("drift of all runs", "drift", None),
        ("weights misplaced", "placement", None),
        ("planes nearly alike", KINDS[1], 0.1),
    ):
        for source, words in ((SOURCES[0], ""), (SOURCES[3], ", spare runs")):
            print(line(name + words, simulate(jobs, source, kind, apart=apart)))


def assumed(times: float) -> Errors:
    """Errors so many times as large as those that are assumed."""
    return lambda _: (ASSUMED * times, ASSUMED * times)


if __name__ == "__main__":
    main(*(int(word) for word in sys.argv[1:]))
