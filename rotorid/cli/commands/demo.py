"""`rotorid demo`: the main job, or another, on sample data."""

from __future__ import annotations

import contextlib
import io
import os
import shlex
from collections.abc import Mapping
from pathlib import Path
from typing import Annotated, Any

import typer

from rotorid.base.suggestions import did_you_mean
from rotorid.cli.common import (
    JsonOption,
    provenance,
)
from rotorid.cli.demo_samples import SAMPLES, Sample
from rotorid.cli.output import json_text

COPIED = (".csv", ".toml", ".md", ".txt")


def demo(
    folder: Annotated[Path, typer.Argument(metavar="[DIR]", help="Where to write the sample job.")] = Path(
        "rotorid-demo"
    ),
    sample: Annotated[str, typer.Option(metavar="NAME", help=f"One of {', '.join(SAMPLES)}.")] = "main",
    show: Annotated[bool, typer.Option("--list", help="What the samples are; nothing is written.")] = False,
    json: JsonOption = False,
) -> None:
    """Write a sample to DIR, run its commands on it, and say where the pictures are.

    Example: rotorid demo demo

    Example: rotorid demo demo --sample holes
    """
    if show:
        _list(as_json=json)
        return
    if sample not in SAMPLES:
        raise ValueError(
            f"there is no sample {sample!r}{did_you_mean(sample, SAMPLES)}: one of {', '.join(SAMPLES)}"
        )
    chosen = SAMPLES[sample]
    copies = _copy(folder, chosen)
    pictures = [folder / name for name in chosen.pictures]
    if json:
        document = {
            "folder": str(folder),
            "sample": sample,
            "pictures": [str(path) for path in pictures],
            "commands": [shlex.join(command) for command in _commands(folder, chosen)],
            **_documents(folder, chosen),
            "provenance": provenance(copies, {"folder": folder, "sample": sample}),
        }
        typer.echo(json_text(document))
        return
    for number, (step, command) in enumerate(
        zip(chosen.steps, _commands(folder, chosen), strict=True), start=1
    ):
        typer.echo(f"{number}. {step.title}\n$ {shlex.join(command)}\n")
        _run(command)
        typer.echo("")
    typer.echo("Pictures:\n" + "\n".join(f"  {path}" for path in pictures))


def _list(*, as_json: bool) -> None:
    """The samples, one line each."""
    if as_json:
        about = [{"name": name, "about": sample.about} for name, sample in SAMPLES.items()]
        typer.echo(json_text({"samples": about, "provenance": provenance([], {"list": True})}))
        return
    width = max(map(len, SAMPLES))
    for name, sample in SAMPLES.items():
        typer.echo(f"{name:{width}}  {sample.about}")


def _commands(folder: Path, sample: Sample) -> list[list[str]]:
    """The commands as typed, `rotorid` first."""
    return [
        ["rotorid", *(part.replace("{}", str(folder), 1) for part in step.arguments)] for step in sample.steps
    ]


def _run(command: list[str]) -> None:
    """One command, as if typed."""
    from rotorid.cli import app

    app(command[1:], prog_name=command[0], standalone_mode=False)


def _documents(folder: Path, sample: Sample) -> dict[str, Any]:
    """The results of all commands, without what the demo states itself."""
    import json

    found: dict[str, Any] = {}
    for step, command in zip(sample.steps, _commands(folder, sample), strict=True):
        with contextlib.redirect_stdout(io.StringIO()) as text:
            _run([*command, "--json"])
        found[step.key] = {k: v for k, v in json.loads(text.getvalue()).items() if k != "provenance"}
    return found


def _copy(folder: Path, sample: Sample) -> list[Path]:
    """Write the files of a sample; refuse before anything is written."""
    from rotorid.samples import sample_data
    from rotorid.tables.reader.writing import write_files

    samples = sample_data()
    sources: list[Path] = []
    for name in sample.sources:
        place = samples / name
        inside = [f for f in sorted(place.iterdir()) if f.suffix in COPIED] if place.is_dir() else [place]
        sources += inside
    copies = {folder / f.relative_to(samples): f.read_bytes() for f in sources}
    _check_folder(folder, samples, copies, sample)
    for path in copies:
        path.parent.mkdir(parents=True, exist_ok=True)
    write_files({path: data for path, data in copies.items() if not path.exists()})
    return list(copies)


def _check_folder(folder: Path, samples: Path, copies: Mapping[Path, bytes], sample: Sample) -> None:
    """Refuse a folder whose files the demo would overwrite."""
    remedy = "choose another folder: rotorid demo DIR"
    if folder.exists() and not folder.is_dir():
        raise ValueError(f"{folder}: this is a file; {remedy}")
    inside = Path(os.path.realpath(folder))
    if samples.resolve() in (inside, *inside.parents) or any(
        os.path.realpath(folder / name) == os.path.realpath(samples / name) for name in sample.sources
    ):
        raise ValueError(f"{folder}: these are the sample data themselves; {remedy}")
    own = all(path.exists() for path in copies)  # a demo of this sample ran here before
    pictures = [] if own else [str(folder / p) for p in sample.pictures if (folder / p).exists()]
    if pictures:
        raise ValueError(f"{', '.join(pictures)}: would be overwritten; delete it, or {remedy}")
    changed = [str(p) for p, data in copies.items() if p.exists() and (p.is_dir() or p.read_bytes() != data)]
    if changed:
        raise ValueError(
            f"{', '.join(changed)}: differs from the sample and would be overwritten; delete it, or {remedy}"
        )
