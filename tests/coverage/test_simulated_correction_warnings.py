"""Planes that only errors tell apart: drawn jobs."""

import contextlib

import numpy as np
import pytest
from balancing_data import complex_normal, job, noisy
from repetitions import FULL, lowest_share

from balancing import ReadingErrors, UndeterminedError, correct, estimate_influence

ERRORS = ReadingErrors(0.01, 0.01)


def dependent(rng, planes=2, readings=6, apart=0.0):
    """Coefficients whose last plane follows from the others, but for `apart`; and a vibration."""
    W = complex_normal(rng, (readings, planes))
    W[:, -1] = W[:, :-1] @ complex_normal(rng, planes - 1) + apart * complex_normal(rng, readings)
    return W, complex_normal(rng, readings)


def simulated(rng, W, Y0, errors, stated=True):
    P = W.shape[1]
    T = np.vstack((np.zeros(P), np.eye(P)))
    exact = Y0 + T @ W.T
    return job(noisy(rng, exact, errors), T, errors=errors if stated else None)


@pytest.mark.parametrize("planes", [2, 3])
@pytest.mark.parametrize("errors", [ERRORS, ReadingErrors(0.005, 0.005, 0.02)])
def test_planes_that_only_errors_tell_apart_are_refused(planes, errors):
    rng = np.random.default_rng(21)
    W, Y0 = dependent(rng, planes, readings=8)
    n = 100 if FULL else 60
    influences = [estimate_influence(simulated(rng, W, Y0, errors)) for _ in range(n)]
    refused = 0
    for influence in influences:
        found = correct(influence, refuse=False, method="least-squares")
        if "act alike" in found.summary():
            with contextlib.suppress(UndeterminedError):
                correct(influence, method="least-squares")
                refused -= 1
            refused += 1
    # the hypothesis of dependence is true: refused in about 95 % of all jobs
    assert refused >= (88 if FULL else n * lowest_share(n, 0.95))
    # planes that differ by more than the errors are determined
    W, Y0 = dependent(rng, planes, readings=8, apart=0.3)
    for _ in range(20):
        correct(estimate_influence(simulated(rng, W, Y0, errors)))
