"""`rotorid tolerance`: permissible residual unbalance by ISO 21940-11."""

from __future__ import annotations

from collections.abc import Mapping
from typing import TYPE_CHECKING, Annotated

import typer

from rotorid.cli.common import (
    JsonOption,
    OutputOption,
    PlotOption,
    emit,
)
from rotorid.cli.output import check_targets
from rotorid.workflows.parameters import one_speed

if TYPE_CHECKING:
    from matplotlib.figure import Figure

    from balancing.iso21940 import Tolerance
    from rotorid.tables.reader.units import Unit


def tolerance(
    mass: Annotated[str, typer.Option(metavar="MASS", help="Of the rotor, such as 500kg.")],
    speed: Annotated[str, typer.Option(metavar="SPEED", help="Highest service speed, such as 3000rpm.")],
    grade: Annotated[str, typer.Option(metavar="GRADE", help="Balance quality grade, G0.4 to G4000.")],
    planes: Annotated[
        str | None,
        typer.Option(
            metavar="LIST",
            help="One or two correction planes, with positions along the shaft or without: "
            "left=100mm,right=600mm.",
            show_default=False,
        ),
    ] = None,
    bearings: Annotated[
        str | None,
        typer.Option(
            metavar="A,B",
            help="Positions of both bearings, 0mm,700mm; default: the planes are the tolerance planes.",
            show_default=False,
        ),
    ] = None,
    centre: Annotated[
        str | None,
        typer.Option(metavar="POSITION", help="Of the centre of mass, such as 350mm.", show_default=False),
    ] = None,
    json: JsonOption = False,
    plot: PlotOption = None,
    output: OutputOption = None,
) -> None:
    """Permissible residual unbalance of a rigid rotor (ISO 21940-11), and the share of each plane.

    Positions count along the shaft from any point. Two planes without positions share it in equal parts.

    Example: rotorid tolerance --mass 500kg --speed 3000rpm --grade G2.5

    Example: rotorid tolerance --mass 500kg --speed 3000rpm --grade G2.5
    --planes left=100mm,right=600mm --bearings 0mm,700mm --centre 320mm --plot tolerance.png
    """
    from balancing.iso21940 import tolerance as permissible
    from rotorid.tables.reader import units

    check_targets(plot, output)
    ends = None if bearings is None else two_positions(bearings)
    found = permissible(
        quantity(mass, "--mass", units.MASS, "500kg"),
        speed_with_unit(speed, "--speed"),
        grade,
        planes=None if planes is None else plane_positions(planes),
        bearings=ends,
        centre=None if centre is None else quantity(centre, "--centre", units.LENGTH, "350mm"),
    )
    emit(
        found.to_dict(),
        found.summary,
        as_json=json,
        files=[],
        options={
            "mass": mass,
            "speed": speed,
            "grade": grade,
            "planes": planes,
            "bearings": bearings,
            "centre": centre,
        },
        figure=(plot, lambda: _figure(found)),
        table=(output, found.to_frame),
    )


def quantity(text: str, what: str, known: Mapping[str, Unit], example: str) -> float:
    """Read "500kg" or "500 kg" in SI.

    Raises
    ------
    ValueError
        For no number, no unit or another one; says which there are.
    """
    from rotorid.tables.reader.number import NotANumber, parse_number
    from rotorid.tables.reader.units import spelt

    body = text.strip()
    split = next((i for i in range(len(body), 0, -1) if body[i - 1] in "0123456789."), 0)
    number, unit = body[:split].strip(), known.get(spelt(body[split:].strip()))
    try:
        value = parse_number(number)
    except NotANumber:
        unit = None
    if unit is None:
        raise ValueError(
            f"{what} {text!r}: a number with its unit ({', '.join(known)}) is needed, such as {example}"
        )
    return unit.to_si(value)


def speed_with_unit(text: str, what: str) -> float:
    """Read "3000rpm" in rad/s.

    Raises
    ------
    ValueError
        Without a unit: a number alone would be taken for rad/s by one, and for rpm by the other.
    """
    if not any(letter.isalpha() for letter in text):
        raise ValueError(f"{what} {text!r}: a speed needs its unit here, such as 3000rpm, 50Hz or 314rad_s")
    return one_speed(text, what)


def plane_positions(text: str) -> dict[str, float | None]:
    """Read "left=100mm,right=600mm" in m; None where there is no position."""
    from rotorid.tables.reader.units import LENGTH

    found: dict[str, float | None] = {}
    for part in text.split(","):
        name, sign, place = (piece.strip() for piece in part.partition("="))
        if not name or (sign and not place):
            raise ValueError(
                f"--planes {text!r}: names with positions or without are needed, such as "
                "left=100mm,right=600mm"
            )
        if name in found:
            raise ValueError(f"--planes {text!r}: the plane {name!r} stands twice")
        found[name] = quantity(place, f"--planes {name}", LENGTH, "100mm") if sign else None
    return found


def two_positions(text: str) -> tuple[float, float]:
    """Read "0mm,700mm" in m."""
    from rotorid.tables.reader.units import LENGTH

    parts = text.split(",")
    if len(parts) != 2:
        raise ValueError(f"--bearings {text!r}: two positions are needed, such as 0mm,700mm")
    first, second = (quantity(part, "--bearings", LENGTH, "0mm,700mm") for part in parts)
    return first, second


def _figure(found: Tolerance) -> Figure:
    from balancing.plots.tolerances import polar_figure, tolerance_circles

    return polar_figure(lambda ax: tolerance_circles(found, ax))
