"""Choice of frequencies: against enumeration, closed forms and simulated repetitions."""

import json
from itertools import combinations, combinations_with_replacement

import numpy as np
import pytest
from cases import each_of
from harmonic_cases import STATED, task51, two_masses

from rotorid.identify.amplitudes import AmplitudeErrors
from rotorid.identify.design import design
from rotorid.identify.equations import harmonic_model
from rotorid.regression.d_optimal import d_optimal


def log_det(J, chosen):
    rows = J[list(chosen)].reshape(-1, J.shape[2])
    return np.linalg.slogdet(rows.T @ rows)[1]


@pytest.mark.parametrize("repeat", [False, True])
def test_the_choice_is_the_best_of_all_and_never_far_from_it(repeat):
    pick = combinations_with_replacement if repeat else combinations
    lost = []
    for seed in range(150):
        J, n = np.random.default_rng(seed).standard_normal((8, 2, 3)), 2 + seed % 3
        chosen = d_optimal(J, n, repeat=repeat)
        assert len(chosen) == n
        assert repeat or len(set(chosen)) == n
        lost.append(max(log_det(J, c) for c in pick(range(8), n)) - log_det(J, chosen))
    # exchanges of one at a time are no proof: now and then they stop a little below the best
    assert np.mean(np.array(lost) < 1e-6) >= 0.98
    assert max(lost) < 0.05


@pytest.mark.parametrize("n", [2, 3, 4])
def test_for_two_masses_it_is_the_best_of_all_choices(n):
    model, truth, _, inputs = two_masses()
    guess = dict(zip(model.parameters, truth, strict=True))
    w = np.linspace(10, 55, 12)
    found = design(model, guess, w, n, errors=STATED, inputs=inputs)
    J = sensitivities(model, truth, w, inputs)
    best = max(combinations(range(12), n), key=lambda c: log_det(J, c))
    assert tuple(found.chosen) == best


def sensitivities(model, truth, w, inputs):
    """By numerical differentiation of the model's own prediction: d ln|Z| and d arg Z over their errors."""
    loads = {name: np.full(len(w), complex(v)) for name, v in inputs.items()}

    def logs(theta):
        z = np.stack(list(model.predict(theta, w, loads).values()), axis=1)
        return np.log(z)

    columns = []
    for j in range(len(truth)):
        step = np.zeros(len(truth))
        step[j] = 1e-6 * truth[j]
        slope = (logs(truth + step) - logs(truth - step)) / (2 * step[j])
        columns.append(np.concatenate((slope.real / STATED.relative, slope.imag / STATED.phase), axis=1))
    return np.stack(columns, axis=2)


def test_expected_deviations_are_those_of_independent_derivatives():
    model, truth, w, inputs = two_masses()
    guess = dict(zip(model.parameters, truth, strict=True))
    found = design(model, guess, w, 3, errors=STATED, inputs=inputs)
    J = sensitivities(model, truth, w, inputs)
    rows = J.reshape(-1, 3)
    np.testing.assert_allclose(found.std_all, np.sqrt(np.diag(np.linalg.inv(rows.T @ rows))), rtol=1e-6)
    part = J[found.chosen].reshape(-1, 3)
    np.testing.assert_allclose(found.std, np.sqrt(np.diag(np.linalg.inv(part.T @ part))), rtol=1e-6)


def test_a_resonance_tells_the_damping():
    model, _, _, inputs = task51()
    w = np.array([2.0, 5.0, 9.0, 10.0, 11.0, 20.0, 40.0])
    found = design(model, {"c": 1000.0, "b": 10.0}, w, 2, errors=STATED, inputs=inputs)
    assert w[np.argmin(found.std_alone[:, 1])] == 10.0
    assert found.determined
    assert (found.std >= found.std_all * (1 - 1e-12)).all()
    assert found.efficiency > 1.2


def test_repetition_and_a_single_sensor():
    model, truth, _, inputs = two_masses()
    guess = dict(zip(model.parameters, truth, strict=True))
    w = np.linspace(10, 55, 10)
    found = design(model, guess, w, 12, errors=STATED, inputs=inputs, measured=["X2"], repeat=True)
    assert len(found.chosen) == 12
    assert len(set(found.chosen)) < 12
    both = design(model, guess, w, 12, errors=STATED, inputs=inputs, repeat=True)
    assert (both.std < found.std).all()


def test_what_cannot_be_determined_is_said():
    model = harmonic_model(
        ["(m*p**2 + b*p + c)*X - delta*b*p*X = F"], known={"m": 10.0}, estimate=["c", "b", "delta"]
    )
    found = design(model, {"c": 1e3, "b": 10.0, "delta": 0.2}, [5, 10, 15], 2, errors=STATED, inputs={"F": 1})
    assert not found.determined
    assert np.isfinite(found.std[0])
    assert np.isinf(found.std[1:]).all()
    assert np.isnan(found.efficiency)
    assert found.summary().count("will not determine it") == 2
    assert found.to_dict()["parameters"]["b"]["std"] is None


def test_the_result_speaks():
    model, truth, w, inputs = two_masses()
    guess = dict(zip(model.parameters, truth, strict=True))
    found = design(model, guess, w, 2, errors=STATED, inputs=inputs)
    frame = found.to_frame()
    assert frame["chosen"].sum() == 2
    assert list(frame.columns) == ["frequency_rad_s", "chosen", "a1_std", "a2_std", "a_std"]
    document = json.loads(json.dumps(found.to_dict(), allow_nan=False))
    assert document["frequencies_rad_s"] == found.where.tolist()


@each_of(
    ("change", "words"),
    [
        ({"n": 0}, "choose from 1 to 3"),
        ({"n": 4}, "choose from 1 to 3"),
        ({"guess": {"c": 1.0}}, "guess a value of b"),
        ({"candidates": [1.0, np.nan]}, "candidate frequencies"),
        ({"candidates": []}, "candidate frequencies"),
        ({"inputs": {}}, "give the amplitude of F"),
        ({"measured": ["Y"]}, "Y is no output"),
        ({"measured": []}, "no output has a sensor"),
        ({"guess": {"c": 1000.0, "b": 0.0}, "candidates": [10.0], "n": 1}, "resonance without damping"),
    ],
)
def test_bad_requests_are_refused_in_words(change, words):
    model, _, w, inputs = task51()
    options = {"guess": {"c": 1e3, "b": 1.0}, "candidates": w, "n": 2, "inputs": inputs} | change
    guess, candidates, n = (options.pop(key) for key in ("guess", "candidates", "n"))
    with pytest.raises(ValueError, match=words):
        design(model, guess, candidates, n, errors=AmplitudeErrors(relative=0.01, phase=0.01), **options)
