"""What a job's settings say, before its tables are read: files, conventions, stated errors."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace
from pathlib import Path

from balancing.data.conventions import Angles, Labels, Phase
from rotorid.tables.job.job_data import Source
from rotorid.tables.job.keys import by_speed
from rotorid.tables.reader.grid import Grid
from rotorid.tables.reader.problems import Problems
from rotorid.tables.reader.toml_file import Section
from rotorid.tables.runs.conventions import (
    DEFAULT_TOLERANCE,
    ERROR_KEYS,
    LARGEST_TOLERANCE,
    PHASES,
    Conventions,
    StatedErrors,
    Turning,
    as_angles,
    as_phase,
    check_angles,
    read_key_phasor,
    read_turning,
    resolve_angles,
)
from rotorid.tables.runs.influence_table import Stored
from rotorid.tables.runs.slow_roll import SlowRollKeys, take_slow_roll


@dataclass(frozen=True)
class Settings:
    """What a job's settings say, before its tables are read; conventions that nobody states are None."""

    phase: Phase | None
    turning: Turning
    speed_tolerance_percent: float
    errors: StatedErrors | None

    @property
    def angles(self) -> Angles | None:
        """With or against the rotation."""
        return self.turning.angles


@dataclass(frozen=True)
class Overrides:
    """What the caller says instead of the job file."""

    phase: str | None
    angles: str | None
    amplitude_error_percent: float | None
    phase_error_deg: float | None
    run_error_percent: float | None = None

    def __post_init__(self) -> None:
        Labels(phase=as_phase(self.phase or "lead"))
        if self.angles is not None:
            check_angles(self.angles)
        self.errors(None)

    def settings(self) -> Settings:
        """Of a job that has no job file.

        Raises
        ------
        ValueError
            For angles clockwise or counter-clockwise: only a job file says how the rotor turns.
        """
        turning = Turning() if self.angles is None else Turning(resolve_angles(self.angles, None))
        phase = as_phase(self.phase) if self.phase else None
        return Settings(phase, turning, DEFAULT_TOLERANCE, self.errors(None))

    def errors(self, stated: StatedErrors | None) -> StatedErrors | None:
        """Stated errors with the replacements."""
        said = {
            "amplitude_percent": self.amplitude_error_percent,
            "phase_deg": self.phase_error_deg,
            "run_percent": self.run_error_percent,
        }
        given = {key: value for key, value in said.items() if value is not None}
        return replace(stated or StatedErrors(), **given) if given else stated


@dataclass(frozen=True)
class Extra:
    """What else a job may say: rotor model, check runs with their weights, weights of the speeds, and more.

    Attributes
    ----------
    rotor, check, check_weights
        Files; the tables may be sheets.
    speed_weights
        Weight in the fit by speed.
    slow_roll
        Vectors to subtract from all readings.
    key_phasor
        Direction, in the job's degrees.
    """

    rotor: Path | None
    check: Source | None
    check_weights: Source | None
    speed_weights: Mapping[str, float]
    slow_roll: SlowRollKeys | None = None
    key_phasor: float = 0.0


def read_extra(top: Section, job: Path, sheets: Mapping[str, Grid]) -> Extra:
    """Take the files (or sheets) besides the tables, and the weights of the speeds."""
    rotor = file_of(top, "rotor", job)
    check, weights = (source_of(top, key, job, sheets) for key in ("check", "check_weights"))
    if ("check_weights" in top or weights is not None) and not ("check" in top or check is not None):
        top.complain("check_weights", 'the check runs too, check = "check.csv" (in a workbook a sheet check)')
    slow_roll, key_phasor = take_slow_roll(top, job, sheets.get("slow_roll")), read_key_phasor(top)
    by: Mapping[str, float] = {}
    if "speed_weights" in top and not isinstance(top.take("speed_weights"), (dict, str)):
        top.complain("speed_weights", 'a table of weights by speed, such as { "3000" = 2, "4500" = 0.5 }')
    else:
        by = by_speed(top, "speed_weights", "a weight of 0 or more", above_zero=False)
    return Extra(rotor, check, weights, by, slow_roll, key_phasor)


def source_of(top: Section, key: str, job: Path, sheets: Mapping[str, Grid]) -> Source | None:
    """The sheet of this name, else the file that a key names; None without both, or with a problem."""
    if key in sheets or (sheets and key in ("runs", "weights")):  # these are no files beside a workbook
        top.take(key)
        return sheets.get(key)
    return file_of(top, key, job)


def file_of(top: Section, key: str, job: Path) -> Path | None:
    """The file that a key names, relative to the job; None without it, or with a problem."""
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


def read_settings(top: Section, overrides: Overrides, problems: Problems) -> Settings:
    """Take conventions, tolerance and errors, with what the caller says in their place."""
    phase = top.choice("phase", PHASES, "")
    turning = read_turning(top, overrides.angles)
    tolerance = top.number("speed_tolerance_percent", DEFAULT_TOLERANCE, low=0.0, high=LARGEST_TOLERANCE)
    errors = _errors(top, problems)
    phase = overrides.phase or phase
    return Settings(
        as_phase(phase) if phase else None,
        turning,
        DEFAULT_TOLERANCE if tolerance is None else tolerance,
        overrides.errors(errors),
    )


def _errors(top: Section, problems: Problems) -> StatedErrors | None:
    section = top.section("errors")
    if section is None:
        return None
    before = len(problems)
    values = {key: section.number(key, low=0.0) for key in ERROR_KEYS}
    section.finish()
    given = {key: value for key, value in values.items() if value is not None}
    if len(problems) > before:
        return None
    if not any(value or key.startswith("run_") for key, value in given.items()):
        expected = (
            "an error above 0 (amplitude_percent, phase_deg or floor); leave [errors] out if it is unknown"
        )
        top.missing("errors", expected)
        return None
    return StatedErrors(**given)


def settle_conventions(
    settings: Settings, stored: str, found: Stored | None
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
    t = settings.turning
    own = {"phase": settings.phase, "angles": settings.angles}
    unstated = tuple(name for name, word in own.items() if word is None)
    labels = Labels(phase=phase, angles=angles, rotation=t.rotation, view=t.view, clock=t.clock)
    return (
        Conventions(labels, settings.speed_tolerance_percent, unstated),
        tuple(notes),
    )
