"""Help: panels, the common options first, 100 columns, examples that run as typed; `rotorid` alone."""

import shlex
import sys
from pathlib import Path

import pytest
from golden.cases import CASES, STORED
from repetitions import FULL
from typer.core import TyperOption

import rotorid.cli
from rotorid.base.answer import COLUMNS
from rotorid.samples import sample_data

sys.path.append(str(Path(__file__).resolve().parents[3] / "docs" / "_ext"))

from commands import all_commands, split_help

COMMANDS = dict(all_commands())
FIRST = "Input", "Input and conventions", "Output"
STORED_LINES = {f"rotorid {CASES[name].command}" for name in STORED}
EXAMPLES = [(name, line) for name, one in COMMANDS.items() for line in split_help(one.help)[1]]


def options(command):
    return [one for one in command.params if one.param_type_name == "option"]


@pytest.fixture
def checkout(tmp_path, monkeypatch):
    """An empty folder with the sample data, as in a checkout."""
    (tmp_path / "sample_data").symlink_to(sample_data(), target_is_directory=True)
    monkeypatch.chdir(tmp_path)


@pytest.mark.parametrize("name", COMMANDS)
def test_every_option_has_a_panel_and_the_first_two_are_short(name):
    panels = {}
    for one in options(COMMANDS[name]):
        assert one.rich_help_panel, one.name
        panels.setdefault(one.rich_help_panel, []).append(one.name)
    sizes = [len(names) for names in panels.values()]
    assert sum(sizes[:2]) <= 12, panels
    assert not panels or next(iter(panels)) in FIRST
    # panels follow each other in plain help, too, where their titles are not printed
    in_order = [one.rich_help_panel for one in options(COMMANDS[name])]
    assert in_order == sorted(in_order, key=list(panels).index) or in_order[-1] == "Output"


@pytest.mark.parametrize("plain", [False, True])
@pytest.mark.parametrize("name", [*COMMANDS, ""])
def test_help_fits_the_terminal_and_names_no_types(cli, monkeypatch, name, plain):
    monkeypatch.setenv("COLUMNS", str(COLUMNS))
    monkeypatch.setattr(rotorid.cli, "plain", lambda: plain)
    text = cli(*name.split(), "--help").out
    assert max(map(len, text.splitlines())) <= COLUMNS
    if name:
        ranges = ["[x>="] if hasattr(TyperOption, "_get_number_range_help_str") else []  # typer 0.29
        for hidden in ("<bool>", "<path>", "list[", "<str>", "<int", "[[", "🅱", *ranges):
            assert hidden not in text, hidden
        for one in options(COMMANDS[name]):
            assert one.opts[0] in text
        assert ("─ Output ─" in text) == (not plain)


@pytest.mark.full
@pytest.mark.parametrize(("name", "line"), EXAMPLES, ids=[f"{n}-{i}" for i, (n, _) in enumerate(EXAMPLES)])
def test_every_example_runs_as_typed(cli, checkout, name, line):
    words = shlex.split(line)
    assert words[: 1 + len(name.split())] == ["rotorid", *name.split()]
    if name.startswith("fleet"):
        pytest.importorskip("pyarrow", reason="without the extra rotorid[fleet]")
    if name == "worksheet":
        return  # its own tests run it
    if line in STORED_LINES and not FULL:
        return  # the net runs it and compares with what is stored
    outcome = cli(*words[1:])
    assert (outcome.code, outcome.err) == (0, outcome.err)


@pytest.mark.full
def test_rotorid_alone_shows_the_jobs_with_examples_that_run(cli, checkout):
    outcome = cli()
    lines = outcome.out.splitlines()
    assert outcome.code == 0
    assert len(lines) <= 24
    assert max(map(len, lines)) <= COLUMNS
    words = set(outcome.out.replace(",", " ").replace(";", " ").split())
    assert {name.split()[0] for name in COMMANDS} <= words
    examples = [line.strip() for line in lines if line.startswith("  rotorid ")]
    assert [example.split()[1] for example in examples] == ["balance", "critical", "reduce", "identify"]
    for example in examples:
        assert cli(*shlex.split(example)[1:]).code == 0, example
