"""`rotorid tolerance`: permissible residual unbalance by ISO 21940-11."""

from __future__ import annotations

from typing import Annotated

import typer

from rotorid.cli.common import JsonOption, OutputOption, PlotOption
from rotorid.cli.output import check_targets, chosen, deliver
from rotorid.workflows.tolerance import ToleranceOptions
from rotorid.workflows.tolerance import tolerance as work


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
    options = chosen(ToleranceOptions, locals())
    check_targets(plot, output)
    deliver("tolerance", lambda: work(options), as_json=json, plot=plot, output=output)
