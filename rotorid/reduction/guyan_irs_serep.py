"""Guyan reduction, IRS and SEREP of a rotor beside formula (50), all at the same masters.

K and M are those of the rotor's plane x at rest, with all its unknowns: deflections and slopes, shear angles,
pedestals. Split into masters d (deflections of the chosen nodes) and the others o, each method but the
regression writes the whole rotor as x = T x_d and keeps Tᵀ K T and Tᵀ M T:

- Guyan (static condensation): x_o = −K_oo⁻¹ K_od x_d, the shape of the shaft at rest. Inertia of the others
  acts, but bends nothing.
- IRS (O'Callahan's improved reduced system): the inertia forces of Guyan's model bend the others further.
  In a mode of it M_G x″ = −K_G x, so that M T x″ = −M T M_G⁻¹ K_G x; the reaction of this force on the others
  adds K_oo⁻¹ (M T M_G⁻¹ K_G)_o to the rows of T. The sign is that of a load −M x″, which K_oo carries.
- SEREP: T = Φ Φ_d⁻¹ with the first n modes Φ: exact frequencies and shapes, by construction.

The frequencies of all three are those of a Ritz method, never below the rotor's of the same number. Formula
(50) is another thing: Guyan's stiffness, and masses one can point at.

Sources: R. J. Guyan, AIAA J. 3 (1965) 380; J. O'Callahan, Proc. 7th IMAC (1989) 17; J. O'Callahan,
P. Avitabile, R. Riemer, Proc. 7th IMAC (1989) 29.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

import fem
from fem import Pencil, Spectrum, lowest_modes, whole_rotor
from fem.assembly import assemble, ignored_inertia, multiply
from rotorid.base import registry
from rotorid.base.arrays import FloatArray, IndexArray
from rotorid.base.checks import whole
from rotorid.base.text import counted
from rotorid.reduction.equivalent.equivalent_masses_formula_50 import (
    Normalisation,
    RowWeights,
    equivalent_masses,
    normalised,
    row_factors,
)
from rotorid.reduction.equivalent.plane_at_rest import mass_nodes, plane_at_rest
from rotorid.reduction.equivalent.small_model_modes import like, mac, natural_frequencies
from rotorid.reduction.equivalent.support_flexibility_formula_47 import held
from rotorid.reduction.guyan_irs_serep_result import Method, Methods

DEPENDENT = 1e-6
"""Shapes whose smallest combination at the masters is below this share of their largest entries are one."""
NEARLY = 1e-2
"""Below this share SEREP says that errors of the shapes are magnified."""
_MASSLESS = 1e-12


@dataclass(frozen=True)
class _Regression:
    """How formula (50) is used."""

    modes: int = 1
    normalise: Normalisation = "first"
    rows: RowWeights = "equal"


@dataclass(frozen=True, eq=False)
class _Condensed:
    """What the methods share: the plane at rest, and its static shapes on masters that are held.

    `factor` is the Cholesky band of K with the masters' rows and columns those of the identity; `T` are
    Guyan's shapes in the order of the pencil.
    """

    rotor: fem.Rotor
    nodes: tuple[int, ...]
    said: tuple[str, ...]
    plane: fem.Rotor
    pencil: Pencil
    masters: IndexArray
    modes: fem.Modes
    spectrum: Spectrum
    compliance: FloatArray
    factor: FloatArray
    T: FloatArray
    regression: _Regression = _Regression()


def reduce_by(
    rotor: fem.Rotor, nodes: Sequence[str | int], method: str = "guyan", *, speed: float | None = None
) -> Method:
    """Reduce a rotor to the deflections of some nodes by one of `METHODS`.

    Parameters
    ----------
    rotor
        On supports; its plane x at rest is reduced.
    nodes
        Masters: different nodes, as numbers from 1 or names of stations.
    method
        "guyan", "irs", "serep", or "regression" over one mode.
    speed
        Where tables of supports are read, rad/s; by default their lowest common speed.

    Raises
    ------
    ValueError
        For nodes that do not exist or repeat, more masters than the rotor has modes, a rotor that is free
        to move, a speed outside a table, an unknown method; for "irs" where Guyan's mass matrix is singular;
        for "serep" where the modes' shapes at the masters depend on one another.

    Examples
    --------
    >>> supports = [fem.Support(1, 1e8), fem.Support(5, 1e8)]
    >>> shaft = fem.Rotor(length=[0.25] * 4, outer_diameter=0.05, supports=supports)
    >>> model = reduce_by(shaft, [3])
    >>> model.M.round(2), model.relative_error.round(4)
    (array([[7.5]]), array([0.0075]))
    """
    chosen = registry.find(METHODS, method, "method")
    return chosen.function(chosen.title, _condense(rotor, nodes, speed))


def compare_methods(
    rotor: fem.Rotor,
    nodes: Sequence[str | int],
    *,
    modes: int = 2,
    speed: float | None = None,
    normalise: Normalisation = "first",
    rows: RowWeights = "equal",
) -> Methods:
    """Reduce a rotor to the same nodes by all `METHODS`.

    Parameters
    ----------
    rotor, nodes, speed
        As in `reduce_by`.
    modes
        How many modes the regression uses, 1 … n.
    normalise, rows
        Scaling of shapes and weights of rows of the regression, as in `equivalent_masses`.

    Returns
    -------
    A row per method. A method that fails at these nodes has no matrices, NaN as frequencies, and its reason
    among the warnings.

    Raises
    ------
    ValueError
        As for `reduce_by`, or for a number of modes out of range.
    """
    C = _condense(rotor, nodes, speed)
    n = len(C.nodes)
    modes = whole(modes, "the number of modes")
    if not 1 <= modes <= n:
        raise ValueError(f"{n} masses can use 1 … {n} modes; got {modes}")
    normalised(np.ones((n, modes)), normalise)  # refuse a wrong choice before anything is computed
    row_factors(rows, np.ones(modes), n)
    C = replace(C, regression=_Regression(modes, normalise, rows))
    table = []
    for method in METHODS:
        try:
            table.append(method.function(method.title, C))
        except _NoModelError as failure:
            table.append(_without(method.title, n, str(failure)))
    ours = ignored_inertia(C.plane)
    warnings = (
        *C.said,
        *ignored_inertia(rotor),
        *(text for text in C.modes.warnings if text not in ours),
        *(f"{row.name}: {row.reason}" for row in table if row.reason),
    )
    positions = rotor.positions[np.array(C.nodes) - 1]
    return Methods(rotor, C.nodes, positions, C.modes, tuple(table), warnings)


class _NoModelError(ValueError):
    """A method that fails at masters where others work."""


def _condense(rotor: fem.Rotor, nodes: Sequence[str | int], speed: float | None) -> _Condensed:
    from scipy.linalg.lapack import dpbtrf, dpbtrs

    at = mass_nodes(rotor, nodes)
    plane, said = plane_at_rest(rotor, speed)
    alpha = fem.compliance(plane, at)  # refuses a rotor that is free, or a mesh lost in float64
    modes = fem.critical_speeds(plane, len(at))
    A = assemble(plane)
    pencil = whole_rotor(plane, A)
    spectrum = lowest_modes(plane, A, len(at), pencil)
    masters = pencil.waves[0][np.array(at) - 1]
    unit = np.zeros((pencil.size, len(at)), order="F")
    unit[masters, np.arange(len(at))] = 1.0
    load = -multiply(pencil.stiffness, unit)
    load[masters] = 0.0
    factor, info = dpbtrf(held(pencil.stiffness, masters))
    if info != 0:
        raise ValueError(
            "the rotor held at the masters is statically unstable: a support has negative stiffness; check "
            "its sign and size"
        )
    T = np.asarray(dpbtrs(factor, load)[0])
    T[masters] = np.eye(len(at))
    return _Condensed(
        rotor, at, tuple(said), plane, pencil, masters, modes, spectrum, alpha, factor, T
    )  # fmt: skip


def _stiffness(C: _Condensed, T: FloatArray) -> FloatArray:
    """Tᵀ K T from strains, which keep their digits on fine meshes."""
    return np.asarray(C.pencil.energy(T))


def _mass(C: _Condensed, T: FloatArray) -> FloatArray:
    """Tᵀ M T."""
    M = T.T @ multiply(C.pencil.mass, np.asfortranarray(T))
    return np.asarray((M + M.T) / 2)


def _guyan(name: str, C: _Condensed) -> Method:
    return _projected(name, C, C.T)


def _irs(name: str, C: _Condensed) -> Method:
    from scipy.linalg.lapack import dpbtrs

    M, K = _mass(C, C.T), _stiffness(C, C.T)
    least, most = np.linalg.eigvalsh(M)[[0, -1]]
    if least <= _MASSLESS * most:
        raise _NoModelError(
            "Guyan's mass matrix is singular at these nodes, and IRS needs its inverse: some motion of the "
            "masters moves no mass; choose nodes with mass or fewer of them"
        )
    force = multiply(C.pencil.mass, np.asfortranarray(C.T @ np.linalg.solve(M, K)))
    force[C.masters] = 0.0
    return _projected(name, C, C.T + dpbtrs(C.factor, force)[0])


def _serep(name: str, C: _Condensed) -> Method:
    largest = np.abs(C.spectrum.vectors[C.pencil.waves[0]]).max(axis=0)
    vectors = C.spectrum.vectors / largest
    at_masters = vectors[C.masters]
    smallest = float(np.linalg.svd(at_masters, compute_uv=False)[-1])
    n = len(C.nodes)
    if not smallest > DEPENDENT:
        raise _NoModelError(
            f"the rotor's first {n} shapes depend on one another at the nodes {list(C.nodes)}"
            if n > 1
            else f"node {C.nodes[0]} is a node of the rotor's first mode"
        )
    reason = ""
    if smallest < NEARLY:
        reason = (
            f"at these nodes the shapes nearly depend on one another (smallest combination {smallest:.1e} of "
            "their largest deflection): small errors of the model change its matrices much"
        )
    return _projected(name, C, np.linalg.solve(at_masters.T, vectors.T).T, reason)


def _projected(name: str, C: _Condensed, T: FloatArray, reason: str = "") -> Method:
    from scipy.linalg import eigh

    M, K = _mass(C, T), _stiffness(C, T)
    mu, shapes = eigh(M, K)  # μ = 1/ω²: the inverse form keeps the digits of the low modes
    mu, shapes = mu[::-1], shapes[:, ::-1]
    with np.errstate(divide="ignore", invalid="ignore"):
        frequencies = np.where(mu > 1e-15 * mu[0], 1 / np.sqrt(mu), np.nan)
    return _judged(name, C, M, K, _in_order(C, T), frequencies, shapes, False, reason)


def _regression(name: str, C: _Condensed) -> Method:
    n, how = len(C.nodes), C.regression
    name = f"{name}, {counted(how.modes, 'mode')}"
    shapes = C.modes.shapes[np.array(C.nodes) - 1]
    try:
        estimate = equivalent_masses(
            C.compliance,
            C.modes.frequencies[: how.modes],
            shapes[:, : how.modes],
            normalise=how.normalise,
            rows=how.rows,
        )
    except ValueError as failure:
        return _without(name, n, str(failure))
    if not estimate.full_rank:
        return _without(name, n, f"these modes do not determine the masses: {estimate.describe_rank()}")
    masses = estimate.solution
    omega, own = natural_frequencies(C.compliance, masses)
    bad = [node for node, m in zip(C.nodes, masses, strict=True) if m <= 0]
    reason = ""
    if bad:
        reason = (
            f"the mass at node {bad[0]} is not positive: no physical model; use other nodes or more modes"
        )
    K = np.linalg.inv(C.compliance)
    return _judged(name, C, np.diag(masses), (K + K.T) / 2, None, omega, own, True, reason)


METHODS: tuple[registry.Method[Callable[[str, _Condensed], Method]], ...] = (
    registry.Method("guyan", "the shaft bent as at rest", _guyan, "Guyan"),
    registry.Method("irs", "Guyan's shapes bent further by their inertia forces", _irs, "IRS"),
    registry.Method("serep", "the rotor's own first modes, exact for these", _serep, "SEREP"),
    registry.Method("regression", "masses that stand at the nodes, formula (50)", _regression, "regression"),
)


def _judged(  # noqa: PLR0913
    name: str,
    C: _Condensed,
    M: FloatArray,
    K: FloatArray,
    T: FloatArray | None,
    frequencies: FloatArray,
    shapes: FloatArray,
    diagonal: bool,
    reason: str,
) -> Method:
    reference = C.modes.shapes[np.array(C.nodes) - 1]
    error = frequencies / C.modes.frequencies - 1
    agreement = np.where(np.isfinite(frequencies), np.diag(mac(shapes, reference)), np.nan)
    return Method(
        name, M, K, T, frequencies, like(shapes, reference), error, agreement, diagonal, reason
    )  # fmt: skip


def _without(name: str, n: int, reason: str) -> Method:
    unknown = np.full(n, np.nan)
    return Method(name, None, None, None, unknown, np.full((n, n), np.nan), unknown, unknown, False, reason)


def _in_order(C: _Condensed, T: FloatArray) -> FloatArray:
    """Rows of T as the coordinates of `fem.equations_of_motion`: the shaft, then the pedestals.

    The pencil keeps a pedestal right behind the deflection of its node. It leaves out one that no spring
    ties to the rotor: that one stays at rest.
    """
    waves, tilts = C.pencil.waves[0], C.pencil.tilts[0]
    pedestals: dict[int, list[int]] = {
        node: list(range(int(w) + 1, int(t)))
        for node, (w, t) in enumerate(zip(waves, tilts, strict=True), start=1)
        if t > w + 1
    }
    shaft = np.ones(C.pencil.size, dtype=bool)
    shaft[[i for places in pedestals.values() for i in places]] = False
    own: list[Any] = []
    for support in C.plane.supports:
        if support.pedestal is not None:
            tied = bool(np.any(np.asarray(support.stiffness) != 0))
            own.append(T[pedestals[support.node].pop(0)] if tied else np.zeros(T.shape[1]))
    return np.vstack([T[shaft], *own])
