"""Random effects: closed forms of balanced data, shrinkage, groups that do not belong."""

import numpy as np
import pytest

from rotorid.regression.random_effects import (
    Groups,
    RandomEffects,
    grouped,
    oddness,
    positive,
    random_effects,
    shrunk,
)

RNG = np.random.default_rng(5)


def several(M=12, k=4, n=2, between=2.0, within=0.5, error=0.1, seed=3):
    rng = np.random.default_rng(seed)
    group = np.repeat(np.arange(M), k)
    y = (
        3
        + between * rng.standard_normal((M, n))[group]
        + np.hypot(within, error) * rng.standard_normal((M * k, n))
    )
    return y, np.tile(error**2 * np.eye(2), (M * k, n // 2, 1, 1)), group


def test_variances_are_those_of_the_analysis_of_variance():
    M, k = 12, 4
    y, error, group = several(M, k)
    means = y.reshape(M, k, 2).mean(axis=1)
    inside = np.sum((y.reshape(M, k, 2) - means[:, None]) ** 2, axis=(0, 1)) / (M * (k - 1))
    outside = k * np.sum((means - means.mean(axis=0)) ** 2, axis=0) / (M - 1)
    found = random_effects(grouped(y, error, group))
    assert found.mean == pytest.approx(means.mean(axis=0))
    assert np.diag(found.within) == pytest.approx(inside - 0.1**2, rel=1e-9)
    assert np.diag(found.between) == pytest.approx((outside - inside) / k, rel=1e-9)


def test_one_job_a_group_has_no_scatter_within():
    y, error, _ = several(k=1)
    groups = grouped(y, error, np.arange(len(y)))
    assert not groups.within.any()
    assert groups.covariance(3) == pytest.approx(0.1**2 * np.eye(2))


def test_many_groups_give_back_what_was_drawn():
    C = np.array([[4.0, 1.5, 0, 0], [1.5, 1.0, 0, 0], [0, 0, 2.0, -1.0], [0, 0, -1.0, 1.0]])
    y = np.random.default_rng(1).multivariate_normal(np.arange(4.0), C, 20000)
    error = np.zeros((len(y), 2, 2, 2))
    found = random_effects(grouped(y, error, np.arange(len(y))))
    assert found.between == pytest.approx(C, abs=0.1)
    assert found.new_group == pytest.approx(found.between * (1 + 1 / 20000))


def test_shrinkage_is_that_of_schaefer_and_strimmer():
    x = RNG.standard_normal((9, 5)) @ np.diag([1, 2, 3, 4, 5.0])
    x -= x.mean(axis=0)
    n, p = x.shape
    S = x.T @ x / (n - 1)
    z = x / np.sqrt(np.diag(S))
    share, total = 0.0, 0.0
    for i in range(p):
        for j in range(p):
            if i != j:
                w = z[:, i] * z[:, j]
                share += n / (n - 1) ** 3 * np.sum((w - w.mean()) ** 2)
                total += (np.sum(w) / (n - 1)) ** 2
    keep = 1 - min(1.0, share / total)
    wanted = np.where(np.eye(p) > 0, S, keep * S)
    assert shrunk(x, n - 1) == pytest.approx(wanted)


def test_negative_variances_are_none():
    A = RNG.standard_normal((5, 5))
    good = A @ A.T
    assert positive(good) == pytest.approx(good)
    assert np.linalg.eigvalsh(positive(good - 3 * np.eye(5))).min() > -1e-12
    assert not positive(np.zeros((2, 2))).any()


def test_a_known_group_is_shrunk_to_the_mean():
    effects = RandomEffects(np.array([10.0, 0.0]), np.diag([4.0, 1.0]), np.zeros((2, 2)), 10**9)
    mean, covariance = effects.given(np.array([16.0, 2.0]), np.diag([2.0, 0.0]))
    assert mean == pytest.approx([10 + 6 * 4 / 6, 2.0], rel=1e-6)
    assert covariance == pytest.approx(np.diag([4 * 2 / 6, 0.0]), abs=1e-6)


def test_groups_that_do_not_belong_are_found_and_few_others():
    false = []
    for seed in range(40):
        rng = np.random.default_rng(seed)
        y = rng.multivariate_normal(np.zeros(6), np.eye(6) + 2, 30)
        y[[4, 9, 20]] += 12 * rng.choice([-1, 1], (3, 6))
        distance, limit = oddness(grouped(y, np.zeros((30, 3, 2, 2)), np.arange(30)))
        odd = distance > limit
        assert odd[[4, 9, 20]].all()
        false.append(odd.sum() - 3)
    assert sum(false) <= 0.01 * 40 * 27  # 0.1 %, and some for how little 30 tell


def test_few_groups_have_no_odd_one():
    y = RNG.standard_normal((4, 2))
    distance, limit = oddness(Groups(y, np.zeros((4, 1, 2, 2)), np.ones(4, dtype=int), np.zeros((2, 2))))
    assert not distance.any()
    assert limit == np.inf
