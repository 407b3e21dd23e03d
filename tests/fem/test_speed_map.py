import dataclasses
import math

import matplotlib as mpl
import numpy as np
import pytest
from cases import each_of
from fem_rotors import rotor23, uniform
from whirl_rotors import machine

import fem

mpl.use("Agg")


def test_a_rigid_rotor_follows_the_root_of_the_stiffness():
    rotor = fem.Rotor(
        np.full(4, 0.05), 0.2, discs=[fem.Disc(3, 50.0)], supports=[fem.Support(1, 1e5), fem.Support(5, 1e5)]
    )
    k = np.array([1e3, 1e4, 1e5])
    found = fem.speed_map(rotor, k, n=2)
    np.testing.assert_allclose(found.speeds[:, 0], np.sqrt(2 * k / rotor.total_mass), rtol=1e-4)
    np.testing.assert_allclose(found.free, 0.0)


def test_asymptotes_of_a_uniform_beam():
    rotor = uniform(24, supports=[fem.Support(1, 1e8), fem.Support(25, 1e8)])
    found = fem.speed_map(rotor, n=4)
    pinned = np.arange(1, 5) ** 2 * 1276.18775
    np.testing.assert_allclose(found.pinned, pinned, rtol=1e-4)
    np.testing.assert_allclose(found.free, [0, 0, 2892.9744, 7974.59535], rtol=1e-4)
    assert (np.diff(found.speeds, axis=0) > 0).all()
    np.testing.assert_allclose(found.speeds[-1], found.pinned, rtol=2e-2)
    assert (found.speeds <= found.pinned * (1 + 1e-9)).all()
    np.testing.assert_allclose(found.speeds[0, 2:], found.free[2:], rtol=2e-2)


def test_it_is_the_critical_speeds_at_each_stiffness():
    """Forward synchronous whirl of the same undamped rotor."""
    rotor = dataclasses.replace(machine(), supports=[fem.Support(s.node, 1e8) for s in machine().supports])
    found = fem.speed_map(rotor, [1e7, 1e8, 1e9], n=3)
    np.testing.assert_allclose(found.speeds[1], fem.critical_speeds(rotor, 3).frequencies, rtol=1e-12)


@each_of(
    ("rotor", "stiffness", "n", "message"),
    [
        (rotor23(), [1e8, 1e7], 2, "ascending"),
        (rotor23(), [-1.0, 1e7], 2, "above 0"),
        (rotor23(), [math.inf], 2, "finite"),
        (rotor23(), ["stiff"], 2, "could not convert"),
        (rotor23(), [1e8], 0, "cannot be found"),
        (uniform(5), [1e8], 2, "no support"),
    ],
)
def test_bad_input(rotor, stiffness, n, message):
    with pytest.raises(ValueError, match=message):
        fem.speed_map(rotor, stiffness, n)
