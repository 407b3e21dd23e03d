"""Complex numbers: from sizes and angles, which are off the real axis, variances along and across."""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike

from rotorid.base.arrays import ComplexArray, FloatArray


def polar(size: ArrayLike, angle: ArrayLike) -> ComplexArray:
    """Complex numbers from sizes and angles (rad); exact at quarter turns, which people write most."""
    turns = np.asarray(angle, dtype=float) / (np.pi / 2)
    quarter = np.round(turns)
    exact = np.abs(turns - quarter) < 1e-15 * np.maximum(np.abs(turns), 1.0)
    unit = np.where(exact, 1j ** np.mod(np.where(exact, quarter, 0.0), 4), np.exp(1j * np.asarray(angle)))
    return np.asarray(size * unit, dtype=complex)


def off_axis(weights: ArrayLike) -> bool:
    """Whether any of these complex numbers stands at another angle than 0° and 180°."""
    w = np.asarray(weights, dtype=complex)
    return bool((np.abs(w.imag) > 1e-9 * np.abs(w)).any())


def turned(z: ComplexArray, radial: FloatArray, tangential: FloatArray) -> FloatArray:
    """Covariances (…, 2, 2) from variances along z and across."""
    size = np.abs(z)
    unit = np.where(size > 0, z, 1.0) / np.where(size > 0, size, 1.0)
    c, s = unit.real, unit.imag
    out = np.empty((*z.shape, 2, 2))
    out[..., 0, 0] = radial * c**2 + tangential * s**2
    out[..., 1, 1] = radial * s**2 + tangential * c**2
    out[..., 0, 1] = out[..., 1, 0] = (radial - tangential) * c * s
    return out
