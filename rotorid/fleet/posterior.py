"""Coefficients of a type of machines and the runs of one machine together.

Known before are W = μ + L ε with independent ε of variance 1 (`Influence.columns`); Y₀ is free. A run reads
Y = Y₀ + W T + e; what e has in common are further unknowns of variance 1. With the rows divided by the errors
of each reading alone this is least squares in (Y₀, ε, …): the posterior of normal errors, all sensors and
speeds together, so that a trial run in one plane also tells of another where machines that differ in one
differ in the other. A bare run: nothing but the type. Many runs: the measured coefficients (shrinkage).
"""

from __future__ import annotations

from contextlib import suppress
from dataclasses import replace

import numpy as np

from balancing import (
    Influence,
    Remarks,
    Trials,
    UndeterminedError,
    estimate_influence,
    local_runs,
    reading_of,
    real_parts,
    usual_run_errors,
)
from balancing.noise import Gaussian, Mounted, kind_sizes, run_noise
from rotorid.regression import covariance_root, unstretch


def update(expected: Influence, trials: Trials) -> tuple[Influence, float]:
    """Coefficients and the bare rotor's readings, from what is known before and from runs.

    Parameters
    ----------
    expected
        Coefficients with columns, as of `MachineType.influence`.
    trials
        Runs with these sensors, speeds and planes; one bare run is enough.

    Returns
    -------
    The coefficients with a baseline, and the probability of readings farther from what was expected, by χ²; 1
    where nothing is spare.

    Raises
    ------
    ValueError
        For runs without these sensors, speeds or planes.
    """
    from scipy.special import chdtrc

    runs = local_runs(expected, trials)
    R, (S, C, P) = len(runs.runs), expected.W.shape
    reading, run = reading_of(runs), usual_run_errors(runs)
    with suppress(UndeterminedError):  # as runs that tell more than the coefficients show them
        _, reading, run, *_ = estimate_influence(runs).errors
    noise = run_noise(runs, expected.W, np.eye(R, dtype=complex), reading, run)
    alone_of, shared = noise.at(kind_sizes(run))  # (S, C, 2R, 2R)
    alone_of += 1e-12 * (np.trace(alone_of, axis1=-2, axis2=-1).max() or 1.0) * np.eye(2 * R)
    columns = expected.columns()
    unknown = np.concatenate((columns @ np.column_stack((np.ones(R), runs.weights)).T, shared))
    root = np.linalg.cholesky(alone_of)
    K = np.linalg.solve(root, np.moveaxis(real_parts(unknown), 0, -1)).reshape(S * C, 2 * R, -1)
    free = np.linalg.solve(root, np.tile(np.eye(2), (R, 1))[None, None]).reshape(S * C, 2 * R, 2)
    difference = np.moveaxis(runs.mean, 0, -1) - expected.W @ runs.weights.T
    y = np.linalg.solve(root, real_parts(difference)[..., None]).reshape(-1, 2 * R)
    N, M, m = 2 * S * C, len(unknown), len(columns)
    A = np.zeros((S * C, 2 * R, N + M))
    for k in range(S * C):
        A[k, :, 2 * k : 2 * k + 2] = free[k]
    A[..., N:] = K
    rows = np.vstack((A.reshape(-1, N + M), np.eye(N + M)[N:]))
    right = np.append(y, np.zeros(M))
    # in units of each column: else small errors of readings in SI leave no variance of the coefficients
    scale = np.linalg.norm(rows, axis=0)
    values = np.linalg.lstsq(rows / scale, right, rcond=None)[0] / scale
    covariance = np.linalg.pinv((rows.T @ rows) / np.outer(scale, scale), hermitian=True)
    covariance /= np.outer(scale, scale)
    moved = np.tensordot(values[N : N + m], columns, 1)
    # what a channel's readings tell of its Y₀ alone, all else given, is its own; the rest is in common
    alone = np.zeros((S, C, 2 * P + 2, 2 * P + 2))
    alone[..., :2, :2] = np.linalg.inv(np.einsum("kij,kil->kjl", free, free)).reshape(S, C, 2, 2)
    joint = covariance[: N + m, : N + m].copy()
    for k, block in enumerate(alone[..., :2, :2].reshape(-1, 2, 2)):
        joint[2 * k : 2 * k + 2, 2 * k : 2 * k + 2] -= block
    factors = covariance_root(joint, np.diag(covariance)[: N + m]).T
    common = np.tensordot(factors[:, N:], columns, 1)
    common[..., 0] += unstretch(factors[:, :N]).reshape(-1, S, C)
    mounted = Mounted(runs.runs[-1], expected.planes, runs.weights[-1])
    warnings = dict.fromkeys((*expected.remarks.warnings, *trials.warnings, *reading.warnings))
    result = replace(
        expected,
        W=expected.W + moved[..., 1:],
        baseline=(values[:N:2] + 1j * values[1:N:2]).reshape(S, C) + moved[..., 0],
        errors=Gaussian(alone, common, reading, run, mounted),
        labels=trials.labels,
        remarks=Remarks(tuple(warnings)),
    )
    spare = N * (R - 1)
    return result, float(chdtrc(spare, np.sum((rows @ values - right) ** 2))) if spare else 1.0
