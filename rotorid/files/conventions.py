"""Stated conventions of a job: how it counts phases and angles."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Any, get_args

from balancing import Labels
from rotorid.base.text import Angles, Phase, Rotation

PHASES: tuple[Phase, ...] = get_args(Phase)
ROTATIONS: tuple[Rotation, ...] = get_args(Rotation)
DEFAULT_TOLERANCE = 0.5
LARGEST_TOLERANCE = 20.0


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


def resolve_angles(stated: Any, rotation: str | None) -> Angles:  # noqa: ANN401  what `Labels` refuses too
    """With or against the rotation, of clockwise too; `rotation` is seen from the same end.

    Raises
    ------
    ValueError
        For clockwise or counter-clockwise without a rotation.
    """
    if stated not in ROTATIONS:
        angles: Angles = stated
        return angles
    if rotation is None:
        raise ValueError(
            f"angles that count {stated} need the direction of rotation seen from the same end: state "
            'rotation = "clockwise" or "counter-clockwise" in a job file, or angles with or against rotation'
        )
    return "with rotation" if stated == rotation else "against rotation"
