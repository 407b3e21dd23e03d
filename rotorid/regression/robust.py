"""Loss functions that give gross errors less weight, and what they do to the spread of an estimate."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from rotorid.base.arrays import FloatArray
from rotorid.base.choices import Method, find

Rho = Callable[[FloatArray], tuple[FloatArray, FloatArray, FloatArray]]


@dataclass(frozen=True)
class Loss:
    """A loss ρ of squared scaled residuals.

    Attributes
    ----------
    tuning
        Residual, in standard deviations, above which it begins to discount: there it loses 5 % of efficiency
        on normal errors (Huber 1981; Holland & Welsch 1977).
    rho
        ρ, its first and its second derivative at z (m,), as scipy has them.
    """

    tuning: float
    rho: Rho


def _linear(z: FloatArray) -> tuple[FloatArray, FloatArray, FloatArray]:
    return z, np.ones_like(z), np.zeros_like(z)


def _huber(z: FloatArray) -> tuple[FloatArray, FloatArray, FloatArray]:
    near, root = z <= 1, np.sqrt(np.maximum(z, 1.0))
    return np.where(near, z, 2 * root - 1), 1 / root, np.where(near, 0.0, -0.5 / root**3)


def _soft_l1(z: FloatArray) -> tuple[FloatArray, FloatArray, FloatArray]:
    root = np.sqrt(1 + z)
    return 2 * (root - 1), 1 / root, -0.5 / root**3


def _cauchy(z: FloatArray) -> tuple[FloatArray, FloatArray, FloatArray]:
    return np.log1p(z), 1 / (1 + z), -1 / (1 + z) ** 2


LOSSES = (
    Method("linear", "least squares", Loss(1.0, _linear)),
    Method("soft_l1", "a smooth Huber", Loss(1.345, _soft_l1)),
    Method("huber", "gross errors count by their size, not its square", Loss(1.345, _huber)),
    Method("cauchy", "gross errors count hardly at all", Loss(2.385, _cauchy)),
)


def tuning(loss: str) -> float:
    """Residual, in standard deviations, above which a loss begins to discount."""
    return find(LOSSES, loss, "loss").function.tuning


def spread(r: FloatArray) -> float:
    """Robust standard deviation of residuals (m,): 1.4826 times their median size."""
    size = 1.4826 * float(np.median(np.abs(r)))
    return size if size > 0 else max(float(np.sqrt(np.mean(r**2))), np.finfo(float).tiny)


def cost(r: FloatArray, loss: str, scale: float) -> float:
    """Half the sum of the loss of residuals (m,), as scipy counts it."""
    rho, _, _ = find(LOSSES, loss, "loss").function.rho((r / scale) ** 2)
    return 0.5 * scale**2 * float(rho.sum())


def pseudo_residuals(r: FloatArray, loss: str, scale: float) -> FloatArray:
    """Residuals whose least-squares step and variance are those of the robust estimate.

    ψ(r) over the mean of ψ′: the classical covariance of an M-estimator, s² (JᵀJ)⁻¹ with s² from these
    (Huber 1981, section 7.6).
    """
    z = (r / scale) ** 2
    _, first, second = find(LOSSES, loss, "loss").function.rho(z)
    slope = first + 2 * z * second
    return np.asarray(r * first / max(float(slope.mean()), 0.05))
