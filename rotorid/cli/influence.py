"""`rotorid influence`: influence coefficients of a rotor model."""

from __future__ import annotations

from typing import Annotated

import typer

from rotorid.cli.common import (
    JsonOption,
    OutputOption,
    PlotOption,
    RotorArgument,
    check_targets,
    emit,
    numbers,
    picture,
    speeds,
)


def influence(
    rotor: RotorArgument,
    planes: Annotated[str, typer.Option(help="Nodes of the correction planes, such as 7,12,18.")],
    sensors: Annotated[str, typer.Option(help="Nodes of the sensors.")],
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

    Example: rotorid influence sample_data/rotor23.csv --planes 7,12 --sensors 2,22 --speeds 100,120
    """
    import fem
    from rotorid.tables import influence_frame, read_rotor, rotor_files

    check_targets(plot, output)
    result = fem.influence(
        read_rotor(rotor), numbers(planes, "--planes"), numbers(sensors, "--sensors"), speeds(speed)
    )
    emit(
        result.to_dict(),
        result.summary,
        as_json=json,
        files=rotor_files(rotor),
        options={"planes": planes, "sensors": sensors, "speeds": speed},
        figure=(plot, picture(result.plot)),
        table=(output, lambda: influence_frame(result)),
    )
