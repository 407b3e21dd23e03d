"""Propagation of the readings' errors into the corrections: first order, through W and through Y₀.

The corrections D = −W⁺ Y₀ satisfy Wᴴ r = 0 with the residual r = Y₀ + W D. Its differential,
dWᴴ r + Wᴴ (dY₀ + dW D + W dD) = 0, gives

    dD = −W⁺ (dY₀ + dW D) − (WᴴW)⁻¹ dWᴴ r.

The last term vanishes only where the residual does. It is linear in the *conjugate* of dW, hence everything
stands in real, stretched form (`real_jacobian`).

A reading in a check run, with the proposed D mounted, differs from its prediction Y₀ + W D by the errors of
both, dY₀ + dW D, and by its own.
"""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from balancing.data.reading_errors import hermitian, symmetric
from rotorid.base.arrays import ComplexArray, FloatArray
from rotorid.regression import gain, stretch


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
    G = gain(W)
    inverse = G @ G.conj().T  # (WᴴW)⁻¹
    along = -G.T[:, :, None] * np.concatenate(([1.0], D))
    across = np.zeros_like(along)
    across[:, :, 1:] = -inverse * r[:, None, None]
    return real_jacobian(along, across)


def real_jacobian(along: ComplexArray, across: ComplexArray) -> FloatArray:
    """Real matrices (…, 2m, 2n) of the changes δ ↦ along δ + across δ̄, both (…, m, n)."""
    return np.asarray(stretch(along) + stretch(across) * np.tile([1.0, -1.0], across.shape[-1]))


def prediction_covariance(D: ComplexArray, covariance: FloatArray) -> FloatArray:
    """Covariance (N, 2, 2) of Y₀ + W D at given D, from that of each reading's (Y₀, W)."""
    B = stretch([[1.0, *D]])
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


def common_covariance(
    J: FloatArray, common: ComplexArray | None, parameters: ComplexArray | None
) -> tuple[FloatArray, ...]:
    """Covariances (2P, 2P) by errors common at a speed, to the whole run, and of a model's parameters.

    Parameters
    ----------
    J
        Derivatives of the stretched D by (Re Y₀, Im Y₀, Re W₁, …) of each reading, (N, 2P, 2P + 2).
    common, parameters
        As of `balancing.Influence`, (2, M, S, C, P + 1) and (M, S, C, P + 1), N = S C.
    """
    size = J.shape[1]
    run, speed, known = np.zeros((3, 0, size, 2))
    if common is not None:
        _, M, S, C, n = common.shape
        F = stretch(common[..., None]).reshape(2, M, S * C, 2 * n, 2)
        moved = np.einsum("nqz,kmnzu->kmnqu", J, F).reshape(2, M, S, C, size, 2).sum(axis=3)
        run, speed = moved[0].sum(axis=1), moved[1].reshape(M * S, size, 2)
    if parameters is not None:
        F = stretch(parameters[..., None])[..., :1].reshape(len(parameters), *J.shape[::2], 1)
        known = np.einsum("nqz,mnzu->mqu", J, F)
    return tuple(np.einsum("mqu,mpu->qp", part, part) for part in (speed, run, known))


def whitening(
    own: FloatArray, speed: FloatArray, run: FloatArray
) -> tuple[Callable[[FloatArray], FloatArray], FloatArray]:
    """How to divide readings by the root of their joint covariance, and what that consists of.

    Parameters
    ----------
    own
        Covariance of the readings at each speed by errors of their own, (S, n, n).
    speed, run
        Columns of errors common at a speed, (S, n, m), and to all speeds, (S, n, k), as `real_columns`.

    Returns
    -------
    Function of vectors (S, n, j): independent and of variance 1 after it; and shares of the three kinds in
    the mean square of what it makes of errors.
    """
    root = np.linalg.cholesky(symmetric(own + speed @ np.swapaxes(speed, -1, -2)))
    moved = np.linalg.solve(root, run)
    S, n, k = moved.shape
    Q, s, _ = np.linalg.svd(moved.reshape(S * n, k), full_matrices=False)
    less = 1 - 1 / np.sqrt(1 + s**2)

    def white(vectors: FloatArray) -> FloatArray:
        x = np.linalg.solve(root, vectors).reshape(S * n, -1)
        return np.asarray((x - Q @ (less[:, None] * (Q.T @ x))).reshape(vectors.shape))

    whole = float(np.sum(s**2 / (1 + s**2))) / (S * n)
    at_speed = float(np.sum(np.linalg.solve(root, speed) ** 2)) / (S * n)
    return white, np.array([(1 - whole) * (1 - at_speed), (1 - whole) * at_speed, whole])


def real_columns(common: ComplexArray) -> FloatArray:
    """Columns (M, S, n) of complex numbers as real ones, (S, 2n, 2M); every other one is that of Re."""
    return stretch(np.transpose(common, (1, 2, 0)))


def region_radius(dof: float | None, n: int = 2) -> float:
    """Radius of the joint 95 % region of n numbers, in standard deviations (n = 2, stated errors: 2.448)."""
    from scipy.special import chdtri, fdtri

    return float(np.sqrt(chdtri(n, 0.05) if dof is None else n * fdtri(n, dof, 0.95)))


def region_edge(values: ComplexArray, covariance: FloatArray, dof: float | None, points: int) -> ComplexArray:
    """Points (…, points + 1) on the edge of the 95 % region of values (…) of covariance (…, 2, 2)."""
    variances, axes = np.linalg.eigh(covariance)
    turn = np.linspace(0.0, 2 * np.pi, points + 1)
    reach = region_radius(dof) * np.sqrt(np.maximum(variances, 0.0))
    edge = (axes * reach[..., None, :]) @ np.stack((np.cos(turn), np.sin(turn)))
    return np.asarray(values[..., None] + edge[..., 0, :] + 1j * edge[..., 1, :])
