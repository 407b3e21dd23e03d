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
    for name, default in {"mutants": 5000, "first": 0, "seed": "1", "jobs": 2, "minutes": 60.0}.items():
        parser.add_argument(f"--{name}", type=type(default), default=default)
    chosen = parser.parse_args()
    end, counts = time.monotonic() + 60 * chosen.minutes, Counter()
    with (
        tempfile.TemporaryDirectory(prefix="fuzz") as folder,
        multiprocessing.get_context("fork").Pool(chosen.jobs) as pool,
    ):
        examined = functools.partial(work, seed=chosen.seed, folder=folder)
        outcomes = pool.imap_unordered(examined, range(chosen.first, chosen.first + chosen.mutants))
        while counts.total() < chosen.mutants and time.monotonic() < end:
            try:
                outcome = outcomes.next(PATIENCE)
            except multiprocessing.TimeoutError:
                print(f"nothing for {PATIENCE} s: a process has died, or waits for something")
                break
            counts[outcome.result] += 1
            if outcome.result in (FINDING, CHANGED):  # another answer, as the content written plainly has it
                print(outcome, flush=True)
    print(f"\n{counts.total()} mutants of seed {chosen.seed}:", dict(counts))
    sys.exit(1 if counts[FINDING] or counts.total() < chosen.mutants else 0)


if __name__ == "__main__":
    main()
