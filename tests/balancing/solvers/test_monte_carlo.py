"""Covariance of weights by drawing readings from their errors."""

import numpy as np
import pytest
from balancing_data import complex_normal

from balancing.solvers.error_propagation import correction_jacobian
from balancing.solvers.monte_carlo import sampled_covariance
from rotorid.regression import gain


def plain(W, Y):
    return -gain(W) @ Y


def problem(scale=1.0):
    rng = np.random.default_rng(1)
    W, Y = complex_normal(rng, (6, 2)), complex_normal(rng, 6)
    root = 0.02 * rng.standard_normal((6, 6, 6))
    unit = np.repeat([1.0, scale, scale], 2)
    return W * scale, Y, root @ np.swapaxes(root, 1, 2) * np.outer(unit, unit)


@pytest.mark.parametrize("scale", [1.0, 1e9])
def test_least_squares_agrees_with_the_formula(scale):
    """Standard deviations within 6 % (statistical: 1.6 % for 2000 draws)."""
    W, Y, C = problem(scale)
    D = plain(W, Y)
    J = correction_jacobian(W, D, Y + W @ D)
    expected = np.sum(J @ C @ np.swapaxes(J, 1, 2), axis=0)
    found = sampled_covariance(plain, W, Y, C, draws=2000)
    np.testing.assert_allclose(np.sqrt(np.diag(found)), np.sqrt(np.diag(expected)), rtol=0.06)
    np.testing.assert_allclose(found, expected, atol=0.09 * np.diag(expected).max())
    np.testing.assert_array_equal(found, found.T)


def test_the_seed_decides():
    W, Y, C = problem()
    a, b, c = (sampled_covariance(plain, W, Y, C, draws=20, seed=s) for s in (3, 3, 4))
    np.testing.assert_array_equal(a, b)
    assert not np.allclose(a, c)


def test_errors_in_one_direction_only():
    """A singular covariance: only the real part of Y is uncertain, and one plane with W = 1."""
    C = np.zeros((1, 4, 4))
    C[0, 0, 0] = 0.25
    found = sampled_covariance(plain, [[1.0]], [2.0 + 1j], C, draws=4000)
    assert found[0, 0] == pytest.approx(0.25, rel=0.09)
    assert abs(found[0, 1]) < 1e-20
    assert found[1, 1] < 1e-20


def test_a_weight_held_by_a_limit_scatters_along_it():
    def held(W, Y):
        D = plain(W, Y)
        return D / np.abs(D) * np.minimum(np.abs(D), 0.5)

    C = np.zeros((1, 4, 4)) + np.diag([0.01, 0.01, 0, 0])
    found = sampled_covariance(held, [[1.0]], [-2.0], C, draws=2000)
    assert found[1, 1] == pytest.approx(0.01 / 16, rel=0.09)
    assert found[0, 0] < 1e-4


def test_draws_without_a_solution_are_left_out():
    calls = []

    def sometimes(W, Y):
        calls.append(1)
        if len(calls) % 10 == 0:
            raise ValueError("infeasible")
        if len(calls) % 10 == 5:
            return np.array([np.nan, 1.0])
        return plain(W, Y)

    W, Y, C = problem()
    found = sampled_covariance(sometimes, W, Y, C, draws=400)
    assert len(calls) == 400
    np.testing.assert_allclose(found, sampled_covariance(plain, W, Y, C), atol=0.05 * found.trace())


def test_too_many_draws_without_a_solution():
    calls = []

    def often(W, Y):
        calls.append(1)
        if len(calls) % 4 == 0:
            raise ValueError("the limit of sensor 'a' cannot be met")
        return plain(W, Y)

    with pytest.raises(
        ValueError, match=r"100 of 400 problems have no solution \(the last one: the limit of"
    ):
        sampled_covariance(often, *problem())


def test_the_solver_may_change_its_arguments():
    def careless(W, Y):
        D = plain(W, Y)
        W[:], Y[:] = 0, 0
        return D

    W, Y, C = problem()
    np.testing.assert_array_equal(
        sampled_covariance(careless, W, Y, C, draws=20), sampled_covariance(plain, W, Y, C, draws=20)
    )


def test_bad_input_is_refused():
    W, Y, C = problem()
    with pytest.raises(ValueError, match=r"must have shape \(readings, planes"):
        sampled_covariance(plain, W[:, 0], Y, C)
    with pytest.raises(ValueError, match="the vibration must have shape"):
        sampled_covariance(plain, W, Y[:3], C)
    with pytest.raises(ValueError, match="found NaN"):
        sampled_covariance(plain, W, Y * np.nan, C)
    with pytest.raises(ValueError, match="more than 6 draws"):
        sampled_covariance(plain, W, Y, C, draws=6)
    with pytest.raises(ValueError, match="must return 2 weights"):
        sampled_covariance(lambda W, Y: np.zeros(3), W, Y, C)
