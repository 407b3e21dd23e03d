"""`rotorid influence`: influence coefficients of a rotor model."""

from __future__ import annotations

from rotorid.cli.common_options import RotorArgument, command
from rotorid.cli.output import Destination
from rotorid.workflows.influence import InfluenceOptions
from rotorid.workflows.influence import influence as work


@command(InfluenceOptions)
def influence(rotor: RotorArgument, options: InfluenceOptions, to: Destination) -> None:
    """Vibration at sensors per unit unbalance at planes, over speeds.

    The table that --output writes is the stored-coefficients file that `rotorid balance --influence` reads.

    Example: rotorid influence sample_data/rotor23.csv --planes 7,12 --sensors 2:45,22:45 --speeds 100,120
    """
    to.deliver("influence coefficients", lambda: work(rotor, options))
