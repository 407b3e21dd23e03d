"""Equivalent masses of a rotor by regression over its modes, formula (50).

Free vibration of n masses in compliance form ([S] (49)), with springs c to the ground at the masses
(seals), is `x + α (M x″ + C x) = 0`. In a mode (λ = 1/ω², shape U) this reads

    Σ_j α_ij U_jk m_j = λ_k (U_ik + Σ_j α_ij c_j U_jk)          for every mass i and mode k,

linear in the masses: formula (50) of [S]. The rows stand as in the book: unweighted, every shape scaled to
1 at the first mass.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike, NDArray

from rotorid.regression import Estimate, least_squares

FloatArray = NDArray[np.float64]


def equivalent_masses(
    compliance: ArrayLike, frequencies: ArrayLike, shapes: ArrayLike, *, seal_stiffness: ArrayLike = 0.0
) -> Estimate:
    """Estimate the masses of an n-mass model from k modes, [S] (50).

    Parameters
    ----------
    compliance
        Deflection at mass i under unit force at mass j, m/N, shape (n, n), symmetric.
    frequencies
        Natural frequencies of the k modes, rad/s, shape (k,).
    shapes
        Mode shapes at the masses, shape (n, k); scaled to 1 at the first mass before use.
    seal_stiffness
        Of springs from each mass to the ground that `compliance` does not hold, N/m, shape (n,) or scalar.

    Returns
    -------
    Estimate of m1 … mn, kg.

    Raises
    ------
    ValueError
        For shapes that do not fit, frequencies that are not positive, or a mode with a node at the first
        mass (it cannot be scaled there).

    Examples
    --------
    >>> estimate = equivalent_masses([[2e-8, 1e-8], [1e-8, 2e-8]], [1e3], [[1.0], [1.0]])
    >>> estimate.values.round(3)
    array([33.333, 33.333])
    """
    alpha = np.asarray(compliance, dtype=float)
    omega = np.atleast_1d(np.asarray(frequencies, dtype=float))
    U = np.asarray(shapes, dtype=float)
    n = len(alpha)
    if alpha.shape != (n, n) or U.shape != (n, len(omega)):
        raise ValueError(
            f"compliance must be (n, n) and shapes (n, k) for k frequencies; got {alpha.shape}, {U.shape} "
            f"and {len(omega)} frequencies"
        )
    if not (omega > 0).all():
        raise ValueError("natural frequencies must be positive: a rigid-body mode determines no masses")
    if (np.abs(U[0]) < 1e-9 * np.abs(U).max(axis=0)).any():
        raise ValueError("a mode has a node at the first mass; choose another node for the first mass")
    U = U / U[0]
    springs = np.broadcast_to(np.asarray(seal_stiffness, dtype=float), (n,))
    B = np.concatenate([alpha * U[:, k] for k in range(len(omega))])
    D = ((U + alpha @ (springs[:, None] * U)) / omega**2).T.reshape(-1)
    return least_squares(B, D, names=[f"m{i + 1}" for i in range(n)])
