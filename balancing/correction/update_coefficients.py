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
from balancing.coefficients.repeatability import both_directions, describe, differences
from balancing.coefficients.run_error_estimate import known_run_errors
from balancing.coefficients.run_errors import RunErrors, Runs, marginal, run_columns, runs_of
from balancing.data.reading_errors import (
    EQUAL,
    ErrorModel,
    error_model,
    mean_covariance,
    mean_variance,
    symmetric,
)
from balancing.data.trials import Trials
from balancing.solvers.error_propagation import real_columns, whitening
from rotorid.base.arrays import ComplexArray, FloatArray
from rotorid.regression import covariance_root, least_squares, stretch, unstretch


def update(known: Influence, trials: Trials) -> tuple[Influence, float]:
    """Coefficients and the bare rotor's readings, from what is known and from runs.

    Known are coefficients with `parameters`, as of `MachineType.influence`; one bare run is enough. Beside
    the coefficients with a baseline it gives the probability of readings farther from what was known, by χ²;
    1 where nothing is spare. ValueError for runs without these sensors, speeds or planes.
    """
    from scipy.special import chdtrc

    speeds, sensors = places(known, trials)
    pick = np.ix_(range(len(trials.runs)), speeds, sensors)
    mounted, Y = mounted_weights(known, trials), trials.mean[pick]
    runs = runs_of(Y, mounted, known.W)
    model, between = _errors(trials, runs)
    shared = run_columns(between, runs)
    own = _own(trials, model)[pick] + shared.own[..., None, None] * np.eye(2)
    own += EQUAL * (mean_variance(own).max() or 1.0) * np.eye(2)  # a reading of zero has none
    assert known.parameters is not None
    S, C, P = known.W.shape
    N, n = 2 * S * C, 2 * S * C + len(known.parameters)
    F = np.zeros((n, S * C, 2 * P + 2))  # (Y₀, W) of each channel by each of θ
    F[:N, :, :2] = np.eye(N).reshape(N, -1, 2)
    F[N:] = stretch(known.parameters.ravel()).reshape(n - N, S * C, -1)
    B = stretch(np.column_stack((np.ones(len(Y)), mounted))[:, None])  # a reading of each run by (Y₀, W)
    white = np.array([_white(own[r], shared.common[:, r]) for r in range(len(Y))])
    K = white @ np.einsum("nkm,rim->rkin", F, B).reshape(-1, N, n)
    y = white @ stretch((Y - runs.effect).ravel()).reshape(-1, N, 1)
    rows = np.vstack((*K, np.eye(n)[N:]))
    found = least_squares(rows, np.append(y, np.zeros(n - N)), sigma=1.0)
    assert found.solution_covariance is not None
    assert found.chi_square is not None
    F = F.reshape(n, -1)
    moves = F.T @ found.solution_covariance
    gains = (moves @ np.swapaxes(K, 1, 2) @ white).reshape(-1, S * C, 2 * P + 2, S * C, 2)
    alone, columns = _split(moves @ F, gains, own.reshape(-1, S * C, 2, 2))
    parameters = columns.reshape(-1, S, C, P + 1)
    change = unstretch(found.solution @ F).reshape(S, C, -1)
    repeated = describe(differences(trials, model))
    said = *known.warnings, *trials.warnings, *repeated, *model.warnings
    result = replace(
        known,
        W=known.W + change[..., 1:],
        baseline=change[..., 0],
        parameters=parameters,
        covariance=alone.reshape(S, C, 2 * P + 2, -1) + marginal(None, parameters),
        errors=model.errors,
        error_source=model.source,
        reading_dof=model.dof,
        run_errors=between,
        labels=trials.labels,
        last_run=trials.runs[-1] if mounted[-1].any() else None,
        last_weights=mounted[-1],
        warnings=tuple(dict.fromkeys(said)),
        contradictions=repeated,
    )
    return result, float(chdtrc(found.dof, found.chi_square)) if found.dof else 1.0


def _errors(trials: Trials, runs: Runs) -> tuple[ErrorModel, RunErrors]:
    """Of the readings and between the runs: as runs that tell more than the coefficients show them."""
    model = error_model(trials)
    try:
        found = estimate_influence(trials)
    except UndeterminedError:
        return model, known_run_errors(trials, runs)
    shown = ErrorModel(found.errors, found.reading_dof, found.error_source, model.warnings)
    return shown, found.run_errors


def _own(trials: Trials, model: ErrorModel) -> FloatArray:
    """Covariance (R, S, C, 2, 2) of readings; an error that is not stated is that of the other direction."""
    assert model.errors is not None
    return mean_covariance(trials, replace(model, errors=both_directions(model.errors)))


def _white(own: FloatArray, common: ComplexArray) -> FloatArray:
    """What divides the stretched readings of a run by the root of their covariance, (2 S C, 2 S C)."""
    S, C = own.shape[:2]
    blocks = np.einsum("scij,cd->scidj", own, np.eye(C)).reshape(S, 2 * C, 2 * C)
    white, _ = whitening(blocks, real_columns(common[1]), real_columns(common[0]))
    return white(np.eye(2 * S * C).reshape(S, 2 * C, -1)).reshape(2 * S * C, -1)


def _split(covariance: FloatArray, gains: FloatArray, own: FloatArray) -> tuple[FloatArray, ComplexArray]:
    """What channels put into their own (Y₀, W), (S C, n, n), n = 2P + 2; columns (M, S C n / 2) of the rest.

    Of the covariance (S C n, S C n), with the gains (R, S C, n, S C, 2) of the readings of each run and their
    own covariances (R, S C, 2, 2).
    """
    from scipy.linalg import block_diag

    G = np.einsum("rknkj->rknj", gains)
    alone = symmetric(np.sum(G @ own @ np.swapaxes(G, -1, -2), axis=0))
    rest = covariance - block_diag(*alone)
    return alone, unstretch(covariance_root(rest, np.diag(covariance)).T)
