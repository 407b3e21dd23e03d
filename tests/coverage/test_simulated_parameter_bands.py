"""Bands of amplitudes beside the scatter of drawn rotors."""

from dataclasses import replace

import numpy as np
import pytest
from repetitions import FULL

import fem
from fem.parameters import spread

NAMES = ("bearing[1].kxx", "bearing[2].stiffness.scale", "material.youngs_modulus", "disc[wheel].mass")


VALUES = np.array([4e7, 1.0, 2.1e11, 60.0])


RELATIVE = np.array([[0.03, 0, 0, 0], [-0.02, 0.03, 0, 0], [0.01, 0.005, 0.01, 0], [0, 0, 0.01, 0.02]])


A = RELATIVE * VALUES[:, None]


DRAWS = 800 if FULL else 300


WITHIN = 4 / np.sqrt(2 * DRAWS)  # four standard errors of a standard deviation


def built(values):
    k, scale, modulus, mass = values
    return fem.Rotor(
        [0.15] * 8,
        0.08,
        youngs_modulus=modulus,
        discs=[fem.Disc(4, mass, 1.0, 0.6, "wheel"), fem.Disc(7, 30.0)],
        supports=[
            fem.Support(1, ((k, 0.0), (0.0, 3e7)), 4e3),
            fem.Support(9, ((5e7 * scale, 5e6 * scale), (-5e6 * scale, 5e7 * scale)), 4e3),
        ],
        model=fem.Model(rotary_inertia=True, gyroscopic=True),
    )


ROTOR = replace(built(VALUES), calibration=fem.Calibration(NAMES, VALUES, A @ A.T))


@pytest.fixture(scope="module")
def drawn():
    rng = np.random.default_rng(7)
    return [built(VALUES + A @ rng.normal(size=4)) for _ in range(DRAWS)]


def amplitudes(rotor, speeds):
    return np.abs(fem.unbalance_response(rotor, {4: 1e-3}, speeds).readings([1, (4, 30.0)]))


def test_amplitudes_scatter_as_the_band_says_beside_and_above_the_resonances(drawn):
    speeds = np.array([100.0, 150.0, 500.0, 600.0])
    scatter = np.std([amplitudes(rotor, speeds) for rotor in drawn], axis=0)
    np.testing.assert_allclose(
        spread(ROTOR, lambda rotor: amplitudes(rotor, speeds)), scatter, rtol=1.3 * WITHIN
    )
