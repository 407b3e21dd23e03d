"""Coefficients at the equilibrium, the linear rotor made of them, and its threshold."""

import dataclasses
import re

import numpy as np
import pytest
from scipy.optimize import approx_fprime, brentq

import fem
from fem import CubicSpring, InternalDamping, JournalBearing, MuszynskaSeal, SqueezeFilm, Stop
from rotorid.motion.equilibrium import equilibria, equilibrium
from rotorid.motion.linear_coefficients import coefficients, linear_rotor, threshold
from rotorid.motion.system import rotor_system, system

RPM = np.pi / 30
BEARING = {"length": 0.03, "diameter": 0.1, "clearance": 1e-4, "viscosity": 0.1}
TURN = np.array([[0.0, -1.0], [1.0, 0.0]])


def loaded(force, load, angle):
    turned = load * np.exp(1j * np.radians(angle))
    zero = np.zeros((2, 2))
    return system(
        lambda speed: fem.Motion(np.eye(2), zero, zero, ("x1", "y1"), speed),
        np.array([0.0, 1e4]),
        forces=[force],
        weight={"x1": turned.real, "y1": turned.imag},
    )


@pytest.mark.parametrize("film", ["pressure", "line of centres"])
def test_the_reference_bearing(film):
    """Issue 21: x is horizontal, the load points to −y, the shaft turns from x to y."""
    force = JournalBearing(1, **BEARING, film=film)
    K, C = coefficients([equilibrium(loaded(force, 525.0, -90.0), 1500 * RPM)])
    printed_K, printed_C = [[12.808, 16.394], [-25.060, 8.815]], [[232.90, -81.92], [-81.92, 294.91]]
    np.testing.assert_allclose(K[0, 0] / 1e6, printed_K, atol=5.1e-4)
    np.testing.assert_allclose(C[0, 0] / 1e3, printed_C, atol=5.1e-3)
    turned = coefficients([equilibrium(loaded(force, 525.0, 0.0), 1500 * RPM)])
    for here, there in zip((K, C), turned, strict=True):
        np.testing.assert_allclose(TURN @ here[0, 0] @ TURN.T, there[0, 0], rtol=1e-9)


def rotor_on(forces, supports=()):
    return fem.Rotor(
        length=[0.2] * 4,
        outer_diameter=0.08,
        discs=[fem.Disc(3, 60.0, 0.4, 0.2)],
        supports=supports,
        forces=forces,
        model=fem.Model(gyroscopic=True),
    )


def test_the_linear_rotor_moves_as_the_forces_do_for_small_motion():
    """Its matrices are the derivatives, by differences, of what the forces of the system leave over."""
    forces = [
        JournalBearing(1, "left", **BEARING),
        MuszynskaSeal(3, "seal", 1e6, 900.0, 3.0, 0.45, 3e-4),
        CubicSpring(4, "", 1e5, 1e14),
        InternalDamping(2, "", 40.0),
        Stop(4, "far", 1e-3, 1e8),
    ]
    rotor = rotor_on(forces, [fem.Support(5, 3e7, 2e3)])
    made, speed = rotor_system(rotor, 100.0, 400.0), 250.0
    found = equilibria(made, [100.0, speed, 400.0])
    linear = linear_rotor(rotor, found)
    assert [s.kind for s in linear.supports] == ["bearing"] * 5
    motion = fem.equations_of_motion(linear, speed=speed)
    q = found[1].q
    C, K = made.linear(speed)

    def left_over(both):
        F = made.acting(both[: q.size], both[q.size :], speed)[0]
        return K @ both[: q.size] + C @ both[q.size :] - F

    steps = approx_fprime(np.concatenate([q, 0 * q]), left_over, 1e-9)
    np.testing.assert_allclose(motion.M, made.M, atol=1e-12)
    for name, part in (("K", steps[:, : q.size]), ("C", steps[:, q.size :])):
        scale = np.abs(part).max()
        np.testing.assert_allclose(getattr(motion, name), part, atol=2e-5 * scale)
        moved = [made.index(n)[0] for n in (1, 2, 3, 4)]
        near = np.ix_(moved, [i + made.index(1)[1] - made.index(1)[0] for i in moved])
        np.testing.assert_allclose(
            getattr(motion, name)[near], part[near], atol=2e-5 * np.abs(part[near]).max()
        )


def test_a_squeeze_film_counts_at_its_centre():
    film = SqueezeFilm(1, "damper", 0.02, 0.1, 2e-4, 0.01, centring_stiffness=4e6)
    rotor = rotor_on([film], [fem.Support(5, 3e7)])
    found = equilibria(rotor_system(rotor, 0.0, 100.0), [0.0, 100.0])
    assert found[0].eccentricity[0] > 0.5
    K, C = coefficients(found)
    np.testing.assert_allclose(K[:, 0], [4e6 * np.eye(2)] * 2, atol=1e-6)
    # π-film short damper at the centre: C = (π / 2) η R (L / c)³
    np.testing.assert_allclose(C[1, 0], np.pi / 2 * 0.01 * 0.05 * 100.0**3 * np.eye(2), atol=1e-9)


def test_what_drives_outwards_is_a_seal():
    force = MuszynskaSeal(3, "", 0.0, 300.0, 4.0, 0.5, 1e-3)
    rotor = rotor_on([force], [fem.Support(1, 1e8), fem.Support(5, 1e8)])
    linear = linear_rotor(rotor, equilibria(rotor_system(rotor, 50.0, 200.0), [50.0, 200.0]))
    assert [s.kind for s in linear.supports] == ["bearing", "bearing", "seal"]
    assert linear.discs[-1].mass == 4.0
    assert not linear.forces


@pytest.mark.parametrize(("e", "mass", "ratio"), [(0.2, 7.18997, 0.51056), (0.5, 6.46040, 0.51464)])
def test_the_threshold_of_a_rigid_rotor_is_that_of_routh_and_hurwitz(e, mass, ratio):
    """A stiff shaft with its mass in the middle: M = m c Ω² / W at the threshold, by the closed form."""
    g, c, L, R, m = 9.80665, 1e-4, 0.03, 0.05, 20.0
    speed = np.sqrt(mass * g / c)
    sommerfeld = e / (4 * (1 - e**2) ** 2) * np.sqrt(16 * e**2 + np.pi**2 * (1 - e**2))
    viscosity = m * g * c**2 / (speed * R * L**3 * sommerfeld)
    forces = [JournalBearing(node, "", L, 2 * R, c, viscosity) for node in (1, 3)]
    rotor = fem.Rotor(
        length=[0.1, 0.1], outer_diameter=0.4, density=0.0, discs=[fem.Disc(2, 2 * m)], forces=forces
    )
    made = rotor_system(rotor, 0.5 * speed, 1.5 * speed)
    found = equilibria(made, np.linspace(0.5, 1.5, 6) * speed)
    stable = threshold(rotor, made, found)
    assert stable.status == "threshold"
    np.testing.assert_allclose(stable.threshold, speed, rtol=3e-4)  # the shaft is not quite rigid
    np.testing.assert_allclose(stable.whirl_ratio, ratio, rtol=1e-3)
    coarse = fem.stability_threshold(linear_rotor(rotor, found), 1.5 * speed, lowest=0.5 * speed)
    finer = equilibria(made, np.linspace(0.5, 1.5, 400) * speed)
    fine = fem.stability_threshold(linear_rotor(rotor, finer), 1.5 * speed, lowest=0.5 * speed)
    assert abs(stable.threshold - fine.threshold) < 0.02 * abs(coarse.threshold - fine.threshold)


def test_one_speed_gives_constant_coefficients():
    rotor = rotor_on([JournalBearing(1, "", **BEARING)], [fem.Support(5, 1e8)])
    found = equilibria(rotor_system(rotor, 50.0, 100.0), [80.0])
    linear = linear_rotor(rotor, found)
    assert linear.constant
    assert linear.supports[1].name == "journal bearing"
    assert dataclasses.replace(linear, supports=rotor.supports) == rotor.linear


@pytest.mark.parametrize("speeds", [(20.0, 1500.0), np.linspace(20.0, 1500.0, 6)])
def test_the_threshold_of_a_flexible_rotor_by_dense_eigenvalues(speeds):
    """Coefficients change most at low speeds: between a few speeds they are not linear."""
    bearings = [JournalBearing(node, "", 0.03, 0.1, 1.2e-4, 0.01) for node in (1, 5)]
    rotor = fem.Rotor(
        length=[0.25] * 4,
        outer_diameter=0.06,
        discs=[fem.Disc(2, 30.0), fem.Disc(4, 60.0, 0.4, 0.2)],
        supports=[fem.Support(3, [[4e5, 0.0], [0.0, 3e6]], 200.0)],
        forces=[*bearings, InternalDamping(3, "", 600.0)],
        model=fem.Model(gyroscopic=True),
    )
    made = rotor_system(rotor, 20.0, 1500.0)

    def growth(speed):
        q = equilibrium(made, speed).q
        (C, K), (_, F_q, F_v, _) = made.linear(speed), made.acting(q, 0 * q, speed)
        lower = -np.linalg.solve(made.M, np.hstack([K - F_q, C - F_v]))
        return np.linalg.eigvals(np.vstack([np.eye(made.size, 2 * made.size, made.size), lower])).real.max()

    scan = np.linspace(20.0, 1500.0, 75)
    first = next(k for k, speed in enumerate(scan) if growth(speed) > 0)
    there = brentq(growth, scan[first - 1], scan[first], xtol=1e-9)
    stable = threshold(rotor, made, equilibria(made, speeds))
    np.testing.assert_allclose(stable.threshold, there, rtol=1e-7)
    assert (stable.lowest, stable.highest) == (20.0, 1500.0)


@pytest.mark.parametrize("highest", [1490.0, 1500.0])
def test_an_unstable_range_between_the_speeds_asked_for_is_found_and_where_it_ends(highest):
    """A seal drives the shaft at 203 rad/s alone: its table stands between the speeds."""
    driving = [[[1e7, q], [-q, 1e7]] for q in (0.0, 0.0, 2e7, 0.0, 0.0)]
    seal = fem.Support(3, driving, 20.0, speeds=(20.0, 200.0, 203.0, 206.0, 1500.0), kind="seal")
    rotor = rotor_on([JournalBearing(n, "", **BEARING) for n in (1, 5)], [seal])
    made = rotor_system(rotor, 20.0, highest)
    stable = threshold(rotor, made, equilibria(made, [20.0, 100.0, highest]))
    assert 200 < stable.threshold < 203
    (said,) = stable.warnings
    assert re.search(r"about 20[3-6]\.\d+ rad/s = .* stable again", said)
