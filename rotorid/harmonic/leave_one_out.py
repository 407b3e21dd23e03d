"""How much a single experiment decides: the estimate without it, from its leverage."""

from __future__ import annotations

import numpy as np

from rotorid.base.arrays import FloatArray, IntArray


def leave_one_out(K: FloatArray, Y: FloatArray, experiment: IntArray, count: int) -> FloatArray:
    """Change of a least-squares estimate when the rows of one experiment are left out.

    Parameters
    ----------
    K, Y
        Rows (m, u), (m,), weighted.
    experiment
        Of each row (m,), from 0.
    count
        Number of experiments.

    Returns
    -------
    (count, u): estimate without the experiment minus estimate with all; NaN where the others do not determine
    the unknowns. Exact, from the leverage block H_ii: −(KᵀK)⁻¹ K_iᵀ (1 − H_ii)⁻¹ r_i.
    """
    scale = np.linalg.norm(K, axis=0)
    scale[scale == 0] = 1.0
    U, s, Vt = np.linalg.svd(K / scale, full_matrices=False)
    rank = int(np.count_nonzero(s > 1e-12 * s[0])) if s[0] > 0 else 0
    U, back = U[:, :rank], (Vt[:rank].T / s[:rank]) / scale[:, None]
    residual = Y - U @ (U.T @ Y)
    change = np.zeros((count, K.shape[1]))
    for i in range(count):
        own = U[experiment == i]
        if not len(own):
            continue
        left = np.eye(rank) - own.T @ own  # normal matrix of the others, in the basis U
        values = np.linalg.eigvalsh(left)
        if not rank or values[0] < 1e-9:
            change[i] = np.nan
            continue
        change[i] = -back @ np.linalg.solve(left, own.T @ residual[experiment == i])
    return change
