"""Parameters of commands: the options of a workflow, told by its dataclass, and where the result goes."""

from __future__ import annotations

import ast
import dataclasses
import functools
import inspect
import sys
import textwrap
from collections.abc import Callable, Iterator, Mapping, Sequence
from pathlib import Path
from typing import Annotated, Any, Literal, get_origin, get_type_hints

import typer
from typer.models import OptionInfo

from rotorid.cli.output import Destination

Command = Callable[..., None]
USUAL = ("plot", "output", "table", "json")
WITH_REPORT = ("report", *USUAL)
EQUATIONS = ("show", "latex")
INPUT, OUTPUT = "Input", "Output"
RotorArgument = Annotated[
    Path,
    typer.Argument(metavar="ROTOR", help="Rotor table (.csv, .xlsx) or rotor file (.toml)."),
]
_TYPES: dict[str, Any] = {"bool": bool, "int": int, "float": float, "Path": Path, "Amplitudes": list[str]}
"""What is typed, by the first alternative of an annotation; else one of a few words, or any text."""


def command(
    options: type | None = None,
    *,
    names: Mapping[str, Sequence[str]] | None = None,
    least: Mapping[str, float] | None = None,
    panels: Mapping[str, str] | None = None,
    to: Sequence[str] = USUAL,
) -> Callable[[Command], Command]:
    """Replace the parameters `options` and `to` of a command by one for each field of these dataclasses.

    Their help and their metavar are the documentation of the dataclass, field by field, their names and
    defaults those of the fields.

    Parameters
    ----------
    options
        The dataclass of the workflow's options; None for a command without.
    names
        What is typed instead of `--field`.
    least
        The least value of a number.
    panels
        Of the help, in their order: title, and the options in it, the common ones first. Options that are
        not named stand in `INPUT`, before these, or in `OUTPUT` (those of `to`).
    to
        Which fields of `Destination` the command has.
    """
    own = [] if options is None else [*_parameters(options, names or {}, least or {})]
    where = [one for one in _parameters(Destination, {}, {}) if one.name in to]

    def decorate(function: Command) -> Command:
        hints = get_type_hints(function, include_extras=True)
        told: list[inspect.Parameter] = []
        for name, parameter in inspect.signature(function).parameters.items():
            expanded = {"options": own, "to": where}.get(name)
            told += [parameter.replace(annotation=hints[name])] if expanded is None else expanded

        @functools.wraps(function)
        def wrapper(**given: Any) -> None:  # noqa: ANN401 - what typer has read
            if options is not None:
                given["options"] = _taken(options, given)
            given["to"] = _taken(Destination, given)
            function(**given)

        wrapper.__doc__ = written_help(function)
        only = inspect.Parameter.KEYWORD_ONLY
        told = _in_panels([parameter.replace(kind=only) for parameter in told], panels or {}, to)
        wrapper.__signature__ = inspect.Signature(told)  # type: ignore[attr-defined]
        wrapper.__annotations__ = {parameter.name: parameter.annotation for parameter in told}
        return wrapper

    return decorate


def _in_panels(
    told: Sequence[inspect.Parameter], panels: Mapping[str, str], to: Sequence[str]
) -> list[inspect.Parameter]:
    """Arguments, then options, panel by panel."""
    titles = {**panels, OUTPUT: " ".join((*to, panels.get(OUTPUT, "")))}
    panel_of = {name: title for title, names in titles.items() for name in names.split()}
    order = list(panel_of)
    for parameter in told:
        declared = parameter.annotation.__metadata__[0]
        if isinstance(declared, OptionInfo):
            declared.rich_help_panel = panel_of.get(parameter.name, INPUT)
    return sorted(told, key=lambda one: order.index(one.name) if one.name in panel_of else -1)


def _taken(kind: type, given: dict[str, Any]) -> Any:  # noqa: ANN401 - of that kind
    """The dataclass made of its fields among what typer has read; lists as tuples."""
    found = {}
    for field in dataclasses.fields(kind):
        value = given.pop(field.name, None)
        found[field.name] = (
            field.default if value is None else tuple(value) if isinstance(value, list) else value
        )
    return kind(**found)


def _parameters(
    kind: type, names: Mapping[str, Sequence[str]], least: Mapping[str, float]
) -> Iterator[inspect.Parameter]:
    """One option for each field of a dataclass."""
    about = _documentation(kind)
    choices = getattr(sys.modules[kind.__module__], "choices", None)
    for field in dataclasses.fields(kind):
        name, metavar, text = field.name, *about[field.name]
        found = _type(kind, str(field.type))
        flag = [f"--{name.replace('_', '-')}"] if found is bool else []  # without its --no-…
        option = typer.Option(*names.get(name, flag), metavar=metavar, help=text, min=least.get(name))
        default = None if field.default == () else field.default
        if field.default is dataclasses.MISSING:
            default = inspect.Parameter.empty
        typed = found if default is not None else found | None
        annotation: Any = Annotated[typed, option, choices]
        yield inspect.Parameter(name, inspect.Parameter.KEYWORD_ONLY, default=default, annotation=annotation)


def _type(kind: type, annotation: str) -> Any:  # noqa: ANN401 - a type, for typer
    first = annotation.partition(" | ")[0]
    if first in _TYPES:
        return _TYPES[first]
    known = getattr(sys.modules[kind.__module__], first, str)
    return known if get_origin(known) is Literal else str


def written_help(of: Any) -> str:  # noqa: ANN401 - a function or a class
    """The docstring, which is the help; `python -OO` drops it, the file has it still."""
    if sys.flags.optimize < 2:
        return of.__doc__ or ""
    (definition,) = ast.parse(textwrap.dedent(inspect.getsource(of))).body
    assert isinstance(definition, ast.FunctionDef | ast.ClassDef)
    return ast.get_docstring(definition) or ""


def _documentation(kind: type) -> dict[str, tuple[str | None, str]]:
    """Metavar and text of each attribute, from lines `name : METAVAR` and the indented ones below."""
    found: dict[str, tuple[str | None, str]] = {}
    name = ""
    for line in inspect.cleandoc(written_help(kind)).partition("----------\n")[2].splitlines():
        if line.startswith(" "):
            metavar, text = found[name]
            found[name] = metavar, f"{text} {line.strip()}".strip()
        elif line:
            name, _, metavar = line.partition(" : ")
            found[name] = metavar or None, ""
    return found
