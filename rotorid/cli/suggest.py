"""Wrong usage explained with the nearest known name, and no colours where none are wanted."""

from __future__ import annotations

import os
import re
from collections.abc import Iterable, Iterator
from contextlib import contextmanager
from typing import Any, Literal, cast

import typer
from typer.core import TyperGroup

from rotorid.base.suggestions import suggest

# The class of all complaints about usage; where it lives depends on the version of typer.
UsageError = cast("type[Exception]", typer.BadParameter.__base__)
_CHOICE = re.compile(r"'([^']*)' is not one of (.+?)\.?$", re.DOTALL)


def dumb() -> bool:
    """Whether the terminal says that it knows no escape codes, so that nothing can move on it."""
    return os.environ.get("TERM", "").lower() in ("dumb", "unknown")


def plain() -> bool:
    """Whether colours and frames are unwanted: NO_COLOR is set, or the terminal is a dumb one."""
    return bool(os.environ.get("NO_COLOR")) or dumb()


def markup_mode() -> Literal["rich"] | None:
    """How typer prints help and complaints: with rich, or as plain text without any escape code."""
    return None if plain() else "rich"


class NearestGroup(TyperGroup):
    """Commands whose complaints about usage name what was probably meant."""

    def make_context(self, *args: Any, **kwargs: Any) -> Any:  # noqa: ANN401 - as typer declares it
        """As typer's, with better complaints about the program's own options."""
        with _improved():
            return super().make_context(*args, **kwargs)

    def resolve_command(self, ctx: Any, args: list[str]) -> Any:  # noqa: ANN401 - as typer declares it
        """As typer's, with the one nearest command."""
        try:
            return super().resolve_command(ctx, args)
        except UsageError as problem:
            if args and not args[0].startswith("-"):
                _say(problem, unknown("command", args[0], self.commands))
            raise

    def invoke(self, ctx: Any) -> Any:  # noqa: ANN401 - as typer declares it
        """As typer's, with better complaints about options of a command and their values."""
        with _improved():
            return super().invoke(ctx)


def unknown(kind: str, name: str, known: Iterable[str]) -> str:
    """`No such command 'balence'. Did you mean 'balance'?`; the question only where something is near."""
    near = suggest(name, known)
    return f"No such {kind} {name!r}." + (f" Did you mean {near!r}?" if near else "")


@contextmanager
def _improved() -> Iterator[None]:
    """Complaints about unknown options and choices get the nearest known one."""
    try:
        yield
    except UsageError as problem:
        option = getattr(problem, "option_name", None)
        context = getattr(problem, "ctx", None)
        if isinstance(option, str) and context is not None and hasattr(problem, "possibilities"):
            _say(problem, unknown("option", option, _options(context)))
        else:
            _say(problem, choice(str(getattr(problem, "message", ""))))
        raise


def _options(context: Any) -> list[str]:  # noqa: ANN401 - typer's or click's, which depends on the version
    """All options of the command in hand, `-h` and `--help` with them."""
    command = context.command
    return [
        name
        for parameter in command.get_params(context)
        if parameter.param_type_name == "option"
        for name in (*parameter.opts, *parameter.secondary_opts)
    ]


def choice(message: str) -> str:
    """A complaint about a value that is none of a few, with the nearest one; other messages as they are."""
    found = _CHOICE.search(message)
    if found is None:
        return message
    near = suggest(found[1], re.findall(r"'([^']*)'", found[2]))
    text = message.replace("Value error, ", "").rstrip(".") + "."
    return text + (f" Did you mean {near!r}?" if near else "")


def _say(problem: Exception, message: str) -> None:
    """Give a complaint another text; what click would append to it is in the text already."""
    vars(problem)["message"] = message
    if "possibilities" in vars(problem):
        vars(problem)["possibilities"] = None
