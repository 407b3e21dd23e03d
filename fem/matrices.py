"""Stiffness and mass of a rotor: Euler–Bernoulli beam elements, assembled into bands.

Two unknowns per node, the deflection w (m) and the slope θ = dw/dx (rad), in the order w₁, θ₁, w₂, θ₂, …;
elements are cubic (Hermite) with consistent mass, without shear, rotary inertia or gyroscopic effect, as
[S] task 9.1 needs. An isotropic rotor turns these into complex unknowns of z = x + i y with the same real
matrices.

Symmetric bands are kept as LAPACK does, upper form: `band[3 + i - j, j]` is entry (i, j) for i ≤ j.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from fem.rotor import FloatArray, Rotor

WIDTH = 3  # entries above the diagonal: four unknowns per element

# Upper triangle of the element matrices: row, column, factor of E I / L³, factor of ρ A L / 420, power of L.
_ELEMENT = (
    (0, 0, 12.0, 156.0, 0),
    (0, 1, 6.0, 22.0, 1),
    (0, 2, -12.0, 54.0, 0),
    (0, 3, 6.0, -13.0, 1),
    (1, 1, 4.0, 4.0, 2),
    (1, 2, -6.0, 13.0, 1),
    (1, 3, 2.0, -3.0, 2),
    (2, 2, 12.0, 156.0, 0),
    (2, 3, -6.0, -22.0, 1),
    (3, 3, 4.0, 4.0, 2),
)


@dataclass(frozen=True, eq=False)
class Matrices:
    """The assembled rotor.

    Attributes
    ----------
    stiffness, mass
        Upper bands, shape (4, 2 N) for N nodes; supports and discs included.
    damped
        Unknowns (from 0) on which support damping acts, shape (d,).
    damping
        Its coefficients, N·s/m, shape (d,).
    rigid
        Number of rigid-body motions that no support stiffness resists: 0, 1 or 2.
    """

    stiffness: FloatArray
    mass: FloatArray
    damped: NDArray[np.intp]
    damping: FloatArray
    rigid: int

    @property
    def size(self) -> int:
        """Number of unknowns, twice the number of nodes."""
        return int(self.stiffness.shape[1])


def assemble(rotor: Rotor) -> Matrices:
    """Stiffness, mass and damping of a rotor, assembled without a loop over elements."""
    n = rotor.n_elements
    L = rotor.length
    powers = (np.ones(n), L, L * L)
    bending = rotor.youngs_modulus * rotor.second_moment / (L * L * L)
    inertia = rotor.density * rotor.area * L / 420.0
    K = np.zeros((WIDTH + 1, 2 * n + 2))
    M = np.zeros((WIDTH + 1, 2 * n + 2))
    for row, column, k, m, power in _ELEMENT:
        band = WIDTH + row - column
        K[band, column : column + 2 * n : 2] += k * bending * powers[power]
        M[band, column : column + 2 * n : 2] += m * inertia * powers[power]
    for disc in rotor.discs:
        M[WIDTH, 2 * (disc.node - 1)] += disc.mass
    damping: dict[int, float] = {}
    for support in rotor.supports:
        unknown = 2 * (support.node - 1)
        K[WIDTH, unknown] += support.stiffness
        if support.damping > 0:
            damping[unknown] = damping.get(unknown, 0.0) + support.damping
    held = {support.node for support in rotor.supports if support.stiffness > 0}
    return Matrices(
        K, M, np.array(list(damping), dtype=np.intp), np.array(list(damping.values())), max(0, 2 - len(held))
    )


def multiply(band: FloatArray, X: FloatArray) -> FloatArray:
    """Product of a symmetric band with vectors, shape (2 N, m)."""
    Y = band[WIDTH, :, None] * X
    for above in range(1, WIDTH + 1):
        entries = band[WIDTH - above, above:, None]
        Y[:-above] += entries * X[above:]
        Y[above:] += entries * X[:-above]
    return Y


def dense(band: FloatArray) -> FloatArray:
    """Full symmetric matrix of a band, shape (2 N, 2 N), in Fortran order."""
    size = band.shape[1]
    A = np.zeros((size, size))
    flat = A.reshape(-1)
    for above in range(WIDTH + 1):
        entries = band[WIDTH - above, above:]
        flat[above : (size - above) * size : size + 1] = entries
        flat[above * size :: size + 1] = entries
    return A.T


def general(band: FloatArray) -> FloatArray:
    """The same matrix in LAPACK's general band form with room for pivoting, shape (10, 2 N)."""
    A = np.zeros((3 * WIDTH + 1, band.shape[1]))
    A[2 * WIDTH] = band[WIDTH]
    for above in range(1, WIDTH + 1):
        A[2 * WIDTH - above] = band[WIDTH - above]
        A[2 * WIDTH + above, :-above] = band[WIDTH - above, above:]
    return A


def strain_energy(rotor: Rotor, X: FloatArray) -> FloatArray:
    """Twice the potential energy xᵀ K x of shaft and supports for each column of X, N·m, shape (m,).

    The shaft's part is summed from the end rotations of each element against its chord, which loses
    rounding of the order (number of elements)² instead of the fourth power that xᵀ K x itself loses.
    """
    L = rotor.length[:, None]
    w, slope = X[0::2], X[1::2]
    chord = np.diff(w, axis=0) / L
    a, b = slope[:-1] - chord, slope[1:] - chord
    stiffness = 4 * rotor.youngs_modulus * rotor.second_moment / rotor.length
    energy = stiffness @ (a * a + a * b + b * b)
    for support in rotor.supports:
        energy = energy + support.stiffness * w[support.node - 1] ** 2
    return np.asarray(energy)


def rounding_error(band: FloatArray, X: FloatArray) -> FloatArray:
    """Relative error of xᵀ K x that rounding the entries of K may cause, for each column of X, shape (m,).

    It grows with the fourth power of the number of elements: about 1e-13 at 20, 1e-5 at 2000. Solutions
    of K x = f are wrong by as much.
    """
    energy = np.abs(np.einsum("ij,ij->j", X, multiply(band, X)))
    size = np.abs(X)
    scatter = np.einsum("ij,ij->j", size, multiply(np.abs(band), size))
    with np.errstate(divide="ignore", invalid="ignore"):
        return np.asarray(np.where(scatter > 0, np.finfo(float).eps * scatter / energy, 0.0))


def ignored_inertia(rotor: Rotor) -> tuple[str, ...]:
    """One warning for each disc whose moments of inertia this model leaves out."""
    return tuple(
        f"disc{f' {disc.name!r}' if disc.name else ''} at node {disc.node}: its moments of inertia are "
        "ignored, the model has no rotary inertia and no gyroscopic effect"
        for disc in rotor.discs
        if disc.polar_inertia > 0 or disc.diametral_inertia > 0
    )
