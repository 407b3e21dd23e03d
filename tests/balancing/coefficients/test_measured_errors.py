"""Errors of readings as an instrument measured them, of each reading its own, go through to the weights."""

from dataclasses import replace

import numpy as np
import pytest
from balancing_data import GRAM, complex_normal, job, noisy, synthetic

from balancing import ReadingErrors, correct, estimate_influence
from balancing.correction.check_run import compare_check
from balancing.correction.mount_decision import coarse
from balancing.correction.refine_coefficients import together
from balancing.correction.verdict import verdict_of_check
from balancing.data.limits import Limits
from balancing.data.reading_errors import error_model, mean_covariance, turned
from balancing.data.trials import RunScatter, Trials
from rotorid.tables.runs.slow_roll import SlowRoll, subtract_slow_roll

STEADY = RunScatter(0.0, 1e-9)
"""Runs that differ by hardly anything but their readings."""


def measured(trials, along, across=None):
    """The same trials with standard deviations of each reading, along and across it."""
    along = np.broadcast_to(along, trials.readings.shape)
    across = along if across is None else np.broadcast_to(across, trials.readings.shape)
    covariance = np.moveaxis(turned(trials.readings, along**2, across**2), (-2, -1), (0, 1))
    return replace(trials, covariance=covariance)


def drawn(rng, Y, along, across):
    a, b = rng.standard_normal((2, *Y.shape))
    return Y + Y / np.abs(Y) * (a * along + 1j * b * across)


@pytest.fixture
def exact():
    return synthetic(np.random.default_rng(11))[0]


def test_equal_ones_say_what_a_stated_floor_says(exact):
    trials = replace(exact, run_errors=STEADY)
    stated = correct(estimate_influence(replace(trials, errors=ReadingErrors(floor=0.03))))
    own = correct(estimate_influence(measured(trials, 0.03)))
    assert (stated.error_source, own.error_source) == ("stated", "measured")
    np.testing.assert_allclose(own.weights, stated.weights, rtol=1e-12)
    for name in ("covariance", "after_covariance"):
        expected = getattr(stated, name)
        np.testing.assert_allclose(getattr(own, name), expected, atol=1e-9 * np.abs(expected).max())
    assert own.errors.floor == pytest.approx(0.03, rel=1e-12)
    assert not any("assumed" in line for line in own.summary().splitlines() if "reading" in line)
    document = own.to_dict()["errors"]
    assert (document["source"], document["floor"]) == ("measured", pytest.approx(0.03))
    assert "root mean square of those that the instrument measured" in " ".join(own.answer.whole().split())


def test_stated_errors_add_to_them(exact):
    both = measured(replace(exact, errors=ReadingErrors(floor=0.04)), 0.03)
    model = error_model(both)
    assert model.source == "stated"
    expected = np.broadcast_to(0.05**2 * np.eye(2), (*both.mean.shape, 2, 2))
    np.testing.assert_allclose(mean_covariance(both, model), expected, atol=1e-15)


def test_repeats_average_them_and_digits_do_not(exact):
    rng = np.random.default_rng(3)
    four = drawn(rng, np.repeat(exact.readings, 4, axis=0), 0.03, 0.03)
    trials = measured(replace(exact, readings=four, steps=None), 0.03)
    model = error_model(trials)
    assert (model.source, model.dof) == ("measured", None)
    np.testing.assert_allclose(np.trace(mean_covariance(trials, model)[0, 0, 0]) / 2, 0.015**2, rtol=1e-12)
    step = np.sqrt(12) * 0.02
    rounded = replace(trials, steps=np.stack((np.full(four.shape, step), step / np.abs(four))))
    np.testing.assert_allclose(
        np.trace(mean_covariance(rounded, model)[0, 0, 0]) / 2, 0.015**2 + 0.02**2, rtol=0.01
    )


def test_repeats_that_scatter_more_are_added(exact):
    rng = np.random.default_rng(4)
    four = drawn(rng, np.repeat(exact.readings, 4, axis=0), 0.1, 0.1)
    model = error_model(measured(replace(exact, readings=four), 0.01))
    assert model.source == "repeats"
    assert "times as much as the measured standard deviations: their scatter was added" in model.warnings[0]
    ratio = float(model.warnings[0].split("scatter ")[1].split(" times")[0])
    assert 9 < ratio < 11


def test_directions_of_repeats_count(exact):
    """Scatter across alone is explained where that was measured across, and not where it was along."""
    rng = np.random.default_rng(5)
    eight = drawn(rng, np.repeat(exact.readings, 8, axis=0), 0.001, 0.05)
    right, wrong = ((0.001, 0.05), (0.05, 0.001))
    made = replace(exact, readings=eight)
    assert error_model(measured(made, *right)).source == "measured"
    assert error_model(measured(made, *wrong)).source == "repeats"


def test_digits_are_not_coarse_where_errors_are_large(exact):
    """One digit is about how readings are written, not about how noisy they are."""
    steps = np.full((2, *exact.readings.shape), 1e-6)
    trials = measured(replace(exact, steps=steps, run_errors=STEADY), np.abs(exact.readings))
    found = estimate_influence(replace(measured(trials, 1e-3), steps=steps))
    assert coarse(replace(found, trials=trials)) == ()


def test_slow_roll_leaves_them_as_they_are(exact):
    trials = measured(exact, 0.01, 0.05)
    vectors = complex_normal(np.random.default_rng(1), len(exact.sensors))
    left = subtract_slow_roll(trials, SlowRoll(exact.sensors, vectors))
    np.testing.assert_array_equal(left.covariance, trials.covariance)
    assert error_model(left).source == "measured"


def check_of(exact, W, Y0, weights, **options):
    after = (Y0 + W @ weights)[None]
    check = job(after, np.zeros((1, 2)), speeds=exact.speeds, sensors=exact.sensors, **options)
    return replace(check, planes=exact.planes, weights=weights[None])


def test_a_check_run_has_its_own():
    rng = np.random.default_rng(8)
    exact, W, Y0 = synthetic(rng)
    trials = measured(replace(exact, run_errors=STEADY), 1e-6)
    influence = estimate_influence(trials)
    found = correct(influence)
    check = check_of(exact, W, Y0, np.array([1.0, 2.0j]) * GRAM)
    size = np.abs(check.readings) * 0.3 + 0.1
    off = replace(check, readings=check.readings + size)
    exactly = compare_check(found, measured(off, size, size), influence)
    expected = np.sum(size**2 / (size**2 + 1e-12))
    assert exactly.chi_square == pytest.approx(expected, rel=1e-3)
    assert exactly.explained
    assert not compare_check(found, off, influence).explained
    np.testing.assert_allclose(
        exactly.covariance[0], np.einsum("sc,ij->scij", size[0, 0] ** 2, np.eye(2)), atol=1e-9
    )


def test_a_verdict_has_those_of_its_run():
    rng = np.random.default_rng(9)
    exact, W, Y0 = synthetic(rng)
    influence = estimate_influence(measured(replace(exact, run_errors=STEADY), 1e-6))
    check = check_of(exact, W, Y0, np.array([1.0, 2.0j]) * GRAM)
    two = Trials(
        ("first", "last"),
        check.speeds,
        check.sensors,
        (),
        np.repeat(check.readings, 2, axis=1),
        np.zeros((2, 0)),
    )
    along = np.abs(two.readings) * np.array([1.0, 0.01])[None, :, None, None]
    limits = Limits(np.full(2, np.inf), np.full(check.mean.shape[1:], 100.0), ((), ()))
    high = [
        [
            row.high - row.size
            for row in verdict_of_check(influence, measured(two, along), run=r, limits=limits).rows
        ]
        for r in (0, 1)
    ]
    np.testing.assert_allclose(high[0], 100 * np.array(high[1]), rtol=1e-3)


def test_joined_runs_keep_them():
    rng = np.random.default_rng(10)
    exact, W, Y0 = synthetic(rng)
    trials = measured(exact, 0.01, 0.03)
    weights = np.array([1.0, 2.0j]) * GRAM
    check = check_of(exact, W, Y0, weights, runs=("check",))
    joint = together(trials, measured(check, 0.5))
    np.testing.assert_array_equal(joint.covariance[:, :, :, :3], trials.covariance)
    np.testing.assert_allclose(joint.covariance[0, 0, 0, 3], 0.25)
    typed = together(trials, check)  # has the mean variance of the others
    np.testing.assert_allclose(typed.covariance[[0, 1], [0, 1], 0, 3], (0.01**2 + 0.03**2) / 2)
    stated = together(replace(trials, errors=ReadingErrors(0.01)), replace(check, errors=ReadingErrors(0.01)))
    assert not stated.covariance[:, :, 0, 3].any()  # what is stated is all there is
    assert together(exact, check).covariance is None


def test_what_is_impossible(exact):
    with pytest.raises(ValueError, match="covariance must be finite, of shape"):
        replace(exact, covariance=np.zeros((2, *exact.readings.shape)))
    with pytest.raises(ValueError, match="covariance must be finite, of shape"):
        replace(exact, covariance=np.full((2, 2, *exact.readings.shape), np.nan))


def test_same_weights_twice_are_asked_about_only_beyond_them():
    rng = np.random.default_rng(12)
    exact = synthetic(rng, weights=np.array([[0, 0], [1, 0], [0, 1], [0, 0]]) * GRAM)[0]
    errors = ReadingErrors(0.02, 0.02)
    trials = replace(exact, readings=noisy(rng, exact.readings, ReadingErrors(0.2, 0.2)), errors=errors)
    asked = "have the same weights mounted but differ"
    assert any(asked in words for words in estimate_influence(trials).warnings)
    own = measured(trials, 0.3 * np.abs(trials.readings))
    assert not any(asked in words for words in estimate_influence(own).warnings)
