"""The theory pages: Python blocks run in order, formulas can be shown, links lead somewhere."""

import re
from importlib import import_module
from pathlib import Path

import pytest
from docs_blocks import check_formulas

ROOT = Path(__file__).resolve().parents[2]
FOLDER = ROOT / "docs" / "theory"
INDEX = (FOLDER / "index.md").read_text(encoding="utf-8")
TOCTREE = re.search(r"```\{toctree\}\n(.*?)```", INDEX, re.DOTALL)
PAGES = [line for line in TOCTREE[1].split() if not line.startswith(":") and not line.isdigit()]
BLOCK = re.compile(r"^```python\n(.*?)^```$", re.DOTALL | re.MULTILINE)
FENCED = re.compile(r"^```.*?^```$", re.DOTALL | re.MULTILINE)


def text_of(page):
    return (FOLDER / f"{page}.md").read_text(encoding="utf-8")


def test_the_index_lists_every_page():
    assert sorted(PAGES) == sorted(path.stem for path in FOLDER.glob("*.md") if path.stem != "index")
    assert len(PAGES) == 8


def run(page):
    """Run the blocks of a page in order; an error shows its line of the page."""
    text = text_of(page)
    names = {"__name__": "__theory__"}
    for block in BLOCK.finditer(text):
        first = text.count("\n", 0, block.start(1))
        exec(compile("\n" * first + block[1], str(FOLDER / f"{page}.md"), "exec"), names)


@pytest.mark.full
@pytest.mark.parametrize("page", PAGES)
def test_the_code_of_a_page_runs_and_its_formulas_hold(page, monkeypatch):
    monkeypatch.chdir(ROOT)
    run(page)


@pytest.mark.parametrize("page", PAGES)
def test_every_block_checks_something(page):
    blocks = BLOCK.findall(text_of(page))
    assert blocks
    assert all("assert " in block for block in blocks)


@pytest.mark.parametrize("page", ["index", *PAGES])
def test_every_formula_becomes_mathml(page):
    """As docs/_ext/mathml.py writes it: no command is left over as text, and the result is well-formed."""
    assert check_formulas(FOLDER / f"{page}.md")


@pytest.mark.parametrize("page", ["index", *PAGES])
def test_links_lead_somewhere_and_lines_fit(page):
    text = text_of(page)
    for link in re.findall(r"\]\(([^)#]+)(?:#[^)]*)?\)", FENCED.sub("", text)):
        assert (FOLDER / link).exists(), link
    assert text.startswith("# ")
    assert max(map(len, text.splitlines())) <= 120


@pytest.mark.parametrize("page", PAGES)
def test_files_and_functions_named_in_a_page_exist(page):
    for name in re.findall(r"`((?:tests|examples|sample_data|docs)/[\w./]+)`", text_of(page)):
        assert (ROOT / name).exists(), name
    for package, name in re.findall(r"`(fem|balancing|rotorid)\.(\w+)`", text_of(page)):
        assert hasattr(import_module(package), name), f"{package}.{name}"
