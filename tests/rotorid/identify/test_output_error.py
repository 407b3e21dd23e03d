"""Output error: exact derivatives, exact data, missing readings, free vibration."""

from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest
from harmonic_cases import STATED, simulate, task51, two_masses
from hypothesis import given, settings
from hypothesis import strategies as st

from rotorid.identify import identify
from rotorid.identify.amplitudes import AmplitudeErrors, compare
from rotorid.identify.amplitudes import experiments as gather
from rotorid.identify.equations import harmonic_model
from rotorid.identify.fit_amplitudes import output_error as fit_from


def output_error(model, data, start, bounds=None, loss="linear"):
    """The fit from one start."""
    fit, comparison, *_ = fit_from(compare(model, data), np.array(start), bounds=bounds, loss=loss)
    return SimpleNamespace(fit=fit, comparison=comparison)


EVERYTHING = ("c1", "c", "c2", "a1", "a", "a2")


def chain3(estimate=("c1", "c2", "c3"), **known):
    """[S] task 7.1: three masses 20, 20, 10 kg on springs 1e4, 2e4, 5e3 N/m."""
    numbers = {"m1": 20.0, "m2": 20.0, "m3": 10.0, "c1": 1e4, "c2": 2e4, "c3": 5e3} | known
    equations = [
        "(m1*p**2 + c1 + c2)*A1 - c2*A2 = 0",
        "-c2*A1 + (m2*p**2 + c2 + c3)*A2 - c3*A3 = 0",
        "-c3*A2 + (m3*p**2 + c3)*A3 = 0",
    ]
    model = harmonic_model(
        equations, known={k: v for k, v in numbers.items() if k not in estimate}, estimate=estimate, inputs=[]
    )
    M = np.diag([numbers["m1"], numbers["m2"], numbers["m3"]])
    c1, c2, c3 = numbers["c1"], numbers["c2"], numbers["c3"]
    K = np.array([[c1 + c2, -c2, 0], [-c2, c2 + c3, -c3], [0, -c3, c3]])
    z, v = np.linalg.eig(np.linalg.solve(M, K))
    order = np.argsort(z)
    shapes = (v / v[0])[:, order].T
    return model, np.array([numbers[e] for e in estimate]), np.sqrt(z[order]), shapes


def vibrations(model, frequencies, shapes, **options):
    return gather(model, frequencies, {f"A{j + 1}": shapes[:, j] for j in range(3)}, free=True, **options)


def numeric_jacobian(function, x):
    columns = []
    for j in range(len(x)):
        h = 1e-6 * abs(x[j])
        step = np.zeros(len(x))
        step[j] = h
        columns.append((function(x + step) - function(x - step)) / (2 * h))
    return np.stack(columns, axis=1)


@settings(max_examples=20, deadline=None)
@given(st.integers(0, 10_000))
def test_the_jacobian_of_forced_amplitudes_is_exact(seed):
    rng = np.random.default_rng(seed)
    model, truth, w, inputs = two_masses(EVERYTHING)
    data = simulate(model, truth, w, inputs, STATED, rng, stated=STATED)
    comparison = compare(model, data)
    x = truth * (1 + 0.05 * rng.standard_normal(len(truth)))
    J = comparison.residuals(x)[1]
    expected = numeric_jacobian(lambda theta: comparison.residuals(theta)[0], x)
    np.testing.assert_allclose(J * x, expected * x, atol=1e-6 * np.abs(expected * x).max())


def test_the_jacobian_of_products_of_parameters_is_exact():
    model = harmonic_model(
        ["(T0*T1*T2*p**3 + T2*(T0 + T1)*p**2 + T2*p + K)*S = (T1*T2*p**2 + T2*p)*f"],
        known={"T0": 1.0}, estimate=["K", "T1", "T2"],
    )  # fmt: skip
    x = np.array([9.0, 0.6, 0.7])
    data = simulate(model, np.array([10, 0.5, 0.8]), np.array([1.0, 2.0, 3.0]), {"f": 1.0})
    comparison = compare(model, data)
    expected = numeric_jacobian(lambda theta: comparison.residuals(theta)[0], x)
    np.testing.assert_allclose(comparison.residuals(x)[1], expected, atol=1e-8 * np.abs(expected).max())


@pytest.mark.parametrize("estimate", [("c1", "c2", "c3"), ("c1", "c2", "c3", "m2", "m3")])
def test_the_jacobian_of_natural_modes_is_exact(estimate):
    model, truth, w, shapes = chain3(estimate)
    comparison = compare(model, vibrations(model, w, shapes))
    x = truth * (1 + 0.02 * np.sin(np.arange(len(truth))))
    expected = numeric_jacobian(lambda theta: comparison.residuals(theta)[0], x)
    np.testing.assert_allclose(
        comparison.residuals(x)[1] * x, expected * x, atol=1e-7 * np.abs(expected * x).max()
    )


def test_predicted_amplitudes_are_those_of_the_model():
    model, truth, w, inputs = two_masses(EVERYTHING)
    data = simulate(model, truth, w, inputs)
    Z, _ = model.forced(truth, w, np.full((len(w), 1), 100.0 + 0j))
    np.testing.assert_allclose(Z, np.stack([data.signals["X1"], data.signals["X2"]], 1), rtol=1e-12)


@pytest.mark.parametrize("case", [task51(), two_masses(), two_masses(EVERYTHING)])
@pytest.mark.parametrize("stated", [None, STATED])
def test_exact_readings_give_the_truth(case, stated):
    model, truth, w, inputs = case
    found = output_error(model, simulate(model, truth, w, inputs, stated=stated), 1.2 * truth)
    assert found.fit.converged
    np.testing.assert_allclose(found.fit.values, truth, rtol=1e-9)
    assert found.fit.estimate.errors_stated == (stated is not None)
    comparison = found.comparison
    assert comparison.left_out == ()
    assert len(found.fit.estimate.residuals) == 2 * len(w) * len(model.outputs)
    assert np.abs(found.fit.estimate.residuals).max() < 1e-7


def test_a_start_by_name_and_none_at_all():
    model, truth, w, inputs = task51()
    data = simulate(model, truth, w, inputs)
    for start in ({"c": 900.0, "b": 8.0}, {"c": 900.0}):
        np.testing.assert_allclose(identify(model, data, start=start).values, truth, rtol=1e-9)
    with pytest.raises(ValueError, match="start: d is no parameter"):
        identify(model, data, start={"d": 1.0})


def test_a_start_in_another_valley_does_not_hide_the_linear_one():
    model, truth, w, inputs = two_masses(("c1", "c2", "a1"))
    data = simulate(model, truth, w, inputs, STATED, np.random.default_rng(3), stated=STATED)
    far = {"c1": 1.5e6, "c2": 4e2, "a1": 3e3}
    np.testing.assert_allclose(
        identify(model, data, start=far).values, identify(model, data).values, rtol=1e-6
    )


def test_missing_amplitudes_are_left_out_and_named():
    model, truth, w, inputs = two_masses()
    data = simulate(model, truth, w, inputs)
    x2, f = data.signals["X2"].copy(), data.signals["F1"].copy()
    x2[1] = np.nan
    f[4] = np.nan
    data = replace(data, signals={**data.signals, "X2": x2, "F1": f})
    found = output_error(model, data, 0.9 * truth)
    np.testing.assert_allclose(found.fit.values, truth, rtol=1e-9)
    assert found.comparison.left_out == (
        "experiment 2: X2 not measured",
        "experiment 5: left out, for not every input is known",
    )
    assert len(found.fit.estimate.residuals) == 2 * 7
    predicted = identify(model, data).predicted["X2"]
    assert np.isfinite(predicted[1])
    assert np.isnan(predicted[4])


def test_one_sensor_is_enough():
    model, truth, w, inputs = two_masses()
    data = simulate(model, truth, w, inputs)
    only = replace(data, signals={name: z for name, z in data.signals.items() if name != "X2"})
    found = output_error(model, only, 0.9 * truth)
    np.testing.assert_allclose(found.fit.values, truth, rtol=1e-8)


def test_free_vibration_finds_the_springs():
    model, truth, w, shapes = chain3()
    found = output_error(model, vibrations(model, w, shapes), 1.3 * truth)
    np.testing.assert_allclose(found.fit.values, truth, rtol=1e-9)
    predicted, frequencies = found.comparison.predict(found.fit.values)
    np.testing.assert_allclose(frequencies, w, rtol=1e-10)
    np.testing.assert_allclose(predicted[:, 2].real, shapes[:, 2], rtol=1e-8)
    assert len(found.fit.estimate.residuals) == 9


def test_two_modes_without_one_amplitude_are_enough():
    model, truth, w, shapes = chain3(("c1", "c2", "c3", "m2"))
    shapes = shapes.copy()
    shapes[1, 2] = np.nan
    found = output_error(model, vibrations(model, w[:2], shapes[:2], errors=STATED), 1.1 * truth)
    np.testing.assert_allclose(found.fit.values, truth, rtol=1e-8)
    assert found.comparison.left_out == ("experiment 2: A3 not measured",)


def test_a_compliance_form_with_odd_powers_of_p_in_free_vibration():
    model = harmonic_model(
        ["X1 + d11*m1*p**2*X1 + d12*m2*p**2*X2 + b*p*X1 = 0", "X2 + d12*m1*p**2*X1 + d22*m2*p**2*X2 = 0"],
        known={"d11": 2e-8, "d12": 1e-8, "d22": 1.5e-8, "b": 1e-9}, estimate=["m1", "m2"], inputs=[],
    )  # fmt: skip
    D = np.array([[2e-8, 1e-8], [1e-8, 1.5e-8]])
    lam, v = np.linalg.eig(D @ np.diag([10.0, 20.0]))
    data = gather(model, 1 / np.sqrt(lam), {"X1": v[0], "X2": v[1]}, free=True)
    found = output_error(model, data, [8.0, 25.0])
    np.testing.assert_allclose(found.fit.values, [10.0, 20.0], rtol=1e-9)


def test_forced_and_free_together():
    model, truth, w, inputs = two_masses(("c1", "c2", "a1"))
    data = simulate(model, truth, w[:2], inputs)
    K, M = np.array([[15e3, -5e3], [-5e3, 5e3]]), np.diag([10.0, 5.0])
    lam, v = np.linalg.eig(np.linalg.solve(M, K))
    both = gather(
        model,
        [*w[:2], np.sqrt(lam[0])],
        {
            "F1": [100, 100, 0],
            "X1": [*data.signals["X1"], v[0, 0]],
            "X2": [*data.signals["X2"], v[1, 0]],
        },
        free=[False, False, True],
    )
    found = output_error(model, both, 1.1 * truth)
    np.testing.assert_allclose(found.fit.values, truth, rtol=1e-8)
    assert np.isnan(found.comparison.predict(truth)[1][:2]).all()


def test_bounds_and_robust_loss_reach_the_kernel():
    model, truth, w, inputs = two_masses()
    rng = np.random.default_rng(5)
    data = simulate(model, truth, w, inputs, STATED, rng, stated=STATED)
    held = output_error(model, data, truth, bounds={"a1": (0.0, 30.0)})
    assert held.fit.at_bounds == ("a1",)
    assert held.fit.values[0] == 30.0
    assert any("a1 stands at its bound" in text for text in held.fit.end_warnings)
    clean = output_error(model, data, truth).fit.values
    spoilt = data.signals["X1"].copy()
    spoilt[2] *= 3
    data = replace(data, signals={**data.signals, "X1": spoilt})
    plain = output_error(model, data, truth).fit.values
    robust = output_error(model, data, truth, loss="huber").fit.values
    assert np.abs(robust / clean - 1).max() < 0.1 * np.abs(plain / clean - 1).max()


def test_what_the_data_do_not_tell_is_said():
    model = harmonic_model(
        ["(m*p**2 + b*p + c)*Z - delta*b*p*Z = m*e*omega**2"],
        known={"m": 10.0, "e": 1e-4, "omega": 90.0}, estimate=["c", "b", "delta"],
    )  # fmt: skip
    w = np.array([80.0, 100.0])
    z = 10 * 1e-4 * 90.0**2 / (-10 * w**2 + 1j * w * 5e3 + 1e5)
    found = output_error(model, gather(model, w, {"Z": z}, free=False, errors=STATED), [9e4, 1e4, 0.4])
    assert found.fit.values[0] == pytest.approx(1e5, rel=1e-8)
    assert found.fit.estimate.undetermined == ("b", "delta")
    solution = found.fit.estimate.solution
    assert solution[1] * (1 - solution[2]) == pytest.approx(5e3, rel=1e-8)


def test_repeated_readings_weight_each_reading():
    model, truth, w, inputs = task51()
    data = simulate(model, truth, w, inputs)
    spoilt = data.signals["X"].copy()
    spoilt[0] *= 1.5
    sigma = np.abs(spoilt) * [10.0, 1e-3, 1e-3]
    covariance = sigma[:, None, None] ** 2 * np.eye(2)
    data = replace(data, signals={**data.signals, "X": spoilt}, covariances={"X": covariance})
    found = output_error(model, data, truth)
    np.testing.assert_allclose(found.fit.values, truth, rtol=1e-5)
    assert found.fit.estimate.errors_stated


def test_bad_requests_are_refused_in_words():
    model, truth, w, inputs = task51()
    data = simulate(model, truth, w, inputs)
    no_load = replace(data, signals={"X": data.signals["X"]})
    with pytest.raises(ValueError, match="not every input is known"):
        output_error(model, no_load, truth)
    square = harmonic_model(["(m*p**2 + c)*X + b*p*Y = F"], known={"m": 1.0}, estimate=["c", "b"])
    with pytest.raises(ValueError, match="as many equations as outputs"):
        output_error(square, data, truth)


def test_no_phase_is_exact():
    model, truth, w, inputs = task51()
    data = simulate(model, truth, w, inputs, stated=AmplitudeErrors(relative=0.02))
    found = output_error(model, data, truth)
    assert 1 / np.linalg.svd(found.comparison.whiten)[1][:, 0, 0] == pytest.approx(
        0.01 * 0.02 * np.abs(data.signals["X"]), rel=1e-3
    )
    np.testing.assert_allclose(found.fit.values, truth, rtol=1e-8)
