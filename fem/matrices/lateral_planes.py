"""The rotor in both planes: matrices of its equations of motion in any basis of the shaft.

With single-plane matrices M, B, G, K of the shaft (see `fem.matrices.banded_matrices`) and the speed Ω,

    x:  M x'' + B x' + Ω G y' + K x + Ω B y + supports = 0
    y:  M y'' + B y' − Ω G x' + K y − Ω B x + supports = 0

Where every support is rotationally symmetric, z = x + i y takes half of the unknowns: M z'' + (B − i Ω G) z'
+ (K − i Ω B) z + supports = 0 with scalars k = kxx − i kxy and c = cxx − i cxy. A pedestal is one more
unknown in each plane.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np

from fem.matrices.banded_matrices import Matrices, assemble, multiply
from fem.matrices.strain import strains
from fem.model.rotor import Rotor
from rotorid.base.arrays import AnyArray, FloatArray, IndexArray


@dataclass(frozen=True, eq=False)
class Planes:
    """A rotor as both planes see it.

    Attributes
    ----------
    rotor, A
        The rotor and its single-plane bands.
    planes
        2: unknowns x and y, real matrices; 1: the complex coordinate z, complex matrices.
    rows
        Unknown of the deflection at each support, from 0, shape (s,).
    pedestals
        Which supports stand on a pedestal, shape (f,).
    pedestal_mass, pedestal_stiffness, pedestal_damping
        Of the pedestals, shapes (f, planes).
    tilting
        (unknown of a slope, N·m/rad) for each support that holds the slope.
    """

    rotor: Rotor
    A: Matrices
    planes: int
    rows: IndexArray
    pedestals: IndexArray
    pedestal_mass: FloatArray
    pedestal_stiffness: FloatArray
    pedestal_damping: FloatArray
    tilting: tuple[tuple[int, float], ...]

    def supports(self, speeds: FloatArray) -> tuple[AnyArray, AnyArray]:
        """Stiffness and damping of all supports, each of shape (S, s, planes, planes).

        Raises
        ------
        ValueError
            Outside the table of a support.
        """
        p = self.planes
        K = np.zeros((speeds.size, len(self.rotor.supports), p, p), dtype=self.dtype)
        C = np.zeros_like(K)
        for i, support in enumerate(self.rotor.supports):
            for whole, matrix in zip((K, C), support.at(speeds), strict=True):
                whole[:, i] = matrix if p == 2 else matrix[:, :1, :1] - 1j * matrix[:, :1, 1:]
        return K, C

    def mirrored(self, speeds: FloatArray) -> bool:
        """Whether left eigenvectors are the right ones with y reversed (or, of z, are equal to them).

        So it is where no support has a symmetric cross-coupling: kxy = −kyx, the same for damping.
        """
        if self.planes == 1:
            return True
        return all(np.array_equal(matrix[..., 0, 1], -matrix[..., 1, 0]) for matrix in self.supports(speeds))

    @property
    def dtype(self) -> type[Any]:
        """Of the matrices."""
        return float if self.planes == 2 else complex


@dataclass(frozen=True, eq=False)
class Quadratic:
    """λ² M + λ (D₀ + Ω D₁ + supports) + K₀ + Ω K₁ + supports, in a basis of d shaft vectors per plane.

    Unknowns: d per plane, plane after plane, then the pedestals, again plane after plane; R in all.

    Attributes
    ----------
    P
        The rotor.
    basis
        Vectors of one plane, shape (size, d).
    M, D0, D1, K0, K1
        Shape (R, R).
    ties
        What a unit entry (i, j) of each support's matrices adds, shape (s · planes², R²).
    """

    P: Planes
    basis: FloatArray
    M: FloatArray
    D0: FloatArray
    D1: AnyArray
    K0: FloatArray
    K1: AnyArray
    ties: FloatArray

    @property
    def size(self) -> int:
        """R."""
        return len(self.M)

    def at(self, speeds: FloatArray) -> tuple[AnyArray, AnyArray]:
        """D and K at each speed, shape (S, R, R)."""
        k, c = self.P.supports(speeds)
        shape = (speeds.size, self.size, self.size)
        omega = speeds[:, None, None]
        D = self.D0 + omega * self.D1 + (c.reshape(speeds.size, len(self.ties)) @ self.ties).reshape(shape)
        K = self.K0 + omega * self.K1 + (k.reshape(speeds.size, len(self.ties)) @ self.ties).reshape(shape)
        return D, K

    def mirror(self, vectors: AnyArray) -> AnyArray:
        """Reduced vectors (…, R) with y reversed; a complex coordinate stays as it is."""
        if self.P.planes == 1:
            return vectors
        d, f = self.basis.shape[1], len(self.P.pedestals)
        out = vectors.copy()
        out[..., d : 2 * d] *= -1
        out[..., 2 * d + f :] *= -1
        return out

    def expand(self, vectors: AnyArray) -> AnyArray:
        """Shaft unknowns of reduced vectors (…, R), shape (…, planes, size)."""
        return self._of_shaft(vectors, self.basis)

    def nodes(self, vectors: AnyArray) -> AnyArray:
        """Deflections of all nodes in reduced vectors (…, R), shape (…, planes, N)."""
        return self._of_shaft(vectors, self.basis[:: self.P.A.stride])

    def _of_shaft(self, vectors: AnyArray, basis: FloatArray) -> AnyArray:
        planes, d = self.P.planes, basis.shape[1]
        coefficients = vectors[..., : planes * d]
        return np.asarray(coefficients.reshape(*vectors.shape[:-1], planes, d) @ basis.T)


def both_planes(rotor: Rotor, *, complex_coordinate: bool | None = None) -> Planes:
    """Look at a rotor in both planes; by default with the complex coordinate where that is enough."""
    one = rotor.symmetric if complex_coordinate is None else complex_coordinate
    p = 1 if one else 2
    A = assemble(rotor)
    supports = rotor.supports
    stands = [(i, s.pedestal) for i, s in enumerate(supports) if s.pedestal is not None]
    return Planes(
        rotor=rotor,
        A=A,
        planes=p,
        rows=np.array([A.stride * (s.node - 1) for s in supports], dtype=np.intp),
        pedestals=np.array([i for i, _ in stands], dtype=np.intp),
        pedestal_mass=np.array([[pedestal.mass] * p for _, pedestal in stands]).reshape(-1, p),
        pedestal_stiffness=np.array([pedestal.xy("stiffness")[:p] for _, pedestal in stands]).reshape(-1, p),
        pedestal_damping=np.array([pedestal.xy("damping")[:p] for _, pedestal in stands]).reshape(-1, p),
        tilting=tuple(
            (A.stride * (s.node - 1) + 1, s.tilting_stiffness) for s in supports if s.tilting_stiffness > 0
        ),
    )


def project(P: Planes, basis: FloatArray) -> Quadratic:
    """The equations in a basis of the shaft, shape (size, d), the same in both planes."""
    d, p, f = basis.shape[1], P.planes, len(P.pedestals)
    strain = strains(P.rotor, basis)
    flat = strain.reshape(-1, d)
    damped = (np.sqrt(P.rotor.material_damping)[:, None] * strain).reshape(-1, d)
    K, B = flat.T @ flat, damped.T @ damped
    for unknown, stiffness in P.tilting:
        K += stiffness * np.outer(basis[unknown], basis[unknown])
    M = basis.T @ multiply(P.A.mass, basis)
    G = basis.T @ multiply(P.A.gyroscopic, basis)
    # Force in x from y, and with the opposite sign in y from x; or the same of z.
    across = np.array([[0.0, 1.0], [-1.0, 0.0]]) if p == 2 else np.array([[-1j]])

    def planes(sides: AnyArray, shaft: FloatArray, pedestals: FloatArray) -> AnyArray:
        """A matrix of the shaft, made symmetric, in the planes, and its values at the pedestals."""
        whole = np.zeros((p * (d + f), p * (d + f)), dtype=sides.dtype)
        both = sides[:, None, :, None] * ((shaft + shaft.T) / 2)[:, None]  # plane, unknown, plane, unknown
        whole[: p * d, : p * d] = both.reshape(p * d, p * d)
        np.fill_diagonal(whole[p * d :, p * d :], pedestals.T.ravel())
        return whole

    along, none = np.eye(p), np.zeros((f, p))
    # What a support feels: motion of its node against the ground or the foot, in each plane.
    felt = np.zeros((len(P.rows), p, p * (d + f)))
    for plane in range(p):
        felt[:, plane, plane * d : (plane + 1) * d] = basis[P.rows]
        felt[P.pedestals, plane, p * d + plane * f + np.arange(f)] = -1.0
    ties = np.einsum("sia,sjb->sijab", felt, felt).reshape(-1, felt.shape[2] ** 2)
    return Quadratic(
        P=P,
        basis=basis,
        M=planes(along, M, P.pedestal_mass),
        D0=planes(along, B, P.pedestal_damping),
        D1=planes(across, G, none),
        K0=planes(along, K, P.pedestal_stiffness),
        K1=planes(across, B, none),
        ties=ties,
    )
