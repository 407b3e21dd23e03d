"""`{picture} COMMAND`: what `rotorid COMMAND --plot` draws while the pages are built, in the page itself."""

from __future__ import annotations

import base64
import contextlib
import html
import io
import os
import shlex
import tempfile
import warnings
from pathlib import Path
from typing import TYPE_CHECKING, Any
from unittest import mock

from docutils import nodes
from sphinx.util.docutils import SphinxDirective

if TYPE_CHECKING:
    from sphinx.application import Sphinx

SAMPLES = Path(__file__).parents[2] / "sample_data"


class Picture(SphinxDirective):
    """A figure; the text below the directive says what is to be seen."""

    required_arguments = 1
    final_argument_whitespace = True
    has_content = True

    def run(self) -> list[nodes.Node]:
        """The picture with its caption."""
        if not self.content:
            raise self.error("a figure needs a text that says what is to be seen")
        caption = html.escape(" ".join(self.content), quote=True)
        address = "data:image/svg+xml;base64," + base64.b64encode(drawn_by(self.arguments[0])).decode("ascii")
        text = (
            f'<figure class="drawn"><img alt="{caption}" src="{address}"><figcaption>{caption}</figcaption>'
        )
        return [nodes.raw("", text + "</figure>", format="html")]


def drawn_by(command: str) -> bytes:
    """The picture of a command as SVG, made in a folder that holds the sample data."""
    import matplotlib

    from rotorid.cli import application

    with (
        mock.patch.dict(os.environ, {"SOURCE_DATE_EPOCH": "0"}),
        tempfile.TemporaryDirectory() as folder,
        contextlib.chdir(folder),
        contextlib.redirect_stdout(io.StringIO()),
        contextlib.redirect_stderr(io.StringIO()),
        matplotlib.rc_context({"svg.hashsalt": command}),
        warnings.catch_warnings(),
    ):
        warnings.simplefilter("ignore")
        os.symlink(SAMPLES, "sample_data")
        words = [*shlex.split(command), "--plot", "picture.svg"]
        application(words)(words, standalone_mode=False)
        return Path("picture.svg").read_bytes()


def setup(app: Sphinx) -> dict[str, Any]:
    """Register the directive."""
    app.add_directive("picture", Picture)
    return {"parallel_read_safe": True, "parallel_write_safe": True}
