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
    estimate_influence,
    with_parameters,
)


def computed(W, error):
    """Computed coefficients with a covariance as `model_influence` makes it."""
    labels, nothing, none = Labels(weight_unit="g"), np.full(W.shape[:2], np.nan), Gaussian.none(*W.shape)
    names = tuple(f"s{c}" for c in range(W.shape[1])), ("A", "B")
    exact = Influence(np.array([100.0, 200.0, 300.0]), *names, W, nothing, none, labels)
    return with_parameters(exact, np.zeros((0, *W.shape)), error)


def test_combining_reduces_the_error_where_both_are_right():
    rng, n = np.random.default_rng(1), 300 if FULL else 150
    made, W, _ = synthetic(rng)
    squares, warned, chi = np.zeros(3), 0, []
    for _ in range(n):
        readings = made.mean * (1 + 0.03 * complex_normal(rng, made.mean.shape))
        measured = estimate_influence(replace(made, readings=readings, errors=ReadingErrors(0.03, 0.03)))
        model = computed(W * (1 + 0.05 * complex_normal(rng, W.shape)), 0.05)
        both = combine(measured, model)
        squares += [np.sum(abs(i.W - W) ** 2) for i in (measured, model, both)]
        warned += any("measured and computed" in words for words in both.remarks.warnings)
        error = (both.W - W).view(float)[..., None]
        chi.append(np.mean(np.swapaxes(error, -1, -2) @ np.linalg.solve(both.channels()[..., 2:, 2:], error)))
    assert squares[2] < 0.8 * squares[:2].min()
    assert np.mean(chi) == pytest.approx(4.0, rel=0.05)  # the covariance says how large the error is
    assert warned < 0.04 * n  # at a level of 99 %
