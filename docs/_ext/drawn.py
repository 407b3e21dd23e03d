"""Figures made while the pages are built, inside the page itself.

`{drawn} NAME` is what a command of `docs/figures.py` draws, `{gallery} GROUP` all of a group with their
commands and sentences; `{drawing} NAME …` is what `docs/drawings.py` draws.
"""

from __future__ import annotations

import base64
import html
from typing import TYPE_CHECKING, Any

from docutils import nodes
from sphinx.util.docutils import SphinxDirective

if TYPE_CHECKING:
    from sphinx.application import Sphinx

PIXELS = 108
"""An inch of a picture on the screen: letters of 9 pt are as large as those of the page, in every picture."""


class Drawn(SphinxDirective):
    """A figure; the text below the directive says what is to be seen."""

    required_arguments = 1
    has_content = True

    def run(self) -> list[nodes.Node]:
        """The picture with its caption."""
        from figures import FIGURES

        name = self.arguments[0]
        if name not in FIGURES:
            raise self.error(f"docs/figures.py draws no {name!r}, only {', '.join(FIGURES)}")
        if not self.content:
            raise self.error("a figure needs a text that says what is to be seen")
        return [figure(name, " ".join(self.content))]


class Gallery(SphinxDirective):
    """Pictures of one group: command, picture, and the sentence that it lets one read."""

    required_arguments = 1

    def run(self) -> list[nodes.Node]:
        """All of them."""
        from figures import GALLERY

        group = [one for one in GALLERY if one.group == self.arguments[0]]
        if not group:
            raise self.error(f"docs/figures.py has no pictures of {self.arguments[0]!r}")
        out: list[nodes.Node] = []
        for one in group:
            line = "$ " + one.typed.replace("\n", "\n$ ")
            out += [nodes.literal_block(line, line, language="console"), figure(one.name, one.read)]
        return out


def figure(name: str, caption: str) -> nodes.raw:
    """A picture inside the page, as wide as its letters ask for, with its caption."""
    from figures import FIGURES, picture, width

    drawn, said = picture(name), html.escape(caption, quote=True)
    media = {"svg": "image/svg+xml", "png": "image/png"}[FIGURES[name].kind]
    address = f"data:{media};base64,{base64.b64encode(drawn).decode('ascii')}"
    text = (
        f'<figure class="drawn" id="figure-{nodes.make_id(name)}">'
        f'<img alt="{said}" width="{PIXELS * width(drawn):.0f}" src="{address}">'
        f"<figcaption>{said}</figcaption></figure>"
    )
    return nodes.raw(text, text, format="html")


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
    """Register the directives."""
    app.add_directive("drawn", Drawn)
    app.add_directive("gallery", Gallery)
    app.add_directive("drawing", Drawing)
    return {"parallel_read_safe": True, "parallel_write_safe": True}
