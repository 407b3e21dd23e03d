"""Equilibrium in journal bearings and coefficients about it: formulas, differences and dense eigenvalues."""

import dataclasses
import re

import numpy as np
import pytest
from moving_mass import one_mass
from scipy.optimize import approx_fprime, brentq

import fem
from fem import CubicSpring, InternalDamping, JournalBearing, MuszynskaSeal, SqueezeFilm, Stop
from rotorid.motion.equilibrium import equilibria, equilibrium
from rotorid.motion.linear_coefficients import coefficients, linear_rotor, threshold
from rotorid.motion.system import rotor_system

RPM = np.pi / 30
BEARING = {"length": 0.03, "diameter": 0.1, "clearance": 1e-4, "viscosity": 0.1}


def journal(node=1, name="", **changes):
    return JournalBearing(node, name, **BEARING | changes)


def sommerfeld(e):
    """Load of a short bearing in η Ω R L³ / c² (Ocvirk)."""
    return e / (4 * (1 - e**2) ** 2) * np.sqrt(16 * e**2 + np.pi**2 * (1 - e**2))


@pytest.mark.parametrize("film", ["pressure", "line of centres"])
@pytest.mark.parametrize("e", [1e-4, 0.2, 0.9, 0.995])
@pytest.mark.parametrize("angle", [-90.0, 30.0])
def test_eccentricity_and_attitude_are_those_of_ocvirk(e, angle, film):
    load = 0.1 * 200.0 * 0.05 * 0.03**3 / 1e-8 * sommerfeld(e) * np.exp(1j * np.radians(angle))
    rest = equilibrium(one_mass(weight=load, forces=[journal(film=film)]), 200.0)
    np.testing.assert_allclose(rest.eccentricity, e, rtol=1e-9)
    np.testing.assert_allclose(rest.attitude, np.arctan(np.pi * np.sqrt(1 - e**2) / (4 * e)), rtol=1e-9)
    np.testing.assert_allclose(rest.load, load, rtol=1e-9)


@pytest.mark.parametrize("film", ["pressure", "line of centres"])
def test_the_reference_bearing(film):
    """x is horizontal, the load points to −y, the shaft turns from x to y."""
    down, aside = (
        equilibrium(one_mass(weight=load, forces=[journal(film=film)]), 1500 * RPM)
        for load in (525.0, 525 + 0j)
    )
    assert round(float(down.eccentricity[0]), 4) == 0.2663
    # S = η N L D / W (R / c)²: 0.1 · 25 · 0.03 · 0.1 / 525 · 500²
    np.testing.assert_allclose(down.sommerfeld, 3.5714285714285716, rtol=1e-12)
    K, C = coefficients([down])
    np.testing.assert_allclose(K[0, 0] / 1e6, [[12.808, 16.394], [-25.060, 8.815]], atol=5.1e-4)
    np.testing.assert_allclose(C[0, 0] / 1e3, [[232.90, -81.92], [-81.92, 294.91]], atol=5.1e-3)
    turn = np.array([[0.0, -1.0], [1.0, 0.0]])
    for here, there in zip((K, C), coefficients([aside]), strict=True):
        np.testing.assert_allclose(turn @ here[0, 0] @ turn.T, there[0, 0], rtol=1e-9)


def three_bearings(**film):
    film = {"length": 0.04, "diameter": 0.08, "viscosity": 0.02} | film
    discs, bearings = [fem.Disc(3, 90.0), fem.Disc(7, 25.0)], [journal(n, **film) for n in (1, 5, 9)]
    return fem.Rotor(length=[0.2] * 8, outer_diameter=0.08, discs=discs, forces=bearings)


def test_three_bearings_carry_what_rigid_supports_carry_where_the_films_are_thin():
    """With clearances that vanish beside the shaft's deflections the loads are those of a continuous beam."""
    thin = three_bearings(clearance=1e-8)
    rest = equilibrium(rotor_system(thin, 0.0, 1000.0), 300.0)
    rigid = dataclasses.replace(thin, forces=(), supports=[fem.Support(n, 1e14) for n in (1, 5, 9)])
    np.testing.assert_allclose(-rest.load.imag, fem.static_deflection(rigid).reaction_y, rtol=1e-4)
    np.testing.assert_allclose(rest.load.real, 0.0, atol=0.2)


@pytest.mark.parametrize("viscosity", [1e-5, 0.02, 10.0])
def test_three_bearings_at_any_viscosity(viscosity):
    shaft = three_bearings(viscosity=viscosity)
    made = rotor_system(shaft, 1.0, 1000.0)
    for rest in equilibria(made, [1000.0, 1.0, 50.0]):
        F = made.acting(rest.q, np.zeros(made.size), rest.speed)[0]
        left = made.linear(rest.speed)[1] @ rest.q - made.weight - F
        assert np.abs(left).max() < 1e-6 * 9.81 * shaft.total_mass
        np.testing.assert_allclose(rest.load.sum(), -1j * 9.80665 * shaft.total_mass, rtol=1e-6)
        assert rest.eccentricity.max() < 1


def test_a_sag_on_other_forces_is_that_of_their_formulas():
    sprung = SqueezeFilm(1, "", 0.03, 0.1, 1e-3, 0.01, centring_stiffness=2e6)
    rest = equilibrium(one_mass(weight=100.0, forces=[sprung]), 0.0)
    np.testing.assert_allclose(rest.position, [-100.0j / 2e6], rtol=1e-12)
    assert np.isnan(rest.sommerfeld[0])
    sag = -equilibrium(one_mass(weight=100.0, forces=[CubicSpring(1, "", 1e5, 1e15)]), 0.0).q[1]
    np.testing.assert_allclose(1e5 * sag + 1e15 * sag**3, 100.0, rtol=1e-12)
    seal = MuszynskaSeal(1, "", 1e6, 500.0, 0.0, 0.4, 1e-3)
    rest = equilibrium(one_mass(weight=300.0, forces=[seal]), 100.0)
    e = rest.eccentricity[0]
    K, D, turn = 1e6 / (1 - e**2) ** 2, 500.0 / (1 - e**2) ** 2, 0.4 * np.sqrt(1 - e)
    np.testing.assert_allclose((K - 1j * turn * 100.0 * D) * rest.position, [-300.0j], rtol=1e-9)
    ring = Stop(1, "ring", 2e-4, 1e8)  # k z + k_s (z − gap) = W, without friction
    for k, sag, touched in ((1e6, (500.0 + 1e8 * 2e-4) / 1.01e8, (ring,)), (1e7, 500.0 / 1e7, ())):
        rest = equilibrium(one_mass(k=k, weight=500.0, forces=[ring]), 50.0)
        np.testing.assert_allclose(rest.q, [0.0, -sag], rtol=1e-9, atol=1e-15)
        assert rest.touched == touched


def damper(k):
    return SqueezeFilm(1, "", **BEARING, centring_stiffness=k)


@pytest.mark.parametrize(
    ("force", "speed", "words"),
    [
        (journal(name="DE"), 0.0, "speed 0: the journal bearing 'DE' at node 1 carries"),
        (damper(0.0), 50.0, "nothing holds the rotor.* a squeeze film its centring spring"),
        (damper(1e6), 50.0, "under 20 % of the weight "
         "the shaft uses 100 % of its clearance at the squeeze film at node 1"),
        (damper(5e6), 50.0, "under 100 % of the weight"),
        (MuszynskaSeal(1, "", 1e5, 10.0, 0.0, 0.4, 1e-4, stiffness_exponent=0.0), 50.0,
         "no equilibrium is found"),
        (Stop(1, "ring", 2e-4, 1e8), 50.0, "nothing holds the rotor"),
        (journal(name="DE"), 2e4, "hold from 0 to 10000 rad/s"),
    ],
)  # fmt: skip
def test_what_has_no_equilibrium_is_refused_with_node_and_reason(force, speed, words):
    with pytest.raises(ValueError, match=words):
        equilibrium(one_mass(weight=500.0, forces=[force]), speed)


def test_one_journal_bearing_alone_holds_no_rotor():
    """Also where the other's table falls to nothing, and the search begins at the equilibrium before."""
    table = fem.Support(1, [[[1e8, 0], [0, 1e8]], [[0, 0], [0, 0]]], speeds=(50.0, 100.0))
    for supports, words in (
        ([], "give it stiffness or journal bearings at two nodes"),
        ([table], r"at 100 rad/s = .* nothing holds the rotor"),
    ):
        shaft = fem.Rotor(length=[0.2] * 4, outer_diameter=0.05, forces=[journal(5)], supports=supports)
        with pytest.raises(ValueError, match=words):
            equilibria(rotor_system(shaft, 50.0, 100.0), [50.0, 80.0, 100.0])


# Coefficients at the equilibrium


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
        journal(1, "left"),
        MuszynskaSeal(3, "seal", 1e6, 900.0, 3.0, 0.45, 3e-4),
        CubicSpring(4, "", 1e5, 1e14),
        InternalDamping(2, "", 40.0),
        Stop(4, "far", 1e-3, 1e8),
    ]
    rotor = rotor_on(forces, [fem.Support(5, 3e7, 2e3)])
    made, speed = rotor_system(rotor, 100.0, 400.0), 250.0
    rests = equilibria(made, [100.0, speed, 400.0])
    motion = fem.equations_of_motion(linear_rotor(rotor, rests), speed=speed)
    q, (C, K) = rests[1].q, made.linear(speed)

    def left_over(both):
        F = made.acting(both[: q.size], both[q.size :], speed)[0]
        return K @ both[: q.size] + C @ both[q.size :] - F

    steps = approx_fprime(np.concatenate([q, 0 * q]), left_over, 1e-9)
    np.testing.assert_allclose(motion.M, made.M, atol=1e-12)
    moved = [made.index(n)[0] for n in (1, 2, 3, 4)]
    near = np.ix_(moved, [i + made.index(1)[1] - made.index(1)[0] for i in moved])
    for ours, part in ((motion.K, steps[:, : q.size]), (motion.C, steps[:, q.size :])):
        for a, b in ((ours, part), (ours[near], part[near])):  # the coupling of x and y by its own size
            np.testing.assert_allclose(a, b, atol=2e-5 * np.abs(b).max())


def test_a_squeeze_film_counts_at_its_centre():
    film = SqueezeFilm(1, "damper", 0.02, 0.1, 2e-4, 0.01, centring_stiffness=4e6)
    rests = equilibria(rotor_system(rotor_on([film], [fem.Support(5, 3e7)]), 0.0, 100.0), [0.0, 100.0])
    assert rests[0].eccentricity[0] > 0.5
    K, C = coefficients(rests)
    np.testing.assert_allclose(K[:, 0], [4e6 * np.eye(2)] * 2, atol=1e-6)
    # π-film short damper at the centre: C = (π / 2) η R (L / c)³
    np.testing.assert_allclose(C[1, 0], np.pi / 2 * 0.01 * 0.05 * 100.0**3 * np.eye(2), atol=1e-9)


def test_what_drives_outwards_is_a_seal_and_one_speed_gives_constant_coefficients():
    force = MuszynskaSeal(3, "", 0.0, 300.0, 4.0, 0.5, 1e-3)
    rotor = rotor_on([force], [fem.Support(1, 1e8), fem.Support(5, 1e8)])
    linear = linear_rotor(rotor, equilibria(rotor_system(rotor, 50.0, 200.0), [50.0, 200.0]))
    assert [s.kind for s in linear.supports] == ["bearing", "bearing", "seal"]
    assert linear.discs[-1].mass == 4.0
    assert not linear.forces
    rotor = rotor_on([journal()], [fem.Support(5, 1e8)])
    linear = linear_rotor(rotor, equilibria(rotor_system(rotor, 50.0, 100.0), [80.0]))
    assert linear.constant
    assert dataclasses.replace(linear, supports=rotor.supports) == rotor.linear


@pytest.mark.parametrize(("e", "mass", "ratio"), [(0.2, 7.18997, 0.51056), (0.5, 6.46040, 0.51464)])
def test_the_threshold_of_a_rigid_rotor_is_that_of_routh_and_hurwitz(e, mass, ratio):
    """A stiff shaft with its mass in the middle: M = m c Ω² / W at the threshold, by the closed form."""
    g, c, L, R, m = 9.80665, 1e-4, 0.03, 0.05, 20.0
    speed = np.sqrt(mass * g / c)
    viscosity = m * g * c**2 / (speed * R * L**3 * sommerfeld(e))
    bearings, discs = [journal(node, viscosity=viscosity) for node in (1, 3)], [fem.Disc(2, 2 * m)]
    rotor = fem.Rotor(length=[0.1, 0.1], outer_diameter=0.4, density=0.0, discs=discs, forces=bearings)
    made = rotor_system(rotor, 0.5 * speed, 1.5 * speed)
    stable = threshold(rotor, made, equilibria(made, np.linspace(0.5, 1.5, 6) * speed))
    np.testing.assert_allclose(stable.threshold, speed, rtol=3e-4)  # the shaft is not quite rigid
    np.testing.assert_allclose(stable.whirl_ratio, ratio, rtol=1e-3)


@pytest.mark.parametrize("speeds", [(20.0, 1500.0), np.linspace(20.0, 1500.0, 6)])
def test_the_threshold_of_a_flexible_rotor_by_dense_eigenvalues(speeds):
    """Coefficients change most at low speeds: between a few speeds they are not linear."""
    bearings = [journal(node, clearance=1.2e-4, viscosity=0.01) for node in (1, 5)]
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
def test_an_unstable_range_between_the_speeds_asked_for_is_told_and_where_it_ends(highest):
    """A seal drives the shaft at 203 rad/s alone: its table stands between the speeds."""
    driving = [[[1e7, q], [-q, 1e7]] for q in (0.0, 0.0, 2e7, 0.0, 0.0)]
    seal = fem.Support(3, driving, 20.0, speeds=(20.0, 200.0, 203.0, 206.0, 1500.0), kind="seal")
    rotor = rotor_on([journal(n) for n in (1, 5)], [seal])
    made = rotor_system(rotor, 20.0, highest)
    stable = threshold(rotor, made, equilibria(made, [20.0, 100.0, highest]))
    assert 200 < stable.threshold < 203
    (warning,) = stable.warnings
    assert re.search(r"about 20[3-6]\.\d+ rad/s = .* stable again", warning)
