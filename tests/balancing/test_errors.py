"""Errors of readings and of runs: from repeats, stated, measured, and sizes of errors that were drawn."""

from dataclasses import replace

import numpy as np
import pytest
from balancing_data import complex_normal, job, noisy, synthetic

from balancing.reading_errors import (
    ASSUMED,
    reading_covariance,
    reading_of,
    run_errors,
    unseen,
)
from balancing.trials import ReadingErrors, RunScatter

T = np.diag([0.001, 0.001])


def many(scatter, errors=None, repeats=30, across=None):
    """Repeats of three runs with errors along and across."""
    rng = np.random.default_rng(12)
    exact, _, _ = synthetic(rng)
    true = ReadingErrors(scatter, scatter if across is None else across)
    return job(
        noisy(rng, exact.readings[0], true, (repeats,)), exact.weights, speeds=exact.speeds, errors=errors
    )


def test_repeats_give_the_errors_where_none_are_stated():
    trials = many(0.02, across=0.01)
    readings = trials.readings.copy()
    readings[20:, 0] = np.nan  # fewer repeats of the first run
    reading = reading_of(replace(trials, readings=readings))
    assert (reading.source, reading.dof) == ("repeats", 12 * (2 * 29 + 19))
    assert reading.errors.amplitude == pytest.approx(0.02, rel=0.08)
    assert reading.errors.phase == pytest.approx(0.01, rel=0.08)
    # the mean of n has 1/n of the variance
    one, mean = (
        reading_covariance(trials.mean, reading.errors),
        reading.covariance(replace(trials, readings=readings)),
    )
    assert np.allclose(mean[1:], one[1:] / 30, rtol=0.05)


@pytest.mark.parametrize(
    ("stated", "scatter", "errors", "source"),
    [
        ((0.01, 0.02), (0.003, 0.006), (0.01, 0.02), "stated"),
        ((0.01, 0.02), (0.03, 0.06), (0.03, 0.06), "stated, enlarged by repeats"),
        ((0.01, 0.0), (0.01, 0.02), (0.01, 0.02), "stated, enlarged by repeats"),  # one was not stated
    ],
)
def test_stated_errors_hold_unless_repeats_contradict_them(stated, scatter, errors, source):
    reading = reading_of(many(scatter[0], ReadingErrors(*stated), 9, across=scatter[1]))
    assert reading.source == source
    assert (reading.errors.amplitude, reading.errors.phase) == pytest.approx(errors, rel=0.1)
    assert any("times as much as the stated errors" in w for w in reading.warnings) == (errors[0] > stated[0])


def test_equal_repeats_say_nothing_about_the_errors():
    exact, _, _ = synthetic(np.random.default_rng(1))
    repeats = np.repeat(exact.readings, 3, axis=0)
    reading = reading_of(replace(exact, readings=repeats))
    assert reading.errors == ASSUMED
    assert "equal to the last digit" in reading.warnings[0]


def test_errors_that_an_instrument_measured():
    trials = many(0.1, repeats=4)
    each = np.tile(0.03**2 * np.eye(2)[..., None, None, None, None], trials.readings.shape)
    one = replace(trials, readings=trials.readings[:1], covariance=each[:, :, :1])
    reading = reading_of(one)
    assert reading.source == "measured"
    assert reading.errors.floor == pytest.approx(0.03)
    assert np.allclose(reading.covariance(one), 0.03**2 * np.eye(2))
    # stated ones add to them, digits do too, and do not average out
    both = replace(one, errors=ReadingErrors(floor=0.04))
    assert np.allclose(reading_of(both).covariance(both), 0.05**2 * np.eye(2))
    step = np.sqrt(12) * 0.02
    steps = np.stack((np.full(one.readings.shape, step), step / np.abs(one.readings)))
    rounded = replace(one, steps=steps)
    assert np.allclose(reading_of(rounded).covariance(rounded), (0.03**2 + 0.02**2) * np.eye(2))


def drawn(rng, own, common, further, spare=12):
    """An exact rotor with runs that err, and errors of a reading near zero."""
    weights = np.vstack((np.zeros((spare + 1, 2)), np.diag([1e-3, 1e-3])))
    trials, W, _ = synthetic(rng, weights=weights, errors=ReadingErrors(1e-4, 1e-4))
    Y = trials.readings[0]
    R = len(Y)
    level = np.sqrt(np.mean(np.abs(Y) ** 2))
    columns = W * level / np.sqrt(2 * np.mean(np.abs(W) ** 2, axis=(0, 1)))
    error = own * np.abs(Y) * complex_normal(rng, Y.shape) + common * Y * complex_normal(rng, (R, 1, 1))
    error += further * np.einsum("scp,rp->rsc", columns, complex_normal(rng, (R, 2)))
    theta = np.linalg.pinv(np.column_stack((np.ones(R), weights))) @ (Y + error).reshape(R, -1)
    return replace(trials, readings=Y + error), theta.T.reshape(*Y.shape[1:], 3)


@pytest.mark.parametrize("sizes", [(0.03, 0.0, 0.0), (0.0, 0.03, 0.0), (0.0, 0.0, 0.03), (0.01, 0.03, 0.0)])
def test_spare_runs_tell_the_parts(sizes):
    rng = np.random.default_rng(3)
    found = []
    for _ in range(8):
        trials, theta = drawn(rng, *sizes)
        reading = reading_of(trials)
        run = run_errors(trials, theta, reading.covariance(trials), reading)
        assert run.origin == "estimated"
        found.append(np.sqrt(run.probability @ run.sizes**2))
    # twelve complex numbers tell a size to 20 % each
    assert np.allclose(np.mean(found, axis=0)[[0, 1, 3]], sizes, atol=0.15 * max(sizes) + 0.1 * max(sizes))


def test_stated_run_errors_are_fixed_in_all_unless_contradicted():
    trials, theta = drawn(np.random.default_rng(5), 0.02, 0.0, 0.0)
    reading = reading_of(trials)
    covariance = reading.covariance(trials)
    run = run_errors(replace(trials, run_errors=RunScatter(0.02)), theta, covariance, reading)
    assert run.origin == "stated"
    assert np.allclose(np.sum(run.sizes**2, axis=1), 0.02**2)
    wrong = run_errors(replace(trials, run_errors=RunScatter(0.002)), theta, covariance, reading)
    assert "placement_percent" in unseen(wrong, trials)[-1]  # a note where errors are estimated
    assert 0.01 < np.linalg.norm(wrong.typical) < 0.04


def test_assumed_where_nothing_tells():
    trials, _, _ = synthetic(np.random.default_rng(6))
    reading = reading_of(trials)
    assert reading.errors == ASSUMED
    theta = np.ones((*trials.mean.shape[1:], 3), dtype=complex)
    run = run_errors(trials, theta, reading.covariance(trials), reading)
    assert run.origin == "assumed"
    assert np.allclose(run.typical, [0.02, 0.02, 0.0, 0.02])
