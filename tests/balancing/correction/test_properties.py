"""What must hold for every job."""

import numpy as np
from balancing_data import GRAM, complex_normal, job, synthetic
from hypothesis import given, settings
from hypothesis import strategies as st
from repetitions import FULL

from balancing import ReadingErrors, correct, estimate_influence

seeds = st.integers(0, 2**32 - 1)
unhurried = settings(deadline=None, max_examples=100 if FULL else 15)  # a busy machine is no failure


@unhurried
@given(seeds, st.integers(1, 4), st.integers(1, 3))
def test_an_exact_job_gives_its_coefficients_and_the_least_squares_weights(seed, planes, speeds):
    trials, W, Y0 = synthetic(np.random.default_rng(seed), planes=planes, speeds=speeds)
    influence = estimate_influence(trials)
    np.testing.assert_allclose(influence.W, W, rtol=1e-9, atol=1e-9 * np.abs(W).max())
    np.testing.assert_allclose(influence.baseline, Y0, rtol=1e-9)
    c = correct(influence, method="least-squares")
    flat = W.reshape(-1, planes)
    expected = np.linalg.lstsq(flat, -Y0.ravel(), rcond=None)[0]
    np.testing.assert_allclose(c.weights, expected, rtol=1e-7, atol=1e-9 * np.abs(expected).max())
    # the residual is orthogonal to everything the planes can do
    assert (
        np.abs(flat.conj().T @ c.after.ravel()).max()
        < 1e-9 * np.abs(flat).max() * np.abs(Y0).max() * flat.shape[0]
    )


@unhurried
@given(seeds)
def test_unbalance_in_the_planes_is_found_and_undone(seed):
    rng = np.random.default_rng(seed)
    W = complex_normal(rng, (2, 4, 2)) * 1e3
    U = complex_normal(rng, 2) * GRAM
    T = np.vstack((np.zeros(2), np.diag(complex_normal(rng, 2)))) * GRAM
    trials = job(np.einsum("scp,rp->rsc", W, T + U), T, speeds=(100.0, 200.0))
    c = correct(estimate_influence(trials), method="least-squares")
    np.testing.assert_allclose(c.weights, -U, rtol=1e-6, atol=1e-9 * GRAM)


@unhurried
@given(seeds, st.floats(1e-6, 1e6))
def test_the_unit_of_the_weights_scales_them(seed, factor):
    trials, _, _ = synthetic(np.random.default_rng(seed), errors=ReadingErrors(0.001, 0.001))
    scaled = job(trials.readings[0], trials.weights * factor, speeds=trials.speeds, errors=trials.errors)
    a, b = correct(estimate_influence(trials)), correct(estimate_influence(scaled))
    np.testing.assert_allclose(b.weights, a.weights * factor, rtol=1e-9)
    np.testing.assert_allclose(
        b.covariance, a.covariance * factor**2, rtol=1e-6, atol=1e-12 * factor**2 * GRAM**2
    )
    assert np.isclose(a.condition_number, b.condition_number)


@unhurried
@given(seeds, st.floats(-np.pi, np.pi))
def test_a_turned_mark_turns_the_angles(seed, turn):
    """A mark moved by `turn` with the rotation takes `turn` from every angle and from every phase."""
    trials, _, _ = synthetic(np.random.default_rng(seed), errors=ReadingErrors(0.001, 0.001))
    by = np.exp(-1j * turn)
    turned = job(trials.readings[0] * by, trials.weights * by, speeds=trials.speeds, errors=trials.errors)
    a, b = correct(estimate_influence(trials)), correct(estimate_influence(turned))
    np.testing.assert_allclose(b.weights, a.weights * by, rtol=1e-8)
    np.testing.assert_allclose(b.mass_std, a.mass_std, rtol=1e-6)
    np.testing.assert_allclose(np.abs(b.after), np.abs(a.after), rtol=1e-7, atol=1e-12)


@unhurried
@given(seeds, st.permutations(range(5)))
def test_the_order_of_the_runs_does_not_matter(seed, order):
    rng = np.random.default_rng(seed)
    T = np.array([[0, 0], [1, 0], [0, 1], [1, 1j], [-1, 0]]) * GRAM
    trials, _, _ = synthetic(rng, weights=T)
    noisy = trials.readings[0] * (1 + 0.01 * complex_normal(rng, trials.readings.shape[1:]))
    a = correct(estimate_influence(job(noisy, T, speeds=trials.speeds)))
    index = list(order)
    b = correct(estimate_influence(job(noisy[index], T[index], speeds=trials.speeds)))
    np.testing.assert_allclose(b.weights, a.weights, rtol=1e-5)
    np.testing.assert_allclose(b.covariance, a.covariance, rtol=1e-4, atol=1e-9 * np.abs(a.covariance).max())


@unhurried
@given(seeds)
def test_trial_weights_removed_or_left_in_say_the_same(seed):
    rng = np.random.default_rng(seed)
    left_in = np.array([[0, 0, 0], [1, 0, 0], [1, 1j, 0], [1, 1j, -1]]) * GRAM
    removed = np.diag([1, 1j, -1]) * GRAM
    W, Y0 = complex_normal(rng, (2, 3, 3)) * 1e3, complex_normal(rng, (2, 3))
    results = [
        correct(
            estimate_influence(job(Y0 + np.einsum("scp,rp->rsc", W, T), T, speeds=(100.0, 200.0))),
            method="least-squares",
        )
        for T in (left_in, np.vstack((np.zeros(3), removed)))
    ]
    np.testing.assert_allclose(results[0].weights, results[1].weights, rtol=1e-6)
    assert results[0].to_add is not None
    np.testing.assert_allclose(results[0].to_add, results[0].weights - left_in[-1], rtol=1e-12)


@unhurried
@given(seeds)
def test_no_baseline_run_is_needed_where_the_runs_determine_it(seed):
    T = np.array([[1, 0], [-1, 0], [0, 1], [0, -1j]]) * GRAM
    trials, W, Y0 = synthetic(np.random.default_rng(seed), weights=T)
    influence = estimate_influence(trials)
    np.testing.assert_allclose(influence.baseline, Y0, rtol=1e-8, atol=1e-12)
    np.testing.assert_allclose(influence.W, W, rtol=1e-8, atol=1e-9)
