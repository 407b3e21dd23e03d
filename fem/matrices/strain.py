"""Generalised strains of the elements, so that stiffness is a sum of squares that keeps its digits."""

from __future__ import annotations

import numpy as np

from fem.model.rotor import Rotor
from rotorid.base.arrays import FloatArray


def strains(rotor: Rotor, X: FloatArray) -> FloatArray:
    """Strains S(X) of the shaft with Xᵀ K X = S(X)ᵀ S(X), shape (k, n elements, m) for X of shape (size, m).

    With a, b the end slopes of an element against its chord and γ its shear angles, the bending energy is
    E I ((b − a − Δγ)² + 3 (a + b)²) / L and the shear energy κ G A L ((γₐ + γ_b)² / 4 + Δγ² / 12). Rounding
    costs about (number of elements)² of what a product with K costs.
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
    # The tilts are those of the sections: the slopes of the line are tilt + γ, their change b − a − Δγ.
    return np.stack(
        (
            bending * (b - a),
            np.sqrt(3.0) * bending * (a + b + left + right),
            shear * (left + right) / 2,
            shear * (right - left) / np.sqrt(12.0),
        )
    )
