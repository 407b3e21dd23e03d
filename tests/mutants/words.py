"""How many tests break where ten words of ten packages change: `python tests/mutants/words.py --seed 1`.

In a copy of the tree one word of a sentence for people is exchanged in each of ten packages, drawn by a seed;
then the tests of `make test` run there. A sentence is pinned once, in the test of the function that makes it.
"""

from __future__ import annotations

import argparse
import ast
import random
import re
import tempfile
from pathlib import Path

import mutants

BELOW = ("base", "regression", "harmonic", "identify", "reduction", "motion", "tables", "commands")
PACKAGES = ("fem", "balancing", *(f"rotorid/{name}" for name in BELOW))
WORD = re.compile(r"(?<![\w{'-])[a-z]{5,}(?![\w}'(-])")


def sentences(path: Path) -> list[tuple[int, int, int]]:
    """Line, first and last column of strings on one line with four words or more, but docstrings."""
    places = []
    tree = ast.parse(path.read_text(encoding="utf-8"))
    alone = {id(node.value) for node in ast.walk(tree) if isinstance(node, ast.Expr)}
    for node in ast.walk(tree):
        if not isinstance(node, ast.Constant) or not isinstance(node.value, str) or id(node) in alone:
            continue
        if node.lineno == node.end_lineno and len(node.value.split()) >= 4:
            places.append((node.lineno, node.col_offset, node.end_col_offset or 0))
    return places


def exchange(root: Path, package: str, rng: random.Random) -> str:
    """Change one word of one sentence in a package; returns where."""
    files = sorted((root / package).rglob("*.py"))
    while True:
        path = rng.choice(files)
        places = sentences(path)
        if not places:
            continue
        line, first, last = rng.choice(places)
        lines = path.read_text(encoding="utf-8").split("\n")
        whole = lines[line - 1].encode()
        text = whole[first:last].decode(errors="ignore")
        words = list(WORD.finditer(text))
        if not words:
            continue
        word = rng.choice(words)
        changed = text[: word.start()] + "otherwise" + text[word.end() :]
        lines[line - 1] = (whole[:first] + changed.encode() + whole[last:]).decode()
        path.write_text("\n".join(lines), encoding="utf-8")
        return f"{path.relative_to(root)}:{line}: {word[0]} → otherwise, in {text}"


def main() -> None:
    """Draw, exchange, run, count."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--seed", type=int, default=1)
    rng = random.Random(parser.parse_args().seed)
    with tempfile.TemporaryDirectory(prefix="words-") as name:
        tree = mutants.copy_of(mutants.ROOT, Path(name) / "tree")
        for package in PACKAGES:
            print(exchange(tree, package, rng), flush=True)
        mutants.pytest_in(tree, ["-n", "2", "--dist", "loadfile"], 3600.0)
        log = (tree / "mutants.log").read_text(encoding="utf-8").splitlines()
        print(*(line[:150] for line in log if line.startswith("FAILED")), log[-1], sep="\n")


if __name__ == "__main__":
    main()
