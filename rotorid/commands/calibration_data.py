"""Data of a calibration, from files: jobs with runs, critical speeds, natural frequencies with shapes."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from rotorid.base.text import counted
from rotorid.calibration import MeasuredFrequencies, RunReadings
from rotorid.commands.model_places import model_places

if TYPE_CHECKING:
    from fem import Rotor
    from rotorid.tables import Job


def read_data(
    files: Sequence[Path], rotor: Rotor, unbalance: Sequence[int], bow: int
) -> tuple[list[RunReadings], list[MeasuredFrequencies], list[Path], list[str]]:
    """Readings and frequencies of these files, all files that were read, and what was assumed.

    Parameters
    ----------
    files
        Jobs (.toml, or a workbook), tables of critical speeds or natural frequencies, tables of modes.
    rotor
        Knows the nodes.
    unbalance, bow
        As `RunReadings`, of all jobs.
    """
    from rotorid.tables import read_job
    from rotorid.tables.data.frequency_table import is_job, read_frequencies

    readings, frequencies, read, assumed = [], [], list[Path](), list[str]()
    for file in files:
        if is_job(file):
            job = read_job(file)
            try:
                readings.append(run_readings(job, rotor, unbalance, bow))
            except ValueError as error:
                raise ValueError(f"{file.name}: {error}") from None
            read += job.files
        else:
            table = read_frequencies(file, rotor)
            frequencies.append(table.data)
            read.append(file)
            assumed += [f"{file.name}: {each}" for each in table.assumed]
    return readings, frequencies, read, assumed


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
