"""`{commands}`: every command with all its arguments and options, as the program itself has them."""

from __future__ import annotations

import inspect
import re
from typing import TYPE_CHECKING, Any, get_args, get_type_hints

from docutils import nodes
from pieces import paragraph, section, words
from sphinx.util.docutils import SphinxDirective

if TYPE_CHECKING:
    from collections.abc import Iterator

    from sphinx.application import Sphinx

EXAMPLE = re.compile(r"(?:Examples?: )?(?=rotorid )")


class Commands(SphinxDirective):
    """One section per command."""

    def run(self) -> list[nodes.Node]:
        """The sections, in the order of `rotorid --help`."""
        sections = [describe(name, command) for name, command in all_commands()]
        for part in sections:
            self.state.document.note_explicit_target(part)  # a label, #rotorid-balance
        return list(sections)


def all_commands() -> Iterator[tuple[str, Any]]:
    """Names and commands; a command has `params`, each with `opts`, `help`, `default` and more."""
    from typer.main import get_command

    from rotorid.cli import application
    from rotorid.cli.help_and_suggestions import tell_choices

    group: Any = get_command(application())
    for name, command in group.commands.items():
        parts = getattr(command, "commands", {})  # of `rotorid fleet`
        for typed, one in ({f"{name} {part}": own for part, own in parts.items()} or {name: command}).items():
            tell_choices(one)
            yield typed, one


def describe(name: str, command: Any) -> nodes.section:  # noqa: ANN401 - typer has no public type for it
    """What a command does, its examples, and every argument and option."""
    out = section(f"rotorid {name}", f"rotorid-{name.replace(' ', '-')}")
    arguments = [p for p in command.params if p.param_type_name == "argument"]
    options = [p for p in command.params if p.param_type_name == "option"]
    usage = " ".join(["rotorid", name, *(_usage(p) for p in arguments), "[OPTIONS]"])
    out += _code(usage)
    said, examples = split_help(inspect.cleandoc(command.help or ""))
    out += [paragraph(text) for text in said]
    if examples:
        out += _code("\n".join(f"$ {example}" for example in examples))
    hints = get_type_hints(command.callback)
    panels: dict[str, list[Any]] = {"Arguments": arguments} if arguments else {}
    for option in options:
        panels.setdefault(option.rich_help_panel, []).append(option)
    for title, params in panels.items():
        out += nodes.rubric("", title)
        out += nodes.definition_list("", *(_item(p, hints.get(p.name)) for p in params))
    return out


def split_help(text: str) -> tuple[list[str], list[str]]:
    """Paragraphs of a help text, and the commands of its examples."""
    parts = [" ".join(part.split()) for part in text.split("\n\n") if part.strip()]
    examples = [EXAMPLE.sub("", part, count=1) for part in parts if EXAMPLE.match(part)]
    return [part for part in parts if not EXAMPLE.match(part)], examples


def _usage(param: Any) -> str:  # noqa: ANN401
    name = param.metavar or param.name.upper()
    return name if param.required or name.startswith("[") else f"[{name}]"


def _item(param: Any, hint: object) -> nodes.definition_list_item:  # noqa: ANN401
    value = "" if getattr(param, "is_flag", False) else param.metavar or _values(hint)
    names = [param.metavar or param.name.upper()]
    if param.param_type_name == "option":
        names = [f"{name} {value}".strip() for name in (*param.opts, *param.secondary_opts)]
    term = nodes.term()
    for i, name in enumerate(names):
        term += [nodes.Text(", ")] * bool(i) + [nodes.literal(name, name)]
    text = param.help or ""
    if param.required:
        text += " Required."
    elif param.default is not None and param.default is not False and param.show_default is not False:
        text += f" Default: `{param.default}`."
    if param.multiple:
        text += " May be given several times."
    return nodes.definition_list_item("", term, nodes.definition("", nodes.paragraph("", "", *words(text))))


def _values(hint: object) -> str:
    """What an option takes, from its annotation: the choices, or the kind of value."""
    kinds = [kind for kind in (get_args(hint) or (hint,)) if kind is not type(None)]
    if kinds and all(isinstance(kind, str) for kind in kinds):
        return "|".join(kinds)
    first = kinds[0] if kinds else str
    if get_args(first) and all(isinstance(choice, str) for choice in get_args(first)):
        return "|".join(get_args(first))
    return {int: "N", float: "NUMBER"}.get(first, "TEXT") if isinstance(first, type) else "TEXT"


def _code(text: str) -> nodes.literal_block:
    return nodes.literal_block(text, text, language="console" if text.startswith("$") else "text")


def setup(app: Sphinx) -> dict[str, Any]:
    """Register the directive."""
    app.add_directive("commands", Commands)
    return {"parallel_read_safe": True, "parallel_write_safe": True}
