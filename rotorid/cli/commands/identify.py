"""`rotorid identify`: coefficients of a model from harmonic tests, natural frequencies and shapes."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from rotorid.commands.app import Destination, command
from rotorid.commands.outcome import EQUATIONS, WITH_REPORT
from rotorid.workflows.identify import IdentifyOptions, compare
from rotorid.workflows.identify import identify as work


@command(
    IdentifyOptions,
    least={"choose": 1},
    panels={"Method": "method loss ridge", "Next test": "design choose"},
    to=(*WITH_REPORT, *EQUATIONS),
)
def identify(
    model: Annotated[
        Path, typer.Argument(metavar="MODEL.toml", help="Equations, known numbers, what to estimate.")
    ],
    data: Annotated[
        list[Path] | None,
        typer.Argument(
            metavar="OTHER.toml DATA",
            help="Measured amplitudes, .csv or .xlsx; only --design does without. A second model before them "
            "is compared with the first: misfits and F test.",
        ),
    ] = None,
    *,
    options: IdentifyOptions,
    to: Destination,
) -> None:
    """Coefficients of a model from harmonic tests, with ±, or what the data do tell.

    Example: rotorid identify sample_data/identify/task_5_1/model.toml sample_data/identify/task_5_1/data.csv

    Which frequencies to measure next:

    Example: rotorid identify sample_data/identify/task_5_1/model.toml sample_data/identify/task_5_1/data.csv
    --amplitude-error 2 --phase-error 1 --design 5:40:1 --choose 3
    """
    *others, table = data or (None,)
    if others and table:
        to.deliver("comparison", lambda: compare([model, *others], table, options))
    else:
        to.deliver("identification", lambda: work(model, table, options))
