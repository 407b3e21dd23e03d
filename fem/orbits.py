"""Orbits of shaft centres: axes, inclination, direction and probe readings from complex amplitudes.

x(t) = Re(X e^{iωt}), y(t) = Re(Y e^{iωt}), rotation positive from x to y. The orbit is the sum of a forward
circle F = (X + iY)/2 and a backward one B = (X − iY)/2: z = F e^{iωt} + B̄ e^{−iωt}.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike

from fem.result import holding_arrays
from rotorid.base.arrays import ComplexArray, FloatArray

DIRECTION_NAMES = {1.0: "forward", -1.0: "backward", 0.0: "mixed"}
STRAIGHT = 1e-9  # minor by major axis below which an orbit is a line: rounding, not whirl


@holding_arrays
class Orbits:
    """Ellipses, all arrays of one shape.

    Attributes
    ----------
    major, minor
        Semi-axes, not negative, in the unit of the amplitudes.
    inclination
        Of the major axis from x, with the rotation, rad, above −π/2 up to π/2.
    direction
        1 forward (with the rotation), −1 backward, 0 a straight line.
    """

    major: FloatArray
    minor: FloatArray
    inclination: FloatArray
    direction: FloatArray


def orbits(x: ArrayLike, y: ArrayLike) -> Orbits:
    """Compute the ellipses of complex amplitudes x and y (peak values).

    Parameters
    ----------
    x, y
        Complex amplitudes of the same unit, shapes that broadcast.

    Examples
    --------
    >>> ellipse = orbits(3.0, -2.0j)
    >>> float(ellipse.major), float(ellipse.minor), float(ellipse.direction)
    (3.0, 2.0, 1.0)
    """
    forward, backward = (np.add(x, np.multiply(way, y)) / 2 for way in (1j, -1j))
    f, b = np.abs(forward), np.abs(backward)
    half = (np.angle(forward) - np.angle(backward)) / 2
    # A circle has no major axis: measure from x.
    circle = np.minimum(f, b) <= 1e-15 * np.maximum(f, b)
    line = np.abs(f - b) <= STRAIGHT * (f + b)
    return Orbits(
        major=f + b,
        minor=np.where(line, 0.0, np.abs(f - b)),
        inclination=np.where(circle, 0.0, half - np.pi * np.ceil(half / np.pi - 0.5)),
        direction=np.where(line, 0.0, np.sign(f - b)),
    )


def probe(x: ArrayLike, y: ArrayLike, angle: ArrayLike) -> ComplexArray:
    """Complex amplitude that a probe reads.

    Parameters
    ----------
    x, y
        Complex amplitudes of the node in both directions.
    angle
        Where the probe points, rad from x with the rotation.

    Returns
    -------
    x cos(angle) + y sin(angle), the shapes broadcast.
    """
    return np.multiply(x, np.cos(angle)) + np.multiply(y, np.sin(angle)) + 0j


def whirl_direction(x: ArrayLike, y: ArrayLike) -> FloatArray:
    """Direction of whole modes: 1 forward or −1 backward at every node, 0 where nodes differ, or lines.

    Orbits of less than 1 % of the largest area do not count.

    Parameters
    ----------
    x, y
        Complex amplitudes, nodes along the last axis, shape (…, N).

    Returns
    -------
    1, −1 or 0, shape (…).
    """
    X, Y = np.asarray(x), np.asarray(y)
    area = X.imag * Y.real - X.real * Y.imag  # over π
    line = STRAIGHT * (X.real**2 + X.imag**2 + Y.real**2 + Y.imag**2).max(axis=-1)
    least = np.maximum(1e-2 * abs(area).max(axis=-1), line)
    counts = np.sign(area) * (abs(area) > least[..., None])
    return np.asarray((counts.max(axis=-1) + counts.min(axis=-1)).clip(-1, 1))
