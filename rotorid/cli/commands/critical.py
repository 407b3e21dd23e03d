"""`rotorid critical`: critical speeds and mode shapes."""

from __future__ import annotations

from typing import Annotated

import typer

from rotorid.cli.common import (
    JsonOption,
    OperatingOption,
    OutputOption,
    PlotOption,
    ReportOption,
    RotorArgument,
)
from rotorid.cli.output import check_targets, chosen, deliver
from rotorid.workflows.critical import CriticalOptions
from rotorid.workflows.critical import critical as work


def critical(
    rotor: RotorArgument,
    number: Annotated[
        int | None,
        typer.Option(
            "-n",
            "--number",
            min=1,
            help="How many critical speeds, by default 3; rigid-body motions come besides.",
        ),
    ] = None,
    mesh_check: Annotated[
        bool, typer.Option("--mesh-check", help="Estimate by refinement how far off the mesh makes each.")
    ] = False,
    speed_map: Annotated[
        bool,
        typer.Option("--map", help="Critical speeds over the stiffness of the bearings; --plot draws it."),
    ] = False,
    operating: OperatingOption = None,
    json: JsonOption = False,
    plot: PlotOption = None,
    output: OutputOption = None,
    report: ReportOption = None,
) -> None:
    """Critical speeds with their whirl directions, and mode shapes, of the rotor without damping.

    Damping and cross-coupling that does work are left out; `rotorid campbell` has them.

    Example: rotorid critical sample_data/rotor23.csv -n 3 --plot modes.png

    Example: rotorid critical sample_data/compressor/rotor.toml -n 4 --map --plot map.png
    """
    options = chosen(CriticalOptions, locals())
    check_targets(plot, output, report=report)
    deliver(
        "critical speeds",
        lambda: work(rotor, options),
        as_json=json,
        plot=plot,
        output=output,
        report=report,
    )
