"""Output error through `identify`: started from the linear estimate, with the same kind of answer."""

import json

import numpy as np
import pytest
from harmonic_cases import STATED, simulate, task51, two_masses

from rotorid.identify import harmonic_model, identify
from rotorid.identify.amplitudes import experiments as gather


def feedback(estimate):
    """[S] 1.8: a feedback system with products of unknowns."""
    numbers = {"T0": 1.0, "T1": 0.5, "T2": 0.8, "K": 10.0}
    known = {k: v for k, v in numbers.items() if k not in estimate}
    model = harmonic_model(
        ["(T0*T1*T2*p**3 + T2*(T0 + T1)*p**2 + T2*p + K)*S = (T1*T2*p**2 + T2*p)*f"],
        known=known, estimate=estimate,
    )  # fmt: skip
    return model, np.array([numbers[e] for e in estimate]), np.array([1.0, 2.0, 3.0]), {"f": 1.0}


@pytest.mark.parametrize(
    "case", [task51(), two_masses(), two_masses(("c1", "c2", "c")), feedback(("T1", "T2"))]
)
@pytest.mark.parametrize("stated", [None, STATED])
def test_exact_readings_give_the_truth_without_a_start(case, stated):
    model, truth, w, inputs = case
    found = identify(model, simulate(model, truth, w, inputs, stated=stated))
    np.testing.assert_allclose(found.values, truth, rtol=1e-8)
    assert found.identifiable
    assert found.unidentifiable == ()
    assert found.warnings == ()
    assert found.method == "output-error"
    assert found.residual_rms < 1e-9
    assert {*found.residuals[2].values} == {*model.outputs}
    assert found.estimate.rank == len(truth)
    json.dumps(found.to_dict(), allow_nan=False)
    assert "output error" in found.summary()


def test_from_noisy_readings_it_fits_better_than_the_linear_estimate():
    model, truth, _, inputs = two_masses(("c1", "c2", "c"))
    w = np.linspace(18, 27, 10)
    data = simulate(model, truth, w, inputs, STATED, np.random.default_rng(8), stated=STATED)
    found = identify(model, data)
    linear = found.linear
    assert (np.abs(found.values - truth) < 4 * found.std).all()

    def misfit(values):
        z = model.predict(values, w, {"F1": np.full(10, 100.0 + 0j)})
        return sum(np.sum(np.abs(np.log(z[o] / data.signals[o])) ** 2) for o in model.outputs)

    assert misfit(found.values) < misfit(linear.recovery.values)
    same = identify(model, data, start=dict(zip(model.parameters, 1.01 * truth, strict=True)))
    np.testing.assert_allclose(same.values, found.values, rtol=1e-5)


def test_exchangeable_parameters_have_two_solutions():
    model = harmonic_model(["(T1*p + 1)*(T2*p + 1)*X = K*f"], known={"K": 2.0}, estimate=["T1", "T2"])
    data = simulate(model, np.array([0.5, 0.2]), np.array([1.0, 3.0, 6.0]), {"f": 1.0}, stated=STATED)
    found = identify(model, data)
    assert np.isnan(found.values).all()
    assert sorted(round(s["T1"], 8) for s in found.solutions) == [0.2, 0.5]
    assert found.unidentifiable
    values = {c.words: c.value for c in found.combinations}
    assert any(value == pytest.approx(0.1, rel=1e-8) for value in values.values())
    assert any(value == pytest.approx(0.7, rel=1e-8) for value in values.values())
    assert all(c.std > 0 for c in found.combinations)


def test_only_the_difference_is_determined():
    model = harmonic_model(
        ["(m*p**2 + b*p + c)*Z - delta*b*p*Z = F"], known={"m": 10.0}, estimate=["c", "b", "delta"]
    )
    w = np.array([80.0, 100.0, 120.0])
    z = 5.0 / (-10 * w**2 + 1j * w * 400 + 1e5)
    data = gather(model, w, {"Z": z, "F": 5.0}, errors=STATED, free=False)
    found = identify(model, data)
    assert found.values[0] == pytest.approx(1e5, rel=1e-8)
    assert np.isnan(found.values[1:]).all()
    assert not found.identifiable
    (combination,) = found.combinations
    assert combination.words == "b*(1 - delta)"
    assert combination.value == pytest.approx(400, rel=1e-8)
    one = harmonic_model(["(m*p**2 + d*p + c)*Z = F"], known={"m": 10.0}, estimate=["c", "d"])
    assert combination.std == pytest.approx(identify(one, data).std[1], rel=1e-6)
    assert any("c and b*(1 - delta)" in text for text in found.unidentifiable)
    assert found.to_dict()["parameters"]["b"]["value"] is None


def test_a_wrong_model_is_warned_about():
    model, truth, w, inputs = two_masses()
    data = simulate(model, truth, w, inputs, STATED, np.random.default_rng(8), stated=STATED)
    assert identify(model, data).warnings == ()
    wrong = harmonic_model(model.equations, known={**model.known, "c1": 15300.0}, estimate=model.parameters)
    (warning,) = identify(wrong, data).warnings
    assert "times as large as the stated errors explain" in warning


CHAIN = (
    "(m1*p**2 + c1 + c2)*A1 - c2*A2 = 0",
    "-c2*A1 + (m2*p**2 + c2 + c3)*A2 - c3*A3 = 0",
    "-c3*A2 + (m3*p**2 + c3)*A3 = 0",
)
# [S] 7.1: ω² rounded to 150, 690, 2400; shapes computed at these from the last two equations
Z_71 = np.array([150.0, 690.0, 2400.0])
A2_71, A3_71 = [1.3461538, 0.8210890, -0.9223301], [1.9230769, -2.1607606, 0.2427184]


def test_a_free_vibration_tells_only_ratios():
    model = harmonic_model(CHAIN, known={"m1": 20.0}, estimate=["c1", "c2", "c3", "m2", "m3"], inputs=[])
    data = gather(model, np.sqrt(Z_71[:1]), {"A1": 1.0, "A2": A2_71[:1], "A3": A3_71[:1]}, free=True)
    found = identify(model, data)
    assert not found.identifiable
    assert found.unidentifiable
    assert found.estimate.rank == 3
