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

from collections.abc import Mapping
from dataclasses import replace
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import ArrayLike

from balancing.conditioning import chance
from balancing.conventions import Labels
from balancing.error_draws import Gaussian
from balancing.groups import mapped
from balancing.influence import Influence, Remarks, match_readings
from balancing.regions import mean_variances
from rotorid.base.text import Quantity, rpm_text

if TYPE_CHECKING:
    from fem import Rotor, SensorLike

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
        For nodes and speeds that cannot be, and as `fem.influence`.
    """
    from fem import influence

    model = influence(rotor, list(planes.values()), list(sensors.values()), speeds)
    levers = np.ones(len(planes)) if radii is None else np.array([radii[plane] for plane in planes])
    W = np.asarray(model.W) * np.exp(1j * np.radians(key_phasor))
    W = W * ((1j * model.speeds) ** DERIVATIVES[quantity])[:, None, None] * levers
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
    variance = np.insert((far[..., None] * np.abs(influence.W)) ** 2, 0, 0.0, axis=-1)
    each = np.repeat(variance, 2, axis=-1)
    common = np.insert(np.asarray(columns, dtype=complex), 0, 0.0, axis=-1)
    independent = each[..., None] * np.eye(each.shape[-1])
    return replace(influence, errors=Gaussian(independent, common, *influence.errors[1:4]))


def combine(measured: Influence, computed: Influence) -> Influence:
    """Combine measured coefficients with those of a model, weighted by their errors.

    Parameters
    ----------
    measured
        Coefficients with errors, from `estimate_influence`, or stored ones.
    computed
        Of the same kind (per mass or per unbalance) with errors, from `model_influence` with a
        `relative_error`; at every speed (within 0.5 %) and sensor of the measurement.

    Returns
    -------
    Influence
        At the speeds and sensors of the measurement and the planes of either; the coefficients of a plane
        that only one of them has are taken from it. Baseline, errors of further readings, labels and what is
        mounted are those of the measurement. Contradictions are warnings.

    Raises
    ------
    ValueError
        If one side has no errors, both are not of the same kind, or a speed or sensor is not computed.
    """
    if not (measured.known_errors and computed.known_errors):
        raise ValueError(
            "coefficients are combined by their errors: state those of a reading, or repeat readings, and "
            "state the relative error of the model"
        )
    if measured.labels.unbalances != computed.labels.unbalances:
        raise ValueError(
            f"measured coefficients per {measured.labels.weight_unit} and computed ones per "
            f"{computed.labels.weight_unit}: compute them with the radii of the planes, per mass, or "
            "without, per unbalance"
        )
    computed = computed.part(*match_readings(measured, computed, "computed coefficients"))
    planes = tuple(dict.fromkeys((*measured.planes, *computed.planes)))
    first, second = (np.isin(planes, side.planes) for side in (measured, computed))
    one, other = (mapped(side, planes, np.equal.outer(side.planes, planes)) for side in (measured, computed))
    v, u = (mean_variances(side.channels())[..., 1:] for side in (one, other))
    both, total = first & second, np.maximum(v + u, 1e-300)
    share = np.where(both, u / total, first)
    parts = np.eye(len(planes) + 1, dtype=complex) * np.insert(share, 0, 1.0, axis=-1)[..., None]
    chi = both * np.abs(one.W - other.W) ** 2 / total
    warnings = *measured.remarks.warnings, *computed.remarks.warnings
    s, c, p = map(int, np.unravel_index(int(np.argmax(chi)), chi.shape))
    # each two degrees of freedom, and so many chances
    if both.sum() * one.baseline.size * chance(float(chi[s, c, p]), 2) < 1 - LEVEL:
        warnings += (
            f"measured and computed coefficient of plane {planes[p]!r} at sensor {measured.sensors[c]!r}, "
            f"{rpm_text(measured.speeds[s])}, differ by {np.sqrt(chi[s, c, p] / 2):.2g} times their errors: "
            "the model, the trial runs or the stated errors are wrong",
        )
    rest = other.errors.noise.changed(np.eye(len(planes) + 1) - parts)
    return replace(
        one,
        W=one.W * share + other.W * (1 - share),
        errors=one.errors._replace(noise=one.errors.noise.changed(parts).plus(rest)),
        remarks=measured.remarks._replace(warnings=warnings),
    )
