"""Forces at nodes made linear about the static equilibrium: a rotor with bearing tables over speed."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

import fem
from fem import SqueezeFilm, Stop
from fem.forces import kind_of
from rotorid.base.arrays import FloatArray
from rotorid.base.rpm import speed_text
from rotorid.motion.equilibrium import Equilibrium, each_force, equilibria
from rotorid.motion.system import MotionSystem

_STEP = 0.05
"""Between speeds at which coefficients are known, by the speed."""
_MANY = 200
"""Of the speeds asked for, between which stability is looked for."""
_AROUND = ((1e-2, 40), (1e-4, 1))
"""How far from the threshold, by its speed, the equilibria beside it are, time after time; steps between."""


def coefficients(found: Sequence[Equilibrium]) -> tuple[FloatArray, FloatArray]:
    """Stiffness N/m and damping N·s/m of each force at equilibria of a system, shape (S, f, 2, 2) each.

    The force on the shaft is −K (x, y) − C (x', y') for small motion about the equilibrium. At rest outside
    its centre a squeeze film has no such matrices; those at the centre are given, which hold for small
    orbits about it.
    """
    made = []
    for at in found:
        out = each_force(at.system, at.q, at.speed)
        centred = each_force(at.system, np.zeros(at.system.size), at.speed)
        squeezed = [isinstance(force, SqueezeFilm) for force in at.system.forces]
        out[squeezed] = centred[squeezed]
        made.append(-out)
    both = np.array(made)
    return both[..., 1:3], both[..., 3:5]


def linear_rotor(rotor: fem.Rotor, found: Sequence[Equilibrium]) -> fem.Rotor:
    """The rotor with linear supports in place of its forces, with tables over the speeds of the equilibria.

    Stops, which the shaft does not touch, are left out. Supports have no mass: the fluid of a seal is a disc,
    which does what its inertia does, and adds to the weight of this rotor.

    Parameters
    ----------
    rotor
        With the forces of the system that the equilibria are of.
    found
        At ascending speeds; of one alone the coefficients are constant.
    """
    speeds = tuple(one.speed for one in found) if len(found) > 1 else ()
    K, C = coefficients(found)
    supports, fluids = [], []
    for k, force in enumerate(rotor.forces):
        name = force.name or kind_of(force).replace("_", " ")
        both = [each[:, k] if speeds else each[0, k] for each in (K, C)]
        kind = "seal" if min(each.diagonal(axis1=-2, axis2=-1).min() for each in both) < 0 else "bearing"
        if not isinstance(force, Stop):
            stiffness, damping = (each.tolist() for each in both)
            supports.append(fem.Support(force.node, stiffness, damping, name, speeds=speeds, kind=kind))
        if force.mass:
            fluids.append(fem.Disc(force.node, force.mass, name=f"fluid of {name}"))
    return replace(rotor.linear, supports=(*rotor.supports, *supports), discs=(*rotor.discs, *fluids))


def threshold(rotor: fem.Rotor, system: MotionSystem, found: Sequence[Equilibrium]) -> fem.Stability:
    """Where the linear rotor loses stability, between the speeds of two equilibria or more.

    Coefficients are linear between the speeds where they are known: at those of the equilibria, at further
    ones wherever these are far apart, and in the end close beside the threshold.
    """
    lowest, highest = found[0].speed, found[-1].speed
    start = max(lowest, 1e-3 * highest)
    more = np.geomspace(start, highest, 2 + int(np.log(highest / start) / _STEP))[1:-1].tolist()
    known = {one.speed: one for one in (*found[:: 1 + len(found) // _MANY], found[-1])}
    known |= {one.speed: one for one in equilibria(system, sorted({*more, *system.knots[1:-1].tolist()}))}
    every = [known[speed] for speed in sorted(known)]
    linear = linear_rotor(rotor, every)
    stable = fem.stability_threshold(linear, highest, lowest=lowest)
    first = fem.judge(linear, np.array(sorted(known)))[0][:1]
    guesses = [one.first for one in first if one.begins] + [stable.threshold or highest]
    for share, steps in _AROUND:
        a, b = (float(np.clip(min(guesses) * (1 + s), lowest, highest)) for s in (-share, share))
        beside = linear_rotor(rotor, equilibria(system, (a, b)))
        near = fem.stability_threshold(beside, b, lowest=a, steps=steps)
        if near.threshold is None:
            break
        stable = replace(near, lowest=lowest, highest=highest, margin=stable.margin, rotor=stable.rotor)
        guesses = [near.threshold]
    again = tuple(
        f"about {speed_text(one.last)} it is stable again; `rotorid campbell` of the file that --output "
        "writes shows all such ranges"
        for one in first
        if one.ends
    )
    return replace(stable, warnings=again)
