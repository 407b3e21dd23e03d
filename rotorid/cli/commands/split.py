"""`rotorid split`: one given weight on holes, at two free angles, or as material taken away."""

from __future__ import annotations

from typing import Annotated

import typer

from rotorid.commands.app import Destination, command
from rotorid.workflows.split import SplitOptions
from rotorid.workflows.split import split as work


@command(
    SplitOptions,
    names={"axial": ("--axial/--radial",)},
    panels={
        "Input": "mounted radius angles",
        "Holes": "holes pieces best stock per_hole first_hole taken most_pieces good_enough",
        "Limits and steps": "max_mass step angle_step",
        "Instead of holes": "two drill depth axial spacing tip_angle density grind",
    },
)
def split(
    vector: Annotated[
        str,
        typer.Argument(
            metavar="VECTOR",
            help="Weight to be added and its angle in degrees, such as 35g@120 or 3500g_mm@120; several "
            "with + between them are added.",
        ),
    ],
    options: SplitOptions,
    to: Destination,
) -> None:
    """Mount one given weight: in holes, at two angles, or by drilling or grinding.

    Example: rotorid split 35g@120 --holes 24 --pieces 10g,20g --taken 3:10g

    Example: rotorid split 35g@120 --two 20g,30g

    Example: rotorid split 35g@120 --drill 8mm --depth 20mm --radius 100mm
    """
    to.deliver("split", lambda: work(vector, options))
