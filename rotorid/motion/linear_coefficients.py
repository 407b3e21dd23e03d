"""Forces at nodes made linear about the static equilibrium: a rotor with bearing tables over speed."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from typing import TypeVar, cast

import numpy as np

import fem
from fem import SqueezeFilm, Stop
from fem.forces import kind_of
from rotorid.base.arrays import FloatArray
from rotorid.base.text import speed_text
from rotorid.motion.equilibrium import Equilibrium, each_force, equilibria
from rotorid.motion.system import MotionSystem
from rotorid.reduction import SmallModel

_AnyRotor = TypeVar("_AnyRotor", bound=fem.Rotor | SmallModel)
_STEP = 0.05  # between speeds at which coefficients are known, by the speed
_AROUND = ((1e-2, 40), (1e-4, 1))
"""How far from the threshold, by its speed, the equilibria beside it are, time after time; steps between."""


def coefficients(resting: Sequence[Equilibrium]) -> tuple[FloatArray, FloatArray]:
    """Stiffness N/m and damping N·s/m of each force at equilibria of a system, shape (S, f, 2, 2) each.

    The force on the shaft is −K (x, y) − C (x', y') for small motion about the equilibrium. At rest outside
    its centre a squeeze film has no such matrices; those at the centre are given, which hold for small
    orbits about it.
    """
    made = []
    for at in resting:
        out = each_force(at.system, at.q, at.speed)
        squeezed = [isinstance(force, SqueezeFilm) for force in at.system.forces]
        out[squeezed] = each_force(at.system, np.zeros(at.system.size), at.speed)[squeezed]
        made.append(-out)
    both = np.array(made)
    return both[..., 1:3], both[..., 3:5]


def linear_rotor(rotor: _AnyRotor, resting: Sequence[Equilibrium]) -> _AnyRotor:
    """The rotor with linear supports in place of its forces, with tables over the speeds of the equilibria.

    Stops that the shaft does not touch are left out. Supports have no mass: the fluid of a seal is a disc, of
    a small model a mass, which does what its inertia does, and adds to the weight of this rotor.

    Parameters
    ----------
    rotor
        With the forces of the system that the equilibria are of.
    resting
        At ascending speeds; of one alone the coefficients are constant.
    """
    speeds = tuple(one.speed for one in resting) if len(resting) > 1 else ()
    K, C = coefficients(resting)
    supports, fluids = [*rotor.supports], list[fem.Disc]()
    for k, force in enumerate(rotor.forces):
        name = force.name or kind_of(force).replace("_", " ")
        stiffness, damping = (each[:, k] if speeds else each[0, k] for each in (K, C))
        least = min(each.diagonal(axis1=-2, axis2=-1).min() for each in (stiffness, damping))
        kind = "seal" if least < 0 else "bearing"
        if not isinstance(force, Stop) or stiffness.any():
            matrices = stiffness.tolist(), damping.tolist()
            supports.append(fem.Support(force.node, *matrices, name, speeds=speeds, kind=kind))
        if force.mass:
            fluids.append(fem.Disc(force.node, force.mass, name=f"fluid of {name}"))
    made: fem.Rotor | SmallModel
    if isinstance(rotor, fem.Rotor):
        made = replace(rotor.linear, supports=tuple(supports), discs=(*rotor.discs, *fluids))
    else:
        masses = rotor.masses.copy()
        for fluid in fluids:
            masses[rotor.nodes.index(fluid.node)] += fluid.mass
        made = replace(rotor, supports=tuple(supports), masses=masses, forces=())
    return cast("_AnyRotor", made)


def threshold(
    rotor: fem.Rotor | SmallModel, system: MotionSystem, resting: Sequence[Equilibrium]
) -> fem.Stability:
    """Where the linear rotor loses stability, between the speeds of two equilibria or more.

    Coefficients are linear between the speeds where they are known: at those of the equilibria, at further
    ones wherever these are far apart, and in the end close beside the threshold.
    """
    lowest, highest = resting[0].speed, resting[-1].speed
    start = max(lowest, 1e-3 * highest)
    more = np.geomspace(start, highest, 2 + int(np.log(highest / start) / _STEP))[1:-1].tolist()
    rests = {one.speed: one for one in resting}
    rests |= {one.speed: one for one in equilibria(system, sorted({*more, *system.knots[1:-1].tolist()}))}
    linear = linear_rotor(rotor, [rests[speed] for speed in sorted(rests)])
    stable = _search(linear, lowest, highest)
    for share, steps in _AROUND:
        if stable.threshold is None:
            break
        a, b = np.clip(stable.threshold * np.array([1 - share, 1 + share]), lowest, highest).tolist()
        near = _search(linear_rotor(rotor, equilibria(system, (a, b))), a, b, steps)
        if near.threshold is not None:
            stable = replace(near, lowest=lowest, highest=highest, margin=stable.margin, rotor=stable.rotor)
    ends = () if isinstance(linear, SmallModel) else fem.judge(linear, np.array(sorted(rests)))[0][:1]
    again = tuple(
        f"about {speed_text(one.last)} it is stable again; `rotorid campbell` of the file that --output "
        "writes shows all such ranges"
        for one in ends
        if one.ends
    )
    return replace(stable, warnings=again)


def _search(rotor: fem.Rotor | SmallModel, lowest: float, highest: float, steps: int = 40) -> fem.Stability:
    """The first threshold of a linear rotor, of any kind."""
    if not isinstance(rotor, SmallModel):
        return fem.stability_threshold(rotor, highest, lowest=lowest, steps=steps)
    inside = {s for support in rotor.supports for s in support.speeds if lowest < s < highest}
    speeds = {*inside, *fem.range_of_speeds(lowest, highest, steps).tolist()}
    return fem.threshold_of(rotor.whirl(np.array(sorted(speeds))))
