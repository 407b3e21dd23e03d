"""`rotorid periodic`: periodic motion over speed, its stability and bifurcations."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from rotorid.cli.common_options import command
from rotorid.cli.output import Destination
from rotorid.workflows.motion.periodic import PeriodicOptions
from rotorid.workflows.motion.periodic import periodic as work


@command(
    PeriodicOptions,
    least={"subsynchronous": 2, "steps": 4},
    panels={"Method": "subsynchronous limit_cycle steps"},
)
def periodic(
    model: Annotated[
        Path, typer.Argument(metavar="MODEL", help="Rotor file, rotor table, or small model (.toml).")
    ],
    unbalance: Annotated[
        Path | None,
        typer.Option("--unbalance", metavar="FILE", help="Table of a rotor's unbalance, as of response."),
    ] = None,
    bow: Annotated[
        Path | None, typer.Option("--bow", metavar="FILE", help="Table of a rotor's bow at rest.")
    ] = None,
    *,
    options: PeriodicOptions,
    to: Destination,
) -> None:
    """Periodic motion over speed: branches past folds, stability, bifurcations, limit cycles.

    Example: rotorid periodic damper.toml --unbalance unbalance.csv --speeds 2000:10000rpm --plot jumps.png

    Example: rotorid periodic journals.toml --speeds 1000:6000rpm --limit-cycle
    """
    to.deliver("periodic motion", lambda: work(model, options, unbalance, bow))
