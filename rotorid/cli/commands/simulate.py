"""`rotorid simulate`: what a model with given parameters would show, as a table to identify from."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from rotorid.commands.app import Destination, command
from rotorid.workflows.simulate import SimulateOptions
from rotorid.workflows.simulate import simulate as work


@command(
    SimulateOptions,
    names={"parameters": ["--with"]},
    least={"digits": 1, "seed": 0},
    panels={"As if read": "digits amplitude_error phase_error sigma seed"},
    to=("output", "table", "json"),
)
def simulate(
    model: Annotated[Path, typer.Argument(metavar="MODEL.toml", help="A model file of identify or fit.")],
    options: SimulateOptions,
    to: Destination,
) -> None:
    """The direct problem: amplitudes, modes or a record, as identify and fit read them.

    Example: rotorid simulate sample_data/identify/task_5_1/model.toml --with c=1000,alpha=10
    --frequencies 10,20,30 --inputs F=10 --digits 2

    A record with errors:

    Example: rotorid simulate sample_data/fit/three_masses/model.toml --with c1=0.14,m1=12,m2=28
    --times 0:50:0.2 --sigma 0.01 --seed 1
    """
    to.deliver("simulation", lambda: work(model, options))
