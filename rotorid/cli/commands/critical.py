"""`rotorid critical`: critical speeds and mode shapes."""

from __future__ import annotations

from typing import Annotated

from rotorid.cli.common import JsonOption, OutputOption, PlotOption, ReportOption, RotorArgument, options_of
from rotorid.cli.output import check_targets, chosen, deliver
from rotorid.workflows.critical import CriticalOptions
from rotorid.workflows.critical import critical as work

say = options_of(CriticalOptions)


def critical(
    rotor: RotorArgument,
    number: Annotated[int | None, say("number", None, "-n", "--number", least=1)] = None,
    mesh_check: Annotated[bool, say("mesh_check", None, "--mesh-check")] = False,
    speed_map: Annotated[bool, say("speed_map", None, "--map")] = False,
    operating: Annotated[str | None, say("operating", "A:B")] = None,
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
