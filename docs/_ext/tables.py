"""Tables of the program itself: `{keys}` of typed settings, `{methods}` of a registry."""

from __future__ import annotations

import typing
from collections.abc import Sequence
from pkgutil import resolve_name
from typing import TYPE_CHECKING, Any

from docutils import nodes
from pieces import table
from sphinx.util.docutils import SphinxDirective

from rotorid.base.text import sentence
from rotorid.files.settings import settings_schema

if TYPE_CHECKING:
    from sphinx.application import Sphinx


class Keys(SphinxDirective):
    """`{keys} MODULE.NAME [ENTRY]`: the keys of typed settings; the line below heads their column."""

    required_arguments = 1
    optional_arguments = 1
    has_content = True

    def run(self) -> list[nodes.Node]:
        """One row per key."""
        return [table((self.content[0], "meaning", "such as"), key_lines(settings_of(self.arguments)))]


class Methods(SphinxDirective):
    """`{methods} MODULE NAME`: the methods of a registry, each with its sentence, as `--help` has them."""

    required_arguments = 2

    def run(self) -> list[nodes.Node]:
        """One row per method."""
        methods = resolve_name(":".join(self.arguments))
        rows = [(f"`{method.name}`", sentence(method.about)) for method in methods]
        return [table(("name", "what it does"), rows)]


def settings_of(words: Sequence[str]) -> Any:  # noqa: ANN401  a model of pydantic
    """Typed settings by the name of their module and their own, or of a table of them and their kind."""
    value = resolve_name(words[0])
    return value[words[1]] if words[1:] else value


def key_lines(settings: Any) -> list[tuple[str, str, str]]:  # noqa: ANN401  a model of pydantic
    """Names of each key as a file writes them, what it means, and how its values are written."""
    schema = settings_schema(settings, "")["properties"]
    lines = []
    for name, field in settings.model_fields.items():
        key = settings.known_keys()[field.alias or name]
        kinds = (field.annotation, *typing.get_args(field.annotation))
        inner = any(hasattr(kind, "known_keys") for kind in kinds)
        origin = typing.get_origin(field.annotation)
        header = "[{}]" if inner or dict in kinds else "{}"
        if inner and origin is list:
            header = "[[{}]]"
        elif origin is dict:
            header = (
                "[{}.NAME]" if inner else "{}" if any(hasattr(m, "func") for m in field.metadata) else "[{}]"
            )
        names = ", ".join(f"`{header.format(one)}`" for one in key.names)
        choices = schema.get(field.alias or name, {})
        words = [
            f'"{word}"' for one in (choices, *choices.get("anyOf", ())) for word in one.get("enum", ())
        ] or (field.examples or [])
        lines.append((names, key.about, ", ".join(f"`{word}`" for word in words)))
    return lines


def setup(app: Sphinx) -> dict[str, Any]:
    """Register the directives."""
    app.add_directive("keys", Keys)
    app.add_directive("methods", Methods)
    return {"parallel_read_safe": True, "parallel_write_safe": True}
