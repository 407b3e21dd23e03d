"""A few masses on a massless shaft with its supports and what is not linear: a small model for motion."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any

import numpy as np

import fem
from fem import NodeForce
from fem.forces import kind_of
from rotorid.base.answer import Answer, Answered
from rotorid.base.arrays import FloatArray, read_only
from rotorid.base.checks import number
from rotorid.base.text import counted, listing

_ROUNDING = 1e-5  # share of the largest entry that stands in few digits
_zero = np.array(0.0).copy  # a new one each time
_MATRICES = ("stiffness", "material_damping", "gyroscopic", "damping")


@dataclass(frozen=True, eq=False)
class SmallModel(Answered):
    """Masses at nodes of a shaft that is given by its matrices, the same in both planes.

    With rotation from x to y and the matrices of one plane, without supports and forces,

        x:  M x'' + (B + C) x' + Ω G y' + K x + Ω B y = f_x
        y:  M y'' + (B + C) y' − Ω G x' + K y − Ω B x = f_y.

    Attributes
    ----------
    nodes
        Different numbers of the k nodes.
    masses
        kg, shape (k,); 0 where only a support or a force acts.
    weight
        N at 9.80665 m/s², shape (k,).
    stiffness
        K of the shaft, N/m, shape (k, k); symmetric and not negative, as the others.
    material_damping, gyroscopic, damping
        B, N·s/m, which turns with the shaft, G, kg, and C, N·s/m, of the surroundings, shape (k, k), or
        the number 0.
    supports, forces
        At these nodes.
    unbalance
        m e e^{iβ} by node, kg·m, β with the rotation.
    bow
        How far the shaft at rest deviates from a straight line by node, m, at three nodes or more.
    warnings
        What the reader must know.

    Raises
    ------
    ValueError
        For what no shaft has; the message begins with the attribute.
    """

    nodes: tuple[int, ...]
    masses: FloatArray
    weight: FloatArray
    stiffness: FloatArray
    material_damping: FloatArray = field(default_factory=_zero)
    gyroscopic: FloatArray = field(default_factory=_zero)
    damping: FloatArray = field(default_factory=_zero)
    supports: Sequence[fem.Support] = ()
    forces: Sequence[NodeForce] = ()
    unbalance: Mapping[int, complex] = field(default_factory=dict)
    bow: Mapping[int, complex] = field(default_factory=dict)
    warnings: tuple[str, ...] = ()

    def __post_init__(self) -> None:
        k = len(self.nodes)
        if not k or len(set(self.nodes)) != k:
            raise ValueError(f"nodes: different nodes, one at least, not {list(self.nodes)}")
        for name in ("masses", "weight", *_MATRICES):
            object.__setattr__(self, name, _array(name, getattr(self, name), k))
        if (self.masses < 0).any() or not self.masses.any():
            raise ValueError("masses: 0 or more, and not all of them 0")
        acting = *(support.node for support in self.supports), *(force.node for force in self.forces)
        for node in (*acting, *self.unbalance, *self.bow):
            self.node(node)
        if any(support.tilting_stiffness for support in self.supports):
            raise ValueError(
                "supports: a small model has no slopes; tilting stiffness belongs into the shaft's stiffness"
            )

    def node(self, name: str | int) -> int:
        """Number of a node, given as a number or as its text.

        Raises
        ------
        ValueError
            If the model has no such node.
        """
        if str(name) not in map(str, self.nodes):
            known = listing(map(str, self.nodes), "and")
            raise ValueError(f"node {name} does not exist: the small model has {known}")
        return int(name)

    def motion(self, speed: float = 0.0) -> fem.Motion:
        """The linear equations in both planes, without forces that are not linear.

        Coordinates are x and y of the nodes, `x7` and `y7`, then pedestals, `foot_x1` and `foot_y1` of the
        first support.

        Raises
        ------
        ValueError
            For an impossible speed or one outside the table of a support.
        """
        speed = number(speed, "speed")
        names = [f"{axis}{node}" for axis in "xy" for node in self.nodes]
        stands = [i for i, support in enumerate(self.supports) if support.pedestal is not None]
        feet = [f"foot_{axis}{i + 1}" for axis in "xy" for i in stands]
        along, across = np.eye(2), np.array([[0.0, speed], [-speed, 0.0]])
        M, C, K = (
            np.pad(matrix, (0, len(feet)))
            for matrix in (
                np.kron(along, np.diag(self.masses)),
                np.kron(along, self.material_damping + self.damping) + np.kron(across, self.gyroscopic),
                np.kron(along, self.stiffness) + np.kron(across, self.material_damping),
            )
        )
        names += feet
        for i, support in enumerate(self.supports):
            felt = np.zeros((2, len(names)))
            for plane, axis in enumerate("xy"):
                felt[plane, names.index(f"{axis}{support.node}")] = 1.0
                if support.pedestal is not None:
                    foot = names.index(f"foot_{axis}{i + 1}")
                    felt[plane, foot] = -1.0
                    M[foot, foot] = support.pedestal.mass
                    K[foot, foot] += support.pedestal.xy("stiffness")[plane]
                    C[foot, foot] += support.pedestal.xy("damping")[plane]
            stiffness, damping = support.at(speed)
            K += felt.T @ stiffness @ felt
            C += felt.T @ damping @ felt
        return fem.Motion(M, C, K, tuple(names), speed)

    def to_dict(self) -> dict[str, Any]:
        """Plain data for JSON; the file of the model has the rest."""
        return {
            "nodes": list(self.nodes),
            "masses_kg": self.masses.tolist(),
            "weight_N": self.weight.tolist(),
            "warnings": list(self.warnings),
        }

    @property
    def answer(self) -> Answer:
        """Where its masses stand, and what acts on it."""
        acting = [f"{kind_of(force).replace('_', ' ')} at {force.node}" for force in self.forces]
        acting += [f"{support.kind} at {support.node}" for support in self.supports]
        masses = ", ".join(f"{m:.2f} at {n}" for n, m in zip(self.nodes, self.masses, strict=True))
        return Answer(
            f"For motion: {counted(len(self.nodes), 'node')} in both planes, masses in kg {masses}, together "
            f"{self.masses.sum():.2f}, weight {self.weight.sum():.1f} N; {listing(acting, 'and') or 'free'}.",
            warnings=self.warnings,
        )


def _array(name: str, value: FloatArray, k: int) -> FloatArray:
    """Checked and read-only; the number 0 is a matrix of zeros."""
    shape = (k, k) if name in _MATRICES else (k,)
    array = np.array(value, dtype=float)
    if not array.ndim and array == 0:
        array = np.zeros(shape)
    if array.shape != shape or not np.isfinite(array).all():
        numbers = " × ".join(map(str, shape))
        raise ValueError(f"{name}: {numbers} finite numbers for {counted(k, 'node')}")
    if name in _MATRICES:
        rounding = _ROUNDING * np.abs(array).max()
        if np.abs(array - array.T).max() > rounding or np.linalg.eigvalsh(array)[0] < -rounding:
            raise ValueError(f"{name}: a symmetric matrix that has no negative eigenvalue")
    read_only(array)
    return array
