"""Names of the product that say nothing of what they hold: `python tests/helpers/dialect.py [PACKAGE …]`.

A variable, argument or attribute is named after what it holds: `readings`, not `said`.
Exempt is `known` where model files of an identification have a table of that name.
"""

import ast
import sys
from pathlib import Path
from typing import NamedTuple

ROOT = Path(__file__).resolve().parents[2]
PACKAGES = ("fem", "balancing", "rotorid")
DIALECT = {"said", "told", "found", "own", "known", "felt"}
MODEL_FILES = ("rotorid/identify", "rotorid/files", "rotorid/commands/identify.py")


class Binding(NamedTuple):
    """Where a name is given to something."""

    path: str
    line: int
    name: str


def bound(node):
    """The names that one node of a syntax tree binds."""
    if isinstance(node, ast.arg):
        return [node.arg]
    if isinstance(node, ast.Name | ast.Attribute) and isinstance(node.ctx, ast.Store):
        return [node.id if isinstance(node, ast.Name) else node.attr]
    if isinstance(node, ast.FunctionDef | ast.AsyncFunctionDef | ast.ClassDef):
        return [node.name]
    if isinstance(node, ast.alias):
        return [node.asname] if node.asname else []
    if isinstance(node, ast.ExceptHandler | ast.MatchAs | ast.MatchStar) and node.name:
        return [node.name]
    return []


def bindings(root=ROOT, packages=PACKAGES):
    """Every binding of the dialect, by place."""
    places = []
    for package in packages:
        for path in sorted((root / package).rglob("*.py")):
            name = path.relative_to(root).as_posix()
            exempt = name.startswith(MODEL_FILES)
            tree = ast.parse(path.read_text(encoding="utf-8"))
            for node in ast.walk(tree):
                words = [word for word in bound(node) if word.strip("_") in DIALECT]
                places += [
                    Binding(name, node.lineno, word) for word in words if word != "known" or not exempt
                ]
    return sorted(places)


def main():
    for place in (places := bindings(packages=sys.argv[1:] or PACKAGES)):
        print(f"{place.path}:{place.line}: {place.name}")
    print(len(places))


if __name__ == "__main__":
    main()
