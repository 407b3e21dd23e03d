import dataclasses
import math

import numpy as np
import pytest
from dense_rotor import whirl as dense_whirl
from fem_rotors import machines, rotor23, uniform
from hypothesis import given, settings
from hypothesis import strategies as st
from whirl_rotors import FULL, machine

import fem


def test_what_does_no_work_is_not_in_the_decay():
    """Undamped, not even by rounding; with 1e-10 s of material damping the mode grows above its frequency."""
    rotor = machine(cross=False)
    springs = [fem.Support(s.node, ((1e8, 0.0), (0.0, 1.6e8))) for s in rotor.supports]
    rotor = dataclasses.replace(rotor, supports=springs)
    np.testing.assert_array_equal(fem.whirl_modes(rotor, 700.0).log_decrements, 0.0)
    beta = 1e-10
    damped = fem.whirl_modes(dataclasses.replace(rotor, material_damping=beta), 0.0, 2)
    whole = dataclasses.replace(rotor, material_damping=1e4 * beta)
    assert damped.log_decrements * 1e4 == pytest.approx(
        fem.whirl_modes(whole, 0.0, 2).log_decrements, rel=1e-6
    )


@settings(max_examples=10, deadline=None)
@given(machines(elements=(3, 12)), st.floats(0.0, 1000.0))
def test_the_dense_solver_of_the_tests_agrees(rotor, speed):
    rotor = dataclasses.replace(rotor, model=dataclasses.replace(rotor.model, shear=False))
    found = fem.whirl_modes(rotor, speed, 6)
    values, X, Y = dense_whirl(rotor, speed)
    for k, lam in enumerate(found.eigenvalues):
        i = int(np.argmin(np.abs(values - lam)))
        assert abs(values[i] - lam) < 2e-7 * abs(lam)
        gap = np.sort(np.abs(values - lam))[1] / abs(lam)
        if gap < 1e-3:
            continue
        a = np.concatenate((found.x[:, k], found.y[:, k]))
        b = np.concatenate((X[i], Y[i]))
        alike = abs(np.vdot(a, b)) ** 2 / (np.vdot(a, a).real * np.vdot(b, b).real)
        assert alike > 1 - 1e-5


def test_rigid_disc_on_a_light_overhang():
    """Disc at the end of a massless cantilever: (k11 − m ω²)(k22 + Ip Ω ω − Id ω²) = k12²."""
    L, d, E = 0.5, 0.03, 2.1e11
    m, Ip, Id, speed = 8.0, 0.09, 0.05, 400.0
    EI = E * math.pi / 64 * d**4
    k11, k12, k22 = 12 * EI / L**3, -6 * EI / L**2, 4 * EI / L
    # Forward and backward whirl are the roots of one polynomial in ω, positive and negative.
    roots = np.roots([m * Id, -m * Ip * speed, -(k11 * Id + m * k22), k11 * Ip * speed, k11 * k22 - k12**2])
    rotor = fem.Rotor(
        [L],
        d,
        density=1e-12,
        discs=[fem.Disc(2, m, Ip, Id)],
        supports=[fem.Support(1, 1e14, tilting_stiffness=1e13)],
        model=FULL,
    )
    found = fem.whirl_modes(rotor, speed, 4)
    signed = found.frequencies * found.direction
    np.testing.assert_allclose(np.sort(signed), np.sort(roots.real), rtol=1e-7)


def test_directions_of_a_symmetric_rotor():
    rotor = dataclasses.replace(
        machine(), supports=[fem.Support(s.node, 1e8, 1e4) for s in machine().supports]
    )
    found = fem.whirl_modes(rotor, 500.0, 8)
    np.testing.assert_array_equal(found.direction, [-1, 1] * 4)
    # Circles: y lags x by a quarter turn forward, leads it backward.
    np.testing.assert_allclose(found.y, -1j * found.direction * found.x, atol=1e-12)
    assert found.to_dict()["direction"][:2] == ["backward", "forward"]


def test_a_free_rotor():
    found = fem.whirl_modes(uniform(20), 100.0, 4)
    free = np.array([4.730040744862704, 7.853204624095838]) ** 2 * math.sqrt(2.1e11 * 0.1**2 / 16 / 7850.0)
    np.testing.assert_allclose(found.frequencies, np.repeat(free, 2), rtol=1e-4)
    assert "rigid-body motions" in found.warnings[0]


def test_overdamped_motions_are_said():
    rotor = fem.Rotor(
        [0.1, 0.1],
        0.1,
        density=1e-9,
        discs=[fem.Disc(2, 10.0)],
        supports=[fem.Support(1, 1e5, 2e3), fem.Support(3, 1e5, 2e3)],
    )
    with pytest.raises(ValueError, match="no oscillating mode"):
        fem.whirl_modes(rotor, 10.0, 1)
    with pytest.raises(ValueError, match="no oscillating mode"):
        fem.campbell(rotor, [10.0], 1)


def test_a_rotor_that_runs_away_is_told():
    rotor = dataclasses.replace(rotor23(), supports=[*rotor23().supports, fem.Support(12, -1e9, kind="seal")])
    found = fem.whirl_modes(rotor, 10.0, 2)
    assert any("runs away" in text for text in found.warnings)
    assert found.real.max() > 0


@pytest.mark.parametrize(
    ("speed", "n", "message"),
    [
        (-1.0, 2, "not negative"),
        ("fast", 2, "numbers in rad/s"),
        (10.0, 1000, "1 to 96"),
        (600.0, 2, "front.*100 to 500 rad/s, not 600"),
    ],
)
def test_bad_input(speed, n, message):
    table = fem.Support(2, [1e8, 2e8], 1e3, speeds=(100, 500), name="front")
    rotor = dataclasses.replace(rotor23(), supports=[table] if speed == 600 else rotor23().supports)
    with pytest.raises(ValueError, match=message):
        fem.whirl_modes(rotor, speed, n)
