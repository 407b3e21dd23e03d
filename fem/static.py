"""Static compliance, and the deflection of a resting or turning rotor under its weight.

K x + Ω B y + kxx x + kxy y = f_x and K y − Ω B x + kyx x + kyy y = f_y with the matrices of `fem.assembly`:
the whole band at the frequency 0. Rounding of K costs about 1e-13 of a deflection at 20 equal elements and
1e-5 where one of them is 500 times shorter; beyond 1e-3 the answer is refused.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from fem.assembly import (
    FROM_XY,
    TO_XY,
    Planes,
    WholeBand,
    both_planes,
    free_motions,
    multiply,
    rounding_error,
)
from fem.result import Result, holding_arrays
from fem.rotor import Rotor
from rotorid.base.arrays import FloatArray, number
from rotorid.base.tables import Column, Table

GRAVITY = 9.80665  # m/s²


@holding_arrays
class StaticDeflection(Result):
    """A rotor under its own weight.

    Attributes
    ----------
    x, y
        Deflection of each node, m, shape (N,).
    reaction_x, reaction_y
        Force of each support on the rotor, N, shape (B,).
    weight
        N.
    rotor
        The rotor.
    speed
        Of rotation, rad/s.
    """

    x: FloatArray
    y: FloatArray
    reaction_x: FloatArray
    reaction_y: FloatArray
    weight: float
    rotor: Rotor
    speed: float

    @property
    def deflection(self) -> FloatArray:
        """Size of the deflection of each node, m, shape (N,)."""
        return np.hypot(self.x, self.y)

    def tables(self) -> tuple[Table, ...]:
        """The reactions; and the deflection, a row for each node."""
        supports = self.rotor.supports
        nodes = (
            Column("node", range(1, self.rotor.n_nodes + 1)),
            Column("position_m", self.rotor.positions, "{:.6g}".format, "positions_m.*"),
            Column("x_m", self.x, "{:.4g}".format, "x_m.*"),
            Column("y_m", self.y, "{:.4g}".format, "y_m.*"),
        )
        reactions = (
            Column("support", [support.name or f"node {support.node}" for support in supports]),
            Column("reaction x, N", self.reaction_x, "{:.6g}".format, "reactions.*.x_N"),
            Column("y, N", self.reaction_y, "{:.6g}".format, "reactions.*.y_N"),
        )
        return Table("reactions", reactions), Table("deflection", nodes)

    def sentence(self) -> str:
        """Weight and largest deflection."""
        k = int(self.deflection.argmax())
        largest = f"{1e6 * self.deflection[k]:.4g} µm at node {k + 1}"
        return f"Weight {self.weight:.6g} N; largest deflection {largest}"


def static_deflection(
    rotor: Rotor, speed: float = 0.0, *, direction: float = -90.0, gravity: float = GRAVITY
) -> StaticDeflection:
    """Compute the deflection under the rotor's weight, and the reactions of its supports.

    Parameters
    ----------
    rotor
        The rotor, held by its supports in both directions.
    speed
        Of rotation, rad/s: where bearing tables are read, and where material or internal damping, if there
        is any, bends the turning shaft sideways.
    direction
        Of gravity, degrees from x with the rotation; −y by default.
    gravity
        m/s².

    Raises
    ------
    ValueError
        If the supports leave the rotor free, the speed lies outside a bearing table, or float64 does not
        carry the answer.
    """
    speed, gravity = number(speed, "speed"), number(gravity, "gravity")
    angle = math.radians(number(direction, "direction", signed=True))
    P = both_planes(rotor, complex_coordinate=False)
    lifted = np.zeros((P.A.size, 1))
    lifted[P.A.deflections] = gravity
    along = np.round((math.cos(angle), math.sin(angle)), 15)  # straight down is straight down
    X = _solved(P, along[:, None] * multiply(P.A.mass, lifted).T[:, None], speed)[0]
    springs = [support.dynamic_stiffness(0.0, speed).real for support in rotor.supports]
    x, y = X[:, P.A.deflections]
    at_x, at_y = -np.einsum("sij,js->is", springs, X[:, P.rows])
    return StaticDeflection(x, y, at_x, at_y, gravity * rotor.total_mass, rotor, speed)


def compliance(rotor: Rotor, nodes: Sequence[str | int], speed: float = 0.0) -> FloatArray:
    """Compute the deflections of some nodes under unit forces at these nodes, [S] (47).

    Forces and deflections are those in x. On supports that couple x and y the rotor moves in y, too, and the
    matrix is symmetric only if kxy = kyx.

    Parameters
    ----------
    rotor
        The rotor, held by stiffness at two nodes at least.
    nodes
        Node numbers, from 1, or names of stations; n of them.
    speed
        Where bearing tables are read, rad/s; damping that turns with the shaft is left out.

    Returns
    -------
    numpy.ndarray
        α, m/N, shape (n, n); entry (i, j) is the deflection of node i under a force at node j.

    Raises
    ------
    ValueError
        If the supports leave the rotor free, or a node does not exist, or the mesh is so fine that float64
        carries fewer than about three digits.
    """
    P = both_planes(rotor, complex_coordinate=False)
    P = replace(P, A=replace(P.A, material=np.zeros_like(P.A.material)))
    unknowns = P.A.deflections[[rotor.node(node) - 1 for node in nodes]]
    forces = (np.arange(P.A.size) == unknowns[:, None, None]) * [[1.0], [0.0]]
    alpha = _solved(P, forces, number(speed, "speed"))[:, 0, unknowns].T
    symmetric = all(support.plain for support in rotor.supports)
    return (alpha + alpha.T) / 2 if symmetric else alpha


def _solved(P: Planes, forces: FloatArray, speed: float) -> FloatArray:
    """Deflections under forces at rest, both of shape (m, 2, size)."""
    springs = P.supports(np.array([speed]))[0][0]
    for plane in (0, 1):
        if free_motions(P.rotor, set(P.rows[springs[:, plane, plane] != 0])):
            raise ValueError("a rotor that is not held has no rest: give stiffness to supports at two nodes")
    loads = (FROM_XY @ forces).swapaxes(1, 2).reshape(len(forces), -1)  # F and b alternate
    answers = WholeBand(P).factor(0.0, speed)(loads.T).T.reshape(len(forces), -1, 2)
    X = (TO_XY @ answers.swapaxes(1, 2)).real
    flat, work = X.reshape(-1, P.A.size), abs((forces * X).sum(axis=(1, 2)))
    if not (rounding_error(P.A.shaft, flat.T, np.repeat(work, 2)) < 1e-3).all():
        raise ValueError(
            f"the compliance of {P.rotor.n_elements} elements on these supports is lost in float64; "
            "join neighbouring elements (50 to 200 are ample for a rotor) or check the support stiffness"
        )
    # What rounding alone moves across does not move.
    return np.where(abs(X) < 1e-9 * abs(X).max(axis=1, keepdims=True), 0.0, X)
