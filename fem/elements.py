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

from collections.abc import Sequence

import numpy as np

from fem.rotor import Rotor
from rotorid.base.arrays import AnyArray, FloatArray

__all__ = [
    "Layout",
    "bending_terms",
    "dense",
    "gyroscopic_terms",
    "mass_terms",
    "multiply",
    "strains",
]

_LENGTHS = np.array([0, 1, 1, 1, 0, 1])  # powers of L in the scaling
# End values (w₁, slope₁, w₂, slope₂) of the polynomial from the element's unknowns, and the polynomial
# 1, ξ, ξ², ξ³ on 0 … 1 from its end values.
_ENDS = np.array([[1, 0, 0, 0, 0, 0], [0, 1, 1, 0, 0, 0], [0, 0, 0, 0, 1, 0], [0, 0, 0, 1, 0, 1]])
_HERMITE = np.array([[1, 0, -3, 2], [0, 1, -2, 1], [0, 0, 3, -2], [0, 0, -1, 1]])


def _forms() -> list[FloatArray]:
    """∫(w'' − γ')², ∫γ², ∫w², ∫(w' − γ)² as 6 × 6 matrices: Gauss's rule of four points is exact."""
    points, weights = np.polynomial.legendre.leggauss(4)
    x, one, zero = (points + 1) / 2, np.ones(4), np.zeros(4)
    powers = [(one, x, x**2, x**3), (zero, one, 2 * x, 3 * x**2), (zero, zero, 2 * one, 6 * x)]
    w, slope, curvature = (_ENDS.T @ _HERMITE @ np.array(each) for each in powers)
    shear = np.array([zero, zero, 1 - x, x, zero, zero])
    change = np.array([zero, zero, -one, one, zero, zero])
    fields = (curvature - change, shear, w, slope - shear)
    return [np.round(420 * (field * weights / 2) @ field.T) / 420 for field in fields]


_BENDING, _SHEAR, _MASS, _TILT = _forms()


class Layout:
    """Where the unknowns of a rotor stand: `stride` per node, the last node has two."""

    def __init__(self, rotor: Rotor) -> None:
        self._unknowns = np.arange(6) if rotor.model.shear else np.array([0, 1, 4, 5])
        self.stride = self._unknowns.size - 2
        self.width = self._unknowns.size - 1  # entries above the diagonal
        self.size = self.stride * rotor.n_elements + 2
        scale = rotor.length ** _LENGTHS[self._unknowns, None]
        self._scales = scale[:, None] * scale

    def band(self, terms: Sequence[tuple[FloatArray, FloatArray]]) -> FloatArray:
        """Upper band of Σ over terms (factor per element, form), shape (width + 1, size)."""
        pick = np.ix_(self._unknowns, self._unknowns)
        elements = sum(form[pick][:, :, None] * factor for factor, form in terms) * self._scales
        band = np.zeros((self.width + 1, self.size), order="F")  # as LAPACK takes it without a copy
        for j in range(self.width + 1):
            columns = slice(j, j + self.stride * elements.shape[2], self.stride)
            band[self.width - j :, columns] += elements[: j + 1, j]
        return band


def bending_terms(rotor: Rotor) -> list[tuple[FloatArray, FloatArray]]:
    """Terms of the stiffness."""
    L = rotor.length
    terms = [(rotor.youngs_modulus * rotor.second_moment / L**3, _BENDING)]
    if rotor.model.shear:
        terms.append((rotor.shear_coefficient * rotor.shear_modulus * rotor.area / L, _SHEAR))
    return terms


def mass_terms(rotor: Rotor) -> list[tuple[FloatArray, FloatArray]]:
    """Terms of the mass."""
    terms = [(rotor.density * rotor.area * rotor.length, _MASS)]
    if rotor.model.rotary_inertia:
        terms.append((rotor.density * rotor.second_moment / rotor.length, _TILT))
    return terms


def gyroscopic_terms(rotor: Rotor) -> list[tuple[FloatArray, FloatArray]]:
    """Terms of the gyroscopic matrix; none unless the model has it."""
    if not rotor.model.gyroscopic:
        return []
    return [(2 * rotor.density * rotor.second_moment / rotor.length, _TILT)]


def strains(rotor: Rotor, X: FloatArray) -> FloatArray:
    """Strains S(X) of the shaft with Xᵀ K X = S(X)ᵀ S(X), shape (k, n elements, m) for X of shape (size, m).

    With a, b the end slopes of an element against its chord and γ its shear angles, the bending energy is
    E I ((b − a − Δγ)² + 3 (a + b)²) / L and the shear energy κ G A L ((γₐ + γ_b)² / 4 + Δγ² / 12), a and b
    being tilts in the first bracket: the slopes of the line are tilt + γ. Rounding costs about (number of
    elements)² of what a product with K costs.
    """
    stride = 4 if rotor.model.shear else 2
    L = rotor.length[:, None]
    w, tilt = X[0::stride], X[1::stride]
    chord = np.diff(w, axis=0) / L
    a, b = tilt[:-1] - chord, tilt[1:] - chord
    bending = np.sqrt(rotor.youngs_modulus * rotor.second_moment / rotor.length)[:, None]
    if not rotor.model.shear:
        return np.stack((bending * (b - a), np.sqrt(3.0) * bending * (a + b)))
    left, right = X[2::stride], X[3::stride]
    shear = np.sqrt(rotor.shear_coefficient * rotor.shear_modulus * rotor.area * rotor.length)[:, None]
    return np.stack(
        (
            bending * (b - a),
            np.sqrt(3.0) * bending * (a + b + left + right),
            shear * (left + right) / 2,
            shear * (right - left) / np.sqrt(12.0),
        )
    )


def multiply(band: AnyArray, X: AnyArray) -> AnyArray:
    """Product of a symmetric or Hermitian band with vectors, shape (size, m)."""
    from scipy.linalg import blas

    kind = np.result_type(band, X)
    product = blas.dsbmv if kind.kind == "f" else blas.zhbmv
    band = np.asarray(band, kind, order="F")
    columns = [product(len(band) - 1, 1.0, band, column) for column in X.T.astype(kind)]
    return np.reshape(columns, X.T.shape).T


def dense(band: AnyArray) -> AnyArray:
    """Full symmetric or Hermitian matrix of a band, shape (size, size)."""
    size = band.shape[1]
    A = np.zeros((size, size), band.dtype)
    flat = A.reshape(-1)
    for above in range(min(len(band), size)):
        entries = band[-1 - above, above:]
        flat[above * size :: size + 1] = entries.conj()
        flat[above : (size - above) * size : size + 1] = entries
    return A
