"""The course of `examples/book`: no number of the three texts is missing, every command runs; its schemes."""

import re
import shlex
import shutil
import subprocess
import sys
from pathlib import Path

import pytest
from docs_blocks import blocks, check_formulas, check_links, commands

from rotorid.samples import sample_data

FOLDER = Path(__file__).resolve().parents[2] / "examples" / "book"
PAGE = FOLDER / "covered.md"


def _to(last, first=1, text="({})"):
    return [text.format(n) for n in range(first, last + 1)]


def _tasks(*lessons):
    return [f"task {i}.{j}" for i, number in enumerate(lessons, 1) for j in range(1, number + 1)]


# Read from the texts. Some numbers the scan has lost; they stand between their neighbours.
NUMBERED = {
    "[S]": [
        *_to(50),
        *("(2)′", "(6)′", "(28)′"),
        *("2.1 (1)", "2.2 (1)", "3.1 (1)", "4.1 (1)", "7.1 (1)", "7.1 (2)", "8.1 (1)"),
        *_tasks(2, 3, 3, 3, 2, 2, 2, 2, 2),
        *(f"table of {place}" for place in ("task 5.1", "task 5.2", "task 6.1", "task 9.1", "figure 14")),
        "section 1.8",
    ],
    "[Q]": [*_to(36, text="(2.{})"), *_to(3, text="table 2.{}"), "section 2.3"],
    "[F]": [
        *_to(8, text="(3.{})"),
        "definition 3.1",
        "Runge–Kutta",
        "algorithm",
        *_to(4, text="laboratory task {}"),
        "record 1",
    ],
}


def rows(text, source):
    """Of the table of one text: numbers, what it is, command."""
    table = text.split(f"\n### {source}\n", 1)[1].split("\n### ", 1)[0]
    lines = [line for line in table.splitlines() if line.startswith("| ")]
    return [[cell.strip() for cell in line.strip("| ").split(" | ")] for line in lines[1:]]


def numbers(cell):
    """The numbers that a cell names, ranges spelt out."""
    found = []
    for words in cell.split(", "):
        first, _, last = words.partition("–")
        if last and re.fullmatch(r"\([\d.]+\)", last):
            chapter = first.strip("()").rpartition(".")[0]
            begin, end = (int(word.strip("()").rpartition(".")[2]) for word in (first, last))
            found += _to(end, begin, f"({chapter}.{{}})" if chapter else "({})")
        else:
            found.append(words)
    return found


TEXT_OF_PAGE = PAGE.read_text(encoding="utf-8")
ROWS = {source: rows(TEXT_OF_PAGE, source) for source in (*NUMBERED, "In words")}
COMMANDS = dict.fromkeys(re.findall(r"`(rotorid [^`]+)`", TEXT_OF_PAGE))
TYPED = {
    command
    for page in FOLDER.glob("*.md")
    for block in blocks(page)
    if block.kind == "console"
    for command, _ in commands(block)
}
"""On the other pages, which `test_pages` runs."""


@pytest.mark.parametrize("source", NUMBERED)
def test_every_number_of_the_texts_is_in_the_table_once(source):
    named = [number for row in ROWS[source] for number in numbers(row[0])]
    assert sorted(named) == sorted(NUMBERED[source])


def test_every_row_has_a_command_or_a_page_or_says_why_not():
    for row in [row for table in ROWS.values() for row in table]:
        assert len(row) == 3, row
        assert re.fullmatch(r"`rotorid [^`]+`|`make book`|not computed, because .+", row[2]), row


@pytest.mark.full
@pytest.mark.parametrize("command", [command for command in COMMANDS if command not in TYPED])
def test_every_command_that_no_other_page_has_runs(command, tmp_path, monkeypatch, cli):
    shutil.copytree(sample_data(), tmp_path / "sample_data")
    monkeypatch.chdir(tmp_path)
    assert cli(*shlex.split(command)[1:]).code == 0


def test_the_schemes_are_those_that_the_module_draws(tmp_path):
    """Ten, all of them on a page, as `python examples/book/schemes.py` writes them."""
    subprocess.run([sys.executable, FOLDER / "schemes.py", tmp_path], check=True)
    drawn = {path.name: path.read_text(encoding="utf-8") for path in tmp_path.iterdir()}
    stored = {path.name: path.read_text(encoding="utf-8") for path in (FOLDER / "schemes").iterdir()}
    assert drawn == stored
    pages = "".join(page.read_text(encoding="utf-8") for page in FOLDER.glob("*.md"))
    assert set(re.findall(r"\]\(schemes/(\w+\.svg)\)", pages)) == set(drawn)
    assert len(drawn) == 10


@pytest.mark.parametrize("page", sorted(FOLDER.glob("*.md")), ids=lambda page: page.stem)
def test_links_of_a_page_lead_somewhere_and_its_formulas_become_mathml(page):
    check_links(page)
    check_formulas(page)
