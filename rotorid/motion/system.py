"""A rotor whose motion is sought: linear equations over speed, and what else acts at its nodes.

    M q'' + C(Ω) q' + K(Ω) q = w + Σ F(q, q', Ω) + Re[(u (Ω² − i Ω') + b) e^{iφ}],  Ω = φ'

with the weight w, the laws F of `fem.forces`, the unbalance u = m e in x and −i m e in y at its node (a mass
centre at e e^{iφ} acts with −m e (e^{iφ})'' there), and b, what a bent shaft needs to be straight: the
shaft's stiffness times the bow. A bow is at rest in the turning shaft: internal damping does not feel it.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np

import fem
from fem import NodeForce
from fem.forces import law, tables
from rotorid.base.arrays import ComplexArray, FloatArray, IndexArray
from rotorid.base.compiled import compiled_part


@dataclass(frozen=True, eq=False)
class MotionSystem:
    """What moves; made by `system`.

    Attributes
    ----------
    coordinates
        Names of the n unknowns as in `fem.Motion`: `x7` and `y7` are the deflections of node 7, m.
    knots
        Speeds at which `C` and `K` are known, rad/s, ascending, shape (s,); between them both are linear.
    M, C, K
        Mass, shape (n, n), the fluid's in seals included; linear damping, gyroscopic effect included, and
        stiffness, shape (s, n, n).
    forces
        What is not linear, f of them.
    weight, unbalance, bow
        w, N, and, complex, u, kg·m, and b, N, shape (n,) each.
    """

    coordinates: tuple[str, ...]
    knots: FloatArray
    M: FloatArray
    C: FloatArray
    K: FloatArray
    forces: tuple[NodeForce, ...]
    weight: FloatArray
    unbalance: ComplexArray
    bow: ComplexArray

    @property
    def size(self) -> int:
        """How many unknowns there are, n."""
        return len(self.coordinates)

    def index(self, node: int) -> tuple[int, int]:
        """Where x and y of a node stand, from 0; ValueError for a node that has no deflection here."""
        try:
            return self.coordinates.index(f"x{node}"), self.coordinates.index(f"y{node}")
        except ValueError:
            raise ValueError(
                f"node {node} does not move of its own; nodes {', '.join(map(str, self.nodes))} do"
            ) from None

    @cached_property
    def nodes(self) -> tuple[int, ...]:
        """Nodes with deflections of their own."""
        return tuple(int(name[1:]) for name in self.coordinates if name[0] == "x" and name[1:].isdecimal())

    @cached_property
    def law_tables(self) -> tuple[IndexArray, FloatArray, IndexArray]:
        """Codes (f,) and parameters (f, 8) of the laws, and where x and y of their nodes stand, (f, 2)."""
        places = np.array([self.index(force.node) for force in self.forces], dtype=np.intp).reshape(-1, 2)
        return *tables(self.forces), places

    def linear(self, speed: float) -> tuple[FloatArray, FloatArray]:
        """C and K at a speed, rad/s, shape (n, n) each; ValueError outside the knots."""
        if not self.knots[0] <= speed <= self.knots[-1]:
            raise ValueError(
                f"these equations hold from {self.knots[0]:.6g} to {self.knots[-1]:.6g} rad/s, not at "
                f"{speed:.6g} rad/s"
            )
        i = max(0, min(int(np.searchsorted(self.knots, speed, "right")) - 1, len(self.knots) - 2))
        s = (speed - self.knots[i]) / (self.knots[i + 1] - self.knots[i])
        C, K = ((1 - s) * matrix[i] + s * matrix[i + 1] for matrix in (self.C, self.K))
        return np.asarray(C), np.asarray(K)

    def acting(self, q: FloatArray, v: FloatArray, speed: float) -> tuple[FloatArray, ...]:
        """Forces that are not linear, F (n,), and their derivatives by q and v, (n, n), and Ω, (n,)."""
        n = self.size
        out = np.zeros(n), np.zeros((n, n)), np.zeros((n, n)), np.zeros(n)
        add_forces(*self.law_tables, q, v, speed, *out)
        return out


def system(
    linear: Callable[[float], fem.Motion],
    knots: FloatArray,
    *,
    forces: Sequence[NodeForce] = (),
    weight: Mapping[str, float] | None = None,
    unbalance: Mapping[int, complex] | None = None,
    bow: Mapping[str, complex] | None = None,
) -> MotionSystem:
    """Put together what moves; ValueError as `linear`, and for nodes that do not move.

    Parameters
    ----------
    linear, knots
        The equations of motion at a speed, rad/s; where their matrices may change slope, and both ends.
    forces
        What is not linear.
    weight, bow
        N by coordinate.
    unbalance
        m e e^{iβ} by node, kg·m, β with the rotation.
    """
    motions = [linear(float(speed)) for speed in knots]
    names = motions[0].coordinates
    made = MotionSystem(
        coordinates=names,
        knots=np.asarray(knots, dtype=float),
        M=motions[0].M.copy(),
        C=np.array([motion.C for motion in motions]),
        K=np.array([motion.K for motion in motions]),
        forces=tuple(forces),
        weight=np.zeros(len(names)),
        unbalance=np.zeros(len(names), dtype=complex),
        bow=np.zeros(len(names), dtype=complex),
    )
    for force in forces:
        for i in made.index(force.node):
            made.M[i, i] += force.mass
    for node, value in (unbalance or {}).items():
        x, y = made.index(node)
        made.unbalance[x] += value
        made.unbalance[y] -= 1j * value
    for name, value in (weight or {}).items():
        made.weight[motions[0].index(name)] += value
    for name, value in (bow or {}).items():
        made.bow[motions[0].index(name)] += value
    return made


@compiled_part
def add_forces(  # noqa: PLR0913  what is compiled takes no objects
    codes: IndexArray,
    values: FloatArray,
    places: IndexArray,
    q: FloatArray,
    v: FloatArray,
    speed: float,
    F: FloatArray,
    F_q: FloatArray,
    F_v: FloatArray,
    F_speed: FloatArray,
) -> None:
    """Add the forces of `MotionSystem.law_tables` to F and their derivatives to F_q, F_v and F_speed."""
    out = np.empty((2, 6))
    for f in range(len(codes)):
        ix, iy = places[f, 0], places[f, 1]
        law(codes[f], values[f], q[ix], q[iy], v[ix], v[iy], speed, out)
        for row in range(2):
            i = ix if row == 0 else iy
            F[i] += out[row, 0]
            F_q[i, ix] += out[row, 1]
            F_q[i, iy] += out[row, 2]
            F_v[i, ix] += out[row, 3]
            F_v[i, iy] += out[row, 4]
            F_speed[i] += out[row, 5]
