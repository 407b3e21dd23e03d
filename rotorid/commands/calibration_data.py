"""Data of a calibration, from files: jobs with runs."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from rotorid.base.text import counted
from rotorid.calibration import RunReadings
from rotorid.commands.model_places import model_places

if TYPE_CHECKING:
    from fem import Rotor
    from rotorid.tables import Job


def read_data(
    files: Sequence[Path], rotor: Rotor, unbalance: Sequence[int], bow: int
) -> tuple[list[RunReadings], list[Path]]:
    """Readings of these jobs (.toml, or a workbook), and all files that were read."""
    from rotorid.tables import read_job

    readings, read = [], list[Path]()
    for file in files:
        job = read_job(file)
        try:
            readings.append(run_readings(job, rotor, unbalance, bow))
        except ValueError as error:
            raise ValueError(f"{file.name}: {error}") from None
        read += job.files
    return readings, read


def run_readings(job: Job, rotor: Rotor, unbalance: Sequence[int] = (), bow: int = 0) -> RunReadings:
    """The runs of a job at their places in the model.

    Raises
    ------
    ValueError
        Where a plane or a sensor has no place in the model, or the runs say nothing of it.
    """
    trials = job.trials
    places = model_places(job)
    if job.rotor is not None and job.rotor.n_nodes != rotor.n_nodes:
        raise ValueError(
            f"the job names a rotor of {counted(job.rotor.n_nodes, 'node')}, this one has {rotor.n_nodes}: "
            "its planes and sensors would be elsewhere"
        )
    changed = bool((trials.weights != trials.weights[0]).any())
    if not (unbalance or bow or changed):
        raise ValueError(
            "these runs say nothing of the rotor: no weights change between them; runs with a trial weight "
            "are needed, or nodes at which the unbalance may stand (--unbalance-at)"
        )
    return RunReadings(
        trials,
        tuple(places.nodes[plane] for plane in trials.planes),
        np.array([1.0 if places.radii is None else places.radii[plane] for plane in trials.planes]),
        tuple(places.sensors[sensor] for sensor in trials.sensors),
        places.derivatives,
        job.key_phasor,
        tuple(unbalance),
        bow,
    )
