"""`rotorid campbell`: whirl frequencies, logarithmic decrements and damped critical speeds."""

from __future__ import annotations

from typing import TYPE_CHECKING, Annotated

import typer

from rotorid.base.text import counted
from rotorid.cli.common import (
    JsonOption,
    OperatingOption,
    OutputOption,
    PlotOption,
    RotorArgument,
    emit,
)
from rotorid.cli.output import check_targets
from rotorid.cli.progress import busy
from rotorid.cli.verbose import note_rotor
from rotorid.workflows.operating import (
    separation,
    separation_text,
)
from rotorid.workflows.parameters import (
    band,
    rising_speeds,
)

if TYPE_CHECKING:
    from matplotlib.figure import Figure


def campbell(
    rotor: RotorArgument,
    speed: Annotated[
        str,
        typer.Option("--speeds", help="FIRST:LAST:STEP or a list, rad/s; or with a unit: 500:15000:250rpm."),
    ],
    n: Annotated[
        int | None,
        typer.Option(
            "-n", "--number", min=1, help="How many modes, by default 6; forward and backward count apart."
        ),
    ] = None,
    operating: OperatingOption = None,
    json: JsonOption = False,
    plot: PlotOption = None,
    output: OutputOption = None,
) -> None:
    """Whirl frequencies, logarithmic decrements and directions over speed, and damped critical speeds.

    The picture is a Campbell diagram with the 1× line, over the logarithmic decrements.

    Example: rotorid campbell sample_data/compressor/rotor.toml --speeds 1000:15000:250rpm --plot campbell.png
    """
    import fem
    from fem.campbell import HEAVY
    from fem.plots import campbell_figure
    from rotorid.tables import read_rotor, rotor_files

    check_targets(plot, output)
    service = band(operating)
    model, omega = read_rotor(rotor), rising_speeds(speed)
    with busy(f"whirl at {counted(len(omega), 'speed')}"):
        result = fem.campbell(model, omega, n)

    def picture() -> Figure:
        return campbell_figure(
            result, result.criticals, operating=service, unstable=[(w.first, w.last) for w in result.windows]
        )

    document = result.to_dict()
    inside = (
        None
        if service is None
        else separation([speed for speed, damping in result.criticals if damping <= HEAVY], service)
    )
    if inside is not None:
        document["operating"] = inside
    note_rotor(model, speeds=len(omega), estimated_relative_error=result.error)
    emit(
        document,
        lambda: "\n".join([result.summary(), *([] if inside is None else [separation_text(inside)])]),
        as_json=json,
        files=rotor_files(rotor),
        options={"speeds": speed, "number": n or result.frequencies.shape[1], "operating": operating},
        figure=(plot, picture),
        table=(output, result.to_frame),
    )
