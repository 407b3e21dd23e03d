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
    stiffness
        The same with the supports that are plain: one constant stiffness, on the ground.
    mass
        Shaft and discs; tilting inertia if the model has `rotary_inertia`.
    gyroscopic
        G, polar inertia of shaft and discs on the slopes; zero unless the model has `gyroscopic`.
    material
        B, Σ β K of the elements.
    damped
        Unknowns (from 0) on which damping of plain supports acts, shape (d,).
    damping
        Its coefficients, N·s/m, shape (d,).
    rigid
        Number of rigid-body motions that no stiffness of plain supports resists: 0, 1 or 2.
    stride, width
        Unknowns per node, and entries of a band above its diagonal.
    """

    shaft: FloatArray
    stiffness: FloatArray
    mass: FloatArray
    gyroscopic: FloatArray
    material: FloatArray
    damped: IndexArray
    damping: FloatArray
    rigid: int
    stride: int
    width: int

    @property
    def size(self) -> int:
        """Number of unknowns."""
        return int(self.stiffness.shape[1])

    def deflection(self, node: int) -> int:
        """Unknown, from 0, of the deflection of a node, from 1; that of its slope is the next."""
        return self.stride * (node - 1)

    @property
    def deflections(self) -> IndexArray:
        """Unknowns of the deflections of all nodes, shape (N,)."""
        return np.arange(0, self.size, self.stride)


def assemble(rotor: Rotor) -> Matrices:
    """Matrices of a rotor, assembled without a loop over elements."""
    layout, model = Layout(rotor), rotor.model
    bending = bending_terms(rotor)
    shaft, M = layout.band(*bending), layout.band(*mass_terms(rotor))
    G = layout.band(*gyroscopic_terms(rotor)) if model.gyroscopic else np.zeros_like(M)
    beta = rotor.material_damping
    B = layout.band(*((beta * factor, form) for factor, form in bending)) if beta.any() else np.zeros_like(M)
    w = layout.width
    for disc in rotor.discs:
        unknown = layout.deflection(disc.node)
        M[w, unknown] += disc.mass
        if model.rotary_inertia:
            M[w, unknown + 1] += disc.diametral_inertia
        if model.gyroscopic:
            G[w, unknown + 1] += disc.polar_inertia
    for support in rotor.supports:
        shaft[w, layout.deflection(support.node) + 1] += support.tilting_stiffness
    K = shaft.copy(order="K")
    damping: dict[int, float] = {}
    for support in rotor.supports:
        if not support.plain:
            continue
        unknown = layout.deflection(support.node)
        K[w, unknown] += support.stiffness
        if support.damping > 0:
            damping[unknown] = damping.get(unknown, 0.0) + support.damping
    held = {s.node for s in rotor.supports if s.plain and s.stiffness > 0}
    damped, coefficients = np.array(list(damping), dtype=np.intp), np.array(list(damping.values()))
    rigid = free_motions(rotor, held)
    return Matrices(shaft, K, M, G, B, damped, coefficients, rigid, layout.stride, w)


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

    It is summed from the end rotations of each element against its chord, which loses rounding of the
    order (number of elements)² instead of the fourth power that xᵀ K x itself loses.
    """
    stride = 4 if rotor.model.shear else 2
    L = rotor.length[:, None]
    w, slope = X[0::stride], X[1::stride]
    chord = np.diff(w, axis=0) / L
    a, b = slope[:-1] - chord, slope[1:] - chord
    stiffness = 4 * rotor.youngs_modulus * rotor.second_moment / rotor.length
    if rotor.model.shear:
        left, right = X[2::stride], X[3::stride]
        a, b, step = a + left, b + right, right - left
        # ∫(w'' − γ')² = 4 (a² + a b + b²) / L − 2 (b − a)(γ_b − γ_a) / L + (γ_b − γ_a)² / L
        energy = stiffness @ (a * a + a * b + b * b + step * (step - 2 * (b - a)) / 4)
        shear = rotor.shear_coefficient * rotor.shear_modulus * rotor.area * rotor.length / 3
        energy = energy + shear @ (left * left + left * right + right * right)
    else:
        energy = stiffness @ (a * a + a * b + b * b)
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
    polar, diametral = not rotor.model.gyroscopic, not rotor.model.rotary_inertia
    warnings = []
    for disc in rotor.discs:
        left_out = [
            name
            for name, value in (
                ("polar", polar and disc.polar_inertia > 0),
                ("diametral", diametral and disc.diametral_inertia > 0),
            )
            if value
        ]
        if not left_out:
            continue
        name = f" {disc.name!r}" if disc.name else ""
        what = "moments of inertia are" if polar and diametral else f"{left_out[0]} moment of inertia is"
        missing = [text for text, off in (("rotary inertia", diametral), ("gyroscopic effect", polar)) if off]
        warnings.append(
            f"disc{name} at node {disc.node}: its {what} ignored, the model has no {' and no '.join(missing)}"
        )
    return tuple(warnings)
