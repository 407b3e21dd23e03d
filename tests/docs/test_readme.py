"""What the README tells a reader to type works as written."""

import re
import shlex
import shutil
from pathlib import Path

import pytest
from golden.cases import CASES, TEXT
from golden.storing import read

ROOT = Path(__file__).resolve().parents[2]
BLOCKS = re.findall(r"```(\w*)\n(.*?)```", (ROOT / "README.md").read_text(encoding="utf-8"), re.DOTALL)
COMMANDS = [
    line for kind, text in BLOCKS if not kind for line in text.splitlines() if line.startswith("rotorid ")
]
SCRIPTS = [text for kind, text in BLOCKS if kind == "python"]


@pytest.fixture
def workplace(tmp_path, monkeypatch):
    shutil.copytree(ROOT / "sample_data", tmp_path / "sample_data")
    monkeypatch.chdir(tmp_path)
    return tmp_path


def test_the_readme_shows_commands_and_code():
    assert len(COMMANDS) >= 4
    assert len(SCRIPTS) >= 1


@pytest.mark.parametrize("command", COMMANDS)
def test_every_command_of_the_readme_runs(command):
    """The net runs it and compares with what is stored: success, and the files that it asks for."""
    words = shlex.split(command)[1:]
    name = next((name for name, case in CASES.items() if case.words == words and TEXT in case.forms), None)
    assert name is not None, "make it a case of tests/golden/cases.py, and run `make golden`"
    texts, _ = read(name)
    assert texts["status"].endswith("\nstatus 0")
    for option in ("--plot", "--output", "--report", "--model", "--state-space", "--template"):
        if option in words:
            assert len(texts[f"file {words[words.index(option) + 1]}"]) > 0


@pytest.mark.parametrize("script", SCRIPTS)
def test_every_script_of_the_readme_runs(workplace, script, capsys):
    exec(compile(script, "README.md", "exec"), {})
    assert "135.240" in capsys.readouterr().out
    assert (workplace / "corrections.csv").stat().st_size > 0


def test_every_file_the_readme_links_to_exists():
    links = re.findall(r"\]\(([^)#]+)\)", (ROOT / "README.md").read_text(encoding="utf-8"))
    assert links
    for link in links:
        assert (ROOT / link).exists() or link.startswith("http"), link
