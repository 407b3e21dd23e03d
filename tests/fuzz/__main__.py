"""`make fuzz`: thousands of mutants, each within 10 s and 1 GB; exit status 1 if anything was found."""

from __future__ import annotations

import argparse
import functools
import multiprocessing
import os
import resource
import sys
import tempfile
import time
from collections import Counter
from dataclasses import replace
from pathlib import Path

from fuzz.examining import CHANGED, FINDING, examine

PATIENCE = 300
"""Seconds without any outcome after which a process has died, or waits for something."""
MOST_MB = 1000


def work(number, seed, folder):
    """Examine a mutant in a process of its own."""
    outcome = examine(number, seed, Path(folder) / str(os.getpid()))
    memory = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss // 1000
    return replace(outcome, result=FINDING, why=f"{memory} MB") if memory > MOST_MB else outcome


def main():
    """The command line."""
    parser = argparse.ArgumentParser(prog="python -m fuzz", description=__doc__)
    parser.add_argument("--mutants", type=int, default=5000)
    parser.add_argument("--first", type=int, default=0, help="number of the first mutant")
    parser.add_argument("--seed", default="1")
    parser.add_argument("--jobs", type=int, default=2)
    parser.add_argument("--minutes", type=float, default=60.0, help="in all, at most")
    chosen = parser.parse_args()
    numbers = range(chosen.first, chosen.first + chosen.mutants)
    begun, found = time.monotonic(), []
    with (
        tempfile.TemporaryDirectory(prefix="fuzz") as folder,
        multiprocessing.get_context("fork").Pool(chosen.jobs) as pool,
    ):
        examined = functools.partial(work, seed=chosen.seed, folder=folder)
        outcomes = pool.imap_unordered(examined, numbers)
        while len(found) < len(numbers) and time.monotonic() - begun < 60 * chosen.minutes:
            try:
                found.append(outcomes.next(PATIENCE))
            except multiprocessing.TimeoutError:
                print(f"nothing for {PATIENCE} s: a process has died, or waits for something")
                break
            if found[-1].result == FINDING:
                print(found[-1], flush=True)
    print("\nAccepted files with another answer, each as its content written plainly gives it:")
    for outcome in sorted((o for o in found if o.result == CHANGED), key=lambda o: o.number):
        print(outcome)
    counts = Counter(outcome.result for outcome in found)
    said = ", ".join(f"{n} {what}" for what, n in sorted(counts.items()))
    print(f"\n{len(found)} mutants of seed {chosen.seed} in {time.monotonic() - begun:.0f} s: {said}")
    sys.exit(1 if counts[FINDING] or len(found) < chosen.mutants else 0)


if __name__ == "__main__":
    main()
