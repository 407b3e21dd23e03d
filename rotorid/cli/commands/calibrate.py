"""`rotorid calibrate`: numbers of a rotor file from what the machine tells."""

from __future__ import annotations

import dataclasses
from pathlib import Path
from typing import Annotated

import typer

from rotorid.commands.app import TABLES, Destination, RotorArgument, command
from rotorid.commands.calibrate import CalibrateOptions
from rotorid.commands.calibrate import calibrate as work


@command(CalibrateOptions)
def calibrate(
    rotor: RotorArgument,
    data: Annotated[
        list[Path],
        typer.Argument(
            metavar="DATA",
            help="Jobs with trial runs (.toml, .xlsx), tables of critical speeds, frequencies or modes.",
        ),
    ],
    options: CalibrateOptions,
    to: Destination,
) -> None:
    """Numbers of a rotor file from trial runs, critical speeds and modes, with ±.

    --output FILE.toml writes the calibrated rotor with its errors: `balance` then needs one run, and
    critical, campbell and response show bands.

    Example: rotorid calibrate sample_data/compressor/rotor.toml sample_data/calibration/trial.toml
    --estimate "bearing[*].*" --prior "bearing[*].*=20%" --output calibrated.toml
    """
    dataclasses.replace(to, output=None).deliver(
        "calibration",
        lambda: dataclasses.replace(work(rotor, data, options), written=to.output),
        more=((to.output, (*TABLES, ".toml"), lambda result: result.files(to.output or Path())),),
    )
