"""Errors of the readings: where they come from, and how they go through to the weights and to a check run."""

from dataclasses import replace

import numpy as np
import pytest
from balancing_data import GRAM, bruel_kjaer, complex_normal, job, noisy, synthetic

from balancing import Influence, Labels, ReadingErrors, correct, estimate_influence
from balancing.data.reading_errors import ASSUMED, error_model, reading_covariance
from balancing.data.trials import RunScatter
from balancing.solvers.error_propagation import correction_jacobian, prediction_covariance
from rotorid.regression import stretch
from rotorid.samples import sample_data
from rotorid.tables import read_job

ERRORS = ReadingErrors(amplitude=0.006, phase=np.deg2rad(0.2), floor=0.001)


def best(Y0, W):
    """Corrections (…, P) by complex pseudo-inverse, for stacks of jobs."""
    return -np.einsum("...pn,...n->...p", np.linalg.pinv(W), Y0)


def test_the_covariance_of_a_reading():
    rng = np.random.default_rng(3)
    Y = np.array([2.0 + 1j, -0.3 + 0.5j])
    draws = noisy(rng, Y, ERRORS, (40000,)) - Y
    real = np.stack((draws.real, draws.imag), axis=-1)
    for i in range(2):
        found = np.cov(real[:, i].T)
        expected = reading_covariance(Y[i], ERRORS)
        np.testing.assert_allclose(found, expected, atol=0.03 * np.trace(expected))


def test_a_reading_of_zero_has_only_the_floor():
    np.testing.assert_allclose(reading_covariance(0.0, ERRORS), np.eye(2) * ERRORS.floor**2)


def test_the_jacobian_against_finite_differences():
    """Including the term with the residual, which is far from zero here."""
    rng = np.random.default_rng(5)
    W, Y0 = complex_normal(rng, (6, 2)), complex_normal(rng, 6)
    D = best(Y0, W)
    r = Y0 + W @ D
    assert np.linalg.norm(r) > 0.3 * np.linalg.norm(Y0)
    J = correction_jacobian(W, D, r)
    h = 1e-6
    for n in range(6):
        for k in range(6):
            direction = np.zeros(6)
            direction[k] = h
            d = direction[::2] + 1j * direction[1::2]
            change = []
            for sign in (1, -1):
                Ys, Ws = Y0.copy(), W.copy()
                Ys[n] += sign * d[0]
                Ws[n] += sign * d[1:]
                change.append(stretch(best(Ys, Ws)))
            np.testing.assert_allclose(J[n, :, k], (change[0] - change[1]) / (2 * h), atol=1e-8)


def test_the_stated_covariance_against_simulated_jobs():
    """Standard deviations within 4 % of those of 6000 simulated jobs (statistical: 0.9 %)."""
    rng = np.random.default_rng(8)
    trials, W, Y0 = synthetic(rng, planes=2, sensors=3, speeds=2, errors=ERRORS)
    exact = trials.readings[0]
    draws = noisy(rng, exact, ERRORS, (6000,)).reshape(6000, 3, 6)
    w = np.moveaxis(draws[:, 1:] - draws[:, :1], 1, 2) / GRAM
    D = best(draws[:, 0], w)
    real = np.stack((D.real, D.imag), axis=-1).reshape(6000, 4)
    c = correct(estimate_influence(trials), method="least-squares")
    np.testing.assert_allclose(real.std(axis=0), np.sqrt(np.diag(c.covariance)), rtol=0.04)
    np.testing.assert_allclose(np.cov(real.T), c.covariance, atol=0.05 * np.diag(c.covariance).max())
    np.testing.assert_allclose(np.abs(D).std(axis=0), c.mass_std, rtol=0.04)
    angle = np.angle(D / c.weights)
    np.testing.assert_allclose(angle.std(axis=0), c.angle_std, rtol=0.04)
    # a check run: the true rotor, each job's own weights, and a reading with its own error
    check = Y0.ravel() + np.einsum("np,kp->kn", W.reshape(6, 2), D)
    check = noisy(rng, check, ERRORS)
    predicted = draws[:, 0] + np.einsum("knp,kp->kn", w, D)
    difference = check - predicted
    real = np.stack((difference.real, difference.imag), axis=-1)
    stated = c.after_covariance.reshape(6, 2, 2)
    distance = np.einsum("kni,nij,knj->kn", real, np.linalg.inv(stated), real)
    np.testing.assert_allclose(np.mean(distance < 5.991, axis=0), 0.95, atol=0.015)


def test_the_mean_of_repeats_has_less_variance():
    single = bruel_kjaer(errors=ERRORS)
    many = bruel_kjaer(errors=ERRORS)
    four = job(np.repeat(many.readings, 4, axis=0), many.weights, errors=ERRORS)
    a, b = (correct(estimate_influence(t), method="least-squares") for t in (single, four))
    np.testing.assert_allclose(b.covariance, a.covariance / 4, rtol=1e-9)


def test_repeats_give_the_errors_where_none_are_stated():
    rng = np.random.default_rng(12)
    true = ReadingErrors(0.02, 0.01)
    exact, _, _ = synthetic(rng)
    readings = noisy(rng, exact.readings[0], true, (30,))
    readings[20:, 0] = np.nan  # fewer repeats of the first run
    model = error_model(job(readings, exact.weights, speeds=exact.speeds))
    assert model.source == "repeats"
    assert model.dof == 12 * (2 * 29 + 19)
    # standard deviations of the estimates: 1/√(2·924) = 2.3 %
    assert model.errors.amplitude == pytest.approx(0.02, rel=0.08)
    assert model.errors.phase == pytest.approx(0.01, rel=0.08)
    trials = job(readings, exact.weights, speeds=exact.speeds)
    assert estimate_influence(trials).reading_dof == model.dof
    c = correct(estimate_influence(replace(trials, run_errors=RunScatter(0.0))))
    assert c.dof == pytest.approx(model.dof)
    assert c.coverage_factor == pytest.approx(1.9626, abs=1e-3)


@pytest.mark.parametrize(("factor", "enlarged"), [(0.3, False), (1.0, False), (3.0, True)])
def test_stated_errors_hold_unless_repeats_contradict_them(factor, enlarged):
    rng = np.random.default_rng(13)
    real = ReadingErrors(ERRORS.amplitude * factor, ERRORS.phase * factor, ERRORS.floor * factor)
    exact, _, _ = synthetic(rng)
    readings = noisy(rng, exact.readings[0], real, (5,))
    model = error_model(job(readings, exact.weights, speeds=exact.speeds, errors=ERRORS))
    if enlarged:
        assert model.errors.amplitude == pytest.approx(real.amplitude, rel=0.09)
        assert model.errors.floor / ERRORS.floor == pytest.approx(model.errors.phase / ERRORS.phase)
        assert model.dof == 2 * 4 * 36
        assert "times as much as the stated errors" in model.warnings[0]
    else:
        assert model.errors == ERRORS
        assert model.dof is None
        assert model.warnings == ()


def test_an_error_that_was_not_stated_is_taken_from_the_repeats():
    rng = np.random.default_rng(17)
    exact, _, _ = synthetic(rng)
    readings = noisy(rng, exact.readings[0], ReadingErrors(0.01, 0.02), (9,))
    stated = ReadingErrors(amplitude=0.01)
    model = error_model(job(readings, exact.weights, speeds=exact.speeds, errors=stated))
    assert model.errors.amplitude == 0.01
    assert model.errors.phase == pytest.approx(0.02, rel=0.099)
    assert "no phase error is stated; repeated readings scatter by 1.1" in model.warnings[0]
    assert model.dof == 8 * 36


def test_one_repeated_reading_does_not_refuse_a_job():
    """Errors with one degree of freedom make wide intervals, no refusal."""
    readings = np.full((2, 3, 1, 2), np.nan, dtype=complex)
    readings[0] = bruel_kjaer().readings[0]
    readings[1, 0, 0, 0] = readings[0, 0, 0, 0] * 1.03 * np.exp(0.02j)
    trials = replace(job(readings, bruel_kjaer().weights), run_errors=RunScatter(0.0))
    c = correct(estimate_influence(trials))
    assert c.dof == pytest.approx(1)
    assert c.coverage_factor == pytest.approx(12.706, abs=1e-3)


def test_equal_repeats_say_nothing_about_the_errors():
    exact = bruel_kjaer()
    model = error_model(job(np.repeat(exact.readings, 3, axis=0), exact.weights))
    assert model.source == "assumed"
    assert "equal to the last digit" in model.warnings[0]


def test_disagreeing_runs_give_the_errors_where_nothing_else_does():
    rng = np.random.default_rng(14)
    true = ReadingErrors(0.02, 0.02)
    T = np.array([[0, 0], [1, 0], [0, 1], [1, 1], [-1, 0], [0, -1], [0, 0], [1, 0]]) * GRAM
    exact, _, _ = synthetic(rng, sensors=6, speeds=4, weights=T)
    trials = job(noisy(rng, exact.readings[0], true), T, speeds=exact.speeds)
    influence = estimate_influence(trials)
    assert influence.error_source == "residuals"
    assert 100 < influence.dof < 2 * 24 * 5 * 2
    assert influence.errors.phase == influence.errors.amplitude
    run = influence.run_errors
    low, high = np.array(run.interval) / np.sqrt(np.mean(np.abs(trials.mean) ** 2))
    assert 0.017 < low < 0.02 < high < 0.024
    assert run.common < 0.3


def test_where_nobody_states_or_measures_errors_they_are_assumed_and_called_so():
    influence = estimate_influence(bruel_kjaer())
    c = correct(influence)
    assert c.errors == ASSUMED == ReadingErrors(0.02, np.deg2rad(2.0))
    assert c.error_source == influence.run_errors.origin == "assumed"
    assert influence.run_errors.sizes[0] @ influence.run_errors.sizes[0] == pytest.approx(0.02**2)
    assert "assumed, 2 % of the amplitude, 2°: state them" in " ".join(c.summary().split())
    assert "2 % of the amplitude, 2° (assumed" in c.answer.whole().replace("\n", " ")
    assert c.to_dict()["errors"]["between_runs"]["source"] == "assumed"
    assert not c.warnings
    assert "one more baseline run" in c.notes[0]


def test_stored_coefficients_without_errors_have_none():
    measured = estimate_influence(bruel_kjaer())
    stored = Influence(measured.speeds, measured.sensors, measured.planes, measured.W, measured.baseline)
    c = correct(stored)
    assert c.covariance is None
    assert c.mass_std is None
    assert c.angle_std is None
    assert c.after_covariance is None
    assert "No intervals" in c.summary()
    d = c.to_dict()
    assert d["corrections"][0]["mass_std"] is None
    assert d["corrections"][0]["covariance"] is None
    assert d["residuals"][0]["after_covariance"] is None


def test_the_angle_of_a_weight_within_its_own_error_is_not_determined():
    """The rotor is balanced already: the proposed weight is noise."""
    readings = np.array([[0.01, 0.02j], [1.0, 2.0]])
    c = correct(estimate_influence(job(readings, [[0], [GRAM]], errors=ReadingErrors(0.01, 0.01, 0.05))))
    row = c.to_dict()["corrections"][0]
    assert row["mass_std"] > row["mass"]
    assert row["angle_std_deg"] is None
    assert "angle not determined" in c.summary()
    assert c.decision.word == "do not mount"


def test_errors_in_one_direction_only():
    """Amplitude errors without phase errors make singular covariances, which are honest all the same."""
    c = correct(estimate_influence(bruel_kjaer(errors=ReadingErrors(amplitude=0.01))))
    assert np.isfinite(c.mass_std).all()
    assert np.isfinite(c.angle_std).all()
    assert (c.mass_std > 0).all()


def test_the_prediction_of_exactly_known_coefficients_has_the_error_of_the_baseline():
    covariance = np.zeros((1, 4, 4))
    covariance[0, :2, :2] = np.diag([1.0, 4.0])
    found = prediction_covariance(np.array([0.3 + 0.2j]), covariance)
    np.testing.assert_allclose(found[0], np.diag([1.0, 4.0]))


def test_covariances_are_written_as_the_job_counts_angles():
    plain = correct(estimate_influence(bruel_kjaer(errors=ERRORS)))
    labels = Labels("um_pp", 1e6, "g", 1e3, "lag", "against rotation")
    turned = correct(estimate_influence(bruel_kjaer(errors=ERRORS, labels=labels)))
    a = np.array(plain.to_dict()["corrections"][0]["covariance"])
    b = np.array(turned.to_dict()["corrections"][0]["covariance"])
    np.testing.assert_allclose(b, a * [[1, -1], [-1, 1]], rtol=1e-9)
    a = np.array(plain.to_dict()["residuals"][1]["after_covariance"])
    b = np.array(turned.to_dict()["residuals"][1]["after_covariance"])
    np.testing.assert_allclose(b, 1e12 * a * [[1, -1], [-1, 1]], rtol=1e-9)


def test_repeats_with_equal_phases_do_not_make_the_phase_exact():
    """An instrument that shows whole degrees: an error of zero would count a reading infinitely."""
    job = read_job(sample_data() / "bk_two_plane" / "job.toml")
    once = job.trials.readings[:1]
    twice = np.concatenate((once * 0.99, once * 1.01))
    model = error_model(replace(job.trials, readings=twice, errors=None, steps=None))
    assert model.errors.phase == pytest.approx(model.errors.amplitude)
    assert model.errors.amplitude == pytest.approx(0.01 * np.sqrt(2), rel=1e-9)
    assert "all repeated phases are equal" in model.warnings[0]
