"""What is known of coefficients before, brought up to date by runs: trial runs, check runs, or a bare one.

Known before are W = μ + L ε with independent ε of variance 1 (`Influence.parameters`); Y₀ is free. A run
reads Y_r = Y₀ + W T_r + e_r. With the rows divided by the root of the covariance of e_r, what it has in
common included, and the rows ε = 0 below them, this is least squares in θ = (Y₀, ε): the posterior of normal
errors, all sensors and speeds together, so that a trial run in one plane also tells of another where machines
that differ in one differ in the other. A bare run: nothing but the type. Many runs: the measured coefficients
(shrinkage).

Of its errors, what a channel's own readings put into its own (Y₀, W) is the channel's; by that, corrections
weigh readings. All else, also what is left of ε, is common to the channels (`Influence.parameters`).
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from balancing.coefficients.baseline import mounted_weights, places
from balancing.coefficients.identifiability import UndeterminedError
from balancing.coefficients.influence import Influence, estimate_influence
from balancing.coefficients.run_error_estimate import known_run_errors
from balancing.coefficients.run_errors import marginal, run_columns, runs_of
from balancing.data.reading_errors import error_model, mean_covariance, symmetric
from balancing.data.trials import Trials
from balancing.solvers.error_propagation import real_columns, whitening
from rotorid.base.arrays import ComplexArray, FloatArray
from rotorid.regression import least_squares, stack, stretch, unstretch


def update(known: Influence, trials: Trials) -> tuple[Influence, float]:
    """Coefficients and the bare rotor's readings, from what is known and from runs.

    Parameters
    ----------
    known
        Coefficients with `parameters`, as of `MachineType.influence`.
    trials
        Runs of at least the speeds and sensors of the coefficients; one run without weights is enough.

    Returns
    -------
    Influence
        With a baseline.
    probability
        Of readings farther from what was known than these, by χ²; 1 where nothing is spare.

    Raises
    ------
    ValueError
        For runs without these sensors, speeds or planes.
    """
    from scipy.special import chdtrc

    speeds, sensors = places(known, trials)
    pick = np.ix_(range(len(trials.runs)), speeds, sensors)
    mounted, Y, model = mounted_weights(known, trials), trials.mean[pick], error_model(trials)
    runs = runs_of(Y, mounted, known.W)
    try:
        between = estimate_influence(trials).run_errors
    except UndeterminedError:  # nothing is spare
        between = known_run_errors(trials, runs)
    columns = run_columns(between, runs)
    own = mean_covariance(trials, model)[pick] + columns.own[..., None, None] * np.eye(2)
    S, C = Y.shape[1:]
    N = 2 * S * C
    assert known.parameters is not None
    L = np.moveaxis(known.parameters[..., 1:], 0, -1).reshape(S * C, len(known.planes), -1)
    K, y, whites = [], [], []
    for r, T in enumerate(mounted):
        white = _white(own[r], columns.common[:, r])
        K.append(white @ np.column_stack((np.eye(N), stack(np.einsum("npm,p->nm", L, T)))))
        y.append(white @ stretch((Y[r] - known.W @ T).ravel()))
        whites.append(white)
    n = L.shape[-1]
    found = least_squares(np.vstack((*K, np.eye(N + n)[N:])), np.concatenate((*y, np.zeros(n))), sigma=1.0)
    C_theta = found.solution_covariance
    assert C_theta is not None
    assert found.chi_square is not None

    def channels(theta: FloatArray) -> ComplexArray:
        """(Y₀, W) of each channel by columns (N + n, k) of θ, (k, S, C, P + 1)."""
        W = np.einsum("npm,mk->knp", L, theta[N:])
        return np.concatenate((unstretch(theta[:N].T)[..., None], W), axis=-1).reshape(
            -1, S, C, W.shape[-1] + 1
        )

    change = channels(found.solution[:, None])[0]
    gains = [channels(C_theta @ K_r.T @ white) for K_r, white in zip(K, whites, strict=True)]
    alone = sum((_own(G, own[r]) for r, G in enumerate(gains)), np.zeros(()))
    parameters = _shared(channels(_root(C_theta, np.diag(C_theta))), alone)
    last = bool(mounted[-1].any())
    result = replace(
        known,
        W=known.W + change[..., 1:],
        baseline=change[..., 0],
        parameters=parameters,
        covariance=alone + marginal(None, parameters),
        errors=model.errors,
        error_source=model.source,
        reading_dof=model.dof,
        run_errors=between,
        labels=trials.labels,
        last_run=trials.runs[-1] if last else None,
        last_weights=mounted[-1],
        warnings=tuple(dict.fromkeys((*known.warnings, *trials.warnings, *model.warnings))),
    )
    return result, float(chdtrc(found.dof, found.chi_square)) if found.dof else 1.0


def _white(own: FloatArray, common: ComplexArray) -> FloatArray:
    """What divides the stretched readings of a run by the root of their covariance, (2 S C, 2 S C)."""
    S, C = own.shape[:2]
    blocks = np.einsum("scij,cd->scidj", own, np.eye(C)).reshape(S, 2 * C, 2 * C)
    white, _ = whitening(blocks, real_columns(common[1]), real_columns(common[0]))
    return white(np.eye(2 * S * C).reshape(S, 2 * C, -1)).reshape(2 * S * C, -1)


def _own(gains: ComplexArray, own: FloatArray) -> FloatArray:
    """Covariances (S, C, 2P + 2, 2P + 2) by errors (S, C, 2, 2) of a run's readings in their own channel.

    The gains (2 S C, S, C, P + 1) are those of each real reading.
    """
    S, C = own.shape[:2]
    each = _real(gains).reshape(S, C, 2, S, C, -1)
    G = np.einsum("scuscn->scnu", each)
    return symmetric(G @ own @ np.swapaxes(G, -1, -2))


def _shared(columns: ComplexArray, own: FloatArray) -> ComplexArray:
    """Columns (M, S, C, P + 1) of a whole covariance that has such columns, less that of single channels."""
    shape = columns.shape[1:]
    F = _real(columns).reshape(len(columns), -1)
    rest = (F.T @ F).reshape(own.shape[0] * own.shape[1], own.shape[-1], -1, own.shape[-1])
    k = np.arange(len(rest))
    rest[k, :, k] -= own.reshape(len(rest), *own.shape[-2:])
    root = _root(rest.reshape(F.shape[1], -1), np.sum(F**2, axis=0))
    return unstretch(root.T).reshape(-1, *shape)


def _real(columns: ComplexArray) -> FloatArray:
    """Complex numbers (…, n) as real ones, (…, 2n)."""
    return stretch(columns[..., None])[..., 0]


def _root(covariance: FloatArray, variance: FloatArray) -> FloatArray:
    """Columns of a covariance, what is negative left out; numbers in units of their own size."""
    size = np.sqrt(variance)
    size = np.where(size > 0, size, 1.0)
    values, vectors = np.linalg.eigh(symmetric(covariance / np.outer(size, size)))
    return np.asarray(size[:, None] * vectors * np.sqrt(values.clip(0.0)))
