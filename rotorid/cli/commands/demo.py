"""`rotorid demo`: the main job, or another, on sample data."""

from __future__ import annotations

import contextlib
import io
from pathlib import Path
from typing import Annotated, Any

import typer

from rotorid.cli.common_options import command
from rotorid.cli.output import Destination, json_text
from rotorid.workflows.demo import DemoOptions, samples
from rotorid.workflows.demo import demo as work
from rotorid.workflows.demo_samples import SAMPLES


@command(to=("json",))
def demo(
    folder: Annotated[Path, typer.Argument(metavar="DIR", help="Where to write the sample job.")] = Path(
        "rotorid-demo"
    ),
    sample: Annotated[
        str, typer.Option(metavar="NAME", help=f"One of {', '.join(SAMPLES)}.")
    ] = DemoOptions.sample,
    show: Annotated[bool, typer.Option("--list", help="What the samples are; nothing is written.")] = False,
    *,
    to: Destination,
) -> None:
    """Write a sample to DIR, run its commands on it, and say where the pictures are.

    Example: rotorid demo demo

    Example: rotorid demo demo --sample holes
    """
    if show:
        to.deliver("samples", samples)
        return
    made = work(folder, DemoOptions(sample))
    if to.json:
        typer.echo(json_text(made.run(_document).document))
        return
    for heading, words in made.told():
        typer.echo(heading)
        _run(words)
        typer.echo("")
    typer.echo(made.summary())


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
