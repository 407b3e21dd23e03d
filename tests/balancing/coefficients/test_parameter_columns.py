"""Errors of a model's parameters, which its coefficients have in common: from draws, and by closed forms."""

from dataclasses import replace
from functools import partial
from itertools import product
from types import SimpleNamespace

import numpy as np
import pytest
from balancing_data import complex_normal
from repetitions import highest_share, lowest_share, repetitions
from scipy.special import chdtri

from balancing import (
    Influence,
    ReadingErrors,
    Trials,
    combine,
    compare_check,
    correct,
    unbalance_of_run,
    verdict_of_check,
    with_parameters,
)
from balancing.coefficients.baseline import starting_point
from balancing.coefficients.run_errors import RunErrors, marginal, run_columns, runs_of
from balancing.data.reading_errors import hermitian
from balancing.iso21940 import tolerance
from balancing.solvers import correction_methods
from balancing.solvers.error_propagation import region_edge
from balancing.solvers.monte_carlo import sampled_covariance
from rotorid.regression import stretch

ERRORS = ReadingErrors(0.004, 0.004, 0.002)
UNBALANCE = np.array([1.5, 1 - 2j])
NOTHING = np.zeros(2, dtype=complex)


def computed(S, C, M, size=0.02, lack=0.0, seed=1):
    """Coefficients of two planes whose M parameters change every one of them by `size`, in proportion."""
    W = complex_normal(np.random.default_rng(seed), (S, C, 2))
    turn = np.exp(1j * np.linspace(0, 2, S))[:, None, None]
    side = np.array([1.0, -1.0])
    ways = np.stack([turn * W, 1j * turn**2 * W * side, W * side])[:M]
    sensors = tuple(f"s{c}" for c in range(C))
    return with_parameters(Influence(100.0 * np.arange(1, S + 1), sensors, "AB", W), size * ways, lack)


def real(z):
    return np.ascontiguousarray(z, dtype=complex).view(float)


def read(rng, model, Y, T=NOTHING, name="base"):
    """One run with the weights T, its readings with errors as stated."""
    Y = Y * (1 + 0.004 * complex_normal(rng, Y.shape)) + 0.002 * complex_normal(rng, Y.shape)
    return Trials((name,), model.speeds, model.sensors, model.planes, Y[None], T[None], errors=ERRORS)


def true(rng, model, lack=0.0):
    """Coefficients of a rotor of which the model may be the model."""
    W = model.W * (1 + lack * complex_normal(rng, model.W.shape))
    return W + np.tensordot(rng.standard_normal(len(model.parameters)), model.parameters[..., 1:], 1)


SETS = {
    # speeds, sensors, parameters, lack, method, unbalance elsewhere, weights mounted in the baseline run
    "one parameter": (2, 1, 1, 0.0, "weighted", 0.0, NOTHING),
    "spare readings": (2, 3, 1, 0.004, "weighted", 0.0, NOTHING),
    "mounted weights, unbalance elsewhere": (2, 3, 3, 0.004, "least-squares", 4.0, np.array([0.5, 0.3j])),
}


@pytest.fixture(
    scope="module",
    params=[pytest.param(name, marks=() if name == "spare readings" else pytest.mark.full) for name in SETS],
)
def drawn(request):
    """Jobs on rotors drawn around a model, what was true, and the same job without any error."""
    S, C, M, lack, method, outside, mounted = SETS[request.param]
    model, rng = computed(S, C, M, lack=lack), np.random.default_rng(2)
    further = outside * complex_normal(np.random.default_rng(9), (S, C))
    found, checks, truth, seen = [], [], [], []
    for _ in range(repetitions(2000)):
        W = true(rng, model, lack)
        Y = W @ UNBALANCE + further
        base = read(rng, model, Y + W @ mounted, mounted)
        one = correct(model, base, method=method)
        check = read(rng, model, Y + W @ one.weights, one.weights, "check")
        found.append(one)
        truth.append(np.linalg.lstsq(W.reshape(-1, 2), -Y.ravel(), rcond=None)[0])
        seen.append(check.mean[0])
        checks.append(compare_check(one, check, model, base))
    Y = model.W @ (UNBALANCE + mounted) + further
    exact = replace(read(rng, model, Y, mounted), readings=Y[None, None])
    return SimpleNamespace(
        found=found,
        checks=checks,
        away=real(np.array([one.weights for one in found]) - truth),
        seen=np.array(seen),
        exact=correct(model, exact, method=method),
        narrow=M == 1,
    )


def holds_95_of_100(inside):
    inside = np.asarray(inside)
    return lowest_share(len(inside), 0.93) <= inside.mean() <= highest_share(len(inside), 0.97)


def inside(away, covariance):
    """Whether vectors (J, n) lie in their 95 % regions."""
    square = np.einsum("ji,jik,jk->j", away, np.linalg.inv(covariance), away)
    return square < chdtri(away.shape[1], 0.05)


@pytest.mark.full
def test_covariance_of_the_weights_is_that_of_their_errors(drawn):
    expected = drawn.exact.covariance
    std = np.sqrt(np.linalg.eigvalsh(expected))
    assert std[-1] > 2.5 * std[-2] or not drawn.narrow  # nearly a line
    kept = [one.explained for one in drawn.found]  # where not, regions are wider
    root = np.linalg.cholesky(expected)
    difference = np.cov(np.linalg.solve(root, drawn.away[kept].T)) - np.eye(4)
    assert np.abs(difference).max() < 5 / np.sqrt(sum(kept))  # 1/√J each, on the diagonal √(2/J)


def test_regions_hold_the_truth(drawn):
    covariance = np.array([one.covariance for one in drawn.found])
    assert holds_95_of_100(inside(drawn.away, covariance))
    for own in (slice(0, 2), slice(2, 4)):
        assert holds_95_of_100(inside(drawn.away[:, own], covariance[:, own, own]))


def test_what_is_left_is_explained(drawn):
    if drawn.found[0].fit_dof:
        assert holds_95_of_100([one.explained for one in drawn.found])


def test_check_runs_are_predicted(drawn):
    n = drawn.checks[0].n
    assert holds_95_of_100([one.explained for one in drawn.checks])
    chi_square = np.array([one.chi_square for one in drawn.checks])
    assert chi_square.mean() / n == pytest.approx(1, abs=4 * np.sqrt(2 / n / len(chi_square)))
    away = drawn.seen - np.array([one.after for one in drawn.found])
    covariance = np.array([one.after_covariance for one in drawn.found])
    distance = np.array([one.distance for one in drawn.checks])[:, 0]
    for s, c in np.ndindex(away.shape[1:]):
        assert holds_95_of_100(inside(real(away[:, s, c, None]), covariance[:, s, c]))
        assert holds_95_of_100(distance[:, s, c] ** 2 < chdtri(2, 0.05))


def test_check_runs_stay_below_the_bound(drawn):
    below = np.sqrt(np.mean(np.abs(drawn.seen) ** 2, axis=(1, 2))) <= [one.check_rms for one in drawn.found]
    if drawn.found[0].fit_dof:  # what errors leave in spare readings counts in full: too careful
        assert below.mean() >= lowest_share(len(below), 0.95)
    else:
        assert holds_95_of_100(below)


@pytest.mark.parametrize(("seed", "outside"), [(5, 1.0), (7, 1.0), (6, 0.2), (6, 0.1), (7, 0.05)])
def test_the_bound_is_a_quantile_of_the_whole_covariance(seed, outside):
    """|a + e|² of drawn errors of (Y₀, W) at given weights, and of the reading."""
    model, rng = computed(2, 3, 1, lack=0.004), np.random.default_rng(seed)
    base = read(rng, model, model.W @ UNBALANCE + outside * complex_normal(rng, (2, 3)))
    one = correct(model, base, method="least-squares")
    n = 20_000
    z = np.concatenate(([0.0], one.weights))
    lack = 0.004 * np.abs(model.W) * complex_normal(rng, (n, *model.W.shape)) @ one.weights
    errors = np.tensordot(rng.standard_normal((n, 1)), model.parameters @ z, 1) + lack
    for size in (np.abs(base.mean[0]), np.abs(one.after)):  # of the reading that was taken, and of the next
        errors = errors + np.hypot(0.004 * size, 0.002) * complex_normal(rng, errors.shape)
    rms = np.sqrt(np.mean(np.abs(one.after + errors) ** 2, axis=(1, 2)))
    assert 0.93 < np.mean(rms < one.check_rms) < 0.97  # a gamma distribution has not all its moments


@pytest.mark.parametrize("method", ["minmax", "ridge", "truncated"])
def test_other_methods_count_them(method, monkeypatch):
    """Derivatives by differences: weights of W moved along a column and back."""
    monkeypatch.setattr(correction_methods, "sampled_covariance", partial(sampled_covariance, draws=100))
    model = computed(2, 2, 2, size=1e-5)
    how = {"minmax": {"method": "minmax"}, "ridge": {"strength": 0.1}, "truncated": {"keep": 1}}[method]
    Y = model.W @ UNBALANCE + 0.3
    base = Trials(
        ("b",), model.speeds, model.sensors, "AB", Y[None], NOTHING[None], errors=ReadingErrors(1e-9)
    )
    moved = []
    for column in model.parameters[..., 1:]:
        ends = [correct(replace(model, W=model.W + way * column), base, **how).weights for way in (1, -1)]
        moved.append(real(ends[0] - ends[1]) / 2)
    expected = np.array(moved).T @ np.array(moved)
    found = correct(model, base, **how).covariance
    atol = (0.4 if method == "minmax" else 1e-3) * np.trace(expected)  # √(2/100) each
    np.testing.assert_allclose(found, expected, atol=atol)


def test_drawn_errors_are_those_of_the_columns():
    model, Y = computed(2, 3, 2), NOTHING
    W = model.W.reshape(-1, 2)
    Y = W @ UNBALANCE
    own = np.tile(1e-10 * np.eye(6), (6, 1, 1))

    def plain(W, Y):
        return -np.linalg.lstsq(W, Y, rcond=None)[0]

    found = sampled_covariance(plain, W, Y, own, draws=2000, parameters=model.parameters)
    moved = real([plain(W, model.parameters[m, ..., 1:].reshape(-1, 2) @ UNBALANCE) for m in (0, 1)])
    expected = moved.T @ moved
    np.testing.assert_allclose(found, expected, atol=0.1 * np.trace(expected))


def joint(influence, columns):
    """Covariance of all channels' (Y₀, W) together, own parts beside each other."""
    S, C, P = influence.W.shape
    own = influence.covariance - marginal(influence.common, influence.parameters)
    n = 2 * P + 2
    out = np.zeros((S * C * n,) * 2)
    for k, block in enumerate(own.reshape(-1, n, n)):
        out[k * n : k * n + n, k * n : k * n + n] = block
    return out + columns @ columns.T


def real_columns_of(influence):
    """Columns over all channels, those common to a run as pairs."""
    runs = influence.common[0].reshape(influence.common.shape[1], -1)
    known = influence.parameters.reshape(len(influence.parameters), -1)
    return np.vstack((real(runs), real(1j * runs), real(known))).T


@pytest.mark.parametrize("circular", [True, False])
def test_combined_with_measured_coefficients(circular):
    """Generalised least squares with θ free, and its gains on the joint covariance of both sides."""
    rng = np.random.default_rng(3)
    S, C, n = 2, 2, 6
    model = computed(S, C, 1, lack=0.01)
    if circular:
        both = np.concatenate((model.parameters, 1j * model.parameters))[..., 1:]
        model = with_parameters(model, both, 0.01)
    half = complex_normal(rng, (S, C, 3, 3)) * 0.02
    common = np.zeros((2, 1, S, C, 3), dtype=complex)
    common[0] = 0.03 * complex_normal(rng, (1, S, C, 3))
    own = stretch(half @ np.conj(np.swapaxes(half, -1, -2)))
    W = true(rng, model)
    measured = Influence(
        model.speeds, model.sensors, "AB", W, W @ UNBALANCE, own + marginal(common), common=common
    )
    found = combine(measured, model)
    X = np.vstack((np.eye(3), np.eye(3)[1:]))
    gains = np.zeros((S * C, n, 10))
    for k, (s, c) in enumerate(np.ndindex(S, C)):
        K = np.zeros((10, 10))
        K[:6, :6], K[6:, 6:] = measured.covariance[s, c], model.covariance[s, c][2:, 2:]
        if circular:  # real and complex problem are one
            A = stretch(X)
            inverse = A.T @ np.linalg.inv(K)
        else:
            A = X
            inverse = A.T @ np.linalg.inv(hermitian(K[None])[0])
        G = np.linalg.solve(inverse @ A, inverse)
        gains[k] = G if circular else stretch(G)
        z = real(np.concatenate(([W[s, c] @ UNBALANCE], W[s, c], model.W[s, c])))
        theta = np.concatenate(([found.baseline[s, c]], found.W[s, c]))
        np.testing.assert_allclose(real(theta), gains[k] @ z, rtol=1e-9)
    sides = [replace(measured, parameters=common[0] * 0), replace(model, common=0 * common)]
    first, second = (joint(side, real_columns_of(side)) for side in sides)
    whole = np.zeros((n * S * C,) * 2)
    for (k, G), (m, H) in product(enumerate(gains), repeat=2):
        a, b = slice(k * n, k * n + n), slice(m * n, m * n + n)
        whole[a, b] = G[:, :6] @ first[a, b] @ H[:, :6].T + G[:, 6:] @ second[a, b][2:, 2:] @ H[:, 6:].T
    np.testing.assert_allclose(joint(found, real_columns_of(found)), whole, atol=1e-12 * np.trace(whole))


def test_unbalance_of_a_run():
    model, rng, J = computed(2, 3, 1, lack=0.004), np.random.default_rng(6), repetitions(2000)
    found = [unbalance_of_run(model, read(rng, model, true(rng, model, 0.004) @ UNBALANCE)) for _ in range(J)]
    away = real(np.array([one.unbalance for one in found]) - UNBALANCE)
    assert holds_95_of_100(inside(away, np.array([one.covariance for one in found])))
    chi_square = np.array([one.chi_square for one in found])
    assert chi_square.mean() == pytest.approx(8, abs=4 * np.sqrt(16 / J))  # 6 readings, 2 planes


def test_chi_square_of_an_unbalance():
    """What no unbalance explains, by generalised least squares over the real parts of all readings."""
    model, rng = computed(2, 3, 2, lack=0.004), np.random.default_rng(10)
    base = read(rng, model, true(rng, model, 0.004) @ UNBALANCE)
    found, start = unbalance_of_run(model, base), starting_point(model, base)
    z = np.concatenate(([1.0], -found.unbalance))
    own = np.trace(stretch(z[None]) @ start.own @ stretch(z[None]).T, axis1=2, axis2=3) / 2
    columns = real((start.parameters @ z).reshape(2, -1)).T
    root = np.linalg.cholesky(np.diag(np.repeat(own.ravel(), 2)) + columns @ columns.T)
    rows = np.linalg.solve(root, stretch(model.W.reshape(-1, 2)))
    least = np.linalg.lstsq(rows, np.linalg.solve(root, real(found.residual)), rcond=None)[1][0]
    assert found.chi_square == pytest.approx(least, rel=1e-9)


def test_a_verdict_has_the_region_of_the_correction():
    model, rng = computed(2, 3, 1, size=0.1), np.random.default_rng(7)
    base = read(rng, model, model.W @ UNBALANCE)
    whole = tolerance(100, 1, "G2.5", planes={"A": None, "B": None})
    judged = verdict_of_check(model, base, tolerance=whole)
    found = correct(model, base, method="least-squares")
    for p, row in enumerate(judged.rows):
        own = found.covariance[2 * p : 2 * p + 2, 2 * p : 2 * p + 2]
        expected = region_edge(-found.weights[p], own, None, len(row.region) - 1)
        np.testing.assert_allclose(row.region, expected, rtol=1e-9)


def test_degrees_of_freedom_of_the_readings_do_not_widen_them():
    rng, model = np.random.default_rng(8), computed(2, 3, 1, size=0.2)
    Y = model.W @ UNBALANCE
    repeated = np.array([read(rng, model, Y).readings[0] for _ in range(2)])
    base = replace(read(rng, model, Y), readings=repeated, errors=None)
    alone = correct(replace(model, parameters=None, covariance=None), base, method="least-squares")
    found = correct(model, base, method="least-squares")
    assert alone.dof == pytest.approx(6)
    root = np.linalg.inv(np.linalg.cholesky(found.covariance))
    share = np.trace(root @ alone.covariance @ root.T) / 4  # of the readings in the whole
    assert found.dof == pytest.approx(6 / share**2, rel=0.02)


def test_what_is_open_of_errors_between_runs_does_not_scale_them():
    run = RunErrors(probability=np.full(2, 0.5), ratios=np.array([[0.1] * 3, [10.0] * 3]))
    parts = np.zeros((5, 2, 2))
    parts[4] = np.eye(2)
    assert replace(run, merged=True).degrees(parts, 3) == (1.0, None)
    model, rng = replace(computed(2, 3, 1), run_errors=run), np.random.default_rng(11)
    W = true(rng, model)
    base = read(rng, model, W @ UNBALANCE)
    found = correct(model, base)
    check = read(rng, model, W @ (UNBALANCE + found.weights), found.weights, "check")
    assert found.dof is None
    assert compare_check(found, check, model, base).dof is None


def test_known_errors_stay_where_those_between_runs_are_assumed():
    model = computed(2, 3, 2)
    own = np.tile(1e-4 * np.eye(6), (2, 3, 1, 1))
    common = run_columns(
        RunErrors(np.full((3, 3), 0.02)), runs_of(model.W[None, ..., 0], NOTHING[None], model.W)
    )
    columns = np.zeros((2, 4, 2, 3, 3), dtype=complex)
    columns[..., 0] = common.common[:, 0]
    errors = own + marginal(columns, model.parameters)
    one = replace(
        model,
        covariance=errors,
        common=columns,
        own_between=0.25,
        error_source="stated",
        run_errors=RunErrors(origin="assumed"),
    )
    np.testing.assert_allclose(
        one.known_covariance, 0.75 * own + marginal(None, model.parameters), atol=1e-12
    )


def test_a_part_has_the_columns_of_its_own():
    model = computed(3, 3, 2, lack=0.01)
    part = model.part([2, 0], [1], [1])
    alone = with_parameters(
        Influence(model.speeds[[2, 0]], ("s1",), ("B",), model.W[[2, 0]][:, [1]][..., [1]]),
        model.parameters[:, [2, 0]][:, :, [1]][..., [2]],
        0.01,
    )
    np.testing.assert_array_equal(part.parameters, alone.parameters)
    np.testing.assert_allclose(part.covariance, alone.covariance, rtol=1e-12)
    start = starting_point(part, read(np.random.default_rng(0), part, part.W[..., 0], np.array([2j])))
    np.testing.assert_allclose(start.parameters[..., 0], -2j * start.parameters[..., 1], rtol=1e-12)


def test_covariance_of_the_coefficients():
    lack = np.array([[0.1, 0.2]])
    model = computed(1, 2, 1)
    found = with_parameters(model, model.parameters[..., 1:], lack)
    for c in (0, 1):
        f = real(model.parameters[0, 0, c])
        own = np.repeat(np.concatenate(([0.0], lack[0, c] * np.abs(model.W[0, c]))) ** 2, 2)
        np.testing.assert_allclose(found.covariance[0, c], np.diag(own) + np.outer(f, f), rtol=1e-12)
    with pytest.raises(ValueError, match="finite numbers ≥ 0"):
        with_parameters(model, model.parameters[..., 1:], -0.1)
    with pytest.raises(ValueError, match=r"parameters must have shape \(1, 1, 2, 3\)"):
        with_parameters(model, model.parameters, 0.1)
    with pytest.raises(ValueError, match="finite"):
        with_parameters(model, model.parameters[..., 1:] * np.nan, 0.1)
