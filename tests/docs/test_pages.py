"""What the getting-started pages and the API pages tell a reader to type works as written."""

import os
import re
import shutil
import tomllib
from pathlib import Path

import pytest
from docs_blocks import blocks, commands, run_page

from rotorid.base.compiled import COMPILED
from rotorid.samples import sample_data

DOCS = Path(__file__).resolve().parents[2] / "docs"
STARTS = sorted((DOCS / "getting_started").glob("*.md"))
QUESTIONS = [DOCS / "questions.md"]
BOOK = sorted(
    set((DOCS.parent / "examples" / "book").glob("*.md"))
    - {
        DOCS.parent / "examples" / "book" / name
        for name in ("README.md", "covered.md", "numbers.md", "words.md")
    }
)
SINGLE = [DOCS / "sure.md", DOCS / "fleet.md"]
EVERY_TIME = ("getting_started/balancing", "getting_started/identification", "book/rotor")
"""Pages of which `make test` runs the blocks; `make docs` runs all."""
PAGES = [*STARTS, *QUESTIONS, *BOOK, *SINGLE, *sorted((DOCS / "api").glob("*.md"))]


@pytest.fixture
def workplace(tmp_path, monkeypatch):
    shutil.copytree(sample_data(), tmp_path / "sample_data")
    monkeypatch.chdir(tmp_path)
    return tmp_path


USERS = {"balancing", "rotor", "identification"}


def test_there_is_a_page_for_each_of_the_three_users():
    assert {page.stem for page in STARTS} == {*USERS, "installation", "without_phase"}


def name_of(page):
    return f"{page.parent.name}/{page.stem}"


@pytest.mark.parametrize(
    "page",
    [
        pytest.param(page, id=name_of(page), marks=[] if name_of(page) in EVERY_TIME else pytest.mark.full)
        for page in PAGES
    ],
)
def test_every_block_of_a_page_runs_and_prints_what_the_page_says(page, workplace, cli, capsys):
    if page.stem == "motion" and not COMPILED:
        pytest.skip("long without the extra rotorid[fast]")
    if page.stem == "fleet":
        pytest.importorskip("pyarrow", reason="without the extra rotorid[fleet]")
    renewals = {} if os.environ.get("ROTORID_RENEW_PAGES") else None
    ran = run_page(page, workplace, cli, capsys, renewals)
    if renewals:
        text = page.read_text(encoding="utf-8")
        for old, new in renewals.items():
            text = text.replace(f"```console\n{old}```", f"```console\n{new}```")
        page.write_text(text, encoding="utf-8")
    assert ran == sum(
        len(commands(block)) if block.kind == "console" else block.kind == "python" for block in blocks(page)
    )
    if page in BOOK:
        assert ran >= 1
    if page in STARTS or page in QUESTIONS:
        assert ran >= (5 if page.stem in USERS else 2)
        for block in blocks(page):
            for command, _ in commands(block) if block.kind == "console" else ():
                for target in re.findall(
                    r"--(?:plot|output|report|model|state-space|template) (\S+)", command
                ):
                    assert (workplace / target).stat().st_size > 0, command


def test_a_wrong_number_on_a_page_is_found(tmp_path, workplace, cli, capsys):
    text = (DOCS / "getting_started" / "rotor.md").read_text(encoding="utf-8")
    page = tmp_path / "wrong.md"
    page.write_text(text.replace("135.2404\n", "135.2405\n"), encoding="utf-8")
    with pytest.raises(AssertionError, match=r"not printed: 1 forward 1291\.45 21\.5242 135\.2405"):
        run_page(page, workplace, cli, capsys)


def test_the_installation_is_that_of_the_package():
    page = (DOCS / "getting_started" / "installation.md").read_text(encoding="utf-8")
    project = tomllib.loads((DOCS.parent / "pyproject.toml").read_text(encoding="utf-8"))["project"]
    assert f"in '{project['requires-python']}'" in page
    assert f"{project['name']}-{project['version']}-py3-none-any.whl" in page
    assert project["scripts"].keys() == {"rotorid"}
    for name in re.findall(r"--constraint[s= ]+(\S+)", page):
        assert (DOCS.parent / name.strip('"`')).exists(), name
