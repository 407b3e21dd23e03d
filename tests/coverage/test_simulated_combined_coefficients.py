"""Coefficients measured and computed, combined: errors of drawn jobs."""

from dataclasses import replace

import numpy as np
import pytest
from balancing_data import complex_normal, synthetic
from repetitions import FULL

from balancing import (
    Gaussian,
    Influence,
    Labels,
    ReadingErrors,
    combine,
    correct,
    estimate_influence,
    with_parameters,
)

ERRORS = ReadingErrors(0.03, 0.03)


def model(W, error, planes="AB", sensors=("s0", "s1", "s2", "s3"), speeds=(100.0, 200.0, 300.0), unit="g"):
    """Computed coefficients with a covariance as `model_influence` makes it."""
    nothing, none = np.full(W.shape[:2], np.nan), Gaussian.none(*W.shape)
    exact = Influence(np.array(speeds), sensors, tuple(planes), W, nothing, none, Labels(weight_unit=unit))
    return with_parameters(exact, np.zeros((0, *W.shape)), error)


def noisy(rng, made, errors=ERRORS):
    """The readings with errors as stated."""
    size = made.mean
    return replace(
        made,
        readings=size * (1 + errors.amplitude * complex_normal(rng, size.shape)),
        errors=errors,
    )


def test_combining_reduces_the_error_where_both_are_right():
    rng = np.random.default_rng(1)
    made, W, Y0 = synthetic(rng)
    true = np.linalg.lstsq(W.reshape(-1, 2), -Y0.ravel(), rcond=None)[0]
    squares, weights, warned, chi = np.zeros(3), np.zeros(2), 0, []
    n = 300 if FULL else 150
    for k in range(n):
        measured = estimate_influence(noisy(rng, made))
        computed = model(W * (1 + 0.05 * complex_normal(rng, W.shape)), 0.05)
        found = combine(measured, computed)
        squares += [np.sum(np.abs(i.W - W) ** 2) for i in (measured, computed, found)]
        if k % 3 == 0:
            weights += [np.sum(np.abs(correct(i).weights - true) ** 2) for i in (measured, found)]
        warned += any("measured and computed" in words for words in found.remarks.warnings)
        error = (found.W - W).view(float)[..., None]
        chi.append(
            np.mean(np.swapaxes(error, -1, -2) @ np.linalg.solve(found.channels()[..., 2:, 2:], error))
        )
    assert squares[2] < 0.8 * squares[:2].min()
    assert weights[1] < 0.9 * weights[0]
    assert np.mean(chi) == pytest.approx(4.0, rel=0.05)  # the covariance says how large the error is
    assert warned < 0.04 * n  # at a level of 99 %
