"""`rotorid response`: vibration of a rotor model under a given unbalance."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from rotorid.cli.common import JsonOption, OutputOption, PlotOption, ReportOption, RotorArgument, options_of
from rotorid.cli.output import check_targets, chosen, deliver
from rotorid.workflows.response import ResponseOptions, View
from rotorid.workflows.response import response as work

say = options_of(ResponseOptions)


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
    speeds: Annotated[str, say("speeds", None, "--speeds")],
    sensors: Annotated[str | None, say("sensors", "LIST", "--sensors")] = None,
    operating: Annotated[str | None, say("operating", "A:B")] = None,
    view: Annotated[View, typer.Option("--view", help="What --plot draws.")] = "bode",
    at: Annotated[str | None, say("at", "SPEED", "--at")] = None,
    json: JsonOption = False,
    plot: PlotOption = None,
    output: OutputOption = None,
    report: ReportOption = None,
) -> None:
    """Vibration under unbalance: readings, orbits, bearing forces, and the peaks after API 684.

    Example: rotorid response sample_data/compressor/rotor.toml
    --unbalance sample_data/compressor/unbalance.csv --speeds 1000:15000:20rpm
    --sensors "probe DE:45,probe NDE:45" --operating 5300:6500rpm --plot bode.png
    """
    options = chosen(ResponseOptions, locals())
    check_targets(plot, output, report=report)
    deliver(
        "response",
        lambda: work(rotor, unbalance, options),
        as_json=json,
        plot=plot,
        output=output,
        report=report,
        draw=lambda found: found.figure(view),
    )
