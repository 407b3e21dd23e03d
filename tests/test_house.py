"""The test of the house: layers without circles, ceilings of size, limits of ruff that are not loosened."""

import ast
import re
import tomllib
from pathlib import Path

import dialect
import house
import pytest
import typer.main
from typer.core import TyperGroup

from rotorid.cli import application

ROOT = Path(__file__).resolve().parents[1]
PACKAGES = house.PACKAGES
PROJECT = tomllib.loads((ROOT / "pyproject.toml").read_text(encoding="utf-8"))["tool"]
RUFF = PROJECT["ruff"]
PAIRS, NAMES, SCREEN = 230, 110, 25
"""Commands with options, without --help, and of one command: at most so many."""
EXEMPT = 16
"""Functions that may be longer or take more than ruff's limits: at most so many."""
DIALECT = 50
"""Bindings named `said`, `told`, `found`, `own`, `known` or `felt`: at most so many."""


def modules():
    return [path for package in PACKAGES for path in sorted((ROOT / package).rglob("*.py"))]


def lines_with(pattern):
    pattern = re.compile(pattern)
    return [
        f"{path.relative_to(ROOT)}:{i}"
        for path in modules()
        for i, line in enumerate(path.read_text(encoding="utf-8").splitlines(), 1)
        if pattern.search(line)
    ]


def test_no_ceiling_in_force_is_exceeded():
    in_force = [row for row in house.CEILINGS if row[-1] in house.RESOLVED]
    assert house.exceeded(house.measured(ceilings=in_force)) == []


def test_modules_are_at_most_240():
    assert len(modules()) <= 240


def test_pages_are_at_most_30_000_words_and_what_makes_them_500_lines():
    pages = [path.read_text(encoding="utf-8") for path in sorted((ROOT / "docs").rglob("*.md"))]
    assert sum(len(page.split()) for page in pages) <= 30_000
    code = [ROOT / "docs" / "conf.py", *(ROOT / "docs" / "_ext").glob("*.py")]
    assert sum(path.read_text(encoding="utf-8").count("\n") for path in code) <= 500
    assert sum(path.read_text(encoding="utf-8").count("\n") for path in ROOT.glob("benchmarks/*.py")) <= 1000


def test_every_package_stands_in_a_row():
    assert house.in_no_row() == []


def test_names_say_what_they_hold():
    places = dialect.bindings()
    assert len(places) <= DIALECT, places


@pytest.mark.parametrize(
    ("text", "count"),
    [
        ("found = 1\nself.own = [known for known in b]\nfor told, _ in x: pass", 4),
        ("def f(said, *, felt=1): found(own=2, known=said)", 2),
        ("class A:\n    _known: int\n    unknown = found_later = 1", 1),
    ],
)
def test_bindings_of_the_dialect_are_counted(tmp_path, text, count):
    (tmp_path / "fem").mkdir()
    (tmp_path / "fem" / "a.py").write_text(text, encoding="utf-8")
    assert len(dialect.bindings(tmp_path, ("fem",))) == count


def test_units_are_what_a_reader_reads():
    text = '"""Two\nlines."""\n\n# a comment\nx = f(\n    1,\n    b="' + 80 * "c" + '",\n)\n'
    assert house.units(text) == len(("x", "=", "f", "(", "1", "b", "=", "c")) + 2
    assert house.units("a" * 23, ".html") == 4


@pytest.fixture
def small_house(tmp_path):
    for name in ("fem/__init__.py", "fem/inside/b.py", "fem/data/c.py", "rotorid/d.py", "rotorid/e/f.py"):
        (tmp_path / name).parent.mkdir(parents=True, exist_ok=True)
        (tmp_path / name).write_text("x = 1\n", encoding="utf-8")
    (tmp_path / "fem" / "page.html").write_text(20 * "h", encoding="utf-8")
    (tmp_path / "fem" / "data" / "table.csv").write_text(20 * "h", encoding="utf-8")
    return tmp_path


def test_a_row_over_its_ceiling_is_seen_once_its_issue_is_resolved(small_house):
    fem = house.measured(small_house, [("fem", 12, "1"), ("fem", 13, "1")])
    assert [(row.units, row.lines, row.files) for row in fem] == [(13, 3, 4), (13, 3, 4)]
    assert house.exceeded(fem, {"1"}) == fem[:1]
    assert house.exceeded(fem, {"2"}) == []


def test_a_package_in_no_row_is_seen(small_house):
    rows = [("rotorid fem", 99, "1"), ("rotorid/e", 99, "1")]
    assert house.in_no_row(small_house, rows) == ["rotorid/d.py"]
    assert house.in_no_row(small_house, [("rotorid/d.py", 99, "1")]) == ["fem", "rotorid/e"]


def test_ruff_and_its_formatter_are_not_loosened():
    lint = RUFF["lint"]
    assert {"C901", "PLR0913", "PLR0915"} <= set(lint["select"]) - set(lint["ignore"])
    assert lint["mccabe"]["max-complexity"] <= 12
    assert lint["pylint"]["max-statements"] <= 45
    assert lint["pylint"]["max-args"] <= 8
    spared = {
        place: set(codes) & {"C901", "PLR0913", "PLR0915"}
        for place, codes in lint["per-file-ignores"].items()
    }
    assert {place for place, codes in spared.items() if codes} == {"tests/*", "rotorid/cli/*"}
    assert spared["rotorid/cli/*"] == {"PLR0913"}
    assert RUFF["line-length"] == 110
    assert RUFF["extend-exclude"] == ["benchmarks/results"]
    assert not {"format", "exclude", "per-file-target-version"} & set(RUFF)
    assert not list(ROOT.glob("*ruff.toml"))
    assert lines_with(r"# fmt: off|# yapf: disable|# ruff: noqa|# flake8: noqa|# noqa(?!: ?[A-Z])") == []
    assert lines_with(r"# noqa: .*C901") == []
    exempt = lines_with(r"# noqa: .*(PLR0913|PLR0915)(?!  what is compiled takes no objects)")
    assert len(exempt) <= EXEMPT, exempt


def test_no_circle_is_allowed_and_every_layer_is_kept():
    settings = PROJECT["importlinter"]
    contracts = settings["contracts"]
    assert set(settings["root_packages"]) == set(PACKAGES)
    assert settings["exclude_type_checking_imports"] is False
    assert not [contract["name"] for contract in contracts if "ignore_imports" in contract]
    (acyclic,) = [contract for contract in contracts if contract["type"] == "acyclic_siblings"]
    assert set(acyclic["ancestors"]) == set(PACKAGES)
    layers = [contract for contract in contracts if contract["type"] == "layers"]
    assert all(contract.get("exhaustive") for contract in layers if "containers" in contract)
    assert {name for contract in layers for name in contract.get("containers", [])} == set(PACKAGES)


def test_the_command_line_computes_nothing():
    numerical = re.compile(r"^\s*(from|import) (numpy|scipy|pandas|fem|balancing|sympy)\b", re.MULTILINE)
    rooms = re.compile(r"rotorid\.(regression|harmonic|identify|reduction|report)\b")
    texts = {path.name: path.read_text(encoding="utf-8") for path in (ROOT / "rotorid" / "cli").rglob("*.py")}
    assert [name for name, text in texts.items() if numerical.search(text) or rooms.search(text)] == []


def test_every_package_says_what_it_is_for():
    for path in modules():
        if path.name == "__init__.py":
            assert ast.get_docstring(ast.parse(path.read_text(encoding="utf-8"))), path


@pytest.mark.parametrize(
    "pattern",
    [
        r"^\s*\w+ = NDArray\[",  # array types: rotorid.base.arrays
        r"\* 30(\.0)? / (np|math)\.pi|60 / \(2 \* (np|math)\.pi\)",  # rpm: rotorid.base.text
        r"float\(\w+\) if (np|math)\.isfinite\(\w+\) else None",  # JSON: rotorid.base.json
    ],
)
def test_what_the_floor_has_is_written_there_only(pattern):
    assert [place for place in lines_with(pattern) if not place.startswith("rotorid/base/")] == []


def test_no_plural_is_built_by_hand():
    """One function counts words: `counted`; no text says "mode(s)"."""
    assert lines_with(r"\} ?\w*\w\((?:e?s)\)|\} [\w ]*\{(?:''|'s') if ") == []


def options_of_commands():
    """Long names of the options of each command, by its name; of those of `fleet` as `fleet fit`."""

    def commands(group, prefix=""):
        for name, command in group.commands.items():
            if isinstance(command, TyperGroup):
                yield from commands(command, f"{name} ")
            else:
                yield f"{prefix}{name}", command

    return {
        name: [
            max((word for word in option.opts if word.startswith("--")), key=len)
            for option in command.params
            if option.param_type_name == "option" and option.name != "help"
        ]
        for name, command in commands(typer.main.get_command(application()))
    }


def test_options_are_few():
    options = options_of_commands()
    assert sum(map(len, options.values())) <= PAIRS
    assert len({name for names in options.values() for name in names}) <= NAMES
    assert max(map(len, options.values())) <= SCREEN
