"""`rotorid bearings`: equilibrium of a rotor in its journal bearings."""

from __future__ import annotations

import dataclasses
from pathlib import Path

from rotorid.commands.app import TABLES, Destination, RotorArgument, command
from rotorid.workflows.motion.bearings import BearingsOptions
from rotorid.workflows.motion.bearings import bearings as work


@command(BearingsOptions)
def bearings(rotor: RotorArgument, options: BearingsOptions, to: Destination) -> None:
    """Static equilibrium in journal bearings over speed, linear coefficients, stability.

    --output FILE.toml writes the rotor with bearing tables over speed, which critical, campbell, response
    and reduce read.

    Example: rotorid bearings sample_data/motion/rotor.toml --speeds 1000:9000:250rpm

    Example: rotorid bearings sample_data/motion/rotor.toml --speeds 600:9000:100rpm --output linear.toml
    --plot bearings.png
    """
    dataclasses.replace(to, output=None).deliver(
        "equilibrium",
        lambda: work(rotor, options),
        more=((to.output, (*TABLES, ".toml"), lambda found: found.files(to.output or Path())),),
    )
