"""The fit with errors in W against its definition, independent optimisers and simulated jobs."""

import numpy as np
import pytest
from balancing_data import complex_normal
from repetitions import FULL
from scipy.optimize import least_squares as optimise
from scipy.optimize import minimize

from balancing import UndeterminedError
from balancing.data.reading_errors import ReadingErrors, reading_covariance
from balancing.solvers.effective_variance import FLOOR, effective_variance
from balancing.solvers.error_propagation import prediction_covariance
from balancing.solvers.likelihood import evaluate, gradient, hessian, problem_of
from rotorid.regression import least_squares, stretch, unstretch


def covariances(rng, N, P, size=0.1):
    """Full covariances of (Y, W₁, …), everything correlated with everything."""
    root = rng.standard_normal((N, 2 * P + 2, 2 * P + 2)) * size / np.sqrt(2 * P + 2)
    return root @ np.swapaxes(root, 1, 2)


def problem(seed, N=6, P=2, size=0.1):
    """Data drawn around a truth, D of order 1."""
    rng = np.random.default_rng(seed)
    W, D = complex_normal(rng, (N, P)), complex_normal(rng, P)
    C = covariances(rng, N, P, size)
    errors = (np.linalg.cholesky(C) @ rng.standard_normal((N, 2 * P + 2, 1)))[..., 0]
    z = np.column_stack((-W @ D, W)) + errors[:, ::2] + 1j * errors[:, 1::2]
    return z[:, 1:], z[:, 0], C, D


def objective(d, W, Y, C, w=1.0):
    """The definition, reading by reading."""
    D = unstretch(d)
    r = stretch(Y + W @ D).reshape(-1, 2)
    return float(np.sum(w**2 * np.einsum("ni,nij,nj->n", r, np.linalg.inv(prediction_covariance(D, C)), r)))


@pytest.mark.parametrize("seed", range(5))
def test_the_minimum_against_an_independent_optimiser(seed):
    W, Y, C, D = problem(seed)
    fit = effective_variance(W, Y, C)
    found = minimize(objective, stretch(D), (W, Y, C), method="BFGS", options={"gtol": 1e-7})
    assert fit.converged
    assert fit.chi_square == pytest.approx(found.fun, rel=1e-7)
    np.testing.assert_allclose(stretch(fit.weights), found.x, atol=1e-5)
    assert fit.dof == 8


def test_it_is_the_maximum_likelihood_over_all_true_values():
    """Fit of D together with every true coefficient; the true vibration is −W D."""
    W, Y, C, D = problem(11, size=0.3)
    white = np.linalg.inv(np.linalg.cholesky(C))
    data = stretch(np.column_stack((Y, W)).ravel()).reshape(6, 6)

    def misfit(x):
        true = unstretch(x)
        w = true[2:].reshape(6, 2)
        model = stretch(np.column_stack((-w @ true[:2], w)).ravel()).reshape(6, 6)
        return np.einsum("nij,nj->ni", white, data - model).ravel()

    start = stretch(np.concatenate((D, W.ravel())))
    found = optimise(misfit, start, xtol=1e-14, ftol=1e-14, gtol=1e-12)
    fit = effective_variance(W, Y, C)
    np.testing.assert_allclose(stretch(fit.weights), found.x[:4], atol=1e-5)
    assert fit.chi_square == pytest.approx(2 * found.cost, rel=1e-6)


def test_gradient_and_hessian_against_finite_differences():
    W, Y, C, D = problem(3, size=0.4)
    w = np.array([1.0, 2.0, 0.5, 1.0, 3.0, 1.0])
    made = problem_of(W, Y, C, w)
    d = stretch(D) + 0.3
    at = evaluate(made, d)
    assert at.objective == pytest.approx(objective(d, W, Y, C, w), rel=1e-12)
    h = 1e-5
    for k, e in enumerate(np.eye(4) * h):
        slope = (objective(d + e, W, Y, C, w) - objective(d - e, W, Y, C, w)) / (4 * h)
        assert gradient(made, at)[k] == pytest.approx(slope, rel=1e-6)
        row = (gradient(made, evaluate(made, d + e)) - gradient(made, evaluate(made, d - e))) / (2 * h)
        np.testing.assert_allclose(hessian(made, at)[k], row, rtol=1e-6)


def test_the_gradient_vanishes_to_rounding_from_any_start():
    W, Y, C, D = problem(4, N=40, P=4)
    fits = [effective_variance(W, Y, C, start=start) for start in (None, D, 1.3 * D)]
    for fit in fits:
        assert fit.converged
        np.testing.assert_allclose(fit.weights, fits[0].weights, rtol=1e-12)


def test_exact_coefficients_are_weighted_least_squares():
    rng = np.random.default_rng(5)
    W, own = complex_normal(rng, (7, 2)), covariances(rng, 7, 0, 1.0)
    errors = (np.linalg.cholesky(own) @ rng.standard_normal((7, 2, 1))).ravel()
    Y = W @ complex_normal(rng, 2) + unstretch(errors)
    C = np.zeros((7, 6, 6))
    C[:, :2, :2] = own
    whole = np.zeros((14, 14))
    for n in range(7):
        whole[2 * n : 2 * n + 2, 2 * n : 2 * n + 2] = own[n]
    known = least_squares(W, -Y, sigma=whole)
    fit = effective_variance(W, Y, C)
    np.testing.assert_allclose(stretch(fit.weights), known.values, rtol=1e-5)
    np.testing.assert_allclose(fit.covariance, known.covariance, rtol=1e-4, atol=1e-6)
    assert fit.chi_square == pytest.approx(known.chi_square, rel=1e-4)


def test_exact_data_give_exact_weights():
    rng = np.random.default_rng(6)
    W, D = complex_normal(rng, (600, 12)), complex_normal(rng, 12)
    fit = effective_variance(W, -W @ D, covariances(rng, 600, 12))
    assert fit.converged
    np.testing.assert_allclose(fit.weights, D, rtol=1e-11)
    assert fit.chi_square < 1e-18
    assert fit.inflation == 1
    assert fit.model_error == 0


def test_units_do_not_matter():
    W, Y, C, _ = problem(7)
    unit = np.repeat([1e-6, 1e3, 1e3], 2)
    plain, scaled = (
        effective_variance(W, Y, C),
        effective_variance(W * 1e3, Y * 1e-6, C * np.outer(unit, unit)),
    )
    np.testing.assert_allclose(scaled.weights, plain.weights * 1e-9, rtol=1e-10)
    np.testing.assert_allclose(scaled.covariance, plain.covariance * 1e-18, rtol=1e-8, atol=1e-30)
    assert scaled.chi_square == pytest.approx(plain.chi_square, rel=1e-9)


def test_a_weight_counts_like_repeated_readings_and_zero_like_none():
    W, Y, C, _ = problem(8)
    twice = [0, 0, 1, 2, 3, 4]
    weighted = effective_variance(W, Y, C, row_weights=[np.sqrt(2), 1, 1, 1, 1, 0])
    repeated = effective_variance(W[twice], Y[twice], C[twice])
    # the floor is a share of the mean error, which is not the same
    np.testing.assert_allclose(weighted.weights, repeated.weights, rtol=1e-6)
    assert weighted.dof == 6
    assert weighted.derivatives.shape == (6, 4, 6)


def test_as_many_readings_as_unknowns_are_solved_exactly():
    W, Y, C, _ = problem(9, N=2)
    fit = effective_variance(W, Y, C)
    assert fit.dof == 0
    assert fit.inflation == 1
    np.testing.assert_allclose(fit.weights, -np.linalg.solve(W, Y), rtol=1e-9)
    assert (np.linalg.eigvalsh(fit.covariance) > 0).all()


def test_an_exact_direction_becomes_an_exact_equation():
    """Only one part of each reading has errors; the other parts determine the weights by themselves."""
    rng = np.random.default_rng(10)
    W, D = complex_normal(rng, (4, 2)), complex_normal(rng, 2)
    Y = -W @ D + 0.1 * rng.standard_normal(4)
    C = np.zeros((4, 6, 6))
    C[:, 0, 0] = 0.01
    fit = effective_variance(W, Y, C)
    assert fit.converged
    np.testing.assert_allclose(fit.weights, D, atol=1e-5)
    assert np.isfinite(fit.covariance).all()
    # standard deviations: FLOOR of the mean error, times the gain of the exact equations
    assert np.sqrt(fit.covariance.trace()) < 100 * FLOOR * 0.1


def test_amplitude_errors_alone_and_a_reading_of_zero():
    """Readings of all runs in phase: every covariance is singular, and one reading has no error at all."""
    rng = np.random.default_rng(12)
    W = complex_normal(rng, (5, 1))
    Y = -W[:, 0] * (1 + 0.02 * rng.standard_normal(5))
    Y[4], W[4] = 0, 0
    C = np.zeros((5, 4, 4))
    C[:, :2, :2] = reading_covariance(Y, ReadingErrors(amplitude=0.02))
    C[:, 2:, 2:] = reading_covariance(W[:, 0], ReadingErrors(amplitude=0.02))
    fit = effective_variance(W, Y, C)
    assert fit.converged
    assert fit.inflation == 1
    assert abs(fit.weights[0] - 1) < 0.05
    assert abs(fit.weights[0].imag) < 1e-6
    assert np.isfinite(fit.covariance).all()


def test_unbalance_outside_the_planes():
    """The plain fit would excuse the residual by large weights; this one leaves what least squares does."""
    rng = np.random.default_rng(13)
    W, D = complex_normal(rng, (12, 2)), complex_normal(rng, 2)
    outside = 0.4 * np.linalg.norm(W @ D) / np.sqrt(24) * complex_normal(rng, 12)
    Y = -W @ D + outside
    C = np.zeros((12, 6, 6))
    C += np.diag(np.repeat([0.05, 0.1, 0.1], 2)) ** 2
    fit = effective_variance(W, Y, C)
    best = np.linalg.lstsq(W, -Y, rcond=None)[0]
    plain = minimize(objective, stretch(best), (W, Y, C), method="BFGS").x
    left, least, worse = (np.linalg.norm(Y + W @ x) for x in (fit.weights, best, unstretch(plain)))
    assert fit.inflation == pytest.approx(np.sqrt(objective(plain, W, Y, C) / 20), rel=1e-6)
    assert fit.inflation > 1.5
    assert left < 1.005 * least
    assert worse > 1.02 * least
    # what is left stands to the further error as its degrees of freedom say
    assert fit.model_error == pytest.approx(least / np.sqrt(20), rel=0.099)
    wider = C.copy()
    wider[:, [0, 1], [0, 1]] += fit.model_error**2
    assert objective(stretch(fit.weights), W, Y, wider) == pytest.approx(20, rel=1e-5)


@pytest.mark.parametrize("outside", [0.01, 0.1, 1.0, 30.0])
@pytest.mark.parametrize("of_reading", [1e-4, 0.1])
def test_the_further_error_explains_what_is_left(outside, of_reading):
    """However far it is beyond the errors, and whatever a part of the readings knows exactly."""
    rng = np.random.default_rng(14)
    for _ in range(10):
        W, D = complex_normal(rng, (17, 3)), complex_normal(rng, 3)
        Y = -W @ D + outside * complex_normal(rng, 17)
        errors = np.exp(rng.normal(np.log(of_reading), 2.0, 17))
        C = np.zeros((17, 8, 8)) + np.diag(np.repeat([0.01, 0.02, 0.02, 0.02], 2)) ** 2
        C *= errors[:, None, None] ** 2
        fit = effective_variance(W, Y, C)
        assert fit.converged
        if fit.model_error:
            first = np.linalg.lstsq(W, -Y, rcond=None)[0]
            mean = np.mean(np.trace(prediction_covariance(first, C), axis1=1, axis2=2)) / 2
            C[:, [0, 1], [0, 1]] += fit.model_error**2 + FLOOR**2 * mean
            assert objective(stretch(fit.weights), W, Y, C) == pytest.approx(fit.dof, rel=1e-9)


def test_the_covariance_against_the_scatter_of_simulated_jobs():
    """Standard deviations within 9 % (statistical: 3.5 %) of 400 jobs; the errors of W matter."""
    W, _, C, D = problem(14, N=12)
    C = C * 9
    root, z = np.linalg.cholesky(C), np.column_stack((-W @ D, W))
    rng = np.random.default_rng(15)
    n, found, stated = 1000 if FULL else 400, [], []
    for _ in range(n):
        e = (root @ rng.standard_normal((12, 6, 1)))[..., 0]
        drawn = z + e[:, ::2] + 1j * e[:, 1::2]
        fit = effective_variance(drawn[:, 1:], drawn[:, 0], C, explained=lambda D: True)
        found.append(stretch(fit.weights))
        stated.append(np.diag(fit.covariance))
    np.testing.assert_allclose(np.std(found, axis=0), np.sqrt(np.mean(stated, axis=0)), rtol=1.9 / np.sqrt(n))
    # not attenuated: within four standard errors of the truth
    assert (np.abs(np.mean(found, axis=0) - stretch(D)) < 4 * np.std(found, axis=0) / np.sqrt(n)).all()


@pytest.mark.parametrize("start", [None, [1.0]])
def test_coefficients_within_their_errors_are_said_to_lead_nowhere(start):
    """W could as well be zero or turned around: Q = (|1 + W D|² + |1 − W D|²)/(s² + |D|²) falls for ever.

    Least squares even starts at its maximum, D = 0.
    """
    C = np.zeros((2, 4, 4)) + np.diag([1e-4, 1e-4, 1.0, 1.0])
    fit = effective_variance([[0.1], [0.1]], [1.0, -1.0], C, start=start)
    assert not fit.converged
    assert np.isfinite(fit.weights).all()
    assert np.isfinite(fit.covariance).all()
    assert (np.diag(fit.covariance) > 0).all()


def test_bad_input_is_refused():
    W, Y, C, _ = problem(16)
    with pytest.raises(UndeterminedError, match="planes '1' and '2' act alike"):
        effective_variance(W[:, [0, 0]], Y, C)
    with pytest.raises(UndeterminedError, match="2 planes need at least 2 readings"):
        effective_variance(W, Y, C, row_weights=[1, 0, 0, 0, 0, 0])
    with pytest.raises(ValueError, match="found NaN or infinity"):
        effective_variance(W, np.where(np.arange(6) == 2, np.nan, Y), C)
    with pytest.raises(ValueError, match="the vibration must have shape"):
        effective_variance(W, Y[:5], C)
    with pytest.raises(ValueError, match=r"must have shape \(readings, planes"):
        effective_variance(W[:, 0], Y, C)
    with pytest.raises(ValueError, match="row weights must be"):
        effective_variance(W, Y, C, row_weights=[1, 1, 1, 1, 1, -1])
    with pytest.raises(ValueError, match="no reading has any error"):
        effective_variance(W, Y, 0 * C)
    with pytest.raises(ValueError, match="2 finite numbers"):
        effective_variance(W, Y, C, start=[1.0])
