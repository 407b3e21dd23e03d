"""The motion of a rotor with forces that are not linear: its shaft, weight, unbalance and bow."""

from __future__ import annotations

import dataclasses
from collections.abc import Callable, Mapping

import numpy as np

import fem
from fem import GRAVITY
from rotorid.base.arrays import ComplexArray, FloatArray, IndexArray
from rotorid.base.checks import number
from rotorid.motion.system import MotionSystem, system
from rotorid.reduction import SmallModel


def rotor_system(
    rotor: fem.Rotor | SmallModel,
    lowest: float,
    highest: float,
    *,
    unbalance: Mapping[int, complex] | None = None,
    bow: Mapping[int, complex] | None = None,
    gravity: float = GRAVITY,
    direction: float = -90.0,
) -> MotionSystem:
    """Put together what moves of a rotor at speeds from `lowest` to `highest`.

    Parameters
    ----------
    rotor
        With the forces at its nodes; or a small model.
    lowest, highest
        rad/s.
    unbalance
        m e e^{iβ} by node, kg·m, β with the rotation; a small model has its own if there is none here.
    bow
        How far the shaft at rest deviates from a straight line by node, m, complex, at three nodes or more;
        between them it runs as a shaft does that is bent there. A small model has its own, too.
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
    knots = np.array([lowest, *sorted(inside), highest])
    motion, names, stiffness, load = _parts(rotor)
    if isinstance(rotor, SmallModel):
        unbalance = rotor.unbalance if unbalance is None else unbalance
        bow = rotor.bow if bow is None else bow
    weight = {
        name.replace("x", axis, 1): part * mass
        for axis, part in zip("xy", weight_along(gravity, direction), strict=True)
        for name, mass in zip(names, load, strict=True)
    }
    at = np.array([names.index(f"x{rotor.node(node)}") for node in bow or {}], dtype=np.intp)
    bent = bow_forces(stiffness, at, np.array(list((bow or {}).values()), dtype=complex))
    return system(
        motion,
        knots,
        forces=rotor.forces,
        weight=weight,
        unbalance=unbalance,
        bow={
            names[i].replace("x", axis, 1): turned * force
            for i, force in zip(at, bent, strict=True)
            for axis, turned in (("x", 1), ("y", -1j))
        },
    )


def _parts(
    rotor: fem.Rotor | SmallModel,
) -> tuple[Callable[[float], fem.Motion], tuple[str, ...], FloatArray, FloatArray]:
    """Linear equations at a speed; of the shaft alone in x: unknowns, stiffness, N/m, and what weighs, kg."""
    if isinstance(rotor, SmallModel):
        names = tuple(f"x{node}" for node in rotor.nodes)
        return rotor.motion, names, rotor.stiffness, rotor.weight / GRAVITY
    straight = dataclasses.replace(
        rotor.linear, supports=(), material_damping=np.zeros_like(rotor.material_damping)
    )
    plane = fem.equations_of_motion(straight, plane="x")
    deflections = np.array([name[:1] == "x" for name in plane.coordinates], dtype=float)

    def motion(speed: float) -> fem.Motion:
        return fem.equations_of_motion(rotor.linear, speed=speed)

    return motion, plane.coordinates, plane.K, plane.M @ deflections


def weight_along(gravity: float, direction: float) -> tuple[float, float]:
    """Gravity in x and in y, m/s², of its size and its direction in degrees from x with the rotation."""
    angle = np.radians(number(direction, "direction", signed=True))
    both = number(gravity, "gravity") * np.array([np.cos(angle), np.sin(angle)])
    both[np.abs(both) < 1e-15 * gravity] = 0.0  # straight down is straight down
    return float(both[0]), float(both[1])


def bow_forces(stiffness: FloatArray, at: IndexArray, bow: ComplexArray) -> ComplexArray:
    """Forces that bend the straight shaft as it is bent at rest, N.

    Parameters
    ----------
    stiffness
        Of the free shaft in one plane, N/m, shape (n, n).
    at
        Unknowns where the bow is known, b of them; the others follow without a force.
    bow
        m, shape (b,).

    Returns
    -------
    numpy.ndarray
        At these unknowns, shape (b,): (K_bb − K_bo K_oo⁻¹ K_ob) times the bow.

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
