"""Influence coefficients from trial runs: `Y_run = Y_0 + W T_run`, by least squares over all runs.

Trial weights removed or left in, several weights in a run, several trials of one plane and repeated runs
are all the same relation; nothing needs a special case. Source: [S] (34)–(39), generalised.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field, replace
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from balancing.coefficients.identifiability import UndeterminedError, check_runs, refusal
from balancing.coefficients.repeatability import describe, differences
from balancing.coefficients.run_error_estimate import (
    EXPLAINED,
    corrected_row,
    estimated,
    given,
    scatter,
    spare_rows,
)
from balancing.coefficients.run_errors import (
    ASSUMED,
    RunColumns,
    RunErrors,
    Runs,
    assumed,
    marginal,
    run_columns,
    runs_of,
    shares_of,
)
from balancing.coefficients.trial_effects import check_consistency, check_effects, weak_trials
from balancing.data.conventions import Labels
from balancing.data.reading_errors import (
    EQUAL,
    ErrorModel,
    Source,
    error_model,
    mean_covariance,
    mean_variance,
    symmetric,
)
from balancing.data.trials import ReadingErrors, Trials, check_names, check_speeds

if TYPE_CHECKING:
    import pandas as pd
from rotorid.base.arrays import ComplexArray, FloatArray
from rotorid.base.result import Column, frame, rows
from rotorid.base.rpm import RPM
from rotorid.regression import gain, stretch


@dataclass(frozen=True, eq=False)
class Influence:
    """Influence coefficients of P planes on C sensors at S speeds.

    Attributes
    ----------
    speeds
        rad/s, shape (S,).
    sensors, planes
        Names, lengths C and P.
    W
        Complex amplitude per weight, shape (S, C, P).
    baseline
        Readings of the bare rotor, all weights of the runs removed, shape (S, C); None: stored coefficients.
    covariance
        Of (Re Y₀, Im Y₀, Re W₁, Im W₁, …) of each channel, shape (S, C, 2P + 2, 2P + 2); None: unknown.
    common
        What of it the channels have in common: (Y₀, W₁, …) errs by the sum of these columns, each times an
        independent complex number of variance 1 in both directions; [0] a number for each column, [1] one
        for each speed and column. Shape (2, M, S, C, P + 1).
    dof
        Degrees of freedom of the covariance; None for stated errors.
    reading_dof
        Degrees of freedom of the errors of a reading.
    own_between
        Share of what changes from run to run in the variance that is not common.
    errors
        Errors of a single reading that `covariance` is made of, and that further readings have.
    error_source
        Where the errors come from.
    run_errors
        What changes from run to run, also in further runs.
    labels
        Units and conventions to print results in.
    warnings
        What the user should know.
    notes
        What the user may want to know.
    digits
        The covariance that the digits of the readings alone would give; None: they have no end.


    contradictions
        Those of the warnings that say that runs disagree.
    trials
        The runs; None: stored coefficients.
    last_run, last_weights
        Name of the last run, and the weights mounted in it, shape (P,); None for stored coefficients.
    parameters
        What of it errors of a model's parameters do, which are known: (Y₀, W₁, …) errs by the sum of these
        columns, each times an independent real number of variance 1, the same at all speeds and sensors.
        Shape (M, S, C, P + 1).
    """

    speeds: FloatArray
    sensors: tuple[str, ...]
    planes: tuple[str, ...]
    W: ComplexArray
    baseline: ComplexArray | None = None
    covariance: FloatArray | None = None
    dof: float | None = None
    errors: ReadingErrors | None = None
    error_source: Source = "unknown"
    labels: Labels = field(default_factory=Labels)
    warnings: tuple[str, ...] = ()
    last_run: str | None = None
    last_weights: ComplexArray | None = None
    common: ComplexArray | None = None
    run_errors: RunErrors = field(default_factory=RunErrors)
    reading_dof: float | None = None
    own_between: float = 0.0
    notes: tuple[str, ...] = ()
    digits: FloatArray | None = None

    contradictions: tuple[str, ...] = ()
    trials: Trials | None = None
    parameters: ComplexArray | None = None

    def __post_init__(self) -> None:
        object.__setattr__(self, "sensors", check_names(self.sensors, "sensors"))
        object.__setattr__(self, "planes", check_names(self.planes, "planes"))
        object.__setattr__(self, "speeds", check_speeds(self.speeds))
        S, C, P = len(self.speeds), len(self.sensors), len(self.planes)
        self._frozen("W", (S, C, P), complex)
        self._frozen("baseline", (S, C), complex)
        self._frozen("covariance", (S, C, 2 * P + 2, 2 * P + 2), float)
        self._frozen("digits", (S, C, 2 * P + 2, 2 * P + 2), float)
        self._frozen("last_weights", (P,), complex)
        if self.common is not None:
            self._frozen("common", (2, np.shape(self.common)[1], S, C, P + 1), complex)
        if self.parameters is not None:
            self._frozen("parameters", (len(self.parameters), S, C, P + 1), complex)

    def _frozen(self, name: str, shape: tuple[int, ...], kind: type) -> None:
        value = getattr(self, name)
        if value is None:
            return
        array: NDArray[np.generic] = np.array(value, dtype=kind)
        if array.shape != shape:
            raise ValueError(f"{name} must have shape {shape}; got {array.shape}")
        if not np.isfinite(array).all():
            raise ValueError(f"{name} of the influence coefficients must be finite; found NaN or infinity")
        array.flags.writeable = False
        object.__setattr__(self, name, array)

    @property
    def known_covariance(self) -> FloatArray | None:
        """Of the covariance what follows from stated or measured errors; None where nothing does."""
        if self.covariance is None or self.error_source == "assumed":
            return None
        if self.run_errors.origin != "assumed" or self.common is None:
            return self.covariance
        own = self.covariance - marginal(self.common, self.parameters)
        return symmetric(own * (1 - self.own_between) + marginal(None, self.parameters))

    @property
    def unit(self) -> str:
        """Unit of a coefficient, such as "um_pp/g"."""
        return f"{self.labels.vibration_unit or '1'}/{self.labels.weight_unit or '1'}"

    def part(
        self, speeds: Sequence[int], sensors: Sequence[int] | None = None, planes: Sequence[int] | None = None
    ) -> Influence:
        """Those of some speeds, sensors and planes, by their indices; None: of all."""
        sensors, planes = (
            list(range(len(names)) if given is None else given)
            for given, names in ((sensors, self.sensors), (planes, self.planes))
        )
        chosen = [0, *(1 + p for p in planes)]
        own = [2 * k + part for k in chosen for part in (0, 1)]

        def cut(array: FloatArray | None) -> FloatArray | None:
            return None if array is None else array[np.ix_(speeds, sensors, own, own)]

        def columns(array: ComplexArray | None) -> ComplexArray | None:
            return None if array is None else array[..., speeds, :, :][..., sensors, :][..., chosen]

        return replace(
            self,
            speeds=self.speeds[list(speeds)],
            sensors=tuple(self.sensors[c] for c in sensors),
            planes=tuple(self.planes[p] for p in planes),
            W=self.W[np.ix_(speeds, sensors, planes)],
            baseline=None if self.baseline is None else self.baseline[np.ix_(speeds, sensors)],
            covariance=cut(self.covariance),
            common=columns(self.common),
            parameters=columns(self.parameters),
            digits=cut(self.digits),
            last_weights=None if self.last_weights is None else self.last_weights[planes],
        )

    def to_dict(self) -> dict[str, Any]:
        """As JSON types: one row per speed, sensor and plane; phases lead, weights turn with the rotation."""
        return {
            "unit": self.unit,
            "phase": "lead",
            "angles": "with rotation",
            "rows": rows(self._columns()),
        }

    def to_frame(self) -> pd.DataFrame:
        """One row per speed, sensor and plane: `influence` in `unit`, `phase_deg` as lead of the vibration.

        The phase is that of a vibration (positive = lead) caused by a weight at 0°, in every convention.
        """
        return frame(self._columns())

    def _columns(self) -> tuple[Column, ...]:
        scale = self.labels.vibration_scale / self.labels.weight_scale
        S, C, P = self.W.shape
        return (
            Column("speed_rpm", np.repeat(np.round(self.speeds * RPM, 9), C * P)),
            Column("sensor", np.tile(np.repeat(self.sensors, P), S)),
            Column("plane", np.tile(self.planes, S * C)),
            Column("influence", np.abs(self.W).ravel() * scale),
            Column("phase_deg", np.mod(np.degrees(np.angle(self.W)).ravel(), 360.0)),
        )


def estimate_influence(trials: Trials) -> Influence:
    """Influence coefficients, and the readings of the bare rotor, from trial runs.

    Parameters
    ----------
    trials
        R ≥ P + 1 runs whose weights determine the baseline and every plane.

    Returns
    -------
    Influence
        With the covariance of each channel where errors are known (rules in `balancing.data.reading_errors`).

    Raises
    ------
    UndeterminedError
        Where the runs do not separate baseline and planes, and for a trial weight without effect (no reading
        changes, or none by more than its errors explain at 95 %); says which run to add or repeat.

    Notes
    -----
    Runs over-determine the coefficients where R > P + 1. Rows are then weighted by the variance of their
    readings where it is known, else alike.
    """
    R, P = trials.weights.shape
    if P == 0:
        raise UndeterminedError(
            "there are no planes: no run has a trial weight, so the effect of none is determined; "
            "add runs with trial weights, or use stored influence coefficients"
        )
    check_runs(trials.runs, trials.planes, trials.weights)
    model = error_model(trials)
    repeated = describe(differences(trials, model))
    A = np.column_stack((np.ones(R), trials.weights)).astype(complex)
    Y = np.moveaxis(trials.mean, 0, -1)  # (S, C, R)
    merged = model.source == "assumed" and R > P + 1  # the runs themselves tell all errors in one
    reading = mean_covariance(trials, None if merged else model)
    theta = np.einsum("scpr,scr->scp", _gain(A, reading, np.zeros(reading.shape[:3])), Y)
    run = _between_runs(trials, A, theta, reading, model)
    if merged:
        model, run = _as_readings(run, trials, model)
        reading = mean_covariance(trials, model)
    found, runs = _with_errors(trials, A, theta, reading, model, run)
    try:
        told = found.known_covariance if known(model) else found.digits
        check_effects(trials, found.W, told, contradicted=bool(repeated))
    except UndeterminedError as error:
        raise refusal(str(error), trials.warnings + repeated, repeated) from error
    disagree: tuple[str, ...] = ()
    if model.source == "stated" and R > P + 1:
        disagree = check_consistency(trials, A, reading, runs)
    return replace(
        found,
        warnings=trials.warnings + repeated + model.warnings + disagree,
        contradictions=repeated + disagree,
        notes=weak_trials(trials, found.W) + unseen(run),
    )


def estimate_like(trials: Trials, other: Influence) -> Influence:
    """Influence coefficients with the errors of other runs of the same rotor, without any words.

    Parameters
    ----------
    trials
        As `estimate_influence`.
    other
        Coefficients in which these runs, or more of them, took part.
    """
    A = np.column_stack((np.ones(len(trials.runs)), trials.weights)).astype(complex)
    model = ErrorModel(other.errors, other.reading_dof, other.error_source)
    reading = mean_covariance(trials, model)
    G = _gain(A, reading, np.zeros(reading.shape[:3]))
    theta = np.einsum("scpr,scr->scp", G, np.moveaxis(trials.mean, 0, -1))
    return _with_errors(trials, A, theta, reading, model, other.run_errors)[0]


def _with_errors(
    trials: Trials,
    A: ComplexArray,
    theta: ComplexArray,
    reading: FloatArray,
    model: ErrorModel,
    run: RunErrors,
) -> tuple[Influence, Runs]:
    """Coefficients with rows weighted by known errors, starting from others (S, C, P + 1)."""
    Y = np.moveaxis(trials.mean, 0, -1)  # (S, C, R)
    between = run.variance(trials.mean, np.einsum("scp,rp->rsc", theta[..., 1:], trials.weights))
    G = _gain(A, reading, between)
    theta = np.einsum("scpr,scr->scp", G, Y)
    # a rotor at rest is at rest: what is left of its readings is rounding
    theta[..., 0][np.abs(theta[..., 0]) < EQUAL * np.abs(Y).max(axis=-1)] = 0.0
    runs = runs_of(trials.mean, trials.weights, theta[..., 1:])
    covariance, common, dof, own_between = joint_covariance(G, reading, run_columns(run, runs), run, model)
    found = Influence(
        speeds=trials.speeds,
        sensors=trials.sensors,
        planes=trials.planes,
        W=theta[..., 1:],
        baseline=theta[..., 0],
        covariance=covariance,
        dof=dof,
        errors=model.errors,
        error_source=model.source,
        labels=trials.labels,
        last_run=trials.runs[-1],
        last_weights=trials.weights[-1],
        common=common,
        run_errors=run,
        reading_dof=model.dof,
        own_between=own_between,
        digits=_digits(trials, G),
        trials=trials,
    )
    return found, runs


def unseen(run: RunErrors) -> tuple[str, ...]:
    """Note that nothing measures the errors between runs."""
    if run.origin not in ("assumed", "none"):
        return ()
    taken = f"{100 * ASSUMED:g} % are assumed" if run.origin == "assumed" else "none are stated"
    return (
        f"errors between runs (mounting, temperature, drift) are not seen here, {taken}: one more baseline "
        "run at the end, or one more trial run, would measure them; repeated readings do not",
    )


def known(model: ErrorModel) -> bool:
    """Whether something was stated or measured: only that may refuse a job."""
    return model.errors is not None and model.source != "assumed"


def _digits(trials: Trials, G: ComplexArray) -> FloatArray | None:
    """Covariance of the coefficients by the digits of the readings alone; None where they have no end."""
    rounding = mean_covariance(trials, None)
    return _channel_covariance(G, rounding) if rounding.any() else None


def _between_runs(
    trials: Trials, A: ComplexArray, theta: ComplexArray, reading: FloatArray, model: ErrorModel
) -> RunErrors:
    """Errors between runs: stated, estimated from redundant runs, assumed, or none beside stated errors."""
    one_direction = mean_variance(reading)
    runs = runs_of(trials.mean, trials.weights, theta[..., 1:])
    spare = spare_rows(A, runs.Y, one_direction)
    rows = (spare, *corrected_row(A, runs.Y, one_direction, theta))
    stated = trials.run_errors
    if stated is not None and (spare.dof == 0 or scatter([spare], runs, *stated)[1] > 1 - EXPLAINED):
        return given(rows, runs, *stated, "stated")
    if spare.dof:
        return estimated(rows, runs)
    if model.source == "stated":
        return RunErrors()
    return assumed(runs)


def _as_readings(run: RunErrors, trials: Trials, model: ErrorModel) -> tuple[ErrorModel, RunErrors]:
    """What each reading has of its own between runs read once cannot be told from its own error."""
    p, w, f = map(float, run.sizes[:, 0])
    if max((p + w) * np.abs(trials.mean).max(), f) < EQUAL * np.abs(trials.mean).max():
        words = "the runs agree to the last digit: they say nothing about the errors of the readings"
        return replace(model, warnings=(*model.warnings, words)), RunErrors()
    rest = run.sizes.copy()
    rest[[0, 2], 0] = 0.0
    return (
        ErrorModel(ReadingErrors(p or 1e-12, p, f), None, "residuals", model.warnings),
        replace(run, sizes=rest, merged=True),
    )


def joint_covariance(
    G: ComplexArray, reading: FloatArray, columns: RunColumns, run: RunErrors, model: ErrorModel
) -> tuple[FloatArray, ComplexArray, float | None, float]:
    """Covariance of (Y₀, W), what of it the channels have in common, its degrees of freedom, `own_between`.

    Parameters
    ----------
    G
        (Y₀, W₁, …) = G Y, shape (S, C, P + 1, R).
    reading
        Covariance of the mean readings, (R, S, C, 2, 2).
    columns
        Errors between the runs.
    run, model
        Where the two come from.
    """
    own = reading + columns.own[..., None, None] * np.eye(2)
    common = np.einsum("scpr,krmsc->krmscp", G, columns.common).reshape(2, -1, *G.shape[:2], G.shape[2])
    parts = _channel_covariance(G, reading), _channel_covariance(G, own) - _channel_covariance(G, reading)
    each = [*parts, *(marginal(common[[kind]]) for kind in (1, 0))]
    total = sum(each[1:], each[0])
    shares = shares_of(each, total)
    own_between = float(shares[1] / (shares[0] + shares[1])) if shares[:2].any() else 0.0
    return symmetric(total), common, run.degrees(shares[:, None, None] * np.eye(2), model.dof)[1], own_between


def _gain(A: ComplexArray, reading: FloatArray, between: FloatArray) -> ComplexArray:
    """(Y₀, W₁, …) = G Y, (S, C, P + 1, R), with rows weighted by the mean variance of both directions.

    Parameters
    ----------
    reading
        Covariances by the errors of the readings, (R, S, C, 2, 2).
    between
        Variances by the errors between runs, (R, S, C).
    """
    R, n = A.shape
    variance = np.moveaxis(mean_variance(reading) + between, 0, -1)
    largest = variance.max(axis=-1, keepdims=True)
    if n == R or not largest.any():
        return np.broadcast_to(gain(A), (*between.shape[1:], n, R))
    # a reading near zero would otherwise count infinitely much
    variance = np.where(largest > 0, np.maximum(variance, 1e-4 * largest), 1.0)
    root = 1 / np.sqrt(variance)
    return np.asarray(gain(root[..., None] * A) * root[..., None, :])


def _channel_covariance(G: ComplexArray, covariance: FloatArray) -> FloatArray:
    """Covariance (S, C, 2P + 2, 2P + 2) of G Y from that of the readings Y, (R, S, C, 2, 2)."""
    S, C, n, R = G.shape
    B = stretch(G)
    left = np.einsum("scark,rsckl->scarl", B.reshape(S, C, 2 * n, R, 2), covariance)
    return symmetric(left.reshape(B.shape) @ np.swapaxes(B, -1, -2))
