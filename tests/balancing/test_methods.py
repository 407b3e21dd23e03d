"""Methods of correction against closed forms, independent optimisers and simulated jobs."""

import minmax_problems
import numpy as np
import pytest
from balancing_data import complex_normal
from hypothesis import given
from hypothesis import strategies as st
from limited_problems import global_search, problem

from balancing.conditioning import UndeterminedError
from balancing.methods import solve
from balancing.trials import Limits
from rotorid.regression import stretch, unstretch

METHODS = ("least-squares", "minmax")
seeds = st.integers(0, 2**32 - 1)


def numbers(seed, N=10, P=3):
    rng = np.random.default_rng(seed)
    return rng, minmax_problems.normal(rng, (N, P)), minmax_problems.normal(rng, N)


def limits(N, P, *, max_weight=np.inf, residual=np.inf, forbidden=None):
    most, highest = np.broadcast_to(max_weight, P), np.broadcast_to(residual, (1, N))
    return Limits(most.astype(float), highest.astype(float), forbidden or ((),) * P)


def errors_of(d, W, Y, C, w=1.0):
    """Q by its definition."""
    B, r = stretch([[1.0, *unstretch(d)]]), stretch(Y + W @ unstretch(d)).reshape(-1, 2)
    return float(np.sum(w**2 * np.einsum("ni,nij,nj->n", r, np.linalg.inv(B @ C @ B.T), r)))


@given(seeds, st.integers(1, 5), st.booleans())
def test_least_squares_is_the_closed_form(seed, P, weighted):
    rng, W, Y = numbers(seed, 12, P)
    w = rng.uniform(0, 2, 12) if weighted else np.ones(12)
    fitted = solve(W, Y, row_weights=w if weighted else None)
    expected = np.linalg.lstsq(w[:, None] * W, -w * Y, rcond=None)[0]
    np.testing.assert_allclose(fitted.weights, expected, rtol=1e-9, atol=1e-11)
    assert fitted.objective == pytest.approx(np.linalg.norm(w * fitted.residual), rel=1e-12)
    assert fitted.gap is None
    assert not fitted.active_weights.any()
    assert not fitted.active_residuals.any()
    # and the same gain for redrawn data
    again = solve(W, Y, "least-squares", row_weights=w).resolve(np.stack((W, 2 * W)), np.stack((Y, Y)))
    np.testing.assert_allclose(again, np.stack((expected, expected / 2)), rtol=1e-8, atol=1e-10)


@pytest.mark.parametrize("method", METHODS)
@pytest.mark.parametrize("most", [np.inf, 100.0])
@pytest.mark.parametrize(
    ("W", "Y", "more", "error", "message"),
    [
        ([[1], [2], [3j]], [1, np.nan, 2], {}, ValueError, "must be finite; found NaN or infinity"),
        ([[1, 2], [1j, 2j]], [1, 3], {"names": ["A", "B"]}, UndeterminedError, r"'A' and 'B' act alike"),
        ([[1, 0], [2, 0]], [1, 3], {}, UndeterminedError, "plane '2' has no effect on any reading"),
        ([[1, 2]], [1], {}, UndeterminedError, "2 planes need at least 2 readings"),
        ([[1, 2], [2, 1]], [1, 3], {"row_weights": [1, 0]}, UndeterminedError, "2 planes need"),
    ],
)
def test_silent_wrong_answers_are_refused(method, most, W, Y, more, error, message):
    N, P = np.shape(W)
    given = limits(N, P, max_weight=most) if N and np.isfinite(most) else None
    with pytest.raises(error, match=message):
        solve(W, Y, method=method, limits=given, **more)


@pytest.mark.parametrize(
    ("options", "words"),
    [
        (
            {"limits": limits(3, 1, max_weight=1)},
            "the limits are for 3 readings and 1 planes; there are 2",
        ),
        ({"limits": limits(2, 1, forbidden=(((0, 4), (3, 4)),))}, "leave plane '1' no angle"),
        ({"method": "weighted"}, "needs errors of the readings"),
        ({"method": "minmax", "strength": 0.1}, "least squares without limits only"),
    ],
)
def test_what_cannot_be(options, words):
    with pytest.raises(ValueError, match=words):
        solve([[1.0], [1.0]], [1.0, 2.0], **options)


def test_a_ridge_minimises_what_it_says_and_has_no_interval():
    rng, W, Y = numbers(7)
    W[:, 2] = W[:, 0]
    w, strength = rng.uniform(0.5, 2, 10), 0.1
    fitted = solve(W, Y, "least-squares", row_weights=w, strength=strength)
    A = w[:, None] * W
    size = np.linalg.norm(A, axis=0)
    top = np.linalg.svd(A / size, compute_uv=False)[0]

    def target(d):
        D = unstretch(d)
        return np.sum(w**2 * np.abs(Y + W @ D) ** 2) + (strength * top) ** 2 * np.sum(np.abs(size * D) ** 2)

    at, steps = stretch(fitted.weights), 1e-4 * np.eye(6)
    assert all(target(at) < min(target(at + step), target(at - step)) for step in steps)
    assert fitted.weights[0] * size[0] == pytest.approx(fitted.weights[2] * size[2])
    assert np.isnan(fitted.resolve(W[None], Y[None])).all()


def test_unbalance_outside_the_planes_becomes_a_further_error():
    """As large as what is left says; without it, large weights would excuse it by the errors of W."""
    rng, W, _ = numbers(13, 12, 2)
    D = complex_normal(rng, 2)
    Y = -W @ D + 0.4 * np.linalg.norm(W @ D) / np.sqrt(24) * complex_normal(rng, 12)
    C = np.zeros((12, 6, 6)) + np.diag(np.repeat([0.05, 0.1, 0.1], 2)) ** 2
    fitted = solve(W, Y, "weighted", channels=C)
    wide = C.copy()
    wide[:, [0, 1], [0, 1]] += fitted.model_error**2
    assert errors_of(stretch(fitted.weights), W, Y, wide) == pytest.approx(20, rel=1e-5)
    least = solve(W, Y).objective
    assert fitted.model_error == pytest.approx(least / np.sqrt(20), rel=0.1)


def test_errors_that_readings_have_in_common_do_not_contradict():
    """A factor common to all readings: χ² by their marginal errors would be too small or too large."""
    rng, W, _ = numbers(5, 20, 2)
    D, chi = complex_normal(rng, 2), []
    C = np.zeros((20, 6, 6)) + np.diag(np.repeat([0.02, 0.0, 0.0], 2)) ** 2
    direction = complex_normal(rng, 20)
    columns = np.zeros((1, 20, 3), dtype=complex)
    columns[0, :, 0] = direction
    pairs = columns.view(float)[0]
    channels = C + pairs[:, :, None] * pairs[:, None]
    for _ in range(100):
        Y = -W @ D + rng.standard_normal() * direction + 0.02 * complex_normal(rng, 20)
        fitted = solve(W, Y, "weighted", channels=channels, columns=columns)
        chi.append(fitted.chi_square)
        assert fitted.dof == 36
    assert np.mean(chi) == pytest.approx(36, abs=4 * np.sqrt(72 / 100))
    assert np.mean(np.array(chi) > 51) < 0.15  # 51.0 is the 95 % quantile


@pytest.mark.parametrize("seed", [1, 8, 15, 24, 44, 47])
def test_the_weighted_fit_within_limits_against_a_global_search(seed):
    W, Y, C, wider, given = problem(seed)
    fitted = solve(W, Y, "weighted", channels=C, limits=given)
    assert (np.abs(fitted.weights) <= given.max_weight).all()
    assert (np.abs(fitted.residual) <= given.residual.ravel() * (1 + 1e-12)).all()

    def objective(d):
        return errors_of(d, W, Y, wider)

    reached = objective(stretch(fitted.weights))
    assert reached <= global_search(objective, W, Y, given, 2) * (1 + 1e-4) + 1e-6


def test_redrawn_coefficients_change_the_step_of_their_own_draw():
    """D / (1 + e), to second order, and e times the error of the draw before."""
    W, D, e = np.ones((3, 1)), 2.0, 0.1 * np.array([1, -1, 1j, -1j])
    fitted = solve(W, -D * W[:, 0], "weighted", channels=np.tile(1e-12 * np.eye(4), (3, 1, 1)))
    drawn = fitted.resolve((1 + e)[:, None, None] * W, np.tile(-D, (4, 3)) + 0j)[:, 0]
    assert drawn == pytest.approx(D * (1 - e + e**2 + e * [0, *e[:-1]]), rel=1e-6)
