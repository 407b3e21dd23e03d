"""The data of supports, pedestals and discs."""

import copy
import math
import pickle

import numpy as np
import pytest
from cases import each_of

import fem

TABLE = fem.Support(3, [1e7, ((2e7, 1e6), (-1e6, 3e7))], [0.0, 1e4], name="journal", speeds=[100.0, 300.0])


def test_equal_bearings_compare_equal_however_they_are_written():
    assert fem.Support(1, [[2e7, 0], [0, 2e7]], np.eye(2) * 5) == fem.Support(1, 2e7, 5.0)
    assert fem.Support(1, np.array([[1.0, 2], [3, 4]])) == fem.Support(1, ((1, 2), (3, 4)))
    assert fem.Support(1, [1e7, 2e7], 3.0, speeds=np.array([0, 9.0])) == fem.Support(
        1, (1e7, [[2e7, 0], [0, 2e7]]), (3.0, 3.0), speeds=(0, 9)
    )
    assert fem.Support(3, 1e7) != TABLE
    assert hash(fem.Support(1, ((1, 2), (3, 4)))) == hash(fem.Support(1, [[1, 2], [3, 4]]))
    assert pickle.loads(pickle.dumps(TABLE)) == copy.deepcopy(TABLE) == TABLE
    assert fem.Pedestal(5.0, (1e8, 1e8)) == fem.Pedestal(5.0, 1e8)


def test_what_kind_of_support_it_is():
    plain = fem.Support(1, 1e7, 10.0)
    assert (plain.plain, plain.symmetric, plain.constant, plain.damped) == (True, True, True, True)
    swirl = fem.Support(1, ((1e7, 5e5), (-5e5, 1e7)))
    assert (swirl.plain, swirl.symmetric, swirl.constant, swirl.damped) == (False, True, True, False)
    assert not fem.Support(1, ((1e7, 5e5), (5e5, 1e7))).symmetric
    assert not TABLE.symmetric
    assert not TABLE.constant
    on_stand = fem.Support(1, 1e7, pedestal=fem.Pedestal(10.0, 1e8, 3.0))
    assert (on_stand.plain, on_stand.symmetric, on_stand.damped) == (False, True, True)
    assert not fem.Support(1, 1e7, pedestal=fem.Pedestal(10.0, (1e8, 2e8))).symmetric
    hardly = fem.Support(1, 1e7, pedestal=fem.Pedestal(10.0, (1e8, 2e8), (0.0, 1e-6)))
    assert hardly.damped, "however little it is, in however few directions"
    assert not fem.Support(1, 1e7, pedestal=fem.Pedestal(10.0, 1e8)).damped
    rotor = fem.Rotor([0.1, 0.1], 0.05, supports=[plain, TABLE])
    assert not rotor.symmetric
    assert not rotor.constant
    assert fem.Rotor([0.1], 0.05, supports=[plain, swirl]).symmetric


def test_a_table_is_interpolated_and_never_extrapolated():
    k, c = TABLE.at(np.array([[100.0, 200.0], [250.0, 300.0]]))
    assert k.shape == c.shape == (2, 2, 2, 2)
    np.testing.assert_allclose(k[0, 1], [[1.5e7, 5e5], [-5e5, 2e7]], rtol=1e-14)
    np.testing.assert_allclose(c[1, 0], np.eye(2) * 7.5e3, rtol=1e-14)
    np.testing.assert_allclose(k[1, 1], [[2e7, 1e6], [-1e6, 3e7]], rtol=1e-14)
    for speed in (99.0, 301.0):
        with pytest.raises(
            ValueError, match=rf"support 'journal' at node 3: its table holds 100 to 300 rad/s, not {speed:g}"
        ):
            TABLE.at([200.0, speed])
    k, c = fem.Support(1, 5.0, 2.0).at(1e9)
    np.testing.assert_array_equal(k, 5 * np.eye(2))
    np.testing.assert_array_equal(c, 2 * np.eye(2))


def test_a_pedestal_is_a_spring_in_series_with_a_mass():
    stand = fem.Pedestal(20.0, (4e7, 1e7), (100.0, 50.0))
    D = fem.Support(1, 2e7, 300.0, pedestal=stand).dynamic_stiffness([0.0, 700.0])
    np.testing.assert_allclose(D[0], np.diag([4 * 2 / 6, 1 * 2 / 3]) * 1e7, rtol=1e-14)
    bearing, ground = 2e7 + 700j * 300, 4e7 + 700j * 100 - 700**2 * 20
    assert D[1, 0, 0] == pytest.approx(1 / (1 / bearing + 1 / ground), rel=1e-12)
    assert D[1, 0, 1] == 0
    assert fem.Support(1, 2e7).dynamic_stiffness(3.0, speed=1.0)[0, 0] == 2e7


def test_a_disc_from_its_sizes():
    disc = fem.Disc.from_geometry(2, 0.1, 0.4, 0.1, density=7000.0, name="wheel")
    mass = 7000 * 0.1 * math.pi / 4 * (0.16 - 0.01)
    assert disc.mass == pytest.approx(mass, rel=1e-14)
    assert disc.polar_inertia == pytest.approx(mass / 8 * 0.17, rel=1e-14)
    assert disc.diametral_inertia == pytest.approx(mass / 16 * 0.17 + mass / 12 * 0.01, rel=1e-14)
    assert (disc.node, disc.name) == (2, "wheel")


def test_a_rotor_with_everything_survives_copying():
    rotor = fem.Rotor(
        [0.1, 0.1],
        0.05,
        supports=[TABLE],
        stations={"A": 1},
        poisson_ratio=0.25,
        material_damping=[0, 1e-5],
        model=fem.Model(shear=True),
    )
    assert pickle.loads(pickle.dumps(rotor)) == copy.deepcopy(rotor) == rotor
    for change in ({"model": fem.Model()}, {"poisson_ratio": 0.3}, {"material_damping": 0.0}):
        import dataclasses

        assert dataclasses.replace(rotor, **change) != rotor


@each_of(
    ("make", "message"),
    [
        (lambda: fem.Support(1, ((1, 2), (3, "x"))), "support at node 1: stiffness yy must be a number"),
        (lambda: fem.Support(1, [1.0, 2.0]), r"stiffness must be a number or 2 × 2"),
        (lambda: fem.Support(1, 0.0, ((1, math.nan), (0, 1))), "damping xy must be finite"),
        (lambda: fem.Support(2, [1.0, 2, 3], speeds=[1, 2]), "stiffness has 3 values for 2 speeds"),
        (lambda: fem.Support(2, [1.0, -2.0], speeds=[1, 2]), "stiffness 2 must be finite and not negative"),
        (lambda: fem.Support(2, 1.0, speeds=[2, 1]), "at least two, not negative and ascending"),
        (lambda: fem.Support(2, 1.0, speeds=[2]), "speeds must be at least two"),
        (lambda: fem.Support(2, 1.0, speeds="ab"), "speeds must be a list of numbers"),
        (lambda: fem.Support(1, 1e8, kind="spring"), "kind 'spring' is not known .*: one of bearing, seal"),
        (lambda: fem.Support(1, 1e8, pedestal=3), "pedestal must be a Pedestal, not 3"),
        (
            lambda: fem.Support(1, 1e8, tilting_stiffness=-1),
            "tilting_stiffness must be finite and not negative",
        ),
        (lambda: fem.Pedestal(1.0), "pedestal: stiffness must be above 0 in x and y"),
        (lambda: fem.Pedestal(1.0, (1e8, -1)), "pedestal: stiffness in y must be finite and not negative"),
        (lambda: fem.Pedestal(1.0, (1, 2, 3)), r"a number or a pair \(x, y\)"),
        (lambda: fem.Pedestal(-1.0, 1e8), "pedestal: mass must be finite and not negative"),
        (lambda: fem.Disc.from_geometry(1, 0.1, 0.2, 0.2), "inner diameter, 0.2 m, must be smaller"),
        (lambda: fem.Disc.from_geometry(1, -0.1, 0.2), "width must be finite and not negative"),
        (lambda: fem.Model(shear=1), "model: shear must be True or False, not 1"),
        (lambda: fem.Rotor([1.0], 0.1, model=True), "model must be a Model"),
        (
            lambda: fem.Rotor([1.0], 0.1, poisson_ratio=0.6),
            "element 1: poisson_ratio must be finite and above",
        ),
        (lambda: fem.Rotor([1.0], 0.1, material_damping=-1), "material_damping must be finite and not neg"),
        (lambda: fem.Sensor(1, math.inf), "sensor at 1: angle must be finite"),
    ],
)
def test_impossible_data_are_refused(make, message):
    with pytest.raises(ValueError, match=message):
        make()


def test_a_seal_may_push():
    seal = fem.Support(1, -1e5, kind="seal")
    assert seal.stiffness == -1e5
    rotor = fem.Rotor(
        [0.5, 0.5],
        0.05,
        supports=[fem.Support(1, 1e7), fem.Support(3, 1e7), fem.Support(2, -1e5, kind="seal")],
    )
    softer = fem.critical_speeds(rotor, 1).frequencies[0]
    assert (
        softer
        < fem.critical_speeds(fem.Rotor([0.5, 0.5], 0.05, supports=rotor.supports[:2]), 1).frequencies[0]
    )
    unstable = fem.Rotor(
        [0.5, 0.5],
        0.05,
        supports=[fem.Support(1, 1e3), fem.Support(3, 1e3), fem.Support(2, -1e7, kind="seal")],
    )
    with pytest.raises(ValueError, match="statically unstable"):
        fem.critical_speeds(unstable, 1)
