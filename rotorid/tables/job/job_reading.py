"""A job read in one pass: its keys, then readings, model, planes, limits, holes, check runs."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path

from balancing import Labels
from rotorid.files.columns import Source
from rotorid.files.layout import files_of_runs
from rotorid.files.problems import Problems
from rotorid.files.settings_keys import take
from rotorid.files.toml_file import Section
from rotorid.tables.job.assumed_conventions import with_assumed
from rotorid.tables.job.check_runs import holes_taken, read_check
from rotorid.tables.job.job_data import Job, Overrides
from rotorid.tables.job.job_holes import read_holes
from rotorid.tables.job.job_keys import JOB, TABLES, WEIGHTS, named_tables
from rotorid.tables.job.job_limits import read_limits
from rotorid.tables.job.job_model import read_model
from rotorid.tables.job.job_planes import read_planes
from rotorid.tables.job.job_waveforms import with_vectors
from rotorid.tables.job.readings import read_readings


def job_of(
    path: Path | None, top: Section, sheets: Mapping[str, Source], overrides: Overrides, problems: Problems
) -> Job:
    """The job of these settings.

    Parameters
    ----------
    path
        The job, from which its files are named; None without one.
    top
        All its settings.
    sheets
        Tables that are there already, by the key of a job file that names such a table.
    overrides
        What the caller says instead.
    problems
        Collects the complaints.

    Raises
    ------
    InputError
        With all problems.
    """
    said = take(top, JOB)
    folder = Path() if path is None else path.parent
    named = {key: folder / name for key, name in named_tables({key: said[key] for key in TABLES}).items()}
    tables: dict[str, Source] = {**named, **sheets}
    runs = said["runs"]
    files = tuple(folder / name for name in runs) if isinstance(runs, tuple) else ()
    files = files or files_of_runs(tables.get("runs"))
    if files:
        tables["runs"] = files
    if overrides.waveforms is not None:
        tables["runs"] = Path(overrides.waveforms)
    overrides, records = with_vectors(tables, overrides, said["phase"], problems)
    readings = read_readings(said, tables, overrides, problems)
    labels = Labels() if readings is None else readings.conventions.labels
    model = read_model(said, folder, labels, problems)
    if readings is None:
        read_holes(said, None, (), None)
        problems.stop()
        raise AssertionError("no readings and no problem")
    planes = read_planes(said, readings, model, problems)
    limits, row_weights = read_limits(said, planes)
    holes = read_holes(said, planes.trials.labels, planes.names, limits)
    check = None
    if "check" in tables:
        check = read_check(tables, readings, planes, problems)
    if check is not None and "check_weights" in tables:
        holes = holes_taken(tables["check_weights"], check, readings, holes)
    problems.stop()
    first = [tables.get(key) for key in ("runs", "weights", "influence")]
    records = (*files, *records)
    more = [tables.get(key) for key in ("check", "check_weights", "slow_roll")]
    read = [path, *first, *model.files, *more]
    phasor = said["key_phasor"]["angle_deg"] if said["key_phasor"] else 0.0
    angles = {name: sensor["angle_deg"] for name, sensor in said["sensors"].items()}
    return with_assumed(
        Job(
            trials=planes.trials,
            influence=readings.influence,
            conventions=readings.conventions,
            files=(*(file for file in read if isinstance(file, Path)), *records),
            planes=planes.names,
            limits=limits,
            row_weights=row_weights,
            left_out=planes.left_out,
            check=check,
            check_mounted=check is not None and "check_weights" in tables,
            check_of_weights=said["check_weights"] == WEIGHTS and "check_weights" not in tables,
            rotor=model.rotor,
            plane_nodes=model.plane_nodes,
            sensor_places=model.sensor_places,
            sensor_angles={
                name: labels.with_rotation(angle) for name, angle in angles.items() if angle is not None
            },
            radii=planes.radii,
            holes=holes,
            remove=planes.remove,
            trial_radii=planes.trial_radii,
            slow_roll=None if readings.slow_roll is None else readings.slow_roll.vectors,
            key_phasor=labels.with_rotation(phasor),
            machine=said["machine"],
            machine_type=said["machine_type"],
            date=said["date"],
            sheet=said["sheet"] or {},
        )
    )
