"""The documentation as it is built: no warning, every public name, command, option and figure, no network."""

import html
import re
import subprocess
import sys
from importlib import import_module, metadata
from pathlib import Path

import pytest

ROOT = Path(__file__).resolve().parents[2]
DOCS = ROOT / "docs"
for _folder in (DOCS / "_ext", DOCS):
    sys.path.insert(0, str(_folder))

import commands as command_pages  # noqa: E402 - of docs/_ext
import drawings  # noqa: E402
import figures  # noqa: E402
import mathml  # noqa: E402
import names  # noqa: E402
import results  # noqa: E402
import terms  # noqa: E402

PACKAGES = (
    "fem",
    "balancing",
    "rotorid",
    "rotorid.harmonic",
    "rotorid.timedomain",
    "rotorid.reduction",
    "rotorid.calibration",
    "rotorid.tables",
    "rotorid.workflows",
)
EXTERNAL = re.compile(
    r"<(?:script|img|iframe|source|video|audio|object|embed)[^>]+(?:src|data)=\"(?:https?:)?//"
    r"|<link[^>]+href=\"(?:https?:)?//|url\([\"']?(?:https?:)?//|@import",
)


@pytest.fixture(scope="session")
def built(tmp_path_factory):
    """The folder of the built pages; everything that the builder had to say is a failure."""
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


def test_an_external_request_would_be_seen():
    assert EXTERNAL.search('<script async src="https://cdn.example/x.js">')
    assert EXTERNAL.search('<link rel="stylesheet" href="//fonts.example/css">')
    assert not EXTERNAL.search('<a href="https://example.org">')


@pytest.mark.parametrize("package", PACKAGES)
def test_every_public_name_has_its_entry(built, package):
    entries = set()
    for path in (built / "api").glob("*.html"):
        entries |= set(re.findall(r'<dt class="[^"]*"[^>]* id="([\w.]+)"', path.read_text(encoding="utf-8")))
    module, top = import_module(package), import_module("rotorid")
    assert module.__all__
    for name in module.__all__:
        known = f"{package}.{name}" in entries
        # what the package rotorid offers itself is documented there
        again = name in top.__all__ and getattr(top, name) is getattr(module, name)
        assert known or (again and f"rotorid.{name}" in entries), f"{package}.{name}"


def test_every_command_and_every_option_is_on_its_page(built):
    text = page(built, "commands")
    described = list(command_pages.all_commands())
    assert len(described) >= 13
    for name, command in described:
        found = re.search(rf'<section id="rotorid-{name.replace(" ", "-")}">(.*?)</section>', text, re.DOTALL)
        assert found, name
        terms = " ".join(text_of(term) for term in re.findall(r"<dt>(.*?)</dt>", found[1], re.DOTALL))
        words = set(re.split(r"[\s,]+", terms))
        assert len(command.params) >= 2
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


DRAWN = re.compile(
    r'<figure class="drawn" id="figure-([\w-]+)"><img alt="([^"]{20,})" width="(\d+)" src="data:image/'
)


def test_figures_are_drawn_by_the_commands_of_their_pages(built):
    shown = {}
    for path in built.rglob("*.html"):
        for name, *_ in DRAWN.findall(path.read_text(encoding="utf-8")):
            if path.stem != "gallery":
                shown[name] = (DOCS / path.relative_to(built)).with_suffix(".md").read_text(encoding="utf-8")
    assert len(shown) >= 7
    for name, source in shown.items():
        assert f"$ rotorid {figures.FIGURES[name].command.replace(chr(39), chr(34))}" in source, name


def test_the_gallery_has_every_picture_with_its_command_and_what_it_lets_one_read(built):
    text = page(built, "gallery")
    said = {name: (html.unescape(caption), int(wide)) for name, caption, wide in DRAWN.findall(text)}
    assert list(said) == [one.name for one in figures.GALLERY]
    for one in figures.GALLERY:
        caption, wide = said[one.name]
        assert caption == one.read
        assert caption.endswith(".")
        assert wide <= 7 * 108 + 1, f"{one.name}: wider than 7 inches"
        assert all(f"$ {line}" in text_of(text) for line in one.typed.splitlines())
    assert 'href="gallery.html' in page(built, "index")


def test_every_command_that_draws_is_in_the_gallery():
    able = {
        name
        for name, command in command_pages.all_commands()
        if any("--plot" in param.opts for param in command.params)
    }
    drawn = [one.command for one in figures.GALLERY]
    assert {name for name in able if any(command.startswith(f"{name} ") for command in drawn)} == able


def test_a_figure_is_the_same_every_time():
    first, second = figures.picture("modes"), figures.picture("modes")
    assert first == second
    assert first.startswith(b"<?xml")


def test_drawings_are_on_a_page_and_the_same_every_time(built):
    sources = "".join(path.read_text(encoding="utf-8") for path in DOCS.rglob("*.md"))
    shown = " ".join(re.findall(r"^```{drawing} (.*)$", sources, re.MULTILINE)).split()
    assert set(shown) == set(drawings.DRAWINGS)
    made = sum(path.read_text("utf-8").count("<img alt=") for path in built.rglob("*.html"))
    beside = sum(page.read_text("utf-8").count("```{drawn}") for page in DOCS.rglob("*.md"))
    assert made == len(shown) + beside + len(figures.GALLERY)
    assert drawings.svg("turning") == drawings.svg("turning")


def test_the_first_use_of_a_term_leads_to_the_glossary(built):
    labels = set(re.findall(r'<dt id="(term-[^"]+)"', page(built, "glossary")))
    assert len(labels) >= 60
    linked = {}
    for path in built.rglob("*.html"):
        text = path.read_text(encoding="utf-8")
        found = re.findall(r'<a class="[^"]*\bterm\b[^"]*" href="[^"]*glossary\.html#([^"]+)"', text)
        assert len(found) == len(set(found)), path.name
        assert set(found) <= labels, path.name
        linked[path.relative_to(built).with_suffix("").as_posix()] = set(found)
        # no paragraph has a term of which the page has no link
        said = " ".join(re.findall(r"<p>(.*?)</p>", text, re.DOTALL))
        plain = re.sub(r"<(code|a|cite)\b.*?</\1>", "·", said, flags=re.DOTALL)
        for term in ("influence coefficient", "critical speed", "condition number", "trial weight"):
            label = f"term-{term.replace(' ', '-')}"
            if path.stem != "glossary" and terms.finder([term]).search(html.unescape(plain)):
                assert label in text, f"{path.name}: {term}"
    assert {"term-condition-number", "term-trial-weight"} <= linked["getting_started/balancing"]
    assert "term-Guyan" in linked["getting_started/rotor"]
    assert "term-key-phasor" in linked["conventions"]


def test_terms_are_whole_words_in_any_number_and_the_longest_first():
    found = terms.finder(["rank", "residual", "permissible residual unbalance", "1×", "95 % interval"])
    text = "Ranks, frank; no permissible\nresidual unbalance, residuals 1× and 95 % intervals"
    assert [match[0] for match in found.finditer(text)] == [
        "Ranks",
        "permissible\nresidual unbalance",
        "residuals",
        "1×",
        "95 % intervals",
    ]


def test_the_validation_page_has_every_row(built):
    from rotorid.validation import validate

    rows = validate().to_dict()["rows"]
    text = page(built, "validation")
    body = re.findall(r"<tbody>(.*?)</tbody>", text, re.DOTALL)
    assert sum(part.count("<tr") for part in body) == len(rows) > 400
    seen = text_of(text)
    for note in {row["note"] for row in rows if row["note"]}:
        assert " ".join(note.replace("`", "").split()) in seen


ROW = {
    "source": "[S] 1",
    "quantity": "c, N/m",
    "printed": 1e3,
    "printed_text": "1.00e3",
    "computed": 1000.25,
    "difference": 0.25,
    "tolerance": 5.0,
    "status": "agrees",
    "note": "",
}


def test_a_row_that_differs_stops_the_build():
    head, section = results.validation_nodes([ROW, ROW | {"status": "erratum", "note": "a `sign` is lost"}])
    assert (
        head.astext()
        == "2 numbers can fail: 1 agree, 1 are misprints, 0 follow from these; 0 more are given values."
    )
    assert "1000.25" in section.astext()
    assert "erratum (1)" in section.astext()
    assert "a sign is lost" in section.astext()
    with pytest.raises(ValueError, match="c, N/m: differs"):
        results.validation_nodes([ROW | {"status": "differs"}])


def test_measured_times_are_shown_and_differing_answers_are_refused():
    row = {
        "task": "critical speeds",
        "ours": "fem",
        "our_seconds": 1e-3,
        "peer": "ROSS",
        "peer_seconds": 0.25,
        "difference": 1e-9,
        "allowed": 1e-6,
        "required_ratio": 10.0,
        "note": "",
    }
    head, table = results.benchmark_nodes({"machine": "Python 3, 2 processors", "rows": [row]})
    assert head.astext() == "Measured with Python 3, 2 processors."
    assert [cell.astext() for cell in table.findall(lambda node: node.tagname == "entry")][6:] == [
        "critical speeds, fem",
        "1",
        "ROSS",
        "250",
        "250",
        "1e\N{MINUS SIGN}09",
    ]
    with pytest.raises(ValueError, match="critical speeds"):
        results.benchmark_nodes({"machine": "x", "rows": [row | {"difference": 1e-3}]})


def test_bars_and_stars_of_docstrings_are_taken_literally():
    lines = [
        "The size |Im λ| of a*b, `|code|` and `Problem`s:",
        "",
        ">>> 2 * 3",
        "6",
        "",
        "names_ are::",
        "",
        "  |x|",
    ]
    assert names.plain(lines) == [
        "The size \\|Im λ\\| of a\\*b, `|code|` and `Problem`\\ s:",
        "",
        ">>> 2 * 3",
        "6",
        "",
        "names\\_ are::",
        "",
        "  |x|",
    ]


def test_only_public_names_can_be_documented():
    import fem

    assert names.entry("fem", fem, "Rotor")[0] == ".. autoclass:: fem.Rotor"
    assert names.entry("fem", fem, "campbell")[0] == ".. autofunction:: fem.campbell"
    assert names.entry("fem", fem, "STEEL_POISSON")[1] == "   :value: 0.3"
    with pytest.raises(ValueError, match="no public name nonsense"):
        names.entry("fem", fem, "nonsense")


def test_signatures_are_written_as_in_the_source(built):
    import fem
    import rotorid

    text, returned = names.signature_of(rotorid.reduce)
    assert text.startswith(
        "(rotor: fem.Rotor, nodes: Sequence[int], modes: int = 2, *, speed: float | None = None"
    )
    assert returned == "Reduction"
    assert names.signature_of(fem.Response.at) == ("(sensor: SensorLike)", "ComplexArray")
    assert "inner_diameter: FloatArray = ..." in names.signature_of(fem.Rotor)[0]
    shown = text_of(page(built, "api/reduction"))
    assert "modes: int = 2," in shown
    for path in (built / "api").glob("*.html"):
        assert not re.search(
            r"_NestedSequence|TypeAliasForwardRef|~\w+\.|<factory>", text_of(path.read_text("utf-8"))
        )


def test_formulas_are_mathml(built):
    theory = "".join(path.read_text(encoding="utf-8") for path in (built / "theory").glob("*.html"))
    assert theory.count("<math ") >= 20
    assert not re.search(r"<script[^>]*mathjax", theory, re.IGNORECASE)
    assert mathml.setup.__module__ == "mathml"


def test_the_builder_is_a_declared_dependency():
    import tomllib

    groups = tomllib.loads((ROOT / "pyproject.toml").read_text(encoding="utf-8"))["dependency-groups"]
    wanted = [re.match(r"[\w-]+", line)[0] for line in groups["docs"]]
    assert {"sphinx", "myst-parser", "numpydoc", "latex2mathml"} <= set(wanted)
    for name in wanted:
        assert metadata.version(name)
