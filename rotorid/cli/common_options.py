"""Common options: those that several commands have, each declared once."""

from __future__ import annotations

import inspect
from collections.abc import Callable
from pathlib import Path
from typing import Annotated

import typer


def options_of(kind: type) -> Callable[..., object]:
    """Make the options of a command: their help is the documentation of its dataclass, field by field.

    What is given back takes the name of a field, its metavar, names in place of its own, and the least value.
    """
    texts: dict[str, str] = {}
    names: list[str] = []
    for line in (inspect.getdoc(kind) or "").partition("----------\n")[2].splitlines():
        if line.startswith(" "):
            texts |= {name: f"{texts.get(name, '')} {line.strip()}".strip() for name in names}
        elif line:
            names = line.split(", ")

    def option(field: str, metavar: str | None = None, *names: str, least: float | None = None) -> object:
        return typer.Option(*names, metavar=metavar, help=texts[field], min=least)

    return option


JsonOption = Annotated[
    bool, typer.Option("--json", help="One JSON document on standard output, nothing else.")
]
PlotOption = Annotated[
    Path | None,
    typer.Option("--plot", metavar="FILE", help="Picture, .png, .svg or .pdf."),
]
OutputOption = Annotated[Path | None, typer.Option("--output", metavar="FILE", help="Table, .csv or .xlsx.")]
ReportOption = Annotated[
    Path | None,
    typer.Option("--report", metavar="FILE", help="Sheet to print or to send, .html, one file."),
]
RotorArgument = Annotated[
    Path,
    typer.Argument(metavar="ROTOR", help="Rotor table (.csv, .xlsx) or rotor file (.toml)."),
]
PhaseOption = Annotated[str | None, typer.Option(metavar="lead|lag", help="What a positive phase means.")]
AnglesOption = Annotated[
    str | None,
    typer.Option(
        metavar="DIRECTION",
        help="How angles count: with rotation, against rotation, or clockwise and counter-clockwise "
        "where the job states its rotation.",
    ),
]
AmplitudeErrorOption = Annotated[
    float | None,
    typer.Option(metavar="PERCENT", min=0.0, help="Standard deviation of a reading's amplitude."),
]
PhaseErrorOption = Annotated[
    float | None,
    typer.Option(metavar="DEGREES", min=0.0, help="Standard deviation of a reading's phase."),
]
RunErrorOption = Annotated[
    float | None,
    typer.Option(
        metavar="PERCENT",
        min=0.0,
        help="Standard deviation of what changes from run to run, percent of a reading.",
    ),
]
