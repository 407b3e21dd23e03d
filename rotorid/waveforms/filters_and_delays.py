"""What filters, integrators and delays did to a vector, taken off again.

A channel reads y = H(d/dt) x with H(s) = s^m · (its high-pass)(s) · e^{−sτ}: m more derivatives than are
wanted (an accelerometer whose displacement is asked for: 2). With x = X(t) e^{iκ(t)}, κ' = w, the vectors
follow Y = H(iw + d/dt) X, of which the steady term H X and those of first order are kept: Y = H X + H' X' +
½ H'' (i w') X, derivatives of H by s at iw. While the speed passes a resonance, H' X' is half a per cent of
an integrated vector and more.
"""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
from scipy.signal import butter

from rotorid.base.arrays import AnyArray, ComplexArray, FloatArray
from rotorid.waveforms.record import SignalPath

STEP = 1e-4
"""Of s, for the differences that are derivatives of H."""


def response(path: SignalPath, derivatives: int) -> Callable[[AnyArray], AnyArray]:
    """H(s) of a channel that reads so many derivatives more than are wanted (negative: fewer)."""
    zeros, poles = [], []
    if path.high_pass_rad_s is not None:
        zeros, poles, _ = butter(
            path.high_pass_order, path.high_pass_rad_s, "high", analog=True, output="zpk"
        )

    def H(s: AnyArray) -> AnyArray:
        out = s**derivatives * np.exp(-s * path.delay_s)
        for zero, pole in zip(zeros, poles, strict=True):
            out = out * (s - zero) / (s - pole)
        return out

    return H


def before_path(
    H: Callable[[AnyArray], AnyArray],
    y: ComplexArray,
    slope: ComplexArray,
    w: FloatArray,
    rate: FloatArray,
) -> tuple[ComplexArray, FloatArray]:
    """The vector before a path, and what its errors are multiplied by.

    Parameters
    ----------
    H
        Of the path.
    y, slope
        Vectors as they were read, and their change per s, (P,).
    w, rate
        Frequency of the order, rad/s, and its change per s, (P,).
    """
    s = np.asarray(1j * w)
    d = np.asarray(STEP * w + 0j)
    here, above, below = H(s), H(s + d), H(s - d)
    first, second = (above - below) / (2 * d), (above - 2 * here + below) / d**2
    x = y / here
    change = (slope - first * 1j * rate * x) / here
    return (y - first * change - 0.5j * second * rate * x) / here, 1 / np.abs(here)
