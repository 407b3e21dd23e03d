"""Errors measured from repeats: regions of the weights of drawn jobs."""

from dataclasses import replace

import numpy as np
import pytest
from balancing_data import synthetic
from repetitions import highest_share, lowest_share, repetitions

from balancing import RunScatter, correct, estimate_influence
from rotorid.base.arrays import turned

STEADY = RunScatter(0.0, 1e-9)
"""Runs that differ by hardly anything but their readings."""


def measured(trials, along, across=None):
    """The same trials with standard deviations of each reading, along and across it."""
    along = np.broadcast_to(along, trials.readings.shape)
    across = along if across is None else np.broadcast_to(across, trials.readings.shape)
    covariance = np.moveaxis(turned(trials.readings, along**2, across**2), (-2, -1), (0, 1))
    return replace(trials, covariance=covariance)


def drawn(rng, Y, along, across):
    a, b = rng.standard_normal((2, *Y.shape))
    return Y + Y / np.abs(Y) * (a * along + 1j * b * across)


@pytest.fixture
def exact():
    return synthetic(np.random.default_rng(11))[0]


def test_coverage_of_weights_with_unequal_deviations():
    rng = np.random.default_rng(21)
    exact = synthetic(rng, sensors=3, speeds=2)[0]
    Y = exact.readings
    along = np.abs(Y) * np.exp(rng.uniform(np.log(0.002), np.log(0.05), Y.shape))
    across = np.abs(Y) * np.exp(rng.uniform(np.log(0.002), np.log(0.05), Y.shape))
    true = correct(estimate_influence(exact), method="least-squares").weights
    n, inside, each = repetitions(2000), 0, 0
    for _ in range(n):
        trials = measured(replace(exact, readings=drawn(rng, Y, along, across)), along, across)
        found = correct(estimate_influence(replace(trials, run_errors=STEADY)), method="least-squares")
        d = (found.weights - true).view(float)
        inside += found.region().holds(true)
        each += np.mean(np.abs(d) < 1.96 * np.sqrt(np.diag(found.covariance)))
    assert lowest_share(n, 0.95) <= inside / n <= highest_share(n, 0.95)
    assert 0.93 <= each / n <= 0.97
