"""Random effects: closed forms of balanced data, shrinkage, groups that do not belong."""

import numpy as np
import pytest

from rotorid.regression.random_effects import oddness, random_effects, shrunk

RNG = np.random.default_rng(5)


def several(M=12, k=4, between=2.0):
    rng = np.random.default_rng(3)
    group = np.repeat(np.arange(M), k)
    y = 3 + between * rng.standard_normal((M, 2))[group]
    y += np.hypot(0.5, 0.1) * rng.standard_normal((M * k, 2))
    return y, np.tile(0.1**2 * np.eye(2), (M * k, 1, 1, 1)), group


def test_variances_are_those_of_the_analysis_of_variance():
    y, error, group = several(M=12, k=4)
    each = y.reshape(12, 4, 2)
    inside = each.var(axis=1, ddof=1).mean(axis=0)
    outside = 4 * each.mean(axis=1).var(axis=0, ddof=1)
    effects = random_effects(y, error, group)
    assert effects.mean == pytest.approx(y.mean(axis=0))
    assert np.diag(effects.within) == pytest.approx(inside - 0.1**2, rel=1e-9)
    assert np.diag(effects.between) == pytest.approx((outside - inside) / 4, rel=1e-9)


def test_shrinkage_is_that_of_schaefer_and_strimmer():
    x = RNG.standard_normal((9, 5)) @ np.diag([1, 2, 3, 4, 5.0])
    x -= x.mean(axis=0)
    S, n = x.T @ x / 8, 9
    z = x / np.sqrt(np.diag(S))
    w = z[:, :, None] * z[:, None, :]
    other = ~np.eye(5, dtype=bool)
    variance = n / (n - 1) ** 3 * np.sum((w - w.mean(axis=0)) ** 2, axis=0)
    keep = 1 - min(1.0, variance[other].sum() / np.sum((w.sum(axis=0) / 8)[other] ** 2))
    assert shrunk(x, 8) == pytest.approx(np.where(other, keep * S, S))


def test_errors_as_large_as_the_scatter_leave_no_more_than_the_scatter():
    """Where hardly anything is left of one number, the variance of another one once grew without end."""
    x = RNG.standard_normal((40, 2)) @ np.array([[1.0, 0.9], [0.0, 0.4]])
    scatter = np.diag(shrunk(x - x.mean(axis=0), 39))
    for left in (1e-2, 1e-4, 1e-8):
        error = np.diag([0.0, (1 - left) * scatter[1]])
        found = random_effects(x, np.tile(error, (40, 1, 1, 1)), np.arange(40))
        assert np.all(np.diag(found.between) < 1.3 * scatter)


def test_what_is_known_of_a_group_is_what_the_others_and_its_jobs_say():
    """Each group counts once: the others alone, with the same covariances, then the group's own mean."""
    y, error, group = several(M=5, k=2, between=0.5)
    found = random_effects(y, error, group)
    own = 0.1**2 / 2 * np.eye(2) + found.within / 2
    rest = np.delete(found.groups, 3, axis=0).mean(axis=0)
    prior = found.between + (found.between + own) / 4
    G = prior @ np.linalg.inv(prior + own)
    mean, covariance = found.known(3)
    assert mean == pytest.approx(rest + G @ (found.groups[3] - rest))
    assert covariance == pytest.approx(prior - G @ prior)


def test_few_groups_have_no_odd_one():
    y = RNG.standard_normal((4, 2))
    distance, limit = oddness(y, np.zeros((4, 1, 2, 2)), np.arange(4))
    assert not distance.any()
    assert limit == np.inf


def test_a_group_of_many_jobs_does_not_make_the_others_odd():
    rng = np.random.default_rng(4)
    group = np.concatenate((np.zeros(20, dtype=int), np.arange(1, 9), [3]))
    y = 1 + rng.standard_normal((9, 4))[group] + 0.1 * rng.standard_normal((29, 4))
    y[-1] += 30
    distance, limit = oddness(y, np.zeros((29, 2, 2, 2)), group)
    assert np.flatnonzero(distance > limit).tolist() == [28]
    assert (
        oddness(y[:20], np.zeros((20, 2, 2, 2)), np.arange(20) % 4)[1] == np.inf
    )  # four groups of five jobs
