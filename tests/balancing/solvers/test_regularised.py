"""Ridge and truncated corrections: against other ways to compute them, and their errors."""

import numpy as np
import pytest
from balancing_data import complex_normal
from repetitions import FULL

from balancing import ReadingErrors, UndeterminedError
from balancing.data.reading_errors import reading_covariance
from balancing.solvers.regularised import BIAS, STRENGTHS, cross_validated, harmless, ridge, truncated
from rotorid.regression import stretch, unstretch

SHAPES = [(7, 3), (4, 4), (3, 4), (5, 1)]


def case(N, P, seed=0):
    rng = np.random.default_rng(seed)
    scale = np.array([1.0, 20.0, 0.3, 4.0])[:P]
    return complex_normal(rng, (N, P)) * scale, complex_normal(rng, N), rng.uniform(0.3, 2, N)


def alike(rng, N=12, noise=0.02):
    """Two planes that do the same but for some noise, and a third."""
    W = complex_normal(rng, (N, 3))
    W[:, 1] = 2j * W[:, 0] + noise * complex_normal(rng, N)
    return W


def lengths(W, w):
    return np.linalg.norm(w[:, None] * W, axis=0)


@pytest.mark.parametrize(("N", "P"), SHAPES)
def test_the_ridge_against_real_least_squares_with_rows_added(N, P):
    W, Y, w = case(N, P)
    found = ridge(W, Y, 0.3, w)
    s = lengths(W, w)
    largest = np.linalg.norm(w[:, None] * W / s, ord=2)
    K = np.vstack((stretch(w[:, None] * W), np.repeat(0.3 * largest * s, 2) * np.eye(2 * P)))
    expected = np.linalg.lstsq(K, -np.concatenate((stretch(w * Y), np.zeros(2 * P))), rcond=None)[0]
    np.testing.assert_allclose(found.weights, unstretch(expected), rtol=1e-10)
    np.testing.assert_allclose(found.residual, Y + W @ found.weights, rtol=1e-12)
    # effective number: the trace of the matrix that maps readings to fitted readings
    hat = K[: 2 * N] @ np.linalg.solve(K.T @ K, K[: 2 * N].T)
    np.testing.assert_allclose(found.effective, np.trace(hat) / 2, rtol=1e-10)
    assert (found.strength, found.kept) == (0.3, None)


@pytest.mark.parametrize(("N", "P"), SHAPES)
def test_the_truncated_solution_against_a_pseudo_inverse(N, P):
    W, Y, w = case(N, P)
    s = lengths(W, w)
    B = w[:, None] * W / s
    sigma = np.linalg.svd(B, compute_uv=False)
    for keep in range(1, min(N, P) + 1):
        cut = 0.0 if keep == len(sigma) else (sigma[keep - 1] + sigma[keep]) / 2 / sigma[0]
        expected = -np.linalg.pinv(B, rcond=max(cut, 1e-13)) @ (w * Y) / s
        found = truncated(W, Y, keep, w)
        np.testing.assert_allclose(found.weights, expected, rtol=1e-9)
        assert (found.kept, found.strength) == (keep, None)
        np.testing.assert_allclose(found.effective, keep, rtol=1e-12)
        if cut:
            np.testing.assert_array_equal(truncated(W, Y, cut, w).weights, found.weights)


def test_a_weak_ridge_and_all_combinations_are_least_squares():
    W, Y, _ = case(7, 3)
    expected = -np.linalg.lstsq(W, Y, rcond=None)[0]
    np.testing.assert_allclose(ridge(W, Y, 1e-7).weights, expected, rtol=1e-10)
    np.testing.assert_allclose(truncated(W, Y, 3).weights, expected, rtol=1e-10)


def test_a_stronger_ridge_has_smaller_weights_and_a_larger_residual():
    W, Y = alike(np.random.default_rng(3)), complex_normal(np.random.default_rng(4), 12)
    found = [ridge(W, Y, k) for k in (1e-3, 1e-2, 0.1, 1.0)]
    size = [np.linalg.norm(f.weights * lengths(W, np.ones(12))) for f in found]
    left = [np.linalg.norm(f.residual) for f in found]
    assert (np.diff(size) < 0).all()
    assert (np.diff(left) > 0).all()
    assert (np.diff([f.effective for f in found]) < 0).all()


def test_units_of_a_plane_do_not_matter():
    W, Y, w = case(7, 3)
    unit = np.array([1e-3, 1.0, 50.0])
    for solve in (lambda K: ridge(K, Y, 0.2, w), lambda K: truncated(K, Y, 2, w)):
        np.testing.assert_allclose(solve(W * unit).weights * unit, solve(W).weights, rtol=1e-10)


def test_planes_that_are_exactly_dependent_share_the_weight():
    """Where least squares has no answer: two planes with the effects w and 2j·w."""
    rng = np.random.default_rng(2)
    a = complex_normal(rng, 6)
    W, Y = np.column_stack((a, 2j * a)), -3 * a
    found = truncated(W, Y, 1)
    # scaled to equal effect both planes get the same part of it
    np.testing.assert_allclose(found.weights, [1.5, 1.5 / 2j], rtol=1e-12)
    np.testing.assert_allclose(ridge(W, Y, 1e-6).weights, found.weights, rtol=1e-9)
    with pytest.raises(ValueError, match="determine 1 combinations of the 2 planes; 2 cannot be kept"):
        truncated(W, Y, 2)
    assert truncated(W, Y, 1e-15).kept == 1


@pytest.mark.parametrize(("N", "P"), SHAPES)
@pytest.mark.parametrize("kind", ["ridge", "truncated"])
def test_the_jacobian_against_finite_differences(kind, N, P):
    W, Y, w = case(N, P)

    def solve(W, Y):
        return ridge(W, Y, 0.3, w) if kind == "ridge" else truncated(W, Y, max(1, min(N, P) - 1), w)

    J = solve(W, Y).jacobian
    assert J.shape == (N, 2 * P, 2 * P + 2)
    h = 1e-6
    found = np.empty_like(J)
    for n in range(N):
        for k in range(2 * P + 2):
            direction = np.zeros(2 * P + 2)
            direction[k] = h
            d = direction[::2] + 1j * direction[1::2]
            change = []
            for sign in (1, -1):
                Ys, Ws = Y.copy(), W.copy()
                Ys[n] += sign * d[0]
                Ws[n] += sign * d[1:]
                change.append(stretch(solve(Ws, Ys).weights))
            found[n, :, k] = (change[0] - change[1]) / (2 * h)
    np.testing.assert_allclose(J, found, atol=2e-8)


@pytest.mark.parametrize("kind", ["ridge", "truncated"])
def test_the_covariance_against_simulated_jobs(kind):
    """Standard deviations within 7 % of 1000 drawn jobs (statistical: 2.2 %), in planes that act alike."""
    rng = np.random.default_rng(6)
    W = alike(rng, noise=0.05)
    Y = complex_normal(rng, 12)
    errors = ReadingErrors(amplitude=0.01, phase=0.01)
    size = np.concatenate((Y[:, None], W), axis=1)
    channels = np.zeros((12, 8, 8))
    own = reading_covariance(size, errors)
    for k in range(4):
        channels[:, 2 * k : 2 * k + 2, 2 * k : 2 * k + 2] = own[:, k]

    def solve(W, Y, **more):
        return ridge(W, Y, 0.1, **more) if kind == "ridge" else truncated(W, Y, 2, **more)

    found = solve(W, Y, channels=channels)
    n, draws = 3000 if FULL else 1000, []
    for _ in range(n):
        drawn = size * (1 + 0.01 * complex_normal(rng, size.shape))
        draws.append(stretch(solve(drawn[:, 1:], drawn[:, 0]).weights))
    stated = np.sqrt(np.diag(found.covariance))
    np.testing.assert_allclose(np.std(draws, axis=0), stated, rtol=2.2 / np.sqrt(n))
    largest = np.diag(found.covariance).max()
    np.testing.assert_allclose(np.cov(np.transpose(draws)), found.covariance, atol=3.3 / np.sqrt(n) * largest)


def test_unknown_errors_give_no_covariance_and_wrong_ones_are_refused():
    W, Y, _ = case(7, 3)
    assert ridge(W, Y, 0.1).covariance is None
    with pytest.raises(ValueError, match=r"must have shape \(7, 8, 8\)"):
        ridge(W, Y, 0.1, channels=np.zeros((7, 6, 6)))


def test_cross_validation_minimises_its_own_formula():
    """Recomputed with the matrix that maps readings to fitted ones."""
    rng = np.random.default_rng(9)
    W, w = alike(rng), rng.uniform(0.5, 2, 12)
    Y = -W @ complex_normal(rng, 3) + 0.3 * complex_normal(rng, 12)
    s = lengths(W, w)
    B = w[:, None] * W / s
    largest = np.linalg.norm(B, ord=2)
    value = []
    for k in STRENGTHS:
        hat = B @ np.linalg.solve(B.conj().T @ B + (k * largest) ** 2 * np.eye(3), B.conj().T)
        robust = 0.3 + 0.7 * np.trace(hat @ hat).real / 12
        value.append(robust * np.linalg.norm(w * Y - hat @ (w * Y)) ** 2 / (12 - np.trace(hat).real) ** 2)
    best = STRENGTHS[int(np.argmin(value))]
    assert STRENGTHS[0] < best < STRENGTHS[-1]
    np.testing.assert_allclose(cross_validated(W, Y, w), best)
    assert ridge(W, Y, "auto", w).strength == cross_validated(W, Y, w)
    # readings that do not count are as if they were not there
    more = complex_normal(rng, (40, 3))
    assert cross_validated(np.vstack((W, more)), np.r_[Y, more[:, 0]], np.r_[w, np.zeros(40)]) == best


def test_the_automatic_ridge_is_closer_to_the_truth_where_planes_act_alike():
    """Mean over 60 jobs; least squares is worse more than twofold, a clear case hardly changes."""
    rng = np.random.default_rng(12)
    miss = {"auto": [], "none": [], "clear": []}
    for _ in range(60):
        W, D = alike(rng), complex_normal(rng, 3)
        Y = -W @ D + 0.2 * complex_normal(rng, 12)
        for name, strength in (("auto", "auto"), ("none", 1e-6)):
            miss[name].append(np.linalg.norm(ridge(W, Y, strength).weights - D) ** 2)
        clear = complex_normal(rng, (12, 3))
        exact = -clear @ D + 0.01 * complex_normal(rng, 12)
        miss["clear"].append(np.linalg.norm(ridge(clear, exact, "auto").weights - D))
    assert 2 * np.mean(miss["auto"]) < np.mean(miss["none"])
    assert np.mean(miss["clear"]) < 0.02


def test_words_say_that_the_solution_is_biased():
    W, Y = alike(np.random.default_rng(3)), complex_normal(np.random.default_rng(4), 12)
    assert ridge(W, Y, 0.1).words == (
        "ridge of strength 0.1: 2 of 3 combinations of the planes are determined; the weights are biased "
        "towards zero, and the intervals are those of this estimate, not of the true unbalance"
    )
    assert truncated(W, Y, 2).words.startswith(
        "truncated to 2 of 3 combinations of the planes; the weights are "
    )
    assert ", chosen by generalised cross-validation: " in ridge(W, Y, "auto").words


@pytest.mark.parametrize("strength", [0, -0.1, np.nan, np.inf, "strong"])
def test_strengths_that_are_none(strength):
    with pytest.raises(ValueError, match=r"number above 0, such as 0\.05, or 'auto'"):
        ridge([[1], [2]], [1, 1], strength)


@pytest.mark.parametrize("keep", [0, -1, 1.5, np.nan, np.inf])
def test_numbers_to_keep_that_are_none(keep):
    with pytest.raises(ValueError, match="keep is the number of combinations"):
        truncated([[1], [2]], [1, 1], keep)


def test_a_cut_between_equal_singular_values_is_refused():
    with pytest.raises(ValueError, match="singular values 1 and 2 are equal"):
        truncated([[1, 0], [0, 1]], [1, 1], 1)


def test_other_refusals():
    with pytest.raises(ValueError, match="cannot be chosen from 2 readings for 2 planes"):
        ridge([[1, 0.2], [0.1, 1]], [1, 1], "auto")
    with pytest.raises(UndeterminedError, match="plane 'B' has no effect on any reading"):
        ridge([[1, 0], [2, 0]], [1, 1], 0.1, planes=["A", "B"])
    with pytest.raises(ValueError, match="found NaN"):
        truncated([[1.0], [2.0]], [np.nan, 1], 1)


def with_errors(W, Y, errors):
    """Covariance of (Y, W) of each reading, every number of which has errors of its own."""
    N, P = W.shape
    out = np.zeros((N, P + 1, 2, P + 1, 2))
    for p, z in enumerate((Y, *W.T)):
        out[:, p, :, p] = reading_covariance(z, errors)
    return out.reshape(N, 2 * P + 2, 2 * P + 2)


def test_the_automatic_ridge_leaves_what_is_determined():
    for seed in range(20):
        rng = np.random.default_rng(seed)
        W = complex_normal(rng, (8, 2))
        W[:, 1] = W[:, 0] + 0.3 * complex_normal(rng, 8)  # alike, yet 20 times the errors apart
        Y = -W @ [1.3, 0.7] + 0.3 * complex_normal(rng, 8)
        s = np.linalg.svd(W / np.linalg.norm(W, axis=0), compute_uv=False)
        lost = []
        for channels in (None, with_errors(W, Y, ReadingErrors(0.01, 0.01))):
            strength = ridge(W, Y, "auto", channels=channels).strength
            lost.append(1 - s[1] ** 2 / (s[1] ** 2 + (strength * s[0]) ** 2))
        assert lost[0] > 0.2  # by cross-validation alone
        assert lost[1] <= BIAS * (1 + 1e-9)


def test_the_automatic_ridge_still_shrinks_what_only_errors_tell_apart():
    rng = np.random.default_rng(0)
    W, Y = alike(rng), complex_normal(rng, 12)
    channels = with_errors(W, Y, ReadingErrors(0.02, 0.02))
    s = np.linalg.svd(W / np.linalg.norm(W, axis=0), compute_uv=False)
    assert harmless(W, channels) == pytest.approx(s[1] / s[0] * np.sqrt(BIAS / (1 - BIAS)))
    assert harmless(W, None) == harmless(W, 1e6 * channels) == np.inf
    assert ridge(W, Y, "auto", channels=1e6 * channels).strength == cross_validated(W, Y)
    # what the readings have in common counts too
    assert ridge(W, Y, "auto", channels=channels, total=1e6 * channels).strength == cross_validated(W, Y)
