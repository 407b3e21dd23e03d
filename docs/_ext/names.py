"""`.. names:: PACKAGE NAME NAME …`: the listed public names, each with what its docstring says.

Docstrings are plain text for readers of the code: of reStructuredText they use backquotes, doctests and
literal blocks only. What else would be markup, such as the bars of |Im λ|, is taken literally.
"""

from __future__ import annotations

import inspect
import re
from importlib import import_module
from typing import TYPE_CHECKING, Any

from docutils import nodes
from docutils.statemachine import StringList
from sphinx.util.docutils import SphinxDirective

if TYPE_CHECKING:
    from sphinx.application import Sphinx


class Names(SphinxDirective):
    """Documents public names of one package by autodoc, whatever kind each is."""

    required_arguments = 1
    final_argument_whitespace = True

    def run(self) -> list[nodes.Node]:
        """The nodes of all names, in the order in which they are listed."""
        package, *listed = self.arguments[0].split()
        module = import_module(package)
        lines = [line for name in listed for line in entry(package, module, name)]
        holder = nodes.container()
        self.state.nested_parse(StringList(lines, f"names of {package}"), 0, holder)
        return holder.children


def entry(package: str, module: object, name: str) -> list[str]:
    """The lines of reStructuredText for one public name; refused if the package does not offer it."""
    if name not in getattr(module, "__all__", dir(module)):
        raise ValueError(f"{package} has no public name {name}")
    value = getattr(module, name)
    if inspect.isclass(value):
        return [f".. autoclass:: {package}.{name}", "   :members:", ""]
    if callable(value):
        return [f".. autofunction:: {package}.{name}", ""]
    shown = [f"   :value: {value!r}"] if isinstance(value, (int, float, str)) else []
    return [f".. py:data:: {package}.{name}", *shown, ""]


def plain(lines: list[str]) -> list[str]:
    """Lines of a docstring in which bars, stars and underscores at the ends of words are no markup.

    Code stays as it is: what stands in backquotes, doctests with their output, blocks below `::`.
    """
    out: list[str] = []
    doctest = False
    literal: int | None = None
    for line in lines:
        indent = len(line) - len(line.lstrip())
        if literal is not None and line.strip() and indent <= literal:
            literal = None
        doctest = bool(line.strip()) and (doctest or line.lstrip().startswith(">>>"))
        out.append(line if doctest or literal is not None else _escaped(line))
        if literal is None and line.rstrip().endswith("::"):
            literal = indent
    return out


def _escaped(line: str) -> str:
    out = ""
    for i, part in enumerate(re.split(r"(``.+?``|`[^`]+`)", line)):
        after_code = i % 2 == 0 and i > 0 and part[:1].isalnum()
        markup = part if i % 2 else re.sub(r"[|*]|(?<=\w)_(?!\w)", r"\\\g<0>", part)
        out += ("\\ " if after_code else "") + markup
    return out


def _take_literally(*event: Any) -> None:  # noqa: ANN401 - what autodoc hands over
    event[-1][:] = plain(event[-1])


def setup(app: Sphinx) -> dict[str, Any]:
    """Register the directive, and the reading of docstrings before numpydoc."""
    app.add_directive("names", Names)
    app.connect("autodoc-process-docstring", _take_literally, priority=100)
    return {"parallel_read_safe": True, "parallel_write_safe": True}
