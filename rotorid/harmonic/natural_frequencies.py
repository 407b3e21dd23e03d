"""Natural frequency and shape predicted by an operator model, with exact derivatives."""

from __future__ import annotations

import numpy as np

from rotorid.base.arrays import FloatArray

MAC_SLACK = 0.02
"""Modes whose MAC is this near to the best count as equally like; the nearest frequency decides."""


def natural_modes(A: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Positive real z = ω² with Σ A_k z^k singular, and shapes.

    Parameters
    ----------
    A
        Shape (k, e, e).

    Returns
    -------
    z (modes,), ascending, and shapes (e, modes), each of unit length. Complex, negative and infinite
    z are left out: they belong to no free vibration.
    """
    from scipy.linalg import eig

    degree, e = len(A) - 1, A.shape[1]
    if degree < 1:
        return np.zeros(0), np.zeros((e, 0))
    # companion form L y = z R y with y = (v, z v, …); z scaled so that its matrices are of one size
    sizes = [float(np.abs(a).max()) for a in A]
    unit = (sizes[0] / sizes[-1]) ** (1 / degree) if sizes[0] > 0 and sizes[-1] > 0 else 1.0
    scaled = A * unit ** np.arange(degree + 1)[:, None, None]
    L, R = np.eye(degree * e, k=e), np.eye(degree * e)
    L[-e:] = -np.hstack([*scaled[:-1]])
    R[-e:, -e:] = scaled[-1]
    (alpha, beta), y = eig(L, R, homogeneous_eigvals=True)
    with np.errstate(divide="ignore", invalid="ignore"):
        z = alpha / beta
    good = np.isfinite(z) & (np.abs(z.imag) <= 1e-8 * np.abs(z)) & (z.real > 1e-12)
    z, v = z[good].real * unit, y[:e, good]
    # an eigenvector of a real mode is real up to a factor
    turn = v[np.abs(v).argmax(axis=0), np.arange(v.shape[1])]
    v = (v / turn).real
    order = np.argsort(z)
    return z[order], v[:, order] / np.linalg.norm(v[:, order], axis=0)


def nearest_mode(
    z: FloatArray, v: FloatArray, frequency: float, shape: FloatArray
) -> tuple[float, FloatArray] | None:
    """The mode most like a measured shape (NaN: not measured) by MAC; among equals the nearest frequency."""
    if not len(z):
        return None
    seen = ~np.isnan(shape)
    u, w = shape[seen], v[seen]
    size = (w * w).sum(axis=0) * float(u @ u)
    mac = np.divide((u @ w) ** 2, size, out=np.zeros_like(z), where=size > 0)
    away = np.abs(np.log(np.sqrt(z) / frequency))
    like = np.flatnonzero(mac >= mac.max() - MAC_SLACK)
    best = int(like[np.argmin(away[like])])
    return float(z[best]), np.asarray(v[:, best])


def mode_slopes(
    A: FloatArray, dA: FloatArray, z: float, v: FloatArray, reference: int
) -> tuple[FloatArray, FloatArray]:
    """Derivatives of z (n,) and of the shape (e, n) whose entry `reference` is kept at 1.

    From A(z; θ) v = 0: A dv + A′ v dz = −dA/dθ v, bordered by dv[reference] = 0.

    Parameters
    ----------
    A, dA
        Shapes (k, e, e) and (k, e, e, n).
    z
        Eigenvalue.
    v
        Shape (e,), v[reference] = 1.
    reference
        Index.
    """
    k = np.arange(len(A))
    powers = z**k
    whole = np.tensordot(powers, A, axes=1)
    slope = np.tensordot(k[1:] * powers[:-1], A[1:], axes=1)
    force = -np.einsum("k,keon,o->en", powers, dA, v)
    e = len(v)
    bordered = np.zeros((e + 1, e + 1))
    bordered[:e, :e] = whole
    bordered[:e, e] = slope @ v * z  # unknown: relative change of z, of the size of the others
    bordered[e, reference] = 1.0
    rows = np.abs(bordered).max(axis=1)
    rows[rows == 0] = 1.0
    solved = np.linalg.solve(
        bordered / rows[:, None], np.vstack((force, np.zeros(force.shape[1]))) / rows[:, None]
    )
    return solved[e] * z, solved[:e]
