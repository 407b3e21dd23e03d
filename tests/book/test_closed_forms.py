"""Closed forms of what no printed number tells: signs of seals and of damping, several speeds."""

import math

import numpy as np
import pytest

import fem
from rotorid.reduction import equivalent_masses, natural_frequencies

MASS, BETA, SPEED = 20.0, 2e-5, 300.0
BENDING = 48 * 2.1e11 * math.pi * 0.05**4 / 64


def disc_on_supports(stiffness, damping):
    """A disc amid a massless shaft of 1 m with material damping, on two equal supports."""
    return fem.Rotor(
        np.array([0.5, 0.5]),
        np.array([0.05]),
        density=np.array(0.0),
        material_damping=np.array(BETA),
        discs=[fem.Disc(2, MASS)],
        supports=[fem.Support(node, stiffness, damping) for node in (1, 3)],
    )


# a seal on masses


K, SEAL = 2e6, 1.5e6
ALPHA = np.array([[3, 2, 1], [2, 4, 2], [1, 2, 3]]) / (4 * K)
ROOTS = [(4 * K + SEAL + way * math.sqrt(SEAL**2 + 8 * K**2)) / (2 * MASS) for way in (-1, 1)]
SQUARES = np.array([ROOTS[0], 2 * K / MASS, ROOTS[1]])
SHAPES = np.array([[1, 2 - MASS * ROOTS[0] / K, 1], [1, 0, -1], [1, 2 - MASS * ROOTS[1] / K, 1]]).T
"""Three masses on a string of four springs, the middle one on a seal, too."""


def test_masses_by_50_with_a_seal():
    found = equivalent_masses(ALPHA, np.sqrt(SQUARES[:2]), SHAPES[:, :2], seal_stiffness=[0, SEAL, 0])
    np.testing.assert_allclose(found.values, MASS, rtol=1e-9)


def test_natural_frequencies_and_shapes_with_a_seal():
    omega, shapes = natural_frequencies(ALPHA, [MASS] * 3, seal_stiffness=[0, SEAL, 0])
    np.testing.assert_allclose(omega**2, SQUARES, rtol=1e-9)
    np.testing.assert_allclose(shapes / shapes[0], SHAPES, rtol=1e-9, atol=1e-9)


# damping and seals under a turning shaft


DIRECT, CROSS, DAMPING, TURNING = 1e6, 3e5, 800.0, 400.0


@pytest.mark.parametrize(("cross", "turning"), [(0.0, 0.0), (CROSS, 0.0), (0.0, TURNING), (-CROSS, TURNING)])
def test_whirl_on_damped_supports_and_seals(cross, turning):
    """m s² + shaft and supports in series; in x + iy a force q y in x and −q x in y is a stiffness −i q."""
    support = np.poly1d([2 * (DAMPING - 1j * turning), 2 * (DIRECT - 1j * cross)])
    own = np.poly1d([BETA, 1 - 1j * BETA * SPEED]) * BENDING
    s = (np.poly1d([MASS, 0, 0]) * (own + support) + own * support).roots
    backward, forward = sorted(s[np.argsort(np.abs(s.real))][:2], key=lambda root: root.imag)
    rotor = disc_on_supports(((DIRECT, cross), (-cross, DIRECT)), ((DAMPING, turning), (-turning, DAMPING)))
    modes = fem.whirl_modes(rotor, SPEED, 2)
    found = modes.eigenvalues[np.argsort(modes.direction)]
    np.testing.assert_allclose(found, [backward.conjugate(), forward], rtol=1e-8)
