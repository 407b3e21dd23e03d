"""`rotorid unbalance`: where the unbalance is, from a single run and a rotor model."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from rotorid.cli.common import JsonOption, OutputOption, PlotOption
from rotorid.cli.output import check_targets, chosen, deliver
from rotorid.workflows.unbalance import METHODS, UnbalanceOptions
from rotorid.workflows.unbalance import unbalance as work


def unbalance(
    job: Annotated[
        Path, typer.Argument(metavar="JOB.toml", help="Job with a rotor and the place of every sensor in it.")
    ],
    stations: Annotated[str, typer.Option(help="Nodes or stations where unbalance may be: 6,9,12.")],
    method: Annotated[
        str,
        typer.Option(
            metavar="METHOD",
            help=f"{', '.join(METHODS)}; minimum-norm is least squares where the readings suffice.",
        ),
    ] = UnbalanceOptions.method,
    modes: Annotated[
        int | None,
        typer.Option(min=1, metavar="K", help="Of the rotor, for modal: 1 … K.", show_default=False),
    ] = None,
    ridge: Annotated[
        float | None,
        typer.Option(
            min=0.0, metavar="STRENGTH", help="For ridge; default: from the errors.", show_default=False
        ),
    ] = None,
    model_error: Annotated[
        float | None,
        typer.Option(
            min=0.0, metavar="PERCENT", help="Standard deviation of the coefficients.", show_default=False
        ),
    ] = None,
    json: JsonOption = False,
    plot: PlotOption = None,
    output: OutputOption = None,
) -> None:
    """Unbalance at any stations of a rotor model that explains the readings of one run, without trial runs.

    Example: rotorid unbalance sample_data/model_job/job.toml --stations 6,12,19
    """
    options = chosen(UnbalanceOptions, locals())
    check_targets(plot, output)
    deliver("unbalance", lambda: work(job, options), as_json=json, plot=plot, output=output)
