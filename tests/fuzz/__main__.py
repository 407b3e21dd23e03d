"""`make fuzz`: thousands of mutants, each within 10 s and 1 GB; exit status 1 if anything was found."""

from __future__ import annotations

import argparse
import multiprocessing
import os
import resource
import sys
import tempfile
import time
from collections import Counter
from pathlib import Path

from fuzz.examining import CHANGED, FINDING, Outcome, examine

PATIENCE = 300
"""Seconds after which a process that says nothing waits for something: what computes ends itself."""
MOST_MB = 1000


def work(numbers, seed, pipe):
    """Examine mutants in a process of its own, and say of each what came of it and the memory so far."""
    sys.stdin = open(os.devnull, encoding="utf-8")  # noqa: SIM115
    with tempfile.TemporaryDirectory(prefix="fuzz") as folder:
        for number in numbers:
            outcome = examine(number, seed, Path(folder))
            memory = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss // 1000
            pipe.send((outcome, memory))
    pipe.close()


class Worker:
    """A process with its share of the mutants; a new one goes on where the old one died or hung."""

    def __init__(self, numbers, seed):
        self.numbers, self.seed = list(numbers), seed
        self.start()

    def start(self):
        self.pipe, end = multiprocessing.Pipe(duplex=False)
        context = multiprocessing.get_context("fork")
        self.process = context.Process(target=work, args=(self.numbers, self.seed, end), daemon=True)
        self.process.start()
        end.close()
        self.heard = time.monotonic()

    def collect(self):
        """Outcomes since the last time."""
        try:
            while self.numbers and self.pipe.poll(0.05):
                outcome, memory = self.pipe.recv()
                self.numbers.remove(outcome.number)
                self.heard = time.monotonic()
                if memory > MOST_MB:
                    yield Outcome(outcome.number, outcome.file, outcome.mutation, FINDING, f"{memory} MB")
                    self.again()
                    return
                yield outcome
        except EOFError:
            yield self.lost("the process died")
        if self.numbers and time.monotonic() - self.heard > PATIENCE:
            yield self.lost(f"nothing for {PATIENCE} s")

    def lost(self, why):
        number = self.numbers.pop(0)
        self.again()
        return Outcome(number, "?", "?", FINDING, why)

    def again(self):
        self.process.kill()
        self.process.join()
        if self.numbers:
            self.start()


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
    begun = time.monotonic()
    workers = [Worker(numbers[i :: chosen.jobs], chosen.seed) for i in range(chosen.jobs)]
    found = []
    while any(w.numbers for w in workers) and time.monotonic() - begun < 60 * chosen.minutes:
        for worker in workers:
            for outcome in worker.collect():
                found.append(outcome)
                if outcome.result == FINDING:
                    print(outcome, flush=True)
    for worker in workers:
        worker.process.kill()
    print("\nAccepted files with another answer, each as its content written plainly gives it:")
    for outcome in sorted((o for o in found if o.result == CHANGED), key=lambda o: o.number):
        print(outcome)
    counts = Counter(outcome.result for outcome in found)
    said = ", ".join(f"{n} {what}" for what, n in sorted(counts.items()))
    print(f"\n{len(found)} mutants of seed {chosen.seed} in {time.monotonic() - begun:.0f} s: {said}")
    sys.exit(1 if counts[FINDING] or len(found) < chosen.mutants else 0)


if __name__ == "__main__":
    main()
