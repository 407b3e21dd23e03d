"""The data of forces at nodes that are not linear, and what a rotor does with them."""

import copy
import pickle

import numpy as np
import pytest
from cases import each_of

import fem

FILM = {"length": 0.03, "diameter": 0.1, "clearance": 1e-4, "viscosity": 0.1}


@each_of(
    "make, words",
    [
        (
            lambda: fem.JournalBearing(1, **FILM | {"clearance": 0.0}),
            "journal bearing at node 1: clearance must",
        ),
        (lambda: fem.JournalBearing(1, "DE", **FILM | {"length": -1}), "bearing 'DE' at node 1: length must"),
        (lambda: fem.JournalBearing(1, **FILM, film="pi"), "film 'pi' is not known"),
        (lambda: fem.SqueezeFilm(1, **FILM | {"clearance": 1e-200}), "clearance must be above 0, not 1e-200"),
        (lambda: fem.SqueezeFilm(0, **FILM), "squeeze film: node 0 does not exist"),
        (lambda: fem.SqueezeFilm(1.5, **FILM), "the node of squeeze film must be a whole number"),
        (lambda: fem.MuszynskaSeal(1), "clearance must be above 0"),
        (lambda: fem.CubicSpring(1, stiffness=np.nan), "stiffness must be finite and not negative"),
        (lambda: fem.Stop(1, gap=1.0), "stiffness must be above 0"),
        (lambda: fem.InternalDamping(1, damping="much"), "damping must be a number"),
    ],
)
def test_impossible_values(make, words):
    with pytest.raises(ValueError, match=words):
        make()


def test_a_rotor_keeps_them_by_kind_and_compares_them():
    damping, film = fem.InternalDamping(2, damping=3.0), fem.JournalBearing(3, **FILM)
    rotor = fem.Rotor([0.4, 0.6], 0.1, forces=[damping, film])
    assert rotor.forces == (film, damping)
    assert rotor == fem.Rotor([0.4, 0.6], 0.1, forces=[film, damping])
    assert rotor != rotor.linear
    plain = rotor.linear
    assert plain.forces == ()
    assert plain.linear is plain
    assert pickle.loads(pickle.dumps(rotor)) == copy.deepcopy(rotor) == rotor
    assert "2 forces" in repr(rotor)
    assert "force" not in repr(rotor.linear)


def test_a_refined_rotor_has_them_at_the_same_places():
    rotor = fem.Rotor([0.4, 0.6], 0.1, forces=[fem.JournalBearing(2, **FILM), fem.Stop(3, stiffness=1.0)])
    finer = fem.refined(rotor, 3)
    places = [finer.positions[force.node - 1] for force in finer.forces]
    np.testing.assert_allclose(places, [0.4, 1.0])


def test_what_no_rotor_takes():
    with pytest.raises(ValueError, match="force 1 stands at node 4"):
        fem.Rotor([0.4, 0.6], 0.1, forces=[fem.Stop(4, stiffness=1.0)])
    with pytest.raises(ValueError, match="force 1 must be a NodeForce"):
        fem.Rotor([0.4], 0.1, forces=[fem.Support(1, 1e6)])
    with pytest.raises(ValueError, match="node force at node 1 is no force: one of journal_bearing, "):
        fem.Rotor([0.4], 0.1, forces=[fem.NodeForce(1)])
