"""Beam elements: energies of one element as quadratic forms of its unknowns, and their assembly into bands.

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
bending part, which is kept. Both rates are checked in tests/fem/matrices/test_elements.py.

In the scaled unknowns (w₁, L θ₁, L γₐ, L γ_b, w₂, L θ₂) the forms are numbers, the same for all elements,
all of them multiples of 1/420.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from fem.model.rotor import Rotor
from rotorid.base.arrays import FloatArray

# Hermite polynomials on 0 … 1 in (w₁, s₁, w₂, s₂): ∫w''², 30 ∫w'², 420 ∫w², ∫w'(1 − ξ) and ∫w'ξ times 12.
_CURVATURE = np.array([[12, 6, -12, 6], [6, 4, -6, 2], [-12, -6, 12, -6], [6, 2, -6, 4]])
_SLOPE = np.array([[36, 3, -36, 3], [3, 4, -3, -1], [-36, -3, 36, -3], [3, -1, -3, 4]])
_DEFLECTION = np.array([[156, 22, 54, -13], [22, 4, 13, -3], [54, 13, 156, -22], [-13, -3, -22, 4]])
_SLOPE_LEFT, _SLOPE_RIGHT = np.array([-6, 1, 6, -1]), np.array([-6, -1, 6, 1])
# End values of the polynomial from the element's unknowns: slopes are θ + γ.
_ENDS = np.array([[1, 0, 0, 0, 0, 0], [0, 1, 1, 0, 0, 0], [0, 0, 0, 0, 1, 0], [0, 0, 0, 1, 0, 1]])
_POWER = np.array([0, 1, 1, 1, 0, 1])  # of L in the scaling


def _forms() -> tuple[FloatArray, FloatArray, FloatArray, FloatArray]:
    """∫(w'' − γ')², ∫γ², ∫w², ∫(w' − γ)² as symmetric 6 × 6 matrices; whole numbers until the last step."""
    s = _ENDS[3] - _ENDS[1]  # ∫w''
    a, b = np.eye(6, dtype=int)[2], np.eye(6, dtype=int)[3]
    d = b - a
    bending = _ENDS.T @ _CURVATURE @ _ENDS - np.outer(s, d) - np.outer(d, s) + np.outer(d, d)
    shear = 2 * np.outer(a, a) + np.outer(a, b) + np.outer(b, a) + 2 * np.outer(b, b)  # 6 ∫γ²
    cross = np.outer(_SLOPE_LEFT @ _ENDS, a) + np.outer(_SLOPE_RIGHT @ _ENDS, b)  # 12 ∫w'γ
    tilt = 2 * _ENDS.T @ _SLOPE @ _ENDS - 5 * (cross + cross.T) + 10 * shear  # 60 ∫(w' − γ)²
    mass = _ENDS.T @ _DEFLECTION @ _ENDS
    return bending.astype(float), shear / 6.0, mass / 420.0, tilt / 60.0


_BENDING, _SHEAR, _MASS, _TILT = _forms()


class Layout:
    """Where the unknowns of a rotor stand: `stride` per node, the last node has two."""

    def __init__(self, rotor: Rotor) -> None:
        self.stride = 4 if rotor.model.shear else 2
        self.width = 5 if rotor.model.shear else 3  # entries above the diagonal
        self.size = self.stride * rotor.n_elements + 2
        self._pick = np.arange(6) if rotor.model.shear else np.array([0, 1, 4, 5])
        row, column = np.indices((self.width + 1, self.width + 1))
        # Entry (band row, column) of an element: row i of the form = band + column − width.
        index = row + column - self.width
        self._upper = index >= 0
        self._row, self._column = self._pick[np.maximum(index, 0)], self._pick[column]
        power = _POWER[self._row] + _POWER[self._column]
        self._powers = np.array([np.where(self._upper & (power == k), 1.0, 0.0).T for k in range(3)])
        L = rotor.length
        self._lengths = np.stack((np.ones_like(L), L, L * L), axis=1)

    def band(self, terms: Sequence[tuple[FloatArray, FloatArray]]) -> FloatArray:
        """Upper band of Σ over terms (factor per element, form), shape (width + 1, size)."""
        n, s, square = len(self._lengths), self.stride, (self.width + 1) ** 2
        flat = np.zeros((n, square))  # columns of the element, band row by row
        for factor, form in terms:
            picked = self._powers * form[self._row, self._column].T
            flat += (factor[:, None] * self._lengths) @ picked.reshape(3, square)
        element = flat.reshape(n, self.width + 1, self.width + 1)
        band = np.zeros((n + 1, s, self.width + 1))
        band[:-1] = element[:, :s]
        band[1:, :2] += element[:, s:]
        # The transpose of a C array: what LAPACK wants without a copy.
        return band.reshape(-1, self.width + 1)[: self.size].T


def bending_terms(rotor: Rotor) -> list[tuple[FloatArray, FloatArray]]:
    """Terms of the stiffness."""
    L = rotor.length
    terms = [(rotor.youngs_modulus * rotor.second_moment / (L * L * L), _BENDING)]
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
    """Terms of the gyroscopic matrix."""
    return [(2 * rotor.density * rotor.second_moment / rotor.length, _TILT)]
