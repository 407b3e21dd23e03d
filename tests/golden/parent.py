"""All cases with this tree and with another commit, on this machine: within tolerances, or byte for byte."""

from __future__ import annotations

import contextlib
import difflib
import os
import subprocess
import sys
import tempfile
from collections import defaultdict
from collections.abc import Iterator, Mapping, Sequence
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path
from typing import Any

from golden.cases import CASES, REFUSED, STORED
from golden.comparing import Difference, compare
from golden.running import HERE, run
from golden.storing import document
from golden.tolerances import SPREAD, TOLERANCES

SHOWN = 8
"""Lines of a difference of texts, and cases of a key, that are printed."""
REQUIREMENTS = ("constraints.txt", "pyproject.toml")


@contextlib.contextmanager
def worktree(commit: str) -> Iterator[Path]:
    """The tree of a commit, for the time."""
    with tempfile.TemporaryDirectory(prefix="golden") as folder:
        tree = Path(folder) / "parent"
        _git("worktree", "add", "--quiet", "--detach", str(tree), commit)
        try:
            yield tree
        finally:
            _git("worktree", "remove", "--force", str(tree))


def python_of(tree: Path) -> str:
    """This interpreter where a tree requires the same packages, else that of an environment made there."""
    same = all(
        (tree / name).is_file() and (tree / name).read_bytes() == (HERE / name).read_bytes()
        for name in REQUIREMENTS
    )
    if same:
        return sys.executable
    drop = (
        "MAKEFLAGS",
        "MFLAGS",
        "MAKEOVERRIDES",
        "VENV",
        "CONSTRAINTS",
        "PIP_CONSTRAINT",
        "PIP_BUILD_CONSTRAINT",
    )
    env = {name: value for name, value in os.environ.items() if name not in (*drop, "PYTHONPATH")}
    subprocess.run(["make", "-s", "-C", str(tree), ".venv/.dev"], check=True, env=env)
    return str(tree / ".venv" / "bin" / "python")


def both(commit: str, names: Sequence[str], *, whole: bool = False) -> tuple[dict[str, Any], dict[str, Any]]:
    """Outcomes of a commit and of this tree, uncommitted changes included; cases are those of this tree."""
    with worktree(commit) as tree, ThreadPoolExecutor() as pool:
        pairs = ((tree, python_of(tree)), (HERE, sys.executable))
        jobs = [pool.submit(run, names, place, python=python, whole=whole) for place, python in pairs]
        old, new = (job.result() for job in jobs)
    return old, new


def near(commit: str, cases: str = "stored") -> int:
    """Exit status, keys and numbers of the stored or of all cases; 1 where something differs."""
    names = list(CASES) if cases == "all" else [*STORED, *REFUSED]
    old, new = both(commit, names)
    different = apart(old, new)
    print("\n".join(by_key(different)))
    print(f"{len(names)} cases, {len(different)} differ from {_git('rev-parse', '--short', commit).strip()}")
    return 1 if different else 0


def apart(old: Mapping[str, Any], new: Mapping[str, Any]) -> dict[str, list[Difference]]:
    """Differences by case, of those that have any."""
    rules = (*TOLERANCES, *SPREAD)
    found = {name: compare(name, document(old[name]), document(new[name]), rules) for name in old}
    return {name: different for name, different in found.items() if different}


def by_key(different: Mapping[str, Sequence[Difference]]) -> list[str]:
    """A paragraph for each key: in which cases it differs, and how."""
    keys: dict[str, list[str]] = defaultdict(list)
    for name, differences in different.items():
        for each in differences:
            keys[each.key].append(f"  {name}: {each.words}")
    lines = []
    for key, cases in keys.items():
        more = [f"  and {len(cases) - SHOWN} cases more"] if len(cases) > SHOWN else []
        lines += [key, *cases[:SHOWN], *more]
    return lines


def exact(commit: str) -> int:
    """Every text, document and file of all cases, byte for byte; 1 where something differs."""
    old, new = both(commit, list(CASES), whole=True)
    different = [name for name in CASES if flat(old[name]) != flat(new[name])]
    for name in different:
        print(f"{name}: rotorid {CASES[name].command}")
        before, after = flat(old[name]), flat(new[name])
        for part in dict.fromkeys([*before, *after]):
            a, b = (texts.get(part, "").splitlines() for texts in (before, after))
            lines = list(difflib.unified_diff(a, b, part, part, lineterm="", n=0))
            print("\n".join(f"  {line:.200}" for line in lines[:SHOWN]))
    print(f"{len(CASES)} cases, {len(different)} differ from {_git('rev-parse', '--short', commit).strip()}")
    return 1 if different else 0


def flat(outcome: Mapping[str, Any]) -> dict[str, str]:
    """All that a case gave as named texts."""
    forms = {"json": outcome, "text": outcome.get("text", {})}
    texts = {
        f"{form} {key}": str(given.get(key, ""))
        for form, given in forms.items()
        for key in ("status", "output", "error")
    }
    return texts | outcome.get("files", {})


def _git(*words: str) -> str:
    return subprocess.run(["git", "-C", str(HERE), *words], check=True, capture_output=True, text=True).stdout
