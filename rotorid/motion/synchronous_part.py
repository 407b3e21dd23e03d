"""The part of a motion that turns with the shaft (1×), turn by turn, by a slow filter."""

from __future__ import annotations

import numpy as np

from rotorid.base.arrays import ComplexArray, FloatArray
from rotorid.motion.run import MotionRun

_LEAST = 8
"""Samples a turn that it needs."""
_OF_A_TURN = 64


def synchronous_part(motion: MotionRun, turns: int = 4) -> tuple[FloatArray, ComplexArray]:
    """Follow the synchronous part of the deflections in x, that of x(t) = Re(X e^{iφ}) + the rest.

    Each value is that of so many whole turns.

    Parameters
    ----------
    motion
        With eight samples a turn at least.
    turns
        Averaged over, 1 or more.

    Returns
    -------
    Speeds in the middle of these turns, rad/s, shape (r,), and X at the nodes, m, shape (r, m).

    Raises
    ------
    ValueError
        For fewer samples a turn, or fewer turns.
    """
    from scipy.interpolate import CubicSpline

    angle = motion.turned - motion.turned[0]
    whole = int(angle[-1] / (2 * np.pi))
    if whole < turns:
        raise ValueError(f"the rotor makes {whole} turns; {turns} are needed for its synchronous part")
    if np.diff(angle).max() > 2 * np.pi / _LEAST:
        raise ValueError(
            f"{_LEAST} samples a turn are needed at least for the synchronous part: a higher rate"
        )
    even = np.arange(whole * _OF_A_TURN) * (2 * np.pi / _OF_A_TURN)
    turned = angle > 1e-9 * angle[-1]
    turned[0] = True
    turned[1:] &= np.diff(angle) > 0
    x = CubicSpline(angle[turned], motion.z.real[turned])(even)
    each = 2 * (x * np.exp(-1j * (motion.turned[0] + even))[:, None]).reshape(whole, _OF_A_TURN, -1).mean(
        axis=1
    )
    total = np.concatenate([np.zeros((1, each.shape[1])), np.cumsum(each, axis=0)])
    middle = 2 * np.pi * (np.arange(whole - turns + 1) + turns / 2)
    return np.interp(middle, angle, motion.speed), (total[turns:] - total[:-turns]) / turns
