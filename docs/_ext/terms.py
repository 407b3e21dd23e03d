"""Links to the glossary: on every page the first use of each of its terms, without a mark in the text.

The pages stay plain text for who reads them without Sphinx, and no link can be forgotten or broken. Titles,
code, formulas and links are left alone. Write {term}`…` where the words differ from those of the glossary.
"""

from __future__ import annotations

import re
from typing import TYPE_CHECKING, Any

from docutils import nodes
from sphinx.util.nodes import make_refnode

if TYPE_CHECKING:
    from sphinx.application import Sphinx

GLOSSARY = "glossary"
LEFT_ALONE = (
    nodes.title,
    nodes.rubric,
    nodes.literal,
    nodes.literal_block,
    nodes.doctest_block,
    nodes.math,
    nodes.math_block,
    nodes.raw,
    nodes.reference,
    nodes.term,
)


def finder(terms: list[str]) -> re.Pattern[str]:
    """Finds any of the terms as whole words, the longest first, in the singular or the plural."""
    words = (r"\s+".join(map(re.escape, term.split())) for term in sorted(terms, key=len, reverse=True))
    return re.compile(rf"(?<![\w-])(?:{'|'.join(words)})(?:e?s)?(?![\w-])", re.IGNORECASE)


def link_terms(app: Sphinx, doctree: nodes.document, docname: str) -> None:
    """Link the first use of each term on a page."""
    known = {
        " ".join(name.lower().split()): (page, label)
        for (kind, name), (page, label) in app.env.get_domain("std").objects.items()  # type: ignore[attr-defined]
        if kind == "term"
    }
    if docname == GLOSSARY or not known:
        return
    found, linked = finder(list(known)), set(_linked(doctree))
    _join(doctree)
    for text in list(doctree.findall(nodes.Text)):
        if not _left_alone(text):
            _link(app, docname, text, found, known, linked)


def _join(doctree: nodes.document) -> None:
    """Make one text of texts that follow each other: a line that was broken in the source is two."""
    for node in list(doctree.findall(nodes.Element)):
        joined: list[nodes.Node] = []
        for child in node.children:
            if joined and isinstance(child, nodes.Text) and isinstance(joined[-1], nodes.Text):
                joined[-1] = nodes.Text(joined[-1].astext() + child.astext())
            else:
                joined.append(child)
        if len(joined) < len(node.children):
            node.children = []
            node.extend(joined)


def _linked(doctree: nodes.document) -> list[str]:
    """Labels of terms to which the page links by itself."""
    targets = (str(ref.get("refuri", "")).partition("#term-") for ref in doctree.findall(nodes.reference))
    return [f"term-{label}" for _, mark, label in targets if mark]


def _left_alone(text: nodes.Text) -> bool:
    node = text.parent
    while node is not None:
        if isinstance(node, LEFT_ALONE) or node.tagname.startswith("desc_sig") or node.tagname == "desc_name":
            return True
        node = node.parent
    return False


def _link(
    app: Sphinx,
    docname: str,
    text: nodes.Text,
    found: re.Pattern[str],
    known: dict[str, tuple[str, str]],
    linked: set[str],
) -> None:
    """Replace a text by its parts, of which some are links."""
    whole, parts, end = text.astext(), [], 0
    for match in found.finditer(whole):
        words = " ".join(match[0].lower().split())
        page, label = next(known[w] for w in (words, words[:-1], words[:-2]) if w in known)
        if label in linked:
            continue
        linked.add(label)
        inner = nodes.inline("", match[0], classes=["term"])
        reference = make_refnode(app.builder, docname, page, label, inner)
        reference["classes"].append("term")
        parts += [nodes.Text(whole[end : match.start()]), reference]
        end = match.end()
    if parts:
        parent = text.parent
        place = next(i for i, child in enumerate(parent.children) if child is text)
        parent[place : place + 1] = [*parts, nodes.Text(whole[end:])]


def setup(app: Sphinx) -> dict[str, Any]:
    """Link when all pages are read."""
    app.connect("doctree-resolved", link_terms)
    return {"parallel_read_safe": True, "parallel_write_safe": True}
