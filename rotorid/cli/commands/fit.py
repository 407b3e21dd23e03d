"""`rotorid fit`: parameters of ordinary differential equations from time records."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from rotorid.commands.app import OUTPUT, Destination, command
from rotorid.commands.outcome import EQUATIONS, WITH_REPORT
from rotorid.workflows.fit import FitOptions
from rotorid.workflows.fit import fit as work


@command(
    FitOptions,
    least={"starts": 1, "seed": 0, "choose": 1, "max_iterations": 1, "max_seconds": 0.01, "pieces": 1},
    panels={
        "Input": "sigma start allow_missing",
        "Method": "method loss starts ridge",
        "Next record": "design choose",
        "Limits": "max_seconds max_iterations tolerance",
        OUTPUT: "",
        "Expert": "integrator rtol trajectory pieces seed",
    },
    to=(*WITH_REPORT, *EQUATIONS),
)
def fit(
    model: Annotated[
        Path,
        typer.Argument(metavar="MODEL.toml", help="Differential equations, outputs, what to estimate."),
    ],
    records: Annotated[
        list[Path] | None,
        typer.Argument(
            metavar="RECORD…",
            help="Time records, .csv or .xlsx: t_s, outputs and inputs; NAME_std beside an output NAME: "
            "standard deviation of each sample; only --design does without.",
        ),
    ] = None,
    *,
    options: FitOptions,
    to: Destination,
) -> None:
    """Coefficients of differential equations from time records, with ±.

    Inputs are taken as exact, and as straight lines between their samples; only outputs have errors.

    Example: rotorid fit sample_data/fit/three_masses/model.toml sample_data/fit/three_masses/record.csv
    --sigma auto --plot fit.png

    Which times to sample:

    Example: rotorid fit sample_data/fit/quasilinearization/model.toml --start theta1=1,theta2=-1,theta3=-1
    --sigma 0.02 --design 0:10:0.5 --choose 4
    """
    to.deliver("fit", lambda: work(model, records or (), options))
