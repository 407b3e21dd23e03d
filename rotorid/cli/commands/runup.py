"""`rotorid runup`: critical speeds, damping and slow roll of a machine that speeds up or runs down."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from rotorid.commands.app import OUTPUT, TABLES, Destination, command
from rotorid.workflows.vibration.runup import RunUpOptions
from rotorid.workflows.vibration.runup import runup as work
from rotorid.workflows.vibration.runup_result import View


@command(RunUpOptions, panels={"Vectors at some speeds, to balance with": "speeds save_runs", OUTPUT: "view"})
def runup(
    data: Annotated[
        Path,
        typer.Argument(
            metavar="RECORD|VECTORS",
            help="A record, .wav, .mat, .npz, .uff, .tdms, or .csv with --tacho; a waveforms file (.toml); "
            "or a runs table with time_s, .csv or .xlsx: what `vectors` writes.",
        ),
    ],
    options: RunUpOptions,
    view: Annotated[View, typer.Option("--view", help="What --plot draws.")] = "bode",
    save_runs: Annotated[
        Path | None,
        typer.Option(
            "--save-runs",
            metavar="FILE",
            help="Runs table, .csv or .xlsx, of every run at --speeds, for `balance`.",
        ),
    ] = None,
    *,
    to: Destination,
) -> None:
    """Critical speeds and damping of a run-up, its acceleration in the model, with ±.

    The table of modes (--output) is for `reduce --measured` and `calibrate`, if sensors are named as nodes or
    stations of the rotor.

    Example: rotorid runup sample_data/waveforms/run_up.wav --tacho 1 --unit um --phase lag --plot bode.png
    """
    from rotorid.tables.reader.table_writing import table_bytes

    to.deliver(
        "run-up",
        lambda: work(data, options),
        draw=lambda found: found.figure(view),
        more=((save_runs, TABLES, lambda found: table_bytes(save_runs or Path(), found.runs_frame())),),
    )
