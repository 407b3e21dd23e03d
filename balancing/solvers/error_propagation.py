"""How errors of the readings go through the corrections: first order, through W and through Y₀.

The corrections D = −W⁺ Y₀ satisfy Wᴴ r = 0 with the residual r = Y₀ + W D. Its differential,
dWᴴ r + Wᴴ (dY₀ + dW D + W dD) = 0, gives

    dD = −W⁺ (dY₀ + dW D) − (WᴴW)⁻¹ dWᴴ r.

The last term vanishes only where the residual does. It is linear in the *conjugate* of dW, hence everything
stands in real, stretched form: z as [[Re z, −Im z], [Im z, Re z]], and dW ↦ conj(dW) r as
[[Re r, Im r], [Im r, −Re r]].

A reading in a check run, with the proposed D mounted, differs from its prediction Y₀ + W D by the errors of
both, dY₀ + dW D, and by its own.
"""

from __future__ import annotations

import numpy as np

from balancing.coefficients.resolution import hermitian
from balancing.data.errors import symmetric
from rotorid.base.arrays import ComplexArray, FloatArray
from rotorid.regression import gain


def correction_jacobian(W: ComplexArray, D: ComplexArray, r: ComplexArray) -> FloatArray:
    """Derivatives of the stretched D by (Re Y₀, Im Y₀, Re W₁, …) of each reading.

    Parameters
    ----------
    W
        Shape (N, P).
    D
        Corrections, shape (P,).
    r
        Residual Y₀ + W D, shape (N,).

    Returns
    -------
    Shape (N, 2P, 2P + 2).
    """
    N, P = W.shape
    pinv = gain(W)
    inverse = pinv @ pinv.conj().T  # (WᴴW)⁻¹
    J = np.empty((N, P, 2, P + 1, 2))
    J[:, :, :, 0] = -_block(pinv.T)
    along = _block(pinv.T[:, :, None] * D)  # (N, P, P, 2, 2)
    mirrored = np.empty((N, 2, 2))
    mirrored[:, 0, 0], mirrored[:, 1, 1] = r.real, -r.real
    mirrored[:, 0, 1] = mirrored[:, 1, 0] = r.imag
    across = np.einsum("pqab,nbc->npqac", _block(inverse), mirrored)
    J[:, :, :, 1:] = -np.swapaxes(along + across, 2, 3)
    return J.reshape(N, 2 * P, 2 * P + 2)


def correction_covariance(
    W: ComplexArray, D: ComplexArray, r: ComplexArray, covariance: FloatArray
) -> FloatArray:
    """Covariance (2P, 2P) of the stretched D from that of each reading's (Y₀, W), (N, 2P + 2, 2P + 2)."""
    J = correction_jacobian(W, D, r)
    return symmetric(np.sum(J @ covariance @ np.swapaxes(J, 1, 2), axis=0))


def prediction_covariance(D: ComplexArray, covariance: FloatArray) -> FloatArray:
    """Covariance (N, 2, 2) of Y₀ + W D at given D, from that of each reading's (Y₀, W)."""
    B = np.concatenate([_block(np.asarray(z)) for z in (1.0, *D)], axis=1)
    return symmetric(B @ covariance @ B.T)


def error_form(covariance: FloatArray, row_weights: FloatArray | None = None) -> ComplexArray:
    """F (P + 1, P + 1): zᴴ F z is the mean square error of (Y₀, W) z, summed over the readings.

    Parameters
    ----------
    covariance
        Of (Y₀, W) of each reading, (N, 2P + 2, 2P + 2).
    row_weights
        Of the readings, (N,); default 1.
    """
    rows = np.ones(len(covariance)) if row_weights is None else np.asarray(row_weights) ** 2
    return np.asarray(2 * np.einsum("n,npq->qp", rows, hermitian(covariance)))


def common_covariance(J: FloatArray, common: ComplexArray) -> tuple[FloatArray, FloatArray]:
    """Covariances (2P, 2P) by errors that readings have in common: those of the whole run, of each speed.

    Parameters
    ----------
    J
        Derivatives of the stretched D by (Re Y₀, Im Y₀, Re W₁, …) of each reading, (N, 2P, 2P + 2).
    common
        As `balancing.Influence.common`, (2, M, S, C, P + 1), N = S C.
    """
    _, M, S, C, n = common.shape
    columns = np.stack((common, 1j * common), axis=-1).view(np.float64).reshape(2, M, S, C, n, 2, 2)
    F = np.swapaxes(columns, -1, -2).reshape(2, M, S * C, 2 * n, 2)
    moved = np.einsum("nqz,kmnzu->kmnqu", J, F).reshape(2, M, S, C, -1, 2).sum(axis=3)
    run, speed = moved[0].sum(axis=1), moved[1].reshape(M * S, -1, 2)
    first, second = (np.einsum("mqu,mpu->qp", part, part) for part in (run, speed))
    return first, second


def region_radius(dof: float | None) -> float:
    """Radius of the 95 % region of a vector in a plane, in standard deviations (2.448 for stated errors)."""
    from scipy.special import chdtri, fdtri

    return float(np.sqrt(chdtri(2, 0.05) if dof is None else 2 * fdtri(2, dof, 0.95)))


def _block(z: ComplexArray) -> FloatArray:
    """Stretch every number of an array (…) into its 2 × 2 block, (…, 2, 2)."""
    out = np.empty((*z.shape, 2, 2))
    out[..., 0, 0] = out[..., 1, 1] = z.real
    out[..., 0, 1] = -z.imag
    out[..., 1, 0] = z.imag
    return out
