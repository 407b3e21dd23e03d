"""Coefficients of a type of machines brought up to date by runs."""

from dataclasses import replace

import numpy as np
import pytest
from balancing_data import complex_normal, stored

from balancing import ReadingErrors, Trials, with_parameters
from rotorid.fleet.machine_type import update

SPEED = np.array([100.0])


def prior(C=1, P=1, alike=False):
    """Coefficients with independent errors, or one error for all."""
    W = complex_normal(np.random.default_rng(1), (1, C, P))
    n = W.size
    columns = 0.3 * np.concatenate((np.eye(n), 1j * np.eye(n))).reshape(2 * n, 1, C, P)
    if alike:
        columns = 0.3 * np.array([1, 1j])[:, None, None, None] * np.ones((1, C, P))
    expected = replace(stored(W, speeds=SPEED, planes="PQ"[:P]), sensors=tuple("abc"[:C]))
    return with_parameters(expected, columns, 0.0)


def of_runs(expected, W, D, T, rng, floor=0.05):
    Y = np.einsum("scp,rp->rsc", W, np.asarray(T) - D)
    Y = Y + floor * complex_normal(rng, Y.shape)
    names = tuple(f"run {r}" for r in range(len(Y)))
    return Trials(names, SPEED, expected.sensors, expected.planes, Y, T, errors=ReadingErrors(floor=floor))


def test_one_trial_run_is_the_weighted_mean():
    expected, rng = prior(), np.random.default_rng(2)
    trials = of_runs(expected, expected.W + 0.2, np.array([1.0]), [[0.0], [0.8j]], rng)
    outcome, _ = update(expected, trials)
    measured = (trials.mean[1] - trials.mean[0]) / 0.8j
    variance = 2 * 0.05**2 / 0.8**2
    share = 0.3**2 / (0.3**2 + variance)
    assert outcome.W[0, 0, 0] == pytest.approx(expected.W[0, 0, 0] * (1 - share) + measured[0, 0] * share)
    assert outcome.channels()[0, 0, 2, 2] == pytest.approx(1 / (1 / 0.3**2 + 1 / variance))
    # Y0 is read directly, and through the second run
    through = 0.05**2 + 0.8**2 * 0.3**2
    assert outcome.channels()[0, 0, 0, 0] == pytest.approx(1 / (1 / 0.05**2 + 1 / through))


def test_a_plane_that_was_not_tried_follows_the_one_that_was():
    expected, rng = prior(P=2, alike=True), np.random.default_rng(5)
    trials = of_runs(expected, expected.W + 0.4, np.array([1.0, 2.0]), [[0, 0], [5.0, 0]], rng, floor=0.01)
    outcome, _ = update(expected, trials)
    assert pytest.approx(expected.W + 0.4, abs=0.02) == outcome.W


def test_runs_that_show_larger_errors_than_are_assumed_make_no_machine_another():
    """Seven runs with 5 %, nothing stated: 2 % were assumed, and 85 of 100 machines called others."""
    expected, rng, chances = prior(C=3, P=2), np.random.default_rng(8), []
    T = np.array([[0, 0], [1, 0], [0, 1j], [0, 0], [1j, 1], [-1, 0], [0, 1.4]])
    for _ in range(60):
        W = expected.W + 0.3 * complex_normal(rng, expected.W.shape)
        trials = of_runs(expected, W, np.array([1.0, 2.0]), T, rng, floor=1e-9)
        readings = trials.readings * (1 + 0.05 * complex_normal(rng, trials.readings.shape))
        chances.append(update(expected, replace(trials, readings=readings, errors=None))[1])
    assert np.mean(np.array(chances) < 1e-3) < 0.05


def test_readings_without_an_error_of_their_own_are_taken():
    expected, rng = prior(C=3, P=2), np.random.default_rng(9)
    trials = of_runs(expected, expected.W, np.array([1.0, 2.0]), [[0, 0], [0.5, 0]], rng, floor=1e-9)
    readings = trials.readings.copy()
    readings[..., 0] = 0.0
    outcome, _ = update(expected, replace(trials, readings=readings, errors=ReadingErrors(amplitude=0.02)))
    assert outcome.baseline[0] == pytest.approx(np.append(0.0, trials.mean[0, 0, 1:]), rel=0.1, abs=1e-3)
