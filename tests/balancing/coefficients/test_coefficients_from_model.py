"""Influence coefficients computed from a rotor model."""

import numpy as np
import pytest
from exact_solutions import exactly
from fem_rotors import rotor23

import fem
from balancing import Labels, ReadingErrors, Trials, correct
from balancing.coefficients.coefficients_from_model import modal_shapes, model_influence

PLANES = {"left": 7, "right": 18}
SENSORS = {"A": 4, "B": (20, 30.0), "C": fem.Sensor(12, -45.0)}
SPEEDS = np.array([120.0, 300.0, 500.0])


@pytest.fixture(scope="module")
def rotor():
    return rotor23(damping=2e4)


def test_coefficients_are_what_sensors_read_per_unbalance(rotor):
    model = model_influence(rotor, PLANES, SENSORS, SPEEDS)
    assert (model.sensors, model.planes) == (("A", "B", "C"), ("left", "right"))
    assert (model.labels.weight_unit, model.covariance, model.baseline) == ("kg_m", None, None)
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
    np.testing.assert_allclose(np.sqrt(model.covariance[..., 2, 2]), std[..., 0], rtol=1e-14)
    np.testing.assert_allclose(np.sqrt(model.covariance[..., 5, 5]), std[..., 1], rtol=1e-14)
    assert np.count_nonzero(model.covariance) == model.W.size * 2


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
    stated = np.sqrt(np.trace(found.plane_covariance, axis1=1, axis2=2) / 2)
    np.testing.assert_allclose(stated, spread, rtol=0.05)


def test_shapes_are_those_of_the_critical_speeds(rotor):
    shapes = modal_shapes(rotor, {"end": 1, "middle": 12, "right": 18}, 3)
    modes = fem.critical_speeds(rotor, n=3)
    np.testing.assert_allclose(
        shapes, modes.shapes[[0, 11, 17]] / np.abs(modes.shapes).max(axis=0), rtol=1e-12
    )
    np.testing.assert_array_equal(modal_shapes(rotor, [1, 12, 18], 3), shapes)


BAD = [
    ({"relative_error": -0.1}, "relative error of the model must be a finite number"),
    ({"relative_error": np.nan}, "relative error of the model"),
    ({"quantity": "speed"}, "displacement, velocity, acceleration, not 'speed'"),
    ({"key_phasor": np.inf}, "key phasor must be finite"),
    ({"radii": {"left": 0.2}}, "lacking is that of 'right'"),
    ({"radii": {"left": 0.2, "right": 0.2, "mid": 1.0}}, "there is no plane 'mid'"),
    ({"radii": {"left": 0.2, "right": 0.0}}, "radius of a plane must be a finite number > 0 m"),
    ({"speeds": [0.0]}, "greater than zero"),
    ({"planes": {"left": 99}}, "99"),
    ({"sensors": {"A": "nowhere"}}, "nowhere"),
]


@pytest.mark.parametrize(("change", "words"), BAD)
def test_what_cannot_be(rotor, change, words):
    arguments = {"planes": PLANES, "sensors": SENSORS, "speeds": SPEEDS} | change
    with pytest.raises(ValueError, match=words):
        model_influence(rotor, **arguments)
