"""`rotorid campbell`: whirl frequencies, logarithmic decrements and damped critical speeds."""

from __future__ import annotations

from typing import Annotated

from rotorid.cli.common import JsonOption, OutputOption, PlotOption, RotorArgument, options_of
from rotorid.cli.output import check_targets, chosen, deliver
from rotorid.workflows.campbell import CampbellOptions
from rotorid.workflows.campbell import campbell as work

say = options_of(CampbellOptions)


def campbell(
    rotor: RotorArgument,
    speeds: Annotated[str, say("speeds", None, "--speeds")],
    number: Annotated[int | None, say("number", None, "-n", "--number", least=1)] = None,
    operating: Annotated[str | None, say("operating", "A:B")] = None,
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
