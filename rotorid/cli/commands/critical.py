"""`rotorid critical`: critical speeds and mode shapes."""

from __future__ import annotations

from rotorid.cli.common_options import WITH_REPORT, RotorArgument, command
from rotorid.cli.output import Destination
from rotorid.workflows.critical import CriticalOptions
from rotorid.workflows.critical import critical as work


@command(
    CriticalOptions,
    names={"number": ("-n", "--number"), "speed_map": ("--map",)},
    least={"number": 1},
    panels={"Method": "speed_map mesh_check"},
    to=WITH_REPORT,
)
def critical(rotor: RotorArgument, options: CriticalOptions, to: Destination) -> None:
    """Critical speeds with whirl directions, and mode shapes, of the undamped rotor.

    Damping and cross-coupling that does work are left out; `rotorid campbell` has them.

    Example: rotorid critical sample_data/rotor23.csv -n 3 --plot modes.png

    Example: rotorid critical sample_data/compressor/rotor.toml -n 4 --map --plot map.png
    """
    to.deliver("critical speeds", lambda: work(rotor, options))
