"""Orbits of shaft centres: axes, inclination, direction and probe readings from complex amplitudes.

x(t) = Re(X e^{iωt}), y(t) = Re(Y e^{iωt}), rotation positive from x to y. The orbit is the sum of a forward
circle F = (X + iY)/2 and a backward one B = (X − iY)/2: z = F e^{iωt} + B̄ e^{−iωt}.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike

from rotorid.base.arrays import ComplexArray, FloatArray

DIRECTION_NAMES = {1.0: "forward", -1.0: "backward", 0.0: "mixed"}
STRAIGHT = 1e-9  # minor by major axis below which an orbit is a line: rounding, not whirl
_SMALL = 1e-2  # area by the largest area of a mode below which a node has no say in its direction


@dataclass(frozen=True, eq=False)
class Orbits:
    """Ellipses, all arrays of one shape.

    Attributes
    ----------
    major, minor
        Semi-axes, not negative, in the unit of the amplitudes.
    inclination
        Of the major axis from x, with the rotation, rad, above −π/2 up to π/2.
    phase
        Lead of the motion along the major axis (its positive end at `inclination`), rad, −π to π: the shaft
        is farthest out there when ωt = −phase.
    direction
        1 forward (with the rotation), −1 backward, 0 a straight line.
    """

    major: FloatArray
    minor: FloatArray
    inclination: FloatArray
    phase: FloatArray
    direction: FloatArray


def orbits(x: ArrayLike, y: ArrayLike) -> Orbits:
    """Compute the ellipses of complex amplitudes x and y (peak values).

    Parameters
    ----------
    x, y
        Complex amplitudes of the same unit, shapes that broadcast.

    Examples
    --------
    >>> found = orbits(3.0, -2.0j)
    >>> float(found.major), float(found.minor), float(found.direction)
    (3.0, 2.0, 1.0)
    """
    X, Y = np.broadcast_arrays(np.asarray(x, dtype=complex), np.asarray(y, dtype=complex))
    forward, backward = (X + 1j * Y) / 2, (X - 1j * Y) / 2
    f, b = np.abs(forward), np.abs(backward)
    a, c = np.angle(forward), np.angle(backward)
    inclination, phase = (a - c) / 2, (a + c) / 2
    # A circle has no major axis: measure from x.
    round_ = np.minimum(f, b) <= 1e-15 * np.maximum(f, b)
    whole = np.where(f >= b, a, c)
    inclination, phase = np.where(round_, 0.0, inclination), np.where(round_, whole, phase)
    turned = (inclination > np.pi / 2) | (inclination <= -np.pi / 2)
    inclination = inclination - np.where(turned, np.copysign(np.pi, inclination), 0.0)
    phase = phase + np.where(turned, np.pi, 0.0)
    major, minor = f + b, np.abs(f - b)
    line = minor <= STRAIGHT * major
    return Orbits(
        major=major,
        minor=np.where(line, 0.0, minor),
        inclination=inclination,
        phase=np.angle(np.exp(1j * phase)),
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
    angle = np.asarray(angle, dtype=float)
    return np.asarray(
        np.asarray(x, dtype=complex) * np.cos(angle) + np.asarray(y, dtype=complex) * np.sin(angle)
    )


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
    X, Y = np.asarray(x, dtype=complex), np.asarray(y, dtype=complex)
    area = (np.conj(X) * -Y).imag  # π times this is the area
    size = (np.abs(X) ** 2 + np.abs(Y) ** 2).max(axis=-1)
    seen = _SMALL * np.maximum(np.abs(area).max(axis=-1), STRAIGHT * size)
    some_forward = (area > seen[..., None]).any(axis=-1)
    some_backward = (area < -seen[..., None]).any(axis=-1)
    flat = np.abs(area).max(axis=-1) <= STRAIGHT * size
    one_way = some_forward.astype(float) - some_backward.astype(float)
    return np.asarray(np.where(flat, 0.0, one_way))
