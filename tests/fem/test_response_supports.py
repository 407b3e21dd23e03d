"""Unbalance response on any supports: closed forms, the exact solution, energy, reciprocity, bad input."""

import dataclasses
import math

import numpy as np
import pytest
from exact_solutions import SOLVERS, exactly
from fem_rotors import machines, rotor23
from hypothesis import given, settings
from hypothesis import strategies as st
from repetitions import FULL as WHOLE

import fem
from fem.assembly import assemble
from fem.elements import dense

FULL = fem.Model(shear=True, rotary_inertia=True, gyroscopic=True)
MASS, EI = 12.0, 2.1e11 * math.pi * 0.04**4 / 64
BENDING = 48 * EI / 0.6**3


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
    "journal bearing": (((2e7, 3e6), (-9e6, 1.2e7)), ((4e3, 5e2), (5e2, 7e3))),
    "swirl": (((2e7, 2e6), (-2e6, 2e7)), ((4e3, 3e2), (-3e2, 4e3))),
}


@pytest.mark.parametrize("method", ["fast", "exact"])
@pytest.mark.parametrize("case", CASES)
@pytest.mark.parametrize("stand", [None, fem.Pedestal(9.0, (3e7, 5e7), (1e3, 2e3))])
def test_jeffcott_rotor_through_resonance(case, stand, method):
    rotor = jeffcott(*CASES[case], pedestal=stand)
    omega = np.linspace(1.0, 3000.0, 700)
    disc, foot = closed_form(omega, rotor.supports[0].dynamic_stiffness(omega))
    response = SOLVERS[method](fem.unbalance_response, rotor, {2: 1.0}, omega)
    for node, expected in ((2, disc), (1, foot), (3, foot)):
        size = np.abs(expected).max(axis=1)
        for found, axis in ((response.x, 0), (response.y, 1)):
            assert (np.abs(found[:, node - 1] - expected[:, axis]) / size).max() < 1e-9
    forces = response.bearing_forces()
    load = np.einsum("sij,sj->si", rotor.supports[0].dynamic_stiffness(omega), foot)
    np.testing.assert_allclose(forces.x[:, 1], load[:, 0], rtol=0, atol=1e-9 * np.abs(load).max())
    np.testing.assert_allclose(forces.y[:, 0], load[:, 1], rtol=0, atol=1e-9 * np.abs(load).max())


def in_both_planes(rotor, omega, node):
    """x and y of all nodes per unbalance at a node, from dense matrices."""
    A = assemble(rotor)
    K, M, G, B = (dense(band) for band in (A.shaft, A.mass, A.gyroscopic, A.material))
    n = A.size
    one, cross = K - omega**2 * M + 1j * omega * B, 1j * omega**2 * G + omega * B
    Z = np.block([[one, cross], [-cross, one]])
    for s in rotor.supports:
        foot = [A.deflection(s.node), n + A.deflection(s.node)]
        Z[np.ix_(foot, foot)] += s.dynamic_stiffness(omega)
    f = np.zeros(2 * n, dtype=complex)
    f[A.deflection(node)], f[n + A.deflection(node)] = omega**2, -1j * omega**2
    q = np.linalg.solve(Z, f)
    return q[A.deflections], q[n + A.deflections]


@given(machines(elements=(2, 40)), st.integers(0, 10**6))
@settings(max_examples=40 if WHOLE else 12, deadline=None)
def test_fast_is_exact_is_dense(rotor, seed):
    rng = np.random.default_rng(seed)
    node = int(rng.integers(1, rotor.n_nodes + 1))
    speeds = np.linspace(20.0, rng.uniform(100, 2500), 21 if WHOLE else 7)
    fast = fem.unbalance_response(rotor, {node: 1.0}, speeds)
    exact = exactly(fem.unbalance_response, rotor, {node: 1.0}, speeds)
    size = exact.major.max(axis=1)[:, None]
    assert (np.abs(fast.x - exact.x) / size).max() < 1e-6
    assert (np.abs(fast.y - exact.y) / size).max() < 1e-6
    k = int(rng.integers(len(speeds)))
    x, y = in_both_planes(rotor, speeds[k], node)
    assert max(np.abs(exact.x[k] - x).max(), np.abs(exact.y[k] - y).max()) < 1e-7 * size[k, 0]
    if rotor.symmetric:
        assert not fast.backward.any()
        np.testing.assert_array_equal(fast.y, -1j * fast.x)
        np.testing.assert_array_equal(fast.major, fast.minor)


@given(machines(elements=(33, 50)))
@settings(max_examples=10, deadline=None)
def test_uneven_material_damping_on_any_supports(rotor):
    beta = np.linspace(0, 3e-6, rotor.n_elements)
    rotor = dataclasses.replace(rotor, material_damping=beta)
    fast = fem.influence(rotor, [2, 9], [1, (5, 90.0)], [100.0, 700.0]).W
    exact = exactly(fem.influence, rotor, [2, 9], [1, (5, 90.0)], [100.0, 700.0]).W
    np.testing.assert_allclose(fast, exact, rtol=0, atol=1e-6 * np.abs(exact).max())


@given(machines(elements=(2, 20)))
@settings(max_examples=25 if WHOLE else 10, deadline=None)
def test_the_power_of_the_unbalance_is_what_supports_and_shaft_take(rotor):
    rotor = dataclasses.replace(rotor, material_damping=0.0)
    speeds = np.array([60.0, 350.0, 1400.0])
    U = {1: 2e-3, rotor.n_nodes: 1e-3j}
    response = fem.unbalance_response(rotor, U, speeds)
    x, y, force = response.x, response.y, speeds**2
    load = np.zeros((3, rotor.n_nodes), dtype=complex)
    for node, u in U.items():
        load[:, node - 1] += u * force
    put_in = -0.5 * speeds * (np.conj(load) * x + np.conj(-1j * load) * y).sum(axis=1).imag
    forces = response.bearing_forces()
    feet = [s.node - 1 for s in rotor.supports]
    taken = 0.5 * speeds * (np.conj(x[:, feet]) * forces.x + np.conj(y[:, feet]) * forces.y).sum(axis=1).imag
    scale = speeds * np.abs(np.conj(load) * x).sum(axis=1)
    np.testing.assert_allclose(put_in / scale, taken / scale, rtol=0, atol=1e-7)


@given(machines(elements=(2, 16), kinds=("symmetric",)))
@settings(max_examples=20 if WHOLE else 8, deadline=None)
def test_reciprocity_and_superposition(rotor):
    nodes = list(range(1, rotor.n_nodes + 1))
    speeds = [40.0, 500.0, 1900.0]
    W = fem.influence(rotor, nodes, nodes, speeds).W
    np.testing.assert_allclose(W, W.transpose(0, 2, 1), rtol=0, atol=1e-7 * np.abs(W).max())
    U = {1: 1e-3 - 2e-3j, rotor.n_nodes: 3e-3j}
    Z = fem.unbalance_response(rotor, U, speeds).amplitudes
    expected = W[:, :, 0] * U[1] + W[:, :, -1] * U[rotor.n_nodes]
    np.testing.assert_allclose(Z, expected, rtol=0, atol=1e-9 * np.abs(expected).max())


def test_reciprocity_on_symmetric_matrices_in_one_direction():
    rotor = dataclasses.replace(
        rotor23(), supports=[fem.Support(n, ((1e8, 2e7), (2e7, 6e7)), 2e4) for n in (2, 22)]
    )
    W = fem.influence(rotor, [7, 12], [7, 12], [100.0, 400.0]).W
    # Unbalance pushes x and, a quarter turn later, y: the force in x alone is the mean of U and its mirror.
    y = fem.influence(rotor, [7, 12], [(7, 90.0), (12, 90.0)], [100.0, 400.0]).W
    forward = (W + 1j * y) / 2
    np.testing.assert_allclose(forward, forward.transpose(0, 2, 1), rtol=1e-7)


def test_sensors_have_angles():
    rotor = dataclasses.replace(rotor23(2e4), stations={"A": 5})
    speeds = np.linspace(20.0, 800.0, 30)
    W = fem.influence(rotor, [7], ["A", ("A", 30.0), fem.Sensor(5, -60.0)], speeds)
    # A sensor further on with the rotation reads later: its phase lead is smaller.
    np.testing.assert_allclose(W.W[:, 1], W.W[:, 0] * np.exp(-1j * math.pi / 6), rtol=1e-12)
    np.testing.assert_allclose(W.W[:, 2], W.W[:, 0] * np.exp(1j * math.pi / 3), rtol=1e-12)
    assert W.to_frame().sensor.tolist()[:3] == ["A", "A at 30°", "5 at -60°"]
    assert "A at 30°" in W.summary()
    oval = dataclasses.replace(
        rotor, supports=[fem.Support(n, CASES["journal bearing"][0], 2e4) for n in (2, 22)]
    )
    angles = [0.0, 90.0, 30.0]
    W = fem.influence(oval, [7], [(5, angle) for angle in angles], speeds).W[:, :, 0]
    response = fem.unbalance_response(oval, {7: 1.0}, speeds)
    np.testing.assert_allclose(W[:, 0], response.x[:, 4], rtol=1e-9)
    np.testing.assert_allclose(W[:, 1], response.y[:, 4], rtol=1e-9)
    c, s = math.cos(math.pi / 6), math.sin(math.pi / 6)
    np.testing.assert_allclose(W[:, 2], c * W[:, 0] + s * W[:, 1], rtol=1e-9)
    np.testing.assert_allclose(response.at((5, 30.0)), W[:, 2], rtol=1e-9)
    # The axes of the orbit are its largest and smallest radius.
    t = np.linspace(0, 2 * np.pi, 2001)
    x, y = (np.real(Z[3, 4] * np.exp(1j * t)) for Z in (response.x, response.y))
    radius = np.hypot(x, y)
    assert response.major[3, 4] == pytest.approx(radius.max(), rel=1e-5)
    assert abs(response.minor[3, 4]) == pytest.approx(radius.min(), rel=1e-3)
    turning = np.sign(x[0] * (y[1] - y[0]) - y[0] * (x[1] - x[0]))
    assert turning == np.sign(response.minor[3, 4])


def test_material_damping_takes_no_part_on_symmetric_supports():
    disc = [fem.Disc(3, 50.0, 6.0, 3.0)]
    supports = [fem.Support(n, 1e8, 2e4) for n in (1, 7)]
    rotor = fem.Rotor(np.full(6, 0.25), 0.1, discs=disc, supports=supports, model=FULL)
    damped = dataclasses.replace(rotor, material_damping=1e-3)
    for method in ("fast", "exact"):
        a, b = (SOLVERS[method](fem.influence, r, [6], [3], [90.0, 300.0]).W for r in (rotor, damped))
        np.testing.assert_array_equal(a, b)


@pytest.mark.parametrize("method", ["fast", "exact"])
def test_an_undamped_rotor_at_a_critical_speed_is_refused(method):
    disc = [fem.Disc(12, 50.0, 6.0, 3.0)]
    for supports in (
        [fem.Support(n, ((1e8, 2e7), (2e7, 5e7))) for n in (2, 22)],
        [fem.Support(n, 1e8, pedestal=fem.Pedestal(30.0, 2e8)) for n in (2, 22)],
        [fem.Support(n, [8e7, 1.2e8], speeds=[0.0, 3000.0]) for n in (2, 22)],
    ):
        rotor = dataclasses.replace(rotor23(), supports=supports, discs=disc, model=FULL)
        critical = fem.critical_speeds(rotor, 3).frequencies
        for omega in critical:
            with pytest.raises(ValueError, match="stands exactly at its critical speed"):
                SOLVERS[method](fem.influence, rotor, [7], [7], [50.0, omega])
        beside = SOLVERS[method](fem.influence, rotor, [7], [7], critical * (1 + 1e-6)).W
        assert np.isfinite(beside).all()
        assert np.abs(beside).min() > 20


def test_near_a_critical_speed_the_fast_way_keeps_its_digits():
    supports = [
        fem.Support(n, [((8e7, 0), (0, 5e7)), ((9e7, 0), (0, 6e7))], speeds=[0, 3000.0]) for n in (2, 22)
    ]
    rotor = dataclasses.replace(rotor23(), supports=supports, model=FULL)
    critical = fem.critical_speeds(rotor, 2).frequencies
    for distance in (1e-3, 1e-5, 1e-6):
        speeds = critical * (1 + distance)
        fast = fem.influence(rotor, [7], [7, 20], speeds).W
        exact = exactly(fem.influence, rotor, [7], [7, 20], speeds).W
        np.testing.assert_allclose(fast, exact, rtol=1e-5)


@pytest.mark.parametrize("n", [10, 60])
def test_a_free_gyroscopic_rotor(n):
    wheel = fem.Rotor(np.full(n, 0.3 / n), 0.05, discs=[fem.Disc.from_geometry(1, 0.02, 0.6)], model=FULL)
    speeds = [50.0, 700.0]
    fast = fem.unbalance_response(wheel, {1: 1e-3}, speeds)
    exact = exactly(fem.unbalance_response, wheel, {1: 1e-3}, speeds)
    np.testing.assert_allclose(fast.amplitudes, exact.amplitudes, rtol=1e-6)


@pytest.mark.parametrize(
    ("speeds", "message"),
    [
        ([100.0, 901.0], r"support 'left' at node 2: its table holds 50 to 900 rad/s, not 901 rad/s"),
        ([49.0], r"not 49 rad/s; it is not extrapolated"),
    ],
)
def test_outside_a_table_there_is_no_answer(speeds, message):
    supports = [fem.Support(2, [5e7, 6e7], 1e3, speeds=[50.0, 900.0], name="left"), fem.Support(22, 1e8)]
    rotor = dataclasses.replace(rotor23(), supports=supports)
    with pytest.raises(ValueError, match=message):
        fem.unbalance_response(rotor, {7: 1.0}, speeds)


@pytest.mark.parametrize(
    ("sensor", "message"),
    [
        ((1, 2, 3), "a sensor is a node or a pair"),
        ((99, 0.0), "node 99"),
        ((1, "x"), "angle must be a number"),
    ],
)
def test_impossible_sensors_are_refused(sensor, message):
    with pytest.raises(ValueError, match=message):
        fem.influence(rotor23(1e4), [7], [sensor], [100.0])


def test_results_as_tables_and_text():
    rotor = dataclasses.replace(
        rotor23(), supports=[fem.Support(n, CASES["journal bearing"][0], 2e4, name=f"b{n}") for n in (2, 22)]
    )
    response = fem.unbalance_response(rotor, {7: 1e-3}, [100.0, 200.0])
    frame = response.to_frame()
    assert list(frame.columns)[2:] == [
        "amplitude_m",
        "phase_deg",
        "amplitude_y_m",
        "phase_y_deg",
        "major_axis_m",
        "minor_axis_m",
    ]
    row = frame[(frame.speed_rad_s == 200) & (frame.node == 9)].iloc[0]
    assert row.amplitude_y_m == pytest.approx(abs(response.y[1, 8]), rel=1e-12)
    forces = response.bearing_forces()
    table = forces.to_frame()
    assert table.shape == (4, 8)
    for axis in "xy":
        size, phase = table[f"force_{axis}_N"].to_numpy(), np.radians(table[f"phase_{axis}_deg"].to_numpy())
        np.testing.assert_allclose(size, np.abs(getattr(forces, axis)).ravel(), rtol=1e-12)
        assert np.isrealobj(size)
        # the phase is that of the force or its lag
        real = getattr(forces, axis).real.ravel()
        np.testing.assert_allclose(np.cos(phase) * size, real, atol=1e-9 * size.max())
    assert table.support.tolist() == ["b2", "b22"] * 2
    assert forces.to_dict()["force_x_N"][1][0] == pytest.approx(abs(forces.x[0, 1]), rel=1e-12)
    assert "b22" in forces.summary()
    assert (forces.largest >= np.abs(forces.x) - 1e-9).all()
    document = response.to_dict(["9", (9, 90.0)])
    assert document["sensors"] == ["9", "9 at 90°"]
    assert document["amplitude_m"][1][1] == pytest.approx(abs(response.y[1, 8]), rel=1e-12)
