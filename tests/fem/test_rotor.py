"""The data of a rotor: shaft, discs, supports, pedestals, sensors, and of its calibration."""

import copy
import math
import pickle
from dataclasses import replace

import numpy as np
import pytest
from cases import each_of

import fem

TABLE = fem.Support(3, [1e7, ((2e7, 1e6), (-1e6, 3e7))], [0.0, 1e4], name="journal", speeds=[100.0, 300.0])

A = np.array([[2e6, 0.0], [-1e6, 5e5], [0.01, 0.02]])
FOUND = fem.Calibration(
    ("bearing[1].kxx", "bearing[2].kxx", "probe[DE].angle"),
    [1.2e7, 1.1e7, 1.02],
    A @ A.T,
    0.03,
)


def test_a_scalar_counts_for_all_elements_and_nothing_can_be_written():
    lengths = np.array([0.1, 0.2])
    rotor = fem.Rotor(lengths, 0.05, 0.02)
    assert rotor.n_elements == 2
    assert rotor.n_nodes == 3
    np.testing.assert_allclose(rotor.positions, [0, 0.1, 0.3], rtol=1e-15)
    np.testing.assert_array_equal(rotor.youngs_modulus, [2.1e11, 2.1e11])
    lengths[0] = 9.0
    assert rotor.length[0] == 0.1
    with pytest.raises(ValueError, match="read-only"):
        rotor.length[0] = 1.0
    with pytest.raises(AttributeError):
        rotor.density = 1.0


def test_equal_by_value_and_copied():
    options = {"discs": [fem.Disc(1, 2)], "supports": [TABLE], "stations": {"A": 2}, "calibration": FOUND}
    rotor = fem.Rotor([0.1, 0.2], 0.05, **options)
    assert rotor == fem.Rotor(
        np.array([0.1, 0.2]), [0.05, 0.05], **options | {"stations": {"A": np.int64(2)}}
    )
    for change in (
        {"discs": [fem.Disc(2, 2)]},
        {"stations": {}},
        {"length": [0.1, 0.3]},
        {"model": fem.Model(shear=True)},
        {"forces": [fem.Stop(2, stiffness=1.0)]},
    ):
        assert replace(rotor, **change) != rotor
    for copied in (pickle.loads(pickle.dumps(rotor)), copy.deepcopy(rotor)):
        assert copied == rotor
        np.testing.assert_array_equal(copied.calibration.covariance, FOUND.covariance)
    assert replace(rotor, calibration=None) == rotor
    with pytest.raises(TypeError, match="unhashable"):
        hash(rotor)


def test_stations_and_numbers_name_nodes():
    rotor = fem.Rotor([0.1] * 4, 0.05, stations={"bearing": 2, "4": 5})
    assert [rotor.node("bearing"), rotor.node(3), rotor.node("3"), rotor.node("4")] == [2, 3, 3, 5]
    assert type(rotor.node(np.int64(3))) is int
    with pytest.raises(ValueError, match=r"'bering'.*stations: bearing, 4.*1 to 5"):
        rotor.node("bering")
    with pytest.raises(ValueError, match=r"node 6 does not exist.*1 to 5"):
        rotor.node(6)
    with pytest.raises(ValueError, match="node 0 does not exist"):
        rotor.node("0")
    with pytest.raises(ValueError, match=r"whole number, not 2.5"):
        rotor.node(2.5)


@each_of(
    ("arguments", "message"),
    [
        ({"length": [0.1, -0.2]}, "element 2: length must be finite and greater than zero, not -0.2"),
        ({"length": []}, "length must be a number, or one for each of 1 elements"),
        (
            {"inner_diameter": [0, 0.05]},
            "element 2: inner_diameter must be smaller than outer_diameter, not 0.05",
        ),
        ({"discs": [fem.Disc(4, 1)]}, "disc 1: node 4 does not exist: the rotor has nodes 1 to 3"),
        ({"supports": [fem.Support(1, 1), fem.Support(9, 1)]}, "support 2: node 9 does not exist"),
        ({"stations": {"A": 4}}, "station 'A': node 4 does not exist"),
    ],
)
def test_an_impossible_rotor_is_refused(arguments, message):
    with pytest.raises(ValueError, match=message):
        fem.Rotor(**{"length": [0.1, 0.2], "outer_diameter": 0.05, **arguments})


@each_of(
    ("make", "message"),
    [
        (lambda: fem.Disc(0, 1.0), "disc: node 0 does not exist, nodes are numbered from 1"),
        (
            lambda: fem.Disc(2, -1.0, name="wheel"),
            "disc 'wheel' at node 2: mass must be finite and not negative",
        ),
        (lambda: fem.Support(1, -1e8), "support at node 1: stiffness must be finite and not negative"),
    ],
)
def test_an_impossible_disc_or_support_is_refused(make, message):
    with pytest.raises(ValueError, match=message):
        make()


def test_equal_bearings_compare_equal_however_they_are_written():
    assert fem.Support(1, [[2e7, 0], [0, 2e7]], np.eye(2) * 5) == fem.Support(1, 2e7, 5.0)
    one, other = fem.Support(1, np.array([[1.0, 2], [3, 4]])), fem.Support(1, ((1, 2), (3, 4)))
    assert (one, hash(one)) == (other, hash(other))
    tables = [1e7, 2e7], (1e7, [[2e7, 0], [0, 2e7]])
    assert len({fem.Support(1, k, (3.0, 3.0), speeds=(0, 9)) for k in tables}) == 1
    assert fem.Support(3, 1e7) != TABLE
    assert fem.Pedestal(5.0, (1e8, 1e8)) == fem.Pedestal(5.0, 1e8)


OVAL = ((1e7, 5e5), (5e5, 1e7))


@each_of(
    "support, plain, symmetric, damped",
    [
        (fem.Support(1, 1e7, 10.0), True, True, True),
        (fem.Support(1, ((1e7, 5e5), (-5e5, 1e7))), False, True, False),
        (fem.Support(1, OVAL), False, False, False),
        (TABLE, False, False, True),
        (fem.Support(1, 1e7, pedestal=fem.Pedestal(10.0, 1e8, 3.0)), False, True, True),
        (fem.Support(1, 1e7, pedestal=fem.Pedestal(10.0, 1e8)), False, True, False),
        # damped, however little it is, in however few directions
        (fem.Support(1, 1e7, pedestal=fem.Pedestal(10.0, (1e8, 2e8), (0.0, 1e-6))), False, False, True),
    ],
)
def test_what_kind_of_support_it_is(support, plain, symmetric, damped):
    assert (support.plain, support.symmetric, support.damped) == (plain, symmetric, damped)
    assert support.constant == (support is not TABLE)
    rotor = fem.Rotor([0.1, 0.1], 0.05, supports=[fem.Support(2, 1e7), support])
    assert (rotor.symmetric, rotor.constant) == (symmetric, support.constant)


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


@each_of(
    ("make", "message"),
    [
        (lambda: fem.Support(1, [1.0, 2.0]), r"stiffness must be a number or of the shape \(2, 2\)"),
        (
            lambda: fem.Support(1, 0.0, ((1, math.nan), (0, 1))),
            "damping must be finite, not nan",
        ),
        (lambda: fem.Support(2, [1.0, 2, 3], speeds=[1, 2]), "stiffness has 3 values for 2 speeds"),
        (
            lambda: fem.Support(2, [1.0, -2.0], speeds=[1, 2]),
            "stiffness must be finite and not negative, not -2.0",
        ),
        (lambda: fem.Support(2, 1.0, speeds=[2, 1]), "at least two, not negative and ascending"),
        (lambda: fem.Support(1, 1e8, kind="spring"), "kind 'spring' is not known .*: one of bearing, seal"),
        (lambda: fem.Pedestal(1.0), "pedestal: stiffness must be above 0 in x and y"),
        (lambda: fem.Disc.from_geometry(1, 0.1, 0.2, 0.2), "inner diameter, 0.2 m, must be smaller"),
        (
            lambda: fem.Rotor([1.0], 0.1, poisson_ratio=0.6),
            "element 1: poisson_ratio must be finite and above",
        ),
    ],
)
def test_impossible_data_are_refused(make, message):
    with pytest.raises(ValueError, match=message):
        make()


def test_principal_columns_give_the_covariance_in_as_many_directions_as_it_has():
    L = FOUND.columns()
    assert L.shape == (3, 2)
    scale = np.outer(FOUND.std, FOUND.std)
    np.testing.assert_allclose(L @ L.T / scale, FOUND.covariance / scale, atol=1e-14)
    known = replace(FOUND, covariance=np.diag([0.0, 4e10, 1e-4]))
    assert known.columns().shape == (3, 2)
    assert not known.columns()[0].any()
    assert fem.Calibration((), [], np.zeros((0, 0))).columns().shape == (0, 0)
    assert replace(FOUND, covariance=np.zeros((3, 3))).columns().shape == (3, 0)


@pytest.mark.parametrize(
    ("wrong", "words"),
    [
        ({"covariance": np.eye(2)}, r"covariance must be finite and of the shape \(3, 3\)"),
        ({"covariance": [[1, 0.5, 0], [0, 1, 0], [0, 0, 1]]}, "must be symmetric"),
        ({"covariance": [[1, 2, 0], [2, 1, 0], [0, 0, 1]]}, "negative in any direction"),
        ({"names": ("disc.scale",) * 3}, "one of its names comes twice"),
    ],
)
def test_what_is_no_calibration_is_refused(wrong, words):
    with pytest.raises(ValueError, match=words):
        replace(FOUND, **wrong)
