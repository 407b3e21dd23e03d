"""Jobs: the files of one balancing job, with its conventions and stated errors."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from balancing.influence import Influence
from balancing.limits import Limits
from balancing.trials import Trials
from rotorid.tables.conventions import DEFAULT_TOLERANCE, Conventions, as_angles, as_phase
from rotorid.tables.grid import Grid
from rotorid.tables.influence import fit_to_readings, load_influence
from rotorid.tables.jobbook import read_job_book
from rotorid.tables.jobkeys import COLUMNS, PlaneKeys, SensorKeys, read_plane, read_sensor
from rotorid.tables.joblimits import make_limits, make_row_weights
from rotorid.tables.jobmodel import (
    Model,
    collect,
    complain_about_places,
    read_check,
    read_model,
    weight_unit_without_weights,
)
from rotorid.tables.jobsettings import (
    Extra,
    Overrides,
    Settings,
    file_of,
    read_extra,
    read_settings,
    settle_conventions,
)
from rotorid.tables.problems import InputError, Problems, did_you_mean, listing
from rotorid.tables.sheet import is_workbook
from rotorid.tables.tomlfile import Section, read_toml
from rotorid.tables.trials import make_trials

if TYPE_CHECKING:
    from fem.rotor import Rotor
    from fem.sensors import Sensor


@dataclass(frozen=True, eq=False)
class Job:
    """One balancing job, read completely.

    Attributes
    ----------
    trials
        Readings and mounted weights.
    influence
        Stored coefficients for the speeds and sensors of the readings, in their order, or None.
    conventions
        Of phases, angles and speeds.
    files
        All files that were read, for the provenance of a result.
    planes
        Names (P,): those of stored coefficients or else of the weights, then planes that only the rotor
        model knows (named in the job, with a node).
    limits
        In SI with the rotation, in the order of `trials.speeds`, `trials.sensors` and `planes`; None: none.
    row_weights
        Of each reading in the fit, shape (S, C): the speed's times the sensor's; None where all are 1.
    left_out
        Planes that the job tells not to use.
    check
        Check runs, in the units and at the speeds of the job, or None.
    check_mounted
        Whether `check.weights` say what was mounted in the check runs; else the proposed corrections were.
    rotor
        The model that the job names, or None.
    plane_nodes
        Node of each plane that has one in the model.
    sensor_places
        Node and direction (degrees with the rotation from the model's x) of each sensor that has a node.
    radii
        Radius, m, of each plane that has one: it converts between masses and unbalances.
    """

    trials: Trials
    influence: Influence | None
    conventions: Conventions
    files: tuple[Path, ...]
    planes: tuple[str, ...] = ()
    limits: Limits | None = None
    row_weights: NDArray[np.float64] | None = None
    left_out: tuple[str, ...] = ()
    check: Trials | None = None
    check_mounted: bool = False
    rotor: Rotor | None = None
    plane_nodes: Mapping[str, int] = field(default_factory=dict)
    sensor_places: Mapping[str, Sensor] = field(default_factory=dict)
    radii: Mapping[str, float] = field(default_factory=dict)

    @property
    def used(self) -> tuple[str, ...]:
        """Planes that are not left out."""
        return tuple(p for p in self.planes if p not in self.left_out)

    def limits_of(self, planes: Sequence[str]) -> Limits | None:
        """Limits of these planes only, in their order, at all speeds."""
        if self.limits is None:
            return None
        return self.limits.pick(range(len(self.trials.speeds)), [self.planes.index(p) for p in planes])


def read_job(
    path: str | Path,
    *,
    phase: str | None = None,
    angles: str | None = None,
    amplitude_error_percent: float | None = None,
    phase_error_deg: float | None = None,
) -> Job:
    """Read a job file (`.toml`) or a workbook (`.xlsx`, sheets runs, weights, planes, sensors, settings).

    Parameters
    ----------
    path
        The job; files that it names are found relative to it.
    phase, angles, amplitude_error_percent, phase_error_deg
        Replace what the job says.

    Returns
    -------
    Job
        In SI, phase lead, angles with the rotation, and labels to print in.

    Raises
    ------
    InputError
        With all problems of all files of the job.
    ValueError
        If an argument is none of the allowed values.
    """
    path = Path(path)
    problems = Problems()
    overrides = Overrides(phase, angles, amplitude_error_percent, phase_error_deg)
    if is_workbook(path):
        book = read_job_book(path, COLUMNS, problems)
        if book is None:
            problems.stop()
            raise AssertionError
        top = Section(str(path), book.settings, problems, where=book.where)
        runs: Path | Grid | None = book.runs
        weights: Path | Grid | None = book.weights
        if "runs" in top or "weights" in top:
            for key in ("runs", "weights"):
                if top.take(key) is not None:
                    top.complain(key, f"the table in the sheet {key!r} of this workbook, not a file")
    elif path.suffix.lower() == ".toml":
        data = read_toml(path, problems)
        problems.stop()
        top = Section(str(path), data or {}, problems)
        runs, weights = file_of(top, "runs", path), file_of(top, "weights", path)
        if "runs" not in top:
            top.missing("runs", 'the runs table, runs = "runs.csv"')
    else:
        expected = "a job: a .toml file, or an .xlsx workbook with sheets runs and weights"
        problems.add(str(path), None, None, None, expected)
        problems.stop()
        raise AssertionError
    influence, extra = file_of(top, "influence", path), read_extra(top, path)
    if weights is None and "weights" not in top and "influence" not in top and "rotor" not in top:
        top.missing("weights", "a weights table, or an influence table of stored coefficients, or a rotor")
    settings = read_settings(top, overrides, problems)
    unclear = len(problems) > 0
    planes = {name: read_plane(section) for name, section in top.named("planes").items()}
    sensors = {name: read_sensor(section) for name, section in top.named("sensors").items()}
    top.finish()
    if runs is None:
        problems.stop()
        raise AssertionError
    job = _read_tables(path, runs, weights, influence, settings, problems, unclear=unclear)
    sign = 1 if job is None else job.conventions.angle_sign
    model = read_model(extra.rotor, planes, sensors, sign, problems, named="rotor" in top)
    if job is not None:
        job = _completed(job, model, extra, settings, top, planes, sensors, problems)
    problems.stop()
    assert job is not None
    return job


def job_from_files(
    files: Sequence[str | Path],
    *,
    influence: str | Path | None = None,
    phase: str | None = None,
    angles: str | None = None,
    amplitude_error_percent: float | None = None,
    phase_error_deg: float | None = None,
) -> Job:
    """A job without a job file: a runs table with a weights table, or with stored coefficients.

    Parameters
    ----------
    files
        Runs and weights; with `influence` the weights (mounted during the runs) may be left out.
    influence
        Influence table.
    phase, angles, amplitude_error_percent, phase_error_deg
        Conventions and stated errors; default: lead, with rotation, none stated.

    Returns
    -------
    Job
        As of `read_job`.

    Raises
    ------
    InputError
        With all problems of all files.
    ValueError
        If the files are too few or too many, or an argument is none of the allowed values.
    """
    if not 1 <= len(files) <= 2 or (len(files) == 1 and influence is None):
        raise ValueError(
            "give a job (.toml or .xlsx), or a runs table and a weights table, or a runs table and "
            f"--influence with an influence table; got {len(files)} file{'s' if len(files) != 1 else ''}"
        )
    problems = Problems()
    paths = [Path(file) for file in files]
    overrides = Overrides(phase, angles, amplitude_error_percent, phase_error_deg)
    settings = Settings(
        as_phase(phase) if phase else None,
        as_angles(angles) if angles else None,
        DEFAULT_TOLERANCE,
        overrides.errors(None),
    )
    stored = None if influence is None else Path(influence)
    job = _assemble(None, paths[0], paths[1] if len(paths) == 2 else None, stored, settings, problems)
    problems.stop()
    assert job is not None
    return job


def _completed(
    job: Job,
    model: Model,
    extra: Extra,
    settings: Settings,
    top: Section,
    plane_keys: Mapping[str, PlaneKeys],
    sensor_keys: Mapping[str, SensorKeys],
    problems: Problems,
) -> Job:
    """The job with limits, weights, model and check runs; problems are noted."""
    trials = job.trials
    radii = {name: keys.radius for name, keys in plane_keys.items() if keys.radius is not None}
    planes = (*job.planes, *(name for name in model.plane_nodes if name not in job.planes))
    if not job.planes and model.rotor is not None:
        complain_about_places(trials.sensors, model, top, plane_keys)
        trials = weight_unit_without_weights(trials, planes, radii)
    if planes:
        _complain_about_names(top.source, "planes", tuple(plane_keys), planes, problems)
    _complain_about_names(top.source, "sensors", tuple(sensor_keys), trials.sensors, problems)
    left_out = tuple(name for name in planes if name in plane_keys and not plane_keys[name].use)
    if planes and len(left_out) == len(planes):
        top.complain("planes", "at least one plane without use = false", value=False)
    tolerance = settings.speed_tolerance_percent
    limits = make_limits(trials, planes, plane_keys, sensor_keys, tolerance)
    row_weights = make_row_weights(trials, sensor_keys, top, extra.speed_weights, tolerance)
    check = None
    if extra.check is not None:
        tables, known = (extra.check, extra.check_weights), job.conventions
        check = read_check(*tables, known, settings.errors, trials, planes, problems)
    more = (*model.files, *(file for file in (extra.check, extra.check_weights) if file is not None))
    return replace(
        job,
        trials=trials,
        files=job.files + more,
        planes=planes,
        limits=limits,
        row_weights=row_weights,
        left_out=left_out,
        check=check,
        check_mounted=check is not None and extra.check_weights is not None,
        rotor=model.rotor,
        plane_nodes=model.plane_nodes,
        sensor_places=model.sensor_places,
        radii=radii,
    )


def _complain_about_names(
    source: str, key: str, named: Sequence[str], known: Sequence[str], problems: Problems
) -> None:
    for name in named:
        if name not in known:
            expected = f"one of the job's {key}, {listing(known, 'and')}{did_you_mean(name, known)}"
            problems.add(source, None, f"{key}.{name}", name, expected)


def _read_tables(
    job: Path,
    runs: Path | Grid,
    weights: Path | Grid | None,
    stored: Path | None,
    settings: Settings,
    problems: Problems,
    *,
    unclear: bool,
) -> Job | None:
    """`_assemble`, also where planes or sensors have problems, unless the conventions are unclear."""
    own = problems if unclear else Problems()
    read = _assemble(job, runs, weights, stored, settings, own)
    try:
        if not unclear:
            own.stop()
    except InputError as error:
        collect(error, problems)
    return read


def _assemble(
    job: Path | None,
    runs: Path | Grid,
    weights: Path | Grid | None,
    stored: Path | None,
    settings: Settings,
    problems: Problems,
) -> Job | None:
    found = None
    if stored is not None:
        found = load_influence(stored, settings.phase, settings.angles, problems)
    conventions, notes = settle_conventions(settings, stored, found)
    trials = make_trials(runs, weights, conventions, settings.errors, problems)
    influence = None
    if found is not None and trials is not None:
        tolerance = conventions.speed_tolerance_percent
        influence = fit_to_readings(found.influence, trials, tolerance, str(stored), problems)
    if influence is not None and trials is not None:
        trials = replace(trials, labels=influence.labels)
    if trials is None or len(problems):
        return None
    trials = replace(trials, warnings=notes + trials.warnings)
    read = (job, runs, weights, stored)
    files = tuple(file for file in read if isinstance(file, Path))
    planes = trials.planes if influence is None else influence.planes
    return Job(trials, influence, conventions, files, planes)
