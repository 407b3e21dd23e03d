"""`rotorid tolerance`: permissible residual unbalance by ISO 21940-11."""

from __future__ import annotations

from rotorid.commands.app import Destination, command
from rotorid.workflows.tolerance import ToleranceOptions
from rotorid.workflows.tolerance import tolerance as work


@command(ToleranceOptions)
def tolerance(options: ToleranceOptions, to: Destination) -> None:
    """Permissible residual unbalance of a rigid rotor (ISO 21940-11), plane by plane.

    Positions count along the shaft from any point. Two planes without positions share it in equal parts.

    Example: rotorid tolerance --mass 500kg --speed 3000rpm --grade G2.5

    Example: rotorid tolerance --mass 500kg --speed 3000rpm --grade G2.5
    --planes left=100mm,right=600mm --bearings 0mm,700mm --centre 320mm --plot tolerance.png
    """
    to.deliver("tolerance", lambda: work(options))
