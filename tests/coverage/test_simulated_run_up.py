"""Intervals of drawn run-ups."""

import coverage_runup as example
import numpy as np
from repetitions import highest_share, lowest_share


def test_intervals_hold_the_truth_and_the_steady_fit_does_not():
    n = 12
    outcomes = [one for rate in (60.0, -60.0) for one in example.simulate(n, 3, rate)]
    errors = np.abs([one.errors for one in outcomes]).ravel()
    share = np.mean(errors < example.NORMAL)
    assert lowest_share(errors.size, 0.95) <= share <= highest_share(errors.size, 0.95)
    assert sum(bool(one.words) for one in outcomes) <= 1
    steady = np.array([one.steady[0] for one in outcomes])
    assert (steady[:n] > 2e-3).all()
    assert (steady[n:] < -2e-3).all()
