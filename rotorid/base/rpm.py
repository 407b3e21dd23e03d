"""Speeds in rpm and angles in degrees, as people read them."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from numpy.typing import ArrayLike

    from rotorid.base.arrays import FloatArray

RPM = 60 / math.tau  # of 1 rad/s


def rpm(speed: float) -> float:
    """Revolutions per minute to 12 digits: 3000 come back as 3000, not as 3000.0000000000005."""
    return float(f"{speed * RPM:.12g}")


def rpm_text(speed: float) -> str:
    """A speed in rad/s as `2980.5 rpm`."""
    return f"{speed * RPM:.6g} rpm"


def speed_text(speed: float) -> str:
    """A speed in both units, `312.114 rad/s = 2980.5 rpm`."""
    return f"{speed:.6g} rad/s = {speed * RPM:.6g} rpm"


def range_text(low: float, high: float) -> str:
    """A range of speeds in both units, `1000 to 3000 rpm (104.72 to 314.159 rad/s)`."""
    return f"{low * RPM:.6g} to {rpm_text(high)} ({low:.6g} to {high:.6g} rad/s)"


def phase_deg(z: ArrayLike) -> FloatArray:
    """Phases of complex numbers, 0 ≤ phase < 360 degrees."""
    import numpy as np

    phase = np.mod(np.degrees(np.angle(np.asarray(z))), 360.0)
    return np.where(phase >= 360.0, 0.0, phase)  # −1e-20 modulo 360 is rounded to 360
