"""Coefficients of a type of machines brought up to date by runs."""

from dataclasses import replace

import numpy as np
import pytest
from balancing_data import complex_normal, stored

from balancing import ReadingErrors, RunScatter, Trials, with_parameters
from rotorid.fleet import update

TWO = np.array([100.0, 200.0])


def prior(std=0.3, S=1, C=1, P=1, seed=1, alike=False):
    """Coefficients with independent errors, or one error for all."""
    rng = np.random.default_rng(seed)
    W = complex_normal(
        rng,
        (
            S,
            C,
            P,
        ),
    )
    n = W.size
    columns = std * np.concatenate((np.eye(n), 1j * np.eye(n))).reshape(2 * n, S, C, P)
    if alike:
        columns = std * np.array([1, 1j])[:, None, None, None] * np.ones((S, C, P))
    known = replace(stored(W, speeds=TWO[:S], planes="PQ"[:P]), sensors=tuple("abc"[:C]))
    return with_parameters(known, columns, 0.0)


def of_runs(known, W, D, T, rng, floor=0.05):
    S = len(W)
    Y = np.einsum("scp,rp->rsc", W, np.asarray(T) - D)
    Y = Y + floor * complex_normal(rng, Y.shape)
    names = tuple(f"run {r}" for r in range(len(Y)))
    return Trials(names, TWO[:S], known.sensors, known.planes, Y, T, errors=ReadingErrors(floor=floor))


def test_one_trial_run_is_the_weighted_mean():
    known, rng = prior(), np.random.default_rng(2)
    trials = of_runs(known, known.W + 0.2, np.array([1.0]), [[0.0], [0.8j]], rng)
    found, _ = update(known, trials)
    measured = (trials.mean[1] - trials.mean[0]) / 0.8j
    variance = 2 * 0.05**2 / 0.8**2
    share = 0.3**2 / (0.3**2 + variance)
    assert found.W[0, 0, 0] == pytest.approx(known.W[0, 0, 0] * (1 - share) + measured[0, 0] * share)
    assert found.channels()[0, 0, 2, 2] == pytest.approx(1 / (1 / 0.3**2 + 1 / variance))
    # Y0 is read directly, and through the second run
    through = 0.05**2 + 0.8**2 * 0.3**2
    assert found.channels()[0, 0, 0, 0] == pytest.approx(1 / (1 / 0.05**2 + 1 / through))


def test_a_bare_run_leaves_the_coefficients_and_is_the_baseline():
    known, rng = prior(S=2, C=3, P=2), np.random.default_rng(2)
    trials = of_runs(known, known.W, np.array([1.0, 2.0]), [[0.0, 0.0]], rng)
    found, chance = update(known, trials)
    assert chance == 1.0
    assert pytest.approx(known.W) == found.W
    assert found.baseline == pytest.approx(trials.mean[0])
    assert found.channels()[..., 2:, 2:] == pytest.approx(known.channels()[..., 2:, 2:])


@pytest.mark.parametrize("size", [1.0, 1e-9])
def test_the_unit_of_readings_does_not_matter(size):
    """Errors of 5e-11 m once left no variance of the coefficients: pinv cut it off."""
    known, rng = prior(S=2, C=3, P=2), np.random.default_rng(2)
    trials = of_runs(known, known.W, np.array([1.0, 2.0]), [[0.0, 0.0], [0.5, 0.2j]], rng)
    small = replace(known, W=known.W * size)
    small = with_parameters(small, known.columns()[..., 1:] * size, 0.0)
    less = replace(trials, readings=trials.readings * size, errors=ReadingErrors(floor=0.05 * size))
    found, chance = update(small, less)
    reference, as_before = update(known, trials)
    assert found.W / size == pytest.approx(reference.W, rel=1e-9)
    assert found.channels() / size**2 == pytest.approx(reference.channels(), rel=1e-6, abs=1e-9)
    assert chance == pytest.approx(as_before, rel=1e-6)


def test_without_knowledge_it_is_the_measurement():
    known, rng = prior(std=1e4, S=2, C=3, P=2), np.random.default_rng(3)
    T = [[0, 0], [0.5, 0], [0, 0.7j], [0.3, 0.2]]
    trials = replace(of_runs(known, known.W, np.array([1.0, 2.0]), T, rng), run_errors=RunScatter(0.0))
    found, _ = update(known, trials)
    A = np.column_stack((np.ones(len(T)), np.array(T)))
    alone = np.linalg.lstsq(A, trials.mean.reshape(len(T), -1), rcond=None)[0].reshape(3, 2, 3)
    assert pytest.approx(np.moveaxis(alone[1:], 0, -1), rel=1e-6) == found.W
    assert found.baseline == pytest.approx(alone[0], rel=1e-6)


def test_a_plane_that_was_not_tried_follows_the_one_that_was():
    known, rng = prior(P=2, alike=True), np.random.default_rng(5)
    trials = of_runs(known, known.W + 0.4, np.array([1.0, 2.0]), [[0, 0], [5.0, 0]], rng, floor=0.01)
    found, _ = update(known, trials)
    assert pytest.approx(known.W + 0.4, abs=0.02) == found.W


def test_runs_that_show_larger_errors_than_are_assumed_make_no_machine_another():
    """Seven runs with 5 %, nothing stated: 2 % were assumed, and 85 of 100 machines called others."""
    known, rng, chances = prior(C=3, P=2), np.random.default_rng(8), []
    T = np.array([[0, 0], [1, 0], [0, 1j], [0, 0], [1j, 1], [-1, 0], [0, 1.4]])
    for _ in range(60):
        W = known.W + 0.3 * complex_normal(rng, known.W.shape)
        trials = of_runs(known, W, np.array([1.0, 2.0]), T, rng, floor=1e-9)
        readings = trials.readings * (1 + 0.05 * complex_normal(rng, trials.readings.shape))
        chances.append(update(known, replace(trials, readings=readings, errors=None))[1])
    assert np.mean(np.array(chances) < 1e-3) < 0.05


def test_readings_without_an_error_of_their_own_are_taken():
    known, rng = prior(C=3, P=2), np.random.default_rng(9)
    trials = of_runs(known, known.W, np.array([1.0, 2.0]), [[0, 0], [0.5, 0]], rng, floor=1e-9)
    for errors in (ReadingErrors(amplitude=0.02), ReadingErrors(phase=0.02)):
        readings = trials.readings.copy()
        readings[..., 0] = 0.0
        found, _ = update(known, replace(trials, readings=readings, errors=errors))
        assert found.baseline[0] == pytest.approx(np.append(0.0, trials.mean[0, 0, 1:]), rel=0.1, abs=1e-3)


@pytest.mark.full
def test_chance_is_that_of_machines_of_the_type_and_small_for_others():
    rng, chances = np.random.default_rng(7), []
    known = prior(S=1, C=2, P=2)
    T = [[0, 0], [0.5, 0], [0, 0.7j]]
    for _ in range(300):
        W = known.W + 0.3 * complex_normal(rng, known.W.shape)
        chances.append(update(known, of_runs(known, W, np.array([1.0, 2.0]), T, rng))[1])
    assert np.mean(np.array(chances) < 0.1) == pytest.approx(0.1, abs=0.052)  # three deviations
    other = update(known, of_runs(known, -known.W + 1, np.array([1.0, 2.0]), T, rng))[1]
    assert other < 1e-3
