"""What the commands share: options, output, provenance."""

from __future__ import annotations

import hashlib
import json
import os
import tempfile
from collections.abc import Callable, Mapping, Sequence
from datetime import UTC, datetime
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

if TYPE_CHECKING:
    import pandas as pd
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

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
RotorArgument = Annotated[
    Path,
    typer.Argument(
        metavar="ROTOR", help="Rotor table (.csv, .xlsx) or rotor file (.toml).", show_default=False
    ),
]

PICTURES = (".png", ".svg", ".pdf")
TABLES = (".csv", ".xlsx")


def provenance(files: Sequence[Path], options: Mapping[str, object]) -> dict[str, Any]:
    """Program version, input files with their hashes, date and options of a result."""
    from rotorid import __version__

    return {
        "program": "rotorid",
        "version": __version__,
        "date": datetime.now(UTC).isoformat(timespec="seconds"),
        "inputs": [{"file": str(f), "sha256": hashlib.sha256(f.read_bytes()).hexdigest()} for f in files],
        "options": {
            k: str(v) if isinstance(v, Path) else v for k, v in options.items() if v not in (None, False)
        },
    }


def check_targets(plot: Path | None, output: Path | None) -> None:
    """Refuse a file that could not be written, before any work is done."""
    for path, endings in ((plot, PICTURES), (output, TABLES)):
        if path is None:
            continue
        if path.suffix.lower() not in endings:
            raise ValueError(
                f"{path}: cannot write this kind of file; the name must end in {', '.join(endings)}"
            )
        if not path.parent.is_dir():
            raise ValueError(f"{path}: the folder {path.parent} does not exist")


def emit(
    document: Mapping[str, Any],
    text: Callable[[], str],
    *,
    as_json: bool,
    files: Sequence[Path],
    options: Mapping[str, object],
    figure: tuple[Path | None, Callable[[], Figure]] | None = None,
    table: tuple[Path | None, Callable[[], pd.DataFrame]] | None = None,
) -> None:
    """Print a result as text or JSON, with its picture and table, each file written whole or not at all."""
    record = provenance(files, options)
    if figure and figure[0]:
        save_figure(figure[1](), figure[0])
    if table and table[0]:
        from rotorid.tables import write_table

        write_table(table[0], table[1]())
    if as_json:
        typer.echo(
            json.dumps({**document, "provenance": record}, ensure_ascii=False, allow_nan=False, indent=1)
        )
        return
    typer.echo(text())
    for target in (figure, table):
        if target and target[0]:
            typer.echo(f"written: {target[0]}")


def save_figure(figure: Figure, path: Path) -> None:
    """Write a figure, whole or not at all."""
    handle, name = tempfile.mkstemp(dir=path.parent, suffix=path.suffix)
    os.close(handle)
    try:
        figure.savefig(name, dpi=150)
        Path(name).chmod(0o644)
        Path(name).replace(path)
    finally:
        Path(name).unlink(missing_ok=True)


def picture(draw: Callable[[Axes], object], width: float = 9.0, height: float = 5.0) -> Callable[[], Figure]:
    """Make a function that draws on a new figure, which needs no screen."""

    def build() -> Figure:
        from matplotlib.figure import Figure

        figure = Figure(figsize=(width, height), layout="constrained")
        draw(figure.add_subplot())
        return figure

    return build


def numbers(text: str, what: str) -> list[int]:
    """Read "7,12,18" as node numbers."""
    try:
        return [int(part) for part in text.split(",")]
    except ValueError:
        raise ValueError(f"{what} takes node numbers with commas, such as 7,12,18; got {text!r}") from None


def names(text: str | None) -> list[str] | None:
    """Read "A,B" as names; None stays None."""
    return None if text is None else [part.strip() for part in text.split(",") if part.strip()]


_SPEED_UNITS = {"rad_s": 1.0, "rpm": 3.141592653589793 / 30.0, "Hz": 2.0 * 3.141592653589793}


def speeds(text: str) -> list[float]:
    """Read speeds: "100:700:50" (first:last:step) or "100,200", rad/s, or with a unit, "1000:6000:50rpm".

    The last speed of a range is included where the steps meet it.
    """
    import numpy as np

    body, factor = text.strip(), 1.0
    for unit, scale in _SPEED_UNITS.items():
        if body.endswith(unit):
            body, factor = body[: -len(unit)].strip(), scale
    example = (
        "use FIRST:LAST:STEP or a list with commas, in rad/s, or with rpm or Hz at the end (1000:6000:50rpm)"
    )
    try:
        values = [float(v) for v in body.split(":")] if ":" in body else [float(v) for v in body.split(",")]
    except ValueError:
        raise ValueError(f"--speeds {text!r} is not a range: {example}") from None
    if ":" in body:
        if len(values) != 3 or not np.isfinite(values).all():
            raise ValueError(f"--speeds {text!r} is not a range: {example}")
        first, last, step = values
        if step <= 0 or last < first:
            raise ValueError(
                f"--speeds {text!r}: the step must be positive and the last speed not below the first"
            )
        if (last - first) / step > 1e6:
            raise ValueError(f"--speeds {text!r} has more than a million speeds")
        values = list(first + step * np.arange(int(np.floor((last - first) / step * (1 + 1e-12) + 1e-9)) + 1))
    if not np.isfinite(values).all() or min(values) < 0:
        raise ValueError(f"--speeds {text!r}: speeds must be finite and not negative")
    return [float(v) * factor for v in values]
