"""`rotorid demo`: the files of the main job in a folder, and its commands run on them."""

from __future__ import annotations

import contextlib
import io
import os
import shlex
from pathlib import Path
from typing import Annotated

import typer

_COPIED = (".csv", ".toml", ".md", ".txt")
STEPS = (
    "critical {}/rotor23.csv --plot {}/modes.png",
    "balance {}/turbo_job/job.toml --plot {}/balance.png",
    "reduce {}/rotor23.csv --nodes 7,12,18 --modes 2 --plot {}/reduction.png",
)
"""What is typed after `rotorid`, where {} is the folder."""


def demo(
    folder: Annotated[Path, typer.Argument(metavar="DIR", help="Where to write the sample job.")] = Path(
        "rotorid-demo"
    ),
) -> None:
    """Write a sample job to DIR, run the main commands on it, and say where the pictures are.

    Example: rotorid demo demo
    """
    from rotorid.cli import application

    commands = [[word.replace("{}", str(folder)) for word in line.split()] for line in STEPS]
    pictures = [words[-1] for words in commands]
    _copy(folder, [Path(picture) for picture in pictures])
    for number, words in enumerate(commands, start=1):
        with contextlib.redirect_stdout(io.StringIO()) as text:
            application(words)(words, prog_name="rotorid", standalone_mode=False)
        typer.echo(
            "\n".join([f"{number}. {shlex.join(['rotorid', *words])}", *text.getvalue().splitlines()[:6]])
        )
    typer.echo(f"Pictures: {', '.join(pictures)}\nAll that a command says: type it.")


def _copy(folder: Path, pictures: list[Path]) -> None:
    """Write the files of the job; what would be overwritten is refused before anything is written."""
    from rotorid.files.disk import write_files
    from rotorid.samples import sample_data

    samples, remedy = sample_data(), "choose another folder: rotorid demo DIR"
    sources = [samples / "rotor23.csv", *sorted((samples / "turbo_job").iterdir())]
    copies = {folder / f.relative_to(samples): f.read_bytes() for f in sources if f.suffix in _COPIED}
    if folder.exists() and not folder.is_dir():
        raise ValueError(f"{folder}: this is a file; {remedy}")
    if any(Path(os.path.realpath(path)).is_relative_to(samples.resolve()) for path in copies):
        raise ValueError(f"{folder}: these are the sample data themselves; {remedy}")
    theirs = [p for p, data in copies.items() if p.exists() and not (p.is_file() and p.read_bytes() == data)]
    ran = all(path.exists() for path in copies)
    theirs += [] if ran else [picture for picture in pictures if picture.exists()]
    if theirs:
        raise ValueError(f"{theirs[0]}: differs from the sample and would be overwritten; {remedy}")
    for path in copies:
        path.parent.mkdir(parents=True, exist_ok=True)
    write_files({path: data for path, data in copies.items() if not path.exists()})
