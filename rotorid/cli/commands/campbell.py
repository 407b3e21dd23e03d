"""`rotorid campbell`: whirl frequencies, logarithmic decrements and damped critical speeds."""

from __future__ import annotations

from rotorid.cli.common_options import RotorArgument, command
from rotorid.cli.output import Destination
from rotorid.workflows.campbell import CampbellOptions
from rotorid.workflows.campbell import campbell as work


@command(CampbellOptions, names={"number": ("-n", "--number")}, least={"number": 1})
def campbell(rotor: RotorArgument, options: CampbellOptions, to: Destination) -> None:
    """Whirl frequencies, decrements and directions over speed; damped critical speeds.

    The picture is a Campbell diagram with the 1× line, over the logarithmic decrements.

    Example: rotorid campbell sample_data/compressor/rotor.toml --speeds 1000:15000:250rpm --plot campbell.png
    """
    to.deliver("whirl", lambda: work(rotor, options))
