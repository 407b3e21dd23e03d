"""`rotorid study`: many drawn machines, or starts of a calibration."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from rotorid.commands.app import Destination, command
from rotorid.workflows.studies.study import StudyOptions
from rotorid.workflows.studies.study import study as work


@command(StudyOptions, least={"samples": 1, "seed": 0, "workers": 1}, panels={"Work": "workers results"})
def study(
    file: Annotated[Path, typer.Argument(metavar="STUDY", help="Study file (.toml).")],
    options: StudyOptions,
    to: Destination,
) -> None:
    """Chance that a machine meets its limit, as built and balanced, by simulation.

    A study that was broken off is continued by the same command with --results; the samples do not
    depend on the workers. In Python it runs on any executor, such as that of a Dask cluster.

    Example: rotorid study sample_data/study/study.toml --samples 50
    """
    to.deliver("study", lambda: work(file, options))
