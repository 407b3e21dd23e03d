"""Jobs: readings, weights, planes and sensors of one balancing job, from its files and settings."""

from __future__ import annotations

import datetime
import math
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from balancing import Holes, Influence, Labels, Limits, Trials
from fem import Sensor as Probe
from rotorid.base.arrays import ComplexArray, FloatArray
from rotorid.base.complex_numbers import off_axis
from rotorid.base.text import counted
from rotorid.files.columns import Source, source_name
from rotorid.files.conventions import (
    ROTATIONS,
    Conventions,
    as_angles,
    as_phase,
    check_angles,
    resolve_angles,
)
from rotorid.files.influence import Stored, fit_to_readings, load_influence
from rotorid.files.job_excel import WrittenJob, open_job
from rotorid.files.job_models import (
    READINGS,
    TABLES,
    WEIGHTS,
    Errors,
    JobSettings,
    Plane,
    Sensor,
    named_tables,
)
from rotorid.files.job_planes import (
    Readings,
    check_runs,
    in_model,
    make_holes,
    make_limits,
    planes_of,
    row_weights,
    with_taken,
)
from rotorid.files.layout import files_of_runs, stated_phase
from rotorid.files.problems import Problems
from rotorid.files.runs import make_trials
from rotorid.files.slow_roll import make_slow_roll, subtract_slow_roll
from rotorid.files.units import Quantity
from rotorid.files.weights_with_units import in_job_units

if TYPE_CHECKING:
    from balancing import Mounted
    from fem import Rotor

IN_HOLE = 1e-3
"""Relative distance of a weight from the hole that it is in."""
Arc = tuple[float, float]


@dataclass(frozen=True)
class Overrides:
    """What the caller says instead of a job, or where none says it.

    Raises
    ------
    ValueError
        If a value is none of the allowed ones.
    """

    phase: str | None = None
    angles: str | None = None
    amplitude_error_percent: float | None = None
    phase_error_deg: float | None = None
    run_error_percent: float | None = None
    waveforms: str | Path | None = None

    def __post_init__(self) -> None:
        Labels(phase=as_phase(self.phase or "lead"))
        if self.angles is not None:
            check_angles(self.angles)
        self.on(None)

    def on(self, stated: Errors | None) -> Errors | None:
        """The errors of a job with those that the caller states."""
        given = {
            "amplitude_percent": self.amplitude_error_percent,
            "phase_deg": self.phase_error_deg,
            "run_percent": self.run_error_percent,
        }
        ours = {key: value for key, value in given.items() if value is not None}
        for key, value in ours.items():
            if not 0 <= value < math.inf:
                raise ValueError(f"{key} must be finite and not negative, not {value!r}")
        return (stated or Errors.model_construct()).model_copy(update=ours) if ours else stated


@dataclass(frozen=True)
class JobSource:
    """What a job is read from: a job (`.toml`, `.xlsx`), or runs and, perhaps, weights; influence table."""

    files: tuple[Path, ...]
    influence: Path | None = None
    overrides: Overrides = field(default_factory=Overrides)


@dataclass(frozen=True, eq=False)
class Job:
    """One balancing job, read completely.

    Attributes
    ----------
    trials
        Readings and mounted weights, these at the correction radius of their planes.
    influence
        Stored coefficients for the speeds and sensors of the readings, in their order, or None.
    conventions
        Of phases, angles and speeds.
    files
        All files that were read, for the provenance of a result.
    planes
        By name, what the job says of each (P): those of stored coefficients or else of the weights, then
        those that only the rotor model knows. A `node` is a number; lengths in m, angles as the job counts.
    sensors
        The same for each sensor of the readings (C).
    limits
        In SI with the rotation, in the order of `trials.speeds`, `trials.sensors` and `planes`; None: none.
    row_weights
        Of each reading in the fit, shape (S, C): the speed's times the sensor's; None where all are 1.
    check
        Check runs, in the units and at the speeds of the job, or None.
    check_mounted
        Whether `check.weights` are those of a table; else what was proposed is taken to have been mounted.
    check_of_weights
        Whether these were the weights, although there are holes for pieces.
    check_pieces
        The pieces that `check.weights` are then, by `rotorid.commands.after_check`; None: others.
    rotor
        The model that the job names, or None.
    holes
        What can be mounted in each plane that says so, in the unit of the weights; where material is removed
        their angles are those of the equivalent added weights (180° from the hole).
    slow_roll
        Slow-roll vectors, (C,) for all speeds or (S, C), which are subtracted from the readings of `trials`
        and `check` already; None: none.
    key_phasor
        Its direction, degrees with the rotation from the model's x.
    machine, machine_type, date
        What was balanced, of which type, and when; empty and None where the job does not say.
    sheet
        What it says for the balancing sheet: `[sheet]`.
    """

    trials: Trials
    influence: Influence | None
    conventions: Conventions
    files: tuple[Path, ...]
    planes: dict[str, Plane] = field(default_factory=dict)
    sensors: dict[str, Sensor] = field(default_factory=dict)
    limits: Limits | None = None
    row_weights: FloatArray | None = None
    check: Trials | None = None
    check_mounted: bool = False
    check_of_weights: bool = False
    check_pieces: Mounted | None = None
    rotor: Rotor | None = None
    holes: Mapping[str, Holes] = field(default_factory=dict)
    slow_roll: ComplexArray | None = None
    key_phasor: float = 0.0
    machine: str = ""
    machine_type: str = ""
    date: datetime.date | None = None
    sheet: Mapping[str, Any] = field(default_factory=dict)

    @property
    def used(self) -> tuple[str, ...]:
        """Planes that are not left out."""
        return tuple(name for name, plane in self.planes.items() if plane.use)

    @property
    def left_out(self) -> tuple[str, ...]:
        """Planes that the job tells not to use."""
        return tuple(name for name, plane in self.planes.items() if not plane.use)

    @property
    def removed(self) -> list[str]:
        """Planes in which material is taken away."""
        return [name for name, plane in self.planes.items() if plane.remove]

    @property
    def radii(self) -> dict[str, float]:
        """Radius, m, of each plane that has one: it converts between masses and unbalances."""
        return {name: plane.radius for name, plane in self.planes.items() if plane.radius is not None}

    @property
    def trial_radii(self) -> dict[str, float]:
        """Radius, m, at which the weights of the weights table were mounted, where it is another."""
        radii = {name: plane.trial_radius for name, plane in self.planes.items()}
        return {name: radius for name, radius in radii.items() if radius is not None}

    @property
    def plane_nodes(self) -> dict[str, int]:
        """Node of each plane that has one in the model."""
        return {name: plane.node for name, plane in self.planes.items() if plane.node is not None}

    @property
    def sensor_angles(self) -> dict[str, float]:
        """Direction of each sensor that the job states, degrees with the rotation from the model's x."""
        turn = self.conventions.labels.with_rotation
        return {name: turn(one.angle) for name, one in self.sensors.items() if one.angle is not None}

    @property
    def sensor_places(self) -> dict[str, Probe]:
        """Node and direction of each sensor that has a node."""
        angles = self.sensor_angles
        nodes = {name: one.node for name, one in self.sensors.items()}
        return {name: Probe(node, angles.get(name, 0.0)) for name, node in nodes.items() if node is not None}

    def limits_of(self, planes: Sequence[str]) -> Limits | None:
        """Limits of these planes only, in their order, at all speeds."""
        if self.limits is None:
            return None
        order = list(self.planes)
        return self.limits.pick(range(len(self.trials.speeds)), [order.index(p) for p in planes])


def read_job(path: str | Path, **overrides: Any) -> Job:  # noqa: ANN401
    """Read a job file (`.toml`) or a workbook (`.xlsx`, sheets runs, weights, planes, sensors, settings).

    Parameters
    ----------
    path
        The job; files that it names are found relative to it.
    overrides
        phase, angles, amplitude_error_percent, phase_error_deg, run_error_percent: replace what the job says;
        waveforms: a waveforms file, in place of the runs table.

    Returns
    -------
    Job
        In SI, phase lead, angles with the rotation, and labels to print in.

    Raises
    ------
    InputError
        With all problems of the job, else with all problems of the files that it names.
    ValueError
        If an argument is none of the allowed values.
    """
    given, problems = Overrides(**overrides), Problems()
    return job_of(open_job(Path(path), problems), given, problems)


def job_from_files(
    files: Sequence[str | Path],
    *,
    influence: str | Path | None = None,
    **overrides: Any,  # noqa: ANN401
) -> Job:
    """A job without a job file: a runs table with a weights table, or with stored coefficients.

    Parameters
    ----------
    files
        Runs and weights; with `influence` the weights (mounted during the runs) may be left out.
    influence
        Influence table.
    overrides
        Conventions, stated errors and waveforms as of `read_job`; default: lead and with rotation, which the
        labels then call assumed; none stated.

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
            f"--influence with an influence table; got {counted(len(files), 'file')}"
        )
    tables: dict[str, Source] = dict(zip(("runs", "weights"), map(Path, files), strict=False))
    if influence is not None:
        tables["influence"] = Path(influence)
    return job_of(WrittenJob(None, tables=tables), Overrides(**overrides), Problems())


def job_of(written: WrittenJob, overrides: Overrides, problems: Problems) -> Job:
    """The job of these settings and tables; raises `InputError` with all problems."""
    settings = written.read(problems)
    problems.stop()
    tables, records = tables_of(written, settings)
    if overrides.waveforms is not None:
        tables["runs"] = Path(overrides.waveforms)
    # vectors know their sign, so that nothing is assumed: a job that says nothing writes lead
    phase = overrides.phase or settings.phase
    for key in READINGS:
        path = tables.get(key)
        if isinstance(path, Path) and path.suffix.lower() == ".toml":
            from rotorid.files.waveforms import read_vectors_grid

            grid, phase, read = read_vectors_grid(path, phase)
            tables[key], records = grid, (*records, *read)
            overrides = replace(overrides, phase=phase)
    readings = _readings(settings, tables, overrides, problems)
    settings, rotor, model_files = in_model(settings, written.folder, problems)
    readings = problems.need(readings)
    trials, planes = planes_of(settings, readings.trials, readings.influence, rotor, problems)
    limits = make_limits(settings, planes, trials, problems)
    weights = row_weights(settings, trials, problems)
    holes = make_holes(planes, trials.labels, limits, problems)
    check = check_runs(tables, readings, trials, tuple(planes), problems) if "check" in tables else None
    mounted = tables.get("check_weights")
    if check is not None and mounted is not None:
        holes = with_taken(holes, mounted, check, readings.conventions)
    problems.stop()
    order = ("runs", "weights", "influence"), ("check", "check_weights", "slow_roll")
    first, last = ([tables.get(key) for key in keys] for keys in order)
    files = (written.path, *first, *model_files, *last, *records)
    job = Job(
        trials=trials,
        influence=readings.influence,
        conventions=readings.conventions,
        files=tuple(file for file in files if isinstance(file, Path)),
        planes=planes,
        sensors={name: settings.sensors.get(name, Sensor()) for name in trials.sensors},
        limits=limits,
        row_weights=weights,
        check=check,
        check_mounted=check is not None and mounted is not None,
        check_of_weights=settings.check_weights == WEIGHTS and mounted is None,
        rotor=rotor,
        holes=holes,
        slow_roll=None if readings.slow_roll is None else readings.slow_roll.vectors,
        key_phasor=trials.labels.with_rotation(settings.key_phasor.angle if settings.key_phasor else 0.0),
        machine=settings.machine,
        machine_type=settings.machine_type,
        date=settings.date,
        sheet=settings.sheet.model_dump(),
    )
    return _with_assumed(job)


def tables_of(written: WrittenJob, settings: JobSettings) -> tuple[dict[str, Source], tuple[Path, ...]]:
    """What tables there are, by `TABLES`, and the files with one run each."""
    named = named_tables({key: getattr(settings, key) for key in TABLES})
    tables: dict[str, Source] = {key: written.folder / name for key, name in named.items()}
    runs = tuple(written.folder / name for name in settings.runs or ())
    if runs:
        tables["runs"] = runs if len(runs) > 1 else runs[0]
    tables |= written.tables
    files = runs if len(runs) > 1 else files_of_runs(tables.get("runs"))
    if files:
        tables["runs"] = files
    return tables, tuple(files)


def _readings(
    settings: JobSettings, tables: Mapping[str, Source], overrides: Overrides, problems: Problems
) -> Readings | None:
    """Trial runs and stored coefficients, or None and problems."""
    given = {*tables, *(key for key in (*TABLES, "rotor", "machine_type") if settings.has(key))}
    if "check_weights" in given and "check" not in given:
        expected = 'the check runs too, check = "check.csv" (in a workbook a sheet check)'
        settings.complain(problems, "check_weights", expected)
    if not given & {"weights", "influence", "rotor", "machine_type"}:
        expected = (
            "a weights table, or an influence table of stored coefficients, or a rotor; or machine_type, "
            "whose coefficients come with balance --type"
        )
        settings.complain(problems, "weights", expected)
    if "runs" not in tables:
        return None
    before = len(problems)
    errors = overrides.on(settings.errors)
    if (overrides.phase or settings.phase) is None:
        overrides = replace(overrides, phase=stated_phase(tables["runs"], settings.columns))
    stored, name = None, ""
    if "influence" in tables:
        name = source_name(tables["influence"])
        known = conventions_of(settings, overrides)
        phase, angles = (
            None if k in known.unstated else getattr(known.labels, k) for k in ("phase", "angles")
        )
        stored = load_influence(tables["influence"], phase, angles, problems)
    conventions = conventions_of(settings, overrides, {} if stored is None else stored.said)
    trials = make_trials(tables["runs"], tables.get("weights"), conventions, errors, problems)
    influence = None
    if stored is not None and trials is not None:
        tolerance = conventions.speed_tolerance_percent
        influence = fit_to_readings(stored.influence, trials, tolerance, name, problems)
    if trials is None or len(problems) > before:
        return None
    labels = conventions.on(trials.labels if influence is None else influence.labels)
    if influence is not None:
        influence = replace(influence, labels=labels)
    notes = _notes(conventions, stored, name)
    trials = replace(trials, labels=labels, warnings=notes + trials.warnings)
    vectors = tables.get("slow_roll", settings.slow_roll)
    roll = None if vectors is None else make_slow_roll(vectors, trials, conventions, problems)
    if roll is not None:
        trials = subtract_slow_roll(trials, roll)
    return Readings(trials, influence, conventions, errors, roll)


def conventions_of(
    settings: JobSettings, overrides: Overrides, stored: Mapping[str, str] | None = None
) -> Conventions:
    """What the numbers of the tables mean: as the caller says, or the job, or the stored coefficients."""
    stored, rotation = stored or {}, settings.rotation
    phase, angles = overrides.phase or settings.phase, overrides.angles or settings.angles
    clock = angles in ROTATIONS and rotation is not None
    if angles is not None:
        angles = resolve_angles(angles, rotation)
    labels = Labels(
        phase=as_phase(phase or stored.get("phase", "lead")),
        angles=as_angles(angles or stored.get("angles", "with rotation")),
        rotation=rotation,
        view=settings.view if rotation else None,
        clock=clock,
    )
    speed, planes = settings.speed, settings.planes.items()
    return Conventions(
        labels,
        settings.speed_tolerance_percent,
        tuple(key for key, word in (("phase", phase), ("angles", angles)) if word is None),
        settings.columns,
        None if speed is None else (speed.unit.name, speed.value),
        {name: holes for name, plane in planes if (holes := plane.hole_angles())},
        frozenset(name for name, plane in planes if plane.remove),
        any(
            one.limit is not None and one.limit.unit.name.endswith("_rms")
            for one in settings.sensors.values()
        ),
    )


def _notes(conventions: Conventions, stored: Stored | None, name: str) -> tuple[str, ...]:
    """What the user should know about conventions that the coefficients state, or state otherwise."""
    phase, angles, unstated = conventions.labels.phase, conventions.labels.angles, conventions.unstated
    adopted = []
    if "phase" in unstated and phase != "lead":
        adopted.append(f"phase = {phase}")
    if "angles" in unstated and angles != "with rotation":
        adopted.append(f"angles {angles}")
    notes = []
    if adopted:
        notes.append(
            f"nothing states the conventions of the readings: those of {name} are used for them too, "
            f"{' and '.join(adopted)}"
        )
    if stored is not None and stored.said.get("phase", phase) != phase:
        notes.append(
            f"the readings are taken with phase = {phase}, as stated, and the coefficients with "
            f"phase = {stored.said['phase']}, as {name} says"
        )
    return tuple(notes)


def _with_assumed(job: Job) -> Job:
    """The job whose labels name what is assumed.

    Phases always matter. The direction of angles matters as soon as the job writes an angle other than 0° and
    180°: of a weight, a hole, a forbidden arc, or of a sensor or key phasor of the model.
    """
    matters = {"phase": True, "angles": any(off_axis(unit) for unit in _directions(job))}
    assumed = tuple(name for name in job.conventions.unstated if matters[name])
    if not assumed:
        return job
    labels = replace(job.trials.labels, assumed=assumed)
    parts = {name: getattr(job, name) for name in ("trials", "influence", "check")}
    return replace(job, **{k: replace(one, labels=labels) for k, one in parts.items() if one is not None})


def _directions(job: Job) -> Iterator[ComplexArray]:
    """Whatever the job writes with an angle, as complex numbers."""
    yield job.trials.weights
    if job.check is not None:
        yield job.check.weights
    for holes in job.holes.values():
        yield np.exp(1j * holes.angles)
    for arcs in () if job.limits is None else job.limits.forbidden:
        yield np.exp(1j * np.array([end for start, width in arcs for end in (start, start + width)]))
    if job.rotor is not None:
        yield np.exp(1j * np.radians([job.key_phasor, *job.sensor_angles.values()]))


def with_limits(job: Job, weights: Mapping[str, Quantity], amplitudes: Mapping[str, Quantity]) -> Job:
    """The job with other limits, each in place of what the job itself says there.

    Parameters
    ----------
    job
        As read.
    weights
        Largest weights by plane; a mass where the job's weights are unbalances (or the reverse) needs the
        plane's `radius_mm`. The key is what complaints begin with.
    amplitudes
        Largest amplitudes by sensor, at all speeds.

    Returns
    -------
    Job
        With new `limits`; holes keep to the largest weight of their plane.

    Raises
    ------
    ValueError
        For a weight that does not convert to those of the job.
    """
    if not weights and not amplitudes:
        return job
    trials, unit, planes = job.trials, job.trials.labels.weight_unit, list(job.planes)
    old = job.limits or Limits.none(len(trials.speeds), len(trials.sensors), len(planes))
    most, residual = old.max_weight.copy(), old.residual.copy()
    for plane, weight in weights.items():
        size = in_job_units(weight, unit, job.planes[plane].radius)
        if size is None:
            raise ValueError(
                f"{weight.key}: the weights of the job are in {unit}, to which {weight.unit.name} converts "
                f"only with a radius_mm of plane {plane!r} in the job"
            )
        most[planes.index(plane)] = size[0]
    for sensor, amplitude in amplitudes.items():
        residual[:, trials.sensors.index(sensor)] = amplitude.si
    holes = {p: replace(its, max_weight=float(most[planes.index(p)])) for p, its in job.holes.items()}
    return replace(job, limits=Limits(most, residual, old.forbidden), holes=holes)
