"""A small model that keeps its supports.

Bearings and films are held rigidly while formula (50) gives the masses, as
if they were simple supports: then the masses are those of the shaft, whatever it runs on, and what the
formula cannot see, the mass that these supports hold at rest, stands at them. It is shared so that mass and
centre of mass of the model are the rotor's: with two supports that is one way only, with more the nearest
to the shares of static condensation, 1ᵀ M T. The model is then that of Craig and Bampton with masses
instead of modes: exact for what the supports carry, and near to the rotor on supports from soft to stiff.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

import fem
from fem import GRAVITY, JournalBearing, SqueezeFilm
from rotorid.base.arrays import FloatArray
from rotorid.base.text import listing
from rotorid.reduction.masses import bending_stiffness
from rotorid.reduction.small_model import SmallModel, condense, modal

RIGID = 1e7
"""Stiffness of a rigid support by that of a shaft on two of them."""


def held_nodes(rotor: fem.Rotor) -> tuple[int, ...]:
    """Nodes that hold a rotor: bearings with a stiffness, journal bearings and squeeze films.

    Parameters
    ----------
    rotor
        With its supports and forces.

    Returns
    -------
    Node numbers, ascending.
    """
    films = {force.node for force in rotor.forces if isinstance(force, (JournalBearing, SqueezeFilm))}
    springs = {s.node for s in rotor.supports if s.kind == "bearing" and s.at(s.speeds or 0.0)[0].any()}
    return tuple(sorted(films | springs))


def held_rigidly(rotor: fem.Rotor, stiffness: float = RIGID) -> fem.Rotor:
    """The rotor on rigid supports at its bearings, journal bearings and squeeze films, without all else.

    Parameters
    ----------
    rotor
        With its supports and forces.
    stiffness
        Of a support, by that of the shaft, 48 E I / l³.

    Raises
    ------
    ValueError
        If these are fewer than two.
    """
    nodes = held_nodes(rotor)
    if len(nodes) < 2:
        raise ValueError(
            "to keep the supports, the masses are found with the shaft held rigidly at its bearings, journal "
            f"bearings and squeeze films: two nodes at least are needed, this rotor has {len(nodes)}"
        )
    stiffness *= bending_stiffness(rotor)
    tilting = {node: sum(s.tilting_stiffness for s in rotor.supports if s.node == node) for node in nodes}
    return replace(
        rotor,
        supports=[fem.Support(node, stiffness, tilting_stiffness=tilting[node]) for node in nodes],
        forces=(),
    )


def check_free(held: Sequence[int], nodes: Sequence[int]) -> None:
    """Refuse masses where the shaft is held.

    Parameters
    ----------
    held, nodes
        Where it is held, and where masses shall stand.

    Raises
    ------
    ValueError
        For a node that is both.
    """
    if both := [node for node in nodes if node in held]:
        raise ValueError(
            f"node {both[0]} is held rigidly while the masses are found, so none can be found there: leave "
            "it out of --nodes; it is kept with its bearing, and with its share of the rotor's mass"
        )


def keep_supports(
    rotor: fem.Rotor, nodes: Sequence[int], masses: FloatArray, *, modal_damping: Sequence[float] = ()
) -> SmallModel:
    """Condense a shaft to its masses, supports and forces; nodes of the model ascend.

    Parameters
    ----------
    rotor
        With its supports and forces.
    nodes, masses
        As estimated on `held_rigidly`, n of them.
    modal_damping
        Damping ratios of the first modes on rigid supports; of the surroundings, in both planes alike.

    Raises
    ------
    ValueError
        As `small_model`, and for a mass at a node that was held.
    """
    rigid = held_nodes(rotor)
    check_free(rigid, nodes)
    kept = sorted({*nodes, *(s.node for s in rotor.supports), *(force.node for force in rotor.forces)})
    model = condense(rotor, tuple(kept), dict(zip(nodes, masses.tolist(), strict=True)))
    every, z, damping = model.masses.copy(), rotor.positions, np.zeros_like(model.stiffness)
    at, rest = z[np.array(kept) - 1], np.flatnonzero(np.isin(kept, rigid))
    shaft = rotor.density * rotor.area * rotor.length * (z[:-1] + z[1:]) / 2
    moment = float(shaft.sum() + sum(disc.mass * z[disc.node - 1] for disc in rotor.discs))
    lacking = rotor.total_mass - every.sum(), moment - float(every @ at)
    every[rest] = _shared(model.weight[rest] / GRAVITY, at[rest], *lacking)
    if modal_damping:
        places = [kept.index(node) for node in nodes]
        damping[np.ix_(places, places)] = modal(held_rigidly(rotor), nodes, masses, modal_damping)
    model = replace(model, masses=every, damping=damping)
    return replace(model, warnings=(*model.warnings, *_of_masses(rotor, model)))


def _shared(shares: FloatArray, at: FloatArray, mass: float, moment: float) -> FloatArray:
    """Masses of this sum and this first moment about 0, the nearest to `shares`, each a tenth of it at least.

    Where that cannot be, sum and moment are the nearest.
    """
    from scipy.optimize import lsq_linear

    first = 1e7  # weight of mass and moment by that of the shares
    largest = np.abs(shares).max()  # an overhang or a mass nearby may lift what a node carries
    scale = np.sqrt(np.maximum(shares, 1e-3 * largest))
    length = float(np.ptp(at))
    rows = first * np.stack((np.ones_like(at), (at - at.mean()) / length)) * scale
    wanted = first * np.array([mass, (moment - mass * at.mean()) / length])
    least = np.maximum(0.1 * shares, 0.01 * largest) / scale
    solved = lsq_linear(
        np.vstack((rows, np.eye(len(at)))),
        np.concatenate((wanted, shares / scale)),
        bounds=(least, np.inf),
        method="bvls",
        tol=1e-14,
    )
    return np.asarray(scale * solved.x)


def _of_masses(rotor: fem.Rotor, model: SmallModel) -> list[str]:
    """What is wrong with the masses of a model that keeps its supports, in words."""
    remarks, total = [], rotor.total_mass
    if abs(model.masses.sum() / total - 1) > 1e-9:
        remarks.append(
            "the masses are too large to leave some for the supports: together "
            f"{model.masses.sum():.1f} kg of the rotor's {total:.1f} kg; use other nodes or more modes"
        )
    if bare := [str(node) for node in model.nodes if node not in model.massive]:
        remarks.append(
            f"no mass stands at node {listing(bare, 'and')}, where supports or forces act: the shaft follows "
            "there without inertia; better let a mass stand there, with --nodes"
        )
    return remarks
