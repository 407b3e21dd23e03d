"""Do tests find one-line defects? Run by `make mutants`; options: `python tests/mutants/mutants.py --help`.

First the suite of `make test` runs once in a copy of the tree and writes down which test runs which function
(kept in `.mutants/` until a file changes; tests that fail without any mutation are named and left out). Then
every mutation is applied in a copy of its own, and the tests that run the mutated function are run until one
fails: first those whose file is named after the module, then those of its package, then the others;
short ones first. All mutants have their first turn, then those that are alive get the rest, as time allows.
"""

from __future__ import annotations

import argparse
import hashlib
import json
import os
import shutil
import signal
import subprocess
import sys
import tempfile
import time
from collections import defaultdict
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass, field
from pathlib import Path

import mutation as mutations

ROOT = Path(__file__).resolve().parents[2]
STORE = ROOT / ".mutants"
LEFT_OUT = shutil.ignore_patterns(
    ".git", ".venv*", ".mutants", ".hypothesis", ".*_cache", "_build", "dist", "build", "demo", "*.egg-info"
)
SUITE = ("-m", "not full")
"""What `make test` runs."""
TURNS = (15.0, 60.0, 1e9)
"""Seconds of tests, as measured without mutation, that a mutant meets in its first, second and last turn."""


# The tests of a function


@dataclass
class Suite:
    """What the run without mutations has shown."""

    seconds: dict[str, float]
    runs: dict[str, set[str]]
    """Tests by function (`path::qualified name`); what a fixture or the import of a test file ran counts."""
    failing: list[str] = field(default_factory=list)


def of_documents(documents: list[dict]) -> Suite:
    """Suite from what the workers wrote."""
    seconds: dict[str, float] = {}
    runs: dict[str, set[str]] = defaultdict(set)
    ran: dict[str, set[str]] = defaultdict(set)
    failing = []
    for document in documents:
        for context, numbers in document["ran"].items():
            ran[context].update(document["functions"][number] for number in numbers)
    for document in documents:
        for test, about in document["tests"].items():
            if about["outcome"] == "failed":
                failing.append(test)
            elif about["outcome"] == "passed":
                seconds[test] = about["seconds"]
                file = test.partition("::")[0]
                for context in (f"test {test}", f"file {file}", *about["fixtures"]):
                    for function in ran.get(context, ()):
                        runs[function].add(test)
    return Suite(seconds, dict(runs), sorted(failing))


def order(mutation: mutations.Mutation, suite: Suite) -> list[str]:
    """Tests for a mutation, those first that are most likely and quickest to find it.

    At module level, where everything runs on import, and for what is compiled and tells nothing, tests that
    run any function of the module, and those of its package.
    """
    module = {name: tests for name, tests in suite.runs.items() if name.startswith(f"{mutation.path}::")}
    package = f"tests/{Path(mutation.path).parent}/"
    direct = module.get(f"{mutation.path}::{mutation.function}", set())
    if not direct:
        direct = set().union(*module.values(), (test for test in suite.seconds if test.startswith(package)))
    # values kept by a cache were computed in one test only: the others of its file come last
    files = {test.partition("::")[0] for test in direct}
    beside = {test for test in suite.seconds if test.partition("::")[0] in files} - direct

    def rank(test: str) -> tuple[bool, bool, float, str]:
        named = Path(test.partition("::")[0]).stem.endswith(Path(mutation.path).stem)
        return (not named, not test.startswith(package), suite.seconds[test], test)

    return sorted(direct, key=rank) + sorted(beside, key=rank)


# Running


def copy_of(source: Path, target: Path) -> Path:
    """The tree without what can be made again."""
    shutil.copytree(source, target, ignore=LEFT_OUT)
    return target


def environment(tree: Path, **more: str) -> dict[str, str]:
    """For a run in the copy: its packages before the installed ones."""
    paths = os.pathsep.join((str(tree), str(tree / "tests" / "mutants")))
    kept = {name: value for name, value in os.environ.items() if not name.startswith("MUTANTS_")}
    own = {"PYTHONPATH": paths, "OPENBLAS_NUM_THREADS": "1", "MPLBACKEND": "Agg"}
    return kept | own | more


def pytest_in(tree: Path, arguments: list[str], limit: float, **more: str) -> int | None:
    """Exit status of the tests of `make test`, None where the time was over; nothing started stays behind."""
    command = [sys.executable, "-m", "pytest", "-q", "-p", "mutants_plugin", "-p", "no:cacheprovider", *SUITE]
    with (tree / "mutants.log").open("w") as log:
        process = subprocess.Popen(
            [*command, *arguments],
            cwd=tree,
            env=environment(tree, **more),
            stdout=log,
            stderr=subprocess.STDOUT,
            start_new_session=True,
        )
        try:
            return process.wait(limit)
        except subprocess.TimeoutExpired:
            return None
        finally:
            if process.poll() is None:
                os.killpg(process.pid, signal.SIGKILL)
                process.wait()


def fingerprint(root: Path) -> str:
    """Of everything that the run without mutations depends on."""
    digest = hashlib.sha256(sys.version.encode())
    for folder in (*mutations.PACKAGES, "tests", "sample_data", "examples"):
        for path in sorted((root / folder).rglob("*")):
            if path.is_file() and "__pycache__" not in path.parts:
                digest.update(path.relative_to(root).as_posix().encode() + path.read_bytes())
    return digest.hexdigest()


def trace(tree: Path, jobs: int) -> Suite:
    """The suite without mutations, in the copy; stored until a file changes."""
    stored = STORE / f"{fingerprint(ROOT)}.json"
    if not stored.is_file():
        folder = tree / "traces"
        folder.mkdir()
        workers = ["-n", str(jobs), "--dist", "loadfile"]
        code = pytest_in(tree, workers, 3600.0, MUTANTS_TRACE=str(folder))
        documents = [json.loads(path.read_text(encoding="utf-8")) for path in sorted(folder.glob("*.json"))]
        if code not in (0, 1) or not documents:
            raise SystemExit((tree / "mutants.log").read_text(encoding="utf-8")[-3000:])
        STORE.mkdir(exist_ok=True)
        for old in STORE.glob("*.json"):
            old.unlink()
        stored.write_text(json.dumps(documents), encoding="utf-8")
        shutil.rmtree(folder)
    return of_documents(json.loads(stored.read_text(encoding="utf-8")))


@dataclass
class Mutant:
    """A mutation, the tests that are still to run, and what has become of it."""

    mutation: mutations.Mutation
    tests: list[str]
    killer: str = ""
    tried: int = 0
    unfinished: bool = False

    @property
    def words(self) -> str:
        """What came of it."""
        if self.killer:
            return f"killed by {self.killer}"
        if not self.tests and not self.tried:
            return "SURVIVED: no test runs this function"
        more = f" of {self.tried + len(self.tests)}, time over" if self.tests or self.unfinished else ""
        return f"SURVIVED {self.tried}{more} tests"


def turn(mutant: Mutant, base: Path, folder: Path, suite: Suite, seconds: float, deadline: float) -> None:
    """Run the next tests, about `seconds` of them."""
    chosen, total = [], 0.0
    for test in mutant.tests:
        if chosen and total + suite.seconds[test] > seconds:
            break
        chosen.append(test)
        total += suite.seconds[test]
    left = deadline - time.monotonic()
    if left < 5.0 or not chosen:
        return
    tree = copy_of(base, folder)
    try:
        path = tree / mutant.mutation.path
        path.write_text(mutant.mutation.applied(path.read_text(encoding="utf-8")), encoding="utf-8")
        listed, killer = tree / "mutants.txt", tree / "killer.txt"
        listed.write_text("\n".join(chosen), encoding="utf-8")
        files = list(dict.fromkeys(test.partition("::")[0] for test in chosen))
        # busy neighbours slow a run down several times; an endless loop is longer than that
        limit = 60.0 + 8.0 * total
        more = {"MUTANTS_RUN": str(listed), "MUTANTS_KILLER": str(killer)}
        code = pytest_in(tree, ["-x", *files], min(limit, left), **more)
        if code == 0:
            mutant.tried += len(chosen)
            mutant.tests = mutant.tests[len(chosen) :]
        elif code is None and left < limit:
            mutant.unfinished = True
        elif code is None:
            mutant.killer = f"no end within {limit:.0f} s"
        elif code == 5:
            raise SystemExit(f"no tests of {chosen} found in the copy")
        else:
            mutant.killer = killer.read_text(encoding="utf-8") if killer.is_file() else "a failing import"
    finally:
        shutil.rmtree(folder)


def run(drawn: list[mutations.Mutation], jobs: int, minutes: float) -> tuple[list[Mutant], Suite]:
    """Every mutation against its tests."""
    deadline = time.monotonic() + 60 * minutes
    with tempfile.TemporaryDirectory(prefix="mutants-") as name:
        work = Path(name)
        base = copy_of(ROOT, work / "base")
        begun = time.monotonic()
        suite = trace(base, jobs)
        print(
            f"{len(suite.seconds)} tests pass without mutation ({time.monotonic() - begun:.0f} s)", flush=True
        )
        for test in suite.failing:
            print(f"  left out, fails without mutation: {test}")
        mutants = [Mutant(each, order(each, suite)) for each in drawn]
        for round_number, seconds in enumerate(TURNS):
            alive = [mutant for mutant in mutants if mutant.tests and not mutant.killer]
            with ThreadPoolExecutor(jobs) as pool:
                turns = [
                    pool.submit(turn, mutant, base, work / f"{round_number}-{n}", suite, seconds, deadline)
                    for n, mutant in enumerate(alive)
                ]
                try:
                    for each in turns:
                        each.result()
                except BaseException:
                    pool.shutdown(wait=False, cancel_futures=True)
                    raise
            alive = [mutant for mutant in mutants if not mutant.killer]
            print(
                f"turn {round_number + 1}: {len(alive)} alive ({time.monotonic() - begun:.0f} s)", flush=True
            )
    return mutants, suite


def main() -> None:
    """Draw, run, print."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--number", type=int, default=60)
    parser.add_argument("--minutes", type=float, default=15.0)
    parser.add_argument("--jobs", type=int, default=2)
    parser.add_argument("--list", action="store_true", help="print the mutations only")
    given = parser.parse_args()
    drawn = mutations.draw(ROOT, given.seed, given.number)
    print(f"{len(drawn)} mutations, seed {given.seed}", flush=True)
    mutants = [Mutant(each, []) for each in drawn]
    if not given.list:
        mutants, _ = run(drawn, given.jobs, given.minutes)
    for mutant in sorted(mutants, key=lambda m: (not m.killer, m.mutation.path, m.mutation.line)):
        each = mutant.mutation
        old, new = each.shown((ROOT / each.path).read_text(encoding="utf-8"))
        print(f"{each.path}:{each.line}  {'' if given.list else mutant.words}\n    - {old}\n    + {new}")
    if not given.list:
        killed = sum(bool(mutant.killer) for mutant in mutants)
        print(f"seed {given.seed}: {killed} of {len(mutants)} killed, {killed / len(mutants):.0%}")


if __name__ == "__main__":
    main()
