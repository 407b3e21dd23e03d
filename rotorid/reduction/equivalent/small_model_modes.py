"""Natural frequencies and shapes of a model in compliance form, and how alike shapes are."""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike

from rotorid.base.arrays import FloatArray


def natural_frequencies(
    compliance: ArrayLike, masses: ArrayLike, *, seal_stiffness: ArrayLike = 0.0
) -> tuple[FloatArray, FloatArray]:
    """Natural frequencies and shapes of a model in compliance form.

    Parameters
    ----------
    compliance, seal_stiffness
        As in `equivalent_masses`.
    masses
        kg, shape (n,). Masses that are zero or negative are taken as they are.

    Returns
    -------
    Frequencies, rad/s, ascending, shape (n,), NaN where a mode does not vibrate (only with masses that are
    not positive); shapes (n, n), a column per mode, scaled to the largest entry = 1.
    """
    alpha = np.asarray(compliance, dtype=float)
    m = np.asarray(masses, dtype=float)
    n = len(alpha)
    springs = np.broadcast_to(np.asarray(seal_stiffness, dtype=float), (n,))
    flexibility = np.linalg.solve(np.eye(n) + alpha * springs, alpha)
    flexibility = (flexibility + flexibility.T) / 2
    if (m > 0).all():
        root = np.sqrt(m)
        lam, vectors = np.linalg.eigh(root[:, None] * flexibility * root)
        shapes = vectors / root[:, None]
    else:
        complex_lam, complex_shapes = np.linalg.eig(flexibility * m)
        real = np.abs(complex_lam.imag) <= 1e-9 * np.abs(complex_lam)
        lam, shapes = np.where(real, complex_lam.real, np.nan), complex_shapes.real
    with np.errstate(divide="ignore", invalid="ignore"):
        omega = np.where(lam > 1e-15 * np.nanmax(np.abs(lam)), 1.0 / np.sqrt(lam), np.nan)
    order = np.argsort(omega)  # NaN last
    omega, shapes = omega[order], shapes[:, order]
    largest = np.take_along_axis(shapes, np.abs(shapes).argmax(axis=0)[None], axis=0)
    return omega, shapes / largest


def mac(a: ArrayLike, b: ArrayLike) -> FloatArray:
    """Modal assurance criterion between the columns of two sets of shapes.

    Parameters
    ----------
    a, b
        Shapes at the same points, (n, j) and (n, k).

    Returns
    -------
    (j, k), 1 where two shapes are proportional, 0 where they are orthogonal.

    Examples
    --------
    >>> mac([[1.0], [2.0]], [[2.0, 2.0], [4.0, -1.0]])
    array([[1., 0.]])
    """
    A, B = np.asarray(a, dtype=float), np.asarray(b, dtype=float)
    return np.asarray((A.T @ B) ** 2 / np.outer((A**2).sum(axis=0), (B**2).sum(axis=0)))


def like(shapes: FloatArray, reference: FloatArray) -> FloatArray:
    """Scale each column to the least-squares size of the reference column, so that both can be drawn."""
    factor = (shapes * reference).sum(axis=0) / (shapes**2).sum(axis=0)
    weak = np.abs(factor) < 1e-12
    return np.asarray(shapes * np.where(weak, 1.0, factor))
