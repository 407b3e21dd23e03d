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

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

import fem
from fem import Pencil, finite_modes, lowest_modes, whole_rotor
from fem.assembly import assemble, multiply
from rotorid.base.answer import Answer, Answered
from rotorid.base.arrays import FloatArray, IndexArray
from rotorid.base.json import plain
from rotorid.base.tables import Column, text
from rotorid.base.text import counted, percent
from rotorid.reduction.masses import like, mac, mass_nodes, plane_at_rest
from rotorid.reduction.reduce import Reduction

MASSLESS = 1e-12
"""Of the largest eigenvalue of Guyan's mass matrix: below, some motion of the masters moves no mass."""


def held(band: FloatArray, unknowns: IndexArray) -> FloatArray:
    """Upper band with some unknowns fixed: their rows and columns are those of the identity."""
    free = np.ones(band.shape[1])
    free[unknowns] = 0.0
    K = band * free
    for off, row in enumerate(K[::-1]):
        row[off:] *= free[: free.size - off]
    K[-1, unknowns] = 1.0
    return K


def static_shapes(
    band: FloatArray, masters: IndexArray
) -> tuple[FloatArray, Callable[[FloatArray], FloatArray]]:
    """Shapes for a unit deflection of each master, shape (size, n), and what solves K_oo x_o = f_o.

    `band` is the upper band of K. ValueError where the structure does not stand when the masters are held.
    """
    from scipy.linalg.lapack import dpbtrf, dpbtrs

    factor, info = dpbtrf(held(band, masters))
    if info != 0:
        raise ValueError(
            "the rotor held at these nodes is statically unstable: a support has negative stiffness, check "
            "its sign and size; or the elements are too many for float64, join neighbouring ones"
        )

    def carried(force: FloatArray) -> FloatArray:
        """Deflections of the others under forces on them, masters held."""
        force[masters] = 0.0
        return np.asarray(dpbtrs(factor, force)[0])

    unit = (np.arange(band.shape[1])[:, None] == masters).astype(float)
    return unit + carried(-multiply(band, unit)), carried


@dataclass(frozen=True, eq=False)
class Method:
    """One reduced model M x″ + K x = f, x the deflections of the n masters, and how well it does.

    Attributes
    ----------
    name
        "Guyan", "IRS" or "regression, k modes".
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
    def masses(self) -> FloatArray | None:
        """The masses at the masters, kg, shape (n,); None where the mass matrix is not diagonal."""
        return None if self.M is None or self.T is not None else np.diag(self.M).copy()

    def to_dict(self) -> dict[str, Any]:
        """As JSON types; the transformation T is left to Python."""
        return plain(
            {
                "method": self.name,
                "mass_matrix_kg": self.M,
                "stiffness_matrix_N_per_m": self.K,
                "masses_kg": self.masses,
                "diagonal": self.masses is not None,
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
        The plane x of the rotor at rest.
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
        n = len(self.nodes)
        worst = [
            f"{row.name} {percent(round(float(np.abs(row.relative_error).max()), 8))} %"
            if np.isfinite(row.relative_error).all()
            else f"{row.name}: no model of all modes"
            for row in self.rows
        ]
        frequencies, errors, agreement = np.concatenate(
            [(row.frequencies, row.relative_error, row.mac) for row in self.rows], axis=1
        )
        columns = (
            Column("method", np.repeat([row.name for row in self.rows], n)),
            Column("mode", [*range(1, n + 1)] * len(self.rows)),
            Column("rad/s", frequencies, "{:.4f}".format),
            Column("error", errors, "{:+.3%}".format),
            Column("MAC", agreement, "{:.5f}".format),
        )
        full = "Guyan and IRS: full mass matrices; they couple the nodes, and no single mass stands at a node"
        return Answer(
            f"Largest error of {counted(n, 'frequency', 'frequencies')}: {', '.join(worst)}.",
            warnings=self.warnings,
            notes=(full,),
            tables=(text(columns),),
            more="frequencies and shapes of each method",
        )


def compare_methods(reduction: Reduction) -> Methods:
    """Reduce a rotor to the deflections of the same nodes by Guyan's method and IRS, beside formula (50).

    Parameters
    ----------
    reduction
        Of a rotor, by its computed modes; of its plane x at rest.

    Returns
    -------
    A row per method. A method that fails at these nodes (IRS where Guyan's mass matrix is singular) has no
    matrices, NaN as frequencies, and its reason among the warnings.

    Raises
    ------
    ValueError
        For a reduction without a rotor, or a support of negative stiffness.

    Examples
    --------
    >>> from rotorid.reduction import reduce
    >>> supports = [fem.Support(1, 1e8), fem.Support(5, 1e8)]
    >>> shaft = fem.Rotor(length=[0.25] * 4, outer_diameter=0.05, supports=supports)
    >>> model = compare_methods(reduce(shaft, [3], modes=1)).rows[0]
    >>> model.M.round(2), model.relative_error.round(4)
    (array([[7.5]]), array([0.0075]))
    """
    full = reduction.rotor_modes
    if full is None:
        raise ValueError("methods are compared at a rotor, not at measured modes alone")
    places = np.array(reduction.nodes, dtype=int)
    at_masters = full.shapes[places - 1]
    pencil = whole_rotor(full.rotor, assemble(full.rotor))
    static, carried = static_shapes(pencil.stiffness, pencil.waves[0][places - 1])
    motion, of_guyan = reduction.equations_of_motion, _ritz(pencil, static)
    models: dict[str, _Model] = {"Guyan": of_guyan}
    try:
        models["IRS"] = _ritz(pencil, _improved(pencil, static, carried, *of_guyan[:2]))
    except ValueError as failure:
        nothing = np.full_like(motion.M, np.nan)
        models["IRS"] = None, None, None, nothing[0], nothing, str(failure)
    masses = motion.M, motion.K, None, reduction.frequencies, reduction.shapes, ""
    models[f"regression, {counted(reduction.modes, 'mode')}"] = masses
    table = [_beside(name, model, full.frequencies, at_masters) for name, model in models.items()]
    warnings = tuple(f"{row.name}: {row.reason}" for row in table if row.reason)
    return Methods(full.rotor, tuple(places.tolist()), full.frequencies, tuple(table), warnings)


def guyan(rotor: fem.Rotor, nodes: Sequence[int | str]) -> Method:
    """Guyan's model of a rotor at some nodes alone: its plane x at rest, tables at their lowest speed.

    Parameters
    ----------
    rotor
        On supports.
    nodes
        Masters: different node numbers from 1, or names of stations.

    Returns
    -------
    The model beside the rotor's own modes; `reason` says what of the rotor it leaves out.

    Raises
    ------
    ValueError
        For nodes that do not exist or repeat, more nodes than the rotor has modes, a rotor free to move, or
        a support of negative stiffness.
    """
    places = np.array(mass_nodes(rotor, nodes))
    plane, remarks = plane_at_rest(rotor, None)
    pencil = whole_rotor(plane, assemble(plane))
    if pencil.rigid.size or finite_modes(pencil) < len(places):
        raise ValueError("the rotor is not held, or has fewer modes than there are nodes")
    masters, full = pencil.waves[0][places - 1], lowest_modes(pencil, len(places))
    reduced = _ritz(pencil, static_shapes(pencil.stiffness, masters)[0], "; ".join(remarks))
    return _beside("Guyan", reduced, np.sqrt(full.squares), full.vectors[masters])


def _beside(name: str, model: _Model, frequencies: FloatArray, at_masters: FloatArray) -> Method:
    """A row: the model beside frequencies and shapes of the rotor."""
    M, K, T, omega, shapes, reason = model
    agreement = np.where(np.isfinite(omega), np.diag(mac(shapes, at_masters)), np.nan)
    return Method(name, M, K, T, omega, like(shapes, at_masters), omega / frequencies - 1, agreement, reason)


_Model = tuple[FloatArray | None, FloatArray | None, FloatArray | None, FloatArray, FloatArray, str]
"""M, K, T, frequencies and shapes of a method, and what to know about it."""


def _improved(
    pencil: Pencil,
    static: FloatArray,
    carried: Callable[[FloatArray], FloatArray],
    M: FloatArray,
    K: FloatArray,
) -> FloatArray:
    """T of IRS, from M and K of Guyan."""
    least, most = np.linalg.eigvalsh(M)[[0, -1]]
    if least <= MASSLESS * most:
        raise ValueError(
            "Guyan's mass matrix is singular at these nodes, and IRS needs its inverse: some motion of the "
            "masters moves no mass; choose nodes with mass or fewer of them"
        )
    return static + carried(multiply(pencil.mass, static @ np.linalg.solve(M, K)))


def _ritz(
    pencil: Pencil, T: FloatArray, reason: str = ""
) -> tuple[FloatArray, FloatArray, FloatArray, FloatArray, FloatArray, str]:
    """The model whose rotor moves as T."""
    from scipy.linalg import eigh

    M, K = T.T @ multiply(pencil.mass, T), pencil.energy(T)  # from strains
    M = (M + M.T) / 2
    mu, shapes = eigh(M, K)  # μ = 1/ω²: the inverse form keeps the digits of the low modes
    mu, shapes = mu[::-1], shapes[:, ::-1]
    with np.errstate(divide="ignore", invalid="ignore"):
        frequencies = np.where(mu > 1e-15 * mu[0], 1 / np.sqrt(mu), np.nan)
    return M, K, T[pencil.waves[0]], frequencies, shapes, reason
