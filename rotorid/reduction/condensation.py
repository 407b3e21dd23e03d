"""Guyan reduction and IRS of a rotor beside formula (50), all at the same masters.

K and M are those of the rotor's plane x at rest, with all its unknowns: deflections and slopes, shear angles,
pedestals. Split into masters d (deflections of the chosen nodes) and the others o, each method but the
regression writes the whole rotor as x = T x_d and keeps Tᵀ K T and Tᵀ M T:

- Guyan (static condensation): x_o = −K_oo⁻¹ K_od x_d, the shape of the shaft at rest. Inertia of the others
  acts, but bends nothing.
- IRS (O'Callahan's improved reduced system): the inertia forces of Guyan's model bend the others further.
  In a mode of it M_G x″ = −K_G x, so that M T x″ = −M T M_G⁻¹ K_G x; the reaction of this force on the others
  adds K_oo⁻¹ (M T M_G⁻¹ K_G)_o to the rows of T. The sign is that of a load −M x″, which K_oo carries.

The frequencies of both are those of a Ritz method, never below the rotor's of the same number. Formula
(50) is another thing: Guyan's stiffness, and masses one can point at.

Sources: R. J. Guyan, AIAA J. 3 (1965) 380; J. O'Callahan, Proc. 7th IMAC (1989) 17.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

import fem
from fem import Pencil, whole_rotor
from fem.assembly import assemble, ignored_inertia, multiply
from rotorid.base import registry
from rotorid.base.answer import Answer, Answered
from rotorid.base.arrays import FloatArray, IndexArray
from rotorid.base.checks import whole
from rotorid.base.json import plain
from rotorid.base.result import Column, text
from rotorid.base.text import counted, listing, percent
from rotorid.reduction.masses import (
    Normalisation,
    RowWeights,
    design,
    equivalent_masses,
    held,
    like,
    mac,
    mass_nodes,
    natural_frequencies,
    plane_at_rest,
)

MASSLESS = 1e-12
"""Of the largest eigenvalue of Guyan's mass matrix: below, some motion of the masters moves no mass."""


@dataclass(frozen=True, eq=False)
class Method:
    """One reduced model M x″ + K x = f, x the deflections of the n masters, and how well it does.

    Attributes
    ----------
    name
        As titled in `METHODS`; "regression, k modes".
    M, K
        Mass, kg, and stiffness, N/m, shape (n, n); None where the method fails at these masters.
    T
        Deflections of all nodes of the rotor from those of the masters, shape (N, n). None for the
        regression: its masses are no projection.
    frequencies
        rad/s, ascending, shape (n,); NaN for a mode that does not vibrate.
    shapes
        At the masters, a column per mode, each scaled to fit the rotor's, shape (n, n).
    relative_error
        Of each frequency against the rotor's of the same number, shape (n,).
    mac
        Of each shape with the rotor's of the same number, at the masters, shape (n,).
    reason
        Why there is no model, or what to know about it; empty where nothing is to be said.
    """

    name: str
    M: FloatArray | None
    K: FloatArray | None
    T: FloatArray | None
    frequencies: FloatArray
    shapes: FloatArray
    relative_error: FloatArray
    mac: FloatArray
    reason: str = ""

    @property
    def diagonal(self) -> bool:
        """Whether the mass matrix is diagonal: only then does a mass stand at a node."""
        return self.T is None and self.M is not None

    @property
    def masses(self) -> FloatArray | None:
        """The masses at the masters, kg, shape (n,); None where the mass matrix is not diagonal."""
        return np.diag(self.M).copy() if self.diagonal and self.M is not None else None

    def to_dict(self) -> dict[str, Any]:
        """As JSON types; the transformation T is left to Python."""
        return plain(
            {
                "method": self.name,
                "mass_matrix_kg": self.M,
                "stiffness_matrix_N_per_m": self.K,
                "masses_kg": self.masses,
                "diagonal": self.diagonal,
                "natural_frequencies_rad_s": self.frequencies,
                "relative_error": self.relative_error,
                "mac": self.mac,
                "mode_shapes": self.shapes.T,
                "reason": self.reason or None,
            }
        )


@dataclass(frozen=True, eq=False)
class Methods(Answered):
    """Reduced models of the same rotor at the same nodes by different methods.

    Attributes
    ----------
    rotor
        The rotor; its plane x at rest is reduced.
    nodes
        Masters, n of them.
    rotor_frequencies
        The rotor's first n natural frequencies, rad/s.
    rows
        A `Method` each.
    warnings
        What a user should know before choosing.
    """

    rotor: fem.Rotor
    nodes: tuple[int, ...]
    rotor_frequencies: FloatArray
    rows: tuple[Method, ...]
    warnings: tuple[str, ...]

    def row(self, name: str) -> Method:
        """The model of one method; "regression" is the regression however many modes it used.

        Raises
        ------
        ValueError
            For a method that was not compared.
        """
        for row in self.rows:
            if row.name.split(",")[0].lower() == name.split(",")[0].lower():
                return row
        raise ValueError(f"no method {name!r}: there are {', '.join(row.name for row in self.rows)}")

    def _columns(self) -> tuple[Column, ...]:
        n, several = len(self.nodes), len(self.rows)
        frequency, share = "{:.4f}".format, "{:+.3%}".format

        def each(name: str) -> FloatArray:
            return np.concatenate([getattr(row, name) for row in self.rows])

        return (
            Column("method", np.repeat([row.name for row in self.rows], n), str),
            Column("mode", np.tile(np.arange(1, n + 1), several), str),
            Column("frequency_rad_s", each("frequencies"), frequency, "rad/s"),
            Column("rotor_frequency_rad_s", np.tile(self.rotor_frequencies, several), frequency, "rotor"),
            Column("relative_error", each("relative_error"), share, "error"),
            Column("mac", each("mac"), "{:.5f}".format, "MAC"),
        )

    def to_dict(self) -> dict[str, Any]:
        """As JSON types."""
        return plain(
            {
                "nodes": self.nodes,
                "positions_m": self.rotor.positions[np.array(self.nodes) - 1],
                "rotor_frequencies_rad_s": self.rotor_frequencies,
                "methods": [row.to_dict() for row in self.rows],
                "warnings": self.warnings,
            }
        )

    @property
    def answer(self) -> Answer:
        """The largest error of each method; behind it frequencies, errors and MAC by method and mode."""
        worst = [
            f"{row.name} {percent(round(float(np.abs(row.relative_error).max()), 8))} %"
            if np.isfinite(row.relative_error).all()
            else f"{row.name}: no model of all modes"
            for row in self.rows
        ]
        full = [row.name for row in self.rows if row.M is not None and not row.diagonal]
        remark = "full mass matrices; they couple the nodes, and no single mass stands at a node"
        return Answer(
            f"Largest error of {counted(len(self.nodes), 'frequency', 'frequencies')}: {', '.join(worst)}.",
            warnings=self.warnings,
            notes=(f"{listing(full, 'and')}: {remark}",) if full else (),
            tables=(text(self._columns()),),
            more="frequencies and shapes of each method",
        )


@dataclass(frozen=True, eq=False)
class _Condensed:
    """What the methods share: the plane at rest, and its static shapes T on masters that are held.

    `factor` is the Cholesky band of K with the masters' rows and columns those of the identity.
    """

    nodes: tuple[int, ...]
    plane: fem.Rotor
    pencil: Pencil
    masters: IndexArray
    modes: fem.Modes
    factor: FloatArray
    modes_used: int
    weights: Mapping[str, Any]

    @property
    def shapes(self) -> FloatArray:
        """Of the rotor's modes at the masters, (n, n)."""
        return np.asarray(self.modes.shapes[np.array(self.nodes) - 1])

    def matrices(self, T: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Tᵀ M T, and Tᵀ K T from strains, which keep their digits on fine meshes."""
        M = T.T @ multiply(self.pencil.mass, np.asfortranarray(T))
        return (M + M.T) / 2, np.asarray(self.pencil.energy(T))

    def carried(self, force: FloatArray) -> FloatArray:
        """K_oo⁻¹ of forces on the others, masters held."""
        from scipy.linalg.lapack import dpbtrs

        force[self.masters] = 0.0
        return np.asarray(dpbtrs(self.factor, force)[0])


def compare_methods(
    rotor: fem.Rotor,
    nodes: Sequence[str | int],
    *,
    modes: int = 2,
    speed: float | None = None,
    normalise: Normalisation = "first",
    rows: RowWeights = "equal",
) -> Methods:
    """Reduce a rotor to the deflections of the same nodes by all `METHODS`.

    Parameters
    ----------
    rotor
        On supports; its plane x at rest is reduced.
    nodes
        Masters: different nodes, as numbers from 1 or names of stations.
    modes
        How many modes the regression uses, 1 … n.
    speed
        Where tables of supports are read, rad/s; by default their lowest common speed.
    normalise, rows
        Scaling of shapes and weights of rows of the regression, as in `equivalent_masses`.

    Returns
    -------
    A row per method. A method that fails at these nodes (IRS where Guyan's mass matrix is singular) has no
    matrices, NaN as frequencies, and its reason among the warnings.

    Raises
    ------
    ValueError
        For nodes that do not exist or repeat, more masters than the rotor has modes, a rotor that is free
        to move, a speed outside a table, or a number of modes out of range.

    Examples
    --------
    >>> supports = [fem.Support(1, 1e8), fem.Support(5, 1e8)]
    >>> shaft = fem.Rotor(length=[0.25] * 4, outer_diameter=0.05, supports=supports)
    >>> model = compare_methods(shaft, [3], modes=1).row("Guyan")
    >>> model.M.round(2), model.relative_error.round(4)
    (array([[7.5]]), array([0.0075]))
    """
    from scipy.linalg.lapack import dpbtrf

    places = mass_nodes(rotor, nodes)
    n, modes = len(places), whole(modes, "the number of modes")
    if not 1 <= modes <= n:
        raise ValueError(f"{n} masses can use 1 … {n} modes; got {modes}")
    weights: dict[str, Any] = {"normalise": normalise, "rows": rows}
    design(np.eye(n), np.ones(modes), np.ones((n, modes)), **weights)  # refuses wrong choices
    plane, remarks = plane_at_rest(rotor, speed)
    fem.compliance(plane, places)  # refuses a rotor that is free, or a mesh lost in float64
    full = fem.critical_speeds(plane, n)
    pencil = whole_rotor(plane, assemble(plane))
    masters = pencil.waves[0][np.array(places) - 1]
    factor, info = dpbtrf(held(pencil.stiffness, masters))
    if info != 0:
        raise ValueError(
            "the rotor held at the masters is statically unstable: a support has negative stiffness; check "
            "its sign and size"
        )
    condensed = _Condensed(places, plane, pencil, masters, full, factor, modes, weights)
    table = []
    for method in METHODS:
        name = method.title + ("" if method.function is not _regression else f", {counted(modes, 'mode')}")
        try:
            M, K, T, frequencies, shapes, reason = method.function(condensed)
        except ValueError as failure:
            lost = np.full(n, np.nan)
            table.append(
                Method(name, None, None, None, lost, np.full((n, n), np.nan), lost, lost, f"{failure}")
            )
            continue
        error = frequencies / full.frequencies - 1
        agreement = np.where(np.isfinite(frequencies), np.diag(mac(shapes, condensed.shapes)), np.nan)
        scaled = like(shapes, condensed.shapes)
        table.append(Method(name, M, K, T, frequencies, scaled, error, agreement, reason))
    ours = ignored_inertia(plane)
    warnings = (
        *remarks,
        *ignored_inertia(rotor),
        *(warning for warning in full.warnings if warning not in ours),
        *(f"{row.name}: {row.reason}" for row in table if row.reason),
    )
    return Methods(rotor, places, full.frequencies, tuple(table), warnings)


_Model = tuple[FloatArray, FloatArray, FloatArray | None, FloatArray, FloatArray, str]
"""M, K, T, frequencies and shapes of a method, and what to know about it."""


def _static(condensed: _Condensed) -> FloatArray:
    """Guyan's T."""
    n = len(condensed.nodes)
    unit = np.zeros((condensed.pencil.size, n), order="F")
    unit[condensed.masters, np.arange(n)] = 1.0
    return unit + condensed.carried(-multiply(condensed.pencil.stiffness, unit))


def _guyan(condensed: _Condensed) -> _Model:
    return _projected(condensed, _static(condensed))


def _irs(condensed: _Condensed) -> _Model:
    T = _static(condensed)
    M, K = condensed.matrices(T)
    least, most = np.linalg.eigvalsh(M)[[0, -1]]
    if least <= MASSLESS * most:
        raise ValueError(
            "Guyan's mass matrix is singular at these nodes, and IRS needs its inverse: some motion of the "
            "masters moves no mass; choose nodes with mass or fewer of them"
        )
    inertia = multiply(condensed.pencil.mass, np.asfortranarray(T @ np.linalg.solve(M, K)))
    return _projected(condensed, T + condensed.carried(inertia))


def _projected(condensed: _Condensed, T: FloatArray) -> _Model:
    from scipy.linalg import eigh

    M, K = condensed.matrices(T)
    mu, shapes = eigh(M, K)  # μ = 1/ω²: the inverse form keeps the digits of the low modes
    mu, shapes = mu[::-1], shapes[:, ::-1]
    with np.errstate(divide="ignore", invalid="ignore"):
        frequencies = np.where(mu > 1e-15 * mu[0], 1 / np.sqrt(mu), np.nan)
    return M, K, T[condensed.pencil.waves[0]], frequencies, shapes, ""


def _regression(condensed: _Condensed) -> _Model:
    """Formula (50) at the masters."""
    nodes, k = condensed.nodes, condensed.modes_used
    alpha = fem.compliance(condensed.plane, nodes)
    used = condensed.modes.frequencies[:k], condensed.shapes[:, :k]
    estimate = equivalent_masses(alpha, *used, **condensed.weights)
    if not estimate.full_rank:
        raise ValueError(f"these modes do not determine the masses: {estimate.describe_rank()}")
    masses = estimate.solution
    bad = [node for node, m in zip(nodes, masses, strict=True) if m <= 0]
    words = "the mass at node {} is not positive: no physical model; use other nodes or modes"
    K = np.linalg.inv(alpha)
    frequencies, shapes = natural_frequencies(alpha, masses)
    return np.diag(masses), (K + K.T) / 2, None, frequencies, shapes, words.format(bad[0]) if bad else ""


METHODS: tuple[registry.Method[Callable[[_Condensed], _Model]], ...] = (
    registry.Method("guyan", "the shaft bent as at rest", _guyan, "Guyan"),
    registry.Method("irs", "Guyan's shapes bent further by their inertia forces", _irs, "IRS"),
    registry.Method("regression", "masses that stand at the nodes, formula (50)", _regression, "regression"),
)
