"""The nonlinear kernel against certified values, closed forms and the linear kernel."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from rotorid.regression import least_squares
from rotorid.regression.nonlinear import nonlinear_least_squares

# NIST StRD, nonlinear: response, predictor, starts, certified values, their deviations, sum of squares
MISRA1A = """
10.07 14.73 17.94 23.93 29.61 35.18 40.02 44.82 50.76 55.05 61.01 66.40 75.47 81.78

77.6 114.9 141.1 190.8 239.9 289.0 332.8 378.4 434.8 477.3 536.8 593.1 689.1 760.0

500 1e-4

250 5e-4

2.3894212918e2 5.5015643181e-4

2.7070075241 7.2668688436e-6

1.2455138894e-1
"""
THURBER = """
80.574 84.248 87.264 87.195 89.076 89.608 89.868 90.101 92.405 95.854 100.696 101.060 401.672 390.724
567.534 635.316 733.054 759.087 894.206 990.785 1090.109 1080.914 1122.643 1178.351 1260.531 1273.514
1288.339 1327.543 1353.863 1414.509 1425.208 1421.384 1442.962 1464.350 1468.705 1447.894 1457.628

-3.067 -2.981 -2.921 -2.912 -2.840 -2.797 -2.702 -2.699 -2.633 -2.481 -2.363 -2.322 -1.501 -1.460 -1.274
-1.212 -1.100 -1.046 -0.915 -0.714 -0.566 -0.545 -0.400 -0.309 -0.109 -0.103 0.010 0.119 0.377 0.790 0.963
1.006 1.115 1.572 1.841 2.047 2.200

1000 1000 400 40 0.7 0.3 0.03

1300 1500 500 75 1 0.4 0.05

1.2881396800e3 1.4910792535e3 5.8323836877e2 7.5416644291e1 9.6629502864e-1 3.9797285797e-1 4.9727297349e-2

4.6647963344 3.9571156086e1 2.8698696102e1 5.5675370270 3.1333340687e-2 1.4984928198e-2 6.5842344623e-3

5.6427082397e3
"""


def misra1a(b, x):
    """A saturating exponential, and its derivatives by b."""
    left = np.exp(-b[1] * x)
    return b[0] * (1 - left), np.stack((1 - left, b[0] * x * left), axis=1)


def thurber(b, x):
    """A ratio of cubics, and its derivatives by b."""
    powers = x[:, None] ** np.arange(4)
    top, bottom = powers @ b[:4], 1 + powers[:, 1:] @ b[4:]
    slopes = np.hstack((powers, -(top / bottom)[:, None] * powers[:, 1:]))
    return top / bottom, slopes / bottom[:, None]


def problem(model, text):
    """Residuals, Jacobian, names; starts; certified values, their deviations and the sum of squares."""
    y, x, *starts, values, std, total = (np.array(row.split(), float) for row in text.split("\n\n"))
    functions = (lambda b: model(b, x)[0] - y, lambda b: model(b, x)[1])
    return functions, [f"b{i + 1}" for i in range(len(values))], starts, (values, std, total)


@pytest.mark.parametrize(("model", "text", "of_std"), [(misra1a, MISRA1A, 1e-7), (thurber, THURBER, 1e-5)])
def test_certified_values_come_out_to_seven_digits_from_both_starts(model, text, of_std):
    functions, names, starts, (values, std, total) = problem(model, text)
    for start in starts:
        fit = nonlinear_least_squares(*functions, start, names=names, sigma_stated=False)
        assert fit.converged
        np.testing.assert_array_equal(fit.history[[0, -1]], [start, fit.values])
        np.testing.assert_allclose(fit.values, values, rtol=1e-7)
        np.testing.assert_allclose(fit.estimate.std, std, rtol=of_std)
        assert 2 * fit.costs[-1] == pytest.approx(float(total[0]), rel=1e-9)


def line(seed=0, m=30, sigma=0.5):
    rng = np.random.default_rng(seed)
    K = np.stack((np.ones(m), np.linspace(0, 3, m)), axis=1)
    return K, K @ [1.0, 2.0] + rng.normal(0, sigma, m)


@settings(max_examples=25, deadline=None)
@given(st.integers(0, 10_000), st.booleans(), st.floats(1e-3, 1e3))
def test_a_linear_model_gives_the_linear_kernel(seed, stated, sigma):
    K, y = line(seed, sigma=sigma)
    linear = least_squares(K, y, sigma=sigma if stated else None)
    fit = nonlinear_least_squares(
        lambda x: (K @ x - y) / sigma, lambda x: K / sigma, [0.3, -4.0], names="ab", sigma_stated=stated
    )
    np.testing.assert_allclose(fit.values, linear.values, rtol=1e-9, atol=1e-12 * sigma)
    np.testing.assert_allclose(fit.estimate.covariance, linear.covariance, rtol=1e-9)
    np.testing.assert_allclose(fit.estimate.ci95, linear.ci95, rtol=1e-8, atol=1e-10 * sigma)


def test_a_parameter_at_its_bound_is_named_and_held():
    K, y = line()
    run = {"names": ["a", "slope"], "sigma_stated": False}
    bounds = [(-9, None), (None, 1.5)]  # the first does not bind
    fit = nonlinear_least_squares(lambda x: K @ x - y, lambda x: K, [-99.0, 0.0], bounds=bounds, **run)
    held = least_squares(K[:, :1], y - 1.5 * K[:, 1])
    assert fit.at_bounds == ("slope",)
    assert fit.values == pytest.approx([held.values[0], 1.5], rel=1e-9)
    assert fit.estimate.std == pytest.approx([held.std[0], np.nan], rel=1e-9, nan_ok=True)
    assert fit.estimate.to_dict()["parameters"]["slope"] == {"value": 1.5, "std": None, "ci95": None}
    assert "nan" not in fit.estimate.answer.brief()
    assert "slope stands at its bound" in fit.bound_warning


@pytest.mark.parametrize("stated", [True, False])
def test_a_robust_loss_shrugs_off_gross_errors(stated):
    K, y = line(seed=3, m=60, sigma=0.1)
    y[::12] += 30.0
    functions = (lambda x: (K @ x - y) / 0.1, lambda x: K / 0.1, [0, 0])
    robust, plain = (
        nonlinear_least_squares(*functions, names=["a", "b"], sigma_stated=stated, loss=loss)
        for loss in ("huber", "linear")
    )
    error, harm = np.abs(robust.values - [1, 2]), np.abs(plain.values - [1, 2])
    assert robust.converged
    assert (error < np.minimum(4 * robust.estimate.std, 0.15)).all()
    assert harm.max() > 10 * error.max()


def test_no_convergence_is_said():
    functions, names, starts, _ = problem(thurber, THURBER)
    run = {"names": names, "sigma_stated": False, "max_iterations": 2}
    fit = nonlinear_least_squares(*functions, starts[0], **run)
    assert not fit.converged
    assert "not converged" in fit.message


@pytest.mark.parametrize(
    ("change", "words"),
    [
        ({"loss": "median"}, "loss 'median' is not known"),
        ({"bounds": (1, 1)}, "must be strictly less"),
        ({"start": [1e308, -1e6]}, "not finite"),
    ],
)
@pytest.mark.filterwarnings("ignore:overflow", "ignore:invalid value")
def test_bad_input_is_refused_in_words(change, words):
    (residual, jacobian), names, (start, _), _ = problem(misra1a, MISRA1A)
    right = {"start": start, "names": names, "sigma_stated": False}
    with pytest.raises(ValueError, match=words):
        nonlinear_least_squares(residual, jacobian, **right | change)
