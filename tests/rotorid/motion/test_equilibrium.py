"""Static equilibrium in journal bearings, against formulas, scipy's roots and the beam's reactions."""

import dataclasses

import numpy as np
import pytest
from scipy.integrate import quad
from scipy.optimize import root

import fem
from fem import CubicSpring, JournalBearing, MuszynskaSeal, SqueezeFilm, Stop
from rotorid.motion.equilibrium import equilibria, equilibrium
from rotorid.motion.system import rotor_system, system

RPM = np.pi / 30
BEARING = {"length": 0.03, "diameter": 0.1, "clearance": 1e-4, "viscosity": 0.1}


def mass_on(forces, load, *, stiffness=0.0, mass=1.0, angle=-90.0):
    """One mass on forces at node 1, loaded by a force at an angle in degrees."""
    names = ("x1", "y1")
    zero, one = np.zeros((2, 2)), np.eye(2)
    made = fem.Motion(mass * one, zero, stiffness * one, names, 0.0)
    turned = load * np.exp(1j * np.radians(angle))
    return system(
        lambda speed: dataclasses.replace(made, speed=speed),
        np.array([0.0, 1e4]),
        forces=forces,
        weight={"x1": turned.real, "y1": turned.imag},
    )


def short_bearing_load(e, viscosity, length, diameter, clearance, speed):
    """Ocvirk's load and attitude, by their closed forms."""
    scale = viscosity * speed * diameter / 2 * length**3 / (4 * clearance**2)
    attitude = np.arctan(np.pi * np.sqrt(1 - e**2) / (4 * e))
    return scale * e / (1 - e**2) ** 2 * np.sqrt(16 * e**2 + np.pi**2 * (1 - e**2)), attitude


@pytest.mark.parametrize("film", ["pressure", "line of centres"])
@pytest.mark.parametrize("e", [1e-4, 0.01, 0.2, 0.6, 0.9, 0.97, 0.995])
@pytest.mark.parametrize("angle", [-90.0, 30.0])
def test_eccentricity_and_attitude_are_those_of_ocvirk(e, angle, film):
    speed = 200.0
    load, attitude = short_bearing_load(
        e, *(BEARING[k] for k in ("viscosity", "length", "diameter")), 1e-4, speed
    )
    found = equilibrium(mass_on([JournalBearing(1, **BEARING, film=film)], load, angle=angle), speed)
    np.testing.assert_allclose(found.eccentricity, e, rtol=1e-9)
    np.testing.assert_allclose(found.attitude, attitude, rtol=1e-9)
    np.testing.assert_allclose(found.load, load * np.exp(1j * np.radians(angle)), rtol=1e-9)


def test_the_reference_bearing():
    found = equilibrium(mass_on([JournalBearing(1, **BEARING)], 525.0), 1500 * RPM)
    assert round(float(found.eccentricity[0]), 4) == 0.2663
    # S = η N L D / W (R / c)²: 0.1 · 25 · 0.03 · 0.1 / 525 · 500²
    np.testing.assert_allclose(found.sommerfeld, 3.5714285714285716, rtol=1e-12)


def film_force(x, y, speed, bearing):
    """A short film's force by quadrature of its positive pressure, written here anew."""
    c, R = bearing.clearance, bearing.diameter / 2

    def pressure(angle):
        h = c - x * np.cos(angle) - y * np.sin(angle)
        squeeze = speed / 2 * (y * np.cos(angle) - x * np.sin(angle))
        return max(bearing.viscosity * bearing.length**3 * squeeze / h**3, 0.0)

    ends = np.angle(y - 1j * x) + np.array([-np.pi / 2, np.pi / 2])
    parts = [
        quad(lambda a, f=f: -R * pressure(a) * f(a), *ends, epsabs=1e-9, epsrel=1e-11, limit=200)[0]
        for f in (np.cos, np.sin)
    ]
    return np.array(parts)


def three_bearings(viscosity, offset=5):
    bearings = [
        JournalBearing(node, f"bearing {node}", 0.04, 0.08, 1e-4, viscosity) for node in (1, offset, 9)
    ]
    shaft = fem.Rotor(
        length=[0.2] * 8, outer_diameter=0.08, discs=[fem.Disc(3, 90.0), fem.Disc(7, 25.0)], forces=bearings
    )
    return shaft, bearings


def test_three_bearings_against_a_root_of_scipy():
    speed = 300.0
    shaft, bearings = three_bearings(0.02)
    made = rotor_system(shaft, 0.0, 1000.0)
    found = equilibrium(made, speed)
    K, w = made.linear(speed)[1], made.weight
    free = [k for b in bearings for k in made.index(b.node)]
    rest = np.setdiff1d(np.arange(made.size), free)
    follow = np.linalg.solve(K[np.ix_(rest, rest)], np.column_stack([w[rest], K[np.ix_(rest, free)]]))
    A = K[np.ix_(free, free)] - K[np.ix_(free, rest)] @ follow[:, 1:]
    b = w[free] - K[np.ix_(free, rest)] @ follow[:, 0]

    def left_over(e):
        F = [film_force(*(1e-4 * e[2 * k : 2 * k + 2]), speed, one) for k, one in enumerate(bearings)]
        return (A @ (1e-4 * e) - b - np.concatenate(F)) / 1000.0

    answers = []
    for seed in range(4):
        start = np.random.default_rng(seed).uniform(-0.4, 0.4, 6)
        with np.errstate(all="ignore"):
            one = root(left_over, start, method="hybr", options={"xtol": 1e-12})
        if one.success and np.abs(one.x.reshape(3, 2) @ [1, 1j]).max() < 1:
            answers.append(one.x)
    assert answers
    for x in answers:
        np.testing.assert_allclose(found.q[free], 1e-4 * x, atol=1e-11)
    assert 0.05 < found.eccentricity.min() < found.eccentricity.max() < 0.97


def test_three_bearings_carry_what_rigid_supports_carry_where_the_films_are_thin():
    """With clearances that vanish beside the shaft's deflections the loads are those of a continuous beam."""
    shaft, bearings = three_bearings(0.02)
    thin = [dataclasses.replace(one, clearance=1e-8) for one in bearings]
    found = equilibrium(rotor_system(dataclasses.replace(shaft, forces=thin), 0.0, 1000.0), 300.0)
    rigid = dataclasses.replace(shaft, forces=(), supports=[fem.Support(b.node, 1e14) for b in bearings])
    np.testing.assert_allclose(-found.load.imag, fem.static_deflection(rigid).reaction_y, rtol=1e-4)
    np.testing.assert_allclose(found.load.real, 0.0, atol=0.2)


@pytest.mark.parametrize("viscosity", [1e-5, 1e-3, 0.1, 10.0])
def test_three_bearings_at_any_viscosity(viscosity):
    shaft, _ = three_bearings(viscosity)
    made = rotor_system(shaft, 1.0, 1000.0)
    for found in equilibria(made, [1000.0, 1.0, 50.0]):
        F = made.acting(found.q, np.zeros(made.size), found.speed)[0]
        left = made.linear(found.speed)[1] @ found.q - made.weight - F
        assert np.abs(left).max() < 1e-6 * 9.81 * shaft.total_mass
        np.testing.assert_allclose(found.load.sum(), -1j * 9.80665 * shaft.total_mass, rtol=1e-6)
        assert found.eccentricity.max() < 1


def test_a_sag_on_other_forces_is_that_of_their_formulas():
    k, c = 2e6, 1e-3
    sprung = SqueezeFilm(1, "", 0.03, 0.1, c, 0.01, centring_stiffness=k)
    found = equilibrium(mass_on([sprung], 100.0), 0.0)
    np.testing.assert_allclose(found.position, [-100.0j / k], rtol=1e-12)
    assert np.isnan(found.sommerfeld[0])
    cubic = equilibrium(mass_on([CubicSpring(1, "", 1e5, 1e15)], 100.0), 0.0)
    sag = -cubic.q[1]
    np.testing.assert_allclose(1e5 * sag + 1e15 * sag**3, 100.0, rtol=1e-12)
    seal = MuszynskaSeal(1, "", 1e6, 500.0, 0.0, 0.4, 1e-3)
    found = equilibrium(mass_on([seal], 300.0), 100.0)
    e = found.eccentricity[0]
    K, D, turn = 1e6 / (1 - e**2) ** 2, 500.0 / (1 - e**2) ** 2, 0.4 * np.sqrt(1 - e)
    np.testing.assert_allclose((K - 1j * turn * 100.0 * D) * found.position, [-300.0j], rtol=1e-9)


@pytest.mark.parametrize(
    ("forces", "speed", "words"),
    [
        ([JournalBearing(1, "DE", **BEARING)], 0.0, "speed 0: the journal bearing 'DE' at node 1 carries"),
        ([SqueezeFilm(1, "", **BEARING)], 50.0,
         "nothing holds the rotor.* a squeeze film its centring spring"),
        ([SqueezeFilm(1, "", **BEARING, centring_stiffness=1e6)], 50.0, "under 20 % of the weight "
         "the shaft uses 100 % of its clearance at the squeeze film at node 1"),
        ([SqueezeFilm(1, "", **BEARING, centring_stiffness=5e6)], 50.0, "under 100 % of the weight"),
        ([MuszynskaSeal(1, "", 1e5, 10.0, 0.0, 0.4, 1e-4, stiffness_exponent=0.0)], 50.0,
         "no equilibrium is found"),
        ([Stop(1, "ring", 2e-4, 1e8)], 50.0, "nothing holds the rotor"),
        ([JournalBearing(1, "DE", **BEARING)], 2e4, "hold from 0 to 10000 rad/s"),
    ],
)  # fmt: skip
def test_what_has_no_equilibrium_is_refused_with_node_and_reason(forces, speed, words):
    with pytest.raises(ValueError, match=words):
        equilibrium(mass_on(forces, 500.0), speed)


def test_a_shaft_rests_on_a_stop():
    """k z + k_s (z − gap) = W, without friction; and it is told which stop."""
    ring = Stop(1, "ring", 2e-4, 1e8)
    resting = equilibrium(mass_on([CubicSpring(1, "", 1e6), ring], 500.0), 50.0)
    np.testing.assert_allclose(resting.q, [0.0, -(500.0 + 1e8 * 2e-4) / 1.01e8], rtol=1e-9, atol=1e-15)
    assert resting.touched == (ring,)
    assert equilibrium(mass_on([CubicSpring(1, "", 1e7), ring], 500.0), 50.0).touched == ()


def test_one_journal_bearing_alone_holds_no_rotor():
    shaft = fem.Rotor(length=[0.2] * 4, outer_diameter=0.05, forces=[JournalBearing(3, "", **BEARING)])
    with pytest.raises(ValueError, match="give it stiffness or journal bearings at two nodes"):
        equilibrium(rotor_system(shaft, 0.0, 100.0), 50.0)


def test_a_bearing_whose_table_falls_to_nothing_holds_no_rotor():
    """Also where the search begins at the equilibrium at the speed before."""
    table = fem.Support(1, [[[1e8, 0], [0, 1e8]], [[0, 0], [0, 0]]], speeds=(50.0, 100.0))
    shaft = fem.Rotor(
        length=[0.2] * 4, outer_diameter=0.05, forces=[JournalBearing(5, "", **BEARING)], supports=[table]
    )
    with pytest.raises(ValueError, match=r"at 100 rad/s = .* nothing holds the rotor"):
        equilibria(rotor_system(shaft, 50.0, 100.0), [50.0, 80.0, 100.0])
