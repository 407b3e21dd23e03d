"""`rotorid response`: vibration of a rotor model under a given unbalance."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from rotorid.cli.common_options import OUTPUT, WITH_REPORT, RotorArgument, command
from rotorid.cli.output import Destination
from rotorid.workflows.response import ResponseOptions, View
from rotorid.workflows.response import response as work


@command(ResponseOptions, panels={OUTPUT: "view at"}, to=WITH_REPORT)
def response(
    rotor: RotorArgument,
    unbalance: Annotated[
        Path,
        typer.Option(
            "--unbalance",
            metavar="FILE",
            help="Table: plane, unbalance_g_mm (or mass_g and radius_mm), angle_deg.",
        ),
    ],
    options: ResponseOptions,
    view: Annotated[View, typer.Option("--view", help="What --plot draws.")] = "bode",
    *,
    to: Destination,
) -> None:
    """Vibration under unbalance: readings, orbits, bearing forces, peaks after API 684.

    Example: rotorid response sample_data/compressor/rotor.toml
    --unbalance sample_data/compressor/unbalance.csv --speeds 1000:15000:20rpm
    --sensors "probe DE:45,probe NDE:45" --operating 5300:6500rpm --plot bode.png
    """
    to.deliver("response", lambda: work(rotor, unbalance, options), draw=lambda found: found.figure(view))
