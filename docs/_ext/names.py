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
    from collections.abc import Callable

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


def _take_literally(
    app: Sphinx, what: str, name: str, obj: object, options: object, lines: list[str]
) -> None:
    lines[:] = plain(lines)


def signature_of(value: Callable[..., object]) -> tuple[str, str]:
    """Parameters and return type as the source writes them; defaults that are no plain values as `...`."""
    found = inspect.signature(value)
    params = []
    for param in found.parameters.values():
        if param.name in ("self", "cls"):
            continue
        known = isinstance(param.default, (type(None), bool, int, float, str, tuple))
        default = param.default if known or param.default is param.empty else ...
        params.append(param.replace(annotation=_Written.of(param.annotation), default=_Default.of(default)))
    text = str(found.replace(parameters=params, return_annotation=found.empty))
    returned = "" if inspect.isclass(value) else str(_Written.of(found.return_annotation) or "")
    return text, returned


class _Written(str):
    """An annotation that prints as it is written."""

    __slots__ = ()

    __repr__ = str.__str__

    @classmethod
    def of(cls, annotation: object) -> object:
        if annotation is inspect.Parameter.empty:
            return annotation
        if isinstance(annotation, str):
            return cls(annotation.strip("'\""))
        return cls(getattr(annotation, "__name__", None) or str(annotation).replace("typing.", ""))


class _Default:
    """A default that prints as source; None, numbers, texts, tuples of these, or `...`."""

    def __init__(self, value: object) -> None:
        self.value = value

    def __repr__(self) -> str:
        return "..." if self.value is ... else repr(self.value)

    @classmethod
    def of(cls, value: object) -> object:
        return value if value is inspect.Parameter.empty else cls(value)


def _signature(
    app: Sphinx, what: str, name: str, obj: object, options: object, signature: str, returned: str
) -> tuple[str, str] | None:
    if what not in ("function", "method", "class", "exception") or not callable(obj):
        return None
    if inspect.isclass(obj) and issubclass(obj, BaseException) and "__init__" not in vars(obj):
        return None  # made with a message
    return signature_of(obj)


def setup(app: Sphinx) -> dict[str, Any]:
    """Register the directive, and the reading of docstrings before numpydoc."""
    app.add_directive("names", Names)
    app.connect("autodoc-process-docstring", _take_literally, priority=100)
    app.connect("autodoc-process-signature", _signature)
    return {"parallel_read_safe": True, "parallel_write_safe": True}
