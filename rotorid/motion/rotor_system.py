"""The motion of a rotor with forces that are not linear: its beam elements, weight, unbalance and bow."""

from __future__ import annotations

import dataclasses
from collections.abc import Mapping

import numpy as np

import fem
from fem.static import GRAVITY
from rotorid.base.arrays import ComplexArray, FloatArray, IndexArray
from rotorid.base.checks import number
from rotorid.motion.system import MotionSystem, system


def rotor_system(
    rotor: fem.Rotor,
    lowest: float,
    highest: float,
    *,
    unbalance: Mapping[int, complex] | None = None,
    bow: Mapping[int, complex] | None = None,
    gravity: float = GRAVITY,
    direction: float = -90.0,
) -> MotionSystem:
    """Put together what moves of a rotor at speeds from `lowest` to `highest`, rad/s.

    Parameters
    ----------
    unbalance
        m e e^{iβ} by node, kg·m, β with the rotation.
    bow
        How far the shaft at rest deviates from a straight line by node, m, complex, at three nodes or more;
        between them it runs as a shaft does that is bent there.
    gravity, direction
        m/s², and where it points, degrees from x with the rotation; −y by default.

    Raises
    ------
    ValueError
        Speeds that are no range or outside a bearing table; nodes that do not exist; a bow at fewer than
        three nodes.
    """
    lowest, highest = number(lowest, "lowest speed"), number(highest, "highest speed")
    if not lowest < highest:
        raise ValueError(f"the speeds must ascend, not from {lowest:.6g} to {highest:.6g} rad/s")
    inside = {s for support in rotor.supports for s in support.speeds if lowest < s < highest}
    motion = fem.equations_of_motion(rotor.linear, speed=lowest)
    down = dict(zip("xy", weight_along(gravity, direction), strict=True))
    weight = motion.M @ [down.get(name[0], 0.0) for name in motion.coordinates]
    straight = dataclasses.replace(
        rotor.linear, supports=(), material_damping=np.zeros_like(rotor.material_damping)
    )
    plane = fem.equations_of_motion(straight, plane="x")
    bent = {rotor.node(node): value for node, value in (bow or {}).items()}
    at = np.array([plane.index(f"x{node}") for node in bent], dtype=np.intp)
    pull = bow_forces(plane.K, at, np.array(list(bent.values()), dtype=complex))
    return system(
        lambda speed: fem.equations_of_motion(rotor.linear, speed=speed),
        np.array([lowest, *sorted(inside), highest]),
        forces=rotor.forces,
        weight=dict(zip(motion.coordinates, weight.tolist(), strict=True)),
        unbalance=unbalance,
        bow={
            f"{axis}{node}": turned * force
            for node, force in zip(bent, pull, strict=True)
            for axis, turned in (("x", 1), ("y", -1j))
        },
    )


def weight_along(gravity: float, direction: float) -> tuple[float, float]:
    """Gravity in x and in y, m/s², of its size and its direction in degrees from x with the rotation."""
    angle = np.radians(number(direction, "direction", signed=True))
    both = number(gravity, "gravity") * np.array([np.cos(angle), np.sin(angle)])
    both[np.abs(both) < 1e-15 * gravity] = 0.0  # straight down is straight down
    return float(both[0]), float(both[1])


def bow_forces(stiffness: FloatArray, at: IndexArray, bow: ComplexArray) -> ComplexArray:
    """Forces that bend the straight shaft as it is bent at rest: (K_bb − K_bo K_oo⁻¹ K_ob) times the bow.

    Parameters
    ----------
    stiffness
        Of the free shaft in one plane, N/m, shape (n, n).
    at, bow
        Unknowns where the bow is known, and its size, m, (b,); the others follow without a force. N, (b,).

    Raises
    ------
    ValueError
        If one or two are given: any two points lie on a straight line.
    """
    if 0 < len(at) < 3:
        raise ValueError("a bow needs three nodes or more: through two of them a straight shaft passes")
    others = np.setdiff1d(np.arange(len(stiffness)), at)
    pick = np.ix_(at, at)
    K = stiffness[pick]
    if len(at) and others.size:
        across = stiffness[np.ix_(others, at)]
        K = K - across.T @ np.linalg.solve(stiffness[np.ix_(others, others)], across)
    return np.asarray(K @ bow)
