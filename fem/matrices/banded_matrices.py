"""Assembled matrices of one lateral plane of a rotor, in bands; the elements are in `fem.matrices.elements`.

Unknowns: `stride` per node, the deflection w (m) first, then the slope θ (rad); with `shear` two shear angles
of the element to the right follow, and the last node has w and θ only. Both planes have the same real
symmetric matrices. With z = x + i y and rotation Ω

    M z'' + (B − i Ω G) z' + (K − i Ω B) z + supports = f.

Symmetric bands are kept as LAPACK does, upper form: `band[width + i - j, j]` is entry (i, j) for i ≤ j.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from fem.matrices.elements import Layout, bending_terms, gyroscopic_terms, mass_terms
from fem.matrices.strain import strains
from fem.model.node_forces import kind_of
from fem.model.rotor import Rotor
from rotorid.base.arrays import FloatArray, IndexArray

_FEW = 12  # columns that are multiplied one by one


@dataclass(frozen=True, eq=False)
class Matrices:
    """The assembled rotor, one plane.

    Attributes
    ----------
    shaft
        Stiffness of the shaft (and tilting springs) without the supports' stiffness, upper band of shape
        (width + 1, size).
    mass
        Shaft and discs; tilting inertia if the model has `rotary_inertia`.
    gyroscopic
        G, polar inertia of shaft and discs on the slopes; zero unless the model has `gyroscopic`.
    material
        B, Σ β K of the elements.
    stride, width
        Unknowns per node, and entries of a band above its diagonal.
    """

    shaft: FloatArray
    mass: FloatArray
    gyroscopic: FloatArray
    material: FloatArray
    stride: int
    width: int

    @property
    def size(self) -> int:
        """Number of unknowns."""
        return int(self.shaft.shape[1])

    def deflection(self, node: int) -> int:
        """Unknown, from 0, of the deflection of a node, from 1; that of its slope is the next."""
        return self.stride * (node - 1)

    @property
    def deflections(self) -> IndexArray:
        """Unknowns of the deflections of all nodes, shape (N,)."""
        return np.arange(0, self.size, self.stride)


def assemble(rotor: Rotor) -> Matrices:
    """Matrices of a rotor, assembled without a loop over elements.

    Raises
    ------
    ValueError
        For a rotor with forces that are not linear.
    """
    if rotor.forces:
        kind = kind_of(rotor.forces[0]).replace("_", " ")
        raise ValueError(
            f"the {kind} at node {rotor.forces[0].node} is not linear, and this asks for linear equations: "
            "write the coefficients of all such forces at rest first, `rotorid bearings ROTOR --speeds A:B "
            "--output linear.toml`, or take rotor.linear, which leaves them out"
        )
    layout, model = Layout(rotor), rotor.model
    bending = bending_terms(rotor)
    K, M = layout.band(bending), layout.band(mass_terms(rotor))
    G = layout.band(gyroscopic_terms(rotor)) if model.gyroscopic else np.zeros_like(M)
    B, beta = np.zeros_like(M), rotor.material_damping
    if beta.any():
        B = layout.band([(beta * factor, form) for factor, form in bending])
    for disc in rotor.discs:
        deflection = layout.stride * (disc.node - 1)
        M[-1, deflection] += disc.mass
        if model.rotary_inertia:
            M[-1, deflection + 1] += disc.diametral_inertia
        if model.gyroscopic:
            G[-1, deflection + 1] += disc.polar_inertia
    for support in rotor.supports:
        K[-1, layout.stride * (support.node - 1) + 1] += support.tilting_stiffness
    return Matrices(K, M, G, B, layout.stride, layout.width)


def free_motions(rotor: Rotor, held: set[int]) -> int:
    """Number of rigid-body motions, of 2, left by springs at the nodes `held` and by tilting springs."""
    tilting = any(support.tilting_stiffness > 0 for support in rotor.supports)
    if not held:
        return 2 - tilting
    return 0 if len(held) > 1 or tilting else 1


def multiply(band: FloatArray, X: FloatArray) -> FloatArray:
    """Product of a symmetric or Hermitian band with vectors, shape (size, m)."""
    width = band.shape[0] - 1
    if X.shape[1] <= _FEW and band.dtype == X.dtype:
        from scipy.linalg import blas

        product = blas.dsbmv if band.dtype == float else blas.zhbmv
        band, Y = np.asfortranarray(band), np.empty(X.shape, X.dtype, order="F")
        for k in range(X.shape[1]):
            product(width, 1.0, band, X[:, k], y=Y[:, k], overwrite_y=True)
        return Y
    Y = band[width, :, None] * X
    for above in range(1, width + 1):
        entries = band[width - above, above:, None]
        Y[:-above] += entries * X[above:]
        Y[above:] += np.conj(entries) * X[:-above]
    return Y


def held(band: FloatArray, unknowns: IndexArray) -> FloatArray:
    """Upper band with some unknowns fixed: their rows and columns are those of the identity."""
    K = band.copy(order="F")
    width, size = K.shape[0] - 1, K.shape[1]
    K[:, unknowns] = 0.0
    K[width, unknowns] = 1.0
    for above in range(1, width + 1):
        right = unknowns + above
        K[width - above, right[right < size]] = 0.0
    return K


def dense(band: FloatArray) -> FloatArray:
    """Full symmetric or Hermitian matrix of a band, shape (size, size), in Fortran order."""
    width, size = band.shape[0] - 1, band.shape[1]
    A = np.zeros((size, size), band.dtype)
    flat = A.reshape(-1)
    for above in range(min(width, size - 1) + 1):
        entries = band[width - above, above:]
        flat[above : (size - above) * size : size + 1] = np.conj(entries)  # transposed at the end
        flat[above * size :: size + 1] = entries
    return A.T


def general(band: FloatArray) -> FloatArray:
    """The same matrix in LAPACK's general band form with room for pivoting, shape (3 width + 1, size)."""
    width = band.shape[0] - 1
    A = np.zeros((3 * width + 1, band.shape[1]))
    A[2 * width] = band[width]
    for above in range(1, width + 1):
        A[2 * width - above] = band[width - above]
        A[2 * width + above, :-above] = band[width - above, above:]
    return A


def shaft_energy(rotor: Rotor, X: FloatArray) -> FloatArray:
    """Twice the strain energy of the shaft and of tilting springs for each column of X, N·m, shape (m,).

    Summed from strains (`fem.matrices.strain`) it loses rounding of the order (number of elements)² instead
    of the fourth power that xᵀ K x itself loses.
    """
    S = strains(rotor, X)
    energy = np.einsum("kem,kem->m", S, S)
    stride = 4 if rotor.model.shear else 2
    for support in rotor.supports:
        if support.tilting_stiffness:
            energy = energy + support.tilting_stiffness * X[stride * (support.node - 1) + 1] ** 2
    return np.asarray(energy)


def rounding_error(band: FloatArray, X: FloatArray, energy: FloatArray | None = None) -> FloatArray:
    """Relative error of xᵀ K x that rounding the entries of K may cause, for each column of X, shape (m,).

    It grows with the fourth power of the number of elements: about 1e-13 at 20, 1e-5 at 2000. Solutions
    of K x = f are wrong by as much. The `energy` xᵀ K x is computed unless it is known.
    """
    if energy is None:
        energy = np.abs(np.einsum("ij,ij->j", X.conj(), multiply(band, X)))
    size = np.abs(X)
    scatter = np.einsum("ij,ij->j", size, multiply(np.abs(band), size))
    with np.errstate(divide="ignore", invalid="ignore"):
        return np.asarray(np.where(scatter > 0, np.finfo(float).eps * scatter / energy, 0.0))


def ignored_inertia(rotor: Rotor) -> tuple[str, ...]:
    """One warning for each disc whose moments of inertia the model leaves out."""
    model, warnings = rotor.model, []
    polar = ("polar", "no gyroscopic effect", "polar_inertia", model.gyroscopic)
    diametral = ("diametral", "no rotary inertia", "diametral_inertia", model.rotary_inertia)
    left_out = [moment for moment in (diametral, polar) if not moment[-1]]
    missing = " and ".join(effect for _, effect, _, _ in left_out)
    for disc in rotor.discs:
        kinds = [kind for kind, _, name, _ in left_out if getattr(disc, name) > 0]
        if not kinds:
            continue
        name = f" {disc.name!r}" if disc.name else ""
        what = "moments of inertia are" if len(left_out) > 1 else f"{kinds[0]} moment of inertia is"
        warnings.append(f"disc{name} at node {disc.node}: its {what} ignored, the model has {missing}")
    return tuple(warnings)
