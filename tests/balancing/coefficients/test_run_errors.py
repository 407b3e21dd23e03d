"""Errors between runs: likelihood, sizes, shares, degrees of freedom, against dense algebra and drawing."""

import numpy as np
import pytest
from repetitions import highest_share, lowest_share, repetitions
from scipy.special import fdtri
from scipy.stats import kstest

from balancing.coefficients.run_error_estimate import (
    _grid,
    corrected_row,
    estimated,
    given,
    scatter,
    spare_rows,
    spectrum,
)
from balancing.coefficients.run_errors import (
    RunErrors,
    run_columns,
    runs_of,
)


def normal(rng, *shape):
    return rng.standard_normal(shape) + 1j * rng.standard_normal(shape)


def machine(rng, S=2, C=3, P=2, R=5):
    """Exact readings (R, S, C), weights (R, P), coefficients (S, C, P), and (1 T)."""
    W, D = normal(rng, S, C, P), normal(rng, P)
    T = normal(rng, R, P)
    T[0] = 0.0
    return np.einsum("scp,rp->rsc", W, T - D), T, W, np.column_stack((np.ones(R), T))


def dense(rows, runs, point):
    """Joint covariance of all rows by its definition: every run adds its share of each kind."""
    K, S, C = rows.e.shape
    speed = np.repeat(np.arange(S), C)
    same = speed[:, None] == speed
    out = np.zeros((K * S * C, K * S * C), dtype=complex)
    for r, m in enumerate(rows.m.T):
        each = np.diag(rows.known[r].ravel()).astype(complex)
        for b, along in enumerate(([runs.Y[r]], [runs.effect[r]], runs.unbalance)):
            whole = sum(np.outer(v.ravel(), v.ravel().conj()) for v in along)
            own = np.diag(runs.size[b, r].ravel())
            each += point[b, 0] * own + point[b, 1] * whole * same + point[b, 2] * whole
        out += np.kron(np.outer(m, m.conj()), each)
    return 2 * out


@pytest.mark.parametrize("known", [0.0, 0.02])
def test_likelihood_is_that_of_the_dense_covariance(known):
    rng = np.random.default_rng(1)
    Y, T, W, A = machine(rng)
    Y = Y * (1 + 0.05 * normal(rng, *Y.shape))
    runs = runs_of(Y, T, W)
    variance = known**2 * np.abs(Y) ** 2
    theta = np.concatenate(((Y[0])[..., None], W), axis=-1)
    spare, (last,) = spare_rows(A, Y, variance), corrected_row(A, Y, variance, theta)
    grid = _grid(np.array([0.01, 0.1]), runs)
    for rows in (spare, last):
        log, q = spectrum(rows, runs, grid).at(grid.sizes)
        expected = np.zeros((len(log), 2))
        for g, point in enumerate(grid.points):
            e, V = rows.e.ravel(), dense(rows, runs, point)
            inverse = np.linalg.inv(V)
            X = rows.free.reshape(-1, rows.free.shape[-1]) if rows.free.size else np.zeros((e.size, 0))
            extra = 0.0
            if X.shape[1]:
                G = X.conj().T @ inverse @ X
                extra = np.linalg.slogdet(G)[1]
                inverse = inverse - inverse @ X @ np.linalg.solve(G, X.conj().T @ inverse)
            expected[g] = np.linalg.slogdet(V)[1] + extra, (e.conj() @ inverse @ e).real
        # restricted likelihood: its determinant is known up to a constant, that of the free unknowns
        np.testing.assert_allclose(log - log[0], expected[:, 0] - expected[0, 0], atol=1e-5)
        np.testing.assert_allclose(q, expected[:, 1], rtol=1e-5)


@pytest.mark.parametrize("scale", [1e-6, 1e5])
def test_units_do_not_matter(scale):
    rng = np.random.default_rng(2)
    Y, T, W, _ = machine(rng)
    Y = Y * (1 + 0.03 * normal(rng, *Y.shape))
    found = []
    for by in (1.0, scale):
        runs = runs_of(by * Y, T / by, by**2 * W)
        B = np.column_stack((np.ones(len(T)), T / by))
        found.append(estimated([spare_rows(B, by * Y, (0.01 * by * np.abs(Y)) ** 2)], runs))
    one, other = found
    np.testing.assert_allclose(other.sizes * [[1], [1], [1 / scale]], one.sizes, rtol=1e-6)
    np.testing.assert_allclose(np.array(other.interval) / scale, one.interval, rtol=1e-6)
    np.testing.assert_allclose(other.ratios, one.ratios, rtol=1e-5)


def test_degrees_against_a_drawn_mixture():
    """The stated region of n numbers holds 95 % of draws, also where the kinds have different directions."""
    rng = np.random.default_rng(3)
    ratios = np.exp(rng.standard_normal((40, 3)))
    run = RunErrors(probability=np.full(40, 1 / 40), ratios=ratios)
    roots = rng.standard_normal((4, 4, 6))
    parts = roots @ roots.swapaxes(1, 2)
    scale, dof = run.degrees(parts)
    total = parts.sum(axis=0) * scale
    n = 40000
    point = rng.integers(40, size=n)
    factors = np.sqrt(np.column_stack((np.ones(40), ratios)))[point]
    x = np.einsum("nk,kij,nkj->ni", factors, roots, rng.standard_normal((n, 4, 6)))
    inside = np.einsum("ni,ni->n", x, np.linalg.solve(total, x.T).T) < 4 * fdtri(4, dof, 0.95)
    assert np.mean(inside) == pytest.approx(0.95, abs=0.01)


def test_nothing_open_is_normal_and_repeats_leave_their_degrees():
    parts = np.array([0.5, 0.5, 0.0, 0.0])[:, None, None] * np.eye(2)
    assert RunErrors().degrees(parts) == (pytest.approx(1.0), None)
    assert RunErrors().degrees(parts, 10.0) == (pytest.approx(1.0), pytest.approx(10.0 / 0.25))


def test_a_known_size_lies_in_its_interval():
    rng = np.random.default_rng(4)
    n, size, inside = repetitions(1000), 0.03, []
    for _ in range(n):
        Y, T, W, A = machine(rng, 1, 4, 2, 5)
        read = Y * (1 + size * normal(rng, *Y.shape))
        runs = runs_of(read, T, W)
        low, high = estimated([spare_rows(A, read, np.zeros(Y.shape))], runs).interval
        whole = size * np.sqrt(runs.mean[0])
        inside.append(low < whole < high)
    assert lowest_share(n, 0.91) <= np.mean(inside) <= highest_share(n, 0.99)


def test_shares_of_given_errors():
    """What the corrected reading shows decides between own and common; the size stays."""
    rng = np.random.default_rng(5)
    own = []
    for common in (False, True):
        Y, T, W, A = machine(rng, 3, 8, 2, 3)
        read = Y * (1 + 0.04 * normal(rng, *((3, 1, 1) if common else Y.shape)))
        runs = runs_of(read, T, W)
        known = (0.002 * np.abs(read)) ** 2
        theta = np.einsum("pr,rsc->scp", np.linalg.inv(A), read)
        found = given(corrected_row(A, read, known, theta), runs, 0.04, 0.0, "stated")
        assert np.sqrt(np.sum(found.sizes[0] ** 2)) == pytest.approx(0.04)
        own.append(found.sizes[0, 0] / 0.04)
    assert own[0] > 0.7
    assert own[1] < 0.3


@pytest.mark.parametrize("common", [(5, 2, 3), (5, 2, 1), (5, 1, 1)])
def test_errors_as_stated_are_seldom_contradicted(common):
    rng = np.random.default_rng(6)
    n, alarms = repetitions(2000), []
    for _ in range(n):
        Y, T, W, A = machine(rng)
        read = Y * (1 + 0.03 * normal(rng, *common))
        spare = spare_rows(A, read, np.zeros(Y.shape))
        alarms.append(scatter([spare], runs_of(read, T, W), 0.03)[1] < 0.05)
    assert np.mean(alarms) <= highest_share(n, 0.06)


def test_a_test_of_independent_errors_is_a_chi_square():
    rng = np.random.default_rng(7)
    chances = []
    for _ in range(300):
        Y, T, W, A = machine(rng)
        read = Y + 0.01 * normal(rng, *Y.shape)
        spare = spare_rows(A, read, np.full(Y.shape, 0.01**2))
        chances.append(scatter([spare], runs_of(read, T, W))[1])
    assert kstest(chances, "uniform").pvalue > 1e-3


def test_columns_against_drawn_errors():
    rng = np.random.default_rng(8)
    Y, T, W, _ = machine(rng, 2, 2, 2, 1)
    runs = runs_of(Y, T + 1, W)
    sizes = np.arange(1.0, 10.0).reshape(3, 3)
    columns = run_columns(RunErrors(sizes), runs)
    n = 40000
    e = np.zeros((n, 2, 2), dtype=complex)
    for b, along in enumerate((runs.Y, runs.effect, runs.unbalance)):
        for k, shape in enumerate(((2, 2), (2, 1), (1, 1))):
            if k == 0:
                e += sizes[b, 0] * np.sqrt(runs.size[b, 0]) * normal(rng, n, *shape)
            else:
                e += sizes[b, k] * sum(v * normal(rng, n, *shape) for v in along)
    x = e.reshape(n, 4)
    F = columns.common[:, 0].reshape(2, -1, 4)
    run, speed = F.swapaxes(1, 2) @ F.conj()
    expected = np.diag(columns.own[0].ravel()) + run + speed * np.kron(np.eye(2), np.ones((2, 2)))
    got = x.T @ x.conj() / (2 * n)
    assert np.abs(got - expected).max() < 0.05 * np.abs(expected).max()
