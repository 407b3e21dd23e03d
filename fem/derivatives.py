"""What numbers of a rotor change in its synchronous receptance, by the adjoint of the banded equations.

D z = f with the dynamic stiffness D of the whole rotor at λ = iω on forward and backward amplitudes,
x = F + b, y = −i (F − b): a load that turns with the rotor is f on F alone, a sensor at the angle α reads
u = (e^{−iα}, e^{iα}). With the solutions q = D⁻¹ f for each load and p = D⁻ᵀ u for each sensor, of which both
have the same LU factors,

    H = uᵀ q,    ∂H / ∂θ = −pᵀ (∂D / ∂θ) q.

Bands of the shaft act on each wave by itself, K − ω² (M − G) on F and K + 2 i ω B − ω² (M + G) on b. ∂D is a
difference of matrices, exact where they are linear or quadratic in θ; no equation is solved for it.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import Any

import numpy as np

from fem.assembly import WholeBand, assemble, both_planes, multiply, whirl_change
from fem.result import holding_arrays
from fem.rotor import Rotor
from rotorid.base.arrays import ComplexArray, FloatArray, IndexArray

_BANDS = ("shaft", "mass", "gyroscopic", "material")
_CHUNK = 32  # speeds at a time, so that memory does not grow with them


@holding_arrays
class MatrixChange:
    """∂D by one number of a rotor: bands of shaft and discs that change, and supports at nodes.

    Supports, (S, k, 2, 2), act on (F, b) as in `Supported`.

    Attributes
    ----------
    bands
        Of `_BANDS`, each of shape (width + 1, size); none where supports alone change.
    nodes
        Of the supports that change, from 1, length k.
    supports
        Shape (S, k, 2, 2), on forward and backward amplitudes.
    """

    bands: list[FloatArray]
    nodes: tuple[int, ...]
    supports: ComplexArray


def matrix_change(changed: Callable[[float], Rotor], step: float, speeds: FloatArray) -> MatrixChange:
    """∂D of the rotors `changed(by)`; on one side only, where the other is no rotor.

    Parameters
    ----------
    changed
        Gives the rotor with the number changed by so much.
    step
        By how much it is changed, in its unit.
    speeds
        rad/s, shape (S,).

    Returns
    -------
    The change per unit of the number.
    """
    ends, width = [], 0.0
    for side in (step, -step):
        try:
            ends.append(changed(side))
            width += step
        except ValueError:
            ends.append(changed(0.0))
    if width == 0:
        raise ValueError("the rotor can have no other value here, neither larger nor smaller")
    up, down = ends
    pairs = [pair for pair in zip(up.supports, down.supports, strict=True) if pair[0] != pair[1]]
    supports = np.zeros((speeds.size, len(pairs), 2, 2), dtype=complex)
    for k, pair in enumerate(pairs):
        supports[:, k] = whirl_change(*pair, speeds) / width
    bands = list[FloatArray]()
    if all(more.tilting_stiffness != less.tilting_stiffness for more, less in pairs):  # of the shaft, too
        one, other = assemble(up), assemble(down)
        bands = [(getattr(one, name) - getattr(other, name)) / width for name in _BANDS]
    return MatrixChange(bands, tuple(more.node for more, _ in pairs), supports)


@holding_arrays
class ReceptanceWithDerivatives:
    """Receptance H (S, a, b) of sensors and loads, its derivatives by p numbers and by the sensors' angles.

    `by_number` has the shape (p, S, a, b); `by_angle`, (S, a, b), is per rad of each sensor's own angle.
    """

    H: ComplexArray
    by_number: ComplexArray
    by_angle: ComplexArray


def receptance_with_derivatives(
    rotor: Rotor,
    loads: FloatArray,
    rows: IndexArray,
    angles: FloatArray,
    speeds: FloatArray,
    changes: Sequence[MatrixChange],
) -> ReceptanceWithDerivatives:
    """Compute what sensors read under real loads that turn with the rotor, and how numbers change it.

    Parameters
    ----------
    rotor
        The rotor.
    loads
        Real vectors, shape (size, b).
    rows
        Unknowns that the sensors read, from 0, shape (a,).
    angles
        Of their directions from x with the rotation, rad, (a,).
    speeds
        rad/s, shape (S,).
    changes
        ∂D of p numbers, at these speeds.

    Raises
    ------
    ValueError
        Outside a bearing table.
    """
    whole = WholeBand(both_planes(rotor, complex_coordinate=False))
    A, turn = whole.P.A, np.exp(1j * angles)[:, None]
    f, u = (np.zeros((A.size, 2, n), complex) for n in (loads.shape[1], rows.size))
    f[:, 0] = loads
    u[rows, :, np.arange(rows.size)] = np.hstack((1 / turn, turn))
    H, by_angle = np.empty((2, speeds.size, rows.size, loads.shape[1]), dtype=complex)
    by_number = np.zeros((len(changes), *H.shape), dtype=complex)
    for start in range(0, speeds.size, _CHUNK):
        part = slice(start, start + _CHUNK)
        factors = [whole.factor(1j * speed, speed) for speed in speeds[part].tolist()]
        solved = [one(f.reshape(whole.size, -1)) for one in factors]
        adjoint = [one(u.reshape(whole.size, -1), transposed=True) for one in factors]
        # (S, size, 2, b) and (S, a, size, 2), forward and backward
        q, p = np.reshape(solved, (-1, *f.shape)), np.moveaxis(np.reshape(adjoint, (-1, *u.shape)), -1, 1)
        F, b = q[:, rows, 0], q[:, rows, 1]
        H[part] = F / turn + b * turn
        by_angle[part] = 1j * (b * turn - F / turn)
        omega = speeds[part, None, None]
        square = omega**2
        on_planes: Any = (
            (1.0, 1.0),
            (-square, -square),
            (square, -square),
            (0.0, 2j * omega),
        )
        for change, derivative in zip(changes, by_number[:, part], strict=True):
            for k, node in enumerate(change.nodes):
                at = A.deflection(node)
                derivative -= p[:, :, at] @ change.supports[part, k] @ q[:, at]
            moved = q.swapaxes(0, 1)
            for band, factors_of in zip(change.bands, on_planes, strict=False):
                if band.any():
                    forces = multiply(band, moved.reshape(A.size, -1)).reshape(moved.shape).swapaxes(0, 1)
                    for plane, factor in enumerate(factors_of):
                        derivative -= factor * (p[..., plane] @ forces[:, :, plane])
    return ReceptanceWithDerivatives(H, by_number, by_angle)
