"""Dynamic stiffness of the supports at synchronous vibration, at their nodes, over speed."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from fem.matrices.undamped_matrices import FROM_XY, TO_XY
from fem.model.rotor import Rotor
from fem.model.supports import Support
from rotorid.base.arrays import ComplexArray, FloatArray


@dataclass(frozen=True, eq=False)
class Supported:
    """Dynamic stiffness at the supported nodes, everything that stands at a node added up.

    Attributes
    ----------
    nodes
        Numbers from 1, length s.
    stiffness
        D on forward and backward amplitudes (F, b), N/m, shape (S, s, 2, 2); on rotationally symmetric
        supports only entry (0, 0) matters.
    reference
        Real spring nearest to D at each node, N/m, shape (s,): what the conservative rotor stands on.
    planes
        1: forward only; 2: forward and backward are coupled.
    """

    nodes: tuple[int, ...]
    stiffness: ComplexArray
    reference: FloatArray
    planes: int


def supported(rotor: Rotor, speeds: FloatArray) -> Supported:
    """Dynamic stiffness of all supports at speeds in rad/s.

    Raises
    ------
    ValueError
        If a speed lies outside a bearing table.
    """
    total: dict[int, ComplexArray] = {}
    reference: dict[int, float] = {}
    for support in rotor.supports:
        D = on_whirl(support, speeds)
        # A pedestal may be beyond its resonance at most speeds: a negative spring holds nothing.
        k = float(support.stiffness) if support.plain else max(float(np.median(D[:, 0, 0].real)), 0.0)
        total[support.node] = total[support.node] + D if support.node in total else D
        reference[support.node] = reference.get(support.node, 0.0) + k
    planes = 1 if rotor.symmetric else 2
    stiffness = np.stack(list(total.values()), axis=1) if total else np.zeros((speeds.size, 0, 2, 2), complex)
    return Supported(tuple(total), stiffness, np.array(list(reference.values())), planes)


def on_whirl(support: Support, speeds: FloatArray) -> ComplexArray:
    """Dynamic stiffness of one support on (F, b) at speeds in rad/s, N/m, shape (S, 2, 2)."""
    if support.plain:  # many have no others, and this is where a response begins
        D = np.zeros((speeds.size, 2, 2), dtype=complex)
        D[:, 0, 0] = D[:, 1, 1] = support.stiffness + 1j * speeds * support.damping
        return D
    return _turned(support.dynamic_stiffness(speeds))


def whirl_change(more: Support, less: Support, speeds: FloatArray) -> ComplexArray:
    """The differential between two neighbouring supports, as `on_whirl`, with no digits lost to the pedestal.

    Bearing B and pedestal S in series are D = B − B (B + S)⁻¹ B: dD = S G dB G S + B G dS G B, G = (B + S)⁻¹.
    """
    (B, S), (other, beneath) = (support.dynamic_parts(speeds) for support in (more, less))
    change = B - other
    if S is not None and beneath is not None:
        moved, B, S = S - beneath, (B + other) / 2, (S + beneath) / 2
        G = np.linalg.inv(B + S)
        parts = [(S, change), (B, moved)]
        change = sum((X @ G @ dX @ G @ X for X, dX in parts if dX.any()), start=np.zeros_like(B))
    return _turned(change)


def _turned(D: ComplexArray) -> ComplexArray:
    """From (x, y) to (F, b): T⁻¹ D T of matrices (S, 2, 2), as one product."""
    return np.asarray((D.reshape(-1, 4) @ np.kron(FROM_XY, TO_XY.T).T).reshape(D.shape))
