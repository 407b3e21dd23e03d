"""Shaft flexibility apart from that of two supports, formula (47): bearings stay parameters of the model.

A force F_i at a from the left support A loads the supports, a span l apart, with R_A = (l − a_i) F_i / l and
R_B = a_i F_i / l ([S] (41)). They give way by R / c (42); the rotor follows as a straight line (45) and
bends above it as on rigid supports (44):

    α_ij = δ_ij + (l − a_i)(l − a_j) / (c₁ l²) + a_i a_j / (c₂ l²),      α = δ + R diag(1/c) Rᵀ.

Equilibrium alone gives the shares R, so δ and R hold for any stiffness of the supports. Left of A a_i is
negative, right of B it exceeds l: an overhung mass lifts the other support.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import ArrayLike

import fem
from fem.assembly import assemble, rounding_error
from rotorid.base.answer import Answer, Answered
from rotorid.base.arrays import FloatArray, IndexArray
from rotorid.base.json import plain
from rotorid.base.result import Column, frame, text
from rotorid.reduction.equivalent.plane_at_rest import mass_nodes

if TYPE_CHECKING:
    import pandas as pd


@dataclass(frozen=True, eq=False)
class Separated(Answered):
    """Compliance at masses as that of the shaft plus that of two supports.

    Attributes
    ----------
    nodes, positions
        Of the n masses: node numbers, and m from the left support (negative left of it), shape (n,).
    supports, span
        Nodes of the two supports, left first, and their distance, m.
    delta
        δ of the shaft on rigid supports, m/N, shape (n, n); zero where a mass stands at a support.
    fractions
        R (n, 2): share of a force at mass i that each support carries, which is also the displacement of
        mass i per displacement of the support. Each row sums to 1.
    """

    nodes: tuple[int, ...]
    positions: FloatArray
    supports: tuple[int, int]
    span: float
    delta: FloatArray
    fractions: FloatArray

    def compliance(self, stiffness: ArrayLike) -> FloatArray:
        """α = δ + R diag(1/c) Rᵀ, m/N, shape (n, n), for supports of stiffness c, N/m, (2,) or scalar.

        Raises
        ------
        ValueError
            For a stiffness that is not positive and finite.
        """
        c1, c2 = _stiffness(stiffness)
        return separated_compliance(self.delta, self.positions, self.span, c1, c2)

    @property
    def answer(self) -> Answer:
        """Share of the supports in a force at each mass, and its own flexibility δ."""
        a, b = self.supports
        columns = (
            Column("node", self.nodes, str, "mass at node"),
            Column("a", 100 * self.fractions[:, 0], "{:.4g}".format, f"% on node {a}"),
            Column("b", 100 * self.fractions[:, 1], "{:.4g}".format, f"% on node {b}"),
            Column("delta", np.diag(self.delta), "{:.6g}".format, "shaft on rigid supports, m/N"),
        )
        said = f"The shaft apart from its supports at nodes {a} and {b}, {self.span:.6g} m apart."
        return Answer(said, tables=(text(columns),), more="shares of the supports")

    def to_dict(self) -> dict[str, Any]:
        """As JSON types."""
        return plain(
            {
                "nodes": self.nodes,
                "positions_m": self.positions,
                "supports": self.supports,
                "span_m": self.span,
                "delta_m_per_N": self.delta,
                "fractions": self.fractions,
            }
        )

    def to_frame(self) -> pd.DataFrame:
        """A row per mass: node, position from the left support, shares of both supports, row of δ."""
        shares = (Column(f"share_{node}", self.fractions[:, s]) for s, node in enumerate(self.supports))
        delta = (Column(f"delta_{node}_m_per_N", self.delta[:, j]) for j, node in enumerate(self.nodes))
        return frame((Column("node", self.nodes), Column("position_m", self.positions), *shares, *delta))


def separate(rotor: fem.Rotor, nodes: Sequence[int]) -> Separated:
    """Separate the shaft's flexibility from that of its two supports, [S] (41)–(47).

    Parameters
    ----------
    rotor
        On supports at exactly two nodes, without tilting stiffness; their own stiffness does not matter.
    nodes
        Node numbers of the n masses, from 1, all different; they may overhang.

    Raises
    ------
    ValueError
        For more or fewer than two supported nodes or tilting stiffness (equilibrium alone then does not
        give the shares of a force), a seal among the supports, nodes that do not exist or repeat, a mesh
        too fine for float64.
    """
    at = mass_nodes(rotor, nodes)
    a, b = _two_supports(rotor)
    A = assemble(rotor)
    ends = np.array([A.deflection(a), A.deflection(b)])
    unknowns = np.array([A.deflection(p) for p in at], dtype=np.intp)
    delta = _flexibility(held(A.shaft, ends), unknowns)
    delta[np.isin(unknowns, ends), :] = delta[:, np.isin(unknowns, ends)] = 0.0
    where = rotor.positions[np.array([a, b, *at]) - 1]
    span, positions = float(where[1] - where[0]), where[2:] - where[0]
    return Separated(at, positions, (a, b), span, delta, _fractions(positions, span))


def separated_compliance(
    delta: ArrayLike, positions: ArrayLike, span: float, c1: float, c2: float
) -> FloatArray:
    """Compliance of masses on a shaft with two elastic supports, formula (47) itself.

    Parameters
    ----------
    delta
        Of the shaft on rigid supports, m/N, shape (n, n), symmetric.
    positions
        a of the masses from the left support, m, shape (n,); negative or above `span` where they overhang.
    span
        l, between the supports, m.
    c1, c2
        Stiffness of the left and the right support, N/m.

    Returns
    -------
    α, m/N, shape (n, n).

    Raises
    ------
    ValueError
        For shapes that do not fit, entries that are not finite, a span or stiffness that is not positive.

    Examples
    --------
    >>> separated_compliance([[1e-8]], [0.5], 1.0, 1e8, 1e8)
    array([[1.5e-08]])
    """
    D, a = np.asarray(delta, dtype=float), np.asarray(positions, dtype=float)
    if a.ndim != 1 or D.shape != (len(a), len(a)):
        raise ValueError(f"delta must be (n, n) for n positions; got {D.shape} and {a.shape}")
    if not (np.isfinite(D).all() and np.isfinite(a).all()):
        raise ValueError("delta and positions must be finite; found NaN or infinity")
    if not (np.isfinite(span) and span > 0):
        raise ValueError(f"the span between the supports must be positive, in m; got {span}")
    R = _fractions(a, span)
    return np.asarray(D + (R / _stiffness((c1, c2))) @ R.T)


def _fractions(positions: FloatArray, span: float) -> FloatArray:
    return np.stack((span - positions, positions), axis=1) / span


def _stiffness(value: ArrayLike) -> FloatArray:
    c = np.asarray(value, dtype=float)
    if c.shape not in ((), (2,)) or not (np.isfinite(c).all() and (c > 0).all()):
        raise ValueError(f"the stiffness of the two supports must be positive and finite, in N/m; got {c}")
    return np.broadcast_to(c, (2,))


def _two_supports(rotor: fem.Rotor) -> tuple[int, int]:
    """Nodes of the two supports, left first."""
    seals = [s.node for s in rotor.supports if s.kind == "seal"]
    if seals:
        raise ValueError(
            f"the support at node {seals[0]} is a seal, not a bearing of formula (47): leave it out of the "
            "rotor and give its stiffness to equivalent_masses (seal_stiffness), or use small_rotor, which "
            "keeps every support as a coordinate"
        )
    found = sorted({s.node for s in rotor.supports})
    if len(found) != 2:
        raise ValueError(
            f"formula (47) needs supports at exactly two nodes, for equilibrium alone must share a force "
            f"among them; this rotor has supports at {len(found)}: use small_rotor, which keeps every "
            "support as a coordinate"
        )
    if any(s.tilting_stiffness > 0 for s in rotor.supports):
        raise ValueError(
            "a support with tilting stiffness takes moments, so that equilibrium alone does not share a "
            "force between the supports: use small_rotor, which keeps every support as a coordinate"
        )
    return found[0], found[1]


def held(band: FloatArray, unknowns: IndexArray) -> FloatArray:
    """Upper band with some unknowns fixed: their rows and columns are those of the identity."""
    free = np.ones(band.shape[1])
    free[unknowns] = 0.0
    above = range(len(band) - 1, -1, -1)
    K = np.asfortranarray([row * free * np.roll(free, off) for off, row in zip(above, band, strict=True)])
    K[-1, unknowns] = 1.0
    return K


def _flexibility(band: FloatArray, unknowns: IndexArray) -> FloatArray:
    """Entries of the inverse at some unknowns."""
    from scipy.linalg.lapack import dpbtrf, dpbtrs

    forces = np.zeros((band.shape[1], unknowns.size))
    forces[unknowns, np.arange(unknowns.size)] = 1.0
    U, info = dpbtrf(band)
    X = dpbtrs(U, forces)[0] if info == 0 else forces
    if info != 0 or rounding_error(band, X).max(initial=0.0) > 1e-3:
        raise ValueError("the mesh is so fine that float64 carries fewer than about three digits: coarsen it")
    return np.asarray((X[unknowns] + X[unknowns].T) / 2)
