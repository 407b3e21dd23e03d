"""`rotorid fit`: parameters of ordinary differential equations from time records."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from rotorid.cli.common import JsonOption, OutputOption, PlotOption
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
MethodOption = Annotated[str, typer.Option(metavar="METHOD"), choices]
IntegratorOption = Annotated[str, typer.Option(metavar="NAME"), choices]
LossOption = Annotated[str, typer.Option(metavar="LOSS"), choices]
StartOption = Annotated[
    str | None,
    typer.Option(
        metavar="LIST",
        help="Starting values instead of the model's: k=2,d=0.1; the others stay.",
        show_default=False,
    ),
]
StartsOption = Annotated[
    int, typer.Option(metavar="N", min=1, help="Begin from several places, to find other minima.")
]
SeedOption = Annotated[
    int | None,
    typer.Option(metavar="N", min=0, help="Other places for --starts; default: 0.", show_default=False),
]
IterationsOption = Annotated[
    int,
    typer.Option(
        metavar="N",
        min=1,
        help="At most; levenberg-marquardt does not count its undamped Gauss–Newton steps.",
    ),
]
TrajectoryOption = Annotated[
    str | None,
    typer.Option(
        metavar="model|data",
        help="Where quasilinearization (default: model) and multiple shooting (default: data) begin: the "
        "model's own solution, or the measured outputs.",
        show_default=False,
    ),
]
PiecesOption = Annotated[
    int | None,
    typer.Option(
        metavar="N",
        min=1,
        help="Of each record in multiple shooting; default: 12, or fewer for a short one.",
        show_default=False,
    ),
]
RtolOption = Annotated[
    float | None,
    typer.Option(
        metavar="X", help="Relative tolerance of the integration; default: 1e-10.", show_default=False
    ),
]
SecondsOption = Annotated[
    float,
    typer.Option(
        metavar="S", min=0.01, help="Limit of the search; what it has found by then has no intervals."
    ),
]
MissingOption = Annotated[
    bool, typer.Option("--allow-missing", help="Blank cells, NaN and absent outputs were not measured.")
]
SigmaOption = Annotated[
    str | None,
    typer.Option(
        metavar="LIST",
        help="Standard deviation of a sample: 0.01, or y1=0.01,y2=0.02; auto: estimate the error of each "
        "output from its residuals, and weigh by it; default: NAME_std of the record, or else all alike.",
        show_default=False,
    ),
]


def fit(
    model: ModelArgument,
    records: RecordsArgument,
    method: MethodOption = FitOptions.method,
    integrator: IntegratorOption = FitOptions.integrator,
    loss: LossOption = FitOptions.loss,
    start: StartOption = None,
    starts: StartsOption = FitOptions.starts,
    seed: SeedOption = None,
    max_iterations: IterationsOption = FitOptions.max_iterations,
    max_seconds: SecondsOption = FitOptions.max_seconds,
    trajectory: TrajectoryOption = None,
    pieces: PiecesOption = None,
    rtol: RtolOption = None,
    allow_missing: MissingOption = False,
    sigma: SigmaOption = None,
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
