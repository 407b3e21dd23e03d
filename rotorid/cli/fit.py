"""`rotorid fit`: parameters of ordinary differential equations from time records."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from rotorid.cli.common import JsonOption, OutputOption, PlotOption, check_targets, emit
from rotorid.cli.progress import busy

if TYPE_CHECKING:
    from matplotlib.figure import Figure

METHODS = ("levenberg-marquardt", "gauss-newton", "quasilinearization", "multiple-shooting")
INTEGRATORS = ("auto", "expm", "dop853", "lsoda", "heun", "rk4")
LOSSES = ("linear", "soft_l1", "huber", "cauchy")


def fit(
    model: Annotated[
        Path, typer.Argument(metavar="MODEL.toml", help="Differential equations, outputs, what to estimate.")
    ],
    records: Annotated[
        list[Path],
        typer.Argument(metavar="RECORD…", help="Time records, .csv or .xlsx: t_s, outputs and inputs."),
    ],
    method: Annotated[str, typer.Option(metavar="METHOD", help=f"{', '.join(METHODS)}.")] = METHODS[0],
    integrator: Annotated[str, typer.Option(metavar="NAME", help=f"{', '.join(INTEGRATORS)}.")] = INTEGRATORS[
        0
    ],
    loss: Annotated[
        str, typer.Option(metavar="LOSS", help=f"{', '.join(LOSSES)} (robust against outliers).")
    ] = LOSSES[0],
    starts: Annotated[
        int, typer.Option(metavar="N", min=1, help="Begin from several places, to find other minima.")
    ] = 1,
    allow_missing: Annotated[
        bool, typer.Option("--allow-missing", help="Blank cells, NaN and absent outputs were not measured.")
    ] = False,
    sigma: Annotated[
        str | None,
        typer.Option(
            metavar="LIST",
            help="Standard deviation of a sample: 0.01, or y1=0.01,y2=0.02; default: from the residuals.",
            show_default=False,
        ),
    ] = None,
    json: JsonOption = False,
    plot: PlotOption = None,
    output: OutputOption = None,
) -> None:
    """Parameters of differential equations from time records, with intervals, and how they were found.

    Example: rotorid fit sample_data/fit/three_masses/model.toml sample_data/fit/three_masses/record.csv
    --plot fit.png
    """
    for option, value, known in (
        ("--method", method, METHODS),
        ("--integrator", integrator, INTEGRATORS),
        ("--loss", loss, LOSSES),
    ):
        if value not in known:
            raise ValueError(f"{option} {value!r} is not known: one of {', '.join(known)}")
    check_targets(plot, output)
    from rotorid.plots_timedomain import figure_fit
    from rotorid.tables import read_ode_model, read_record
    from rotorid.tables.records import read_sigma
    from rotorid.timedomain.fit import fit as estimate

    equations = read_ode_model(model)
    deviations = read_sigma(sigma, equations)
    data = [read_record(path, equations, allow_missing=allow_missing, sigma=deviations) for path in records]
    with busy("fit"):
        result = estimate(equations, data, method=method, integrator=integrator, loss=loss, starts=starts)

    def draw() -> Figure:
        return figure_fit(result)

    emit(
        result.to_dict(),
        result.summary,
        as_json=json,
        files=[model, *records],
        options={
            "method": method,
            "integrator": integrator,
            "loss": loss,
            "starts": starts,
            "allow_missing": allow_missing,
            "sigma": sigma,
        },
        figure=(plot, draw),
        table=(output, result.to_frame),
    )
