"""Influence coefficients: numbers by hand, draws that have the covariance they say, rebased ones."""

from dataclasses import replace

import numpy as np
import pytest
from balancing_data import bruel_kjaer, job, synthetic

from balancing.conditioning import UndeterminedError
from balancing.influence import estimate_influence
from balancing.trials import Placement, ReadingErrors, RunScatter

STATED = ReadingErrors(0.01, 0.02)


def test_covariance_of_a_difference():
    """W = (Y₁ − Y₀)/T: errors of both readings, and the same Y₀ in Y₀."""
    floor = replace(bruel_kjaer(errors=ReadingErrors(floor=0.1)), run_errors=RunScatter(0.0, 1e-12))
    V = estimate_influence(floor).channels()[0, 0]
    assert np.allclose(
        V[:4, :4], np.kron([[1, -400], [-400, 2 * 400**2]], 0.01 * np.eye(2)), rtol=1e-6, atol=1e-4
    )


def every_error():
    """Coefficients with every kind of error, at 12 readings."""
    trials, _, _ = synthetic(np.random.default_rng(1), errors=STATED)
    return estimate_influence(
        replace(trials, placement=Placement(0.03, 0.05), drift=0.02, run_errors=RunScatter(0.02))
    )


def test_draws_have_the_covariance_of_channels():
    influence = every_error()
    Y0, W = (np.concatenate(parts) for parts in zip(*influence.draws(4000), strict=True))
    theta = np.concatenate((Y0[..., None], W), axis=-1)
    error = (theta - theta.mean(axis=0)).view(float)
    drawn = np.einsum("bscp,bscq->scpq", error, error) / len(error)
    stated = influence.channels()
    # sizes of the parts are drawn, those of channels typical: variances agree to their mean
    ratio = np.einsum("scpp->scp", drawn) / np.einsum("scpp->scp", stated)
    assert np.median(ratio) == pytest.approx(1.0, abs=0.15)


def test_rebased_on_new_runs():
    influence = every_error()
    trials = influence.trials
    T = np.array([[0.5e-3, 0.2e-3]])
    readings = influence.baseline * 0.8 + influence.W @ T[0]
    new = replace(trials, runs=("today",), readings=readings[None], weights=T, drift=0.0)
    today = influence.rebased(new)
    assert np.allclose(today.baseline, 0.8 * influence.baseline)
    assert today.mounted.run == "today"
    assert np.allclose(today.mounted.weights, T[0])
    assert np.allclose(today.channels()[..., 2:, 2:], influence.channels()[..., 2:, 2:])
    # with the weights that are mounted only the new run errs
    Y0, W = (np.concatenate(parts) for parts in zip(*today.draws(2000), strict=True))
    back = Y0 + W @ T[0]
    alone = estimate_errors(today, readings, T[0])
    assert np.std(back.real, axis=0) == pytest.approx(np.std(alone.real, axis=0), rel=0.15)


def estimate_errors(influence, readings, weights):
    return np.concatenate(list(influence.further(readings, weights, 2000)))


def test_runs_without_weights_that_differ():
    influence = every_error()
    trials = influence.trials
    with pytest.raises(UndeterminedError, match="give the weights table"):
        influence.rebased(replace(trials, weights=np.zeros((3, 2))))


def test_a_trial_weight_without_effect():
    with pytest.raises(UndeterminedError, match="changed no reading"):
        estimate_influence(job(np.ones((2, 3)), [[0], [1e-3]]))
    readings = np.array([[1.0, 1.0, 1.0], [1.001, 0.999, 1.002]])
    with pytest.raises(UndeterminedError, match="repeat the run with a larger trial weight, at least"):
        estimate_influence(job(readings, [[0], [1e-3]], errors=ReadingErrors(0.02, 0.02)))


def test_runs_that_disagree():
    readings = np.array([[1.0, 1.0], [1.5, 0.5], [3.0, 4.0]])
    remarks = estimate_influence(job(readings, [[0], [0], [1e-3]])).remarks
    assert "is missing in the weights table" in remarks.contradictions[0]
    assert remarks.contradictions == remarks.warnings
