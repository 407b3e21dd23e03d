"""Loss functions that give gross errors less weight, and what they do to the spread of an estimate."""

from __future__ import annotations

import numpy as np

from rotorid.base.arrays import FloatArray

LOSSES = ("linear", "huber", "soft_l1", "cauchy")
# Scale at which each loses 5 % of efficiency on normal errors (Huber 1981; Holland & Welsch 1977);
# soft_l1 is a smooth Huber and takes its constant.
_TUNING = {"linear": 1.0, "huber": 1.345, "soft_l1": 1.345, "cauchy": 2.385}


def tuning(loss: str) -> float:
    """Residual, in standard deviations, above which a loss begins to discount."""
    return _TUNING[loss]


def spread(r: FloatArray) -> float:
    """Robust standard deviation of residuals (m,): 1.4826 times their median size."""
    size = 1.4826 * float(np.median(np.abs(r)))
    return size if size > 0 else max(float(np.sqrt(np.mean(r**2))), np.finfo(float).tiny)


def cost(r: FloatArray, loss: str, scale: float) -> float:
    """Half the sum of the loss of residuals (m,), as scipy counts it."""
    z = (r / scale) ** 2
    if loss == "linear":
        return 0.5 * float(r @ r)
    if loss == "huber":
        rho = np.where(z <= 1, z, 2 * np.sqrt(np.maximum(z, 1.0)) - 1)
    elif loss == "soft_l1":
        rho = 2 * (np.sqrt(1 + z) - 1)
    else:
        rho = np.log1p(z)
    return 0.5 * scale**2 * float(rho.sum())


def pseudo_residuals(r: FloatArray, loss: str, scale: float) -> FloatArray:
    """Residuals whose least-squares step and variance are those of the robust estimate.

    ψ(r) over the mean of ψ′: the classical covariance of an M-estimator, s² (JᵀJ)⁻¹ with s² from these
    (Huber 1981, section 7.6).
    """
    if loss == "linear":
        return r
    z = (r / scale) ** 2
    if loss == "huber":
        psi = np.clip(r, -scale, scale)
        slope = (z <= 1).astype(np.float64)
    elif loss == "soft_l1":
        psi = r / np.sqrt(1 + z)
        slope = (1 + z) ** -1.5
    else:
        psi = r / (1 + z)
        slope = (1 - z) / (1 + z) ** 2
    return np.asarray(psi / max(float(slope.mean()), 0.05))
