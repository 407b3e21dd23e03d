"""How a job's vibrations and weights are written: units and conventions, to print results in.

Inside, every vibration is a complex amplitude with positive phase = lead, every weight is complex with
its angle counted with the rotation. Only a `Labels` object, made where files are read, knows how the
people of the job write them.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal

import numpy as np
from numpy.typing import ArrayLike, NDArray

FloatArray = NDArray[np.float64]


@dataclass(frozen=True)
class Labels:
    """Units and conventions of a job.

    Attributes
    ----------
    vibration_unit, vibration_scale
        Name of the unit ("um_pp"; "" if the readings had none) and shown = inside × scale.
    weight_unit, weight_scale
        Name ("g", "g_mm") and shown = inside × scale.
    phase
        Whether a positive phase leads or lags.
    angles
        Whether angles on the rotor count with or against the rotation.
    speed_unit
        In which the readings give the speed: "rpm", "rad_s" or "Hz".
    """

    vibration_unit: str = "m"
    vibration_scale: float = 1.0
    weight_unit: str = "kg"
    weight_scale: float = 1.0
    phase: Literal["lead", "lag"] = "lead"
    angles: Literal["with rotation", "against rotation"] = "with rotation"
    speed_unit: str = "rpm"

    def vibration(self, amplitude: ArrayLike) -> tuple[FloatArray, FloatArray]:
        """Amplitude in the job's unit and phase in degrees, 0 ≤ phase < 360, as the job counts it."""
        return _polar(amplitude, self.vibration_scale, self.phase_sign)

    def weight(self, weight: ArrayLike) -> tuple[FloatArray, FloatArray]:
        """Weight in the job's unit and angle in degrees, 0 ≤ angle < 360, as the job counts it."""
        return _polar(weight, self.weight_scale, self.angle_sign)

    def vibration_covariance(self, covariance: FloatArray) -> FloatArray:
        """Covariance (…, 2, 2) of amplitude·cos(phase) and amplitude·sin(phase) as the job writes them."""
        return _mirror(covariance, self.vibration_scale, self.phase_sign)

    def weight_covariance(self, covariance: FloatArray) -> FloatArray:
        """Covariance (…, 2, 2) of mass·cos(angle) and mass·sin(angle) as the job writes them."""
        return _mirror(covariance, self.weight_scale, self.angle_sign)

    @property
    def phase_sign(self) -> int:
        """+1 for lead, −1 for lag."""
        return 1 if self.phase == "lead" else -1

    @property
    def angle_sign(self) -> int:
        """+1 with the rotation, −1 against it."""
        return 1 if self.angles == "with rotation" else -1

    def conventions(self) -> dict[str, str]:
        """The conventions in the words of the job file."""
        return {
            "phase": self.phase,
            "angles": self.angles,
            "vibration_unit": self.vibration_unit,
            "weight_unit": self.weight_unit,
        }


def _polar(value: ArrayLike, scale: float, sign: int) -> tuple[FloatArray, FloatArray]:
    z = np.asarray(value, dtype=complex)
    angle = np.mod(sign * np.degrees(np.angle(z)), 360.0)
    return np.abs(z) * scale, np.where(angle >= 360.0, 0.0, angle)


def _mirror(covariance: FloatArray, scale: float, sign: int) -> FloatArray:
    flip = np.diag([1.0, float(sign)])
    return np.asarray(scale**2 * (flip @ covariance @ flip))
