"""`rotorid split`: one given weight on holes, at two free angles, or as material taken away."""

from __future__ import annotations

from typing import Annotated

import typer

from rotorid.cli.common import JsonOption, OutputOption, PlotOption
from rotorid.cli.output import check_targets, chosen, deliver
from rotorid.workflows.split import SplitOptions
from rotorid.workflows.split import split as work


def split(
    vector: Annotated[
        str,
        typer.Argument(
            metavar="VECTOR",
            help="Weight to be added and its angle in degrees, such as 35g@120 or 3500g_mm@120; several "
            "with + between them are added.",
            show_default=False,
        ),
    ],
    holes: Annotated[
        str | None,
        typer.Option(
            metavar="N|DEG,DEG,…",
            help="Number of equally spaced holes, or their angles, ascending.",
            show_default=False,
        ),
    ] = None,
    first_hole: Annotated[
        float | None,
        typer.Option(
            metavar="DEG", help="Angle of hole 1 of equally spaced ones; default: 0.", show_default=False
        ),
    ] = None,
    pieces: Annotated[
        str | None,
        typer.Option(
            metavar="10g,20g", help="Available pieces; without them amounts are free.", show_default=False
        ),
    ] = None,
    stock: Annotated[
        str | None,
        typer.Option(metavar="8,4", help="How many there are of each of the pieces.", show_default=False),
    ] = None,
    per_hole: Annotated[
        int | None,
        typer.Option(metavar="N", help="Pieces in one hole, at most; default: 1.", show_default=False),
    ] = None,
    most_pieces: Annotated[
        int | None, typer.Option(metavar="N", help="Pieces altogether, at most.", show_default=False)
    ] = None,
    good_enough: Annotated[
        float | None,
        typer.Option(metavar="PERCENT", help="Fewest pieces whose error is not larger.", show_default=False),
    ] = None,
    taken: Annotated[
        str | None,
        typer.Option(
            metavar="HOLE:WEIGHT,…",
            help="Holes in which something is mounted already, such as 3:10g,7:20g.",
            show_default=False,
        ),
    ] = None,
    max_mass: Annotated[
        str | None,
        typer.Option(
            metavar="WEIGHT", help="Largest weight of the plane, as a vector sum.", show_default=False
        ),
    ] = None,
    step: Annotated[
        str | None,
        typer.Option(
            metavar="0.5g",
            help="Smallest step of free amounts in holes, or of the scale for one weight.",
            show_default=False,
        ),
    ] = None,
    angle_step: Annotated[
        float | None,
        typer.Option(metavar="DEG", help="Step of the angle for one weight.", show_default=False),
    ] = None,
    mounted: Annotated[
        str | None,
        typer.Option(
            metavar="VECTOR",
            help="What is mounted already and counts towards VECTOR, such as 10g@30+20g@200 (trim).",
            show_default=False,
        ),
    ] = None,
    two: Annotated[
        str | None,
        typer.Option(
            metavar="20g,30g", help="Angles of two fixed weights instead of holes.", show_default=False
        ),
    ] = None,
    drill: Annotated[
        str | None,
        typer.Option(
            metavar="DIAMETER",
            help="Drill material away opposite to VECTOR instead, such as 8mm.",
            show_default=False,
        ),
    ] = None,
    grind: Annotated[bool, typer.Option("--grind", help="Grind it off opposite to VECTOR instead.")] = False,
    radius: Annotated[
        str | None,
        typer.Option(
            metavar="LENGTH",
            help="Where the masses stand; from where radial holes are drilled, or where axial ones are.",
            show_default=False,
        ),
    ] = None,
    axial: Annotated[
        bool, typer.Option("--axial/--radial", help="Drill along the rotor's axis or towards it.")
    ] = False,
    depth: Annotated[
        str | None,
        typer.Option(
            metavar="LENGTH", help="Largest depth of the full diameter, such as 20mm.", show_default=False
        ),
    ] = None,
    density: Annotated[
        float | None,
        typer.Option(metavar="KG/M3", help="Of the material drilled; default: 7850.", show_default=False),
    ] = None,
    tip_angle: Annotated[
        float | None,
        typer.Option(
            metavar="DEG", help="Of the drill; 180 for a flat one; default: 118.", show_default=False
        ),
    ] = None,
    spacing: Annotated[
        float | None,
        typer.Option(
            metavar="DEG",
            help="Between holes in a row, where one would be too deep; default: 1.5 diameters.",
            show_default=False,
        ),
    ] = None,
    angles: Annotated[
        str, typer.Option(metavar="WAY", help='"with rotation" or "against rotation", of all angles.')
    ] = SplitOptions.angles,
    json: JsonOption = False,
    plot: PlotOption = None,
    output: OutputOption = None,
) -> None:
    """Mount one given weight: in holes (exactly the nearest), at two angles, or by drilling or grinding.

    Examples: rotorid split 35g@120 --holes 24 --pieces 10g,20g --taken 3:10g

    rotorid split 35g@120 --two 20g,30g

    rotorid split 35g@120 --drill 8mm --depth 20mm --radius 100mm
    """
    options = chosen(SplitOptions, locals())
    check_targets(plot, output)
    deliver("split", lambda: work(vector, options), as_json=json, plot=plot, output=output)
