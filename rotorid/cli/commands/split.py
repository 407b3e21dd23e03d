"""`rotorid split`: one given weight on holes, at two free angles, or as material taken away."""

from __future__ import annotations

from typing import Annotated

import typer

from rotorid.cli.common import JsonOption, OutputOption, PlotOption, options_of
from rotorid.cli.output import check_targets, chosen, deliver
from rotorid.workflows.split import SplitOptions
from rotorid.workflows.split import split as work

say = options_of(SplitOptions)


def split(
    vector: Annotated[
        str,
        typer.Argument(
            metavar="VECTOR",
            help="Weight to be added and its angle in degrees, such as 35g@120 or 3500g_mm@120; several "
            "with + between them are added.",
        ),
    ],
    holes: Annotated[str | None, say("holes", "N|DEG,DEG,…")] = None,
    first_hole: Annotated[float | None, say("first_hole", "DEG")] = None,
    pieces: Annotated[str | None, say("pieces", "10g,20g")] = None,
    stock: Annotated[str | None, say("stock", "8,4")] = None,
    per_hole: Annotated[int | None, say("per_hole", "N")] = None,
    most_pieces: Annotated[int | None, say("most_pieces", "N")] = None,
    good_enough: Annotated[float | None, say("good_enough", "PERCENT")] = None,
    taken: Annotated[str | None, say("taken", "HOLE:WEIGHT,…")] = None,
    max_mass: Annotated[str | None, say("max_mass", "WEIGHT")] = None,
    step: Annotated[str | None, say("step", "0.5g")] = None,
    angle_step: Annotated[float | None, say("angle_step", "DEG")] = None,
    mounted: Annotated[str | None, say("mounted", "VECTOR")] = None,
    two: Annotated[str | None, say("two", "20g,30g")] = None,
    drill: Annotated[str | None, say("drill", "DIAMETER")] = None,
    grind: Annotated[bool, say("grind", None, "--grind")] = False,
    radius: Annotated[str | None, say("radius", "LENGTH")] = None,
    axial: Annotated[bool, say("axial", None, "--axial/--radial")] = False,
    depth: Annotated[str | None, say("depth", "LENGTH")] = None,
    density: Annotated[float | None, say("density", "KG/M3")] = None,
    tip_angle: Annotated[float | None, say("tip_angle", "DEG")] = None,
    spacing: Annotated[float | None, say("spacing", "DEG")] = None,
    angles: Annotated[str, say("angles", "WAY")] = SplitOptions.angles,
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
