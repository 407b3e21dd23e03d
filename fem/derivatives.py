"""What numbers of a rotor change in its synchronous receptance, by the adjoint of the banded equations.

In both planes D z = f with the dynamic stiffness D of the whole rotor at λ = iω. With the solutions q = D⁻¹ f
for each load and p = D⁻ᵀ u for each sensor, of which both have the same LU factors,

    H = uᵀ q,    ∂H / ∂θ = −pᵀ (∂D / ∂θ) q.

∂D is written for forward and backward amplitudes, x = F + b, y = −i (F − b): bands of the shaft act on each
by itself, K − ω² (M − G) on F and K + 2 i ω B − ω² (M + G) on b, and p goes with the transposed
transformation, p_F = p_x − i p_y, p_b = p_x + i p_y. It is a difference of matrices, exact where they are
linear or quadratic in θ; no equation is solved for it.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from fem.assembly import (
    FROM_XY,
    TO_XY,
    WholeBand,
    assemble,
    both_planes,
    multiply,
    whirl_change,
)
from fem.rotor import Rotor
from rotorid.base.arrays import ComplexArray, FloatArray, IndexArray

_BANDS = ("shaft", "mass", "gyroscopic", "material")
_CHUNK = 32  # speeds at a time, so that memory does not grow with them


@dataclass(frozen=True, eq=False)
class MatrixChange:
    """∂D by one number of a rotor: bands of shaft and discs that change, and supports at nodes.

    The bands, by name, are those of the unknowns from `first` on; supports, (S, k, 2, 2), act on (F, b) as in
    `Supported`.

    Attributes
    ----------
    bands
        By name, upper bands of the unknowns that change.
    first
        Their first unknown, from 0.
    nodes
        Of the supports that change, from 1, length k.
    supports
        Shape (S, k, 2, 2), on forward and backward amplitudes.
    """

    bands: dict[str, FloatArray]
    first: int
    nodes: tuple[int, ...]
    supports: ComplexArray


def matrix_change(
    changed: Callable[[float], Rotor], value: float, step: float, speeds: FloatArray
) -> MatrixChange:
    """∂D of the rotors `changed(value)`; on one side only, where the other is no rotor.

    Parameters
    ----------
    changed
        Gives the rotor with another value of the number.
    value, step
        The number, and by how much it is changed, in its unit.
    speeds
        rad/s, shape (S,).

    Returns
    -------
    The change per unit of the number.
    """
    ends, width = [], 0.0
    for side in (step, -step):
        try:
            ends.append(changed(value + side))
            width += step
        except ValueError:
            ends.append(changed(value))
    if width == 0:
        raise ValueError("the rotor can have no other value here, neither larger nor smaller")
    up, down = ends
    pairs = [pair for pair in zip(up.supports, down.supports, strict=True) if pair[0] != pair[1]]
    supports = np.zeros((speeds.size, len(pairs), 2, 2), dtype=complex)
    for k, pair in enumerate(pairs):
        supports[:, k] = whirl_change(*pair, speeds) / width
    one, other = assemble(up), assemble(down)
    changes = {name: (getattr(one, name) - getattr(other, name)) / width for name in _BANDS}
    columns = np.flatnonzero([each.any(axis=0) for each in changes.values()]) % one.size
    first, end = max(0, columns.min(initial=one.size) - one.width), columns.max(initial=0) + 1
    bands = {name: band[:, first:end] for name, band in changes.items() if band.any()}
    return MatrixChange(bands, first, tuple(more.node for more, _ in pairs), supports)


@dataclass(frozen=True, eq=False)
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
    A, each = whole.P.A, np.arange(rows.size)
    f = whole.interleaved(loads.T[:, None] * np.array([[1.0], [-1j]])).T
    u = np.zeros((rows.size, 2, A.size))
    u[each, :, rows] = np.column_stack((np.cos(angles), np.sin(angles)))
    seen, turn = whole.interleaved(u).T, np.exp(1j * angles)[:, None]
    H, by_angle = np.empty((2, speeds.size, rows.size, loads.shape[1]), dtype=complex)
    by_number = np.zeros((len(changes), *H.shape), dtype=complex)
    for start in range(0, speeds.size, _CHUNK):
        part = slice(start, start + _CHUNK)
        factors = [whole.factor(1j * speed, speed) for speed in speeds[part].tolist()]
        # q (S, b, 2, size) and p (S, a, 2, size), forward and backward
        q = FROM_XY @ whole.planes(np.array([one.solve(f).T for one in factors]))
        p = TO_XY.T @ whole.planes(np.array([one.solve(seen, transposed=True).T for one in factors]))
        F, b = np.moveaxis(q[..., rows], 2, 0).swapaxes(2, 3)
        H[part] = F / turn + b * turn
        by_angle[part] = 1j * (b * turn - F / turn)
        omega = speeds[part, None, None]
        on_planes: tuple[tuple[Any, Any], ...] = (
            (1.0, 1.0),
            (-(omega**2), -(omega**2)),
            (omega**2, -(omega**2)),
            (0.0, 2j * omega),
        )
        for change, derivative in zip(changes, by_number[:, part], strict=True):
            for k, node in enumerate(change.nodes):
                at = A.deflection(node)
                derivative -= p[..., at] @ change.supports[part, k] @ q[..., at].swapaxes(1, 2)
            for name, band in change.bands.items():
                acting = slice(change.first, change.first + band.shape[1])
                moved = np.moveaxis(q[..., acting], -1, 0)
                forces = multiply(band, moved.reshape(len(moved), -1)).reshape(moved.shape)
                for plane, factor in enumerate(on_planes[_BANDS.index(name)]):
                    derivative -= factor * (p[:, :, plane, acting] @ forces[..., plane].swapaxes(0, 1))
    return ReceptanceWithDerivatives(H, by_number, by_angle)
