"""The page of every sheet: escaped, self-contained, and every number where the document has it."""

import json
import re
import xml.dom.minidom
from html.parser import HTMLParser

import jinja2
import pytest
from cases import each_of
from matplotlib.figure import Figure

from rotorid.report.document import Document, fixed, significant
from rotorid.report.page import inline_svg, json_inside, render_report

PROVENANCE = {
    "program": "rotorid",
    "version": "1.2.3",
    "date": "2026-01-02T03:04:05+00:00",
    "inputs": [{"file": "a&b.csv", "sha256": "0123456789abcdef" * 4}],
    "options": {"method": "least-squares", "max_mass": "5g", "split": True},
}
NAMESPACE = 'xmlns="http://www.w3.org/2000/svg"'


def page(document=None, warnings=(), title="A sheet"):
    return render_report(
        "base.html", document or {}, title=title, warnings=warnings, provenance=PROVENANCE
    ).decode()


def figure(word="amplitude"):
    drawn = Figure(figsize=(5, 3))
    ax = drawn.add_subplot()
    ax.plot([1, 2, 3], [4, 5, 6], "o-")
    ax.set_ylabel(word)
    ax.bar([1], [4], hatch="//")
    return drawn


class Scripts(HTMLParser):
    def __init__(self, text):
        super().__init__()
        self.inside, self.found, self.tags = False, [], []
        self.feed(text)

    def handle_starttag(self, tag, attrs):
        self.tags.append(tag)
        self.inside = tag == "script"

    def handle_endtag(self, tag):
        self.inside = False

    def handle_data(self, data):
        if self.inside:
            self.found.append(data)


def test_a_name_that_the_context_does_not_hold_is_an_error():
    with pytest.raises(jinja2.UndefinedError, match="sentences"):
        render_report("outcome.html", {}, title="x", warnings=[], provenance=PROVENANCE)


def test_text_is_escaped_and_the_document_cannot_end_its_element():
    text = "</script><b>&\u2028'\""
    document = {"name": text, "value": 1.5, "none": None}
    made = page(document, warnings=["left < right & <i>"], title="<Pump>")
    assert "<i>" not in made
    assert "left &lt; right &amp; &lt;i&gt;" in made
    assert "<title>&lt;Pump&gt;</title>" in made
    scripts = Scripts(made)
    assert scripts.tags.count("script") == 1
    assert "b" not in scripts.tags
    assert json.loads(scripts.found[0]) == {**document, "schema_version": 1, "provenance": PROVENANCE}


def test_numbers_that_are_not_finite_are_refused():
    with pytest.raises(ValueError, match="JSON compliant"):
        json_inside({"a": float("nan")})


def test_the_page_needs_nothing_else():
    made = page()
    assert made.startswith("<!doctype html>\n<html lang=")
    for wanted in ('<meta charset="utf-8">', 'name="viewport"', '<link rel="icon" href="data:,">', "@page"):
        assert wanted in made
    assert "http" not in made
    assert not re.search(r"\b(src|srcset|action|onload)=|@import|url\(", made)
    assert made.count("<style>") == 1


def test_a_figure_refers_to_nothing_outside_and_parses():
    made = str(inline_svg(figure(), 'size < 1 "x"'))
    root = xml.dom.minidom.parseString(made).documentElement
    assert root.getAttribute("aria-label") == 'size < 1 "x"'
    assert root.getAttribute("role") == "img"
    assert root.getAttribute("viewBox") == "0 0 360 216"
    assert made.count("http") == made.count(NAMESPACE) == 1
    assert "<style" not in made
    assert "<metadata" not in made
    assert "font-family" not in made


def test_ids_stay_unique_beside_other_figures_and_every_reference_has_its_target():
    made = "".join(str(inline_svg(figure(word), word)) for word in ("a", "b", "c"))
    ids = re.findall(r'\bid="([^"]*)"', made)
    used = re.findall(r'(?:href="#|url\(#)([^")]+)', made)
    assert len(ids) == len(set(ids)) > 3
    assert set(used) == set(ids)


@each_of(
    ("value", "digits", "text"),
    [
        (416.9288, 4, "416.9"),
        (0.048295, 3, "0.0483"),
        (9.999, 3, "10.0"),
        (-2.5, 2, "-2.5"),
        (0.0, 3, "0"),
        (23912.0, 3, "23900"),
        (1234567.0, 3, "1230000"),
        (12345678.0, 3, "1.23e+07"),
        (1.234e-4, 2, "0.00012"),
        (1.2e-6, 2, "1.2e-06"),
        (float("nan"), 3, "–"),
    ],
)
def test_significant_digits(value, digits, text):
    assert significant(value, digits) == text


def test_digits_after_the_point():
    assert fixed(359.96, 1, angle=True) == "0.0"
    assert fixed(359.96, 1) == "360.0"
    assert fixed(-0.001, 2) == "0.00"
    assert fixed(12.0, 0) == "12"
    assert fixed(float("inf"), 1) == "–"


def test_numbers_are_shown_with_the_path_at_which_the_document_has_them():
    show = Document({"rows": [{"mass": 416.9288, "angle": 359.99, "std": None, "ok": True}], "n": 20}).show
    assert show("rows.0.mass", digits=4) == '<span data-key="rows.0.mass">416.9</span>'
    assert show("rows.0.angle", decimals=1, unit="°") == '<span data-key="rows.0.angle">0.0°</span>'
    assert show("rows.0.mass", digits=2, unit="g") == '<span data-key="rows.0.mass">420\u202fg</span>'
    assert show("rows.0.std") == '<span data-key="rows.0.std">–</span>'
    assert show("n", digits=5, trim=True) == '<span data-key="n">20</span>'
    for missing in ("rows.1.mass", "rows.0.size", "rows.x", "n.0", "rows.0.ok", "rows"):
        with pytest.raises(KeyError, match="the document has no"):
            show(missing)
