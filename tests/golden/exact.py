"""Byte for byte: what the cases give with this tree and with another commit, on this machine."""

from __future__ import annotations

import difflib
import subprocess
import sys
import tempfile
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path
from typing import Any

from golden.cases import CASES, JSON, TEXT
from golden.running import HERE, run

SHOWN = 8
"""Lines of a difference that are printed."""


def exact(parent: str) -> int:
    """Compare with a commit; the exit status is 1 where something differs.

    The list of cases is that of this tree, uncommitted changes included; each side has its own sample data.
    """
    with tempfile.TemporaryDirectory(prefix="golden") as folder:
        tree = Path(folder) / "parent"
        _git("worktree", "add", "--quiet", "--detach", str(tree), parent)
        try:
            with ThreadPoolExecutor() as pool:
                both = [
                    pool.submit(run, list(CASES), place, {"PYTHONHASHSEED": "0"}) for place in (tree, HERE)
                ]
                old, new = (future.result() for future in both)
        finally:
            _git("worktree", "remove", "--force", str(tree))
    different = [name for name in CASES if list(_differences(name, old[name], new[name]))]
    for name in different:
        print(f"{name}: rotorid {CASES[name].command}")
        for line in _differences(name, old[name], new[name]):
            print(f"  {line}")
    print(f"{len(CASES)} cases, {len(different)} differ from {_git('rev-parse', '--short', parent).strip()}")
    return 1 if different else 0


def _differences(name: str, old: dict[str, Any], new: dict[str, Any]) -> list[str]:
    before, after = flat(old), flat(new)
    lines = []
    for part in dict.fromkeys([*before, *after]):
        if part not in before or part not in after:
            lines.append(f"{part}: {'is new' if part in after else 'is no more'}")
        elif before[part] != after[part]:
            diff = difflib.unified_diff(before[part].splitlines(), after[part].splitlines(), lineterm="", n=0)
            lines += [f"{part}:", *(line[:200] for line in list(diff)[2 : 2 + SHOWN])]
    return lines


def flat(found: dict[str, Any]) -> dict[str, str]:
    """All that a case gave as named texts."""
    texts = {"copied": found["copied"]}
    for form in (TEXT, JSON):
        if form in found:
            texts |= {f"{form} {key}": str(found[form][key]) for key in ("status", "output", "error")}
    for name, file in found["files"].items():
        texts |= {f"{name} {key}": value for key, value in file.items()}
    return texts


def _git(*words: str) -> str:
    return subprocess.run(["git", "-C", str(HERE), *words], check=True, capture_output=True, text=True).stdout


if __name__ == "__main__":
    sys.exit(exact(sys.argv[1]))
