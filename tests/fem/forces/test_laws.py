"""Seals, springs, stops and internal damping: their laws and all derivatives."""

import numpy as np
import pytest
from cases import each_of

import fem
from fem.forces.laws import law, tables

STOP = {"gap": 0.2, "stiffness": 50.0, "damping": 3.0, "friction": 0.3, "diameter": 0.4, "slip_speed": 0.5}
SEAL = {"stiffness": 4.0, "damping": 3.0, "fluid_mass": 0.5, "swirl_ratio": 0.45, "clearance": 1.2}
FORCES = {
    "bearing": fem.JournalBearing(1, length=0.5, diameter=2.0, clearance=1.2, viscosity=4.0),
    "damper": fem.SqueezeFilm(
        1, length=0.5, diameter=2.0, clearance=1.2, viscosity=4.0, centring_stiffness=1.0
    ),
    "seal": fem.MuszynskaSeal(1, **SEAL, stiffness_exponent=1.7, swirl_exponent=0.6),
    "spring": fem.CubicSpring(1, stiffness=2.0, cubic_stiffness=5.0),
    "stop": fem.Stop(1, **STOP),
    "internal": fem.InternalDamping(1, damping=0.7),
}
STATES = [(0.3, 0.4, 0.2, -0.5, 1.5), (-0.6, 0.2, 0.4, 0.3, 0.7), (0.1, -0.7, -0.2, -0.4, 2.5)]


def act(force, state, *, machine=False):
    (code,), (values,) = tables([force])
    out = np.empty((2, 6))
    function = getattr(law, "machine", law) if machine else law
    function(code, values, *map(float, state), out)
    return out


def force_of(force, state):
    return complex(*act(force, state)[:, 0])


@each_of("name", FORCES)
def test_derivatives(name):
    step = 1e-4
    for state in STATES:
        found = act(FORCES[name], state)
        assert np.abs(found).max() > 0
        for k in range(5):
            d = step * np.eye(5)[k]
            at = [act(FORCES[name], np.add(state, m * d))[:, 0] for m in (-2, -1, 1, 2)]
            expected = (at[0] - 8 * at[1] + 8 * at[2] - at[3]) / (12 * step)
            np.testing.assert_allclose(found[:, 1 + k], expected, rtol=1e-7, atol=1e-8)


@each_of("name", FORCES)
def test_interpreted_and_compiled_agree(name):
    for state in STATES:
        found = act(FORCES[name], state, machine=True)
        np.testing.assert_allclose(found, act(FORCES[name], state), rtol=1e-12, atol=1e-13)


@pytest.mark.parametrize("state", STATES)
def test_a_seal_after_muszynska(state):
    x, y, vx, vy, omega = state
    z, v = complex(x, y), complex(vx, vy)
    e = abs(z) / 1.2
    K, D = (k0 * (1 - e**2) ** -1.7 for k0 in (4.0, 3.0))
    tau = 0.45 * (1 - e) ** 0.6
    expected = -(K - 0.5 * tau**2 * omega**2 - 1j * tau * omega * D) * z - (D - 2j * tau * omega * 0.5) * v
    assert force_of(FORCES["seal"], state) == pytest.approx(expected, rel=1e-13)
    assert FORCES["seal"].mass == 0.5
    assert FORCES["seal"].wall == 1.2
    same = fem.MuszynskaSeal(1, **SEAL, stiffness_exponent=0.0, swirl_exponent=0.0)
    s = 0.45 * omega
    expected = -(4 - 0.5 * s**2 - 3j * s) * z - (3 - 1j * s) * v
    assert force_of(same, state) == pytest.approx(expected, rel=1e-13)
    centred = act(same, (0.0, 0.0, *state[2:]))
    np.testing.assert_allclose(act(same, state)[:, 1:5], centred[:, 1:5], atol=1e-13)


def test_a_seal_at_its_centre_and_at_its_wall():
    assert np.isfinite(act(FORCES["seal"], (0.0, 0.0, 0.1, 0.2, 3.0))).all()
    for x in (1.2, 2.0):
        for machine in (False, True):
            assert np.isnan(act(FORCES["seal"], (x, 0.0, 0.0, 0.0, 1.0), machine=machine)).all()


def test_a_cubic_spring():
    z = complex(0.3, 0.4)
    assert force_of(FORCES["spring"], (0.3, 0.4, 9.0, 9.0, 9.0)) == pytest.approx(-(2 + 5 * 0.25) * z)


def test_internal_damping_drives_above_the_speed_of_the_whirl():
    out = act(FORCES["internal"], (0.1, 0.2, 0.0, 0.0, 30.0))
    np.testing.assert_allclose(-out[:, 1:3], [[0, 0.7 * 30], [-0.7 * 30, 0]])
    np.testing.assert_allclose(-out[:, 3:5], 0.7 * np.eye(2))
    for whirl, sign in ((40.0, -1), (30.0, 0), (20.0, 1)):  # power into the whirl
        assert np.sign(round((force_of(FORCES["internal"], (1, 0, 0, whirl, 30.0)) * -1j).real, 9)) == sign


def test_a_stop():
    assert not act(FORCES["stop"], (0.12, 0.16 - 1e-9, 1.0, 1.0, 5.0)).any(), "not yet there"
    assert not act(FORCES["stop"], (0.21, 0.0, -1.0, 0.0, 5.0)).any(), "leaves faster than the ring follows"
    deep = force_of(FORCES["stop"], (0.0, 0.5, 0.0, 0.0, 1e3))
    assert deep == pytest.approx(complex(0.3, -1) * 50 * 0.3), "friction against the turning surface"
    rolls = force_of(FORCES["stop"], (0.5, 0.0, 0.0, -0.2 * 7, 7.0))
    assert rolls == pytest.approx(-50 * 0.3), "backward whirl that rolls has no friction"
    faster = force_of(FORCES["stop"], (0.5, 0.0, 0.1, -100.0, 7.0))
    assert faster == pytest.approx(complex(-1, 0.3) * (50 * 0.3 + 3 * 0.1))
