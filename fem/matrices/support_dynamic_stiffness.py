"""What the supports of a rotor do at synchronous vibration: dynamic stiffness at nodes, over speed."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from fem.matrices.undamped_matrices import FROM_XY, TO_XY
from fem.model.rotor import Rotor
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
        if support.plain:  # many have no others, and this is where a response begins
            k = float(support.stiffness)
            D = np.zeros((speeds.size, 2, 2), dtype=complex)
            D[:, 0, 0] = D[:, 1, 1] = k + 1j * speeds * support.damping
        else:
            D = FROM_XY @ support.dynamic_stiffness(speeds) @ TO_XY
            # A pedestal may be beyond its resonance at most speeds: a negative spring holds nothing.
            k = max(float(np.median(D[:, 0, 0].real)), 0.0)
        total[support.node] = total[support.node] + D if support.node in total else D
        reference[support.node] = reference.get(support.node, 0.0) + k
    planes = 1 if rotor.symmetric else 2
    stiffness = np.stack(list(total.values()), axis=1) if total else np.zeros((speeds.size, 0, 2, 2), complex)
    return Supported(tuple(total), stiffness, np.array(list(reference.values())), planes)
