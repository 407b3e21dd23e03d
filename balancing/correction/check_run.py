"""Check run against its prediction: the difference compared with the errors of both.

A reading in a check run with weights T mounted is predicted as Y₀ + W T. It differs from that by the errors
of the prediction, dY₀ + dW T, by its own, which repeated readings reduce, and by what its run has of its own
(`balancing.coefficients.run_errors`). All runs share the errors of the prediction, and sensors and speeds
those between runs; V is the covariance of all differences together,

    V = B Σ Bᵀ + Σ_run own errors + columns in common,    B = rows (1, T_run) stretched,

with Σ that of (Y₀, W), and χ² = dᵀ V⁻¹ d has n = 2 × runs × sensors × speeds degrees of freedom. Where errors
are estimates, χ²/n is compared with Fisher's F(n, ν), ν by `RunErrors.degrees` with the shares that each kind
of error has in χ².

Existing unbalance, wherever it sits, is in Y₀ and explains no difference in a linear rotor. A difference
that the errors do not explain means that something changed or is not linear; what a change of the weights
in the correction planes explains is found by fitting d = W δ.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace

import numpy as np
from numpy.typing import ArrayLike

from balancing.coefficients.baseline import Start, match_speeds, starting_point
from balancing.coefficients.influence import Influence
from balancing.coefficients.repeatability import both_directions, tail
from balancing.coefficients.run_errors import (
    RunColumns,
    marginal,
    run_columns,
    runs_of,
)
from balancing.correction.check_run_result import CheckComparison
from balancing.correction.correction_result import Correction
from balancing.correction.refine_coefficients import mounted_in
from balancing.data.reading_errors import covariance_beside_digits, error_model, symmetric
from balancing.data.trials import Trials
from balancing.solvers.error_propagation import real_columns, whitening
from rotorid.base.arrays import ComplexArray, FloatArray, IndexArray
from rotorid.regression import solution, stretch, unstretch

LEVEL = 0.95
"""A difference whose χ² would be exceeded by errors alone in less than 5 % of all jobs is not explained."""

_DIRECTIONS = 8
_EXACT = 1e-9
"""Nothing is known better than this share of the largest reading."""


def compare_check(
    correction: Correction,
    check: Trials,
    influence: Influence,
    baseline: Trials | ArrayLike | None = None,
) -> CheckComparison:
    """Compare check runs with what the influence coefficients predict for them.

    Parameters
    ----------
    correction
        The proposed weights. They count as mounted, and nothing else, if the check runs have no planes.
    check
        Readings, of some or all sensors and speeds of the coefficients; its weights, if it has planes, are
        all that was mounted in each run.
    influence, baseline
        As they were given to `balancing.correct`.

    Returns
    -------
    CheckComparison
        Without a verdict where the errors of the readings are unknown.

    Raises
    ------
    ValueError
        For sensors, speeds or planes without coefficients, and a baseline that does not fit.
    """
    start = starting_point(influence, baseline)
    at = match_speeds(check.speeds, influence.speeds)
    sensors = [_index(name, influence.sensors, "sensor") for name in check.sensors]
    pick = np.ix_(at, sensors)
    T, planes = _mounted(correction, check, influence)
    W, before = influence.W[pick], start.readings[pick]  # (S, C, P), (S, C)
    predicted = before + np.einsum("scp,rp->rsc", W, T)
    achieved = check.mean
    own = error_model(check)
    # the check runs themselves tell most about their errors, by repeats or what the instrument measured
    by_own = own.source in ("measured", "repeats", "stated, enlarged by repeats")
    errors, dof = start.model.errors, start.model.dof
    warnings = check.warnings + (own.warnings if by_own else ())
    covariance = distance = chi_square = probability = explained = change = None
    if errors is not None and start.covariance is not None:
        degrees = [d for d in (dof, own.dof if by_own else None) if d is not None]
        dof = min(degrees, default=None)
        used = own.errors if by_own and own.errors is not None else errors
        reading = replace(own if by_own else start.model, errors=both_directions(used))
        single = covariance_beside_digits(check, reading, predicted)
        single += (_EXACT * np.abs(before).max()) ** 2 * np.eye(2)
        further = run_columns(influence.run_errors, runs_of(predicted, T, W))
        V, common, parameters = _joint(start, pick, T, single, further)
        blocks = V + marginal(common, parameters)
        R = len(check.runs)
        covariance = np.einsum("scrarb->rscab", blocks.reshape(*blocks.shape[:2], R, 2, R, 2))
        d = _vectors(achieved - predicted)
        distance = np.sqrt(np.einsum("rsci,rsci->rsc", d, np.linalg.solve(covariance, d[..., None])[..., 0]))
        run, speed, known = *map(_columns, common), _columns(parameters)[..., ::2]
        white, shares = whitening(_by_speed(V), speed, np.concatenate((run, known), axis=-1))
        model = float(np.sum(white(known) ** 2)) / d.size
        stacked = np.moveaxis(d, 0, 2).reshape(len(at), -1, 1)
        between = influence.own_between
        own_share, at_speed, whole = shares
        kinds = np.array([own_share * (1 - between), own_share * between, at_speed, whole - model, model])
        # all directions alike: so many tell the degrees of freedom
        unit = np.eye(min(d.size, _DIRECTIONS))
        scale, dof = influence.run_errors.degrees(kinds[:, None, None] * unit, dof)
        chi_square = float(np.sum(white(stacked) ** 2)) / scale
        probability = tail(chi_square, d.size, dof)
        explained = probability >= 1 - LEVEL
        change = None if explained else _change(W, white(stacked), white, scale, dof)
        if influence.covariance is None:
            warnings += (
                "the errors of the influence coefficients are not known: the prediction is less certain "
                "than it seems here",
            )
    return CheckComparison(
        runs=check.runs,
        sensors=check.sensors,
        planes=planes,
        speeds=influence.speeds[at],
        weights=T,
        as_proposed=not check.planes,
        before=before,
        predicted=predicted,
        achieved=achieved,
        covariance=covariance,
        distance=distance,
        chi_square=chi_square,
        n=2 * achieved.size,
        dof=dof,
        probability=probability,
        explained=explained,
        change=change,
        labels=start.labels,
        warnings=warnings,
    )


def _mounted(
    correction: Correction, check: Trials, influence: Influence
) -> tuple[ComplexArray, tuple[str, ...]]:
    """Weights (R, P) in the planes of the coefficients during the check runs, and the names of the planes."""
    T = np.zeros((len(check.runs), len(influence.planes)), dtype=complex)
    for plane, weights in mounted_in(check, correction).items():
        if plane in influence.planes or weights.any():
            T[:, _index(plane, influence.planes, "plane")] = weights
    return T, influence.planes


def _index(name: str, names: tuple[str, ...], what: str) -> int:
    if name not in names:
        raise ValueError(
            f"there are no coefficients of {what} {name!r}, which the check run has; there are some of "
            f"{', '.join(map(repr, names))}"
        )
    return names.index(name)


def _joint(
    start: Start, pick: tuple[IndexArray, ...], T: ComplexArray, single: FloatArray, further: RunColumns
) -> tuple[FloatArray, ComplexArray, ComplexArray]:
    """Own covariance of all differences of each sensor and speed (S, C, 2R, 2R), and columns.

    The latter as `Influence.common`, (2, M, S, C, R), and `Influence.parameters`, (M, S, C, R).
    """
    R, S, C = single.shape[:3]
    factors = np.column_stack((np.ones(R), T))
    rows = stretch(factors)
    assert start.own is not None
    V = np.asarray(rows @ start.own[pick] @ rows.T)
    own = single + further.own[..., None, None] * np.eye(2)
    blocks = V.reshape(S, C, R, 2, R, 2)
    each = np.einsum("krmsc,rq->krmscq", further.common, np.eye(R)).reshape(2, -1, S, C, R)
    for r in range(R):
        blocks[:, :, r, :, r, :] += own[r]
    if start.common is not None:
        each = np.concatenate((start.common[:, :, pick[0], pick[1]] @ factors.T, each), axis=1)
    known = np.zeros((0, S, C, R), dtype=complex)
    if start.parameters is not None:
        known = start.parameters[:, pick[0], pick[1]] @ factors.T
    return symmetric(V), each, known


def _by_speed(V: FloatArray) -> FloatArray:
    """Covariances of independent channels (S, C, n, n) as one at each speed, (S, C n, C n)."""
    S, C, n, _ = V.shape
    return np.asarray(np.einsum("scij,cd->scidj", V, np.eye(C)).reshape(S, C * n, C * n))


def _columns(common: ComplexArray) -> FloatArray:
    M, S, C, R = common.shape
    return real_columns(common.reshape(M, S, C * R))


def _change(
    W: ComplexArray,
    target: FloatArray,
    white: Callable[[FloatArray], FloatArray],
    scale: float,
    dof: float | None,
) -> ComplexArray | None:
    """Weights δ (P,), the same in all runs, for which W δ explains the differences; None if none do.

    Generalised least squares over the stretched channels: minimises (d − A δ)ᵀ V⁻¹ (d − A δ) with A the
    stretched row of W repeated for every run; `target` is `white` d.
    """
    S, C, P = W.shape
    rows = target.size - 2 * P
    if rows <= 0:
        return None
    A = np.repeat(stretch(W.reshape(-1, P)).reshape(S, C, 1, 2, 2 * P), target.size // (2 * S * C), axis=2)
    matrix = white(A.reshape(S, -1, 2 * P)).reshape(-1, 2 * P)
    delta = solution(matrix, target.ravel(), rcond=1e-10)
    chi_square = float(np.sum((target.ravel() - matrix @ delta) ** 2)) / scale
    if tail(chi_square, rows, dof) < 1 - LEVEL:
        return None
    return unstretch(delta)


def _vectors(z: ComplexArray) -> FloatArray:
    return np.stack((z.real, z.imag), axis=-1)
