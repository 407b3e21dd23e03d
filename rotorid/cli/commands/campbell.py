"""`rotorid campbell`: whirl frequencies, logarithmic decrements and damped critical speeds."""

from __future__ import annotations

from typing import Annotated

import typer

from rotorid.cli.common import JsonOption, OperatingOption, OutputOption, PlotOption, RotorArgument
from rotorid.cli.output import check_targets, chosen, deliver
from rotorid.workflows.campbell import CampbellOptions
from rotorid.workflows.campbell import campbell as work


def campbell(
    rotor: RotorArgument,
    speeds: Annotated[
        str,
        typer.Option("--speeds", help="FIRST:LAST:STEP or a list, rad/s; or with a unit: 500:15000:250rpm."),
    ],
    number: Annotated[
        int | None,
        typer.Option(
            "-n", "--number", min=1, help="How many modes, by default 6; forward and backward count apart."
        ),
    ] = None,
    operating: OperatingOption = None,
    json: JsonOption = False,
    plot: PlotOption = None,
    output: OutputOption = None,
) -> None:
    """Whirl frequencies, logarithmic decrements and directions over speed, and damped critical speeds.

    The picture is a Campbell diagram with the 1× line, over the logarithmic decrements.

    Example: rotorid campbell sample_data/compressor/rotor.toml --speeds 1000:15000:250rpm --plot campbell.png
    """
    options = chosen(CampbellOptions, locals())
    check_targets(plot, output)
    deliver("whirl", lambda: work(rotor, options), as_json=json, plot=plot, output=output)
