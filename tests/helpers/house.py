"""Size of the house against its ceilings, in units of what a reader has to read: `make house`.

Prints a line a row; exit status 1 where a ceiling in force is exceeded or a package stands in no row.
Units: tokens of Python without comments, docstrings, blank lines, commas and closing brackets (so that
neither line length nor keyword arguments matter), a string one for every 40 characters begun; of JavaScript,
HTML, CSS, TOML, CSV and JSON inside the packages one for every 5 characters.
"""

import ast
import functools
import io
import sys
import tokenize
from pathlib import Path
from typing import NamedTuple

ROOT = Path(__file__).resolve().parents[2]
PACKAGES = ("fem", "balancing", "rotorid")
CEILINGS = (  # places, units, issue whose end puts it in force; only an issue that says so raises one
    ("fem", 35_500, "23"),
    ("balancing", 57_500, "29"),
    ("rotorid/identify", 41_500, "25a"),
    ("rotorid/reduction rotorid/motion", 33_500, "25b"),
    ("rotorid/calibration rotorid/waveforms", 12_500, "25c"),
    ("rotorid/cli rotorid/commands rotorid/report", 49_000, "26"),
    ("rotorid/files", 48_700, "29"),
    ("rotorid/worksheet", 12_800, "29"),
    ("rotorid/fleet rotorid/study", 7_000, "28b"),
    ("rotorid/base rotorid/regression rotorid/validation", 11_500, "28b"),
    ("rotorid/__init__.py rotorid/__main__.py rotorid/plots.py rotorid/samples.py", 1_200, "28"),
    ("fem balancing rotorid", 310_500, "29"),
    ("tests", 430_000, "22b"),
    ("tests", 260_000, "28"),
    ("benchmarks examples docs", 37_500, "22b"),
)
RESOLVED = {"22", "22a", "22b", "23", "25a", "25b", "25c", "26", "28", "28b", "29"}
"""Issues whose ceilings hold: the one that resolves another adds it here; 28b is what 28 has not reached."""

LAYOUT = (
    tokenize.NL,
    tokenize.NEWLINE,
    tokenize.INDENT,
    tokenize.DEDENT,
    tokenize.ENDMARKER,
    tokenize.COMMENT,
)
FREE = {",", ")", "]", "}"}
DOCUMENTED = (ast.FunctionDef, ast.AsyncFunctionDef, ast.ClassDef, ast.Module)
TEXT = {".js", ".html", ".css", ".toml", ".csv", ".json", ".j2"}
DATA = {"sample_data", "data", "stored"}  # folders of measured or stored tables


class Row(NamedTuple):
    """A ceiling and what stands below it."""

    places: str
    issue: str
    ceiling: int
    units: int
    lines: int
    files: int


def lone_strings(tree):
    """Line and column of every docstring, and of every string that stands alone in a body."""
    bodies = [node.body for node in ast.walk(tree) if isinstance(node, DOCUMENTED)]
    values = [child.value for body in bodies for child in body if isinstance(child, ast.Expr)]
    return {
        (value.lineno, value.col_offset)
        for value in values
        if isinstance(value, ast.Constant) and isinstance(value.value, str)
    }


def units(text, suffix=".py"):
    """Units of the text of a file."""
    if suffix != ".py":
        return len(text) // 5
    alone = lone_strings(ast.parse(text))
    counted = [
        token
        for token in tokenize.generate_tokens(io.StringIO(text).readline)
        if token.type not in LAYOUT and token.string not in FREE and token.start not in alone
    ]
    return len(counted) + sum(len(token.string) // 40 for token in counted if token.type == tokenize.STRING)


def files_of(places, root=ROOT):
    """Files of a row: Python everywhere; other text inside the packages only."""
    found = []
    for place in places.split():
        top = root / place
        paths = [top] if top.is_file() else [path for path in top.rglob("*") if path.is_file()]
        for path in paths:
            parts = path.relative_to(root).parts
            shipped = parts[0] in PACKAGES and path.suffix in TEXT and not DATA & set(parts)
            if (path.suffix == ".py" or shipped) and "__pycache__" not in parts and not path.is_symlink():
                found.append(path)
    return found


@functools.cache
def measure(path):
    """Units and lines of a file."""
    text = path.read_text(encoding="utf-8")
    return units(text, path.suffix), text.count("\n")


def measured(root=ROOT, ceilings=CEILINGS):
    """A row for each ceiling."""
    rows = []
    for places, ceiling, issue in ceilings:
        sizes = [measure(path) for path in files_of(places, root)]
        total, lines = (sum(size[i] for size in sizes) for i in (0, 1))
        rows.append(Row(places, issue, ceiling, total, lines, len(sizes)))
    return rows


def in_no_row(root=ROOT, ceilings=CEILINGS):
    """Packages at the root, and packages and modules of rotorid, that no row names."""
    named = {place for places, *_ in ceilings for place in places.split()}
    tops = [path.parent for path in root.glob("*/__init__.py")]
    inside = [
        path
        for path in (root / "rotorid").iterdir()
        if path.suffix == ".py" or any(file.suffix == ".py" for file in path.rglob("*"))
    ]
    places = (path.relative_to(root).as_posix() for path in (*tops, *inside))
    return sorted(place for place in places if place not in named)


def exceeded(rows, resolved=frozenset(RESOLVED)):
    """The rows over a ceiling in force."""
    return [row for row in rows if row.issue in resolved and row.units > row.ceiling]


def main():
    rows, unnamed = measured(), in_no_row()
    print(f"{'units':>8} {'ceiling':>8} {'lines':>7} {'files':>6}")
    for row in rows:
        state = f"over by {row.units - row.ceiling}" if row.units > row.ceiling else "held"
        force = "in force" if row.issue in RESOLVED else f"from issue {row.issue}"
        print(
            f"{row.units:8d} {row.ceiling:8d} {row.lines:7d} {row.files:6d}  {row.places} ({state}; {force})"
        )
    for place in unnamed:
        print(f"{'':33}{place} stands in no row")
    return 1 if unnamed or exceeded(rows) else 0


if __name__ == "__main__":
    sys.exit(main())
