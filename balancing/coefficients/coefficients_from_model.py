"""Influence coefficients and mode shapes computed from a rotor model, named as the runs name them.

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
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace
from typing import TYPE_CHECKING, Literal

import numpy as np
from numpy.typing import ArrayLike

from balancing.coefficients.influence import Influence
from balancing.coefficients.run_errors import marginal
from balancing.data.conventions import Labels
from rotorid.base.arrays import ComplexArray, FloatArray
from rotorid.base.suggestions import did_you_mean

if TYPE_CHECKING:
    from fem import Rotor, SensorLike

Quantity = Literal["displacement", "velocity", "acceleration"]

DERIVATIVES = {"displacement": 0, "velocity": 1, "acceleration": 2}


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
        Without a baseline; with a covariance if `relative_error` > 0 (errors of different coefficients are
        taken as independent, which for a wrong support stiffness, say, they are not).

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
    return Influence(
        speeds=model.speeds,
        sensors=tuple(sensors),
        planes=tuple(planes),
        W=W,
        covariance=_model_covariance(W, relative_error) if relative_error else None,
        labels=labels or default,
        warnings=model.warnings,
    )


def with_parameters(influence: Influence, columns: ArrayLike, lack: ArrayLike) -> Influence:
    """Coefficients of a model with the errors of its parameters.

    Parameters
    ----------
    influence
        As of `model_influence`; a covariance of its own is replaced.
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
    F = np.asarray(columns, dtype=complex)
    found = replace(influence, parameters=np.concatenate((np.zeros_like(F[..., :1]), F), axis=-1))
    own = _model_covariance(found.W, np.broadcast_to(far, found.W.shape[:2])[..., None])
    return replace(found, covariance=own + marginal(None, found.parameters))


def modal_shapes(
    rotor: Rotor, planes: Mapping[str, str | int] | Sequence[str | int], modes: int
) -> FloatArray:
    """Deflection of stations in the modes at the lowest critical speeds.

    Parameters
    ----------
    rotor
        The rotor.
    planes
        Node number or station of each, Q of them; by name, or only a list.
    modes
        k, how many, from 1.

    Returns
    -------
    Shape (Q, k), each mode scaled to its largest deflection on the rotor.

    Raises
    ------
    ValueError
        For modes or nodes that the model does not have.
    """
    from fem import critical_speeds

    found = critical_speeds(rotor, n=modes)
    if found.shapes.shape[1] < modes:
        raise ValueError(f"the model has only {found.shapes.shape[1]} of {modes} modes in reach")
    nodes = planes.values() if isinstance(planes, Mapping) else planes
    rows = [rotor.node(node) - 1 for node in nodes]
    shapes = found.shapes[:, :modes]
    return np.asarray(shapes[rows] / np.abs(shapes).max(axis=0))


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


def _model_covariance(W: ComplexArray, relative_error: float | FloatArray) -> FloatArray:
    """Covariance (S, C, 2P + 2, 2P + 2): (relative error · |W|)² of each part, nothing in common."""
    S, C, P = W.shape
    out = np.zeros((S, C, 2 * P + 2, 2 * P + 2))
    own = np.arange(2, 2 * P + 2)
    out[..., own, own] = np.repeat((relative_error * np.abs(W)) ** 2, 2, axis=-1)
    return out
