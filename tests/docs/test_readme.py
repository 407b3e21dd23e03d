"""What the README tells a reader to type works as written."""

import re
import shlex
import shutil
from pathlib import Path

import pytest

ROOT = Path(__file__).resolve().parents[2]
BLOCKS = re.findall(r"```(\w*)\n(.*?)```", (ROOT / "README.md").read_text(encoding="utf-8"), re.DOTALL)
COMMANDS = re.findall(r"\| `(rotorid [^`]+)` \|", (ROOT / "README.md").read_text(encoding="utf-8"))
SCRIPTS = [text for kind, text in BLOCKS if kind == "python"]


@pytest.fixture
def workplace(tmp_path, monkeypatch):
    shutil.copytree(ROOT / "sample_data", tmp_path / "sample_data")
    monkeypatch.chdir(tmp_path)
    return tmp_path


@pytest.mark.parametrize("command", COMMANDS)
def test_every_command_of_the_readme_runs(workplace, cli, command):
    """With success, and it writes the files that it asks for."""
    words = shlex.split(command)[1:]
    assert cli(*words).code == 0
    for option in ("--plot", "--output", "--report", "--template"):
        if option in words:
            assert (workplace / words[words.index(option) + 1]).stat().st_size > 0


@pytest.mark.parametrize("script", SCRIPTS)
def test_every_script_of_the_readme_runs(workplace, script, capsys):
    exec(compile(script, "README.md", "exec"), {})
    assert "135.240" in capsys.readouterr().out
    assert (workplace / "corrections.csv").stat().st_size > 0


def test_every_file_the_readme_links_to_exists():
    links = re.findall(r"\]\(([^)#]+)\)", (ROOT / "README.md").read_text(encoding="utf-8"))
    assert len({link for link in links if link.startswith("docs") and link.endswith(".md")}) <= 8
    assert len(COMMANDS) == 5
    for link in links:
        assert (ROOT / link).exists() or link.startswith("http"), link
