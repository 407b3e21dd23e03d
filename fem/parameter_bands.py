"""Error bands of what a calibrated rotor gives, from the covariance of its parameters."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from fem.model.rotor import Rotor
from fem.model.rotor_parameters import with_changes
from rotorid.base.arrays import AnyArray, FloatArray

NORMAL_95 = 1.959964
"""Standard deviations from the middle to the ends of 95 %."""
_ROUGH = 0.15
"""Of a value: standard deviation above which a band is no longer linear nor symmetric."""


def spread(rotor: Rotor, evaluate: Callable[[Rotor], AnyArray]) -> FloatArray:
    """Standard deviations of what a rotor gives over its calibrated parameters.

    The parameters are changed up and down by √3 times each principal column of the covariance (Gauss and
    Hermite's points): Σ (f₊ − f₋)² / 12 + (f₊ + f₋ − 2 f)² / 18, exact for a parabola along each column.

    Parameters
    ----------
    rotor
        With its calibration.
    evaluate
        Gives an array, real or complex, the same shape whatever the parameters.

    Returns
    -------
    Of that shape; NaN where any of them is.

    Raises
    ------
    ValueError
        For a rotor without a calibration, parameters that cannot be changed so far, arrays of another shape.
    """
    if rotor.calibration is None:
        raise ValueError("the rotor has no calibration")
    names, middle = rotor.calibration.names, np.asarray(evaluate(rotor))
    square = np.zeros(middle.shape)
    for column in np.sqrt(3.0) * rotor.calibration.columns().T:
        up, down = (
            np.asarray(evaluate(with_changes(rotor, dict(zip(names, way * column, strict=True)))))
            for way in (1.0, -1.0)
        )
        if up.shape != middle.shape or down.shape != middle.shape:
            raise ValueError("their number changes")
        square += np.abs(up - down) ** 2 / 12 + np.abs(up + down - 2 * middle) ** 2 / 18
    return np.sqrt(square)


def band(
    rotor: Rotor, what: str, evaluate: Callable[[Rotor], AnyArray]
) -> tuple[FloatArray | None, tuple[str, ...]]:
    """`spread`, or None without a calibration and where it cannot be given, and what is to be said."""
    if rotor.calibration is None:
        return None, ()
    try:
        std = spread(rotor, evaluate)
    except ValueError as error:
        return None, (f"no error bands of {what}: within the errors of the calibration, {error}",)
    said = []
    if rotor.calibration.needs_trial_run:
        said.append("the readings of the calibration contradict the model: its errors exceed the bands")
    if rough := int(np.count_nonzero(std > _ROUGH * np.abs(evaluate(rotor)))):
        said.append(
            f"{rough} of {std.size} error bands of {what} are wider than ±30 % and rough: a "
            "resonance that moves with the parameters is not linear in them"
        )
    return std, tuple(said)


def nearest_modes(middle: FloatArray, found: FloatArray) -> FloatArray:
    """Frequencies of modes over speed, shape (S, n), in the order of those that they are nearest to.

    Two modes that exchange their numbers with the parameters keep them so. As they are if n differs.
    """
    from scipy.optimize import linear_sum_assignment

    if found.shape != middle.shape:
        return found
    apart = np.nan_to_num(middle[:, :, None] - found[:, None, :]) ** 2
    return np.asarray(found[:, linear_sum_assignment(apart.sum(axis=0))[1]])
