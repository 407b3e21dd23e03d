"""The kernel against certified values, closed forms and its own promises."""

import numpy as np
import pytest
from cases import each_of
from hypothesis import given
from hypothesis import strategies as st

from rotorid.regression import gain, least_squares, solution, stack, stretch, unstretch

# NIST StRD, Longley: total employment; GNP deflator, GNP, unemployed, armed forces, population, year
LONGLEY = """
60323  83.0 234289 2356 1590 107608 1947
61122  88.5 259426 2325 1456 108632 1948
60171  88.2 258054 3682 1616 109773 1949
61187  89.5 284599 3351 1650 110929 1950
63221  96.2 328975 2099 3099 112075 1951
63639  98.1 346999 1932 3594 113270 1952
64989  99.0 365385 1870 3547 115094 1953
63761 100.0 363112 3578 3350 116219 1954
66019 101.2 397469 2904 3048 117388 1955
67857 104.6 419180 2822 2857 118734 1956
68169 108.4 442769 2936 2798 120445 1957
66513 110.8 444546 4681 2637 121950 1958
68655 112.6 482704 3813 2552 123366 1959
69564 114.2 502601 3931 2514 125368 1960
69331 115.7 518173 4806 2572 127852 1961
70551 116.9 554894 4007 2827 130081 1962
"""
LONGLEY_VALUES = [
    -3482258.63459582,
    15.0618722713733,
    -0.358191792925910e-01,
    -2.02022980381683,
    -1.03322686717359,
    -0.511041056535807e-01,
    1829.15146461355,
]
LONGLEY_STD = [
    890420.383607373,
    84.9149257747669,
    0.334910077722432e-01,
    0.488399681651699,
    0.214274163161675,
    0.226073200069370,
    455.478499142212,
]
LONGLEY_RESIDUAL_STD = 304.854073561965


def test_longley_agrees_with_the_certified_values_to_nine_digits():
    table = np.array([row.split() for row in LONGLEY.strip().splitlines()], dtype=float)
    assert table.shape == (16, 7)
    estimate = least_squares(np.column_stack((np.ones(16), table[:, 1:])), table[:, 0])
    np.testing.assert_allclose(estimate.values, LONGLEY_VALUES, rtol=1e-9)
    np.testing.assert_allclose(estimate.std, LONGLEY_STD, rtol=1e-9)
    residual_std = np.sqrt(estimate.residuals @ estimate.residuals / estimate.dof)
    np.testing.assert_allclose(residual_std, LONGLEY_RESIDUAL_STD, rtol=1e-9)
    assert estimate.dof == 9


@given(st.integers(1, 5), st.integers(1, 4), st.integers(0, 2**32 - 1))
def test_stretching_turns_complex_products_into_real_ones(m, n, seed):
    rng = np.random.default_rng(seed)
    A, x = rng.normal(size=(m, n, 2)) @ [1, 1j], rng.normal(size=(n, 2)) @ [1, 1j]
    np.testing.assert_allclose(stretch(A) @ stretch(x), stretch(A @ x), atol=1e-12)
    np.testing.assert_allclose(stack(A) @ x.real, stack(A @ x.real), atol=1e-12)
    np.testing.assert_array_equal(unstretch(stretch(x)), x)


def straight_line(scatter=0.3):
    rng = np.random.default_rng(0)
    x = np.linspace(0, 5, 12)
    return np.column_stack((np.ones(12), x)), 2 + 0.7 * x + scatter * rng.normal(size=12)


def test_unstated_errors_give_student_intervals_from_the_residuals():
    K, Y = straight_line()
    estimate = least_squares(K, Y)
    spread = np.sqrt(estimate.residuals @ estimate.residuals / 10 / np.sum((K[:, 1] - 2.5) ** 2))
    assert estimate.std[1] == pytest.approx(spread, rel=1e-12)
    assert estimate.ci95[1, 1] - estimate.values[1] == pytest.approx(
        2.228138852 * spread, rel=1e-9
    )  # t, tables
    assert (estimate.errors_stated, estimate.chi_square) == (False, None)


def test_stated_errors_give_normal_intervals_whatever_the_residuals():
    K, Y = straight_line(scatter=30.0)
    estimate = least_squares(K, Y, sigma=0.3)
    spread = 0.3 / np.sqrt(np.sum((K[:, 1] - 2.5) ** 2))
    assert estimate.std[1] == pytest.approx(spread, rel=1e-12)
    assert np.ptp(estimate.ci95[1]) == pytest.approx(2 * 1.959963984540054 * spread, rel=1e-12)
    assert estimate.chi_square == pytest.approx(np.sum((estimate.residuals / 0.3) ** 2))
    assert "times as large as the stated errors explain" in estimate.summary()


def test_no_degrees_of_freedom_no_interval():
    estimate = least_squares([[1.0, 0.0], [1.0, 1.0]], [1.0, 2.0], names=["a", "b"])
    assert estimate.std is estimate.ci95 is estimate.correlation is None
    assert "no intervals" in estimate.summary()
    assert estimate.to_dict()["parameters"]["a"] == {"value": pytest.approx(1.0), "std": None, "ci95": None}


def test_stated_errors_weight_rows_as_the_inverse_of_their_squares():
    K, Y = straight_line()
    sigma = np.linspace(0.1, 1.0, 12)
    stated = least_squares(K, Y, sigma=sigma)
    information = K.T @ np.diag(sigma**-2) @ K
    np.testing.assert_allclose(stated.covariance, np.linalg.inv(information), rtol=1e-10)
    np.testing.assert_allclose(stated.values, np.linalg.solve(information, K.T @ (Y / sigma**2)), rtol=1e-10)


def test_opposite_columns_are_named_with_what_is_determined():
    rng = np.random.default_rng(2)
    c, b = rng.normal(size=(2, 9))
    estimate = least_squares(np.column_stack((c, b, -b)), 3 * c - 2 * b, names=["c", "b", "δb"], sigma=0.1)
    expected = least_squares(np.column_stack((c, b)), 3 * c - 2 * b, sigma=0.1)
    assert (estimate.rank, estimate.undetermined) == (2, ("b", "δb"))
    np.testing.assert_allclose(estimate.values, [3.0, np.nan, np.nan])
    (combination,) = estimate.combinations
    assert combination.value == pytest.approx(-2.0)
    assert (estimate.std[0], combination.std) == pytest.approx(tuple(expected.std), rel=1e-9)
    assert estimate.describe_rank().startswith("only c and b − δb are determined")
    document = estimate.to_dict()
    assert document["identifiable"] is False
    assert document["parameters"]["b"]["value"] is None
    assert document["combinations"] == {"b − δb": {"value": pytest.approx(-2.0), "std": combination.std}}
    assert estimate.answer.numbers.count("not determined") == 2


def test_columns_of_very_different_size_do_not_look_dependent():
    rng = np.random.default_rng(3)
    K = rng.normal(size=(20, 3)) * [1e-9, 1.0, 1e9]
    estimate = least_squares(K, K @ [2e9, 3.0, 4e-9])
    assert estimate.full_rank
    np.testing.assert_allclose(estimate.values, [2e9, 3.0, 4e-9], rtol=1e-12)


def test_a_zero_column_is_not_determined_and_the_rest_is():
    estimate = least_squares([[1.0, 0.0], [2.0, 0.0], [3.0, 0.0]], [2.0, 4.0, 6.0], names=["a", "nothing"])
    assert estimate.undetermined == ("nothing",)
    assert estimate.values[0] == pytest.approx(2.0)
    assert estimate.combinations == ()
    assert least_squares([[0.0]], [1.0], names=["a"]).describe_rank().startswith("nothing is determined")
    K = np.random.default_rng(1).normal(size=(9, 4)) * [1e5, 0.0, 1e-5, 1e3]
    assert least_squares(K, K.sum(axis=1)).combinations == ()  # rounding is nothing to be combined with


@each_of(
    ("K", "Y", "more", "message"),
    [
        ([[1.0], [2.0]], [1.0], {}, "K must be"),
        ([[1.0]], [np.inf], {}, "finite"),
        ([[1.0]], [1.0], {"names": ["a", "b"]}, "different names"),
        ([[1.0]], [1.0], {"sigma": 0.0}, "above 0"),
        ([[1.0]], [1.0], {"sigma": [1.0, 1.0]}, "per row of Y"),
        ([[1.0j]], [1.0], {}, "real"),
    ],
)
def test_bad_input_is_refused_with_a_reason(K, Y, more, message):
    with pytest.raises(ValueError, match=message):
        least_squares(K, Y, **more)


def test_gain_is_the_least_squares_solution_of_every_matrix():
    rng = np.random.default_rng(8)
    A = rng.normal(size=(4, 7, 3)) * [1e-6, 1.0, 1e6] + 1j * rng.normal(size=(4, 7, 3))
    y = rng.normal(size=7) + 1j * rng.normal(size=7)
    for matrix, G in zip(A, gain(A), strict=True):
        np.testing.assert_allclose(
            G @ y, unstretch(least_squares(stretch(matrix), stretch(y)).values), rtol=1e-9
        )


def test_plain_solution_of_too_few_equations_is_the_shortest_in_scaled_unknowns():
    np.testing.assert_allclose(solution([[1.0, 100.0, 0.0]], [2.0]), [1.0, 0.01, 0.0], rtol=1e-12)
