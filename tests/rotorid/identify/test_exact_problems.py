"""Zeros, roots and rounded readings: answers that once were doubted without need, or were too sure."""

import numpy as np
import pytest

from rotorid.files import read_harmonic_model, read_measurements
from rotorid.identify import experiments, harmonic_model, identify

TWO = ["(m*p**2 + b1*p + c1 + c2)*X1 - c2*X2 = F", "(5*p**2 + b2*p + c2)*X2 - c2*X1 = 0"]
ROOTS = "sqrt(k)*sqrt(m)*z"
W = np.linspace(5, 40, 8)


def exact(model, truth, w=W):
    loads = {name: np.ones(len(w), dtype=complex) for name in model.inputs}
    return experiments(model, w, {**loads, **model.predict(np.array(truth), w, loads)}, free=False)


def test_dampers_that_are_zero_are_found():
    model = harmonic_model(TWO, known={"m": 10.0}, estimate=["c1", "c2", "b1", "b2"])
    found = identify(model, exact(model, [1e4, 2e4, 0.0, 0.0]))
    assert found.converged
    assert found.warnings == ()
    np.testing.assert_allclose(found.values, [1e4, 2e4, 0, 0], rtol=1e-9, atol=1e-9)


def test_a_linear_problem_with_a_zero_is_no_search():
    """A product beside it: b = 0 is a root, and not left to a search."""
    model = harmonic_model(["(m*p**2 + b*p + m*c)*X = F"], estimate=["m", "b", "c"])
    found = identify(model, exact(model, [3.0, 0.0, 500.0]))
    assert found.warnings == ()
    np.testing.assert_allclose(found.values, [3, 0, 500], rtol=1e-9, atol=1e-9)


@pytest.mark.parametrize(
    ("equation", "estimate", "truth", "words"),
    [
        ("(p**2 + sqrt(k)*p + 7)*X = F", ["k"], [9.0], ("sqrt(k)",)),
        ("(m*p**2 + z*sqrt(k*m)*p + k)*X = F", ["m", "k", "z"], [3, 9, 0.2], ("m", "k", ROOTS)),
        ("(p**2 + a**1.5*p + a*b)*X = F", ["a", "b"], [4.0, 30.0], ("a**(3/2)", "a*b")),
    ],
)  # fmt: skip
def test_roots_of_parameters_are_unknowns_of_their_own(equation, estimate, truth, words):
    model = harmonic_model([equation], estimate=estimate)
    assert set(model.combinations.words) == set(words)
    found = identify(model, exact(model, truth))
    np.testing.assert_allclose(found.linear.recovery.values, truth, rtol=1e-8)
    np.testing.assert_allclose(found.values, truth, rtol=1e-8)


@pytest.mark.parametrize("equation", ["X/(a*(b + 1) - a*b - a) = F", "(a + b)*X/(z - 1) = F"])
def test_a_denominator_that_cancels_is_refused_in_words(equation):
    with pytest.raises(ValueError, match="it divides by zero"):
        harmonic_model([equation], known={"z": 1.0}, estimate=["a", "b"])


@pytest.mark.parametrize(
    ("equation", "names", "numbers"),
    [
        ("(p**2 + b*p + sin(a))*X = F", ("b", "sin(a)"), [0.5, 0.8]),
        ("(p**2 + exp(-sqrt(a))*p + a)*X = F", ("a", "exp(-sqrt(a))"), [9.0, 0.4]),
        ("(sqrt(a + b)*p**2 + b*p + 3)*X = F", ("b", "sqrt(a + b)"), [0.5, 2.0]),
    ],
)
def test_another_function_is_an_unknown_that_is_not_solved(equation, names, numbers):
    model = harmonic_model([equation], estimate=["a", "b"] if "b" in equation else ["a"])
    assert model.parameters == names
    found = identify(model, exact(model, numbers))
    np.testing.assert_allclose(found.values, numbers, rtol=1e-8)
    assert found.warnings == (
        f"{names[1]} is estimated as one unknown: what stands in it is not solved for from it",
    )


def table(tmp_path, digits, truth, seed):
    """A table of amplitudes of one mass in so many digits, read."""
    (tmp_path / "m.toml").write_text('equations = ["(10*p**2 + b*p + c)*X = F"]\nestimate = ["c", "b"]\n')
    file = read_harmonic_model(tmp_path / "m.toml")
    w = np.random.default_rng(seed).uniform(4, 25, 8).round(1)
    X = file.model.predict(truth, w, {"F": np.full(8, 10.0 + 0j)})["X"]
    parts = zip(w, X.real, X.imag, strict=True)
    rows = [f"{f},10,{re:.{digits}g},{im:.{digits}g}" for f, re, im in parts]
    (tmp_path / "d.csv").write_text("\n".join(["frequency_rad_s,F_re,X_re,X_im", *rows]))
    return file.model, read_measurements(tmp_path / "d.csv", file)


def test_digits_of_readings_are_their_errors(tmp_path):
    """Of many tables in two digits the intervals hold in about 95 %; in four digits they are narrower."""
    inside, widths = [], []
    for seed in range(40):
        truth = np.array([1000.0, 10.0]) * np.random.default_rng(100 + seed).uniform(0.9, 1.1, 2)
        found = identify(*table(tmp_path, 2, truth, seed))
        inside += [*(found.ci95[:, 0] <= truth) & (truth <= found.ci95[:, 1])]
        fine = identify(*table(tmp_path, 4, truth, seed))
        widths.append(fine.std / found.std)
    assert 0.88 <= np.mean(inside) <= 1.0
    assert np.median(widths) < 0.05
    assert any("digits in which readings are written" in note for note in found.notes)


def test_digits_are_not_blamed_for_what_is_more_than_they_make(tmp_path):
    model, data = table(tmp_path, 6, np.array([1000.0, 10.0]), 3)
    noise = 1 + 0.02 * np.random.default_rng(1).standard_normal((8, 2)) @ [1, 1j]
    data.signals["X"][:] *= noise
    found = identify(model, data)
    assert not found.errors_stated
    assert (found.std / found.values > 1e-3).all()
