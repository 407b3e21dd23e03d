"""Regions of the correction weights contain the truth as often as they say, or the program warns.

The example's table with fewer jobs. Bounds: a share that is at its requirement passes with 99.9 %, by the
binomial distribution of so many jobs.
"""

import importlib.util
import sys
from pathlib import Path

import numpy as np
import pytest
from balancing_data import complex_normal
from repetitions import repetitions
from scipy.stats import binom

from balancing.correction.region_coverage import clearness, optimism
from balancing.solvers.effective_variance import effective_variance

PATH = Path(__file__).parents[3] / "examples" / "coverage_balance.py"
STRONG, MEDIUM, WEAK = (0.3, 1.0), (0.1, 0.3), (0.03, 0.1)
GOOD, POOR, BAD = (1.0, 10.0), (10.0, 30.0), (30.0, 100.0)


@pytest.fixture(scope="module")
def example():
    spec = importlib.util.spec_from_file_location("coverage_balance", PATH)
    module = importlib.util.module_from_spec(spec)
    sys.modules[spec.name] = module
    spec.loader.exec_module(module)
    yield module
    del sys.modules[spec.name]


def at_least(share, values):
    return np.mean(values) >= binom.ppf(1e-3, len(values), share) / len(values)


def at_most(share, values):
    return np.mean(values) <= binom.ppf(1 - 1e-3, len(values), share) / len(values)


def test_strong_trials_and_planes_that_differ(example):
    n = repetitions(700)
    found = example.simulate(n, GOOD, STRONG)
    inside = found.inside["weighted"]
    assert len(inside) > 0.97 * n
    assert found.lost == 0
    assert at_least(0.93, inside), np.mean(inside)
    assert at_most(0.97, inside), np.mean(inside)
    # least squares does not reach it
    assert not at_least(0.93, found.inside["least-squares"])
    for method in example.METHODS:
        assert at_least(0.93, found.bands[method]), np.mean(found.bands[method])
        assert at_most(0.97, found.bands[method]), np.mean(found.bands[method])


@pytest.mark.parametrize(("condition", "effect"), [(GOOD, WEAK), (POOR, MEDIUM), (BAD, STRONG)])
def test_where_regions_are_too_small_the_warning_says_so(example, condition, effect):
    n = repetitions(500)
    found = example.simulate(n, condition, effect)
    assert found.refused > n / 2
    for method in example.METHODS:
        assert not at_least(0.95, found.inside[method]), np.mean(found.inside[method])
        assert np.mean(found.warned[method]) > 0.75
        assert at_least(0.93, found.bands[method]), np.mean(found.bands[method])
        assert at_most(0.97, found.bands[method]), np.mean(found.bands[method])
    # least squares is worse
    assert np.mean(found.inside["least-squares"]) < np.mean(found.inside["weighted"]) - 0.2


def test_where_the_warning_is_silent_regions_are_honest(example):
    """Weighted, classes of medium difficulty together."""
    silent = []
    for condition, effect in ((GOOD, STRONG), (GOOD, MEDIUM), (POOR, STRONG)):
        found = example.simulate(200, condition, effect, seed=2)
        pairs = zip(found.inside["weighted"], found.warned["weighted"], strict=True)
        silent += [inside for inside, warned in pairs if not warned]
    assert len(silent) > 300
    assert at_least(0.93, silent), np.mean(silent)
    assert at_most(0.97, silent), np.mean(silent)


def test_the_table_is_printed(example, capsys):
    example.main(8)
    text = capsys.readouterr().out
    assert text.count("%–") == 9
    assert "weighted fits that did not converge: 0" in text


def test_a_residual_beyond_the_errors_keeps_the_truth_in_the_region(example):
    """Unbalance outside the planes with 20 % of the vibration, orthogonal to what the planes do."""
    rng = np.random.default_rng(21)
    inside = []
    for _ in range(200):
        true = example.rotor(rng, 3.0)
        outside = complex_normal(rng, 12)
        outside -= true.W @ np.linalg.lstsq(true.W, outside, rcond=None)[0]
        outside *= 0.2 * np.linalg.norm(true.Y) / np.linalg.norm(outside)
        influence = example.estimate_influence(
            example.trial_runs(rng, true._replace(Y=true.Y + outside), STRONG)
        )
        fit = effective_variance(*example._stacked(influence))
        wide = fit.covariance * fit.inflation**2
        inside.append(example._distance(fit.weights - true.D, wide) < example.chdtri(4, 0.05))
    assert at_least(0.93, inside), np.mean(inside)


def coefficients(errors, seed=22):
    """Two planes of equal effect, twelve readings; errors of W of the given size."""
    rng = np.random.default_rng(seed)
    W = complex_normal(rng, (12, 2))
    return W, np.zeros((12, 4, 4)) + np.diag(np.repeat(errors, 2)) ** 2


def test_the_words_name_the_weak_plane():
    W, C = coefficients([0.01, 0.9])
    words = optimism(W, C, ("drive", "fan"))
    assert "the effect of plane 'fan' is only 1." in words
    assert "contained the truth in 25 to 90 % of simulated jobs" in words
    assert "repeat the trial run of plane 'fan'" in words
    assert optimism(W, coefficients([0.01, 0.01])[1], ("drive", "fan")) == ""


def test_the_words_name_planes_that_act_alike():
    W, C = coefficients([0.1, 0.1])
    W[:, 1] = W[:, 0] * (1 + 1j) + 0.15 * W[:, 1]
    words = optimism(W, C, ("drive", "fan"))
    assert "planes 'drive' and 'fan' act so much alike (condition number" in words
    assert "leave a plane out" in words


def test_least_squares_needs_more_than_the_weighted_method():
    """The same job, clear enough for the one and not for the other."""
    W, C = coefficients([0.2, 0.2])
    assert optimism(W, C, ("A", "B")) == ""
    words = optimism(W, C, ("A", "B"), method="least-squares")
    assert "use the weighted method, which is more honest here" in words
    assert "80 to 90 %" in words


def test_exact_coefficients_are_never_optimistic():
    W, C = coefficients([0.0, 0.0])
    assert clearness(W, C) == (np.inf, np.inf)
    assert optimism(W, C, ("A", "B"), method="least-squares") == ""


def test_clearness_is_that_of_the_effect_for_one_plane():
    W, C = coefficients([0.2, 0.2])
    ratio, clear = clearness(W[:, :1], C[:, :2, :2])
    chi_square = np.sum(np.abs(W[:, 0]) ** 2) / 0.04
    assert ratio == pytest.approx(np.sqrt(chi_square / 24))
    assert clear == pytest.approx((chi_square - 24) / np.sqrt(48 + 4 * (chi_square - 24)))
