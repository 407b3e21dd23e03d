"""`rotorid demo`: the main job, or another, on sample data."""

from __future__ import annotations

import contextlib
import io
from pathlib import Path
from typing import Annotated, Any

import typer

from rotorid.base.answer import LINES
from rotorid.commands.app import Destination, command, json_text
from rotorid.commands.demo import DemoOptions, samples
from rotorid.commands.demo import demo as work
from rotorid.commands.demo_samples import SAMPLES


@command(to=("table", "json"))
def demo(
    folder: Annotated[Path, typer.Argument(metavar="DIR", help="Where to write the sample job.")] = Path(
        "rotorid-demo"
    ),
    sample: Annotated[
        str, typer.Option(metavar="NAME", help=f"One of {', '.join(SAMPLES)}.")
    ] = DemoOptions.sample,
    listed: Annotated[bool, typer.Option("--list", help="What the samples are; nothing is written.")] = False,
    *,
    to: Destination,
) -> None:
    """Write a sample to DIR, run its commands on it, and say where the pictures are.

    Example: rotorid demo demo

    Example: rotorid demo demo --sample holes
    """
    if listed:
        to.deliver("samples", samples)
        return
    made = work(folder, DemoOptions(sample))
    if to.json:
        typer.echo(json_text(made.run(_document).document))
        return
    room, left = LINES - 2, len(made.commands)
    for heading, words in made.told():
        typer.echo(heading)
        with contextlib.redirect_stdout(io.StringIO()) as text:
            _run(words)
        lines = heading.count("\n") + 1
        told = text.getvalue()
        said = ["", told] if to.table else _beginning(told, max(room // left - lines, 2))
        typer.echo("\n".join(said))
        room, left = room - lines - len(said), left - 1
    typer.echo(made.answer.whole())
    if not to.table:
        typer.echo("All that a command says: type it; that all of them say: add --table.")


def _beginning(text: str, room: int) -> list[str]:
    """As many whole paragraphs as there is room for, of the first as many lines."""
    said: list[str] = []
    for part in text.split("\n\n"):
        lines = part.splitlines()
        if said and len(said) + len(lines) > room:
            break
        said += lines[:room]
    return said


def _run(command: list[str]) -> None:
    """One command, as if typed."""
    from rotorid.cli import app

    app(command[1:], prog_name=command[0], standalone_mode=False)


def _document(command: list[str]) -> dict[str, Any]:
    """What a command prints with `--json`."""
    import json

    with contextlib.redirect_stdout(io.StringIO()) as text:
        _run([*command, "--json"])
    found: dict[str, Any] = json.loads(text.getvalue())
    return found
