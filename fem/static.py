"""Static compliance, and the deflection of a resting or turning rotor under its weight."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np

from fem.matrices.banded_matrices import Matrices, assemble, general, multiply
from fem.matrices.undamped_matrices import whole_rotor
from fem.model.rotor import Rotor
from rotorid.base.arrays import FloatArray, read_only
from rotorid.base.checks import number
from rotorid.base.json import plain
from rotorid.base.result import Column, frame, rows

if TYPE_CHECKING:
    import pandas as pd

GRAVITY = 9.80665  # m/s²


@dataclass(frozen=True, eq=False)
class StaticDeflection:
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

    def to_frame(self) -> pd.DataFrame:
        """One row per node."""
        nodes = Column("node", range(1, self.rotor.n_nodes + 1))
        positions = Column("position_m", self.rotor.positions)
        return frame((nodes, positions, Column("x_m", self.x), Column("y_m", self.y)))

    def to_dict(self) -> dict[str, Any]:
        """Plain data for JSON."""
        nodes = Column("node", [support.node for support in self.rotor.supports])
        return plain(
            {
                "speed_rad_s": self.speed,
                "weight_N": self.weight,
                "positions_m": self.rotor.positions,
                "x_m": self.x,
                "y_m": self.y,
                "reactions": rows((nodes, Column("x_N", self.reaction_x), Column("y_N", self.reaction_y))),
            }
        )

    def summary(self) -> str:
        """Weight, largest deflection and reactions, as text."""
        size = self.deflection
        k = int(np.argmax(size))
        lines = [
            f"Weight {self.weight:.6g} N; largest deflection {1e6 * size[k]:.4g} µm at node {k + 1}",
            f"{'support':>16}{'reaction x, N':>16}{'y, N':>12}",
        ]
        for support, x, y in zip(self.rotor.supports, self.reaction_x, self.reaction_y, strict=True):
            lines.append(f"{support.name or f'node {support.node}':>16}{x:16.6g}{y:12.6g}")
        return "\n".join(lines)


def static_deflection(
    rotor: Rotor, speed: float = 0.0, *, direction: float = -90.0, gravity: float = GRAVITY
) -> StaticDeflection:
    """Compute the deflection under the rotor's weight, and the reactions of its supports.

    Parameters
    ----------
    rotor
        The rotor, held by its supports in both directions.
    speed
        Of rotation, rad/s: where bearing tables are read, and where material damping, if there is any,
        bends the turning shaft sideways.
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
    angle = np.radians(number(direction, "direction", signed=True))
    A = assemble(rotor)
    ones = np.zeros((A.size, 1))
    ones[A.deflections] = 1.0
    load = gravity * multiply(A.mass, ones)[:, 0]
    forces = np.zeros((2, A.size, 1))
    along = np.array([np.cos(angle), np.sin(angle)])
    along[np.abs(along) < 1e-15] = 0.0  # straight down is straight down
    forces[:, :, 0] = np.outer(along, load)
    X = _solve(rotor, A, forces, speed)[:, :, 0]
    reactions = np.zeros((2, len(rotor.supports)))
    for k, support in enumerate(rotor.supports):
        D = support.dynamic_stiffness(0.0, speed).real
        reactions[:, k] = -D @ X[:, A.deflection(support.node)]
    x, y = X[:, A.deflections]
    read_only(x, y, reactions)
    return StaticDeflection(x, y, reactions[0], reactions[1], gravity * rotor.total_mass, rotor, speed)


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
        Where bearing tables are read, rad/s.

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
    A = assemble(rotor)
    unknowns = np.array([A.deflection(rotor.node(node)) for node in nodes], dtype=np.intp)
    forces = np.zeros((2, A.size, unknowns.size))
    forces[0, unknowns, np.arange(unknowns.size)] = 1.0
    alpha = _solve(rotor, A, forces, number(speed, "speed"), spin=False)[0, unknowns]
    symmetric = all(support.plain for support in rotor.supports)
    return np.asarray((alpha + alpha.T) / 2 if symmetric else alpha)


def _solve(rotor: Rotor, A: Matrices, forces: FloatArray, speed: float, spin: bool = True) -> FloatArray:
    """Static deflections of both planes under forces of shape (2, size, m), same shape.

    K x + Ω B y + kxx x + kxy y = f_x, K y − Ω B x + kyx x + kyy y = f_y.
    """
    from scipy.linalg.lapack import dgbsv

    if whole_rotor(rotor, A, speed).rigid.shape[1]:
        raise _free()
    w, wide = A.width, 2 * A.width + 1
    K = general(A.shaft)[w:]
    band = np.zeros((3 * wide + 1, 2 * A.size), order="F")
    middle = 2 * wide
    for plane in (0, 1):
        band[middle - 2 * w : middle + 2 * w + 1 : 2, plane::2] = K
    if spin and speed and A.material.any():
        B = speed * general(A.material)[w:]
        band[middle - 2 * w - 1 : middle + 2 * w : 2, 1::2] = B  # row x, column y
        band[middle - 2 * w + 1 : middle + 2 * w + 2 : 2, 0::2] = -B
    for support in rotor.supports:
        D, foot = support.dynamic_stiffness(0.0, speed).real, 2 * A.deflection(support.node)
        for p in (0, 1):
            for q in (0, 1):
                band[middle + p - q, foot + q] += D[p, q]
    size = forces.shape[2]
    rhs = np.asfortranarray(np.moveaxis(forces, 0, 1).reshape(2 * A.size, size))
    _, _, X, info = dgbsv(wide, wide, band, rhs)
    work = np.abs(np.einsum("ij,ij->j", rhs, X))
    scatter = np.zeros(size)
    for plane in (0, 1):
        part = np.abs(X[plane::2])
        scatter += np.einsum("ij,ij->j", part, multiply(np.abs(A.shaft), part))
    loaded = np.abs(rhs).max(axis=0) > 0
    if info != 0 or not np.isfinite(X).all() or (np.finfo(float).eps * scatter > 1e-3 * work)[loaded].any():
        raise _lost(rotor)
    return np.asarray(np.moveaxis(X.reshape(A.size, 2, size), 1, 0))


def _free() -> ValueError:
    return ValueError(
        "a rotor that is not held has no static compliance, and no rest under its weight: give stiffness to "
        "supports at two nodes"
    )


def _lost(rotor: Rotor) -> ValueError:
    return ValueError(
        f"the compliance of {rotor.n_elements} elements on these supports is lost in float64; "
        "join neighbouring elements (50 to 200 are ample for a rotor) or check the support stiffness"
    )
