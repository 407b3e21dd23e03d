"""Stated conventions of a job: how it counts phases and angles, and how large its errors are said to be."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from math import isfinite, radians
from typing import Any, cast, get_args

import numpy as np

from balancing import Labels, Placement, ReadingErrors, RunScatter, Trials
from rotorid.base.suggestions import did_you_mean
from rotorid.base.text import listing
from rotorid.base.words import Angles as Angles
from rotorid.base.words import Phase as Phase
from rotorid.base.words import Rotation as Rotation
from rotorid.base.words import View as View

PHASES: tuple[Phase, ...] = get_args(Phase)
ANGLES: tuple[Angles, ...] = get_args(Angles)
ROTATIONS: tuple[Rotation, ...] = get_args(Rotation)
STATED_ANGLES = (*ANGLES, *ROTATIONS)
"""What a job may say; clockwise and counter-clockwise need its `rotation`, seen from the same end."""
DEFAULT_TOLERANCE = 0.5
LARGEST_TOLERANCE = 20.0
ERROR_KEYS = (
    "amplitude_percent",
    "phase_deg",
    "floor",
    "run_percent",
    "run_floor",
    "placement_deg",
    "placement_percent",
    "drift_percent",
)
FULL_TURN = 2.0 * np.pi * (1.0 + 1e-12)


@dataclass(frozen=True)
class Conventions:
    """What the numbers of a job's tables mean.

    Attributes
    ----------
    labels
        How phases and angles count and how the rotor turns; the units are those of the tables, once read.
    speed_tolerance_percent
        Speeds of different runs that differ by less count as one.
    unstated
        Which of "phase" and "angles" neither the job nor the caller states.
    columns
        `job_models.Columns`: names that the columns of the runs tables have in the files; None: their own.
    speed
        Unit and number of the only speed, for runs tables without a column of speeds.
    holes
        Angle in degrees, as the job counts, of each hole by its name, for each plane that has holes.
    removed
        Planes in which material is taken away.
    rms
        Whether the job has limits in rms, so that mm/s alone are rms.

    Raises
    ------
    ValueError
        For a tolerance that is not allowed.
    """

    labels: Labels = field(default_factory=Labels)
    speed_tolerance_percent: float = DEFAULT_TOLERANCE
    unstated: tuple[str, ...] = ()
    columns: Any = None  # Columns of a job, which know where they stand
    speed: tuple[str, float] | None = None
    holes: Mapping[str, Mapping[str, float]] = field(default_factory=dict)
    removed: frozenset[str] = frozenset()
    rms: bool = False

    def __post_init__(self) -> None:
        if not 0 <= self.speed_tolerance_percent <= LARGEST_TOLERANCE:
            raise ValueError(
                f"speed_tolerance_percent must be from 0 to {LARGEST_TOLERANCE:g}, "
                f"not {self.speed_tolerance_percent!r}"
            )

    def on(self, labels: Labels) -> Labels:
        """Labels that also say how the rotor turns and from which end that is seen."""
        own = self.labels
        return replace(labels, rotation=own.rotation, view=own.view, clock=own.clock)


@dataclass(frozen=True)
class StatedErrors:
    """One standard deviation of a reading as a job file writes it.

    Attributes
    ----------
    amplitude_percent, phase_deg
        Relative to the amplitude; of the phase.
    floor
        In the amplitude's own unit, in every direction.
    run_percent, run_floor
        The same for what changes from run to run; None: nobody says.
    placement_deg, placement_percent
        Of the angle and the mass of a mounted weight.
    drift_percent
        Of the readings, from the first run to the last.

    Raises
    ------
    ValueError
        If one of them is negative or not finite.
    """

    amplitude_percent: float = 0.0
    phase_deg: float = 0.0
    floor: float = 0.0
    run_percent: float | None = None
    run_floor: float | None = None
    placement_deg: float = 0.0
    placement_percent: float = 0.0
    drift_percent: float = 0.0

    def __post_init__(self) -> None:
        for name in ERROR_KEYS:
            value = getattr(self, name) or 0.0
            if not (isfinite(value) and value >= 0):
                raise ValueError(f"{name} must be finite and not negative, not {value!r}")

    def in_si(self, labels: Labels) -> ReadingErrors | None:
        """Of a reading: relative, in rad, and in the unit of the readings inside; None: nobody says."""
        if not (self.amplitude_percent or self.phase_deg or self.floor):
            return None
        floor = self.floor / labels.vibration_scale
        return ReadingErrors(self.amplitude_percent / 100.0, radians(self.phase_deg), floor)

    def between_runs(self, labels: Labels) -> RunScatter | None:
        """The same between runs."""
        if self.run_percent is None and self.run_floor is None:
            return None
        return RunScatter((self.run_percent or 0.0) / 100.0, (self.run_floor or 0.0) / labels.vibration_scale)

    def stated_in(self, trials: Trials) -> Trials:
        """The runs with these errors."""
        return replace(
            trials,
            errors=self.in_si(trials.labels),
            run_errors=self.between_runs(trials.labels),
            placement=Placement(self.placement_percent / 100.0, radians(self.placement_deg)),
            drift=self.drift_percent / 100.0,
        )


def check_angles(word: str) -> None:
    """Refuse a word that says nothing about angles.

    Raises
    ------
    ValueError
        Naming the allowed words.
    """
    if word not in STATED_ANGLES:
        hint = did_you_mean(word, STATED_ANGLES)
        raise ValueError(f"angles must be {listing(map(repr, STATED_ANGLES))}, not {word!r}{hint}")


def resolve_angles(stated: str, rotation: str | None) -> Angles:
    """With or against the rotation, from one of `STATED_ANGLES` and the rotation seen from the same end.

    Raises
    ------
    ValueError
        For another word, and for clockwise or counter-clockwise without a rotation.
    """
    check_angles(stated)
    if stated in ANGLES:
        return stated
    if rotation is None:
        raise ValueError(
            f"angles that count {stated} need the direction of rotation seen from the same end: state "
            'rotation = "clockwise" or "counter-clockwise" in a job file, or angles with or against rotation'
        )
    return "with rotation" if stated == rotation else "against rotation"


def as_phase(word: str) -> Phase:
    """A checked word."""
    return cast("Phase", word)


def as_angles(word: str) -> Angles:
    """A checked word."""
    return cast("Angles", word)
