"""Reduction of a rotor to masses at chosen nodes."""

from __future__ import annotations

import dataclasses
from collections.abc import Sequence
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

import fem
from rotorid.base.arrays import FloatArray
from rotorid.base.text import counted
from rotorid.reduction.equivalent.equivalent_masses_formula_50 import (
    BoundedEstimate,
    Normalisation,
    RowWeights,
    equivalent_masses,
)
from rotorid.reduction.equivalent.mass_uncertainty import InputErrors, mass_uncertainty
from rotorid.reduction.equivalent.plane_at_rest import mass_nodes, plane_at_rest
from rotorid.reduction.equivalent.small_model_modes import like, mac, natural_frequencies
from rotorid.reduction.equivalent.support_flexibility_formula_47 import separate
from rotorid.reduction.reduction_warnings import (
    far_off,
    of_regression,
    of_shaft,
    other_frequencies,
    other_shapes,
    too_heavy,
)
from rotorid.reduction.result import Choices, Reduction


def reduce(  # noqa: PLR0913
    rotor: fem.Rotor,
    nodes: Sequence[int],
    modes: int = 2,
    *,
    speed: float | None = None,
    normalise: Normalisation = "first",
    rows: RowWeights = "equal",
    nonnegative: bool = False,
    measured: tuple[ArrayLike, ArrayLike] | None = None,
    supports_apart: bool = False,
    errors: InputErrors | None = None,
) -> Reduction:
    """Reduce a rotor to masses at chosen nodes by regression over its first modes.

    Formula (50) is one of a plane that does not turn: of a rotor with gyroscopic effect, or on supports that
    are more than constant isotropic springs, the plane x at rest is reduced, and `warnings` say so. What
    turns, couples and damps comes back in `Reduction.small`.

    Parameters
    ----------
    rotor
        On supports; its static compliance must exist.
    nodes
        Different node numbers, from 1, where the masses stand.
    modes
        How many of the modes the regression uses, 1 … n.
    speed
        Where tables of supports are read, rad/s; by default their lowest common speed.
    normalise, rows, nonnegative
        As in `equivalent_masses`; the defaults are those of [S].
    measured
        Frequencies, rad/s (k,), and shapes at the nodes (n, k), used instead of the computed ones.
    supports_apart
        Take the compliance from (47): that of the shaft on rigid supports, and the two bearings beside it;
        seals at the masses then stand in the right side of (50).
    errors
        Relative standard deviations of the inputs: then `uncertainty` has those of masses and frequencies.

    Raises
    ------
    ValueError
        For a speed outside a table, nodes that do not exist or repeat, a number of modes out of range, a
        rotor free to move, masses that these modes do not determine, or supports that cannot be set apart.

    Notes
    -----
    Source: [S] 1.10, tasks 9.1 and 9.2. The frequencies of the small model come from its own eigenvalue
    problem, so their agreement with the rotor's is a check, also for the modes that the regression used.
    """
    places = mass_nodes(rotor, nodes)
    n = len(places)
    plane, said = plane_at_rest(rotor, speed)
    if measured is not None and any(s.pedestal is not None and s.pedestal.mass for s in rotor.supports):
        raise ValueError(
            "measured modes hold the masses of the pedestals, which formula (50) cannot take apart: give the "
            "pedestals no mass in the rotor file (the equivalent masses then hold it), or use computed modes"
        )
    full = fem.critical_speeds(plane, n)
    index = np.array(places) - 1
    seals, apart = np.zeros(n), None
    if supports_apart:
        bare, seals = _without_seals(plane, places)
        apart = separate(bare, places)
        alpha = apart.compliance(_at_nodes(bare, apart.supports))
    else:
        alpha = fem.compliance(plane, places)
    if measured is None:
        omega, shapes = full.frequencies, full.shapes[index]
    else:
        omega, shapes = _modes(measured, n)
        said += other_frequencies(omega, full.frequencies) + other_shapes(shapes, full.shapes[index], places)
    result = _reduced(
        places,
        alpha,
        seals,
        omega,
        shapes,
        modes,
        Choices("rotor" if measured is None else "measured", normalise, rows, nonnegative),
        errors,
    )
    return dataclasses.replace(
        result,
        rotor=rotor,
        rotor_modes=full,
        separated=apart,
        warnings=(*said, *of_shaft(rotor, full), *result.warnings, *too_heavy(rotor, result.masses.solution)),
    )


def reduce_measured(  # noqa: PLR0913
    compliance: ArrayLike,
    frequencies: ArrayLike,
    shapes: ArrayLike,
    modes: int | None = None,
    *,
    nodes: Sequence[int | str] | None = None,
    seal_stiffness: ArrayLike = 0.0,
    normalise: Normalisation = "first",
    rows: RowWeights = "equal",
    nonnegative: bool = False,
    errors: InputErrors | None = None,
) -> Reduction:
    """Find equivalent masses of a rotor of which compliance and modes are given, without a model of it.

    Parameters
    ----------
    compliance
        m/N, shape (n, n).
    frequencies, shapes
        Measured, rad/s (k,), and at the masses (n, k).
    modes
        How many of them the regression uses; default all.
    nodes
        Names of the places, 1 … n by default.
    seal_stiffness, normalise, rows, nonnegative
        As in `equivalent_masses`.
    errors
        As in `reduce`.

    Raises
    ------
    ValueError
        As `equivalent_masses`, and for masses that these modes do not determine.
    """
    alpha = np.asarray(compliance, dtype=float)
    n = len(alpha)
    omega, U = _modes((frequencies, shapes), n)
    places = tuple(nodes) if nodes is not None else tuple(range(1, n + 1))
    if len(places) != n or len(set(places)) != n:
        raise ValueError(f"{n} different names of places are needed; got {list(places)}")
    seals = np.broadcast_to(np.asarray(seal_stiffness, dtype=float), (n,)).copy()
    return _reduced(
        places,
        alpha,
        seals,
        omega,
        U,
        len(omega) if modes is None else modes,
        Choices("measured", normalise, rows, nonnegative),
        errors,
    )


def _reduced(
    places: tuple[int | str, ...],
    alpha: FloatArray,
    seals: FloatArray,
    omega: FloatArray,
    shapes: FloatArray,
    modes: int,
    choices: Choices,
    errors: InputErrors | None,
) -> Reduction:
    """The regression and its checks, whatever the inputs come from."""
    n, most = len(places), min(len(places), len(omega))
    if not 1 <= modes <= most:
        raise ValueError(f"{n} masses can use 1 … {most} modes; got {modes}")
    used = omega[:modes], shapes[:, :modes]
    how: dict[str, Any] = {"seal_stiffness": seals, "normalise": choices.normalise, "rows": choices.rows}
    estimate = equivalent_masses(alpha, *used, **how, nonnegative=choices.nonnegative)
    if not estimate.full_rank:
        raise ValueError(
            f"the first {counted(modes, 'mode')} cannot determine the masses at nodes {list(places)}: "
            f"{estimate.describe_rank()}; use more modes or other nodes"
        )
    bound = estimate.warnings if isinstance(estimate, BoundedEstimate) else ()
    if errors is not None and bound:
        bound += ("what the stated errors do was not computed: masses at a bound do not follow them",)
        errors = None
    known = mass_uncertainty(alpha, *used, errors or InputErrors(), **how)
    frequencies, own = natural_frequencies(alpha, estimate.solution, seal_stiffness=seals)
    compared = shapes[:, :n]
    own[:, : compared.shape[1]] = like(own[:, : compared.shape[1]], compared)
    agreement = np.diag(mac(own, compared))
    errors_of_frequency = frequencies[: len(agreement)] / omega[: len(agreement)] - 1
    return Reduction(
        rotor=None,
        nodes=places,
        modes=modes,
        masses=estimate,
        sensitivity=known.sensitivity,
        compliance=alpha,
        seal_stiffness=seals,
        frequencies=frequencies,
        shapes=own,
        rotor_frequencies=omega[:n],
        rotor_shapes=compared,
        rotor_modes=None,
        choices=choices,
        uncertainty=None if errors is None else known,
        separated=None,
        warnings=(
            *bound,
            *of_regression(estimate, known.sensitivity, frequencies, places, agreement[:modes]),
            *far_off(errors_of_frequency),
        ),
    )


def _modes(measured: tuple[ArrayLike, ArrayLike], n: int) -> tuple[FloatArray, FloatArray]:
    """Frequencies and shapes as arrays that fit n masses."""
    omega, shapes = (np.asarray(part, dtype=float) for part in measured)
    omega = np.atleast_1d(omega)
    if shapes.shape != (n, len(omega)):
        raise ValueError(
            f"shapes must be (n, k) for {n} masses and {len(omega)} frequencies; got {shapes.shape}"
        )
    if not (np.isfinite(omega).all() and np.isfinite(shapes).all()):
        raise ValueError("frequencies and shapes must be finite numbers")
    return omega, shapes


def _without_seals(plane: fem.Rotor, places: tuple[int, ...]) -> tuple[fem.Rotor, FloatArray]:
    """The plane without its seals at the masses, and their stiffness."""
    taken = [s for s in plane.supports if s.kind == "seal" and s.node in places and s.plain]
    stiffness = np.array([sum(float(s.stiffness) for s in taken if s.node == node) for node in places])
    kept = [s for s in plane.supports if s not in taken]
    return dataclasses.replace(plane, supports=kept), stiffness


def _at_nodes(plane: fem.Rotor, nodes: tuple[int, ...]) -> list[float]:
    """Stiffness of all bearings at each node, N/m, of a plane on springs; pedestals stand in series."""
    zero = np.zeros(1)
    return [
        float(sum(s.dynamic_stiffness(zero)[0, 0, 0].real for s in plane.supports if s.node == node))
        for node in nodes
    ]
