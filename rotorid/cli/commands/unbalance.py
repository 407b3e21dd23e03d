"""`rotorid unbalance`: where the unbalance is, from a single run and a rotor model."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from rotorid.commands.app import Destination, command
from rotorid.workflows.unbalance import UnbalanceOptions
from rotorid.workflows.unbalance import unbalance as work


@command(
    UnbalanceOptions,
    least={"modes": 1, "ridge": 0.0, "model_error": 0.0},
    panels={"Method": "method modes ridge"},
)
def unbalance(
    job: Annotated[
        Path, typer.Argument(metavar="JOB.toml", help="Job with a rotor and the place of every sensor in it.")
    ],
    options: UnbalanceOptions,
    to: Destination,
) -> None:
    """Unbalance along a rotor model, from the readings of one run, without trial weights.

    Example: rotorid unbalance sample_data/model_job/job.toml --stations 6,12,19
    """
    to.deliver("unbalance", lambda: work(job, options))
