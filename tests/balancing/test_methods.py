"""Methods of correction against closed forms, independent optimisers and simulated jobs."""

import minmax_problems
import numpy as np
import pytest
from balancing_data import complex_normal
from hypothesis import given
from hypothesis import strategies as st
from limited_problems import drawn, global_search, problem
from scipy.optimize import minimize

from balancing.conditioning import UndeterminedError
from balancing.cones import InfeasibleError
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


def test_minmax_by_hand():
    """A third reading 0 pulls from −4 to −5/2."""
    fitted = solve([[1.0], [1.0], [1.0]], [0.0, 3.0, 5.0], method="minmax")
    assert fitted.weights[0] == pytest.approx(-2.5, abs=1e-7)
    assert fitted.objective == pytest.approx(2.5, rel=1e-8)
    np.testing.assert_allclose(np.abs(fitted.residual), [2.5, 0.5, 2.5], atol=1e-7)


@pytest.mark.parametrize("method", METHODS)
def test_planes_without_weight_are_left_out(method):
    """The third plane follows from the others; with at most zero in it the two are determined."""
    _, W, Y = numbers(4, 8, 2)
    three = np.column_stack((W, W @ [1, 2j]))
    fitted = solve(three, Y, method=method, limits=limits(8, 3, max_weight=[np.inf, np.inf, 0]))
    np.testing.assert_array_equal(fitted.active_weights, [False, False, True])
    np.testing.assert_allclose(fitted.weights, [*solve(W, Y, method=method).weights, 0], rtol=1e-4)
    turn = ((0.0, 2 * np.pi),)
    nowhere = solve(W, Y, method=method, limits=limits(8, 2, forbidden=(turn, turn)))
    assert (nowhere.weights == 0).all()
    np.testing.assert_array_equal(nowhere.residual, Y)


@pytest.mark.parametrize("method", METHODS)
@pytest.mark.parametrize("most", [np.inf, 100.0])
@pytest.mark.parametrize(
    ("W", "Y", "more", "error", "message"),
    [
        ([[1], [2], [3j]], [1, np.nan, 2], {}, ValueError, "must be finite; found NaN or infinity"),
        ([[1], [2], [3j]], [1, 2], {}, ValueError, "the vibration must have shape"),
        (np.zeros((0, 2)), [], {}, ValueError, "not empty"),
        ([[1, 2], [1j, 2j]], [1, 3], {"names": ["A", "B"]}, UndeterminedError, r"'A' and 'B' act alike"),
        ([[1, 0], [2, 0]], [1, 3], {}, UndeterminedError, "plane '2' has no effect on any reading"),
        ([[1, 2]], [1], {}, UndeterminedError, "2 planes need at least 2 readings"),
        ([[1, 2], [2, 1]], [1, 3], {"row_weights": [1, 0]}, UndeterminedError, "2 planes need"),
        ([[1, 2], [2, 1]], [1, 3], {"row_weights": [1, -1]}, ValueError, "row weights must be"),
        ([[1, 2], [2, 1]], [1, 3], {"names": ["A"]}, ValueError, "2 planes need as many names"),
    ],
)
def test_silent_wrong_answers_are_refused(method, most, W, Y, more, error, message):
    N, P = np.shape(W)
    given = limits(N, P, max_weight=most) if N and np.isfinite(most) else None
    with pytest.raises(error, match=message):
        solve(W, Y, method=method, limits=given, **more)


def test_what_cannot_be():
    with pytest.raises(ValueError, match="method 'huber' is not known"):
        solve([[1.0]], [1.0], method="huber")
    with pytest.raises(ValueError, match="the limits are for 3 readings and 1 planes; there are 2 and 1"):
        solve([[1.0], [1.0]], [1.0, 2.0], limits=limits(3, 1, max_weight=1))
    with pytest.raises(ValueError, match="needs errors of the readings"):
        solve([[1.0], [1.0]], [1.0, 2.0], "weighted")
    with pytest.raises(ValueError, match="least squares without limits only"):
        solve([[1.0]], [1.0], "minmax", strength=0.1)
    with pytest.raises(ValueError, match="a strength above 0"):
        solve([[1.0]], [1.0], "least-squares", strength=0.0)


def test_limits_in_conflict_are_explained():
    most = limits(2, 2, max_weight=[1.0, 0.0], residual=[2.0, np.inf])
    with pytest.raises(
        InfeasibleError, match=r"plane '1' and plane '2' left empty, reading 1 .limit 2. stays at 3"
    ):
        solve(np.eye(2), [4.0, 1.0], limits=most)
    with pytest.raises(InfeasibleError, match="with at most 1 in plane '1'"):
        solve(np.eye(2), [4.0, 1.0], "weighted", channels=np.zeros((2, 6, 6)) + np.eye(6), limits=most)


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


def test_the_weighted_fit_against_an_independent_optimiser():
    rng, W, _ = numbers(3, 6, 2)
    D, w = complex_normal(rng, 2), rng.uniform(0.5, 2, 6)
    root = 0.1 * rng.standard_normal((6, 6, 6)) / np.sqrt(6)
    C = root @ np.swapaxes(root, 1, 2)
    e = (root @ rng.standard_normal((6, 6, 1)))[..., 0]
    z = np.column_stack((-W @ D, W)) + e[:, ::2] + 1j * e[:, 1::2]
    fitted = solve(z[:, 1:], z[:, 0], "weighted", channels=C, row_weights=w)
    best = minimize(errors_of, stretch(D), (z[:, 1:], z[:, 0], C, w), method="BFGS", options={"gtol": 1e-7})
    np.testing.assert_allclose(stretch(fitted.weights), best.x, atol=1e-5)


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
    draws = fitted.resolve(np.broadcast_to(W, (400, 12, 2)), np.broadcast_to(Y, (400, 12)))
    expected = fitted.model_error * np.sqrt(np.trace(np.linalg.inv(W.conj().T @ W)).real)
    assert np.sqrt(np.mean(np.abs(draws - draws.mean(axis=0)) ** 2, axis=0).sum() / 2) == pytest.approx(
        expected, rel=0.15
    )


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


def simulated(seed, effect, draws=200):
    """Whether the 95 % region of redrawn runs holds the truth; two planes, twelve readings, 3 % and 2°."""
    rng = np.random.default_rng(seed)
    W, D = complex_normal(rng, (12, 2)), complex_normal(rng, 2)
    Y = -W @ D
    trial = effect * np.linalg.norm(Y) / np.linalg.norm(W, axis=0) * np.exp(2j * np.pi * rng.random(2))
    linear = np.vstack(([1, 0, 0], np.column_stack((-1 / trial, np.diag(1 / trial)))))

    def read(runs):
        return runs * (1 + 0.03 * rng.standard_normal(runs.shape) + 0.035j * rng.standard_normal(runs.shape))

    runs = read(np.column_stack((Y, Y[:, None] + W * trial)))
    channels = 0
    for p in range(3):
        for way in (0.03, 0.035j):
            pair = np.ascontiguousarray(linear[:, p] * (way * runs[:, p])[:, None]).view(float)
            channels = channels + pair[:, :, None] * pair[:, None]
    z = runs @ linear.T
    fitted = solve(z[:, 1:], z[:, 0], "weighted", channels=channels)
    again = read(np.broadcast_to(runs, (draws, *runs.shape))) @ linear.T
    x = np.ascontiguousarray(fitted.resolve(again[..., 1:], again[..., 0]) - fitted.weights).view(float)
    inverse = np.linalg.inv(np.cov(x.T))
    d = stretch(D - fitted.weights)
    return d @ inverse @ d <= np.quantile(np.einsum("bi,ij,bj->b", x, inverse, x), 0.95)


@pytest.mark.parametrize(("effect", "least"), [(0.6, 0.92), (0.2, 0.9)])
def test_regions_of_redrawn_runs_hold_the_truth(effect, least):
    """96 and 94 % of 300 jobs."""
    assert np.mean([simulated(seed, effect) for seed in range(100)]) >= least - 0.02


@pytest.mark.parametrize("method", ["weighted", *METHODS])
def test_each_method_keeps_limits_and_solves_again(method):
    W, Y, C = drawn(3)
    N, P = W.shape
    free = solve(W, Y, method, channels=C)
    arcs = ((np.angle(free.weights[1]) - 0.2, 0.5),)
    given = limits(
        N,
        P,
        max_weight=[0.8 * abs(free.weights[0]), *[np.inf] * (P - 1)],
        forbidden=((), arcs, *[()] * (P - 2)),
    )
    fitted = solve(W, Y, method, channels=C, limits=given)
    assert fitted.active_weights[0] == (method != "minmax")
    assert abs(fitted.weights[0]) <= given.max_weight[0]
    turn = np.mod(np.angle(fitted.weights[1]) - arcs[0][0], 2 * np.pi)
    assert turn >= 0.5 - 1e-6 or turn < 1e-6
    same = fitted.resolve(W[None], Y[None])[0]
    np.testing.assert_allclose(same, fitted.weights, atol=2e-3 * np.abs(fitted.weights).max())


@pytest.mark.parametrize("method", ["weighted", "least-squares"])
def test_a_limit_that_barely_binds_keeps_the_errors_of_what_is_not_bound(method):
    """Half of the machines need less than the limit: sqrt(1/2 − 1/(2π)) = 0.58 of the ± is left."""
    rng, W, _ = numbers(1, 12, 2)
    Y, C = -W @ complex_normal(rng, 2) + 0.02 * complex_normal(rng, 12), np.zeros((12, 6, 6))
    C += np.diag(np.repeat([0.02, 0.01, 0.01], 2)) ** 2
    e = rng.standard_normal((800, 12, 6)) * np.repeat([0.02, 0.01, 0.01], 2)
    e = np.ascontiguousarray(e).view(complex)
    free = solve(W, Y, method, channels=C)

    def widths(share):
        most = limits(12, 2, max_weight=[share * abs(free.weights[0]), np.inf])
        fitted = solve(W, Y, method, channels=C, limits=most)
        assert fitted.active_weights.tolist() == [share < 1, False]
        return np.std(np.abs(fitted.resolve(W + e[..., 1:], Y + e[..., 0])), axis=0)

    unlimited, barely = widths(1.5), widths(0.99999)
    assert barely[0] / unlimited[0] == pytest.approx(0.58, abs=0.05)
    assert barely[1] / unlimited[1] == pytest.approx(1, abs=0.1)


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


def test_redrawn_data_without_a_solution_are_not_a_number():
    given = limits(2, 1, max_weight=1.0, residual=2.0)
    fitted = solve([[1.0], [1.0]], [2.5, 2.5], "least-squares", limits=given)
    draws = fitted.resolve(
        np.ones((2, 2, 1), dtype=complex), np.array([[2.5, 2.5], [3.5, 3.5]], dtype=complex)
    )
    assert np.isfinite(draws[0]).all()
    assert np.isnan(draws[1]).all()


def test_units_do_not_matter_to_the_weighted_fit():
    W, Y, C = drawn(7)
    P = W.shape[1]
    unit = np.repeat([1e-6, *[1e3] * P], 2)
    plain, scaled = (
        solve(W, Y, "weighted", channels=C),
        solve(W * 1e3, Y * 1e-6, "weighted", channels=C * np.outer(unit, unit)),
    )
    np.testing.assert_allclose(scaled.weights, plain.weights * 1e-9, rtol=1e-6)
    assert scaled.chi_square == pytest.approx(plain.chi_square, rel=1e-7)
    again = scaled.resolve(1.01e3 * W[None], 1e-6 * Y[None]) * 1e9
    np.testing.assert_allclose(again, plain.resolve(1.01 * W[None], Y[None]), rtol=1e-5)
