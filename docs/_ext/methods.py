"""`{methods} MODULE NAME`: the methods of a registry, each with its sentence, as `--help` has them."""

from __future__ import annotations

from importlib import import_module
from typing import TYPE_CHECKING, Any

from docutils import nodes
from pieces import table
from sphinx.util.docutils import SphinxDirective

from rotorid.base.text import sentence

if TYPE_CHECKING:
    from sphinx.application import Sphinx


class Methods(SphinxDirective):
    """A table of a registry."""

    required_arguments = 2

    def run(self) -> list[nodes.Node]:
        """One row per method."""
        module, name = self.arguments
        known = getattr(import_module(module), name)
        return [table(("name", "what it does"), [(f"`{each.name}`", sentence(each.about)) for each in known])]


def setup(app: Sphinx) -> dict[str, Any]:
    """Register the directive."""
    app.add_directive("methods", Methods)
    return {"parallel_read_safe": True, "parallel_write_safe": True}
