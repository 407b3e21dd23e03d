"""Jobs: readings, weights, planes and sensors of one balancing job, from its files and settings."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from balancing import (
    Groups,
    Holes,
    Influence,
    Labels,
    Limits,
    Trials,
    Unknowns,
    held,
    in_planes,
    machine_influence,
    unknowns,
)
from rotorid.base.arrays import ComplexArray, FloatArray, polar
from rotorid.base.text import counted
from rotorid.files import units
from rotorid.files.columns import Source, source_name
from rotorid.files.input_problems import InputError, Problems, refusal
from rotorid.files.job_keys import (
    READINGS,
    TABLES,
    WEIGHTS,
    Errors,
    JobSettings,
    Plane,
    Sensor,
    WrittenJob,
    named_tables,
)
from rotorid.files.job_planes import (
    in_model,
    make_holes,
    make_limits,
    make_zones,
    planes_of,
    row_weights,
    with_taken,
)
from rotorid.files.runs import make_trials
from rotorid.files.settings import read_toml
from rotorid.files.table_layouts import ROTATIONS, Conventions, files_of_runs, resolve_angles, stated_phase

if TYPE_CHECKING:
    from balancing import Mounted
    from fem import Rotor
    from fem import Sensor as Probe


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
    groups
        The weight of each plane of each group where that of the group is 1.
    sensors
        The same for each sensor of the readings (C).
    limits
        In SI with the rotation, in the order of `trials.speeds`, `trials.sensors` and `planes`; None: none.
    zones
        Boundaries A/B, B/C and C/D of each sensor that has some, amplitudes as those of `trials`.
    row_weights
        Of each reading in the fit, shape (S, C): the speed's times the sensor's; None where all are 1.
    check
        Check runs, in the units and at the speeds of the job, or None.
    check_mounted
        Whether `check.weights` are those of a table; else what was proposed is taken to have been mounted.
    check_pieces
        The pieces that `check.weights` are then, by `rotorid.commands.balance_after_check`; None: others.
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
    settings
        Further keys of the job as it is written: `machine`, `machine_type`, `date`, `sheet` and so on.
    """

    trials: Trials
    influence: Influence | None
    conventions: Conventions
    files: tuple[Path, ...]
    planes: dict[str, Plane] = field(default_factory=dict)
    groups: Groups = field(default_factory=dict)
    sensors: dict[str, Sensor] = field(default_factory=dict)
    limits: Limits | None = None
    zones: Mapping[str, Sequence[float]] = field(default_factory=dict)
    row_weights: FloatArray | None = None
    check: Trials | None = None
    check_mounted: bool = False
    check_pieces: Mounted | None = None
    rotor: Rotor | None = None
    holes: Mapping[str, Holes] = field(default_factory=dict)
    slow_roll: ComplexArray | None = None
    key_phasor: float = 0.0
    settings: JobSettings = field(default_factory=JobSettings)

    @property
    def check_of_weights(self) -> bool:
        """Whether the weights were mounted for the check, although there are holes for pieces."""
        return self.settings.check_weights == WEIGHTS and not self.check_mounted

    @property
    def held(self) -> Unknowns | None:
        """The groups of stored coefficients or of trial weights, where these do not tell planes apart."""
        return held(self.groups, (self.influence or self.trials).planes)

    @property
    def used(self) -> tuple[str, ...]:
        """Planes that are not left out."""
        return tuple(name for name, plane in self.planes.items() if plane.use)

    @property
    def radii(self) -> dict[str, float]:
        """Radius, m, of each plane that has one: it converts between masses and unbalances."""
        return {name: plane.radius for name, plane in self.planes.items() if plane.radius is not None}

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
        from fem import Sensor as Probe

        angles, sensors = self.sensor_angles, self.sensors.items()
        return {s: Probe(one.node, angles.get(s, 0.0)) for s, one in sensors if one.node is not None}

    def limits_of(self, planes: Sequence[str]) -> Limits | None:
        """Limits of these planes only, in their order, at all speeds."""
        if self.limits is None:
            return None
        order = list(self.planes)
        return self.limits.pick(range(len(self.trials.speeds)), [order.index(p) for p in planes])


def read_job(path: str | Path, **stated: Any) -> Job:  # noqa: ANN401
    """Read a job file (`.toml`) or a workbook (`.xlsx`, sheets runs, weights, planes, sensors, settings).

    Parameters
    ----------
    path
        The job; files that it names are found relative to it.
    stated
        phase, angles, amplitude_error_percent, phase_error_deg: replace what the job says.

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
    TypeError
        For another argument.
    """
    problems = Problems()
    return job_of(open_job(Path(path), problems), problems, **stated)


def job_from_files(
    files: Sequence[str | Path],
    *,
    influence: str | Path | None = None,
    **stated: Any,  # noqa: ANN401
) -> Job:
    """A job without a job file: a runs table with a weights table, or with stored coefficients.

    Parameters
    ----------
    files
        Runs and weights; with `influence` the weights (mounted during the runs) may be left out.
    influence
        Influence table.
    stated
        Conventions and errors as of `read_job`; default: lead and with rotation, which the labels then call
        assumed; no errors.

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
    TypeError
        For another argument.
    """
    if not 1 <= len(files) <= 2 or (len(files) == 1 and influence is None):
        raise ValueError(
            "give a job (.toml or .xlsx), or a runs table and a weights table, or a runs table and "
            f"--influence with an influence table; got {counted(len(files), 'file')}"
        )
    tables: dict[str, Source] = dict(zip(("runs", "weights"), map(Path, files), strict=False))
    if influence is not None:
        tables["influence"], first = Path(influence), Path(files[0])
        if first.suffix.lower() == ".toml" and "runs" in read_toml(first):
            expected = f'influence = "{influence}" in the job; --influence goes with a runs table'
            raise refusal(first, expected, column="influence")
    return job_of(WrittenJob(None, tables=tables), Problems(), **stated)


def open_job(path: Path, problems: Problems) -> WrittenJob:
    """A job file (`.toml`) or a workbook (`.xlsx`) as it is written.

    Raises
    ------
    InputError
        If there is nothing of a job in it.
    """
    if path.suffix.lower() == ".toml":
        return WrittenJob(path, read_toml(path))
    from rotorid.files.job_excel import job_in_sheets

    return job_in_sheets(path, problems)


def job_of(written: WrittenJob, problems: Problems, **stated: Any) -> Job:  # noqa: ANN401
    """The job of these settings and tables, or an `InputError`; `stated` as of `read_job`."""
    settings = _stating(written.read(problems), **stated)
    problems.stop()
    tables, records = tables_of(written, settings)
    for key in READINGS:
        path = tables.get(key)
        if isinstance(path, Path) and path.suffix.lower() == ".toml":
            from rotorid.files.waveform_jobs import read_vectors_grid

            grid, phase, read = read_vectors_grid(path, settings.phase)
            tables[key], records = grid, (*records, *read)
            # vectors know their sign, so that nothing is assumed: a job that says nothing writes lead
            settings = settings.model_copy(update={"phase": phase})
    readings = _readings(settings, tables, problems)
    settings, rotor, model_files = in_model(settings, written.folder, problems)
    trials, influence, conventions, slow_roll = problems.need(readings)
    if "check" in tables and (trials.relative or trials.index is not None):
        words = "no check run beside trial weights of unknown mass or place, or an index: it is a further run"
        settings.complain(problems, "check", words)
        problems.stop()
    trials, planes = planes_of(settings, trials, influence, rotor, problems)
    groups = settings.shares(trials.labels)
    limits = make_limits(settings, planes, trials, problems)
    zones = make_zones(settings, trials, problems)
    weights = row_weights(settings, trials, problems)
    holes = make_holes(planes, trials.labels, problems)
    check, mounted = None, tables.get("check_weights")
    if "check" in tables:
        from rotorid.files.check_and_slow_roll import check_runs

        sources = tables["check"], mounted
        check = check_runs(
            sources, trials, [*planes], groups, conventions, settings.errors, slow_roll, problems
        )
        if check and mounted is not None:
            holes = with_taken(holes, mounted, check, conventions)
    problems.stop()
    files = (written.path, *map(tables.get, TABLES), *model_files, *records)
    sensors = {name: settings.sensors.get(name, Sensor.model_construct()) for name in trials.sensors}
    key_phasor = trials.labels.with_rotation(settings.key_phasor.angle if settings.key_phasor else 0.0)
    # phases always matter, the direction of angles as soon as one is written other than 0° and 180°
    degrees = [angle for plane in planes.values() for angle in plane.angles]
    if rotor:
        degrees += [key_phasor, *(one.angle or 0.0 for one in sensors.values())]
    shares = np.array([share for group in groups.values() for share in group.values()], dtype=complex)
    vectors = [trials.weights, shares, polar(1.0, np.radians(degrees))]
    vectors += [check.weights] if check else []
    machine = units.vibration(trials.labels.vibration_unit).kind == "unbalance"  # phases are angles then
    matters = {"phase": not machine, "angles": machine or any(np.imag(each).any() for each in vectors)}
    matters = {} if trials.amplitudes_only else matters  # they tell no direction of turning, and need none
    labels = replace(trials.labels, assumed=tuple(name for name in conventions.unstated if matters.get(name)))
    return Job(
        trials=replace(trials, labels=labels),
        influence=influence and replace(influence, labels=labels),
        conventions=conventions,
        files=tuple(file for file in files if isinstance(file, Path)),
        planes=planes,
        groups=groups,
        sensors=sensors,
        limits=limits,
        zones=zones,
        row_weights=weights,
        check=check and replace(check, labels=labels),
        check_mounted=mounted is not None,
        rotor=rotor,
        holes=holes,
        slow_roll=slow_roll,
        key_phasor=key_phasor,
        settings=settings,
    )


def _stating(
    settings: JobSettings,
    *,
    phase: str | None = None,
    angles: str | None = None,
    amplitude_error_percent: float | None = None,
    phase_error_deg: float | None = None,
) -> JobSettings:
    """The settings of a job with what the caller states in their place."""
    errors = {"amplitude_percent": amplitude_error_percent, "phase_deg": phase_error_deg}
    given: dict[str, Any] = {"phase": phase, "angles": angles}
    if errors := {name: value for name, value in errors.items() if value is not None}:
        given["errors"] = (settings.errors or Errors.model_construct()).model_copy(update=errors)
    return settings.model_copy(update={name: value for name, value in given.items() if value is not None})


def tables_of(written: WrittenJob, settings: JobSettings) -> tuple[dict[str, Source], tuple[Path, ...]]:
    """What tables there are, by `TABLES`, and the files of those of several files."""
    runs = tuple(written.folder / name for name in settings.runs or ())
    named: dict[str, Source] = {
        key: written.folder / name for key, name in named_tables(vars(settings)).items()
    }
    table = runs[0] if runs else written.tables["runs"]
    files = runs if len(runs) > 1 else files_of_runs(table)
    several = settings.check_weights if isinstance(settings.check_weights, tuple) else ()
    mounted = tuple(written.folder / name for name in several)
    if mounted:
        named["check_weights"] = mounted
    return {**named, **written.tables, "runs": files or table}, (*files, *mounted)


def _readings(
    settings: JobSettings, tables: Mapping[str, Source], problems: Problems
) -> tuple[Trials, Influence | None, Conventions, ComplexArray | None] | None:
    """Runs, stored coefficients, what their numbers mean and slow-roll vectors, or None and problems."""
    if "check" not in tables and ("check_weights" in tables or settings.check_weights):
        expected = 'the check runs too, check = "check.csv" (in a workbook a sheet check)'
        settings.complain(problems, "check_weights", expected)
    before, runs, influence, source = len(problems), tables["runs"], None, tables.get("influence")
    phase, stated = settings.phase or stated_phase(runs), dict[str, Any]()
    settings = settings.model_copy(update={"phase": phase})
    if source is not None:
        from rotorid.files.influence import fit_to_readings, load_influence

        angles = resolve_angles(settings.angles, settings.rotation)
        try:
            influence, stated = load_influence(source, phase, angles)
        except InputError as error:
            problems.extend(error.problems)
    conventions = conventions_of(settings, stated)
    trials = make_trials(runs, tables.get("weights"), conventions, settings.errors, problems)
    machine = trials is not None and units.vibration(trials.labels.vibration_unit).kind == "unbalance"
    if not (tables.keys() & {"weights", "influence"} or settings.rotor or settings.machine_type or machine):
        expected = (
            "a weights table, or an influence table of stored coefficients, or a rotor; or machine_type, "
            "whose coefficients come with balance --type"
        )
        settings.complain(problems, "weights", expected)
    elif machine and trials and not trials.planes:
        influence = machine_influence(trials)
    if source is not None and influence and trials:
        groups = settings.shares(conventions.labels)
        trials = in_planes(trials, groups)
        influence = fit_to_readings(
            influence,
            trials,
            unknowns(groups, influence.planes).planes,
            conventions.speed_tolerance_percent,
            source_name(source),
            problems,
        )
    if not trials or len(problems) > before:
        return None
    labels, its = conventions.labels, (influence or trials).labels
    labels = replace(its, rotation=labels.rotation, view=labels.view, clock=labels.clock)
    notes = [] if source is None else _on_conventions(conventions, stated, labels, source_name(source))
    trials = replace(trials, labels=labels, warnings=(*notes, *trials.warnings))
    vectors, slow_roll = tables.get("slow_roll"), None
    if vectors is not None:
        from rotorid.files.check_and_slow_roll import make_slow_roll, subtract_slow_roll

        if (made := make_slow_roll(vectors, trials, conventions, problems)) is not None:
            slow_roll, further = made
            trials = subtract_slow_roll(replace(trials, warnings=(*trials.warnings, *further)), slow_roll)
    return trials, influence, conventions, slow_roll


def _on_conventions(
    conventions: Conventions, stated: Mapping[str, Any], labels: Labels, name: str
) -> list[str]:
    """What readings take from stored coefficients that state their conventions, or these from readings."""
    usual, notes = vars(Labels()), list[str]()
    each = (conventions.unstated, "the readings", name), ({"phase"} - {*stated}, name, "the readings")
    for unstated, one, other in each:
        adopted = [key for key in unstated if getattr(labels, key) != usual[key]]
        words = " and ".join(f"{key} = {getattr(labels, key)}" for key in adopted)
        words = f"nothing states the conventions of {one}: those of {other} are used for them too, {words}"
        notes += [words] if adopted else []
    return notes


def conventions_of(settings: JobSettings, stored: Mapping[str, Any]) -> Conventions:
    """What the numbers of the tables mean: as the job says, or the stored coefficients."""
    rotation, planes = settings.rotation, settings.planes.items()
    labels = Labels(
        phase=settings.phase or stored.get("phase", "lead"),
        angles=resolve_angles(settings.angles or stored.get("angles", "with rotation"), rotation),
        rotation=rotation,
        view=settings.view if rotation else None,
        clock=settings.angles in ROTATIONS,
    )
    limits = [one.limit or one.zones for one in settings.sensors.values()]
    limits += [settings.zones.boundaries] if settings.zones else []
    return Conventions(
        labels,
        settings.speed_tolerance_percent,
        tuple(key for key in ("phase", "angles") if getattr(settings, key) is None),
        settings.exchanged,
        settings.speed,
        {name: holes for name, plane in planes if (holes := plane.hole_angles())},
        frozenset(name for name, plane in planes if plane.remove),
        any(limit and limit.unit.name.endswith("_rms") for limit in limits),
    )
