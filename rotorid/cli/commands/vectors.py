"""`rotorid vectors`: 1× and other orders of waveforms, as a runs table."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from rotorid.commands.app import OUTPUT, Destination, command
from rotorid.workflows.vibration.vectors import VectorsOptions
from rotorid.workflows.vibration.vectors import vectors as work


@command(
    VectorsOptions,
    panels={
        "Input": "tacho sensors unit amplitude phase",
        "Tacho": "pulses edge rate",
        "Vectors": "orders speeds",
        OUTPUT: "picture",
    },
)
def vectors(
    records: Annotated[
        list[Path],
        typer.Argument(
            metavar="RECORD…",
            help="Records, .csv, .wav, .mat, .npz, .uff or .tdms, a run each; or one waveforms file (.toml).",
        ),
    ],
    options: VectorsOptions,
    to: Destination,
) -> None:
    """1× and other orders of waveforms with a tacho, with ±: the runs table of `balance`.

    Example: rotorid vectors sample_data/waveforms/waveforms.toml --output runs.csv
    """
    to.deliver("vectors", lambda: work(records, options))
