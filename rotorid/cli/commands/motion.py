"""`rotorid motion`: motion in time of a rotor whose forces are not linear."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from rotorid.commands.app import OUTPUT, Destination, command
from rotorid.workflows.motion.motion import MotionOptions, View
from rotorid.workflows.motion.motion import motion as work


@command(
    MotionOptions,
    least={"modes": 0},
    panels={"Start": "start displaced", "Method": "modes rate tolerance", OUTPUT: "view"},
)
def motion(
    model: Annotated[
        Path, typer.Argument(metavar="MODEL", help="Rotor file (.toml, .csv, .xlsx) or small model (.toml).")
    ],
    options: MotionOptions,
    view: Annotated[View, typer.Option("--view", help="What --plot draws.")] = "motion",
    *,
    to: Destination,
) -> None:
    """Motion in time at a constant speed, through a run-up or a run-down.

    Example: rotorid motion sample_data/motion/rotor.toml --speed 4000rpm --time 2s --plot motion.png

    Example: rotorid motion sample_data/motion/rotor.toml --run-up 1000:9000rpm --time 10 --plot bode.png
    --view bode
    """
    to.deliver("motion", lambda: work(model, options), draw=lambda found: found.figure(view))
