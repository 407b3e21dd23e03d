"""A rotor reduced to masses at chosen nodes."""

from __future__ import annotations

import dataclasses
from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

import fem
from fem.matrices import ignored_inertia
from rotorid.estimate import Estimate
from rotorid.reduction.masses import equivalent_masses
from rotorid.reduction.result import Reduction
from rotorid.reduction.sensitivity import mass_sensitivity
from rotorid.reduction.vibration import like, mac, natural_frequencies

FloatArray = NDArray[np.float64]

SENSITIVE = 0.1
"""A report warns where input errors of 1 % move a mass by more than this share."""

ALIKE = 0.9
"""Below this MAC two shapes are not those of one mode."""


def reduce(
    rotor: fem.Rotor, nodes: Sequence[int], modes: int = 2, *, speed: float | None = None
) -> Reduction:
    """Reduce a rotor to masses at chosen nodes by regression over its first modes.

    Formula (50) is one of a plane that does not turn: of a rotor with gyroscopic effect, or on supports that
    are more than constant isotropic springs, the plane x at rest is reduced, and `warnings` say so.

    Parameters
    ----------
    rotor
        On supports; its static compliance must exist.
    nodes
        Different node numbers, from 1, where the masses stand.
    modes
        How many of the rotor's modes the regression uses, 1 … n.
    speed
        Where tables of supports are read, rad/s; by default their lowest common speed.

    Raises
    ------
    ValueError
        For a speed outside a table, nodes that do not exist or repeat, a number of modes out of range, a
        rotor free to move, or masses that these modes do not determine.

    Notes
    -----
    Source: [S] 1.10, tasks 9.1 and 9.2. The frequencies of the small model come from its own eigenvalue
    problem, so their agreement with the rotor's is a check, also for the modes that the regression used.
    """
    places = tuple(int(n) for n in nodes)
    n = len(places)
    if n == 0 or len(set(places)) != n:
        raise ValueError(f"the masses need different nodes; got {list(nodes)}")
    bad = [p for p in places if not 1 <= p <= rotor.n_nodes]
    if bad:
        raise ValueError(f"node {bad[0]} does not exist: this rotor has nodes 1 … {rotor.n_nodes}")
    if not 1 <= modes <= n:
        raise ValueError(f"{n} masses can use 1 … {n} modes; got {modes}")
    plane, said = _plane_at_rest(rotor, speed)
    alpha = fem.compliance(plane, places)
    full = fem.critical_speeds(plane, n)
    index = np.array(places) - 1
    rotor_shapes = full.shapes[index]
    estimate = equivalent_masses(alpha, full.frequencies[:modes], rotor_shapes[:, :modes])
    if not estimate.full_rank:
        raise ValueError(
            f"the first {modes} mode(s) do not determine the masses at nodes {list(places)}: "
            f"{estimate.describe_rank()}; use more modes or other nodes"
        )
    sensitivity = mass_sensitivity(alpha, full.frequencies[:modes], rotor_shapes[:, :modes])
    omega, shapes = natural_frequencies(alpha, estimate.solution)
    shapes = like(shapes, rotor_shapes)
    agreement = np.diag(mac(shapes, rotor_shapes))[:modes]
    return Reduction(
        rotor=rotor,
        nodes=places,
        positions=rotor.positions[index],
        modes=modes,
        masses=estimate,
        sensitivity=sensitivity,
        compliance=alpha,
        frequencies=omega,
        shapes=shapes,
        rotor_modes=full,
        rotor_shapes=rotor_shapes,
        warnings=(
            *said,
            *_of_shaft(rotor, full),
            *_warnings(estimate, sensitivity, omega, places, agreement),
        ),
    )


def _plane_at_rest(rotor: fem.Rotor, speed: float | None) -> tuple[fem.Rotor, list[str]]:
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
                pedestal=None if stand is None else fem.Pedestal(stand.mass, stand.xy("stiffness")[0]),
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
    if not rotor.constant:
        which = "the lowest of" if speed is None else "chosen in"
        said.append(f"the stiffness of the supports (kxx) is that at {omega:.6g} rad/s, {which} their tables")
    return plane, said


def _of_shaft(rotor: fem.Rotor, full: fem.Modes) -> list[str]:
    """Warnings of the modes, without those on what the plane at rest leaves out of a rotor that has it."""
    ours = ignored_inertia(full.rotor)
    return [*ignored_inertia(rotor), *(text for text in full.warnings if text not in ours)]


def _uncoupled(rotor: fem.Rotor) -> bool:
    """Whether no support's stiffness couples x and y."""
    matrices = [support.at(support.speeds or 0.0)[0] for support in rotor.supports]
    return not any(K[..., 0, 1].any() or K[..., 1, 0].any() for K in matrices)


def _warnings(
    estimate: Estimate,
    sensitivity: FloatArray,
    omega: FloatArray,
    places: tuple[int, ...],
    agreement: FloatArray,
) -> list[str]:
    out = [
        f"the mass at node {p} is {m:.4g} kg, not positive: no physical model; use other nodes or more modes"
        for p, m in zip(places, estimate.solution, strict=True)
        if m <= 0
    ]
    if np.isnan(omega).any():
        out.append("with these masses the model has modes that do not vibrate")
    out += [
        f"mode {k} of the model does not have the shape of the rotor's (MAC {value:.2f}, below {ALIKE}): "
        "do not rely on its frequency; use other nodes or more masses"
        for k, value in enumerate(agreement, start=1)
        if not value >= ALIKE
    ]
    if (sensitivity > SENSITIVE / 0.01).any():
        moves = ", ".join(f"{x:.0f} %" for x in sensitivity)
        out.append(
            f"the regression is ill-conditioned (condition number "
            f"{estimate.condition_number:.1f}): errors of "
            f"1 % in the compliances and shapes move the masses by {moves}; more modes make them firmer"
        )
    return out
