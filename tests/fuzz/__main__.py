"""`make fuzz`: thousands of mutants, each within 10 s and 1 GB; exit status 1 if anything was found."""

from __future__ import annotations

import argparse
import functools
import multiprocessing
import resource
import sys
import tempfile
import time
from collections import Counter
from concurrent.futures import ProcessPoolExecutor, as_completed
from concurrent.futures.process import BrokenProcessPool
from dataclasses import replace
from pathlib import Path

from fuzz.examining import CHANGED, FINDING, examine

MOST_MB = 1000


@functools.cache
def place():
    """A folder of each process, which goes with it."""
    folder = tempfile.TemporaryDirectory(prefix="fuzz")
    return folder, Path(folder.name)


def work(number, seed):
    """Examine a mutant in a process of its own."""
    outcome = examine(number, seed, place()[1])
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
    pool = ProcessPoolExecutor(chosen.jobs, multiprocessing.get_context("fork"))
    futures = [pool.submit(work, number, chosen.seed) for number in numbers]
    try:
        for future in as_completed(futures, 60 * chosen.minutes):
            found.append(future.result())
            if found[-1].result == FINDING:
                print(found[-1], flush=True)
    except (BrokenProcessPool, TimeoutError) as error:
        print(f"{type(error).__name__}: {error}")
    pool.shutdown(wait=False, cancel_futures=True)
    print("\nAccepted files with another answer, each as its content written plainly gives it:")
    for outcome in sorted((o for o in found if o.result == CHANGED), key=lambda o: o.number):
        print(outcome)
    counts = Counter(outcome.result for outcome in found)
    said = ", ".join(f"{n} {what}" for what, n in sorted(counts.items()))
    print(f"\n{len(found)} mutants of seed {chosen.seed} in {time.monotonic() - begun:.0f} s: {said}")
    sys.exit(1 if counts[FINDING] or len(found) < chosen.mutants else 0)


if __name__ == "__main__":
    main()
