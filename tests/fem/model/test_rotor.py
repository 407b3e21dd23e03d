import copy
import doctest
import math
import pickle

import numpy as np
import pytest
from cases import each_of
from fem_rotors import rotor23

import fem


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
    with pytest.raises(TypeError):
        rotor.stations["a"] = 1


def test_mass_and_sections_of_a_tube():
    tube = fem.Rotor([0.5, 0.5], 0.1, 0.06, density=1000.0, discs=[fem.Disc(2, 3.0)])
    area = math.pi / 4 * (0.1**2 - 0.06**2)
    assert tube.total_mass == pytest.approx(1000 * area + 3.0, rel=1e-14)
    assert tube.second_moment[0] == pytest.approx(math.pi / 64 * (0.1**4 - 0.06**4), rel=1e-14)


def test_equal_by_value_and_copied():
    rotor = fem.Rotor([0.1, 0.2], 0.05, discs=[fem.Disc(1, 2)], stations={"A": 2})
    same = fem.Rotor(
        np.array([0.1, 0.2]), [0.05, 0.05], discs=(fem.Disc(1, 2.0),), stations={"A": np.int64(2)}
    )
    assert rotor == same
    assert rotor != fem.Rotor([0.1, 0.2], 0.05, discs=[fem.Disc(2, 2)], stations={"A": 2})
    assert rotor != fem.Rotor([0.1, 0.2], 0.05, discs=[fem.Disc(1, 2)])
    assert rotor != fem.Rotor([0.1, 0.2, 0.3], 0.05)
    assert rotor != "rotor"
    assert pickle.loads(pickle.dumps(rotor)) == rotor
    assert copy.deepcopy(rotor) == rotor
    with pytest.raises(TypeError, match="unhashable"):
        hash(rotor)


def test_repr_is_short():
    assert repr(rotor23()) == "Rotor(23 elements, 3.243 m, 558.5 kg, 12 discs, 2 supports)"


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
        ({"length": [0.1, 0.0]}, "element 2: length"),
        ({"length": [0.1, float("nan")]}, "element 2: length must be finite"),
        ({"length": []}, "length has 0 values"),
        ({"length": "long"}, "length must be a number"),
        ({"length": [[0.1]]}, r"length must be one number per element, not an array of shape \(1, 1\)"),
        ({"outer_diameter": [0.1, 0.1, 0.1]}, "length has 2 values for 3 elements"),
        ({"outer_diameter": float("inf")}, "element 1: outer_diameter"),
        ({"inner_diameter": [0, 0.05]}, "element 2: the inner diameter, 0.05 m, must be smaller"),
        ({"inner_diameter": -0.01}, "element 1: inner_diameter must be finite and not negative"),
        ({"youngs_modulus": 0.0}, "youngs_modulus must be finite and greater than zero"),
        ({"density": -1.0}, "density must be finite and not negative"),
        ({"discs": [fem.Disc(4, 1)]}, "disc 1 stands at node 4, but the rotor has nodes 1 to 3 only"),
        ({"supports": [fem.Support(1, 1), fem.Support(9, 1)]}, "support 2 stands at node 9"),
        ({"discs": [fem.Support(1, 1)]}, "disc 1 must be a Disc"),
        ({"supports": 3}, "supports must be a list of Support objects"),
        ({"stations": {"A": 4}}, "station 'A' stands at node 4"),
        ({"stations": {"A": 1.5}}, "the node of station 'A' must be a whole number"),
    ],
)
def test_an_impossible_rotor_is_refused(arguments, message):
    with pytest.raises(ValueError, match=message):
        fem.Rotor(**{"length": [0.1, 0.2], "outer_diameter": 0.05, **arguments})


@each_of(
    ("make", "message"),
    [
        (lambda: fem.Disc(0, 1.0), "disc: node 0 does not exist, nodes are numbered from 1"),
        (lambda: fem.Disc(True, 1.0), "whole number, not True"),
        (
            lambda: fem.Disc(2, -1.0, name="wheel"),
            "disc 'wheel' at node 2: mass must be finite and not negative",
        ),
        (lambda: fem.Disc(2, 1.0, polar_inertia=float("nan")), "polar_inertia must be finite"),
        (lambda: fem.Disc(2, 1.0, diametral_inertia=-1), "diametral_inertia must be finite and not negative"),
        (lambda: fem.Disc(2, "heavy"), "mass must be a number, not 'heavy'"),
        (lambda: fem.Support(1.0, 1e8), "the node of support must be a whole number, not 1.0"),
        (lambda: fem.Support(1, -1e8), "support at node 1: stiffness must be finite and not negative"),
        (lambda: fem.Support(1, 1e8, float("inf")), "damping must be finite"),
    ],
)
def test_an_impossible_disc_or_support_is_refused(make, message):
    with pytest.raises(ValueError, match=message):
        make()


def test_the_example_of_the_package_is_true():
    assert doctest.testmod(fem) == (0, 4)
