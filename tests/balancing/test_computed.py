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
    combine,
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


@pytest.mark.parametrize(
    ("options", "factor"),
    [
        ({}, [1, 1]),
        ({"radii": {"right": 0.3, "left": 0.2}}, [0.2, 0.3]),
        ({"quantity": "velocity"}, 1j * SPEEDS[:, None, None]),
        ({"quantity": "acceleration"}, -(SPEEDS[:, None, None] ** 2)),
    ],
)
def test_coefficients_are_what_sensors_read(rotor, options, factor):
    model = model_influence(rotor, PLANES, SENSORS, SPEEDS, **options)
    assert (model.sensors, model.planes) == (("A", "B", "C"), ("left", "right"))
    assert (model.known_errors, model.has_baseline) == (False, False)
    assert model.labels.weight_unit == ("kg" if "radii" in options else "kg_m")
    responses = [exactly(fem.unbalance_response, rotor, {node: 1.0}, SPEEDS) for node in PLANES.values()]
    W = np.array([[response.at(sensor) for response in responses] for sensor in SENSORS.values()])
    np.testing.assert_allclose(model.W, factor * np.moveaxis(W, -1, 0), rtol=1e-5)


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


BAD = [
    ({"relative_error": -0.1}, "relative errors .* must be finite numbers"),
    ({"planes": {"left": 99}}, "99"),
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
    precisions = [1 / each.channels()[0, 0, 2, 2] for each in (measured, computed)]
    assert precisions[1] == pytest.approx((0.05 * 1.02 * abs(W[0, 0, 0])) ** -2)
    expected = np.average([measured.W, computed.W], axis=0, weights=precisions)
    np.testing.assert_allclose(found.W, expected, rtol=1e-9)
    covariance = np.eye(2) / sum(precisions)
    np.testing.assert_allclose(found.channels()[0, 0, 2:, 2:], covariance, atol=1e-9 * covariance[0, 0])


def test_contradictions_are_named():
    made, W, _ = synthetic(np.random.default_rng(2), errors=ERRORS)
    wrong = W.copy()
    wrong[1, 2, 1] *= 3
    measured, computed = estimate_influence(made), model(wrong, 0.1)
    [words] = combine(measured, computed).remarks.warnings
    d = np.array([W[1, 2, 1] - wrong[1, 2, 1]]).view(float)
    S = measured.channels()[1, 2, 4:, 4:] + computed.channels()[1, 2, 4:, 4:]
    ratio = np.sqrt(d @ np.linalg.solve(S, d) / 2)
    assert f"of plane 'B' at sensor 's2', 1909.86 rpm, differ by {ratio:.2g} times their errors" in words


def test_a_plane_that_only_the_model_has():
    made, W, Y0 = synthetic(np.random.default_rng(3), planes=3)
    T = np.vstack((np.zeros(2), np.eye(2))) * GRAM
    Y = Y0 + np.einsum("scp,rp->rsc", W[..., :2], T)
    measured = estimate_influence(job(Y, T, errors=ERRORS, speeds=made.speeds))
    found = combine(measured, model(W[..., [2, 0]], 0.1, "CA"))
    assert tuple(found.planes) == ("A", "B", "C")
    np.testing.assert_allclose(found.W, W, rtol=1e-9)
    np.testing.assert_allclose(found.channels()[..., 6, 6], (0.1 * np.abs(W[..., 2])) ** 2, rtol=1e-9)
    assert (found.channels()[..., 2, 2] < measured.channels()[..., 2, 2]).all()
    assert found.mounted.weights.tolist() == [0, GRAM, 0]


MADE, MODEL_W, _ = synthetic(np.random.default_rng(6), errors=ERRORS)
MEASURED = estimate_influence(MADE)


@pytest.mark.parametrize(
    ("measured", "computed", "words"),
    [
        (stored(MODEL_W), model(MODEL_W, 0.1), "combined by their errors: state those of a reading"),
        (MEASURED, stored(MODEL_W), "state the relative error of the model"),
        (MEASURED, model(MODEL_W, 0.1, unit="kg_m"), r"per g and .* per kg_m: .* with the radii"),
        (MEASURED, model(MODEL_W[:, :3], 0.1, sensors=("s0", "s1", "s2")), "coefficients of sensor 's3'"),
        (MEASURED, model(MODEL_W[:2], 0.1, speeds=(100.0, 200.0)), "no computed coefficients at 2864"),
    ],
)
def test_what_cannot_be_combined(measured, computed, words):
    with pytest.raises(ValueError, match=words):
        combine(measured, computed)
