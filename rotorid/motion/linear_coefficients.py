"""Forces at nodes made linear about the static equilibrium: a rotor with bearing tables over speed."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

import fem
from fem.model.node_forces import NodeForce, SqueezeFilm, Stop, kind_of
from rotorid.base.arrays import FloatArray
from rotorid.motion.equilibrium import Equilibrium, each_force, equilibria
from rotorid.motion.system import MotionSystem

_ROUNDS = 4
_CONVERGED = 1e-7


def coefficients(at: Equilibrium) -> tuple[FloatArray, FloatArray]:
    """Stiffness N/m and damping N·s/m of each force at an equilibrium, shape (f, 2, 2) each.

    The force on the shaft is −K (x, y) − C (x', y') for small motion about the equilibrium. The film of a
    squeeze-film damper has no such matrices at rest outside its centre; those at the centre are given, which
    hold for small orbits about it.
    """
    out = each_force(at.system, at.q, at.speed)
    centred = each_force(at.system, np.zeros(at.system.size), at.speed)
    squeezed = [isinstance(force, SqueezeFilm) for force in at.system.forces]
    out[squeezed] = centred[squeezed]
    return -out[:, :, 1:3], -out[:, :, 3:5]


def linear_rotor(rotor: fem.Rotor, found: Sequence[Equilibrium]) -> fem.Rotor:
    """The rotor with linear supports in place of its forces, with tables over the speeds of the equilibria.

    Stops, which the shaft does not touch, are left out; the fluid of a seal is a disc with its mass, which
    adds to the weight of this rotor.

    Parameters
    ----------
    rotor
        With the forces of the system that the equilibria are of.
    found
        At ascending speeds; of one alone the coefficients are constant.
    """
    K, C = (np.array(each) for each in zip(*map(coefficients, found), strict=True))
    speeds = tuple(one.speed for one in found) if len(found) > 1 else ()
    supports = [
        _support(force, K[:, k], C[:, k], speeds)
        for k, force in enumerate(rotor.forces)
        if not isinstance(force, Stop)
    ]
    fluids = [
        fem.Disc(force.node, force.mass, name=f"fluid of {name_of(force)}") for force in rotor.forces if force.mass
    ]
    return replace(
        rotor.linear, supports=(*rotor.supports, *supports), discs=(*rotor.discs, *fluids)
    )


def name_of(force: NodeForce) -> str:
    """Its name, or its kind and node."""
    return force.name or f"{kind_of(force).replace('_', ' ')} {force.node}"


def threshold(rotor: fem.Rotor, system: MotionSystem, found: Sequence[Equilibrium]) -> fem.Stability:
    """Where the linear rotor loses stability, between the speeds of two equilibria or more.

    Coefficients are linear between these speeds; the equilibrium at the threshold is added until the
    threshold stays where it is.
    """
    ordered = list(found)
    last = np.nan
    for _ in range(_ROUNDS):
        stable = fem.stability_threshold(
            linear_rotor(rotor, ordered), ordered[-1].speed, lowest=ordered[0].speed
        )
        if stable.threshold is None or abs(stable.threshold - last) <= _CONVERGED * stable.threshold:
            return stable
        last = stable.threshold
        near = min(ordered, key=lambda one: abs(one.speed - last))
        if near.speed != last:
            ordered = sorted([*ordered, *equilibria(system, [last])], key=lambda one: one.speed)
    return stable


def _support(
    force: NodeForce, K: FloatArray, C: FloatArray, speeds: tuple[float, ...]
) -> fem.Support:
    outwards = min(K[:, (0, 1), (0, 1)].min(), C[:, (0, 1), (0, 1)].min()) < 0
    return fem.Support(
        force.node,
        K.tolist() if speeds else K[0].tolist(),
        C.tolist() if speeds else C[0].tolist(),
        name_of(force),
        speeds=speeds,
        kind="seal" if outwards else "bearing",
    )
