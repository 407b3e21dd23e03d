"""One mass at one node, for tests of motion."""

import numpy as np

from fem import Motion
from rotorid.motion.system import system


def one_mass(m=1.0, c=0.0, k=0.0, *, speeds=(0.0, 1e4), weight=0.0, unbalance=0.0, forces=()):
    """With one damping, one stiffness or two, a weight (complex: with its angle), and kg·m of unbalance."""
    matrices = {"M": m * np.eye(2), "C": c * np.eye(2), "K": np.diag(np.broadcast_to(k, 2).astype(float))}
    pull = -1j * weight if isinstance(weight, float) else weight
    return system(
        lambda speed: Motion(**matrices, coordinates=("x1", "y1"), speed=speed),
        np.array(speeds),
        forces=forces,
        weight={"x1": pull.real, "y1": pull.imag},
        unbalance={1: unbalance} if unbalance else {},
    )
