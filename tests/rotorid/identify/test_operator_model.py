"""Operator models: reading, features, matrices, messages."""

import numpy as np
import pytest
from cases import each_of

from rotorid.identify import harmonic_model

MASS = "(m*p**2 + b*p + c)*X = F"


def test_signals_inputs_and_outputs_follow_from_the_equations():
    model = harmonic_model([MASS], known={"m": 10.0}, estimate=["c", "b"])
    assert model.signals == ("X", "F")
    assert (model.inputs, model.outputs) == (("F",), ("X",))
    assert not model.has_constant_terms


def test_inputs_may_be_named():
    model = harmonic_model(["m*p**2*X + c*(X - Y) = 0"], known={"m": 1}, estimate=["c"], inputs=["Y"])
    assert (model.inputs, model.outputs) == (("Y",), ("X",))


def test_sympys_own_names_are_ordinary_names():
    model = harmonic_model(
        ["(E*p**2 + I*p + lambda)*S = N*beta"], known={"N": 2.0, "I": 3.0}, estimate=["E", "lambda"]
    )
    assert (model.outputs, model.inputs) == (("S",), ("beta",))
    s = model.predict(np.array([5.0, 7.0]), np.array([1.0]), {"beta": np.ones(1)})["S"]
    np.testing.assert_allclose(s, 2 / (2 + 3j), rtol=1e-14)


def test_a_term_without_a_signal_has_amplitude_one():
    model = harmonic_model(
        ["(m*p**2 + b*p + c)*Z = -m*e*p**2"], known={"m": 10.0, "e": 1e-4, "b": 5.0}, estimate=["c"]
    )
    w = np.array([80.0, 100.0])
    z = model.predict(np.array([1e5]), w, {})["Z"]
    np.testing.assert_allclose(z, 1e-3 * w**2 / (1e5 - 10 * w**2 + 5j * w), rtol=1e-13)


def test_matrices_and_derivatives_agree_with_the_written_equation():
    model = harmonic_model(["(T1*T2*p**2 + T1**2*p + 3)*S = T2*F"], estimate=["T1", "T2"])
    w, theta, h = np.array([0.5, 2.0]), np.array([0.7, 1.9]), 1e-6
    A = model.matrices(theta, w)
    p = 1j * w
    np.testing.assert_allclose(A[:, 0, 0], theta[0] * theta[1] * p**2 + theta[0] ** 2 * p + 3, rtol=1e-14)
    np.testing.assert_allclose(A[:, 0, 1], -theta[1], rtol=1e-14)
    slopes = model.polynomials(theta)[1]
    for j in range(2):
        step = np.eye(2)[j] * h
        numeric = (model.polynomials(theta + step)[0] - model.polynomials(theta - step)[0]) / (2 * h)
        np.testing.assert_allclose(slopes[:, j], numeric, rtol=1e-8, atol=1e-8)


def test_denominators_of_one_term_stay_and_those_of_several_are_multiplied_out():
    single = harmonic_model(["a*X/p**2 + X/k = F"], estimate=["a", "k"])
    assert {f.power for f in single.features} == {-2, 0}
    w = np.array([3.0])
    x = single.predict(np.array([2.0, 4.0]), w, {"F": np.ones(1)})["X"]
    np.testing.assert_allclose(x, 1 / (2 / -9.0 + 1 / 4), rtol=1e-14)
    several = harmonic_model(["S = K*F/(T0*p + 1)/(T1*p + 1)"], estimate=["K", "T0", "T1"])
    s = several.predict(np.array([5.0, 0.2, 0.7]), w, {"F": np.ones(1)})["S"]
    np.testing.assert_allclose(s, 5 / (0.6j + 1) / (2.1j + 1), rtol=1e-14)


def test_functions_of_known_numbers_are_numbers():
    model = harmonic_model(["p**2*X + sqrt(k)*c*X = F"], known={"k": 4.0}, estimate=["c"])
    x = model.predict(np.array([3.0]), np.array([1.0]), {"F": np.ones(1)})["X"]
    np.testing.assert_allclose(x, 1 / 5, rtol=1e-14)


@each_of(
    ("equations", "known", "estimate", "message"),
    [
        ([MASS], {"m": 1}, ["c", "b", "k"], "the parameter k is to be estimated but stands in no equation"),
        ([MASS], {"m": 1}, ["c", "c"], "parameter c: c is already given"),
        ([MASS], {"m": 1, "c": 1}, ["c", "b"], "known value c: c is already a parameter"),
        ([MASS], {"m": 1}, ["c", "p"], "p is d/dt"),
        ([MASS], {"m": 1}, [], "no parameter"),
        ([], {}, ["c"], "no equations"),
        (["c*(X + p*X) - c*X - c*p*X + X = F"], {}, ["c"], "the parameter c cancels out"),
        (["c*X**2 = F"], {}, ["c"], "equation 1, 'c\\*X\\*\\*2 = F': it is not linear in the signals"),
        (["X = F", "c*X*F = F"], {}, ["c"], "equation 2, .*not linear in the signals"),
        (["c*X/(1 + X) = F"], {}, ["c"], "X stands in a denominator"),
        (["sin(c*p)*X = F"], {}, ["c"], "neither a polynomial"),
        (["X/m = c*F"], {"m": 0.0}, ["c"], "divides by m, which is 0"),
        (["c*X/(m - m) = F"], {"m": 1.0}, ["c"], "division by zero"),
        (["c*p = 1"], {}, ["c"], "equation 1, .*contains no signal"),
        (["c*X"], {}, ["c"], "equation needs one ="),
        (["c*X = __import__('os')"], {}, ["c"], "equation 1"),
        ([MASS], {"m": float("nan")}, ["c"], "m: its value must be a finite number"),
        ([MASS], {"m": 1}, ["c", "sin"], "parameter 'sin' is no name"),
    ],
)
def test_bad_models_are_refused_in_words(equations, known, estimate, message):
    with pytest.raises(ValueError, match=message):
        harmonic_model(equations, known=known, estimate=estimate)


@pytest.mark.parametrize(
    ("inputs", "message"), [(["G"], "the input G is no signal"), (["X", "F"], "nothing to measure")]
)
def test_bad_inputs_are_refused(inputs, message):
    with pytest.raises(ValueError, match=message):
        harmonic_model([MASS], known={"m": 1}, estimate=["c", "b"], inputs=inputs)


def test_amplitudes_cannot_be_predicted_with_more_outputs_than_equations():
    model = harmonic_model(["c*X + p*Y = F"], estimate=["c"])
    with pytest.raises(ValueError, match=r"say which signals are given with inputs"):
        model.predict(np.ones(1), np.ones(1), {"F": np.ones(1)})


def test_an_expansion_too_long_to_use_is_refused():
    letters = " + ".join("abcdefghijklmnoqrstuvwxyz")
    with pytest.raises(ValueError, match="terms"):
        harmonic_model([f"({letters})**9*X = F"], estimate=["a"])
