"""`rotorid reduce`: a rotor as a few masses."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Annotated

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

if TYPE_CHECKING:
    from rotorid.reduction import Reduction


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
    model: Annotated[
        Path | None,
        typer.Option(
            metavar="FILE.toml",
            help="Write the small model for `rotorid fit`, with a damper to be estimated at every mass.",
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

    check_targets(plot, output, model=model)
    machine = read_rotor(rotor)
    at = None if speed is None else one_speed(speed, "--speed")
    places = [machine.node(node) for node in parse_nodes(nodes, "--nodes")]
    result = reduce_rotor(machine, places, modes, speed=at)
    emit(
        result.to_dict(),
        result.summary,
        as_json=json,
        files=rotor_files(rotor),
        options={"nodes": nodes, "modes": modes, "speed": speed, "model": model and str(model)},
        figure=(plot, picture(result.plot)),
        table=(output, result.to_frame),
        more=(model, lambda: _model(result, rotor.name)),
    )


def _model(result: Reduction, name: str) -> bytes:
    """The small model as a file for `rotorid fit`; dampers begin with 2 % of each mass's critical one."""
    import numpy as np

    from rotorid.tables.modelwriting import ode_model_bytes

    if (result.masses.solution <= 0).any():
        raise ValueError(
            "a model with a mass that is not positive cannot be written: use other nodes or modes"
        )
    motion = result.equations_of_motion
    critical = 2 * np.sqrt(np.diag(motion.M) * np.diag(motion.K))
    dampers = {x: float(f"{0.02 * c:.3g}") for x, c in zip(motion.coordinates, critical, strict=True)}
    said = [
        f"{name} reduced to masses at nodes {', '.join(map(str, result.nodes))} (formula 50, {result.modes} "
        "modes), SI",
        "Put what is known of the start into [initial] (v_x7 is the velocity of x7), and forces into [force]",
    ]
    return ode_model_bytes(motion, dampers, {}, comments=said)
