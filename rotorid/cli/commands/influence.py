"""`rotorid influence`: influence coefficients of a rotor model."""

from __future__ import annotations

from typing import TYPE_CHECKING, Annotated

import typer

from rotorid.base.text import counted
from rotorid.cli.common import (
    JsonOption,
    OutputOption,
    PlotOption,
    RotorArgument,
    emit,
)
from rotorid.cli.output import check_targets
from rotorid.cli.progress import busy
from rotorid.cli.verbose import note_rotor
from rotorid.plots import plot
from rotorid.workflows.parameters import (
    nodes,
    rising_speeds,
)
from rotorid.workflows.parameters import sensors as parse_sensors

if TYPE_CHECKING:
    from matplotlib.figure import Figure

    from fem import InfluenceCoefficients, Rotor


def influence(
    rotor: RotorArgument,
    planes: Annotated[str, typer.Option(help="Correction planes: nodes or stations, such as 7,12,18.")],
    sensors: Annotated[
        str,
        typer.Option(
            help="Sensors: nodes or stations, each with its angle from x in degrees: 2:45,22:45 (without: 0)."
        ),
    ],
    speed: Annotated[
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
    import fem
    from rotorid.tables import influence_frame, read_rotor, rotor_files

    check_targets(plot, output)
    model = read_rotor(rotor)
    at, read, omega = nodes(planes, "--planes"), parse_sensors(sensors), rising_speeds(speed)
    with busy(f"influence coefficients at {counted(len(omega), 'speed')}"):
        result = fem.influence(model, at, read, omega)
    note_rotor(model, speeds=len(omega))
    emit(
        result.to_dict(),
        result.summary,
        as_json=json,
        files=rotor_files(rotor),
        options={"planes": planes, "sensors": sensors, "speeds": speed},
        figure=(plot, lambda: _figure(model, result)),
        table=(output, lambda: influence_frame(result)),
    )


def _figure(rotor: Rotor, result: InfluenceCoefficients) -> Figure:
    """The coefficients over speed, below the rotor with its planes and sensors."""
    from matplotlib.figure import Figure

    from fem.plots import draw_rotor

    figure = Figure(figsize=(10, 8.5), layout="constrained")
    above, below = figure.subplots(2, height_ratios=(2, 3))
    draw_rotor(rotor, above, planes=result.planes, sensors=result.sensors)
    plot(result, below)
    return figure
