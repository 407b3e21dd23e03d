"""Stability of a rigid rotor in plain short journal bearings, over the eccentricity of its journals."""

from __future__ import annotations

from functools import lru_cache

import numpy as np
from numpy.typing import ArrayLike

from fem.forces import law
from rotorid.base.arrays import FloatArray


def critical_mass(eccentricity: ArrayLike) -> tuple[FloatArray, FloatArray]:
    """Where a rigid rotor in a short journal bearing begins to whirl, from Routh and Hurwitz.

    Parameters
    ----------
    eccentricity
        By the clearance, above 0 and below 1, any shape.

    Returns
    -------
    M, γ
        Critical mass number m c Ω² / W, infinite where the rotor is stable at every speed; frequency of the
        whirl by Ω, NaN there. Docs: theory/motion.
    """
    e = np.asarray(eccentricity, dtype=float)
    if not ((e > 0) & (e < 1)).all():
        raise ValueError("an eccentricity lies above 0 and below 1, as a share of the clearance")
    kappa, square = np.vectorize(_whirl, otypes=[float, float])(e)
    stable = ~(square > 0)
    square = np.where(stable, np.nan, square)
    return np.where(stable, np.inf, kappa / square), np.sqrt(square)


@lru_cache
def always_stable_above() -> float:
    """The eccentricity above which a rigid rotor is stable at every speed, 0.756030."""
    from scipy.optimize import brentq

    return float(brentq(lambda e: _whirl(e)[1], 0.5, 0.9, xtol=1e-14))


def _whirl(e: float) -> tuple[float, float]:
    """κ and γ²: neither depends on the axes, so that the line of centres may be one of them."""
    out = np.empty((2, 6))
    law(0, np.array([1.0, 1.0, 0.0, 0.0, 1.0]), e, 0.0, 0.0, 0.0, 1.0, out)
    W = np.hypot(*out[:, 0])
    (kxx, kxy), (kyx, kyy) = -out[:, 1:3] / W
    (cxx, cxy), (cyx, cyy) = -out[:, 3:5] / W
    kappa = (cxx * kyy + cyy * kxx - cxy * kyx - cyx * kxy) / (cxx + cyy)
    return kappa, ((kxx - kappa) * (kyy - kappa) - kxy * kyx) / (cxx * cyy - cxy * cyx)
