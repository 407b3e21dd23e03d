"""The part of a motion that turns with the shaft (1×), by a slow filter."""

from __future__ import annotations

import numpy as np

from rotorid.base.arrays import ComplexArray, FloatArray
from rotorid.motion.run import LEAST_A_TURN, MotionRun

_OF_A_TURN, _A_TURN = 64, 8
"""Of these so many are told."""


def synchronous_part(motion: MotionRun, turns: int = 4) -> tuple[FloatArray, ComplexArray]:
    """Follow the synchronous part of the deflections in x, that of x(t) = Re(X e^{iφ}) + the rest.

    Each value is a mean over so many whole turns, which fades at both ends.

    Parameters
    ----------
    motion
        With eight samples a turn at least.
    turns
        Averaged over, 2 or more.

    Returns
    -------
    Speeds in the middle of these turns, rad/s, shape (r,), and X at the nodes, m, shape (r, m).

    Raises
    ------
    ValueError
        For fewer samples a turn, or fewer turns.
    """
    from scipy.interpolate import CubicSpline
    from scipy.signal import fftconvolve

    angle = motion.turned - motion.turned[0]
    whole = int(angle[-1] / (2 * np.pi))
    if whole < turns:
        raise ValueError(f"the rotor makes {whole} turns; {turns} are needed for its synchronous part")
    if not motion.resolved:
        raise ValueError(
            f"{LEAST_A_TURN} samples a turn are needed at least for the synchronous part: a higher rate"
        )
    even = np.arange(whole * _OF_A_TURN + 1) * (2 * np.pi / _OF_A_TURN)
    rising = np.concatenate([[True], np.diff(angle) > 0])
    x = CubicSpline(angle[rising], motion.z.real[rising])(even)
    turning = 2 * x * np.exp(-1j * (motion.turned[0] + even))[:, None]
    window = np.hanning(turns * _OF_A_TURN + 1)[:-1]
    mean = fftconvolve(turning, window[:, None] / window.sum(), mode="valid", axes=0)
    each = slice(None, None, _OF_A_TURN // _A_TURN)
    return np.interp(even[: len(mean)] + turns * np.pi, angle, motion.speed)[each], mean[each]
