"""The documentation as it is built: no warning, every public name, command, option and figure, no network."""

import html
import os
import re
import subprocess
import sys
from importlib import import_module
from pathlib import Path

import pytest

ROOT = Path(__file__).resolve().parents[2]
DOCS = ROOT / "docs"
for _folder in (DOCS / "_ext", DOCS):
    sys.path.insert(0, str(_folder))

import commands as command_pages  # noqa: E402 - of docs/_ext
import mathml  # noqa: E402

pytestmark = pytest.mark.full
PACKAGES = (
    "fem",
    "balancing",
    "rotorid",
    "rotorid.identify",
    "rotorid.reduction",
    "rotorid.calibration",
    "rotorid.files",
)
PICTURE = re.compile(r"^```\{picture\} (.*)$", re.MULTILINE)
EXTERNAL = re.compile(
    r"<(?:script|img|iframe|source|video|audio|object|embed)[^>]+(?:src|data)=\"(?:https?:)?//"
    r"|<link[^>]+href=\"(?:https?:)?//|url\([\"']?(?:https?:)?//|@import",
)


@pytest.fixture(scope="session")
def built(tmp_path_factory):
    """The folder of the built pages; everything that the builder had to say is a failure."""
    if os.environ.get("ROTORID_BUILT_DOCS"):  # `make docs` has built them
        return Path(os.environ["ROTORID_BUILT_DOCS"]).resolve()
    folder = tmp_path_factory.mktemp("docs")
    options = ["-W", "--keep-going", "-q", "-j", "auto", "-b", "html", "-d", str(folder / "doctrees")]
    done = subprocess.run(
        [sys.executable, "-m", "sphinx", *options, str(DOCS), str(folder / "html")],
        capture_output=True,
        text=True,
        cwd=ROOT,
    )
    assert (done.returncode, done.stderr) == (0, "")
    return folder / "html"


def page(built, name):
    return (built / f"{name}.html").read_text(encoding="utf-8")


def text_of(page_text):
    """What a reader sees, spaces as one."""
    return " ".join(html.unescape(re.sub(r"<[^>]+>", "", page_text)).split())


def test_every_page_is_built_and_can_be_reached(built):
    sources = [path.relative_to(DOCS).with_suffix("") for path in DOCS.rglob("*.md")]
    sources = [path for path in sources if not path.parts[0].startswith("_")]
    assert len(sources) >= 15
    for source in sources:
        text = page(built, source)
        assert len(text_of(text)) > 300, source
    start = page(built, "index")
    for name in ("getting_started/balancing", "getting_started/rotor", "getting_started/identification"):
        assert f'href="{name}.html' in start


def test_no_page_asks_the_network_for_anything(built):
    pages = [*built.rglob("*.html"), *built.rglob("*.css")]
    assert len(pages) >= 15
    for path in pages:
        found = EXTERNAL.search(path.read_text(encoding="utf-8"))
        assert found is None, f"{path.name}: {found[0]}"


@pytest.mark.parametrize("package", PACKAGES)
def test_every_public_name_has_its_entry(built, package):
    entries = set()
    for path in (built / "api").glob("*.html"):
        entries |= set(re.findall(r'<dt class="[^"]*"[^>]* id="([\w.]+)"', path.read_text(encoding="utf-8")))
    documented = {entry.rpartition(".")[2] for entry in entries}
    assert sorted(set(import_module(package).__all__) - documented - {"plots"}) == []


def test_every_command_and_every_option_is_on_its_page(built):
    text = page(built, "commands")
    described = list(command_pages.all_commands())
    assert len(described) >= 13
    for name, command in described:
        found = re.search(rf'<section id="rotorid-{name.replace(" ", "-")}">(.*?)</section>', text, re.DOTALL)
        assert found, name
        terms = " ".join(text_of(term) for term in re.findall(r"<dt>(.*?)</dt>", found[1], re.DOTALL))
        words = set(re.split(r"[\s,]+", terms))
        assert command.params
        for param in command.params:
            if param.param_type_name == "option":
                assert set(param.opts) <= words, f"{name} {param.opts}"
            else:
                assert " ".join((param.metavar or param.name.upper()).split()) in terms, (
                    f"{name} {param.name}"
                )
            assert " ".join((param.help or "").replace("`", "").split()) in text_of(found[1]), param.name
        for example in command_pages.split_help(command.help)[1]:
            assert example in text_of(found[1])


def test_every_command_has_an_example():
    for name, command in command_pages.all_commands():
        examples = command_pages.split_help(command.help)[1]
        assert examples, name
        assert all(example.startswith(f"rotorid {name}") for example in examples)


def test_pictures_are_drawn_by_a_command_that_the_page_shows(built):
    pages = {path: path.read_text(encoding="utf-8") for path in DOCS.rglob("*.md")}
    shown = [(path, command) for path, text in pages.items() for command in re.findall(PICTURE, text)]
    assert len(shown) >= 7
    for path, command in shown:
        assert f"$ rotorid {command}" in pages[path]
    drawn = "".join(path.read_text(encoding="utf-8") for path in built.rglob("*.html"))
    assert drawn.count('<figure class="drawn"') == len(shown)


def test_formulas_are_mathml(built):
    theory = "".join(path.read_text(encoding="utf-8") for path in (built / "theory").glob("*.html"))
    assert theory.count("<math ") >= 20
    assert not re.search(r"<script[^>]*mathjax", theory, re.IGNORECASE)
    assert mathml.setup.__module__ == "mathml"
