"""`rotorid identify`: coefficients of a model from harmonic tests, natural frequencies and shapes."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from rotorid.cli.common import JsonOption, OutputOption, PlotOption, options_of
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
    ),
]
say = options_of(IdentifyOptions)


def identify(
    model: ModelArgument,
    data: DataArgument = None,
    method: Annotated[str, say("method", "METHOD"), choices] = IdentifyOptions.method,
    loss: Annotated[str, say("loss", "LOSS"), choices] = IdentifyOptions.loss,
    amplitude_error: Annotated[float | None, say("amplitude_error", "PERCENT")] = None,
    phase_error: Annotated[float | None, say("phase_error", "DEGREES")] = None,
    design: Annotated[str | None, say("design", "FIRST:LAST:STEP")] = None,
    choose: Annotated[int | None, say("choose", "N", least=1)] = None,
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
