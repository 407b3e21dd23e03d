"""Formulas as MathML, written while the pages are built: browsers show them without a script or a network."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from docutils import nodes
from latex2mathml.converter import convert

if TYPE_CHECKING:
    from sphinx.application import Sphinx
    from sphinx.writers.html5 import HTML5Translator


def inline(self: HTML5Translator, node: nodes.math) -> None:
    """A formula within a line."""
    self.body.append(f'<span class="math">{convert(node.astext())}</span>')
    raise nodes.SkipNode


def block(self: HTML5Translator, node: nodes.math_block) -> None:
    """A formula by itself, with its number if it has one."""
    self.body.append(self.starttag(node, "div", CLASS="math"))
    self.body.append(convert(_text(node), display="block"))
    self.body.append("</div>\n")
    raise nodes.SkipNode


def _text(node: nodes.math_block) -> str:
    """Lines of a formula that is broken by a double backslash without saying so are aligned."""
    text = node.astext().strip()
    if r"\\" in text and r"\begin" not in text:
        return rf"\begin{{align*}}{text}\end{{align*}}"
    return text


def setup(app: Sphinx) -> dict[str, Any]:
    """Register the renderer."""
    app.add_html_math_renderer("mathml", (inline, None), (block, None))
    return {"parallel_read_safe": True, "parallel_write_safe": True}
