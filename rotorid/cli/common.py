"""What the commands share: options, output, provenance."""

from __future__ import annotations

import hashlib
import io
import json
import os
import sys
from collections.abc import Callable, Iterable, Mapping, Sequence
from datetime import UTC, datetime
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from rotorid.base.units import RPM, rpm_text

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

SLOWEST, FASTEST = 1e-9, 1e9
"""rad/s; no rotor turns so slowly or so fast, and squares of other numbers may overflow."""
PICTURES = (".png", ".svg", ".pdf")
TABLES = (".csv", ".xlsx")
STATE_SPACES = (".json", ".npz", ".mat")


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


def check_targets(
    plot: Path | None,
    output: Path | None,
    *more: Path | None,
    model: Path | None = None,
    state_space: Path | None = None,
    report: Path | None = None,
) -> None:
    """Refuse files that could not be written, before any work is done; `more` are tables, too."""
    targets = [(plot, PICTURES), (output, TABLES), *((path, TABLES) for path in more)]
    targets += [(model, (".toml",)), (state_space, STATE_SPACES), (report, (".html",))]
    asked: list[Path] = []
    for path, endings in targets:
        if path is None:
            continue
        if path.suffix.lower() not in endings:
            raise ValueError(
                f"{path}: cannot write this kind of file; the name must end in {', '.join(endings)}"
            )
        if not path.parent.is_dir():
            raise ValueError(f"{path}: the folder {path.parent} does not exist")
        if path.exists() and not path.is_file():
            what = "a folder" if path.is_dir() else "no regular file"
            raise ValueError(f"{path}: cannot be written, it is {what}")
        if not os.access(path if path.exists() else path.parent, os.W_OK):
            raise ValueError(f"{path}: cannot be written, permission denied")
        twin = next((other for other in asked if _same_file(path, other)), None)
        if twin is not None:
            raise ValueError(f"{path}: two results cannot go into one file; give each its own name")
        asked.append(path)


def check_inputs(targets: Iterable[Path], inputs: Iterable[Path]) -> None:
    """Refuse to write a result over a file that was read for it."""
    sources = list(inputs)
    for path in targets:
        if any(_same_file(path, source) for source in sources):
            raise ValueError(
                f"{path}: this is an input of the command, which must not be overwritten; choose another name"
            )


def _same_file(a: Path, b: Path) -> bool:
    if a.exists() and b.exists():
        return a.samefile(b)
    return os.path.realpath(a) == os.path.realpath(b)  # of a circle of links, too


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


def json_text(document: Mapping[str, Any]) -> str:
    """A document as JSON; in plain ASCII where standard output cannot write more."""
    plain = "utf" not in (getattr(sys.stdout, "encoding", None) or "utf-8").casefold()
    return json.dumps(document, ensure_ascii=plain, allow_nan=False, indent=1)


def figure_bytes(figure: Figure, path: Path) -> bytes:
    """A figure in the format that the name of its file asks for."""
    stream = io.BytesIO()
    figure.savefig(stream, dpi=150, format=path.suffix.lower().lstrip("."))
    return stream.getvalue()


def picture(draw: Callable[[Axes], object], width: float = 9.0, height: float = 5.0) -> Callable[[], Figure]:
    """Make a function that draws on a new figure, which needs no screen."""

    def build() -> Figure:
        from matplotlib.figure import Figure

        figure = Figure(figsize=(width, height), layout="constrained")
        draw(figure.add_subplot())
        return figure

    return build


def nodes(text: str, what: str) -> list[str | int]:
    """Read "7,12,impeller 3" as node numbers and names of stations."""
    parts = [part.strip() for part in text.split(",")]
    if not all(parts):
        raise ValueError(
            f"{what} takes nodes or names of stations with commas, such as 7,12,18; got {text!r}"
        )
    return [int(part) if part.isdecimal() else part for part in parts]


def sensors(text: str) -> list[str | int | tuple[str | int, float]]:
    """Read "2,22:45,probe DE:-30" as nodes with angles in degrees from x, with the rotation; 0 without."""
    found: list[str | int | tuple[str | int, float]] = []
    for part in text.split(","):
        head, colon, tail = part.partition(":")
        angle = _angle(tail) if colon else None
        (node,) = nodes(head, "--sensors")
        found.append(node if angle is None else (node, angle))
    return found


def _angle(text: str) -> float:
    """Degrees; names of stations hold no colon, so this can be nothing else."""
    try:
        angle = float(text)
    except ValueError:
        angle = float("nan")
    if not -360 <= angle <= 360:
        raise ValueError(f"--sensors: {text.strip()!r} is no angle from -360 to 360 degrees")
    return angle


def names(text: str | None) -> list[str] | None:
    """Read "A,B" as names; None stays None."""
    if text is None:
        return None
    found = [part.strip() for part in text.split(",")]
    if not all(found):
        raise ValueError(f"names with commas between them are needed, such as left,right; got {text!r}")
    return found


_SPEED_UNITS = {"rad_s": 1.0, "rad/s": 1.0, "rpm": 3.141592653589793 / 30.0, "Hz": 2.0 * 3.141592653589793}


def band(text: str | None) -> tuple[float, float] | None:
    """Read "9000:10500rpm" as the lowest and highest operating speed in rad/s; None stays None."""
    if text is None:
        return None
    body, factor = _unit(text)
    try:
        low, high = (float(part) for part in body.split(":"))
    except ValueError:
        low = high = -1.0
    if not 0 <= low < high <= FASTEST / factor:
        raise ValueError(
            f"--operating {text!r} is not a range: use LOWEST:HIGHEST, in rad/s, or with rpm or Hz at the end"
        )
    return low * factor, high * factor


def separation(criticals: Iterable[float], operating: tuple[float, float]) -> dict[str, Any]:
    """Which critical speeds, rad/s, lie in the operating range, and how far off the others are.

    The distance is in percent of the nearest end of the range (API 684).
    """
    low, high = operating
    rows = []
    for speed in criticals:
        below = 100 * (low - speed) / low if low > 0 else 0.0
        margin = 100 * (speed - high) / high if speed > high else max(0.0, below)
        rows.append(
            {"speed_rad_s": float(speed), "inside": low <= speed <= high, "separation_percent": float(margin)}
        )
    return {"range_rad_s": [low, high], "critical_speeds": rows}


def separation_text(operating: Mapping[str, Any]) -> str:
    """The result of `separation` for an engineer."""
    low, high = operating["range_rad_s"]
    lines = [f"operating range {low:.6g} to {high:.6g} rad/s ({low * RPM:.6g} to {rpm_text(high)})"]
    for row in operating["critical_speeds"]:
        where = "INSIDE" if row["inside"] else f"{row['separation_percent']:.1f} % away"
        lines.append(f"{row['speed_rad_s']:14.4f} rad/s {row['speed_rad_s'] * RPM:14.2f} rpm   {where}")
    if not operating["critical_speeds"]:
        lines.append("no critical speed was found")
    return "\n".join(lines)


def _unit(text: str) -> tuple[str, float]:
    """A text without the unit of speed at its end, and the unit in rad/s."""
    body = text.strip()
    for unit, scale in _SPEED_UNITS.items():
        if body.endswith(unit):
            return body[: -len(unit)].strip(), scale
    return body, 1.0


def speeds(text: str, unit: str = "rad_s", what: str = "--speeds") -> list[float]:
    """Read speeds, rad/s: "100:700:50" (first:last:step) or "100,200", "1000:6000:50rpm", "20Hz,1500rpm".

    A unit at the end holds for all; or each speed has its own. Without any it is `unit`. The last speed of a
    range is included where the steps meet it.
    """
    import numpy as np

    sign = ":" if ":" in text else ","
    parts = [_speed(part) for part in text.split(sign)]
    usual = unit.replace("rad_s", "rad/s")
    others = " or ".join(name for name in ("rad/s", "rpm", "Hz") if name != usual)
    example = f"use FIRST:LAST:STEP or a list with commas, in {usual}, or with {others} at the end"
    if any(part is None for part in parts) or (sign == ":" and len(parts) != 3):
        raise ValueError(f"{what} {text!r} is not a range: {example}")
    pairs = [part for part in parts if part is not None]
    own = [name for _, name in pairs]
    if any(own[:-1]) and not all(own):
        raise ValueError(f"{what} {text!r}: give the unit at every speed, or once at the end")
    if sign == ":" and len(set(own[:-1]) | {own[-1]} - {""}) > 1 and any(own[:-1]):
        raise ValueError(f"{what} {text!r}: a range has one unit")
    values = [value for value, _ in pairs]
    factors = [_SPEED_UNITS[name or own[-1] or unit] for name in own]
    if not np.isfinite(values).all():
        raise ValueError(f"{what} {text!r}: speeds must be finite and not negative")
    if sign == ":":
        first, last, step = values
        if step <= 0 or last < first:
            raise ValueError(
                f"{what} {text!r}: the step must be positive and the last speed not below the first"
            )
        if (last - first) / step > 1e6:
            raise ValueError(f"{what} {text!r} has more than a million speeds")
        values = list(first + step * np.arange(int(np.floor((last - first) / step * (1 + 1e-12) + 1e-9)) + 1))
        factors = [factors[0]] * len(values)
    found = [float(v) * factor for v, factor in zip(values, factors, strict=True)]
    if not all(value == 0 or SLOWEST <= value <= FASTEST for value in found):
        raise ValueError(f"{what} {text!r}: speeds must be 0 or from {SLOWEST:g} to {FASTEST:g} rad/s")
    return found


def rising_speeds(text: str, what: str = "--speeds") -> list[float]:
    """`speeds` in ascending order, each once."""
    return sorted(set(speeds(text, what=what)))


def one_speed(text: str, what: str) -> float:
    """Read "9000rpm" as one speed, rad/s."""
    values = speeds(text, what=what)
    if len(values) != 1:
        raise ValueError(f"{what} takes one speed, such as 9000rpm; got {text!r}")
    return values[0]


def _speed(text: str) -> tuple[float, str] | None:
    """A number and its unit (empty: none), or None."""
    body = text.strip()
    unit = next((name for name in _SPEED_UNITS if body.endswith(name)), "")
    try:
        return float(body.removesuffix(unit).strip()), unit
    except ValueError:
        return None
