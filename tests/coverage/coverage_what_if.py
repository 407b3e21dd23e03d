"""Does what is predicted for given weights hold? Drawn jobs whose truth is known, each with a check run.

Run `python tests/coverage/coverage_what_if.py [jobs]`, jobs of each source of errors (1000).
The jobs are those of `coverage_balance`. The weights are the true correction, each off by 0.1–1 of its size
in any direction. The check run has the errors of every other run. Corrections that may make it worse are
those of the first speed; at the others there is unbalance outside the planes, 0.3–3 times what these hold.
"""

import sys
from contextlib import suppress
from dataclasses import replace

import coverage_balance as balance
import numpy as np

from balancing import UndeterminedError, correct, estimate_influence, what_if
from balancing.reading_errors import rms

HEADS = ("readings", "rms", "below", "rises said", "wrongly")


def check_run(rng, source, kind):
    """Whether readings are within ±, their rms, and that below its bound, of a check run; as `rises`."""
    errors = balance.ordinary(rng)
    job = balance.draw(rng, source, kind, errors)
    influence = estimate_influence(job.trials)
    W, D, sizes = job.W, job.D, np.exp(rng.uniform(np.log(0.1), 0.0, 2))
    weights = D * (1 + sizes[0] * balance.normal(rng, len(D)) / np.sqrt(2))
    made = what_if(influence, dict(zip(influence.planes, weights, strict=True)))
    true, effect = W @ (weights - D), W * np.sqrt(np.mean(abs(D) ** 2))
    read = true + errors[1] * balance.between_runs(rng, kind, true[None], effect)[0]
    along, across = errors[0] * rng.standard_normal((2, *read.shape))
    read = read * (1 + along) * np.exp(1j * across)
    within = abs(read - made.after) <= made.within / made.labels.vibration_scale
    off = abs(rms(read) - rms(made.after)) <= made.rms_within
    return within.ravel(), [off], [rms(read) <= made.check_rms], *rises(job, 10 * sizes[1] ** 2 * D, rng)


def rises(job, scale, rng):
    """Of a correction of the first speed: whether it is said to make another worse where it does; wrongly."""
    trials, W, D = job.trials, job.W, job.D
    if len(W) < 2 or W.shape[1] < len(D):
        return [], []
    further = balance.normal(rng, *W.shape[:2]) * 0.3 * rms(W @ scale) * (trials.speeds > 100.0)[:, None]
    made = correct(
        estimate_influence(replace(trials, readings=trials.readings + further)), speeds=trials.speeds[:1]
    )
    old, new = abs(further - W @ D), abs(further + W @ (made.weights - D))
    said = "".join(made.decision.elsewhere)
    named = [
        f"at {made.labels.speed_words(v)} " in said and f"worse: {s} " in said
        for v in trials.speeds
        for s in trials.sensors
    ]
    much = (new - old)[1:].max() > 0.1 * old.max()
    return [bool(said)] * bool(much), [bool((new < old).ravel()[named].any())]


def simulate(jobs, source):
    """Of so many jobs, of all kinds of errors in turn, that are not refused: what `check_run` gives."""
    rng, found = np.random.default_rng([3, balance.SOURCES.index(source)]), []
    for k in range(jobs):
        with suppress(UndeterminedError):
            found.append(check_run(rng, source, balance.KINDS[k % len(balance.KINDS)]))
    return [np.concatenate(each) for each in zip(*found, strict=True)]


def main(jobs=1000):
    """Print the table."""
    print(" " * 24 + "".join(f"{head:>12}" for head in HEADS))
    every = {source: simulate(jobs, source) for source in balance.SOURCES}
    every["all"] = [np.concatenate(each) for each in zip(*every.values(), strict=True)]
    for name, found in every.items():
        print(f"{name:<24}" + "".join(f"{balance.percent(each):>12}" for each in found))


if __name__ == "__main__":
    main(*(int(word) for word in sys.argv[1:]))
