"""Where formula (50) looks at a rotor: at which nodes, and in the plane x at rest."""

from __future__ import annotations

import dataclasses
from collections.abc import Sequence

import numpy as np

import fem


def mass_nodes(rotor: fem.Rotor, nodes: Sequence[int | str]) -> tuple[int, ...]:
    """Numbers of different nodes, given as numbers from 1 or names of stations.

    Raises
    ------
    ValueError
        For none, for nodes that do not exist or repeat.
    """
    found = tuple(rotor.node(node) for node in nodes)
    if not found or len(set(found)) != len(found):
        raise ValueError(f"the masses need different nodes; got {list(nodes)}")
    return found


def plane_at_rest(rotor: fem.Rotor, speed: float | None) -> tuple[fem.Rotor, list[str]]:
    """The rotor's plane x without rotation, on springs to the ground or to pedestals, and what to say of it.

    Neither gyroscopic moments nor coupling between x and y nor damping have a place in formula (50).
    """
    if speed is not None and not (np.isfinite(speed) and speed >= 0):
        raise ValueError(f"the speed must be finite and not negative, in rad/s, not {speed}")
    lowest = max((support.speeds[0] for support in rotor.supports if support.speeds), default=0.0)
    omega = lowest if speed is None else float(speed)
    supports = []
    for support in rotor.supports:
        stand = support.pedestal
        supports.append(
            fem.Support(
                support.node,
                float(support.at(omega)[0][0, 0]),
                name=support.name,
                pedestal=None if stand is None else fem.Pedestal(0.0, stand.xy("stiffness")[0]),
                kind=support.kind,
                tilting_stiffness=support.tilting_stiffness,
            )
        )
    plane = dataclasses.replace(
        rotor, supports=supports, model=dataclasses.replace(rotor.model, gyroscopic=False)
    )
    said = []
    if rotor.model.gyroscopic or not (rotor.symmetric and _uncoupled(rotor)):
        said.append(
            "formula (50) knows neither rotation nor coupling of the planes: the model holds for the plane x "
            "of the rotor at rest, without gyroscopic effect and cross-coupling"
        )
    if any(support.pedestal is not None and support.pedestal.mass > 0 for support in rotor.supports):
        said.append(
            "the masses of the pedestals are left out here, of the rotor and of the model: they come back in "
            "the small model (response, stability, model file)"
        )
    if not rotor.symmetric:
        said.append("the supports are not the same in x and y: only x is fitted and compared here")
    if not rotor.constant:
        which = "the lowest of" if speed is None else "chosen in"
        said.append(f"the stiffness of the supports (kxx) is that at {omega:.6g} rad/s, {which} their tables")
    return plane, said


def _uncoupled(rotor: fem.Rotor) -> bool:
    """Whether no support's stiffness couples x and y."""
    matrices = [support.at(support.speeds or 0.0)[0] for support in rotor.supports]
    return not any(K[..., 0, 1].any() or K[..., 1, 0].any() for K in matrices)
