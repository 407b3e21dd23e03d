"""`rotorid fit`: parameters of ordinary differential equations from time records."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from rotorid.cli.common import JsonOption, OutputOption, PlotOption, options_of
from rotorid.cli.output import check_targets, chosen, deliver
from rotorid.workflows.fit import FitOptions, choices
from rotorid.workflows.fit import fit as work

ModelArgument = Annotated[
    Path, typer.Argument(metavar="MODEL.toml", help="Differential equations, outputs, what to estimate.")
]
RecordsArgument = Annotated[
    list[Path],
    typer.Argument(
        metavar="RECORD…",
        help="Time records, .csv or .xlsx: t_s, outputs and inputs; NAME_std beside an output NAME: standard "
        "deviation of each sample.",
    ),
]
say = options_of(FitOptions)


def fit(
    model: ModelArgument,
    records: RecordsArgument,
    method: Annotated[str, say("method", "METHOD"), choices] = FitOptions.method,
    integrator: Annotated[str, say("integrator", "NAME"), choices] = FitOptions.integrator,
    loss: Annotated[str, say("loss", "LOSS"), choices] = FitOptions.loss,
    start: Annotated[str | None, say("start", "LIST")] = None,
    starts: Annotated[int, say("starts", "N", least=1)] = FitOptions.starts,
    seed: Annotated[int | None, say("seed", "N", least=0)] = None,
    max_iterations: Annotated[int, say("max_iterations", "N", least=1)] = FitOptions.max_iterations,
    max_seconds: Annotated[float, say("max_seconds", "S", least=0.01)] = FitOptions.max_seconds,
    trajectory: Annotated[str | None, say("trajectory", "model|data")] = None,
    pieces: Annotated[int | None, say("pieces", "N", least=1)] = None,
    rtol: Annotated[float | None, say("rtol", "X")] = None,
    allow_missing: Annotated[bool, say("allow_missing", None, "--allow-missing")] = False,
    sigma: Annotated[str | None, say("sigma", "LIST")] = None,
    json: JsonOption = False,
    plot: PlotOption = None,
    output: OutputOption = None,
) -> None:
    """Parameters of differential equations from time records, with intervals, and how they were found.

    Inputs are taken as exact, and as straight lines between their samples; only outputs have errors.

    Example: rotorid fit sample_data/fit/three_masses/model.toml sample_data/fit/three_masses/record.csv
    --sigma auto --plot fit.png
    """
    options = chosen(FitOptions, locals())
    check_targets(plot, output)
    deliver("fit", lambda: work(model, records, options), as_json=json, plot=plot, output=output)
