"""The steady response of a rotor that whirls by itself does not exist, and this is said."""

import dataclasses

import numpy as np
import pytest
from fem_rotors import rotor23
from whirl_rotors import machine

import fem
from fem.growth_check import growth_bound

SPEEDS = np.linspace(50.0, 1500.0, 60)


def inner(material):
    base = machine()
    return dataclasses.replace(
        base,
        supports=[fem.Support(s.node, 1e8, 1e4) for s in base.supports],
        material_damping=np.full(23, material),
    )


def test_growth_is_said_with_its_threshold():
    rotor = inner(2e-4)
    threshold = fem.stability_threshold(rotor, 1500.0).threshold
    for result in (
        fem.unbalance_response(rotor, {5: 1e-4}, SPEEDS),
        fem.unbalance_response(rotor, {5: 1e-4}, SPEEDS[::-1]),
        fem.influence(rotor, [5], [7], SPEEDS),
    ):
        assert f"does not exist above {threshold:.6g} rad/s" in result.warnings[-1]
        assert f"up to the last speed, {SPEEDS[-1]:.6g} rad/s" in result.warnings[-1]
        assert "mode 2 (forward whirl" in result.warnings[-1]


def test_one_speed():
    rotor = inner(2e-4)
    threshold = fem.stability_threshold(rotor, 1500.0).threshold
    above = fem.unbalance_response(rotor, {5: 1e-4}, 1.05 * threshold)
    assert f"does not exist at {1.05 * threshold:.6g} rad/s" in above.warnings[-1]
    assert fem.unbalance_response(rotor, {5: 1e-4}, 0.95 * threshold).warnings == ()


def test_a_stable_rotor_with_material_damping_is_not_suspected():
    assert (growth_bound(inner(1e-7), SPEEDS) > 0).all()
    assert fem.unbalance_response(inner(1e-7), {5: 1e-4}, SPEEDS).warnings == ()


def test_a_rotor_that_is_pushed_aside():
    rotor = machine()
    pushed = dataclasses.replace(rotor, supports=[*rotor.supports, fem.Support(12, -1e9, kind="seal")])
    with pytest.raises(ValueError, match="statically unstable"):
        fem.unbalance_response(pushed, {5: 1e-4}, SPEEDS)


@pytest.mark.parametrize(
    ("stiffness", "damping", "sure"),
    [
        (1e8, 1e3, True),
        (((1e8, 0), (0, 2e8)), ((1e3, 0), (0, 5e2)), True),
        (((1e8, 3e7), (3e7, 2e8)), 1e3, True),
        (((1e8, 3e7), (-3e7, 1e8)), 1e3, False),
        (((1e8, 2e8), (2e8, 1e8)), 1e3, False),
        (1e8, ((1e3, 2e3), (2e3, 1e3)), False),
        (1e8, ((1e3, 2e3), (-2e3, 1e3)), True),
    ],
)
def test_what_is_surely_stable(stiffness, damping, sure):
    base = rotor23()
    rotor = dataclasses.replace(
        base, supports=[fem.Support(s.node, stiffness, damping) for s in base.supports]
    )
    assert (growth_bound(rotor, np.array([0.0, 100.0])) == 0).all() == sure
