"""`rotorid reduce`: a rotor as a few masses."""

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
    one_speed,
    picture,
)
from rotorid.cli.common import nodes as parse_nodes


def reduce(
    rotor: RotorArgument,
    nodes: Annotated[str, typer.Option(help="Where the masses stand: nodes or stations, 7,12,18.")],
    modes: Annotated[int, typer.Option(min=1, help="How many modes of the rotor the regression uses.")] = 2,
    speed: Annotated[
        str | None,
        typer.Option(
            metavar="SPEED",
            help="Where tables of bearings and seals are read, such as 3000rpm; default: their lowest speed.",
            show_default=False,
        ),
    ] = None,
    json: JsonOption = False,
    plot: PlotOption = None,
    output: OutputOption = None,
) -> None:
    """Equivalent masses at chosen nodes (formula 50) and the natural frequencies of the small model.

    The formula is one of a plane at rest: gyroscopic effect, cross-coupling and the direction y are left out.

    Example: rotorid reduce sample_data/rotor23.csv --nodes 7,12,18 --modes 2
    """
    from rotorid.reduction import reduce as reduce_rotor
    from rotorid.tables import read_rotor, rotor_files

    check_targets(plot, output)
    model = read_rotor(rotor)
    at = None if speed is None else one_speed(speed, "--speed")
    places = [model.node(node) for node in parse_nodes(nodes, "--nodes")]
    result = reduce_rotor(model, places, modes, speed=at)
    emit(
        result.to_dict(),
        result.summary,
        as_json=json,
        files=rotor_files(rotor),
        options={"nodes": nodes, "modes": modes, "speed": speed},
        figure=(plot, picture(result.plot)),
        table=(output, result.to_frame),
    )
