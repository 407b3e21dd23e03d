"""Where regions are too small, the words say which plane, or which planes, and what to do."""

import numpy as np
import pytest
from balancing_data import complex_normal

from balancing.correction.region_coverage import clearness, relative_error, too_small, uncertain


def coefficients(errors, seed=22):
    """Two planes of equal effect, twelve readings; errors of W of the given size."""
    rng = np.random.default_rng(seed)
    W = complex_normal(rng, (12, 2))
    return W, np.zeros((12, 4, 4)) + np.diag(np.repeat(errors, 2)) ** 2


def test_large_errors_of_the_weights_are_named():
    D = np.array([1.0, 1j])
    assert relative_error(D, 0.04 * np.eye(4)) == pytest.approx(0.2)
    assert uncertain(D, 0.04 * np.eye(4)) == ""
    words = uncertain(D, 0.16 * np.eye(4))
    assert "errors of the weights reach 40 % of their size" in words
    assert "contained the truth in 65 to 90 % of simulated jobs" in words
    assert "40 to 60 %" in uncertain(D, 4 * np.eye(4))
    assert uncertain(np.zeros(2), np.eye(4))


def test_the_words_name_the_weak_plane():
    W, C = coefficients([0.01, 0.9])
    words = too_small(W, C, ("drive", "fan"))
    assert "the effect of plane 'fan' is only 1." in words
    assert "contained the truth in 40 to 65 % of simulated jobs" in words
    assert "repeat the trial run of plane 'fan'" in words
    assert too_small(W, coefficients([0.01, 0.01])[1], ("drive", "fan")) == ""


def test_the_words_name_planes_that_act_alike():
    W, C = coefficients([0.1, 0.1])
    W[:, 1] = W[:, 0] * (1 + 1j) + 0.15 * W[:, 1]
    words = too_small(W, C, ("drive", "fan"))
    assert "planes 'drive' and 'fan' act so much alike (condition number" in words
    assert "use the weighted method, which is more honest here" in words
    assert "leave a plane out" in words


def test_exact_coefficients_are_never_optimistic():
    W, C = coefficients([0.0, 0.0])
    assert clearness(W, C) == np.inf
    assert too_small(W, C, ("A", "B")) == ""


def test_clearness_is_that_of_the_effect_for_one_plane():
    W, C = coefficients([0.2, 0.2])
    chi_square = np.sum(np.abs(W[:, 0]) ** 2) / 0.04
    assert clearness(W[:, :1], C[:, :2, :2]) == pytest.approx(np.sqrt(chi_square / 24))
