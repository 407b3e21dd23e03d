"""Coefficients of a model, and combined with measured ones."""

from dataclasses import replace

import numpy as np
import pytest
from balancing_data import GRAM, job, stored, synthetic
from exact_solutions import exactly
from fem_rotors import rotor23

import fem
from balancing import (
    Labels,
    ReadingErrors,
    Trials,
    combine,
    correct,
    estimate_influence,
    model_influence,
    with_parameters,
)

PLANES = {"left": 7, "right": 18}
SENSORS = {"A": 4, "B": (20, 30.0), "C": fem.Sensor(12, -45.0)}
SPEEDS = np.array([120.0, 300.0, 500.0])


@pytest.fixture(scope="module")
def rotor():
    return rotor23(damping=2e4)


def test_coefficients_are_what_sensors_read_per_unbalance(rotor):
    model = model_influence(rotor, PLANES, SENSORS, SPEEDS)
    assert (model.sensors, model.planes) == (("A", "B", "C"), ("left", "right"))
    assert (model.labels.weight_unit, model.known_errors, model.has_baseline) == ("kg_m", False, False)
    for p, node in enumerate(PLANES.values()):
        response = exactly(fem.unbalance_response, rotor, {node: 1.0}, SPEEDS)
        for c, sensor in enumerate(SENSORS.values()):
            np.testing.assert_allclose(model.W[:, c, p], response.at(sensor), rtol=1e-5)


def test_per_mass_at_the_radius(rotor):
    plain = model_influence(rotor, PLANES, SENSORS, SPEEDS)
    model = model_influence(rotor, PLANES, SENSORS, SPEEDS, radii={"right": 0.3, "left": 0.2})
    np.testing.assert_allclose(model.W, plain.W * [0.2, 0.3], rtol=1e-14)
    assert model.labels.weight_unit == "kg"


def test_velocity_and_acceleration(rotor):
    plain = model_influence(rotor, PLANES, SENSORS, SPEEDS)
    speed = SPEEDS[:, None, None]
    for quantity, factor in (("velocity", 1j * speed), ("acceleration", -(speed**2))):
        model = model_influence(rotor, PLANES, SENSORS, SPEEDS, quantity=quantity)
        np.testing.assert_allclose(model.W, factor * plain.W, rtol=1e-12)


def test_key_phasor_that_stands_elsewhere(rotor):
    """Sampled signal: x(t) after the pulse, which comes when the mark has turned to the key phasor."""
    kappa, omega, U = 50.0, 300.0, 2e-3 * np.exp(0.7j)
    response = fem.unbalance_response(rotor, {7: U}, [omega])
    pulse = np.radians(kappa) / omega
    after = np.linspace(0, 2 * np.pi / omega, 64, endpoint=False)
    signal = np.real(response.at(SENSORS["B"])[0] * np.exp(1j * omega * (pulse + after)))
    read = 2 * np.mean(signal * np.exp(-1j * omega * after))
    model = model_influence(rotor, {"left": 7}, SENSORS, [omega], key_phasor=kappa)
    assert model.W[0, 1, 0] * U == pytest.approx(read, rel=1e-9)


def test_covariance_is_the_stated_relative_error(rotor):
    model = model_influence(rotor, PLANES, SENSORS, SPEEDS, relative_error=0.1)
    std = 0.1 * np.abs(model.W)
    np.testing.assert_allclose(np.sqrt(model.channels()[..., 2, 2]), std[..., 0], rtol=1e-14)
    np.testing.assert_allclose(np.sqrt(model.channels()[..., 5, 5]), std[..., 1], rtol=1e-14)
    assert np.count_nonzero(model.channels()) == model.W.size * 2


def run(rotor, U, errors=None):
    response = fem.unbalance_response(rotor, U, SPEEDS)
    readings = np.array([response.at(sensor) for sensor in SENSORS.values()]).T[None]
    return Trials(("now",), SPEEDS, tuple(SENSORS), (), readings, np.zeros((1, 0)), errors, Labels())


def test_one_run_and_the_model_balance_the_rotor(rotor):
    U = {7: 3e-3 * np.exp(1j), 18: -2e-3j}
    found = correct(model_influence(rotor, PLANES, SENSORS, SPEEDS), run(rotor, U))
    np.testing.assert_allclose(found.weights, [-3e-3 * np.exp(1j), 2e-3j], rtol=1e-6)
    assert np.abs(found.after).max() < 1e-6 * np.abs(found.before).max()


def test_the_error_of_the_model_goes_into_that_of_the_weights(rotor):
    baseline = run(rotor, {7: 3e-3, 18: -2e-3j}, ReadingErrors(1e-4, 1e-4))
    model = model_influence(rotor, PLANES, SENSORS, SPEEDS, relative_error=0.02)
    found = correct(model, baseline, method="least-squares")
    rng = np.random.default_rng(0)
    true = model_influence(rotor, PLANES, SENSORS, SPEEDS).W.reshape(-1, 2)
    noise = rng.standard_normal((2, 4000, *true.shape))
    wrong = true + 0.02 * np.abs(true) * (noise[0] + 1j * noise[1])
    drawn = np.linalg.pinv(wrong) @ -baseline.mean[0].ravel()
    spread = np.sqrt(np.var(drawn, axis=0) / 2)
    stated = np.sqrt(np.diag(found.covariance).reshape(2, 2).mean(axis=1))
    np.testing.assert_allclose(stated, spread, rtol=0.15)


BAD = [
    ({"relative_error": -0.1}, "relative errors .* must be finite numbers"),
    ({"relative_error": np.nan}, "relative errors"),
    ({"radii": {"left": 0.2}}, r"radius of every plane \(left, right\)"),
    ({"radii": {"left": 0.2, "right": 0.2, "mid": 1.0}}, "and of no other one"),
    ({"radii": {"left": 0.2, "right": 0.0}}, "a finite number > 0 m"),
    ({"speeds": [0.0]}, "greater than zero"),
    ({"planes": {"left": 99}}, "99"),
    ({"sensors": {"A": "nowhere"}}, "nowhere"),
]


@pytest.mark.parametrize(("change", "words"), BAD)
def test_what_cannot_be(rotor, change, words):
    arguments = {"planes": PLANES, "sensors": SENSORS, "speeds": SPEEDS} | change
    with pytest.raises(ValueError, match=words):
        model_influence(rotor, **arguments)


ERRORS = ReadingErrors(0.03, 0.03)


def model(W, error, planes="AB", sensors=("s0", "s1", "s2", "s3"), speeds=(100.0, 200.0, 300.0), unit="g"):
    """Computed coefficients as `model_influence` makes them."""
    known = stored(W, speeds=np.array(speeds), planes=planes, labels=Labels(weight_unit=unit))
    return with_parameters(replace(known, sensors=sensors), np.zeros((0, *W.shape)), error)


def test_one_number_is_the_mean_weighted_by_precision():
    made, W, _ = synthetic(np.random.default_rng(0), planes=1, sensors=1, speeds=1, errors=ERRORS)
    measured = estimate_influence(made)
    computed = model(1.02 * W, 0.05, "A", ("s0",), (100.0,))
    found = combine(measured, computed)
    variance = measured.channels()[0, 0, 2, 2], (0.05 * 1.02 * abs(W[0, 0, 0])) ** 2
    np.testing.assert_allclose(
        measured.channels()[0, 0, 2:, 2:], variance[0] * np.eye(2), atol=1e-9 * variance[0]
    )
    total = 1 / variance[0] + 1 / variance[1]
    expected = (measured.W / variance[0] + computed.W / variance[1]) / total
    np.testing.assert_allclose(found.W, expected, rtol=1e-12)
    np.testing.assert_allclose(
        found.channels()[0, 0, 2:, 2:], np.eye(2) / total, rtol=1e-9, atol=1e-9 / total
    )
    assert found.remarks == measured.remarks
    assert (found.reading.errors, found.labels) == (ERRORS, measured.labels)


def test_contradictions_are_named():
    made, W, _ = synthetic(np.random.default_rng(2), errors=ERRORS)
    wrong = W.copy()
    wrong[1, 2, 1] *= 3
    measured = estimate_influence(made)
    computed = model(wrong, 0.1)
    [words] = combine(measured, computed).remarks.warnings
    S = measured.channels()[1, 2, 4:, 4:] + computed.channels()[1, 2, 4:, 4:]
    d = np.array([W[1, 2, 1] - wrong[1, 2, 1]]).view(float)
    ratio = np.sqrt(d @ np.linalg.solve(S, d) / 2)
    assert words == (
        f"measured and computed coefficient of plane 'B' at sensor 's2', 1909.86 rpm, differ by {ratio:.2g} "
        "times their errors: the model, the trial runs or the stated errors are wrong"
    )


def test_a_plane_that_only_the_model_has():
    rng = np.random.default_rng(3)
    made, W, Y0 = synthetic(rng, planes=3)
    two = job(Y0 + np.einsum("scp,rp->rsc", W[..., :2], np.vstack((np.zeros(2), np.eye(2))) * GRAM),
              np.vstack((np.zeros(2), np.eye(2))) * GRAM, errors=ERRORS, speeds=made.speeds)  # fmt: skip
    measured = estimate_influence(two)
    found = combine(measured, model(W[..., [2, 0]], 0.1, "CA"))
    assert tuple(found.planes) == ("A", "B", "C")
    np.testing.assert_allclose(found.W, W, rtol=1e-9)
    np.testing.assert_allclose(found.channels()[..., 6, 6], (0.1 * np.abs(W[..., 2])) ** 2, rtol=1e-9)
    assert (found.channels()[..., 2, 2] < measured.channels()[..., 2, 2]).all()
    assert found.mounted.weights.tolist() == [0, GRAM, 0]
    expected = np.linalg.lstsq(W.reshape(-1, 3), -Y0.ravel(), rcond=None)[0]
    np.testing.assert_allclose(correct(found, method="least-squares").weights, expected, rtol=1e-6)


def test_what_only_the_model_has_of_sensors_and_speeds_stays_out():
    made, W, _ = synthetic(np.random.default_rng(4), errors=ERRORS)
    measured = estimate_influence(made)
    names = ("new", *measured.sensors[::-1])
    more = np.concatenate((W[:, :1], W[:, ::-1]), axis=1)
    found = combine(
        measured, model(np.concatenate((more[:1], more)), 0.1, sensors=names, speeds=(50, 100.2, 200, 300))
    )
    assert found.sensors == measured.sensors
    np.testing.assert_array_equal(found.speeds, measured.speeds)
    np.testing.assert_allclose(found.W, W, rtol=1e-9)
    assert found.has_baseline


def test_what_cannot_be_combined():
    made, W, _ = synthetic(np.random.default_rng(6), errors=ERRORS)
    measured, computed = estimate_influence(made), model(W, 0.1)
    with pytest.raises(ValueError, match="combined by their errors: state those of a reading"):
        combine(stored(W), computed)
    with pytest.raises(ValueError, match="state the relative error of the model"):
        combine(measured, stored(W))
    with pytest.raises(ValueError, match=r"per g and .* per kg_m: .* with the radii"):
        combine(measured, model(W, 0.1, unit="kg_m"))
    per_unbalance = replace(measured, labels=replace(measured.labels, weight_unit="g_mm"))
    with pytest.raises(ValueError, match="or without, per unbalance"):
        combine(per_unbalance, computed)
    with pytest.raises(ValueError, match="no computed coefficients of sensor 's3'"):
        combine(measured, model(W[:, :3], 0.1, sensors=("s0", "s1", "s2")))
    with pytest.raises(ValueError, match="no computed coefficients at 2864"):
        combine(measured, model(W[:2], 0.1, speeds=(100.0, 200.0)))
