"""The test of the house: rooms of a size, names that lead to one file, types of arrays told once."""

import ast
import re
from collections import Counter
from pathlib import Path

import pytest

ROOT = Path(__file__).resolve().parents[1]
PACKAGES = ("fem", "balancing", "rotorid")
MOST, LEAST = 24, 4
"""Modules of a folder: more is a corridor, fewer (with a package's own page) is a module."""

COMPLEX_FUNCTIONS = 16
"""Breaches of the limits of statements and arguments that stand in the code: they may only go."""


def modules():
    return [path for package in PACKAGES for path in sorted((ROOT / package).rglob("*.py"))]


def test_numbers_and_nouns_agree():
    """One function counts words: `counted`; no text says "1 planes", "mode(s)" or builds a plural by hand."""
    by_hand = re.compile(r"\} ?\w*\w\((?:e?s)\)|\} [\w ]*\{(?:''|'s') if ")
    assert [p.name for p in modules() if by_hand.search(p.read_text(encoding="utf-8"))] == []
    stored = ROOT / "tests" / "golden" / "stored"
    wrong = re.compile(r"(?<![\w.,:–-])1 (?!has\b|is\b|was\b|grows\b|times\b)[a-z]{3,}s\b")
    assert [p.name for p in sorted(stored.glob("*")) if wrong.search(p.read_text(encoding="utf-8"))] == []


def folders():
    return sorted({path.parent for path in modules()})


def package_of(path):
    """Where a name must be unique: fem, balancing, and each package of rotorid by itself."""
    parts = path.relative_to(ROOT).parts
    return ".".join(parts[:2]) if parts[0] == "rotorid" and len(parts) > 2 else parts[0]


def test_a_folder_holds_what_a_reader_can_look_through():
    wrong = {}
    for folder in folders():
        files, rooms = len(list(folder.glob("*.py"))), len(list(folder.glob("*/__init__.py")))
        if files > MOST or files + rooms < LEAST:
            wrong[folder.relative_to(ROOT).as_posix()] = files
    assert wrong == {}


def test_folders_of_tests_are_no_larger():
    tests = ROOT / "tests"
    folders = {path.parent for path in tests.rglob("*.py")}
    assert [path for path in folders if len(list(path.glob("*.py"))) > MOST] == []


def test_rooms_are_two_levels_deep():
    assert [p for p in folders() if len(p.relative_to(ROOT).parts) > 3] == []


def test_every_room_says_what_it_is_for():
    for folder in folders():
        assert ast.get_docstring(ast.parse((folder / "__init__.py").read_text(encoding="utf-8"))), folder


def test_no_name_of_a_module_occurs_twice_in_a_package():
    names = Counter((package_of(path), path.stem) for path in modules() if path.stem != "__init__")
    assert [name for name, n in names.items() if n > 1] == []


@pytest.mark.parametrize(
    "pattern",
    [
        r"^\s*\w+ = NDArray\[",  # array types: rotorid.base.arrays
        r"\* 30(\.0)? / (np|math)\.pi|60 / \(2 \* (np|math)\.pi\)",  # rpm: rotorid.base.rpm
        r"float\(\w+\) if (np|math)\.isfinite\(\w+\) else None",  # JSON: rotorid.base.json
    ],
)
def test_what_the_floor_has_is_written_there_only(pattern):
    own = ROOT / "rotorid" / "base"
    found = [
        f"{path.relative_to(ROOT)}:{i}"
        for path in modules()
        if own not in path.parents
        for i, line in enumerate(path.read_text(encoding="utf-8").splitlines(), 1)
        if re.search(pattern, line)
    ]
    assert found == []


def test_the_list_of_complex_functions_only_gets_shorter():
    listed = re.compile(r"# noqa: .*(PLR0913|PLR0915)(?!  what is compiled takes no objects)")
    found = [
        path.name
        for path in modules()
        for line in path.read_text(encoding="utf-8").splitlines()
        if listed.search(line)
    ]
    assert len(found) == COMPLEX_FUNCTIONS, found
    assert not [path.name for path in modules() if "C901" in path.read_text(encoding="utf-8")]


def test_no_circle_is_allowed():
    assert "ignore_imports" not in (ROOT / "pyproject.toml").read_text(encoding="utf-8")


def test_the_command_line_computes_nothing():
    numerical = re.compile(r"^\s*(from|import) (numpy|scipy|pandas|fem|balancing|sympy)\b", re.MULTILINE)
    rooms = re.compile(r"rotorid\.(regression|harmonic|timedomain|reduction|report|expressions)\b")
    own = list((ROOT / "rotorid" / "cli").rglob("*.py"))
    texts = {path.name: path.read_text(encoding="utf-8") for path in own}
    assert [name for name, text in texts.items() if numerical.search(text) or rooms.search(text)] == []
    assert sum(len(text.splitlines()) for text in texts.values()) < 3500
