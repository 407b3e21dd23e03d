"""One balancing job as it is read: readings, weights, and all that the job says about them."""

from __future__ import annotations

import datetime
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import TYPE_CHECKING, Any

from balancing import Holes, Influence, Labels, Limits, Trials
from rotorid.base.arrays import ComplexArray, FloatArray
from rotorid.files.conventions import Conventions, StatedErrors, as_phase, check_angles

if TYPE_CHECKING:
    from balancing import Mounted
    from fem import Rotor, Sensor


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
        sizes = self.amplitude_error_percent or 0.0, self.phase_error_deg or 0.0
        StatedErrors(*sizes, run_percent=self.run_error_percent)


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
        Whether `check.weights` are those of a table; else what was proposed is taken to have been mounted.
    check_of_weights
        Whether these were the weights, although there are holes for pieces.
    check_pieces
        The pieces that `check.weights` are then, by `rotorid.commands.after_check`; None: others.
    rotor
        The model that the job names, or None.
    plane_nodes
        Node of each plane that has one in the model.
    sensor_places
        Node and direction (degrees with the rotation from the model's x) of each sensor that has a node.
    sensor_angles
        Direction of each sensor that the job states, degrees with the rotation from the model's x.
    radii
        Radius, m, of each plane that has one: it converts between masses and unbalances.
    holes
        What can be mounted in each plane that says so, in the unit of the weights; where material is removed
        their angles are those of the equivalent added weights (180° from the hole).
    remove
        Planes in which material is taken away instead of added.
    trial_radii
        Radius, m, at which the weights of the weights table were mounted, of each plane where that is not the
        correction radius; `trials.weights` are converted to the correction radius already.
    slow_roll
        Slow-roll vectors, (C,) for all speeds or (S, C), which are subtracted from the readings of `trials`
        and `check` already; None: none.
    key_phasor
        Its direction, degrees with the rotation from the model's x.
    machine, machine_type, date
        What was balanced, of which type, and when; empty and None where the job does not say.
    sheet
        What it says for the balancing sheet: machine, place, date, engineer, instrument, and zero, where 0°
        stands in polar plots; empty where it says nothing.
    """

    trials: Trials
    influence: Influence | None
    conventions: Conventions
    files: tuple[Path, ...]
    planes: tuple[str, ...] = ()
    limits: Limits | None = None
    row_weights: FloatArray | None = None
    left_out: tuple[str, ...] = ()
    check: Trials | None = None
    check_mounted: bool = False
    check_of_weights: bool = False
    check_pieces: Mounted | None = None
    rotor: Rotor | None = None
    plane_nodes: Mapping[str, int] = field(default_factory=dict)
    sensor_places: Mapping[str, Sensor] = field(default_factory=dict)
    sensor_angles: Mapping[str, float] = field(default_factory=dict)
    radii: Mapping[str, float] = field(default_factory=dict)
    holes: Mapping[str, Holes] = field(default_factory=dict)
    remove: frozenset[str] = frozenset()
    trial_radii: Mapping[str, float] = field(default_factory=dict)
    slow_roll: ComplexArray | None = None
    key_phasor: float = 0.0
    machine: str = ""
    machine_type: str = ""
    date: datetime.date | None = None
    sheet: Mapping[str, Any] = field(default_factory=dict)

    @property
    def used(self) -> tuple[str, ...]:
        """Planes that are not left out."""
        return tuple(p for p in self.planes if p not in self.left_out)

    def limits_of(self, planes: Sequence[str]) -> Limits | None:
        """Limits of these planes only, in their order, at all speeds."""
        if self.limits is None:
            return None
        return self.limits.pick(range(len(self.trials.speeds)), [self.planes.index(p) for p in planes])
