"""Forces at nodes that are not linear: their data, laws and derivatives.

Films against quadrature of Reynolds' pressure and closed forms.
"""

import math
from itertools import pairwise

import numpy as np
import pytest
from cases import each_of
from scipy.optimize import brentq

import fem
from fem.forces import law, tables

BEARING = {"length": 0.03, "diameter": 0.1, "clearance": 1e-4, "viscosity": 0.1}
SPEED = 50 * math.pi  # 1500 rpm
NODES, WEIGHTS = np.polynomial.legendre.leggauss(80)

STOP = {"gap": 0.2, "stiffness": 50.0, "damping": 3.0, "friction": 0.3, "diameter": 0.4, "slip_speed": 0.5}
SEAL = {"stiffness": 4.0, "damping": 3.0, "fluid_mass": 0.5, "swirl_ratio": 0.45, "clearance": 1.2}
LAWS = {
    "bearing": fem.JournalBearing(1, length=0.5, diameter=2.0, clearance=1.2, viscosity=4.0),
    "half film": fem.JournalBearing(
        1, length=0.5, diameter=2.0, clearance=1.2, viscosity=4.0, film="line of centres"
    ),
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


@each_of("name", LAWS)
def test_derivatives(name):
    step = 1e-4
    for state in STATES:
        found = act(LAWS[name], state)
        assert np.abs(found).max() > 0
        for k in range(5):
            d = step * np.eye(5)[k]
            at = [act(LAWS[name], np.add(state, m * d))[:, 0] for m in (-2, -1, 1, 2)]
            expected = (at[0] - 8 * at[1] + 8 * at[2] - at[3]) / (12 * step)
            np.testing.assert_allclose(found[:, 1 + k], expected, rtol=1e-7, atol=1e-8)


@each_of("name", LAWS)
def test_interpreted_and_compiled_agree(name):
    for state in STATES:
        found = act(LAWS[name], state, machine=True)
        np.testing.assert_allclose(found, act(LAWS[name], state), rtol=1e-12, atol=1e-13)


@pytest.mark.parametrize("state", STATES)
def test_a_seal_after_muszynska(state):
    x, y, vx, vy, omega = state
    z, v = complex(x, y), complex(vx, vy)
    e = abs(z) / 1.2
    K, D = (k0 * (1 - e**2) ** -1.7 for k0 in (4.0, 3.0))
    tau = 0.45 * (1 - e) ** 0.6
    expected = -(K - 0.5 * tau**2 * omega**2 - 1j * tau * omega * D) * z - (D - 2j * tau * omega * 0.5) * v
    assert force_of(LAWS["seal"], state) == pytest.approx(expected, rel=1e-13)
    assert LAWS["seal"].mass == 0.5
    assert LAWS["seal"].wall == 1.2
    same = fem.MuszynskaSeal(1, **SEAL, stiffness_exponent=0.0, swirl_exponent=0.0)
    s = 0.45 * omega
    expected = -(4 - 0.5 * s**2 - 3j * s) * z - (3 - 1j * s) * v
    assert force_of(same, state) == pytest.approx(expected, rel=1e-13)
    centred = act(same, (0.0, 0.0, *state[2:]))
    np.testing.assert_allclose(act(same, state)[:, 1:5], centred[:, 1:5], atol=1e-13)


def test_at_the_wall_there_is_no_number():
    assert np.isfinite(act(LAWS["seal"], (0.0, 0.0, 0.1, 0.2, 3.0))).all()
    for name in ("seal", "bearing", "half film"):
        for x in (1.2, 1.2 * (1 - 1e-17), 2.0, np.inf):
            for machine in (False, True):
                assert np.isnan(act(LAWS[name], (x, 0.0, 0.1, 0.0, 1.0), machine=machine)).all()


def test_a_cubic_spring():
    z = complex(0.3, 0.4)
    assert force_of(LAWS["spring"], (0.3, 0.4, 9.0, 9.0, 9.0)) == pytest.approx(-(2 + 5 * 0.25) * z)


def test_a_stop():
    assert not act(LAWS["stop"], (0.12, 0.16 - 1e-9, 1.0, 1.0, 5.0)).any(), "not yet there"
    assert not act(LAWS["stop"], (0.21, 0.0, -1.0, 0.0, 5.0)).any(), "leaves faster than the ring follows"
    deep = force_of(LAWS["stop"], (0.0, 0.5, 0.0, 0.0, 1e3))
    assert deep == pytest.approx(complex(0.3, -1) * 50 * 0.3), "friction against the turning surface"
    rolls = force_of(LAWS["stop"], (0.5, 0.0, 0.0, -0.2 * 7, 7.0))
    assert rolls == pytest.approx(-50 * 0.3), "backward whirl that rolls has no friction"
    faster = force_of(LAWS["stop"], (0.5, 0.0, 0.1, -100.0, 7.0))
    assert faster == pytest.approx(complex(-1, 0.3) * (50 * 0.3 + 3 * 0.1))


def film(x, y, vx, vy, omega, line_of_centres, C=3.0):
    out = np.empty((2, 6))
    values = np.array([1.0, C, line_of_centres, 0.0, 1.0, 0.0, 0.0, 0.0])
    law(0, values, *map(float, (x, y, vx, vy, omega)), out)
    return out


def by_quadrature(x, y, vx, vy, omega, line_of_centres):
    """The pressure that Reynolds' equation gives, 6 η ∂(h² ...)/..., integrated where the film is.

    ∂/∂s (h³ / (6 η) ∂p/∂s) = Ω ∂h/∂θ + 2 ∂h/∂t, zero at both ends of the length L = 1; here η R = 3.
    """

    def pressure(theta):
        h = 1 - x * np.cos(theta) - y * np.sin(theta)
        squeeze = omega * (x * np.sin(theta) - y * np.cos(theta)) - 2 * (
            vx * np.cos(theta) + vy * np.sin(theta)
        )
        return -squeeze / (2 * h**3)  # ∫ s (1 − s) ds = 1/6 of the length, 6 η / 2 of the equation

    def there(theta):
        return y * np.cos(theta) - x * np.sin(theta) if line_of_centres else pressure(theta)

    scan = np.linspace(0, 2 * np.pi, 1001)
    ends = [brentq(there, a, b) for a, b in pairwise(scan) if there(a) * there(b) < 0]
    assert len(ends) == 2
    left, right = ends if there(sum(ends) / 2) > 0 else (ends[1], ends[0] + 2 * math.pi)
    theta = (left + right) / 2 + (right - left) / 2 * NODES
    P = 3.0 * pressure(theta) * WEIGHTS * (right - left) / 2
    return -(P * np.cos(theta)).sum(), -(P * np.sin(theta)).sum()


def textbook(x, y, vx, vy, omega):
    """The same on the half circle at the line of centres: with |Ω − 2 ψ'| in the radial force."""
    e2 = x * x + y * y
    turns = (x * vy - y * vx) / e2
    force = np.array(by_quadrature(x, y, vx, vy, omega, True))
    wedge = by_quadrature(x, y, -y * turns, x * turns, omega, True)  # without e'
    radial = np.array([x, y]) * (wedge[0] * x + wedge[1] * y) / e2
    return force - 2 * radial * (turns > omega / 2)


def states():
    rng = np.random.default_rng(0)
    for _ in range(20):
        z = rng.uniform(0.02, 0.8) * np.exp(2j * np.pi * rng.random())
        vx, vy, omega = rng.normal(size=3)
        yield z.real, z.imag, vx, vy, omega


@pytest.mark.parametrize("line_of_centres", [False, True])
def test_the_force_is_the_pressure_integrated(line_of_centres):
    for state in states():
        expected = textbook(*state) if line_of_centres else by_quadrature(*state, False)
        np.testing.assert_allclose(
            film(*state, line_of_centres)[:, 0], expected, rtol=1e-9, atol=1e-9 * np.hypot(*expected)
        )


@pytest.mark.parametrize("angle", [0.0, 1.0, 4.0])
def test_a_damper_on_a_circle(angle):
    """The π film of a centred circular orbit, at ω: −2 ε² / (1 − ε²)² and −π ε / (2 (1 − ε²)^1.5)."""
    damper = fem.SqueezeFilm(1, **BEARING, centring_stiffness=2e6)
    unit, omega, turn = 0.1 * 0.03**3 * 0.05 / 1e-8, 300.0, np.exp(1j * angle)
    for eps in (0.05, 0.4, 0.85):
        z = 1e-4 * eps * turn
        v = 1j * omega * z
        out = act(damper, (z.real, z.imag, v.real, v.imag, SPEED))
        F = complex(*out[:, 0]) / turn + 2e6 * 1e-4 * eps
        radial = -unit * omega * 2 * eps**2 / (1 - eps**2) ** 2
        across = -unit * omega * math.pi * eps / (2 * (1 - eps**2) ** 1.5)
        np.testing.assert_allclose([F.real, F.imag], [radial, across], rtol=1e-10)
        np.testing.assert_array_equal(out[:, 5], 0)  # its ring does not turn


@each_of(
    "kind, changed, words",
    [
        (fem.JournalBearing, BEARING | {"name": "DE", "length": -1}, "bearing 'DE' at node 1: length must"),
        (fem.JournalBearing, BEARING | {"film": "pi"}, "film 'pi' is not known"),
        (fem.SqueezeFilm, BEARING | {"clearance": 1e-200}, "clearance must be above 0, not 1e-200"),
        (fem.MuszynskaSeal, {}, "clearance must be above 0"),
        (fem.CubicSpring, {"stiffness": np.nan}, "stiffness must be finite and not negative"),
        (fem.Stop, {"gap": 1.0}, "stiffness must be above 0"),
    ],
)
def test_impossible_values(kind, changed, words):
    with pytest.raises(ValueError, match=words):
        kind(**{"node": 1, **changed})


@each_of(
    "force, words",
    [
        (fem.Stop(4, stiffness=1.0), "force 1: node 4 does not exist: the rotor has nodes 1 to 3"),
        (fem.Support(1, 1e6), "force 1 must be a NodeForce"),
    ],
)
def test_what_no_rotor_takes(force, words):
    with pytest.raises(ValueError, match=words):
        fem.Rotor([0.4, 0.6], 0.1, forces=[force])
