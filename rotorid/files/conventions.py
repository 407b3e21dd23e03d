"""Stated conventions of a job: how it counts phases and angles."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from typing import cast, get_args

import numpy as np

from balancing import Labels
from rotorid.base.choices import did_you_mean
from rotorid.base.text import Angles as Angles
from rotorid.base.text import Phase as Phase
from rotorid.base.text import Rotation as Rotation
from rotorid.base.text import View as View
from rotorid.base.text import listing

PHASES: tuple[Phase, ...] = get_args(Phase)
ANGLES: tuple[Angles, ...] = get_args(Angles)
ROTATIONS: tuple[Rotation, ...] = get_args(Rotation)
STATED_ANGLES = (*ANGLES, *ROTATIONS)
"""What a job may say; clockwise and counter-clockwise need its `rotation`, seen from the same end."""
DEFAULT_TOLERANCE = 0.5
LARGEST_TOLERANCE = 20.0
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
    exchanged
        Whether amplitudes and phases stand in each other's columns of the runs tables; None: unstated.
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
    exchanged: bool | None = None
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
        stated = self.labels
        return replace(labels, rotation=stated.rotation, view=stated.view, clock=stated.clock)


def resolve_angles(stated: str, rotation: str | None) -> Angles:
    """With or against the rotation, from one of `STATED_ANGLES` and the rotation seen from the same end.

    Raises
    ------
    ValueError
        For another word, and for clockwise or counter-clockwise without a rotation.
    """
    if stated not in STATED_ANGLES:
        hint = did_you_mean(stated, STATED_ANGLES)
        raise ValueError(f"angles must be {listing(map(repr, STATED_ANGLES))}, not {stated!r}{hint}")
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
