"""Regions of the correction weights contain the truth as often as they say, or the program warns.

The tables of the example with fewer jobs. Bounds: a share that is at its requirement passes, by the binomial
distribution of so many jobs.
"""

import importlib.util
import re
import sys
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from balancing_data import complex_normal
from repetitions import FULL, highest_share, lowest_share
from scipy.special import chdtri

from balancing import UndeterminedError, estimate_influence
from balancing.correction.region_coverage import clearness, relative_error, too_small, uncertain
from balancing.solvers.effective_variance import effective_variance
from rotorid.regression import stretch

PATH = Path(__file__).parents[3] / "examples" / "coverage_balance.py"


@pytest.fixture(scope="module")
def example():
    spec = importlib.util.spec_from_file_location("coverage_balance", PATH)
    module = importlib.util.module_from_spec(spec)
    sys.modules[spec.name] = module
    spec.loader.exec_module(module)
    yield module
    del sys.modules[spec.name]


@pytest.fixture(scope="module")
def good(example):
    """Jobs whose errors are stated correctly or estimated, of every source and kind."""
    each = 100 if FULL else 10
    return [one for s in example.SOURCES[:4] for k in example.KINDS for one in example.simulate(each, s, k)]


def silent(found):
    return [one.inside for one in found if one.inside is not None and not one.words]


def warned(found):
    return [bool(one.words) for one in found if one.inside is not None]


def test_regions_of_jobs_without_a_warning(good):
    inside = silent(good)
    assert len(inside) > 0.8 * len(good)
    assert lowest_share(len(inside), 0.93) <= np.mean(inside) <= highest_share(len(inside), 0.97)


def test_good_jobs_are_seldom_warned(good):
    said = warned(good)
    assert np.mean(said) <= highest_share(len(said), 0.10)


def test_errors_twice_as_large_as_stated(example):
    """Those that a test can see are warned of; regions of others are too small, which the bounds notice."""
    n = 500 if FULL else 200
    found = example.simulate(n // 3, "stated, spare runs", "independent", told=2.0)
    said = [bool(one.words) for one in found if one.inside is not None and one.redundant >= 8]
    assert np.mean(said) >= lowest_share(len(said), 0.95)
    inside = silent(example.simulate(n // 2, "stated", "common to a run", told=2.0))
    assert np.mean(inside) < lowest_share(len(inside), 0.93)


def test_assumed_errors_that_are_not_too_small(example):
    inside = silent(example.every_kind(500 if FULL else 150, "assumed", lambda _: example.assumed(1.0)))
    assert np.mean(inside) >= lowest_share(len(inside), 0.93)


def test_errors_in_common_taken_as_independent_are_noticed(example, monkeypatch):
    """The bounds refuse the wrong model: every error between runs its own."""
    import balancing.coefficients.run_error_estimate as run_likelihood

    monkeypatch.setattr(run_likelihood, "SHARES", (1.0,))
    n = 500 if FULL else 180
    found = [one for kind in example.KINDS[2:] for one in example.simulate(n // 3, "stated", kind)]
    inside = silent(found)
    assert np.mean(inside) < lowest_share(len(inside), 0.92)


def test_the_tables_are_printed(example, capsys):
    example.main(8)
    text = capsys.readouterr().out
    assert [line[0] for line in text.splitlines() if line[1:3] == ". "] == ["a", "b", "c", "d"]
    assert text.count("all: ") == 10
    page = (PATH.parents[1] / "docs" / "coverage.md").read_text(encoding="utf-8")
    shown = [line for block in page.split("```text\n")[1:] for line in block.split("```")[0].splitlines()]
    assert [name(line) for line in shown] == [name(line) for line in text.splitlines() if line]


def test_a_residual_beyond_the_errors_keeps_the_truth_in_the_region(example):
    """Unbalance outside the planes with 20 % of the vibration, orthogonal to what the planes do."""
    rng = np.random.default_rng(21)
    n, inside = 200 if FULL else 120, []
    while len(inside) < n:
        job = example.draw(rng, "stated", "independent", (0.02, 0.0))
        try:
            clean = estimate_influence(job.trials)
        except UndeterminedError:
            continue
        W, Y = clean.W.reshape(-1, len(job.D)), clean.baseline.ravel()
        if len(W) < len(job.D) + 3:
            continue
        outside = complex_normal(rng, len(W))
        outside -= W @ np.linalg.lstsq(W, outside, rcond=None)[0]
        outside *= 0.2 * np.linalg.norm(Y) / np.linalg.norm(outside)
        readings = job.trials.readings + outside.reshape(clean.baseline.shape)
        try:
            found = estimate_influence(replace(job.trials, readings=readings))
        except UndeterminedError:
            continue
        channels = found.covariance.reshape(-1, *found.covariance.shape[-2:])
        fit = effective_variance(found.W.reshape(W.shape), found.baseline.ravel(), channels)
        d = stretch(fit.weights - job.D)
        inside.append(
            d @ np.linalg.solve(fit.covariance * fit.inflation**2, d) < chdtri(2 * len(job.D), 0.05)
        )
    assert np.mean(inside) >= lowest_share(n, 0.93), np.mean(inside)


def name(line):
    """What a line of a table is about, without its numbers at the end."""
    return re.split(r"  +[\d–]| [\d.–]+ % of", line)[0].rstrip()


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
