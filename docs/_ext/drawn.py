"""Figures made while the pages are built, inside the page itself.

`{drawn} NAME` is what a command of `docs/figures.py` draws, `{drawing} NAME …` what `docs/drawings.py` draws.
"""

from __future__ import annotations

import base64
import html
from typing import TYPE_CHECKING, Any

from docutils import nodes
from sphinx.util.docutils import SphinxDirective

if TYPE_CHECKING:
    from sphinx.application import Sphinx


class Drawn(SphinxDirective):
    """A figure; the text below the directive says what is to be seen."""

    required_arguments = 1
    has_content = True

    def run(self) -> list[nodes.Node]:
        """The picture with its caption."""
        from figures import FIGURES, kind, picture

        name = self.arguments[0]
        if name not in FIGURES:
            raise self.error(f"docs/figures.py draws no {name!r}, only {', '.join(FIGURES)}")
        caption = html.escape(" ".join(self.content), quote=True)
        if not caption:
            raise self.error("a figure needs a text that says what is to be seen")
        media = {"svg": "image/svg+xml", "png": "image/png"}[kind(name)]
        address = f"data:{media};base64,{base64.b64encode(picture(name)).decode('ascii')}"
        text = (
            f'<figure class="drawn" id="figure-{nodes.make_id(name)}"><img alt="{caption}" src="{address}">'
            f"<figcaption>{caption}</figcaption></figure>"
        )
        return [nodes.raw(text, text, format="html")]


class Drawing(SphinxDirective):
    """One drawing, or several side by side, in their own size; the text below says what is to be seen."""

    required_arguments = 1
    final_argument_whitespace = True
    has_content = True

    def run(self) -> list[nodes.Node]:
        """The drawings with their caption."""
        from drawings import DRAWINGS, svg

        names = self.arguments[0].split()
        unknown = [name for name in names if name not in DRAWINGS]
        caption = html.escape(" ".join(self.content), quote=True)
        if unknown or not caption:
            raise self.error(f"docs/drawings.py draws {', '.join(DRAWINGS)}, and each needs a text")
        coded = (base64.b64encode(svg(name)).decode("ascii") for name in names)
        images = "".join(f'<img alt="{caption}" src="data:image/svg+xml;base64,{each}">' for each in coded)
        text = f'<figure class="drawing">{images}<figcaption>{caption}</figcaption></figure>'
        return [nodes.raw(text, text, format="html")]


def setup(app: Sphinx) -> dict[str, Any]:
    """Register both directives."""
    app.add_directive("drawn", Drawn)
    app.add_directive("drawing", Drawing)
    return {"parallel_read_safe": True, "parallel_write_safe": True}
