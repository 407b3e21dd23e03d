"""Influence coefficients computed from a rotor model, alone or together with measured ones.

Source: [S] 1.9.1. A computed coefficient is what a sensor reads per unbalance; its unbalance stands at angle
0, at the mark. How such a coefficient compares with a measured one:

- Phase. The model's vibration is Re W U e^{iωt} with the mark in the direction x at t = 0. Instruments count
  time from the pulse of the key phasor, which comes when the mark passes its direction, at the angle κ from
  x: t = t' + κ/ω. What they read is therefore W e^{iκ}: a key phasor further on starts the clock later.
- Sensor. In its direction β from x it sees Re z e^{−iβ}, which is in `fem.influence` already: a probe further
  on sees the heavy spot later. Where bearings are alike in x and y only κ − β matters.
- Quantity. A velocity reads iω W, an acceleration −ω² W.
- Weight. A mass m in a plane of radius r is the unbalance m r: per mass the coefficient is r W.

Offsets that cancel in trial runs (κ, β, peak or peak to peak) do not cancel here: docs/conventions.md.

Measured and computed coefficients of the same plane and reading are combined by inverse variance,

    W = α W_m + (1 − α) W_c,   α = v_c / (v_m + v_c),

v the mean variance of both directions. (Y₀, W) of the result errs by the same combination of what either side
errs by; the baseline is the measured one.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace
from typing import TYPE_CHECKING, Literal, NamedTuple

import numpy as np
from numpy.typing import ArrayLike

from balancing.conditioning import UndeterminedError, chance
from balancing.conventions import Labels
from balancing.errors import Reading, RunErrors, mean_variance, reading_of, usual_run_errors
from balancing.influence import (
    SPEED_TOLERANCE,
    Errors,
    Gaussian,
    Influence,
    Mounted,
    Noise,
    Remarks,
    estimate_influence,
    local_runs,
    run_noise,
)
from balancing.regions import real_parts
from balancing.trials import Trials
from rotorid.base.arrays import ComplexArray, FloatArray
from rotorid.base.rpm import rpm_text
from rotorid.base.suggestions import did_you_mean
from rotorid.regression import covariance_root, unstretch

if TYPE_CHECKING:
    from fem import Rotor, SensorLike

Quantity = Literal["displacement", "velocity", "acceleration"]

DERIVATIVES = {"displacement": 0, "velocity": 1, "acceleration": 2}
LEVEL = 0.99
"""Of the test whether measured and computed coefficients agree, for all together."""


def model_influence(  # noqa: PLR0913
    rotor: Rotor,
    planes: Mapping[str, str | int],
    sensors: Mapping[str, SensorLike],
    speeds: ArrayLike,
    *,
    radii: Mapping[str, float] | None = None,
    relative_error: float = 0.0,
    quantity: Quantity = "displacement",
    key_phasor: float = 0.0,
    labels: Labels | None = None,
) -> Influence:
    """Compute influence coefficients from a rotor model, ready for `correct` with the readings of one run.

    Parameters
    ----------
    rotor
        The rotor.
    planes
        Node number, from 1, or station of each plane.
    sensors
        Node or station of each sensor, which then reads x; or a pair (node, angle) or a `fem.Sensor`, angle
        in degrees from x with the rotation.
    speeds
        rad/s, > 0, shape (S,).
    radii
        m, of every plane: coefficients are then per kg there. Default: per kg·m.
    relative_error
        One standard deviation of each coefficient's real and imaginary part, relative to its size: how far
        the model is trusted. With 0 nothing is said about errors.
    quantity
        What the sensors read.
    key_phasor
        Direction in which the key phasor sees the mark pass, degrees from x with the rotation.
    labels
        Units and conventions to print in; default SI, phase lead.

    Returns
    -------
    Influence
        Without a baseline; with errors if `relative_error` > 0 (those of different coefficients are taken as
        independent, which for a wrong support stiffness, say, they are not).

    Raises
    ------
    ValueError
        For nodes, speeds or radii that cannot be, and as `fem.influence`.
    """
    from fem import influence

    if not (np.isfinite(relative_error) and relative_error >= 0):
        raise ValueError(f"the relative error of the model must be a finite number ≥ 0, not {relative_error}")
    if quantity not in DERIVATIVES:
        raise ValueError(f"quantity must be one of {', '.join(DERIVATIVES)}, not {quantity!r}")
    if not np.isfinite(key_phasor):
        raise ValueError(f"the angle of the key phasor must be finite, not {key_phasor}")
    model = influence(rotor, list(planes.values()), list(sensors.values()), speeds)
    W = np.asarray(model.W) * np.exp(1j * np.radians(key_phasor))
    W = W * ((1j * model.speeds) ** DERIVATIVES[quantity])[:, None, None] * _radii(planes, radii)
    default = Labels(weight_unit="kg_m" if radii is None else "kg")
    coefficients = Influence(
        speeds=model.speeds,
        sensors=tuple(sensors),
        planes=tuple(planes),
        W=W,
        baseline=np.full(W.shape[:2], np.nan),
        errors=Gaussian.none(*W.shape),
        labels=labels or default,
        remarks=Remarks(model.warnings),
    )
    return with_parameters(coefficients, np.zeros((0, *W.shape)), relative_error)


def with_parameters(influence: Influence, columns: ArrayLike, lack: ArrayLike) -> Influence:
    """Coefficients of a model with the errors of its parameters.

    Parameters
    ----------
    influence
        As of `model_influence`; errors that it has are replaced.
    columns
        What independent errors of variance 1 change W by, to first order, in its unit: shape (M, S, C, P).
        For parameters of covariance L Lᵀ: the derivatives of W by them, times L.
    lack
        What the lack of fit leaves: one standard deviation of each coefficient's real and imaginary part,
        relative to its size, independent of each other; (S, C), or a number.

    Raises
    ------
    ValueError
        For shapes that do not fit, and what is not finite or below 0.
    """
    far = np.asarray(lack, dtype=np.float64)
    if not (np.isfinite(far) & (far >= 0)).all():
        raise ValueError("the relative errors that the lack of fit leaves must be finite numbers ≥ 0")
    S, C, P = influence.W.shape
    F = np.asarray(columns, dtype=complex)
    independent = np.zeros((S, C, 2 * P + 2, 2 * P + 2))
    at = np.arange(2, 2 * P + 2)
    std = np.broadcast_to(far, (S, C))[..., None] * np.abs(influence.W)
    independent[..., at, at] = np.repeat(std**2, 2, axis=-1)
    errors = Gaussian(
        independent,
        np.concatenate((np.zeros_like(F[..., :1]), F), axis=-1),
        influence.reading,
        influence.run_errors,
        influence.mounted,
    )
    return replace(influence, errors=errors)


def _radii(planes: Mapping[str, str | int], radii: Mapping[str, float] | None) -> FloatArray:
    if radii is None:
        return np.ones(len(planes))
    unknown = [name for name in radii if name not in planes]
    lacking = [name for name in planes if name not in radii]
    if unknown or lacking:
        hint = did_you_mean(unknown[0], lacking) if len(unknown) == 1 else ""
        raise ValueError(
            f"give the radius of every plane and of no other one: "
            f"{'there is no plane' if unknown else 'lacking is that of'} "
            f"{', '.join(map(repr, unknown or lacking))}{hint}"
        )
    out = np.array([radii[name] for name in planes], dtype=np.float64)
    if not (np.isfinite(out) & (out > 0)).all():
        raise ValueError(f"the radius of a plane must be a finite number > 0 m; got {out.tolist()}")
    return out


def update(expected: Influence, trials: Trials) -> tuple[Influence, float]:
    """Coefficients and the bare rotor's readings, from what is known before and from runs.

    Known are W = μ + L ε with independent ε of variance 1 (`Influence.columns`); Y₀ is free. A run reads
    Y = Y₀ + W T + e; what e has in common are further unknowns of variance 1. With the rows divided by the
    errors of their own this is least squares in (Y₀, ε, …): the posterior of normal errors, all sensors and
    speeds together, so that a trial run in one plane also tells of another where machines that differ in one
    differ in the other. A bare run: nothing but the type. Many runs: the measured coefficients (shrinkage).

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
    runs = local_runs(expected, trials)
    R, (S, C, P) = len(runs.runs), expected.W.shape
    reading, run = _shown(runs)
    unit = np.broadcast_to(np.eye(R, dtype=complex), (S, C, R, R))
    noise = run_noise(runs, expected.W, unit, reading, run)
    sizes = np.array([1.0, *run.typical, 1.0])
    own = np.tensordot(sizes[:2] ** 2, noise.own, axes=1)  # (S, C, 2R, 2R)
    own += 1e-12 * (np.trace(own, axis1=-2, axis2=-1).max() or 1.0) * np.eye(2 * R)
    change = np.column_stack((np.ones(R), runs.weights))
    columns = expected.columns()
    unknown = np.concatenate((columns @ change.T, noise.columns * sizes[noise.kind][:, None, None, None]))
    root = np.linalg.cholesky(own)
    K = np.linalg.solve(root, np.moveaxis(real_parts(unknown), 0, -1)).reshape(S * C, 2 * R, -1)
    free = np.linalg.solve(root, np.tile(np.eye(2), (R, 1))[None, None]).reshape(S * C, 2 * R, 2)
    difference = np.moveaxis(runs.mean, 0, -1) - expected.W @ runs.weights.T
    y = np.linalg.solve(root, real_parts(difference)[..., None]).reshape(-1, 2 * R)
    N, M = 2 * S * C, len(unknown)
    A = np.zeros((S * C, 2 * R, N + M))
    for k in range(S * C):
        A[k, :, 2 * k : 2 * k + 2] = free[k]
    A[..., N:] = K
    rows = np.vstack((A.reshape(-1, N + M), np.eye(N + M)[N:]))
    right = np.append(y, np.zeros(M))
    values, *_ = np.linalg.lstsq(rows, right, rcond=None)
    covariance = np.linalg.pinv(rows.T @ rows, hermitian=True)
    m = len(columns)
    moved = np.tensordot(values[N : N + m], columns, 1)
    baseline = (values[:N:2] + 1j * values[1:N:2]).reshape(S, C) + moved[..., 0]
    # what a channel's readings tell of its Y₀ alone, all else given, is its own; the rest is in common
    alone = np.zeros((S, C, 2 * P + 2, 2 * P + 2))
    alone[..., :2, :2] = np.linalg.inv(np.einsum("kij,kil->kjl", free, free)).reshape(S, C, 2, 2)
    joint = covariance[: N + m, : N + m].copy()
    for k, block in enumerate(alone[..., :2, :2].reshape(-1, 2, 2)):
        joint[2 * k : 2 * k + 2, 2 * k : 2 * k + 2] -= block
    factors = covariance_root(joint, np.diag(covariance)[: N + m]).T
    Y = unstretch(factors[:, :N]).reshape(-1, S, C, 1)
    both = np.tensordot(factors[:, N:], columns, 1)
    both[..., :1] += Y
    mounted = Mounted(runs.runs[-1], expected.planes, runs.weights[-1])
    spare = len(right) - N - M - (N + M - np.linalg.matrix_rank(rows))
    left = float(np.sum((rows @ values - right) ** 2))
    warnings = dict.fromkeys((*expected.remarks.warnings, *trials.warnings, *reading.warnings))
    result = replace(
        expected,
        W=expected.W + moved[..., 1:],
        baseline=baseline,
        errors=Gaussian(alone, both, reading, run, mounted),
        labels=trials.labels,
        remarks=Remarks(tuple(warnings)),
    )
    return result, chance(left, spare) if spare > 0 else 1.0


def _shown(runs: Trials) -> tuple[Reading, RunErrors]:
    """Errors of readings and between runs: as runs that tell more than the coefficients show them."""
    try:
        measured = estimate_influence(runs)
    except UndeterminedError:
        return reading_of(runs), usual_run_errors(runs)
    return measured.reading, measured.run_errors


def combine(measured: Influence, computed: Influence) -> Influence:
    """Combine measured coefficients with those of a model, weighted by their errors.

    Parameters
    ----------
    measured
        Coefficients with errors, from `estimate_influence`, or stored ones.
    computed
        Of the same kind (per mass or per unbalance) with errors, from `model_influence` with a
        `relative_error`. Speeds within 0.5 % of a measured one count as that.

    Returns
    -------
    Influence
        At all speeds, sensors and planes of either; coefficients that only one of them has are taken from it.
        Baseline, errors of further readings, labels and what is mounted are those of the measurement; the
        baseline is NaN where nothing was measured. Contradictions are warnings.

    Raises
    ------
    ValueError
        If one side has no errors, both are not of the same kind, or a coefficient is on neither side.
    """
    for side, words in (
        (measured, "measured coefficients are not known: state the errors of a reading, or repeat readings"),
        (computed, "computed coefficients are not known: state the relative error of the model"),
    ):
        if not side.known_errors:
            raise ValueError(f"coefficients can be combined only by their errors, and those of the {words}")
    _check_kinds(measured, computed)
    speeds, *places = _speeds(measured, computed)
    sensors = tuple(dict.fromkeys((*measured.sensors, *computed.sensors)))
    planes = tuple(dict.fromkeys((*measured.planes, *computed.planes)))
    first, second = (
        _spread(side, at, sensors, planes) for side, at in zip((measured, computed), places, strict=True)
    )
    lacking = np.argwhere(np.isnan(first.W) & np.isnan(second.W))
    if len(lacking):
        s, c, p = lacking[0]
        raise ValueError(
            f"there is neither a measured nor a computed coefficient of plane {planes[p]!r} at sensor "
            f"{sensors[c]!r}, {rpm_text(float(speeds[s]))}: compute it, or leave out one of them"
        )
    both = ~(np.isnan(first.W) | np.isnan(second.W))
    sum_ = first.variance + second.variance
    share = np.where(np.isnan(second.W), 1.0, 0.0)
    share[both] = np.where(
        sum_[both] > 0, second.variance[both] / np.where(sum_[both] > 0, sum_[both], 1), 0.5
    )
    W = np.nan_to_num(first.W) * share + np.nan_to_num(second.W) * (1 - share)
    one = np.ones((*share.shape[:2], 1))
    noises = (
        side.noise.scaled(np.concatenate(parts, axis=-1))
        for side, parts in ((first, (one, share)), (second, (0 * one, 1 - share)))
    )
    one_side, other = noises
    noise = Noise(
        one_side.own + other.own,
        np.concatenate((one_side.columns, other.columns)),
        np.concatenate((one_side.kind, other.kind)),
    )
    by_name = dict(zip(measured.planes, measured.mounted.weights, strict=True))
    mounted = np.array([by_name.get(plane, 0.0) for plane in planes], dtype=complex)
    errors = Errors(
        noise,
        measured.reading,
        measured.run_errors,
        Mounted(measured.mounted.run, planes, mounted),
        measured.trials,
    )
    chi = np.where(both, np.abs(np.nan_to_num(first.W - second.W)) ** 2 / np.where(sum_ > 0, sum_, np.inf), 0)
    remarks = Remarks(
        (
            *measured.remarks.warnings,
            *computed.remarks.warnings,
            *_contradictions(chi, int(both.sum()), planes, sensors, speeds),
        ),
        measured.remarks.notes,
        measured.remarks.contradictions,
    )
    return Influence(speeds, sensors, planes, W, first.baseline, errors, measured.labels, remarks)


class _Side(NamedTuple):
    """One side at the speeds, sensors and planes of both: NaN where it has nothing."""

    W: ComplexArray
    baseline: ComplexArray
    variance: FloatArray
    noise: Noise


def _spread(
    side: Influence, at: Sequence[int | None], sensors: Sequence[str], planes: Sequence[str]
) -> _Side:
    """Put the coefficients of a side in their places among those of both."""
    S, C, P = len(at), len(sensors), len(planes)
    rows = [s for s, i in enumerate(at) if i is not None]
    source = [i for i in at if i is not None]
    columns = [sensors.index(name) for name in side.sensors]
    chosen = [planes.index(name) for name in side.planes]
    part = side.part(source)
    W = np.full((S, C, P), np.nan, dtype=complex)
    W[np.ix_(rows, columns, chosen)] = part.W
    baseline = np.full((S, C), np.nan, dtype=complex)
    baseline[np.ix_(rows, columns)] = part.baseline
    variance = np.zeros((S, C, P))
    blocks = part.channels()[..., 2:, 2:]
    n = len(chosen)
    each = np.einsum("scpipj->scpij", blocks.reshape(*blocks.shape[:2], n, 2, n, 2))
    variance[np.ix_(rows, columns, chosen)] = mean_variance(each)
    return _Side(W, baseline, variance, part.errors.noise.spread((S, C, P), rows, columns, chosen))


def _contradictions(
    chi: FloatArray, n: int, planes: Sequence[str], sensors: Sequence[str], speeds: FloatArray
) -> tuple[str, ...]:
    """χ² (S, C, P) of differences, two degrees of freedom each, that n chances do not explain."""
    s, c, p = map(int, np.unravel_index(int(np.argmax(chi)), chi.shape))
    if n * chance(float(chi[s, c, p]), 2) >= 1 - LEVEL:
        return ()
    return (
        f"measured and computed coefficient of plane {planes[p]!r} at sensor {sensors[c]!r}, "
        f"{rpm_text(speeds[s])}, differ by {np.sqrt(chi[s, c, p] / 2):.2g} times their errors: the model, "
        "the trial runs or the stated errors are wrong",
    )


def _check_kinds(measured: Influence, computed: Influence) -> None:
    kinds = ["unbalance" if "_" in side.labels.weight_unit else "mass" for side in (measured, computed)]
    if kinds[0] != kinds[1]:
        units = measured.labels.weight_unit, computed.labels.weight_unit
        remedy = "give the radii of the planes, to compute them per mass"
        if kinds[0] == "unbalance":
            remedy = "compute them per unbalance, without radii"
        raise ValueError(
            f"the measured coefficients are per {kinds[0]} ({units[0]}) and the computed ones per {kinds[1]} "
            f"({units[1]}): {remedy}"
        )


def _speeds(
    measured: Influence, computed: Influence
) -> tuple[FloatArray, list[int | None], list[int | None]]:
    """All speeds, ascending, and where each stands on either side (None: nowhere)."""
    pairs: dict[int, int] = {}
    for j, speed in enumerate(computed.speeds):
        i = int(np.argmin(np.abs(measured.speeds - speed)))
        if abs(measured.speeds[i] - speed) <= SPEED_TOLERANCE * measured.speeds[i]:
            if i in pairs:
                two = f"{rpm_text(computed.speeds[pairs[i]])} and {rpm_text(speed)}"
                raise ValueError(
                    f"two computed speeds, {two}, fit the measured {rpm_text(measured.speeds[i])}: "
                    "leave one out"
                )
            pairs[i] = j
    rows: list[tuple[float, int | None, int | None]] = [
        (float(speed), i, pairs.get(i)) for i, speed in enumerate(measured.speeds)
    ]
    rows += [(float(speed), None, j) for j, speed in enumerate(computed.speeds) if j not in pairs.values()]
    rows.sort(key=lambda row: row[0])
    return np.array([r[0] for r in rows]), [r[1] for r in rows], [r[2] for r in rows]
