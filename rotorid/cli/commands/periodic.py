"""`rotorid periodic`: periodic motion over speed, its stability and bifurcations."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from rotorid.commands.app import Destination, command
from rotorid.workflows.motion.periodic import PeriodicOptions
from rotorid.workflows.motion.periodic import periodic as work


@command(
    PeriodicOptions,
    least={"subsynchronous": 2, "modes": 0, "max_seconds": 0.01},
    panels={"Motion": "subsynchronous limit_cycle", "Method": "modes max_seconds"},
)
def periodic(
    model: Annotated[
        Path, typer.Argument(metavar="MODEL", help="Rotor file (.toml, .csv, .xlsx) or small model (.toml).")
    ],
    options: PeriodicOptions,
    to: Destination,
) -> None:
    """Periodic motion over speed: stability, bifurcations, self-excited motion.

    Example: rotorid periodic sample_data/motion/rotor.toml --speeds 5000:8000rpm --limit-cycle
    --plot bifurcations.png

    Example: rotorid periodic sample_data/motion/unbalanced.toml --speeds 1000:6000rpm --output branches.csv
    """
    to.deliver("periodic motion", lambda: work(model, options))
