"""Readings of a job: conventions, trial runs, stored coefficients, slow roll subtracted."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace
from typing import cast

from balancing import Influence, Labels, Trials
from rotorid.base.text import listing
from rotorid.files.columns import Source, source_name
from rotorid.files.conventions import (
    ANGLES,
    ROTATIONS,
    Angles,
    Conventions,
    Phase,
    Rotation,
    StatedErrors,
    View,
    as_angles,
    as_phase,
    resolve_angles,
)
from rotorid.files.influence import Stored, fit_to_readings, load_influence
from rotorid.files.layout import stated_phase
from rotorid.files.problems import Problems
from rotorid.files.runs import make_trials
from rotorid.files.settings_keys import Said
from rotorid.files.slow_roll import SlowRoll, make_slow_roll, subtract_slow_roll
from rotorid.tables.job.job_data import Overrides
from rotorid.tables.job.job_holes import hole_angles


@dataclass(frozen=True, eq=False)
class Readings:
    """What the tables of a job say, with its conventions settled and slow roll subtracted.

    Attributes
    ----------
    trials, influence, conventions
        As in `Job`.
    errors
        Of a reading and from run to run, as the job or the caller states them.
    slow_roll
        What was subtracted, or None.
    """

    trials: Trials
    influence: Influence | None
    conventions: Conventions
    errors: StatedErrors | None
    slow_roll: SlowRoll | None


def read_readings(
    said: Said, tables: Mapping[str, Source], overrides: Overrides, problems: Problems
) -> Readings | None:
    """Read the tables of a job, or None and problems.

    Parameters
    ----------
    said
        All its keys.
    tables
        Files and sheets, by the keys that name them.
    overrides
        What the caller says instead.
    problems
        Collects the complaints.
    """
    _complain_about_tables(said, tables)
    errors, others = said["errors"], overriding_errors(overrides)
    if others:
        errors = replace(errors or StatedErrors(), **others)
    if "runs" not in tables:
        return None
    if (overrides.phase or said["phase"]) is None:
        overrides = replace(overrides, phase=stated_phase(tables["runs"], said["columns"]))
    # what is wrong with the planes must not hide what is wrong with the tables
    own = problems.apart({source_name(table) for table in tables.values()})
    found, name = None, ""
    if "influence" in tables:
        name = source_name(tables["influence"])
        phase = cast("Phase | None", overrides.phase or said["phase"])
        found = load_influence(tables["influence"], phase, _angles(said, overrides)[0], own)
    conventions = conventions_of(said, overrides, {} if found is None else found.said)
    trials = make_trials(tables["runs"], tables.get("weights"), conventions, errors, own)
    influence = None
    if found is not None and trials is not None:
        tolerance = conventions.speed_tolerance_percent
        influence = fit_to_readings(found.influence, trials, tolerance, name, own)
    problems.extend(own)
    if trials is None or len(own) or said.section.refused:
        return None
    labels = conventions.on(trials.labels if influence is None else influence.labels)
    if influence is not None:
        influence = replace(influence, labels=labels)
    notes = _notes(conventions, found, name)
    trials = replace(trials, labels=labels, warnings=notes + trials.warnings)
    vectors = tables.get("slow_roll", said["slow_roll"])
    roll = None if vectors is None else make_slow_roll(vectors, trials, conventions, problems)
    if roll is not None:
        trials = subtract_slow_roll(trials, roll)
    return Readings(trials, influence, conventions, errors, roll)


def conventions_of(said: Said, overrides: Overrides, stored: Mapping[str, str]) -> Conventions:
    """What the numbers of the tables mean: as the caller says, or the job, or the stored coefficients."""
    phase = cast("Phase | None", overrides.phase or said["phase"])
    angles, clock = _angles(said, overrides)
    labels = Labels(
        phase=phase or as_phase(stored.get("phase", "lead")),
        angles=angles or as_angles(stored.get("angles", "with rotation")),
        rotation=cast("Rotation | None", said["rotation"]),
        view=cast("View | None", said["view"] if said["rotation"] else None),
        clock=clock,
    )
    unstated = tuple(key for key, word in (("phase", phase), ("angles", angles)) if word is None)
    speed = said["speed_rpm"]
    return Conventions(
        labels,
        said["speed_tolerance_percent"],
        unstated,
        said["columns"],
        None if speed is None else (speed.unit.name, speed.value),
        {name: holes for name, plane in said["planes"].items() if (holes := hole_angles(plane))},
        frozenset(name for name, plane in said["planes"].items() if plane["remove"]),
    )


def _complain_about_tables(said: Said, tables: Mapping[str, Source]) -> None:
    top = said.section
    if "check_weights" in {*top.keys, *tables} and "check" not in {*top.keys, *tables}:
        top.complain("check_weights", 'the check runs too, check = "check.csv" (in a workbook a sheet check)')
    if {"weights", "influence", "rotor", "machine_type"}.isdisjoint({*top.keys, *tables}):
        expected = (
            "a weights table, or an influence table of stored coefficients, or a rotor; or machine_type, "
            "whose coefficients come with balance --type"
        )
        top.missing("weights", expected)


def _angles(said: Said, overrides: Overrides) -> tuple[Angles | None, bool]:
    """With or against the rotation, None where nobody says; and whether they are called clockwise or not."""
    top, rotation, view = said.section, said["rotation"], said["view"]
    stated = overrides.angles or said["angles"]
    seen = ""
    if stated in ROTATIONS:
        seen = f"the same end as the angles, which count {stated}"
    elif view is not None:
        seen = f"the {view}"
    if seen and "rotation" not in top:
        top.missing("rotation", f"{listing(map(repr, ROTATIONS))}, how the rotor turns, seen from {seen}")
    if stated is None or (rotation is None and stated not in ANGLES):
        return None, False
    return resolve_angles(stated, rotation), stated in ROTATIONS


def overriding_errors(overrides: Overrides) -> dict[str, float]:
    """The errors that the caller states, by the keys of a job."""
    given = {
        "amplitude_percent": overrides.amplitude_error_percent,
        "phase_deg": overrides.phase_error_deg,
        "run_percent": overrides.run_error_percent,
    }
    return {key: value for key, value in given.items() if value is not None}


def _notes(conventions: Conventions, found: Stored | None, stored: str) -> tuple[str, ...]:
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
            f"nothing states the conventions of the readings: those of {stored} are used for them too, "
            f"{' and '.join(adopted)}"
        )
    if found is not None and found.said.get("phase", phase) != phase:
        notes.append(
            f"the readings are taken with phase = {phase}, as stated, and the coefficients with "
            f"phase = {found.said['phase']}, as {stored} says"
        )
    return tuple(notes)
