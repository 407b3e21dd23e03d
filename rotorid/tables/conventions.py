"""How a job counts phases and angles, and how large its errors are said to be."""

from __future__ import annotations

from dataclasses import dataclass
from math import isfinite, radians
from typing import Literal, cast

import numpy as np
from numpy.typing import NDArray

from balancing.labels import Labels
from balancing.trials import ReadingErrors

Phase = Literal["lead", "lag"]
Angles = Literal["with rotation", "against rotation"]
PHASES = ("lead", "lag")
ANGLES = ("with rotation", "against rotation")
DEFAULT_TOLERANCE = 0.5
LARGEST_TOLERANCE = 20.0
FULL_TURN = 2.0 * np.pi * (1.0 + 1e-12)


@dataclass(frozen=True)
class Conventions:
    """What the numbers of a job's tables mean.

    Attributes
    ----------
    phase
        Whether a positive phase leads or lags.
    angles
        Whether angles on the rotor count with or against the rotation.
    speed_tolerance_percent
        Speeds of different runs that differ by less count as one.

    Raises
    ------
    ValueError
        If a value is none of the allowed ones.
    """

    phase: Phase = "lead"
    angles: Angles = "with rotation"
    speed_tolerance_percent: float = DEFAULT_TOLERANCE

    def __post_init__(self) -> None:
        if self.phase not in PHASES:
            raise ValueError(f"phase must be 'lead' or 'lag', not {self.phase!r}")
        if self.angles not in ANGLES:
            raise ValueError(f"angles must be 'with rotation' or 'against rotation', not {self.angles!r}")
        if not 0 <= self.speed_tolerance_percent <= LARGEST_TOLERANCE:
            raise ValueError(
                f"speed_tolerance_percent must be from 0 to {LARGEST_TOLERANCE:g}, "
                f"not {self.speed_tolerance_percent!r}"
            )

    @property
    def phase_sign(self) -> int:
        """+1 for lead, −1 for lag."""
        return 1 if self.phase == "lead" else -1

    @property
    def angle_sign(self) -> int:
        """+1 with the rotation, −1 against it."""
        return 1 if self.angles == "with rotation" else -1


@dataclass(frozen=True)
class StatedErrors:
    """One standard deviation of a reading as a job file writes it.

    Attributes
    ----------
    amplitude_percent, phase_deg
        Relative to the amplitude; of the phase.
    floor
        In the amplitude's own unit, in every direction.

    Raises
    ------
    ValueError
        If one of them is negative or not finite.
    """

    amplitude_percent: float = 0.0
    phase_deg: float = 0.0
    floor: float = 0.0

    def __post_init__(self) -> None:
        for name in ("amplitude_percent", "phase_deg", "floor"):
            value = getattr(self, name)
            if not (isfinite(value) and value >= 0):
                raise ValueError(f"{name} of a reading must be finite and not negative, not {value!r}")

    def in_si(self, labels: Labels) -> ReadingErrors:
        """Relative, in rad, and in the unit of the readings inside."""
        floor = self.floor / labels.vibration_scale
        return ReadingErrors(self.amplitude_percent / 100.0, radians(self.phase_deg), floor)


def as_phase(word: str) -> Phase:
    """A checked word."""
    return cast("Phase", word)


def as_angles(word: str) -> Angles:
    """A checked word."""
    return cast("Angles", word)


def polar(size: NDArray[np.float64], angle: NDArray[np.float64], sign: int) -> NDArray[np.complex128]:
    """Complex numbers from sizes and angles (rad); exact at quarter turns, which people write most."""
    turns = angle / (np.pi / 2)
    quarter = np.round(turns)
    exact = np.abs(turns - quarter) < 1e-15 * np.maximum(np.abs(turns), 1.0)
    unit = np.where(exact, 1j ** np.mod(np.where(exact, quarter, 0.0), 4), np.exp(1j * angle))
    z = size * unit
    return np.asarray(z if sign > 0 else np.conj(z), dtype=complex)
