import dataclasses
import json
import math
import tracemalloc

import numpy as np
import pytest
from cases import each_of
from exact_solutions import SOLVERS, exactly
from fem_rotors import machines, mirrored, refined, rotor23, rotors, uniform
from hypothesis import assume, given, settings
from hypothesis import strategies as st
from repetitions import FULL

import fem

K, C, MASS = 2e7, 4e3, 12.0


def laval(damping=C):
    """A disc amid a massless shaft on two damped supports."""
    return fem.Rotor(
        [0.3, 0.3],
        0.04,
        density=0.0,
        discs=[fem.Disc(2, MASS)],
        supports=[fem.Support(1, K, damping), fem.Support(3, K, damping)],
        stations={"disc": 2},
    )


def laval_closed_form(omega, damping=C):
    """Disc and support amplitude per unbalance at the disc."""
    bending = 48 * 2.1e11 * math.pi * 0.04**4 / 64 / 0.6**3
    support = 2 * (K + 1j * omega * damping)
    total = 1 / (1 / bending + 1 / support)
    disc = omega**2 / (total - MASS * omega**2)
    return disc, disc * total / support


def worst(a, b):
    """Largest difference relative to the largest amplitude at each speed."""
    return float((np.abs(a - b).max(axis=(1, 2)) / np.abs(b).max(axis=(1, 2))).max())


@pytest.mark.parametrize("method", ["fast", "exact"])
def test_laval_rotor_on_damped_supports_through_resonance(method):
    critical = fem.critical_speeds(laval(), n=1).frequencies[0]
    speeds = np.concatenate(
        (np.linspace(0.0, 3 * critical, 301), [critical], critical * np.array([1 - 1e-7, 1 + 1e-9]))
    )
    response = SOLVERS[method](fem.unbalance_response, laval(), {"disc": 2e-3 * np.exp(0.7j)}, speeds)
    disc, support = laval_closed_form(speeds)
    U = 2e-3 * np.exp(0.7j)
    np.testing.assert_allclose(response.at("disc"), U * disc, rtol=1e-9)
    np.testing.assert_allclose(response.at(1), U * support, rtol=1e-9)
    np.testing.assert_allclose(response.amplitudes[:, 2], U * support, rtol=1e-9)
    assert response.amplitudes[0].max() == 0.0


def test_the_vibration_lags_the_unbalance_by_a_right_angle_at_resonance():
    rotor = laval(damping=400.0)
    critical = fem.critical_speeds(rotor, n=1).frequencies[0]
    W = fem.influence(rotor, ["disc"], ["disc"], [0.05 * critical, critical, 20 * critical]).W[:, 0, 0]
    np.testing.assert_allclose(np.degrees(np.angle(W[:2])), [0, -90], atol=4)
    assert abs(np.degrees(np.angle(-W[2]))) < 4
    assert abs(W[2] + 1 / MASS) < 0.01 / MASS  # far above, the disc turns about its mass centre


@given(rotors(elements=(2, 55)), st.integers(0, 10**6))
@settings(max_examples=60, deadline=None)
def test_the_fast_way_is_the_exact_solution(rotor, seed):
    rng = np.random.default_rng(seed)
    planes = rng.integers(1, rotor.n_nodes + 1, 3).tolist()
    sensors = rng.integers(1, rotor.n_nodes + 1, 4).tolist()
    top = fem.critical_speeds(rotor, n=4).frequencies[rng.integers(0, 4)] * rng.uniform(0.5, 2)
    speeds = np.linspace(0.02 * top, top, 37)
    fast = fem.influence(rotor, planes, sensors, speeds)
    exact = exactly(fem.influence, rotor, planes, sensors, speeds)
    # rounding costs the banded equations more where hardly any damping limits a response
    assert worst(fast.W, exact.W) < 1e-6 or np.abs(fast.W).max() > 1e3 / rotor.total_mass
    assert fast.W.shape == (37, 4, 3)


@given(rotors())
@settings(max_examples=25, deadline=None)
def test_reciprocity_and_superposition(rotor):
    nodes = list(range(1, rotor.n_nodes + 1))
    speeds = [37.0, 400.0, 2000.0]
    W = fem.influence(rotor, nodes, nodes, speeds).W
    np.testing.assert_allclose(W, W.transpose(0, 2, 1), rtol=0, atol=1e-7 * np.abs(W).max())
    U = {1: 1e-3 - 2e-3j, rotor.n_nodes: 3e-3j}
    Z = fem.unbalance_response(rotor, U, speeds).amplitudes
    expected = W[:, :, 0] * U[1] + W[:, :, -1] * U[rotor.n_nodes]
    np.testing.assert_allclose(Z, expected, rtol=0, atol=1e-10 * np.abs(expected).max())
    backwards = fem.influence(mirrored(rotor), nodes, nodes, speeds).W
    np.testing.assert_allclose(backwards[:, ::-1, ::-1], W, rtol=0, atol=1e-6 * np.abs(W).max())


@given(rotors())
@settings(max_examples=25, deadline=None)
def test_the_power_of_the_unbalance_is_what_the_dampers_take(rotor):
    U = {1: 2e-3, rotor.n_nodes: 1e-3j}
    speeds = np.array([50.0, 300.0, 1500.0])
    Z = fem.unbalance_response(rotor, U, speeds).amplitudes
    forces = sum(np.conj(u) * speeds**2 * Z[:, node - 1] for node, u in U.items())
    put_in = -speeds * forces.imag
    taken = sum(s.damping * speeds**2 * np.abs(Z[:, s.node - 1]) ** 2 for s in rotor.supports)
    scale = speeds * np.abs(forces)
    np.testing.assert_allclose(put_in / scale, taken / scale, rtol=0, atol=1e-7)


@pytest.mark.parametrize("damping", [1e-3, 1e2, 1e6, 1e10, 1e14])
def test_any_damping_from_none_to_a_lock(damping):
    rotor = refined(rotor23(damping), 2)
    rotor = fem.Rotor(
        rotor.length,
        rotor.outer_diameter,
        discs=rotor.discs,
        supports=[*rotor.supports, fem.Support(20, 0.0, damping)],
    )
    speeds = np.linspace(7.0, 3000.0, 200)
    fast = fem.influence(rotor, [13, 24], [3, 20, 47], speeds).W
    assert worst(fast, exactly(fem.influence, rotor, [13, 24], [3, 20, 47], speeds).W) < 1e-6


def test_a_free_rotor_has_a_response_and_approaches_a_free_body():
    rotor = uniform(20)
    Z = fem.unbalance_response(rotor, {11: 1e-3}, [0.5]).amplitudes[0]
    np.testing.assert_allclose(Z, -1e-3 / rotor.total_mass, rtol=1e-6)
    # The banded equations lose digits where ω² M is small beside K.
    exact = exactly(fem.unbalance_response, rotor, {11: 1e-3}, [0.5])
    np.testing.assert_allclose(exact.amplitudes[0], Z, rtol=1e-3)
    fine = fem.influence(uniform(60), [1, 31], [1, 31, 61], [100.0, 5000.0]).W
    coarse = exactly(fem.influence, rotor, [1, 11], [1, 11, 21], [100.0, 5000.0]).W
    assert worst(coarse, fine) < 2e-4


@pytest.mark.parametrize("method", ["fast", "exact"])
@pytest.mark.parametrize("times", [1, 3])
def test_an_undamped_rotor_at_its_critical_speed_is_refused(method, times):
    rotor = refined(rotor23(), times)
    critical = fem.critical_speeds(rotor).frequencies
    for omega in critical:
        with pytest.raises(
            ValueError, match=r"undamped rotor stands exactly at its critical speed .*no limit"
        ):
            SOLVERS[method](fem.influence, rotor, [7], [7], [50.0, omega])
    with pytest.raises(ValueError, match="critical speed 0 rad/s"):
        SOLVERS[method](fem.influence, uniform(5), [1], [1], [0.0])
    near = SOLVERS[method](fem.influence, rotor, [7], [7], critical * (1 + 1e-6)).W
    assert np.isfinite(near).all()
    assert np.abs(near).min() > 50


def test_at_a_damped_critical_speed_the_exact_solution_takes_over():
    rotor = rotor23(2e4)
    critical = fem.critical_speeds(rotor).frequencies
    beside = critical * (1 + 1e-6)
    at = fem.influence(rotor, [7, 12], [2, 18], critical).W
    np.testing.assert_allclose(at, exactly(fem.influence, rotor, [7, 12], [2, 18], beside).W, rtol=2e-3)
    np.testing.assert_allclose(at, exactly(fem.influence, rotor, [7, 12], [2, 18], critical).W, rtol=1e-12)


def test_a_fine_mesh_is_said():
    rotor = refined(rotor23(1.0), 20)
    assert any("mesh is fine" in text for text in fem.influence(rotor, [121], [121], [100.0]).warnings)


@pytest.mark.parametrize("rotor", [uniform(20), rotor23(2e4)])
def test_at_rest_there_is_no_force(rotor):
    found = fem.unbalance_response(rotor, {5: 1e-3}, [0.0, 50.0], nodes=[3])
    assert found.largest[0] == 0.0
    moving = fem.unbalance_response(rotor, {5: 1e-3}, [50.0])
    np.testing.assert_allclose(found.amplitudes[1], moving.amplitudes[0, 2], rtol=1e-9)


@each_of(
    ("arguments", "message"),
    [
        ({"speeds": []}, "at least one"),
        ({"speeds": [1.0, float("nan")]}, "speeds must be finite and not negative, in rad/s"),
        ({"speeds": [-1.0]}, "speeds must be finite and not negative"),
        ({"speeds": "fast"}, "speeds must be numbers in rad/s"),
        ({"speeds": [[1.0]]}, "one number or a list"),
        ({"planes": [25]}, "node 25 does not exist: the rotor has nodes 1 to 24"),
        ({"sensors": ["left"]}, "no station is called 'left'"),
        ({"sensors": []}, "name at least one plane and one sensor"),
    ],
)
def test_impossible_requests_are_refused(arguments, message):
    with pytest.raises(ValueError, match=message):
        fem.influence(rotor23(1e4), **{"planes": [7], "sensors": [2], "speeds": [100.0], **arguments})


@pytest.mark.parametrize(
    ("unbalance", "message"),
    [
        ({}, "no unbalance is given"),
        ({3: complex("nan")}, "unbalance at node 3 must be finite"),
        ({99: 1}, "node 99"),
    ],
)
def test_an_impossible_unbalance_is_refused(unbalance, message):
    with pytest.raises(ValueError, match=message):
        fem.unbalance_response(rotor23(1e4), unbalance, [100.0])


def test_results_as_tables_json_and_text():
    rotor = fem.Rotor(
        rotor23().length,
        rotor23().outer_diameter,
        discs=[*rotor23().discs, fem.Disc(3, 1.0, 0.2)],
        supports=rotor23(2e4).supports,
        stations={"A": 2},
    )
    W = fem.influence(rotor, [7, 12], ["A", 22], [100.0, 200.0, 300.0])
    frame = W.to_frame()
    assert list(frame.columns) == ["speed_rad_s", "sensor", "plane", "influence_m_per_kg_m", "phase_lead_deg"]
    row = frame[(frame.speed_rad_s == 200.0) & (frame.sensor == 22) & (frame.plane == 7)].iloc[0]
    back = row.influence_m_per_kg_m * np.exp(1j * np.radians(row.phase_lead_deg))
    assert back == pytest.approx(W.W[1, 1, 0], rel=1e-12)
    assert frame.phase_deg.between(0, 360, inclusive="left").all()
    document = json.loads(json.dumps(W.to_dict()))
    assert len(document["rows"]) == 12
    assert document["rows"][0]["sensor"] == "A"
    assert "ignored" in document["warnings"][0]
    assert "3 speeds from 954.93 to 2864.79 rpm (100 to 300 rad/s)" in W.answer.judgement
    assert "phase lead" in fem.influence(rotor, [7], [2], 100.0).summary()
    with pytest.raises(ValueError, match="read-only"):
        W.W[0, 0, 0] = 0

    Z = fem.unbalance_response(rotor, {"A": 1e-3, 2: 1e-3j}, [100.0, 135.0])
    assert Z.unbalance == {2: 1e-3 + 1e-3j}
    document = json.loads(json.dumps(Z.to_dict(["A", 22])))
    assert document["sensors"] == ["A", 22]
    assert np.shape(document["amplitude_m"]) == (2, 2)
    assert document["amplitude_m"][1][0] == pytest.approx(abs(Z.at(22)[0]), rel=1e-12)
    assert len(Z.to_frame()) == 48
    assert "µm peak at node" in Z.sentence()
    assert repr(Z).count("\n") == 0
    assert Z._repr_html_().count("<table") == 1
    assert f"{1e6 * Z.largest.max():.4g} µm" in Z.summary()
    assert "Warning: " in Z.summary()


def test_no_unbalance_no_vibration():
    for rotor in (rotor23(1e4), refined(rotor23(1e4), 3)):
        assert not fem.unbalance_response(rotor, {5: 0.0}, [10.0, 500.0]).amplitudes.any()


@given(machines(elements=(2, 12), tables=False), st.floats(-9, -3))
@settings(max_examples=15, deadline=None)
def test_a_free_rotor_far_below_its_first_critical_speed_is_a_free_body(rotor, power):
    free = dataclasses.replace(rotor, supports=[])
    try:
        first = fem.critical_speeds(free, 1).frequencies[-1]
    except ValueError:  # more polar than diametral inertia
        assume(False)
    centre = (
        float(
            (free.density * free.area * free.length) @ ((free.positions[:-1] + free.positions[1:]) / 2)
            + sum(disc.mass * free.positions[disc.node - 1] for disc in free.discs)
        )
        / free.total_mass
    )
    # Equal and opposite about the centre of mass: two planes that make a force there without a couple.
    ends, where = (1, free.n_nodes), free.positions[[0, -1]]
    share = (where[1] - centre) / (where[1] - where[0])
    found = fem.unbalance_response(
        free, {ends[0]: 1e-3 * share, ends[1]: 1e-3 * (1 - share)}, [10**power * first]
    )
    np.testing.assert_allclose(
        found.amplitudes[0], -1e-3 / free.total_mass, rtol=1e-6 + 1e3 * 10 ** (2 * power)
    )
    assert found.warnings == tuple(text for text in found.warnings if "ignored" in text)


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


def test_memory_grows_with_the_answer():
    """Of 600 elements at 4,000 speeds two nodes are asked for: all nodes would be 77 MB and more."""
    rotor = refined(rotor23(2e4), 26)
    speeds = np.linspace(20.0, 900.0, 4000 if FULL else 1000)
    tracemalloc.start()
    try:
        found = fem.unbalance_response(rotor, {100: 1e-3}, speeds, nodes=[50, 300])
        peak = tracemalloc.get_traced_memory()[1]
    finally:
        tracemalloc.stop()
    whole = 2 * 16 * speeds.size * rotor.n_nodes
    assert peak < 12e6 + 0.1 * whole
    every = fem.unbalance_response(rotor, {100: 1e-3}, speeds[::97])
    np.testing.assert_allclose(found.amplitudes[::97], every.amplitudes[:, [49, 299]], rtol=1e-6)
    np.testing.assert_array_equal(found.largest_node[::97], every.major.argmax(axis=1) + 1)
    with pytest.raises(ValueError, match="node 7 was not kept"):
        found.at(7)


def test_a_peak_on_constant_springs_is_refined_without_a_word_of_numpy():
    # what the banded equations answer near a critical speed is complex; all else is real here
    rotor = fem.Rotor(np.full(1000, 0.003), 0.1, supports=[fem.Support(101, 1e7), fem.Support(901, 1e7)])
    response = fem.unbalance_response(rotor, {500: 1e-4}, np.arange(1.0, 1000.0, 10.0))
    assert fem.response_peaks(response, 500).peaks


amplitudes = st.complex_numbers(max_magnitude=1e3, allow_nan=False, allow_infinity=False)


@given(amplitudes, amplitudes)
def test_axes_are_those_of_the_traced_curve(x, y):
    found = fem.orbits(x, y)
    t = np.linspace(0, 2 * np.pi, 4001)
    radius = np.abs(np.real(x * np.exp(1j * t)) + 1j * np.real(y * np.exp(1j * t)))
    size = max(float(radius.max()), 1e-300)
    assert abs(found.major - radius.max()) <= 1e-5 * size
    assert abs(found.minor - radius.min()) <= 2e-3 * size


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
        lag = np.angle(along / across)
        assert math.isclose(lag, found.direction * np.pi / 2, abs_tol=1e-6)


def test_known_ellipses():
    x, y = np.array([3.0, 1.0, 2j, 1.0, 0.0]), np.array([-2j, 1j, 1.0, 1.0, 5.0])
    found = fem.orbits(x, y)
    np.testing.assert_allclose(found.major, [3, 1, 2, math.sqrt(2), 5])
    np.testing.assert_allclose(found.minor, [2, 1, 1, 0, 0], atol=1e-15)
    np.testing.assert_allclose(found.inclination, [0, 0, 0, math.pi / 4, math.pi / 2])
    np.testing.assert_array_equal(found.direction, [1, -1, 1, 0, 0])


def test_turning_the_axes_turns_the_inclination():
    x, y, angle = 3.0 + 1j, 0.5 - 2j, 0.4
    found, turned = fem.orbits(x, y), fem.orbits(*(fem.probe(x, y, angle + a) for a in (0, np.pi / 2)))
    assert turned.inclination == pytest.approx(float(found.inclination - angle), abs=1e-12)
    assert turned.major == pytest.approx(float(found.major))
    assert turned.direction == found.direction


def test_direction_of_whole_modes():
    circle = np.ones(3)
    assert fem.whirl_direction(circle, -1j * circle) == 1
    assert fem.whirl_direction(circle, 1j * circle) == -1
    assert fem.whirl_direction(circle, -1j * np.array([1, 1, -0.5])) == 0
    assert fem.whirl_direction(circle, -1j * np.array([1, 1, -0.001])) == 1
    assert fem.whirl_direction(circle, 2 * circle) == 0
    many = fem.whirl_direction(np.ones((2, 4, 3)), np.full((2, 4, 3), -1j))
    np.testing.assert_array_equal(many, np.ones((2, 4)))


def test_a_standing_rotor_alone():
    # one speed, zero: nothing whirls, and unbalance does nothing
    found = fem.influence(rotor23(), [7], [7], [0.0])
    assert not found.W.any()
