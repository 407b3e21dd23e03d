"""Pieces of a page that several directives make: texts with code, tables, sections."""

from __future__ import annotations

import re
from collections.abc import Sequence

from docutils import nodes


def words(text: str) -> list[nodes.Node]:
    """A text in which single or double backquotes mark code."""
    out: list[nodes.Node] = []
    for i, part in enumerate(re.split(r"``?([^`]+)``?", text)):
        if part:
            out.append(nodes.literal(part, part) if i % 2 else nodes.Text(part))
    return out


def paragraph(text: str) -> nodes.paragraph:
    """One paragraph of such a text."""
    return nodes.paragraph("", "", *words(text))


def section(title: str, name: str, *children: nodes.Node) -> nodes.section:
    """A section with a title and a name that links can use."""
    return nodes.section("", nodes.title(title, title), *children, ids=[nodes.make_id(name)], names=[name])


def table(head: Sequence[str], rows: Sequence[Sequence[str]]) -> nodes.table:
    """A table of such texts, with one line of headings."""
    group = nodes.tgroup("", *(nodes.colspec(colwidth=1) for _ in head), cols=len(head))
    group += nodes.thead("", _line(head))
    group += nodes.tbody("", *(_line(row) for row in rows))
    return nodes.table("", group, classes=["colwidths-auto"])


def _line(cells: Sequence[str]) -> nodes.row:
    return nodes.row("", *(nodes.entry("", paragraph(cell)) for cell in cells))
