"""`rotorid fit`: parameters of ordinary differential equations from time records."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from rotorid.commands.app import OUTPUT, Destination, command
from rotorid.commands.fit import FitOptions
from rotorid.commands.fit import fit as work


@command(
    FitOptions,
    panels={
        "Input": "sigma start allow_missing",
        "Method": "method loss starts ridge",
        "Limits": "max_iterations tolerance",
        OUTPUT: "",
        "Expert": "integrator rtol seed",
    },
    to=("report", "plot", "output", "table", "json", "show", "latex"),
)
def fit(
    model: Annotated[
        Path,
        typer.Argument(metavar="MODEL.toml", help="Differential equations, outputs, what to estimate."),
    ],
    records: Annotated[
        list[Path],
        typer.Argument(
            metavar="RECORD…",
            help="Time records, .csv or .xlsx: t_s, outputs and inputs; NAME_std beside an output NAME: "
            "standard deviation of each sample.",
        ),
    ],
    *,
    options: FitOptions,
    to: Destination,
) -> None:
    """Coefficients of differential equations from time records, with ±.

    Inputs are taken as exact, and as straight lines between their samples; only outputs have errors.

    Example: rotorid fit sample_data/fit/three_masses/model.toml sample_data/fit/three_masses/record.csv
    --sigma auto --plot fit.png

    Every step of [Q], its regression M θ = Y, and the tables of its iterations:

    Example: rotorid fit sample_data/fit/quasilinearization/model.toml
    sample_data/fit/quasilinearization/record.csv --method quasilinearization --integrator sequential-heun
    --show equations
    """
    to.deliver("fit", lambda: work(model, records, options))
