"""Numbers taken as exact: how often they are contradicted, right and wrong, in drawn linear problems."""

import numpy as np
import pytest
from repetitions import highest_share, lowest_share, repetitions
from scipy.special import chdtrc

from rotorid.calibration.held_numbers import held_numbers

NAMES = ("a", "b", "c", "d")
M, N = 40, 8


@pytest.fixture(scope="module")
def problem():
    """Derivatives by estimated and held numbers; the held ones move the data by about their errors."""
    rng = np.random.default_rng(4)
    return rng.standard_normal((M, N)), 0.4 * rng.standard_normal((M, len(NAMES)))


def chances(problem, times, seed=5):
    """Of so many data with held numbers off by `times` their deviation: of the test, and of χ² (n, 2)."""
    K, H = problem
    rng = np.random.default_rng(seed)
    out = []
    for _ in range(repetitions(4000)):
        r = rng.standard_normal(M) + H @ (times * rng.standard_normal(len(NAMES)))
        r -= K @ np.linalg.lstsq(K, r, rcond=None)[0]
        out.append((held_numbers(NAMES, K, H, r).chance, chdtrc(M - N, r @ r)))
    return np.array(out)


@pytest.mark.parametrize("level", [0.01, 0.05, 0.5])
def test_right_numbers_are_contradicted_as_often_as_stated(problem, level):
    found = chances(problem, 0.0)[:, 0] < level
    n = len(found)
    assert lowest_share(n, 0.8 * level) <= np.mean(found) <= highest_share(n, 1.2 * level)


def test_wrong_numbers_are_contradicted_more_often_than_by_what_is_left(problem):
    held, left = np.mean(chances(problem, 1.0) < 0.01, axis=0)
    assert held > left + 0.1


def test_one_number_far_off_is_named(problem):
    K, H = problem
    r = -5.0 * H[:, 2] + 0.1 * np.random.default_rng(6).standard_normal(M)
    found = held_numbers(NAMES, K, H, r - K @ np.linalg.lstsq(K, r, rcond=None)[0])
    assert found.chance < 1e-6
    assert found.away[2] == pytest.approx(5.0, rel=0.2)
    assert "most of all c: " in found.words
    assert "higher would explain more" in found.words


def test_numbers_that_the_estimated_ones_replace_are_never_contradicted(problem):
    K, _ = problem
    r = np.random.default_rng(7).standard_normal(M)
    r -= K @ np.linalg.lstsq(K, r, rcond=None)[0]
    found = held_numbers(NAMES[:2], K, K[:, :2], r)
    assert found.chance > 0.01
    assert np.abs(found.away).max() < 1e-9
