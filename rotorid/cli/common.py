"""What the commands share: options, output, provenance."""

from __future__ import annotations

import dataclasses
import hashlib
import inspect
from collections.abc import Callable, Mapping, Sequence
from datetime import UTC, datetime
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from rotorid.cli.output import check_inputs, figure_bytes, json_text

if TYPE_CHECKING:
    import pandas as pd
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure


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
    defaults = {field.name: field.default for field in dataclasses.fields(kind)}

    def option(field: str, metavar: str | None = None, *names: str, least: float | None = None) -> object:
        shown = defaults[field] is not None
        return typer.Option(*names, metavar=metavar, help=texts.get(field), show_default=shown, min=least)

    return option


JsonOption = Annotated[
    bool, typer.Option("--json", help="One JSON document on standard output, nothing else.")
]
PlotOption = Annotated[
    Path | None,
    typer.Option("--plot", metavar="FILE", help="Picture, .png, .svg or .pdf.", show_default=False),
]
OutputOption = Annotated[
    Path | None, typer.Option("--output", metavar="FILE", help="Table, .csv or .xlsx.", show_default=False)
]
ReportOption = Annotated[
    Path | None,
    typer.Option(
        "--report", metavar="FILE", help="Sheet to print or to send, .html, one file.", show_default=False
    ),
]
RotorArgument = Annotated[
    Path,
    typer.Argument(
        metavar="ROTOR", help="Rotor table (.csv, .xlsx) or rotor file (.toml).", show_default=False
    ),
]
OperatingOption = Annotated[
    str | None,
    typer.Option(metavar="A:B", help="Operating speeds, such as 5300:6500rpm.", show_default=False),
]

PhaseOption = Annotated[
    str | None, typer.Option(metavar="lead|lag", help="What a positive phase means.", show_default=False)
]
AnglesOption = Annotated[
    str | None,
    typer.Option(
        metavar="DIRECTION",
        help="How angles count: with rotation, against rotation, or clockwise and counter-clockwise "
        "where the job states its rotation.",
        show_default=False,
    ),
]
AmplitudeErrorOption = Annotated[
    float | None,
    typer.Option(
        metavar="PERCENT", min=0.0, help="Standard deviation of a reading's amplitude.", show_default=False
    ),
]
PhaseErrorOption = Annotated[
    float | None,
    typer.Option(
        metavar="DEGREES", min=0.0, help="Standard deviation of a reading's phase.", show_default=False
    ),
]
RunErrorOption = Annotated[
    float | None,
    typer.Option(
        metavar="PERCENT",
        min=0.0,
        help="Standard deviation of what changes from run to run, percent of a reading.",
        show_default=False,
    ),
]


def provenance(files: Sequence[Path], options: Mapping[str, object]) -> dict[str, Any]:
    """Program version, input files with their hashes, date and options of a result."""
    from rotorid import __version__
    from rotorid.tables.reader.input_file import file_content

    return {
        "program": "rotorid",
        "version": __version__,
        "date": datetime.now(UTC).isoformat(timespec="seconds"),
        "inputs": [{"file": str(f), "sha256": hashlib.sha256(file_content(f)).hexdigest()} for f in files],
        "options": {
            k: str(v) if isinstance(v, Path) else v
            for k, v in options.items()
            if v is not None and v is not False
        },
    }


def emit(
    document: Mapping[str, Any],
    text: Callable[[], str],
    *,
    as_json: bool,
    files: Sequence[Path],
    options: Mapping[str, object],
    figure: tuple[Path | None, Callable[[], Figure]] | None = None,
    table: tuple[Path | None, Callable[[], pd.DataFrame]] | None = None,
    more: Sequence[tuple[Path | None, Callable[[], bytes]]] = (),
    report: tuple[Path | None, Callable[[dict[str, Any], dict[str, Any]], bytes]] | None = None,
) -> None:
    """Print a result as text or JSON; write its picture, table, sheet and `more`, all of them or none.

    The sheet is made from the document and the provenance.
    """
    from rotorid.cli.verbose import note
    from rotorid.tables.reader.problems import printable
    from rotorid.tables.reader.writing import table_bytes, write_files

    note(document)
    check_inputs([t[0] for t in (figure, table, *more, report) if t and t[0]], files)
    record = provenance(files, options)
    written: dict[Path, bytes] = {}
    if figure and figure[0]:
        written[figure[0]] = figure_bytes(figure[1](), figure[0])
    if table and table[0]:
        written[table[0]] = table_bytes(table[0], table[1]())
    written |= {path: build() for path, build in more if path is not None}
    if report and report[0]:
        written[report[0]] = report[1](dict(document), record)
    write_files(written)
    if as_json:
        typer.echo(json_text({**document, "provenance": record}))
        return
    typer.echo(text())
    for path in written:
        typer.echo(f"written: {printable(str(path))}")


def picture(draw: Callable[[Axes], object], width: float = 9.0, height: float = 5.0) -> Callable[[], Figure]:
    """Make a function that draws on a new figure, which needs no screen."""

    def build() -> Figure:
        from matplotlib.figure import Figure

        figure = Figure(figsize=(width, height), layout="constrained")
        draw(figure.add_subplot())
        return figure

    return build
