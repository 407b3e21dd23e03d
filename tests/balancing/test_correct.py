"""Correction weights: closed forms, printed jobs, what must hold for every job, regions, and refusals."""

from dataclasses import replace

import numpy as np
import pytest
from balancing_data import (
    GRAM,
    bruel_kjaer,
    complex_normal,
    job,
    limits_by_name,
    noisy,
    stored,
    synthetic,
)
from cases import each_of
from hypothesis import given, settings
from hypothesis import strategies as st
from repetitions import FULL

from balancing import Labels, ReadingErrors, Trials, UndeterminedError, correct, estimate_influence

ERRORS = ReadingErrors(0.01, 0.01)
seeds = st.integers(0, 2**32 - 1)
unhurried = settings(deadline=None, max_examples=100 if FULL else 10)  # a busy machine is no failure


def plain(trials, **options):
    return correct(estimate_influence(trials), method="least-squares", **options)


def rotor(seed, *, outside=0.0, effect=0.6, error=0.02):
    """A job with errors, of two planes, and the weights that would be right."""
    rng = np.random.default_rng(seed)
    W, D = complex_normal(rng, (3, 4, 2)), complex_normal(rng, 2)
    Y0 = -W @ D + outside * complex_normal(rng, (3, 4))
    T = np.vstack((np.zeros(2), effect * np.eye(2)))
    exact = Y0 + np.einsum("scp,rp->rsc", W, T)
    errors = ReadingErrors(error, error)
    return job(noisy(rng, exact, errors), T, errors=errors, speeds=[100.0, 150.0, 200.0]), D


def real(z):
    return np.ascontiguousarray(z).view(float)


# prints


@pytest.mark.parametrize("phase", ["lead", "lag"])
@pytest.mark.parametrize("angles", ["with rotation", "against rotation"])
def test_one_physical_job_in_every_convention(phase, angles):
    """The labels turn the numbers round; the weights stay where they are on the rotor."""
    labels = Labels("mm_s", 1e3, "g", 1e3, phase, angles)
    document = correct(estimate_influence(bruel_kjaer(labels=labels, errors=ERRORS))).to_dict()
    usual = correct(estimate_influence(bruel_kjaer(errors=ERRORS))).to_dict()
    sign = 1 if angles == "with rotation" else -1
    for row, other in zip(document["corrections"], usual["corrections"], strict=True):
        assert row["mass"] == pytest.approx(other["mass"], rel=1e-9)
        assert row["angle_deg"] == pytest.approx(sign * other["angle_deg"] % 360, abs=1e-6)
        flip = np.array([[1, sign], [sign, 1]])
        assert np.allclose(row["covariance"], other["covariance"] * flip, rtol=1e-6)
    first = document["residuals"][0]
    assert first["before"] == pytest.approx(7200)
    assert first["before_phase_deg"] == pytest.approx(238 if phase == "lead" else 122)


# what must hold for every job


@unhurried
@given(seeds)
def test_trial_weights_removed_or_left_in_or_without_a_baseline_run_say_the_same(seed):
    rng = np.random.default_rng(seed)
    W, Y0 = complex_normal(rng, (2, 3, 2)) * 1e3, complex_normal(rng, (2, 3))
    found = []
    for T in ([[0, 0], [1, 0], [1, 1j]], [[0, 0], [1, 0], [0, 1j]], [[1, 0], [-1, 0], [0, 1], [0, -1j]]):
        weights = np.array(T) * GRAM
        trials = job(Y0 + np.einsum("scp,rp->rsc", W, weights), weights, speeds=(100.0, 200.0))
        found.append(plain(trials))
        assert np.allclose(found[-1].to_add, found[-1].weights - weights[-1], rtol=1e-12)
    assert np.allclose(found[1].weights, found[0].weights, rtol=1e-6)
    assert np.allclose(found[2].weights, found[0].weights, rtol=1e-6)


# errors


def test_the_covariance_of_weights_and_of_a_check_run_against_simulated_jobs():
    """Floors of the same size for all, so that nothing depends on what was read: drawn again 3000 times."""
    rng = np.random.default_rng(8)
    floor = ReadingErrors(floor=0.02)
    trials, W, Y0 = synthetic(rng, sensors=3, speeds=2, errors=floor)
    exact = trials.readings[0]
    read = exact + 0.02 * complex_normal(rng, (3000, *exact.shape))
    w = np.moveaxis(read[:, 1:] - read[:, :1], 1, -1).reshape(3000, 6, 2) / GRAM
    D = -np.einsum("kpn,kn->kp", np.linalg.pinv(w), read[:, 0].reshape(3000, 6))
    c = plain(trials)
    assert np.allclose(np.std(real(D), axis=0), np.sqrt(np.diag(c.covariance)), rtol=0.15)
    assert np.allclose(np.abs(D).std(axis=0), c.mass_std, rtol=0.15)
    assert np.allclose(np.angle(D / c.weights).std(axis=0), c.angle_std, rtol=0.15)
    # a check run on the true rotor with the weights of each job
    check = Y0.ravel() + np.einsum("np,kp->kn", W.reshape(6, 2), D) + 0.02 * complex_normal(rng, (3000, 6))
    off = check - read[:, 0].reshape(3000, 6) - np.einsum("knp,kp->kn", w, D)
    stated = np.trace(c.after_covariance, axis1=-2, axis2=-1).ravel()
    assert np.allclose(np.mean(np.abs(off) ** 2, axis=0), stated, rtol=0.25)
    assert np.mean(np.sqrt(np.mean(np.abs(check) ** 2, axis=1)) < c.check_rms) > 0.93


# weights of readings, limits, ridge, removal


@each_of("options", [{"method": m} for m in ("least-squares", "weighted", "minmax")] + [{"strength": 0.05}])
def test_a_reading_of_weight_zero_is_as_if_it_were_not_there(options):
    trials, _ = rotor(0, outside=0.2)
    rows = np.ones((3, 4))
    rows[:, 3] = 0
    influence = estimate_influence(trials)
    found = correct(influence, row_weights=rows, **options)
    direct = correct(influence.part([0, 1, 2], [0, 1, 2]), **options)
    assert np.allclose(found.weights, direct.weights, rtol=1e-6)
    assert found.conditioning.condition_number == pytest.approx(direct.conditioning.condition_number)
    if "strength" not in options:
        assert np.allclose(found.mass_std, direct.mass_std, rtol=0.15)


@pytest.mark.parametrize("method", ["least-squares", "weighted", "minmax"])
def test_limits_are_kept_and_their_errors_are_drawn(method):
    trials, _ = rotor(0)
    influence = estimate_influence(trials)
    free = correct(influence, method=method)
    most, arc = 0.8 * abs(free.weights[0]), (float(np.angle(free.weights[1]) - 0.2), 0.5)
    limits = limits_by_name(influence, max_weight={"A": most}, forbidden={"B": [arc]})
    c = correct(influence, method=method, limits=limits)
    assert abs(c.weights[0]) <= most * (1 + 1e-9)
    turn = np.mod(np.angle(c.weights[1]) - arc[0], 2 * np.pi)
    assert turn >= 0.5 - 1e-6 or turn <= 1e-6 or turn >= 2 * np.pi - 1e-6
    assert len(c.active) == 2
    assert c.held.tolist() == [method == "weighted", False]
    assert c.mass_std[0] < 0.2 * free.mass_std[0]
    assert np.isfinite(c.covariance).all()
    assert (np.abs(c.draws[:, 0]) <= most * (1 + 1e-6)).all()
    loose = limits_by_name(influence, max_weight={"A": 100.0})
    assert np.allclose(correct(influence, method=method, limits=loose).weights, free.weights, rtol=1e-6)


def test_where_material_is_taken_away_the_place_is_opposite():
    c = correct(estimate_influence(bruel_kjaer()), remove=["A"])
    row, other = c.to_dict()["corrections"]
    assert (row["action"], row["remove_at_deg"]) == ("remove", pytest.approx((row["angle_deg"] + 180) % 360))
    assert (other["action"], other["remove_at_deg"]) == ("add", None)


# a baseline of another day


def test_runs_with_weights_serve_as_baseline_of_known_coefficients():
    """Y₀ = Y − W T: the total weights do not depend on what is mounted in the new run."""
    known = estimate_influence(bruel_kjaer(errors=ReadingErrors(0.02, 0.02)))
    T = np.array([[0.7, 0.2j]]) * GRAM
    reading = known.baseline + known.W @ T[0]
    new = Trials(("now",), known.speeds, known.sensors[::-1], known.planes, reading[None, :, ::-1], T)
    c = correct(known, new)
    assert np.allclose(c.weights, correct(known).weights)
    assert np.allclose(c.to_add, c.weights - T[0])
    assert c.region_known
    bare = correct(stored(known.W), known.baseline)
    assert np.allclose(bare.weights, c.weights)
    assert not bare.mounted.weights.any()


# refusals


def test_stated_errors_refuse_what_assumed_ones_only_warn_of():
    rng = np.random.default_rng(24)
    W, Y0 = complex_normal(rng, (8, 2)), complex_normal(rng, 8)
    W[:, 1] = (0.5 + 1j) * W[:, 0] + 0.01 * complex_normal(rng, 8)
    T = np.vstack((np.zeros(2), np.eye(2)))
    runs = job(Y0 + T @ W.T, T)
    assert "act alike" in plain(runs).answer.whole()
    stated = replace(runs, errors=ReadingErrors(0.02, 0.02))
    with pytest.raises(UndeterminedError, match=r"act alike .*\nInstead: weights in '[AB]' alone"):
        plain(stated)
    assert plain(stated, refuse=False).weights.size == 2


@each_of(
    "options, words",
    [
        ({"strength": 0.1, "method": "minmax"}, "least squares without limits only"),
        ({"row_weights": np.ones(3)}, "shape"),
        ({"row_weights": np.zeros((1, 2))}, "not all zero"),
        ({"planes": ["X"]}, "there is no plane 'X'"),
        ({"speeds": [120.0]}, "there are no coefficients at"),
        ({"baseline": np.zeros((1, 2))}, "there is nothing to balance"),
    ],
)
def test_what_cannot_be(options, words):
    with pytest.raises(ValueError, match=words):
        correct(estimate_influence(bruel_kjaer()), **options)


@each_of(
    "options, words",
    [
        ({}, "give the readings of a baseline run"),
        ({"baseline": np.ones((1, 3)), "method": "weighted"}, "needs errors of the readings"),
    ],
)
def test_stored_coefficients_need_a_baseline_and_a_weighted_fit_errors(options, words):
    with pytest.raises(ValueError, match=words):
        correct(stored(complex_normal(np.random.default_rng(0), (1, 3, 2))), **options)
