"""Errors of influence coefficients beside the scatter of drawn runs."""

import numpy as np
from balancing_data import GRAM, job, noisy, synthetic
from repetitions import of_a_spread, repetitions

from balancing import ReadingErrors, correct, estimate_influence
from rotorid.regression import stretch

ERRORS = ReadingErrors(amplitude=0.006, phase=np.deg2rad(0.2), floor=0.001)


def test_over_determined_runs_with_errors_of_very_different_size():
    """Rows are weighted; the stated covariance is that of the weighted solution."""
    rng = np.random.default_rng(9)
    T = np.array([[0, 0], [1, 0], [0, 1], [3, 0], [0, 3j], [0, 0]]) * GRAM
    trials, _, _ = synthetic(rng, planes=2, sensors=2, speeds=1, weights=T, errors=ERRORS)
    c = correct(estimate_influence(trials))
    exact = trials.readings[0]
    D = []
    n = repetitions(1500)
    for _ in range(n):
        draw = job(noisy(rng, exact, ERRORS), T, speeds=trials.speeds, errors=ERRORS)
        D.append(stretch(correct(estimate_influence(draw)).weights))
    np.testing.assert_allclose(np.std(D, axis=0), np.sqrt(np.diag(c.covariance)), rtol=of_a_spread(n))
