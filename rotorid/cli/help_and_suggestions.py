"""Help of commands, with the choices of the registries; a suggestion for a misspelt choice."""

from __future__ import annotations

import inspect
import os
import re
from functools import partial
from pathlib import Path
from types import NoneType
from typing import Any, get_args, get_type_hints

import typer
from typer.core import TyperCommand, TyperGroup

from rotorid.base.choices import suggest

_CHOICE = re.compile(r"(?:Value error, )?('([^']*)' is not one of (.+?))\.?", re.DOTALL)


class Commands(TyperGroup):
    """All commands; a file in place of one is no option, even if its name begins with -."""

    def resolve_command(self, ctx: Any, args: list[str]) -> Any:  # noqa: ANN401 - as typer declares it
        """As typer's."""
        if args[0].startswith("-") and self.get_command(ctx, args[0]) is None:
            ctx.fail(f"No such command {args[0]!r}: the command stands first, rotorid balance -- {args[0]}")
        return super().resolve_command(ctx, args)

    def parse_args(self, ctx: Any, args: list[str]) -> list[str]:  # noqa: ANN401 - as typer declares it
        """As typer's, without pydantic where that is not needed."""
        _spare_pydantic(self, ctx)
        return super().parse_args(ctx, args)


class Command(TyperCommand):
    """A command whose help tells what its options choose from."""

    def format_help(self, ctx: Any, formatter: Any) -> None:  # noqa: ANN401 - as typer declares it
        """As typer's, with the methods of the registries, and compact."""
        tell_choices(self)
        _compact(self, ctx)
        super().format_help(ctx, formatter)

    def parse_args(self, ctx: Any, args: list[str]) -> list[str]:  # noqa: ANN401 - as typer declares it
        """As typer's, with the nearest choice in a complaint."""
        _spare_pydantic(self, ctx)
        try:
            return super().parse_args(ctx, args)
        except typer.BadParameter as problem:
            problem.message = nearest_choice(problem.message)
            raise


def _spare_pydantic(command: Any, ctx: Any) -> None:  # noqa: ANN401 - typer has no public type for it
    """Leave to typer's checks only what needs one: they load pydantic, which takes long."""
    hints = get_type_hints(command.callback)
    for parameter in command.get_params(ctx):
        hint = hints.get(parameter.name, NoneType)
        parameter.process_value = partial(_taken, parameter.process_value, get_args(hint) or [hint])


def _taken(check: Any, kinds: Any, ctx: Any, value: Any) -> Any:  # noqa: ANN401 - as typer declares it
    """A value that is of one of these kinds, or names a file that can be read; else by typer's check."""
    if isinstance(value, str) and Path in kinds and os.access(value, os.R_OK):
        return Path(value)
    return value if type(value) in kinds else check(ctx, value)


def tell_choices(command: Any) -> None:  # noqa: ANN401 - typer has no public type for it
    """Put the methods behind the help of each option that chooses one: Annotated[…, Option(…), choices].

    `choices` is a function of the command's module: registries by the names of the options.
    """
    hints = get_type_hints(command.callback, include_extras=True)
    for parameter in command.params:
        declared: tuple[Any, ...] = getattr(hints.get(parameter.name), "__metadata__", ())
        choices = declared[1]() if declared[1:] and declared[1] else {}
        if parameter.name in choices:
            methods = "; ".join(f"{each.name}: {each.about}" for each in choices[parameter.name])
            parameter.help = f"{declared[0].help} {methods}."


def whole_paragraphs(text: str) -> str:
    """Each paragraph of a docstring on one line."""
    return "\n\n".join(" ".join(each.split()) for each in inspect.cleandoc(text).split("\n\n"))


def _compact(command: Any, ctx: Any) -> None:  # noqa: ANN401 - typer has no public type for it
    """Whole paragraphs, and without what the words say as well: `<bool>`, `<list[Path]>`, ranges."""
    command.help = whole_paragraphs(command.help or "").partition("Parameters ---")[0]
    for parameter in command.get_params(ctx):
        if parameter.name == "help":
            parameter.rich_help_panel = "Output"
        parameter._get_number_range_help_str = lambda: ""  # a refusal tells it
        if parameter.param_type_name == "argument" or parameter.is_flag:
            parameter.display_type_rich = lambda ctx: ""


def nearest_choice(message: str) -> str:
    """A complaint about a value that is none of a few, with the nearest one; others as they are."""
    match = _CHOICE.fullmatch(message)
    if match is None:
        return message
    near = suggest(match[2], re.findall(r"'([^']*)'", match[3]))
    return f"{match[1]}." + (f" Did you mean {near!r}?" if near else "")
