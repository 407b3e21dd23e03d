"""Influence coefficients from trial runs: `Y_run = Y_0 + W T_run`, by least squares over all runs.

Trial weights removed or left in, several weights in a run, several trials of one plane and repeated runs
are all the same relation; nothing needs a special case. Source: [S] (34)–(39), generalised.
"""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from balancing.coefficients.identifiability import UndeterminedError, check_runs, refusal
from balancing.coefficients.repeatability import describe, differences
from balancing.coefficients.significance import check_consistency, check_effects, weak_trials
from balancing.data.conventions import Labels
from balancing.data.errors import EQUAL, ErrorModel, Source, error_model, mean_covariance, symmetric
from balancing.data.trials import ReadingErrors, Trials, check_names, check_speeds

if TYPE_CHECKING:
    import pandas as pd
from rotorid.base.arrays import ComplexArray, FloatArray
from rotorid.base.units import RPM
from rotorid.regression import gain


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
        Errors of different channels are independent.
    dof
        Degrees of freedom of the errors; None for stated ones.
    errors
        Errors of a single reading that `covariance` is made of, and that further readings have.
    error_source
        Where the errors come from.
    labels
        Units and conventions to print results in.
    warnings
        What the user should know.
    last_run, last_weights
        Name of the last run, and the weights mounted in it, shape (P,); None for stored coefficients.
    """

    speeds: FloatArray
    sensors: tuple[str, ...]
    planes: tuple[str, ...]
    W: ComplexArray
    baseline: ComplexArray | None = None
    covariance: FloatArray | None = None
    dof: int | None = None
    errors: ReadingErrors | None = None
    error_source: Source = "unknown"
    labels: Labels = field(default_factory=Labels)
    warnings: tuple[str, ...] = ()
    last_run: str | None = None
    last_weights: ComplexArray | None = None

    def __post_init__(self) -> None:
        object.__setattr__(self, "sensors", check_names(self.sensors, "sensors"))
        object.__setattr__(self, "planes", check_names(self.planes, "planes"))
        object.__setattr__(self, "speeds", check_speeds(self.speeds))
        S, C, P = len(self.speeds), len(self.sensors), len(self.planes)
        self._frozen("W", (S, C, P), complex)
        self._frozen("baseline", (S, C), complex)
        self._frozen("covariance", (S, C, 2 * P + 2, 2 * P + 2), float)
        self._frozen("last_weights", (P,), complex)

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
    def unit(self) -> str:
        """Unit of a coefficient, such as "um_pp/g"."""
        return f"{self.labels.vibration_unit or '1'}/{self.labels.weight_unit or '1'}"

    def to_dict(self) -> dict[str, Any]:
        """As JSON types: one row per speed, sensor and plane; phases lead, weights turn with the rotation."""
        frame = self.to_frame()
        rows = frame.to_dict("records")
        return {"unit": self.unit, "phase": "lead", "angles": "with rotation", "rows": rows}

    def to_frame(self) -> pd.DataFrame:
        """One row per speed, sensor and plane: `influence` in `unit`, `phase_deg` as lead of the vibration.

        The phase is that of a vibration (positive = lead) caused by a weight at 0°, in every convention.
        """
        import pandas as pd

        scale = self.labels.vibration_scale / self.labels.weight_scale
        S, C, P = self.W.shape
        rpm = np.round(self.speeds * RPM, 9)
        return pd.DataFrame(
            {
                "speed_rpm": np.repeat(rpm, C * P),
                "sensor": np.tile(np.repeat(self.sensors, P), S),
                "plane": np.tile(self.planes, S * C),
                "influence": np.abs(self.W).ravel() * scale,
                "phase_deg": np.mod(np.degrees(np.angle(self.W)).ravel(), 360.0),
            }
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
        With the covariance of each channel where errors are known (rules in `balancing.data.errors`).

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
    G = np.broadcast_to(gain(A), (*Y.shape[:2], P + 1, R))
    if model.errors is None and R > P + 1:
        model = _errors_from_residuals(A, G, Y, model)
    elif model.errors is not None and R > P + 1:
        G = _weighted_gain(A, mean_covariance(trials, model.errors))
    theta = np.einsum("scpr,scr->scp", G, Y)
    # a rotor at rest is at rest: what is left of its readings is rounding
    theta[..., 0][np.abs(theta[..., 0]) < EQUAL * np.abs(Y).max(axis=-1)] = 0.0
    covariance = None
    if model.errors is not None:
        covariance = _channel_covariance(G, mean_covariance(trials, model.errors))
    try:
        check_effects(trials, theta[..., 1:], covariance)
    except UndeterminedError as error:
        raise refusal(str(error), trials.warnings + repeated) from error
    warnings = trials.warnings + repeated + model.warnings + weak_trials(trials, theta[..., 1:])
    if model.errors is not None and model.source == "stated" and R > P + 1:
        warnings += check_consistency(trials, A, theta, mean_covariance(trials, model.errors))
    return Influence(
        speeds=trials.speeds,
        sensors=trials.sensors,
        planes=trials.planes,
        W=theta[..., 1:],
        baseline=theta[..., 0],
        covariance=covariance,
        dof=model.dof,
        errors=model.errors,
        error_source=model.source,
        labels=trials.labels,
        warnings=warnings,
        last_run=trials.runs[-1],
        last_weights=trials.weights[-1],
    )


def _weighted_gain(A: ComplexArray, covariance: FloatArray) -> ComplexArray:
    """Gain (S, C, P + 1, R) with rows weighted by the mean variance of both directions, (R, S, C, 2, 2)."""
    variance = np.moveaxis(np.trace(covariance, axis1=-2, axis2=-1) / 2, 0, -1)
    largest = variance.max(axis=-1, keepdims=True)
    # a reading near zero would otherwise count infinitely much
    variance = np.where(largest > 0, np.maximum(variance, 1e-4 * largest), 1.0)
    root = 1 / np.sqrt(variance)
    return np.asarray(gain(root[..., None] * A) * root[..., None, :])


def _channel_covariance(G: ComplexArray, covariance: FloatArray) -> FloatArray:
    """Covariance (S, C, 2P + 2, 2P + 2) of G Y from that of the readings Y, (R, S, C, 2, 2)."""
    S, C, n, R = G.shape
    B = np.empty((S, C, n, 2, R, 2))
    B[..., 0, :, 0] = B[..., 1, :, 1] = G.real
    B[..., 0, :, 1] = -G.imag
    B[..., 1, :, 0] = G.imag
    B = B.reshape(S, C, 2 * n, R, 2)
    left = np.einsum("scark,rsckl->scarl", B, covariance).reshape(S, C, 2 * n, 2 * R)
    return symmetric(left @ np.swapaxes(B.reshape(S, C, 2 * n, 2 * R), -1, -2))


def _errors_from_residuals(
    A: ComplexArray, G: ComplexArray, Y: ComplexArray, model: ErrorModel
) -> ErrorModel:
    """One relative error, alike in both directions, from the residuals of all channels.

    Each channel counts in proportion to its own mean square reading, so that the resonance does not decide
    alone; the estimate is unbiased for errors proportional to the readings.
    """
    R, n = A.shape
    size = np.mean(np.abs(Y) ** 2, axis=-1)
    used = size > 0
    if not used.any():
        return model
    M = np.eye(R) - A @ G[0, 0]
    found = np.sum(np.abs(np.einsum("qr,scr->scq", M, Y)) ** 2, axis=-1)
    expected = 2 * np.einsum("qr,scr->sc", np.abs(M) ** 2, np.abs(Y) ** 2)
    relative = float(np.sqrt(np.sum(found[used] / size[used]) / np.sum(expected[used] / size[used])))
    if relative < EQUAL:
        words = "the runs agree to the last digit: they say nothing about the errors of the readings"
        return ErrorModel(warnings=(*model.warnings, words))
    dof = 2 * int(np.count_nonzero(used)) * (R - n)
    return ErrorModel(ReadingErrors(relative, relative), dof, "residuals", model.warnings)
