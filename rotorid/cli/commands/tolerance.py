"""`rotorid tolerance`: permissible residual unbalance by ISO 21940-11."""

from __future__ import annotations

from typing import Annotated

from rotorid.cli.common_options import JsonOption, OutputOption, PlotOption, options_of
from rotorid.cli.output import check_targets, chosen, deliver
from rotorid.workflows.tolerance import ToleranceOptions
from rotorid.workflows.tolerance import tolerance as work

say = options_of(ToleranceOptions)


def tolerance(
    mass: Annotated[str, say("mass", "MASS")],
    speed: Annotated[str, say("speed", "SPEED")],
    grade: Annotated[str, say("grade", "GRADE")],
    planes: Annotated[str | None, say("planes", "LIST")] = None,
    bearings: Annotated[str | None, say("bearings", "A,B")] = None,
    centre: Annotated[str | None, say("centre", "POSITION")] = None,
    json: JsonOption = False,
    plot: PlotOption = None,
    output: OutputOption = None,
) -> None:
    """Permissible residual unbalance of a rigid rotor (ISO 21940-11), and the share of each plane.

    Positions count along the shaft from any point. Two planes without positions share it in equal parts.

    Example: rotorid tolerance --mass 500kg --speed 3000rpm --grade G2.5

    Example: rotorid tolerance --mass 500kg --speed 3000rpm --grade G2.5
    --planes left=100mm,right=600mm --bearings 0mm,700mm --centre 320mm --plot tolerance.png
    """
    options = chosen(ToleranceOptions, locals())
    check_targets(plot, output)
    deliver("tolerance", lambda: work(options), as_json=json, plot=plot, output=output)
