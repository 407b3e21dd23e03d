"""Beam elements: energies of one element as quadratic forms of its unknowns, their bands, and their strains.

Unknowns of an element are (w₁, θ₁, γₐ, γ_b, w₂, θ₂): deflection w and tilt θ of the cross-section at both
ends, and the shear angle γ at the left and right end of the element. w is the cubic (Hermite) polynomial
with end slopes θ + γ, γ is linear, and the tilt in between is θ = w' − γ. With γ = 0 this is the
Euler–Bernoulli element, unknowns (w₁, θ₁, w₂, θ₂): there is no locking. γ belongs to its element alone and
jumps at nodes, as it does in truth at a point load and where sections change.

Energies (twice): bending E I ∫(w'' − γ')², shear κ G A ∫γ², mass ρ A ∫ẇ², tilting ρ I ∫θ̇², and the
gyroscopic form 2 ρ I ∫θ².

Why the unknowns γ: the usual two-node element of the peers (Przemieniecki's, shear parameter
Φ = 12 E I / (κ G A L²)) ties the shear angle to the third derivative of its cubic, so that γ is constant in
the element. That is right at rest, where κ G A γ = Q is constant between loads; in vibration the inertia
of the shaft makes Q vary linearly in an element to first order, γ is wrong by O(h), its energy by O(h²), and
so are the frequencies. A linear γ leaves an error O(h²) in γ, O(h⁴) in energy and frequency: the rate of the
bending part, which is kept and checked in tests/fem/test_elements.py.

In the scaled unknowns (w₁, L θ₁, L γₐ, L γ_b, w₂, L θ₂) the forms are numbers, the same for all elements,
all of them multiples of 1/420.
"""

from __future__ import annotations

import math

import numpy as np

from fem.rotor import Rotor
from rotorid.base.arrays import AnyArray, FloatArray, IndexArray

DENSE = 64  # unknowns up to which a full matrix costs less than its band, and all modes less than the lowest
_LENGTHS = np.array([0, 1, 1, 1, 0, 1])  # powers of L in the scaling
_HERMITE = np.array([[1, 0, -3, 2], [0, 1, -2, 1], [0, 0, 3, -2], [0, 0, -1, 1]])
"""Coefficients of 1, ξ, ξ², ξ³ on 0 … 1 of the polynomials of w₁, slope₁, w₂, slope₂."""


def _forms(unknowns: list[int]) -> tuple[IndexArray, list[FloatArray]]:
    """Unknowns, and ∫(w'' − γ')², ∫γ², ∫w², ∫(w' − γ)² as matrices of these."""
    derivative, powers = np.diag([1, 2, 3], 1), np.arange(4)
    w, gamma = _HERMITE[[0, 1, 1, 3, 2, 3]].T, np.zeros((4, 6))
    gamma[:2, 2:4] = [[1, 0], [-1, 1]]
    tilt = derivative @ w - gamma
    integrals = 1 / (powers[:, None] + powers + 1)
    shapes = [shape[:, unknowns] for shape in (derivative @ tilt, gamma, w, tilt)]
    return np.array(unknowns), [np.round(420 * f.T @ integrals @ f) / 420 for f in shapes]


_BENDING, _SHEAR = _forms([0, 1, 4, 5]), _forms([0, 1, 2, 3, 4, 5])


def shaft_bands(rotor: Rotor) -> FloatArray:
    """Upper bands of stiffness, mass, gyroscopic form and material damping, shape (4, width + 1, size)."""
    model, L, outer = rotor.model, rotor.length, np.multiply.outer
    unknowns, (bending, shear, inertia, tilt) = _SHEAR if model.shear else _BENDING
    scale = np.where(_LENGTHS[unknowns, None], L, 1.0)
    stiffness = outer(bending, rotor.youngs_modulus * rotor.second_moment / L**3)
    if model.shear:
        stiffness += outer(shear, rotor.shear_coefficient * rotor.shear_modulus * rotor.area / L)
    mass = outer(inertia, rotor.density * rotor.area * L)
    tilting = outer(tilt, rotor.density * rotor.second_moment / L)
    mass += model.rotary_inertia * tilting
    turning, damping = 2 * model.gyroscopic * tilting, rotor.material_damping * stiffness
    forms = np.array((stiffness, mass, turning, damping)) * (scale * scale[:, None])
    stride, width = unknowns.size - 2, unknowns.size - 1
    # Each as LAPACK takes it without a copy.
    bands = np.zeros((4, stride * L.size + 2, width + 1)).transpose(0, 2, 1)
    for j in range(width + 1):
        bands[:, width - j :, j : j + stride * L.size : stride] += forms[:, : j + 1, j]
    return bands


def strains(rotor: Rotor, X: FloatArray) -> FloatArray:
    """Strains S(X) of the shaft with Xᵀ K X = S(X)ᵀ S(X), shape (k, n elements, m) for X of shape (size, m).

    With a, b the end slopes of an element against its chord and γ its shear angles, the bending energy is
    E I ((b − a − Δγ)² + 3 (a + b)²) / L and the shear energy κ G A L ((γₐ + γ_b)² / 4 + Δγ² / 12), a and b
    being tilts in the first bracket: the slopes of the line are tilt + γ. Rounding costs about (number of
    elements)² of what a product with K costs.
    """
    stride = 4 if rotor.model.shear else 2
    w, tilt, *shear = (X[i::stride] for i in range(stride))
    chord = (w[1:] - w[:-1]) / rotor.length[:, None]
    bending = np.sqrt(rotor.youngs_modulus * rotor.second_moment / rotor.length)[:, None]
    left, right = tilt[:-1], tilt[1:]
    parts = [
        bending * (right - left),
        math.sqrt(3.0) * bending * ((left - chord) + (right - chord) + sum(shear)),
    ]
    if shear:
        left, right = shear
        stiff = np.sqrt(rotor.shear_coefficient * rotor.shear_modulus * rotor.area * rotor.length)[:, None]
        parts += [stiff * (left + right) / 2, stiff * (right - left) / math.sqrt(12.0)]
    return np.array(parts)


def multiply(band: AnyArray, X: AnyArray) -> AnyArray:
    """Product of a symmetric or Hermitian band with vectors, shape (size, m)."""
    if band.shape[1] <= DENSE:
        return dense(band) @ X
    product = band[-1, :, None] * X
    for off in range(1, len(band)):
        entries = band[-1 - off, off:, None]
        product[:-off] += entries * X[off:]
        product[off:] += entries.conj() * X[:-off]
    return product


def dense(band: AnyArray) -> AnyArray:
    """Full symmetric or Hermitian matrix of a band, shape (size, size)."""
    size = band.shape[1]
    A = np.zeros(size * size, band.dtype)
    for off in range(len(band)):
        A[off * size :: size + 1] = entries = band[-1 - off, off:]
        A[off : (size - off) * size : size + 1] = entries.conj()
    return A.reshape(size, size).T
