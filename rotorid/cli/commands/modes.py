"""`rotorid modes`: natural frequencies, damping and shapes from amplitudes measured around resonances."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from rotorid.commands.app import Destination, command
from rotorid.workflows.vibration.modes import ModesOptions
from rotorid.workflows.vibration.modes import modes as work


@command(ModesOptions)
def modes(
    data: Annotated[
        Path,
        typer.Argument(
            metavar="AMPLITUDES",
            help="Table, .csv or .xlsx: frequency, amplitude and phase (lead) at some points.",
        ),
    ],
    options: ModesOptions,
    to: Destination,
) -> None:
    """Natural frequencies, damping and shapes from amplitudes around resonances, with ±.

    The table of modes is for `reduce --measured`, and for `identify` in place of amplitudes.

    Example: rotorid modes sample_data/modes/amplitudes.csv --excitation force --amplitude-error 2
    --phase-error 1 --output modes.csv
    """
    to.deliver("modes", lambda: work(data, options))
