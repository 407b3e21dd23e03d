"""Measured and computed coefficients together."""

from dataclasses import replace

import numpy as np
import pytest
from balancing_data import GRAM, complex_normal, job, synthetic

from balancing import Influence, Labels, ReadingErrors, correct, estimate_influence
from balancing.coefficients.combined_coefficients import combine

ERRORS = ReadingErrors(0.03, 0.03)


def model(W, error, planes="AB", sensors=("s0", "s1", "s2", "s3"), speeds=(100.0, 200.0, 300.0), unit="g"):
    """Computed coefficients with a covariance as `model_influence` makes it."""
    S, C, P = W.shape
    covariance = np.zeros((S, C, 2 * P + 2, 2 * P + 2))
    own = np.arange(2, 2 * P + 2)
    covariance[..., own, own] = np.repeat((error * np.abs(W)) ** 2, 2, axis=-1)
    return Influence(
        np.array(speeds), sensors, tuple(planes), W, covariance=covariance, labels=Labels(weight_unit=unit)
    )


def test_one_number_is_the_mean_weighted_by_precision():
    made, W, _ = synthetic(np.random.default_rng(0), planes=1, sensors=1, speeds=1, errors=ERRORS)
    measured = estimate_influence(made)
    computed = model(1.02 * W, 0.05, "A", ("s0",), (100.0,))
    found = combine(measured, computed)
    variance = measured.covariance[0, 0, 2, 2], (0.05 * 1.02 * abs(W[0, 0, 0])) ** 2
    np.testing.assert_allclose(
        measured.covariance[0, 0, 2:, 2:], variance[0] * np.eye(2), atol=1e-9 * variance[0]
    )
    total = 1 / variance[0] + 1 / variance[1]
    expected = (measured.W / variance[0] + computed.W / variance[1]) / total
    np.testing.assert_allclose(found.W, expected, rtol=1e-12)
    np.testing.assert_allclose(
        found.covariance[0, 0, 2:, 2:], np.eye(2) / total, rtol=1e-9, atol=1e-9 / total
    )
    assert found.warnings == measured.warnings
    assert (found.errors, found.error_source, found.labels) == (ERRORS, "stated", measured.labels)


def test_same_as_one_least_squares_problem():
    """Trial runs and the model as rows of one problem, weighted by their errors."""
    rng = np.random.default_rng(8)
    floor = ReadingErrors(floor=0.1)  # alike for all readings: then nothing depends on their size
    made, W, _ = synthetic(rng, errors=floor)
    made = replace(made, readings=made.readings + 0.1 * complex_normal(rng, made.readings.shape))
    computed = model(W * (1 + 0.1 * complex_normal(rng, W.shape)), 0.1)
    found = combine(estimate_influence(made), computed)
    for s, c in np.ndindex(W.shape[:2]):
        sigma = 0.1 * np.abs(computed.W[s, c])
        rows = np.column_stack((np.ones(3), made.weights)) / 0.1
        K = np.vstack((rows, np.column_stack((np.zeros(2), np.diag(1 / sigma)))))
        y = np.concatenate((made.mean[:, s, c] / 0.1, computed.W[s, c] / sigma))
        inverse = np.linalg.inv(K.conj().T @ K)
        theta = inverse @ K.conj().T @ y
        np.testing.assert_allclose(np.r_[found.baseline[s, c], found.W[s, c]], theta, rtol=1e-9)
        variance = np.diag(found.covariance[s, c])
        np.testing.assert_allclose(variance, np.repeat(np.diag(inverse).real, 2), rtol=1e-9)


def test_contradictions_are_named():
    made, W, _ = synthetic(np.random.default_rng(2), errors=ERRORS)
    wrong = W.copy()
    wrong[1, 2, 1] *= 3
    measured = estimate_influence(made)
    computed = model(wrong, 0.1)
    [words] = [w for w in combine(measured, computed).warnings if w not in measured.warnings]
    S = measured.covariance[1, 2, 4:, 4:] + computed.covariance[1, 2, 4:, 4:]
    d = np.array([W[1, 2, 1] - wrong[1, 2, 1]]).view(float)
    ratio = np.sqrt(d @ np.linalg.solve(S, d) / 2)
    assert words == (
        f"measured and computed coefficient of plane 'B' at sensor 's2', 1909.86 rpm, differ by {ratio:.2g} "
        "times their errors: the model, the trial runs or the stated errors are wrong"
    )
    turned = [w for w in combine(measured, model(-W, 0.1)).warnings if w not in measured.warnings]
    assert len(turned) == 3
    assert "; so do " in turned[-1]
    assert turned[-1].endswith("of 24: the model, the trial runs or the stated errors are wrong")


def test_a_plane_that_only_the_model_has():
    rng = np.random.default_rng(3)
    made, W, Y0 = synthetic(rng, planes=3)
    two = job(Y0 + np.einsum("scp,rp->rsc", W[..., :2], np.vstack((np.zeros(2), np.eye(2))) * GRAM),
              np.vstack((np.zeros(2), np.eye(2))) * GRAM, errors=ERRORS, speeds=made.speeds)  # fmt: skip
    measured = estimate_influence(two)
    found = combine(measured, model(W[..., [2, 0]], 0.1, "CA"))
    assert found.planes == ("A", "B", "C")
    np.testing.assert_allclose(found.W, W, rtol=1e-9)
    np.testing.assert_allclose(found.covariance[..., 6, 6], (0.1 * np.abs(W[..., 2])) ** 2, rtol=1e-9)
    assert (found.covariance[..., 2, 2] < measured.covariance[..., 2, 2]).all()
    np.testing.assert_array_equal(found.last_weights, [0, GRAM, 0])
    expected = np.linalg.lstsq(W.reshape(-1, 3), -Y0.ravel(), rcond=None)[0]
    np.testing.assert_allclose(correct(found, method="least-squares").weights, expected, rtol=1e-6)
    # the trial of B shares its baseline with that of A, which the model now knows better
    assert (found.covariance[..., 4, 4] < measured.covariance[..., 4, 4]).all()


def test_a_sensor_and_a_speed_that_only_one_has():
    made, W, _ = synthetic(np.random.default_rng(4), errors=ERRORS)
    measured = estimate_influence(made)
    extra = np.concatenate((W[:, :1], W[:, :1] * 2), axis=1)
    found = combine(measured, model(extra, 0.1, sensors=("s0", "new"), speeds=(100.2, 200.0, 300.0)))
    assert found.sensors == ("s0", "s1", "s2", "s3", "new")
    np.testing.assert_array_equal(found.speeds, measured.speeds)
    np.testing.assert_allclose(found.W[:, :4], W, rtol=1e-9)
    np.testing.assert_allclose(found.W[:, 4], extra[:, 1], rtol=1e-9)
    assert found.baseline is None
    assert found.warnings[-1].endswith("give the readings of a baseline run")
    later = combine(measured, model(W[:1] * 3, 0.1, speeds=(150.0,)))
    np.testing.assert_array_equal(later.speeds, [100, 150, 200, 300])
    np.testing.assert_allclose(later.W[1], 3 * W[0], rtol=1e-12)


def test_stored_coefficients_without_a_baseline():
    made, W, _ = synthetic(np.random.default_rng(4), errors=ERRORS)
    stored = replace(estimate_influence(made), baseline=None, last_run=None, last_weights=None)
    found = combine(stored, model(W, 0.1))
    assert (found.baseline, found.last_weights, found.warnings) == (None, None, stored.warnings)
    np.testing.assert_allclose(found.W, W, rtol=1e-9)


def test_what_cannot_be_combined():
    made, W, _ = synthetic(np.random.default_rng(6), errors=ERRORS)
    measured, computed = estimate_influence(made), model(W, 0.1)
    with pytest.raises(ValueError, match="measured coefficients are not known: state the errors"):
        combine(replace(measured, covariance=None, errors=None), computed)
    with pytest.raises(ValueError, match="state the relative error of the model"):
        combine(measured, replace(computed, covariance=None))
    with pytest.raises(ValueError, match=r"per mass \(g\) and .* per unbalance \(kg_m\): give the radii"):
        combine(measured, model(W, 0.1, unit="kg_m"))
    per_unbalance = replace(measured, labels=replace(measured.labels, weight_unit="g_mm"))
    with pytest.raises(ValueError, match="per unbalance, without radii"):
        combine(per_unbalance, computed)
    with pytest.raises(
        ValueError, match="neither a measured nor a computed coefficient of plane 'C' at sensor 's1'"
    ):
        combine(measured, model(W[:, :1, :1], 0.1, "C", ("s0",)))
    with pytest.raises(ValueError, match="two computed speeds"):
        combine(measured, model(W[:2], 0.1, speeds=(100.0, 100.1)))
