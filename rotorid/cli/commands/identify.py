"""`rotorid identify`: coefficients of a model from harmonic tests, natural frequencies and shapes."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from rotorid.cli.common import JsonOption, OutputOption, PlotOption
from rotorid.cli.output import check_targets, chosen, deliver
from rotorid.workflows.identify import IdentifyOptions, choices
from rotorid.workflows.identify import identify as work

ModelArgument = Annotated[
    Path, typer.Argument(metavar="MODEL.toml", help="Equations, known numbers, what to estimate.")
]
DataArgument = Annotated[
    Path | None,
    typer.Argument(
        metavar="DATA",
        help="Measured amplitudes, .csv or .xlsx; only --design does without.",
        show_default=False,
    ),
]
MethodOption = Annotated[str, typer.Option(metavar="METHOD"), choices]
LossOption = Annotated[str, typer.Option(metavar="LOSS", help="Of output error."), choices]
DesignOption = Annotated[
    str | None,
    typer.Option(
        metavar="FIRST:LAST:STEP",
        help="Which of these frequencies to measure next: rad/s, or with Hz or rpm at the end.",
        show_default=False,
    ),
]
ChooseOption = Annotated[
    int | None,
    typer.Option(metavar="N", min=1, help="How many frequencies --design chooses.", show_default=False),
]
PercentOption = Annotated[
    float | None,
    typer.Option(
        metavar="PERCENT", help="One standard deviation of an amplitude, in percent.", show_default=False
    ),
]
DegreesOption = Annotated[
    float | None,
    typer.Option(
        metavar="DEGREES", help="One standard deviation of a phase, in degrees.", show_default=False
    ),
]


def identify(
    model: ModelArgument,
    data: DataArgument = None,
    method: MethodOption = IdentifyOptions.method,
    loss: LossOption = IdentifyOptions.loss,
    amplitude_error: PercentOption = None,
    phase_error: DegreesOption = None,
    design: DesignOption = None,
    choose: ChooseOption = None,
    json: JsonOption = False,
    plot: PlotOption = None,
    output: OutputOption = None,
) -> None:
    """Coefficients of a model from measured amplitudes, with intervals, or what the data do tell.

    Example: rotorid identify sample_data/identify/task_5_1/model.toml sample_data/identify/task_5_1/data.csv

    With --amplitude-error 2 --phase-error 1 --design 5:40:1 --choose 3: which frequencies to measure next.
    """
    options = chosen(IdentifyOptions, locals())
    check_targets(plot, output)
    deliver("identification", lambda: work(model, data, options), as_json=json, plot=plot, output=output)
