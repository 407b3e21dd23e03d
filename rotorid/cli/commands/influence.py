"""`rotorid influence`: influence coefficients of a rotor model."""

from __future__ import annotations

from typing import Annotated

import typer

from rotorid.cli.common_options import JsonOption, OutputOption, PlotOption, RotorArgument
from rotorid.cli.output import check_targets, chosen, deliver
from rotorid.workflows.influence import InfluenceOptions
from rotorid.workflows.influence import influence as work


def influence(
    rotor: RotorArgument,
    planes: Annotated[
        str, typer.Option("--planes", help="Correction planes: nodes or stations, such as 7,12,18.")
    ],
    sensors: Annotated[
        str,
        typer.Option(
            "--sensors",
            help="Sensors: nodes or stations, each with its angle from x in degrees: 2:45,22:45 "
            "(without: 0).",
        ),
    ],
    speeds: Annotated[
        str,
        typer.Option("--speeds", help="FIRST:LAST:STEP or a list, rad/s; or with a unit: 1000:6000:50rpm."),
    ],
    json: JsonOption = False,
    plot: PlotOption = None,
    output: OutputOption = None,
) -> None:
    """Vibration at sensors per unit unbalance at planes, over speeds.

    The table that --output writes is the stored-coefficients file that `rotorid balance --influence` reads.

    Example: rotorid influence sample_data/rotor23.csv --planes 7,12 --sensors 2:45,22:45 --speeds 100,120
    """
    options = chosen(InfluenceOptions, locals())
    check_targets(plot, output)
    deliver("influence coefficients", lambda: work(rotor, options), as_json=json, plot=plot, output=output)
