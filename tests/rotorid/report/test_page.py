"""The page of every sheet: escaped, self-contained, and every number where the document has it."""

import json
import re
import xml.dom.minidom
from html.parser import HTMLParser

import jinja2
import pytest
from matplotlib.figure import Figure

from rotorid.report.page import inline_svg, render_report

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
