"""`rotorid trial-weight`: the first trial weight of a plane."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from rotorid.commands.app import Destination, command
from rotorid.workflows.trial_weight import TrialWeightOptions
from rotorid.workflows.trial_weight import trial_weight as work


@command(
    TrialWeightOptions,
    least={"carried_by": 1},
    panels={
        "Input": "rotor_mass speed radius bearing_load carried_by",
        "Weight": "fraction share mass max_mass plane",
        "Angle": "reading_phase lag critical damping sensor_angle key_phasor measures",
        "Conventions": "phase angles unit",
    },
)
def trial_weight(
    job: Annotated[
        Path | None,
        typer.Argument(
            metavar="JOB",
            help="Job (.toml, .xlsx) with coefficients, a rotor or trial runs: they give amount and angle.",
        ),
    ] = None,
    *,
    options: TrialWeightOptions,
    to: Destination,
) -> None:
    """A first trial weight: how heavy, and at which angle.

    Example: rotorid trial-weight --rotor-mass 500kg --speed 3000rpm --radius 200mm --fraction 10

    Example: rotorid trial-weight --bearing-load 9kN --speed 50Hz --radius 8in --reading-phase 120 --lag below

    Example: rotorid trial-weight sample_data/model_job/job.toml --plane middle
    """
    to.deliver("trial weight", lambda: work(job, options))
