"""Runs that contradict each other, and planes that only errors tell apart: refused or questioned, by name."""

from dataclasses import replace

import numpy as np
import pytest
from balancing_data import GRAM, bruel_kjaer, complex_normal, job, noisy, polar
from cases import each_of

from balancing import Influence, ReadingErrors, Trials, UndeterminedError, correct, estimate_influence
from balancing.coefficients.identifiability import resolution

ERRORS = ReadingErrors(0.01, 0.01)


def stored(influence):
    return Influence(
        influence.speeds, influence.sensors, influence.planes, influence.W, labels=influence.labels
    )


def without_weights(trials, runs, errors=None):
    index = [trials.runs.index(r) for r in runs]
    mounted = np.zeros((len(runs), 0))
    return Trials(runs, trials.speeds, trials.sensors, (), trials.readings[:, index], mounted, errors)


@pytest.mark.parametrize("errors", [None, ERRORS])
def test_trial_runs_without_their_weights_are_no_baseline(errors):
    trials = bruel_kjaer()
    known = stored(estimate_influence(trials))
    with pytest.raises(UndeterminedError, match=r"runs 'run 0' and 'run [12]'") as caught:
        correct(known, without_weights(trials, ("run 0", "run 1", "run 2"), errors))
    assert "give the weights table or keep only the baseline run" in str(caught.value)
    alone = correct(known, without_weights(trials, ("run 0",), errors))
    np.testing.assert_allclose(alone.weights, correct(estimate_influence(trials)).weights)


def test_repeated_baselines_that_agree_are_averaged():
    known = stored(estimate_influence(bruel_kjaer()))
    Y = estimate_influence(bruel_kjaer()).baseline
    for second, errors in ((Y * 1.05, None), (Y * 1.005, ERRORS)):
        two = Trials(("a", "b"), known.speeds, known.sensors, (), [Y, second], np.zeros((2, 0)), errors)
        np.testing.assert_allclose(correct(known, two).before, (Y + second) / 2)
    with pytest.raises(UndeterminedError, match="times the errors of the readings"):
        correct(known, Trials(("a", "b"), known.speeds, known.sensors, (), [Y, 1.1 * Y], two.weights, ERRORS))


def test_runs_with_weights_that_imply_different_baselines_are_questioned():
    trials = bruel_kjaer()
    known = stored(estimate_influence(trials))
    assert not any("imply" in w for w in correct(known, trials).warnings)
    wrong = Trials(
        trials.runs, trials.speeds, trials.sensors, trials.planes, trials.readings, 2 * trials.weights
    )
    words = " ".join(correct(known, wrong).warnings)
    assert "imply vibrations of the bare rotor that differ by" in words


def test_a_forgotten_row_of_the_weights_table_is_asked_for():
    readings = [[polar(7.2, 238), 1.0], [polar(90, 114), 9.0], [polar(5.4, 238), 1.0]]
    T = [[0], [2.5 * GRAM], [0]]
    question = "runs 'run 0' and 'run 2' have the same weights mounted but differ by 25 %"
    [words] = [w for w in estimate_influence(job(readings, T)).warnings if "same weights" in w]
    assert words == question + "; is a row missing in the weights table?"
    with_errors = estimate_influence(job(readings, T, errors=ERRORS)).warnings
    assert any("differ by" in w and "times the errors of the readings" in w for w in with_errors)


@each_of(
    ("change", "errors", "asked"),
    [
        (1.18, None, False),
        (1.30, None, True),
        (np.exp(0.15j), None, False),
        (np.exp(0.25j), None, True),
        (1.03, ERRORS, False),
        (1.06, ERRORS, True),
        (np.exp(0.06j), ReadingErrors(amplitude=0.01), True),
        (np.exp(0.02j), ReadingErrors(amplitude=0.01), False),
    ],
)
def test_when_runs_of_one_state_differ(change, errors, asked):
    trials = job([[1.0, 0.01], [3.0, 0.5], [change, 0.01]], [[0], [GRAM], [0]], errors=errors)
    found = [w for w in estimate_influence(trials).warnings if "same weights mounted" in w]
    assert bool(found) is asked


def test_a_disagreement_is_told_with_the_refusal_that_it_causes():
    trials = bruel_kjaer()
    readings = np.concatenate((trials.readings[0], 12 * trials.readings[0, :1]))
    with pytest.raises(UndeterminedError) as caught:
        correct(estimate_influence(job(readings, np.concatenate((trials.weights, [[0, 0]])))))
    assert str(caught.value).startswith("runs 'run 0' and 'run 3' have the same weights mounted")


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


def test_assumed_errors_warn_and_digits_refuse():
    rng = np.random.default_rng(24)
    W, Y0 = dependent(rng, 2, readings=8, apart=0.01)
    T = np.vstack((np.zeros(2), np.eye(2)))
    runs = job(Y0 + T @ W.T, T)
    influence = estimate_influence(runs)
    assert influence.error_source == "assumed"
    assert "act alike" in correct(influence, method="least-squares").summary()
    # digits so coarse that they alone hide the difference
    for step, refused in ((1e-6, False), (0.3, True)):
        steps = np.stack((np.full(runs.mean.shape, step), np.zeros(runs.mean.shape)))
        rounded = estimate_influence(replace(runs, steps=steps))
        if refused:
            with pytest.raises(UndeterminedError, match="act alike"):
                correct(rounded, method="least-squares")
        else:
            assert "act alike" in correct(rounded, method="least-squares").summary()


def test_the_statistic_is_chi_square():
    rng = np.random.default_rng(22)
    W, Y0 = dependent(rng, 3, readings=10)
    found = []
    for _ in range(300):
        influence = estimate_influence(simulated(rng, W, Y0, ERRORS))
        found.append(resolution(influence.W[0], influence.covariance[0][:, 2:, 2:]))
    assert found[0].n == 2 * (10 - 2)
    # the mean of 300 values has a standard deviation of √(2/16/300) = 2 %
    assert np.mean([f.chi_square / f.n for f in found]) == pytest.approx(1.0, abs=0.08)


def test_without_known_errors_a_hopeless_condition_is_refused():
    rng = np.random.default_rng(23)
    W, Y0 = dependent(rng, 2, apart=1e-5)
    T = np.vstack((np.zeros(2), np.eye(2)))
    measured = estimate_influence(job(Y0 + T @ W.T, T))
    with pytest.raises(UndeterminedError, match="no instrument supports a condition number of") as caught:
        correct(measured)
    assert "planes 'A' and 'B' act alike at every sensor and speed" in str(caught.value)
    # nobody measured stored ones here: they may be exact
    c = correct(stored(measured), measured.baseline)
    assert c.condition_number > 1e3
    assert "planes 'A' and 'B' act alike" in c.summary() or "act nearly alike" in c.summary()
    W, Y0 = dependent(rng, 2, apart=0.01)
    assert 100 < correct(estimate_influence(job(Y0 + T @ W.T, T))).condition_number < 1e3


def test_what_rounding_leaves_has_no_direction():
    c = correct(estimate_influence(bruel_kjaer()))
    for row in c.to_dict()["residuals"]:
        assert (row["after"], row["after_phase_deg"]) == (0.0, None)
    assert c.to_dict()["rms_after"] == 0.0
    assert c.residuals_frame()["after_phase_deg"].isna().all()
    assert c.residuals_frame()["after_phase_deg"].dtype == float


def test_covariances_are_symmetric_to_the_last_digit():
    rng = np.random.default_rng(24)
    W, Y0 = complex_normal(rng, (6, 2)), complex_normal(rng, 6)
    influence = estimate_influence(simulated(rng, W, Y0, ReadingErrors(0.02, 0.001)))
    c = correct(influence)
    for covariance in (influence.covariance, c.covariance, c.after_covariance):
        np.testing.assert_array_equal(covariance, np.swapaxes(covariance, -1, -2))


def test_runs_without_trial_weights_determine_nothing():
    trials = bruel_kjaer()
    with pytest.raises(UndeterminedError, match="no run has a trial weight"):
        estimate_influence(without_weights(trials, trials.runs))
