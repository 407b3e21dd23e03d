"""What errors of the inputs do to the masses of formula (50)."""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike, NDArray

from rotorid.reduction.masses import equivalent_masses

FloatArray = NDArray[np.float64]


def mass_sensitivity(compliance: ArrayLike, frequencies: ArrayLike, shapes: ArrayLike) -> FloatArray:
    """Say how much errors of the inputs move the masses of (50).

    Parameters
    ----------
    compliance, frequencies, shapes
        As in `equivalent_masses`.

    Returns
    -------
    Standard deviation of each mass over its value, per unit relative standard deviation of every compliance
    (symmetric) and every shape ordinate except the first, all independent; shape (n,). First order.
    """
    alpha, omega = np.asarray(compliance, dtype=float), np.atleast_1d(np.asarray(frequencies, dtype=float))
    U = np.asarray(shapes, dtype=float)
    U = U / U[0]
    n, step = len(alpha), 1e-6
    variance = np.zeros(n)
    masses = equivalent_masses(alpha, omega, U).solution

    def add(change: FloatArray) -> None:
        nonlocal variance
        variance = variance + (change / (2 * step * masses)) ** 2

    for i in range(n):
        for j in range(i + 1):
            bump = np.ones((n, n))
            bump[i, j] = bump[j, i] = 1 + step
            up, down = alpha * bump, alpha * (2 - bump)
            add(equivalent_masses(up, omega, U).solution - equivalent_masses(down, omega, U).solution)
    for i in range(1, n):
        for k in range(len(omega)):
            bump = np.ones_like(U)
            bump[i, k] = 1 + step
            up, down = U * bump, U * (2 - bump)
            add(equivalent_masses(alpha, omega, up).solution - equivalent_masses(alpha, omega, down).solution)
    return np.asarray(np.sqrt(variance))
