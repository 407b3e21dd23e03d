import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

import fem

amplitudes = st.complex_numbers(max_magnitude=1e3, allow_nan=False, allow_infinity=False)


@given(amplitudes, amplitudes)
def test_axes_are_those_of_the_traced_curve(x, y):
    found = fem.orbits(x, y)
    t = np.linspace(0, 2 * np.pi, 4001)
    radius = np.abs(np.real(x * np.exp(1j * t)) + 1j * np.real(y * np.exp(1j * t)))
    size = max(float(radius.max()), 1e-300)
    assert abs(found.major - radius.max()) <= 1e-5 * size
    assert abs(found.minor - radius.min()) <= 2e-3 * size


@given(amplitudes, amplitudes)
def test_the_shaft_is_farthest_out_at_inclination_and_phase(x, y):
    found = fem.orbits(x, y)
    at = np.exp(-1j * found.phase)
    z = np.real(x * at) + 1j * np.real(y * at)
    expected = found.major * np.exp(1j * found.inclination)
    assert abs(z - expected) <= 1e-6 * max(abs(x), abs(y), 1e-300) or found.major < 1e-300
    assert -math.pi / 2 < found.inclination <= math.pi / 2
    # A probe along the major axis reads it, one across it the minor axis, a quarter turn later forward.
    along = fem.probe(x, y, found.inclination)
    across = fem.probe(x, y, found.inclination + np.pi / 2)
    scale = max(abs(x), abs(y), 1e-300)
    assert abs(abs(along) - found.major) <= 1e-6 * scale
    assert abs(abs(across) - found.minor) <= 1e-6 * scale
    if found.minor > 1e-3 * found.major:
        lag = np.angle(along / across)
        assert math.isclose(lag, found.direction * np.pi / 2, abs_tol=1e-6)


def test_known_ellipses():
    x, y = np.array([3.0, 1.0, 2j, 1.0, 0.0]), np.array([-2j, 1j, 1.0, 1.0, 5.0])
    found = fem.orbits(x, y)
    np.testing.assert_allclose(found.major, [3, 1, 2, math.sqrt(2), 5])
    np.testing.assert_allclose(found.minor, [2, 1, 1, 0, 0], atol=1e-15)
    np.testing.assert_allclose(found.inclination, [0, 0, 0, math.pi / 4, math.pi / 2])
    np.testing.assert_array_equal(found.direction, [1, -1, 1, 0, 0])
    np.testing.assert_allclose(found.phase, [0, 0, math.pi / 2, 0, 0], atol=1e-15)


def test_turning_the_axes_turns_the_inclination():
    x, y, angle = 3.0 + 1j, 0.5 - 2j, 0.4
    found, turned = fem.orbits(x, y), fem.orbits(*(fem.probe(x, y, angle + a) for a in (0, np.pi / 2)))
    assert turned.inclination == pytest.approx(float(found.inclination - angle), abs=1e-12)
    assert turned.major == pytest.approx(float(found.major))
    assert turned.direction == found.direction


def test_direction_of_whole_modes():
    circle = np.ones(3)
    assert fem.whirl_direction(circle, -1j * circle) == 1
    assert fem.whirl_direction(circle, 1j * circle) == -1
    assert fem.whirl_direction(circle, -1j * np.array([1, 1, -0.5])) == 0
    assert fem.whirl_direction(circle, -1j * np.array([1, 1, -0.001])) == 1
    assert fem.whirl_direction(circle, 2 * circle) == 0
    many = fem.whirl_direction(np.ones((2, 4, 3)), np.full((2, 4, 3), -1j))
    np.testing.assert_array_equal(many, np.ones((2, 4)))
