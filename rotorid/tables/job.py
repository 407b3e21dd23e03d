"""Jobs: the files of one balancing job, with its conventions and stated errors."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from pathlib import Path

from balancing.influence import Influence
from balancing.trials import Trials
from rotorid.tables.conventions import (
    ANGLES,
    DEFAULT_TOLERANCE,
    LARGEST_TOLERANCE,
    PHASES,
    Angles,
    Conventions,
    Phase,
    StatedErrors,
    as_angles,
    as_phase,
)
from rotorid.tables.grid import Grid
from rotorid.tables.influence import Stored, fit_to_readings, load_influence
from rotorid.tables.jobbook import read_job_book
from rotorid.tables.problems import Problems, did_you_mean, listing
from rotorid.tables.sheet import is_workbook
from rotorid.tables.tomlfile import Section, read_toml
from rotorid.tables.trials import make_trials

# Keys of the interface that later versions obey; until then each is refused by name.
PLANES_LATER = (
    "max_mass_g",
    "radius_mm",
    "trial_radius_mm",
    "holes_deg",
    "holes",
    "first_hole_deg",
    "available_g",
    "forbidden_deg",
    "remove",
)
SENSORS_LATER = ("limit", "weight", "angle_deg")
JOB_LATER = ("rotor", "check", "key_phasor", "slow_roll")


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
    """

    trials: Trials
    influence: Influence | None
    conventions: Conventions
    files: tuple[Path, ...]


@dataclass(frozen=True)
class Settings:
    """What a job's settings say, before its tables are read; conventions that nobody states are None."""

    phase: Phase | None
    angles: Angles | None
    speed_tolerance_percent: float
    errors: StatedErrors | None


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
    overrides = _Overrides(phase, angles, amplitude_error_percent, phase_error_deg)
    if is_workbook(path):
        book = read_job_book(path, {"planes": PLANES_LATER, "sensors": SENSORS_LATER}, problems)
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
        runs, weights = _file(top, "runs", path), _file(top, "weights", path)
        if "runs" not in top:
            top.missing("runs", 'the runs table, runs = "runs.csv"')
    else:
        expected = "a job: a .toml file, or an .xlsx workbook with sheets runs and weights"
        problems.add(str(path), None, None, None, expected)
        problems.stop()
        raise AssertionError
    influence = _file(top, "influence", path)
    if weights is None and "weights" not in top and "influence" not in top:
        top.missing("weights", "a weights table, or an influence table of stored coefficients")
    settings = _settings(top, overrides, problems)
    planes, sensors = _named(top, "planes", PLANES_LATER), _named(top, "sensors", SENSORS_LATER)
    top.finish()
    if runs is None:
        problems.stop()
        raise AssertionError
    job = _assemble(path, runs, weights, influence, settings, problems)
    if job is not None:
        known_planes = job.trials.planes or (job.influence.planes if job.influence else ())
        _complain_about_names(str(path), "planes", planes, known_planes, problems)
        _complain_about_names(str(path), "sensors", sensors, job.trials.sensors, problems)
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
    overrides = _Overrides(phase, angles, amplitude_error_percent, phase_error_deg)
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


@dataclass(frozen=True)
class _Overrides:
    """What the caller says instead of the job file."""

    phase: str | None
    angles: str | None
    amplitude_error_percent: float | None
    phase_error_deg: float | None

    def __post_init__(self) -> None:
        Conventions(as_phase(self.phase or "lead"), as_angles(self.angles or "with rotation"))
        self.errors(None)

    def errors(self, stated: StatedErrors | None) -> StatedErrors | None:
        """Stated errors with the replacements."""
        if self.amplitude_error_percent is None and self.phase_error_deg is None:
            return stated
        result = stated or StatedErrors()
        if self.amplitude_error_percent is not None:
            result = replace(result, amplitude_percent=self.amplitude_error_percent)
        if self.phase_error_deg is not None:
            result = replace(result, phase_deg=self.phase_error_deg)
        return result


def _file(top: Section, key: str, job: Path) -> Path | None:
    name = top.text(key)
    if name is None:
        return None
    if not name.isprintable():
        expected = (
            "the name of a file, without control characters: in double quotes TOML takes \\ for the "
            "beginning of one; write / in its place, or put the name in single quotes"
        )
        top.complain(key, expected)
        return None
    return job.parent / name


def _settings(top: Section, overrides: _Overrides, problems: Problems) -> Settings:
    phase = top.choice("phase", PHASES, "")
    angles = top.choice("angles", ANGLES, "")
    tolerance = top.number("speed_tolerance_percent", DEFAULT_TOLERANCE, low=0.0, high=LARGEST_TOLERANCE)
    errors = _errors(top, problems)
    top.later(*JOB_LATER)
    phase, angles = overrides.phase or phase, overrides.angles or angles
    return Settings(
        as_phase(phase) if phase else None,
        as_angles(angles) if angles else None,
        DEFAULT_TOLERANCE if tolerance is None else tolerance,
        overrides.errors(errors),
    )


def _errors(top: Section, problems: Problems) -> StatedErrors | None:
    section = top.section("errors")
    if section is None:
        return None
    before = len(problems)
    values = {key: section.number(key, low=0.0) for key in ("amplitude_percent", "phase_deg", "floor")}
    section.finish()
    given = {key: value for key, value in values.items() if value is not None}
    if len(problems) > before:
        return None
    if not any(given.values()):
        expected = (
            "an error above 0 (amplitude_percent, phase_deg or floor); leave [errors] out if it is unknown"
        )
        top.missing("errors", expected)
        return None
    return StatedErrors(**given)


def _named(top: Section, key: str, later: tuple[str, ...]) -> tuple[str, ...]:
    sections = top.named(key)
    for section in sections.values():
        section.later(*later)
        section.finish()
    return tuple(sections)


def _complain_about_names(
    source: str, key: str, named: Sequence[str], known: Sequence[str], problems: Problems
) -> None:
    for name in named:
        if name not in known:
            expected = f"one of the job's {key}, {listing(known, 'and')}{did_you_mean(name, known)}"
            problems.add(source, None, f"{key}.{name}", name, expected)


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
    conventions, notes = _conventions(settings, stored, found)
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
    return Job(trials, influence, conventions, tuple(file for file in read if isinstance(file, Path)))


def _conventions(
    settings: Settings, stored: Path | None, found: Stored | None
) -> tuple[Conventions, tuple[str, ...]]:
    """Conventions of the readings and weights: stated ones, else those of stored coefficients; and notes."""
    said = {} if found is None else found.said
    phase = settings.phase or as_phase(said.get("phase", "lead"))
    angles = settings.angles or as_angles(said.get("angles", "with rotation"))
    notes = []
    adopted = [
        words
        for words, own, used, usual in (
            (f"phase = {phase}", settings.phase, phase, "lead"),
            (f"angles {angles}", settings.angles, angles, "with rotation"),
        )
        if own is None and used != usual
    ]
    if adopted:
        notes.append(
            f"nothing states the conventions of the readings: those of {stored} are used for them too, "
            f"{' and '.join(adopted)}"
        )
    if settings.phase and said.get("phase", settings.phase) != settings.phase:
        notes.append(
            f"the readings are taken with phase = {settings.phase}, as stated, and the coefficients with "
            f"phase = {said['phase']}, as {stored} says"
        )
    return Conventions(phase, angles, settings.speed_tolerance_percent), tuple(notes)
