"""What is known of coefficients before, brought up to date by runs: trial runs, check runs, or a bare one.

Known before are W = μ + L ε with independent ε of variance 1 (`Influence.parameters`) and, after a first
update, Y₀ alike; else Y₀ is free. A run reads Y_r = Y₀ + W T_r + e_r. With the rows divided by the root of
the covariance of e_r, what it has in common included, and the rows ε = 0 below them, this is least squares
in (Y₀, ε): the posterior of normal errors, all sensors and speeds together, so that a trial run in one plane
also tells of another where machines that differ in one differ in the other. No run: nothing but the type.
Many runs: the measured coefficients (shrinkage).
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from balancing.coefficients.baseline import mounted_weights, places
from balancing.coefficients.influence import Influence
from balancing.coefficients.run_error_estimate import known_run_errors
from balancing.coefficients.run_errors import marginal, run_columns, runs_of
from balancing.data.reading_errors import error_model, mean_covariance
from balancing.data.trials import Trials
from balancing.solvers.error_propagation import real_columns, whitening
from rotorid.regression import least_squares, stack, stretch, unstretch

OWN = 0.01
"""Of the variance of each channel, added as its own: by that, corrections weigh readings.

What these have in common, `Influence.parameters`, counts in the errors of the answer, but not in weights.
"""


def update(known: Influence, trials: Trials) -> tuple[Influence, float]:
    """Coefficients and the bare rotor's readings, from what is known and from runs.

    Parameters
    ----------
    known
        Coefficients with `parameters`: of a type (`MachineType.influence`), or of an earlier update.
    trials
        Runs of at least the speeds and sensors of the coefficients; one run without weights is enough.

    Returns
    -------
    Influence
        With a baseline, and all that is not known in `parameters`.
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
    between = known_run_errors(trials, runs)
    columns = run_columns(between, runs)
    own = mean_covariance(trials, model)[pick] + columns.own[..., None, None] * np.eye(2)
    S, C = Y.shape[1:]
    assert known.parameters is not None
    F = np.moveaxis(known.parameters, 0, -1)  # (S, C, P + 1, M)
    M, free = F.shape[-1], 2 * S * C if known.baseline is None else 0
    start = np.zeros((S, C)) if known.baseline is None else known.baseline
    K, y = [], []
    for r, T in enumerate(mounted):
        blocks = np.zeros((S, 2 * C, 2 * C))
        for c in range(C):
            blocks[:, 2 * c : 2 * c + 2, 2 * c : 2 * c + 2] = own[r, :, c]
        white, _ = whitening(blocks, *(real_columns(columns.common[k, r]) for k in (1, 0)))
        does = np.einsum("scpm,p->scm", F, np.array([1.0, *T]))
        change = np.concatenate((np.eye(2 * S * C)[:, :free], stack(does.reshape(S * C, M))), axis=1)
        left = stretch((Y[r] - start - known.W @ T).ravel())
        K.append(white(change.reshape(S, 2 * C, -1)).reshape(-1, free + M))
        y.append(white(left.reshape(S, 2 * C, 1)).ravel())
    K.append(np.eye(free + M)[free:])
    y.append(np.zeros(M))
    found = least_squares(np.vstack(K), np.concatenate(y), sigma=1.0)
    assert found.solution_covariance is not None
    assert found.chi_square is not None
    values, vectors = np.linalg.eigh(found.solution_covariance)
    moved = np.column_stack((found.solution, vectors * np.sqrt(values.clip(0.0))))
    P = F.shape[2] - 1
    each = np.einsum("scpm,mk->kscp", F, moved[free:])
    each[..., 0] += unstretch(moved[:free].T).reshape(-1, S, C) if free else 0.0
    last = bool(mounted[-1].any())
    result = replace(
        known,
        W=known.W + each[0, ..., 1:],
        baseline=start + each[0, ..., 0],
        parameters=each[1:],
        covariance=(1.0 + OWN) * marginal(None, each[1:]),
        errors=model.errors,
        error_source=model.source,
        reading_dof=model.dof,
        run_errors=between,
        labels=trials.labels,
        last_run=trials.runs[-1] if last else None,
        last_weights=mounted[-1] if last else np.zeros(P, dtype=complex),
        warnings=tuple(dict.fromkeys((*known.warnings, *trials.warnings, *model.warnings))),
    )
    return result, float(chdtrc(found.dof, found.chi_square)) if found.dof else 1.0
