"""Unbalance response on any supports: closed forms, the exact solution, energy, orbits, bad input."""

import dataclasses
import math

import dense_rotor
import numpy as np
import pytest
from cases import each_of
from exact_solutions import SOLVERS, exactly
from fem_rotors import machines, rotor23, uniform
from hypothesis import given, settings
from hypothesis import strategies as st
from repetitions import FULL as WHOLE
from scipy.linalg import eigh

import fem
from fem.assembly import assemble, dense

FULL = fem.Model(shear=True, rotary_inertia=True, gyroscopic=True)
MASS, EI = 12.0, 2.1e11 * math.pi * 0.04**4 / 64
BENDING = 48 * EI / 0.6**3
OVAL = ((2e7, 3e6), (-9e6, 1.2e7))


def on(*stiffness, times=1, **options):
    """The reference rotor on two equal supports."""
    rotor = fem.refined(rotor23(), times)
    supports = [fem.Support(times * (n - 1) + 1, *stiffness, **options) for n in (2, 22)]
    return dataclasses.replace(rotor, supports=supports)


def jeffcott(stiffness, damping, model=None, **others):
    """A disc amid a massless shaft on two equal supports."""
    return fem.Rotor(
        [0.3, 0.3],
        0.04,
        density=0.0,
        discs=[fem.Disc(2, MASS)],
        supports=[fem.Support(n, stiffness, damping, **others) for n in (1, 3)],
        model=model or fem.Model(),
    )


def closed_form(omega, D):
    """Deflection (x, y) of the disc and of a support per unbalance; D of one support, shape (S, 2, 2)."""
    k = BENDING * np.eye(2)
    total = np.linalg.inv(np.linalg.inv(k) + np.linalg.inv(2 * D))
    f = omega[:, None] ** 2 * np.array([1.0, -1j])
    disc = np.linalg.solve(total - MASS * omega[:, None, None] ** 2 * np.eye(2), f[..., None])
    return disc[..., 0], (np.linalg.inv(2 * D) @ total @ disc)[..., 0]


CASES = {
    "isotropic": (2e7, 4e3),
    "two stiffnesses": (((2e7, 0), (0, 8e6)), ((4e3, 0), (0, 1e3))),
    "journal bearing": (OVAL, ((4e3, 5e2), (5e2, 7e3))),
    "swirl": (((2e7, 2e6), (-2e6, 2e7)), ((4e3, 3e2), (-3e2, 4e3))),
}


@pytest.mark.parametrize("method", SOLVERS)
@pytest.mark.parametrize("case", CASES)
@pytest.mark.parametrize("stand", [None, fem.Pedestal(9.0, (3e7, 5e7), (1e3, 2e3))])
def test_jeffcott_rotor_through_resonance(case, stand, method):
    rotor = jeffcott(*CASES[case], pedestal=stand)
    critical = fem.critical_speeds(rotor, n=1).frequencies[0]
    omega = np.sort([*np.linspace(1.0, 3000.0, 300), critical, critical * (1 - 1e-7), critical * (1 + 1e-9)])
    disc, foot = closed_form(omega, rotor.supports[0].dynamic_stiffness(omega))
    U = 2e-3 * np.exp(0.7j)
    response = SOLVERS[method](fem.unbalance_response, rotor, {2: U}, omega)
    for node, expected in ((2, disc), (1, foot), (3, foot)):
        size = abs(U * expected).max(axis=1)
        for amplitudes, axis in ((response.x, 0), (response.y, 1)):
            assert (abs(amplitudes[:, node - 1] - U * expected[:, axis]) / size).max() < 1e-9
    forces = response.bearing_forces()
    load = U * np.einsum("sij,sj->si", rotor.supports[0].dynamic_stiffness(omega), foot)
    np.testing.assert_allclose(forces.x[:, 1], load[:, 0], rtol=0, atol=1e-9 * abs(load).max())
    np.testing.assert_allclose(forces.y[:, 0], load[:, 1], rtol=0, atol=1e-9 * abs(load).max())


@given(machines(elements=(2, 45)), st.integers(0, 10**6), st.booleans())
@settings(max_examples=40 if WHOLE else 15, deadline=None)
def test_fast_is_exact_is_dense(rotor, seed, uneven):
    rng = np.random.default_rng(seed)
    if uneven:
        rotor = dataclasses.replace(rotor, material_damping=np.linspace(0, 3e-6, rotor.n_elements))
    node = int(rng.integers(1, rotor.n_nodes + 1))
    speeds = np.linspace(20.0, rng.uniform(100, 2500), 21 if WHOLE else 7)
    fast = fem.unbalance_response(rotor, {node: 1.0}, speeds)
    exact = exactly(fem.unbalance_response, rotor, {node: 1.0}, speeds)
    size = exact.major.max(axis=1)[:, None]
    assert (abs(fast.x - exact.x) / size).max() < 1e-6
    assert (abs(fast.y - exact.y) / size).max() < 1e-6
    k = int(rng.integers(len(speeds)))
    if not rotor.model.shear:
        x, y = dense_rotor.response(rotor, {node: 1.0}, speeds[k])
        assert max(abs(exact.x[k] - x).max(), abs(exact.y[k] - y).max()) < 1e-7 * size[k, 0]
    if rotor.symmetric:
        assert not fast.backward.any()
        np.testing.assert_array_equal(fast.y, -1j * fast.x)
        np.testing.assert_array_equal(fast.major, fast.minor)


@pytest.mark.parametrize("rotary_inertia", [False, True])
@pytest.mark.parametrize("shear", [False, True])
@given(machines(elements=(1, 4), tables=False))
@settings(max_examples=10, deadline=None)
def test_what_has_no_mass_is_no_mode_of_its_own(shear, rotary_inertia, rotor):
    model = dataclasses.replace(rotor.model, shear=shear, rotary_inertia=rotary_inertia)
    supports = [dataclasses.replace(support, pedestal=None) for support in rotor.supports]
    rotor = dataclasses.replace(rotor, model=model, supports=supports)
    pencil = fem.whole_rotor(rotor, assemble(rotor))
    M, modes = dense(pencil.mass), fem.lowest_modes(pencil, fem.finite_modes(pencil))
    size = np.sqrt(abs(M.diagonal()))
    assert modes.squares.size == np.linalg.matrix_rank(M / np.outer(size, size), 1e-10)
    mu = eigh(M, dense(pencil.stiffness), eigvals_only=True)
    most = mu[np.argsort(-abs(mu))][: modes.squares.size]
    np.testing.assert_allclose(1 / modes.squares, most, rtol=0, atol=1e-9 * abs(most[0]))
    speeds = np.linspace(20.0, 2500.0, 7)
    fast, exact = (solve(fem.unbalance_response, rotor, {1: 1.0}, speeds) for solve in SOLVERS.values())
    np.testing.assert_array_less(abs(fast.x - exact.x).max(axis=1), 1e-7 * exact.largest)


@pytest.mark.parametrize("method", SOLVERS)
@pytest.mark.parametrize(
    "rotor",
    [
        fem.refined(rotor23(), 3),
        on(((1e8, 2e7), (2e7, 5e7))),
        on(1e8, pedestal=fem.Pedestal(30.0, 2e8)),
        on([8e7, 1.2e8], speeds=[0.0, 3000.0]),
    ],
    ids=["plain", "oval", "pedestal", "table"],
)
def test_an_undamped_rotor_at_a_critical_speed_is_refused(rotor, method):
    rotor = dataclasses.replace(rotor, model=FULL)
    critical = fem.critical_speeds(rotor, 3).frequencies
    for omega in critical:
        with pytest.raises(ValueError, match=r"undamped rotor stands exactly at its critical speed"):
            SOLVERS[method](fem.influence, rotor, [7], [7], [50.0, omega])
    beside = SOLVERS[method](fem.influence, rotor, [7], [7], critical * (1 + 1e-6)).W
    assert np.isfinite(beside).all()
    assert abs(beside).min() > 20


def test_near_a_critical_speed_the_fast_way_keeps_its_digits():
    table = [((8e7, 0), (0, 5e7)), ((9e7, 0), (0, 6e7))]
    rotor = dataclasses.replace(on(table, speeds=[0, 3000.0]), model=FULL)
    critical = fem.critical_speeds(rotor, 2).frequencies
    for distance in (1e-3, 1e-5, 1e-6):
        fast, exact = (
            solver(fem.influence, rotor, [7], [7, 20], critical * (1 + distance)).W
            for solver in SOLVERS.values()
        )
        np.testing.assert_allclose(fast, exact, rtol=1e-5)


def test_at_rest_there_is_no_force():
    for rotor in (uniform(20, supports=[]), rotor23(2e4)):
        response = fem.unbalance_response(rotor, {5: 1e-3}, [0.0, 50.0], nodes=[3])
        assert response.largest[0] == 0.0
        moving = fem.unbalance_response(rotor, {5: 1e-3}, [50.0])
        np.testing.assert_allclose(response.amplitudes[1], moving.amplitudes[0, 2], rtol=1e-9)
    assert not fem.influence(rotor23(), [7], [7], [0.0]).W.any()
    with pytest.raises(ValueError, match="critical speed 0 rad/s"):
        fem.influence(uniform(5), [1], [1], [0.0])


def test_sensors_have_angles():
    speeds = np.linspace(20.0, 800.0, 30)
    rotor = dataclasses.replace(rotor23(2e4), stations={"A": 5})
    W = fem.influence(rotor, [7], ["A", ("A", 30.0), fem.Sensor(5, -60.0)], speeds)
    # A sensor further on with the rotation reads later: its phase lead is smaller.
    np.testing.assert_allclose(W.W[:, 1], W.W[:, 0] * np.exp(-1j * math.pi / 6), rtol=1e-12)
    np.testing.assert_allclose(W.W[:, 2], W.W[:, 0] * np.exp(1j * math.pi / 3), rtol=1e-12)
    assert W.to_frame().sensor.tolist()[:3] == ["A", "A at 30°", "5 at -60°"]
    oval = on(OVAL, 2e4)
    W = fem.influence(oval, [7], [(5, angle) for angle in (0.0, 90.0, 30.0)], speeds).W[:, :, 0]
    response = fem.unbalance_response(oval, {7: 1.0}, speeds)
    x, y = response.x[:, 4], response.y[:, 4]
    turned = math.cos(math.pi / 6) * x + math.sin(math.pi / 6) * y
    np.testing.assert_allclose(W, np.stack((x, y, turned), axis=1), rtol=1e-9)
    np.testing.assert_allclose(response.at((5, 30.0)), turned, rtol=1e-9)


def test_a_peak_on_constant_springs_is_refined_without_a_word_of_numpy():
    # what the banded equations answer near a critical speed is complex; all else is real here
    rotor = fem.Rotor(np.full(1000, 0.003), 0.1, supports=[fem.Support(101, 1e7), fem.Support(901, 1e7)])
    response = fem.unbalance_response(rotor, {500: 1e-4}, np.arange(1.0, 1000.0, 10.0))
    assert fem.response_peaks(response, 500).peaks


@each_of(
    ("rotor", "arguments", "message"),
    [
        (rotor23(1e4), {"speeds": []}, "at least one"),
        (rotor23(1e4), {"speeds": "fast"}, "numbers in rad/s"),
        (rotor23(1e4), {"planes": [25]}, "node 25 does not exist: the rotor has nodes 1 to 24"),
        (rotor23(1e4), {"sensors": ["left"]}, "no station is called 'left'"),
        (rotor23(1e4), {"sensors": []}, "name at least one plane and one sensor"),
        (rotor23(1e4), {"sensors": [(1, 2, 3)]}, "a sensor is a node or a pair"),
        (
            on([5e7, 6e7], 1e3, speeds=[50.0, 900.0], name="left"),
            {"speeds": [100.0, 901.0]},
            r"support 'left' at node 2: its table holds 50 to 900 rad/s, not 901",
        ),
    ],
)
def test_impossible_requests_are_refused(rotor, arguments, message):
    with pytest.raises(ValueError, match=message):
        fem.influence(rotor, **{"planes": [7], "sensors": [2], "speeds": [100.0], **arguments})


@each_of(
    ("unbalance", "message"),
    [
        ({}, "no unbalance is given"),
        ({3: complex("nan")}, "unbalance at node 3 must be finite"),
    ],
)
def test_an_impossible_unbalance_is_refused(unbalance, message):
    with pytest.raises(ValueError, match=message):
        fem.unbalance_response(rotor23(1e4), unbalance, [100.0])


def complex_of(frame, size, phase):
    return frame[size].to_numpy() * np.exp(1j * np.radians(frame[phase].to_numpy()))


def test_response_and_forces_as_table_and_json():
    rotor = dataclasses.replace(on(OVAL, 2e4), stations={"A": 2})
    response = fem.unbalance_response(rotor, {"A": 1e-3, 2: 1e-3j}, [100.0, 200.0], nodes=[2, 9, 22])
    assert response.unbalance == {2: 1e-3 + 1e-3j}
    with pytest.raises(ValueError, match="node 7 was not kept"):
        response.at(7)
    frame = response.to_frame()
    np.testing.assert_allclose(complex_of(frame, "amplitude_m", "phase_deg"), response.x.ravel())
    np.testing.assert_allclose(complex_of(frame, "amplitude_y_m", "phase_y_deg"), response.y.ravel())
    document = response.to_dict(["9", (9, 90.0)])
    assert document["sensors"] == ["9", "9 at 90°"]
    np.testing.assert_allclose(document["amplitude_m"][1], abs(response.y[:, 1]), rtol=1e-12)
    forces = response.bearing_forces()
    table = forces.to_frame()
    for axis in "xy":
        expected = getattr(forces, axis).ravel()
        np.testing.assert_allclose(complex_of(table, f"force_{axis}_N", f"phase_{axis}_deg"), expected)


@given(st.floats(1.0, 5000.0), st.floats(1.0, 5000.0), st.sampled_from([6, 8, 12]))
@settings(max_examples=200, deadline=None)
def test_speeds_written_in_rpm_do_not_fall_off_a_table(low, step, digits):
    support = fem.Support(1, [1e6, 2e6], speeds=(low, low + step))
    for speed, k in ((low, 1e6), (low + step, 2e6)):
        rpm = float(f"{speed * 30 / np.pi:.{digits}g}")
        written = rpm * np.pi / 30
        assert support.at(written)[0][0, 0] == pytest.approx(k, rel=1e-5 * (1 + (low + step) / step))
    with pytest.raises(ValueError, match="not extrapolated"):
        support.at((low + step) * 1.0001)


amplitudes = st.complex_numbers(max_magnitude=1e3, allow_nan=False, allow_infinity=False)


@given(amplitudes, amplitudes)
def test_the_major_axis_stands_at_its_inclination(x, y):
    found = fem.orbits(x, y)
    assert -math.pi / 2 < found.inclination <= math.pi / 2
    # A probe along the major axis reads it, one across it the minor axis, a quarter turn later forward.
    along = fem.probe(x, y, found.inclination)
    across = fem.probe(x, y, found.inclination + np.pi / 2)
    scale = max(abs(x), abs(y), 1e-300)
    assert abs(abs(along) - found.major) <= 1e-6 * scale
    assert abs(abs(across) - found.minor) <= 1e-6 * scale
    if found.minor > 1e-3 * found.major:
        lag = np.angle(along / scale / (across / scale))
        assert math.isclose(lag, found.direction * np.pi / 2, abs_tol=1e-6)


def test_direction_of_whole_modes():
    circle = np.ones(3)
    assert fem.whirl_direction(circle, -1j * circle) == 1
    assert fem.whirl_direction(circle, 1j * circle) == -1
    assert fem.whirl_direction(circle, -1j * np.array([1, 1, -0.5])) == 0
    assert fem.whirl_direction(circle, -1j * np.array([1, 1, -0.001])) == 1
    assert fem.whirl_direction(circle, 2 * circle) == 0
    many = fem.whirl_direction(np.ones((2, 4, 3)), np.full((2, 4, 3), -1j))
    np.testing.assert_array_equal(many, np.ones((2, 4)))
