"""Check runs that refine the influence coefficients, what moved by them, and what is left to add."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from balancing_data import GRAM, complex_normal, job, synthetic

from balancing import ReadingErrors, UndeterminedError, correct, estimate_influence
from balancing.coefficients.influence import estimate_like
from balancing.correction.refine_coefficients import refine
from rotorid.tables import read_job

SAMPLES = Path(__file__).parents[3] / "sample_data"
ERRORS = ReadingErrors(0.02, 0.02)


def check_of(trials, W, Y0, weights, *, noise=0.0, runs=("check",), rng=None):
    """Check runs with weights (R, P) of a rotor that is linear."""
    T = np.atleast_2d(np.asarray(weights, dtype=complex))
    readings = Y0 + np.einsum("scp,rp->rsc", W, T)
    if noise:
        readings = readings * (1 + noise * complex_normal(rng, readings.shape))
    return replace(trials, runs=runs, readings=readings[None], weights=T, warnings=())


def part_of(check, speeds, sensors):
    return replace(
        check,
        speeds=check.speeds[speeds],
        sensors=tuple(check.sensors[c] for c in sensors),
        readings=check.readings[:, :, speeds][..., sensors],
    )


def moved(influence):
    return [w for w in influence.warnings if w.startswith("the check runs move")]


def test_a_linear_rotor_keeps_its_coefficients():
    trials, W, Y0 = synthetic(np.random.default_rng(3))
    weights = np.array([[0.5, 0.2j], [-0.3, 0.1]]) * GRAM
    refined = refine(trials, check_of(trials, W, Y0, weights, runs=("first", "second")))
    np.testing.assert_allclose(refined.W, W, rtol=1e-9)
    np.testing.assert_allclose(refined.baseline, Y0, rtol=1e-9)
    assert refined.last_run == "second"
    np.testing.assert_array_equal(refined.last_weights, weights[1])
    assert moved(refined) == []


def test_least_squares_over_all_runs():
    rng = np.random.default_rng(4)
    trials, W, Y0 = synthetic(rng)
    trials = replace(
        trials, readings=trials.readings * (1 + 0.02 * complex_normal(rng, trials.readings.shape))
    )
    checks = [check_of(trials, W, Y0, [[0.5 * GRAM, k * 1j * GRAM]], noise=0.02, rng=rng) for k in (1, 2)]
    refined = refine(trials, *checks)
    T = np.concatenate([each.weights for each in (trials, *checks)])
    Y = np.concatenate([each.mean for each in (trials, *checks)])
    everything = replace(trials, runs=tuple("12345"), weights=T, readings=Y)
    np.testing.assert_array_equal(refined.W, estimate_influence(everything).W)
    off = np.concatenate((refined.baseline[..., None] - Y0[..., None], refined.W - W), axis=-1)
    std = np.sqrt(np.einsum("scii->sci", refined.covariance)[..., ::2])
    assert 0.5 < np.sqrt(np.mean(np.abs(off / std) ** 2) / 2) < 1.5
    assert refined.error_source == "residuals"  # over-determined runs tell their errors


def test_check_runs_make_coefficients_more_certain():
    rng = np.random.default_rng(5)
    trials, W, Y0 = synthetic(rng, errors=ERRORS)
    before = estimate_influence(trials)
    refined = refine(trials, check_of(trials, W, Y0, [[2 * GRAM, 1j * GRAM]]))
    old, new = (np.trace(i.covariance[..., 2:, 2:], axis1=-2, axis2=-1) for i in (before, refined))
    assert (new < old).all()


@pytest.mark.parametrize(
    ("factor", "words"),
    [
        (1.4, None),
        (1.7, "+56 % and +0°"),
        (0.4, "-58 % and +0°"),
        (np.exp(0.7j), None),
        (np.exp(0.9j), "-3 % and +48°"),
        (1.3 * np.exp(-0.9j), "+22 % and -47°"),
        (20, "more than 10 times and +0°"),
    ],
)
def test_a_coefficient_that_moves_is_named(factor, words):
    """With the weights 0, T and 2 T in three runs the last one nearly decides: W = (Y₂ − Y₀) / 2 T."""
    trials = job([[1.0, 1.0], [1.03 if factor == 20 else 1.5, 1.5j]], [[0], [GRAM]])
    old = estimate_influence(trials).W[0, :, 0]
    check = job([1 + 2 * GRAM * old * [factor, 1.0]], [[2 * GRAM]], runs=("check",))
    refined = refine(trials, check)
    np.testing.assert_allclose(refined.W[0, :, 0], old * [factor, 1.0], rtol=0.15)
    if words is None:
        assert moved(refined) == []
        assert not any("not repeatable" in w for w in refined.warnings)
        return
    named = "the check runs move the coefficient of plane 'A' on sensor 's0' at 954.93 rpm "
    (said,) = moved(refined)
    assert (said.startswith(named), said.endswith(f"by {words}")) == (True, True)
    assert refined.warnings[-1].startswith("coefficients that move by more than 50 % or 45°")


def test_a_coefficient_within_its_errors_is_called_so():
    trials = job([[1, 1], [3, 1.02]], [[0], [GRAM]], errors=ReadingErrors(floor=0.05))
    check = job([[5, 0.9]], [[2 * GRAM]], runs=("check",))
    (words,) = moved(refine(trials, check))
    assert "on sensor 's1' at 954.93 rpm (which the trial runs alone do not tell from zero) by " in words


def test_check_runs_of_some_sensors_and_speeds():
    rng = np.random.default_rng(6)
    trials, W, Y0 = synthetic(rng)
    trials = replace(
        trials, readings=trials.readings * (1 + 0.02 * complex_normal(rng, trials.readings.shape))
    )
    whole = check_of(trials, W, Y0, [[0.5 * GRAM, 1j * GRAM]], noise=0.02, rng=rng)
    alone, full = estimate_influence(trials), refine(trials, whole)
    refined = refine(trials, part_of(whole, [2, 0], [3, 1]))
    covered = np.zeros((3, 4), dtype=bool)
    covered[np.ix_([0, 2], [1, 3])] = True
    np.testing.assert_allclose(refined.W[covered], full.W[covered], rtol=0.02)
    np.testing.assert_allclose(refined.W[~covered], alone.W[~covered], rtol=1e-9)
    np.testing.assert_allclose(refined.baseline[~covered], alone.baseline[~covered], rtol=1e-9)
    assert (refined.sensors, refined.last_run) == (trials.sensors, "check")
    assert refined.covariance.shape == (3, 4, 6, 6)
    own = estimate_like(trials, refined).covariance
    np.testing.assert_array_equal(refined.covariance[~covered], own[~covered])
    assert any("sensor 's0' at 954.93 rpm, 's2' at 954.93 rpm, 's0' at 1909.86 rpm and 5 more: the" in w
               for w in refined.warnings)  # fmt: skip
    correct(refined)


def test_repeats_and_stated_errors_of_a_part():
    rng = np.random.default_rng(7)
    trials, W, Y0 = synthetic(rng, errors=ERRORS)
    check = part_of(check_of(trials, W, Y0, [[0.5 * GRAM, 1j * GRAM]]), [0], [0, 1, 2, 3])
    repeated = replace(check, readings=np.concatenate([check.readings * 1.001, check.readings * 0.999]))
    refined = refine(trials, repeated)
    np.testing.assert_allclose(refined.W, W, rtol=1e-6)
    own = estimate_like(trials, refined).covariance
    np.testing.assert_allclose(refined.covariance[1:], own[1:], rtol=1e-12)
    assert refined.errors == ERRORS


def test_names_of_runs_that_are_the_same():
    trials, W, Y0 = synthetic(np.random.default_rng(8))
    check = check_of(trials, W, Y0, [[GRAM, GRAM]], runs=("run 0",))
    assert refine(trials, check).last_run == "run 0 (check)"
    assert refine(trials, check, check).last_run == "run 0 (check 2)"


def test_check_runs_in_which_the_corrections_were_mounted():
    trials, W, Y0 = synthetic(np.random.default_rng(9))
    proposed = correct(estimate_influence(trials))
    named = dict(zip(proposed.planes, proposed.weights, strict=True))
    check = check_of(trials, W, Y0, [proposed.weights])
    silent = replace(check, planes=(), weights=np.zeros((1, 0)))
    for given in (proposed, named):
        refined = refine(trials, silent, corrections=given)
        np.testing.assert_allclose(refined.W, W, rtol=1e-9)
        np.testing.assert_array_equal(refined.last_weights, proposed.weights)
    with pytest.raises(ValueError, match="what was mounted in the check run 'check' is not known"):
        refine(trials, silent)


def test_trial_runs_that_need_the_check_runs():
    trials, W, Y0 = synthetic(np.random.default_rng(10))
    first = replace(trials, runs=trials.runs[:2], readings=trials.readings[:, :2], weights=trials.weights[:2])
    one = replace(first, planes=("A",), weights=first.weights[:, :1])
    check = check_of(trials, W, Y0, [[0, GRAM]])
    for few in (first, one):
        refined = refine(few, check)
        np.testing.assert_allclose(refined.W, W, rtol=1e-9)
    words = refine(first, check).warnings[-1]
    assert words.startswith("the trial runs alone do not determine the coefficients")
    with pytest.raises(UndeterminedError, match="no run has a weight greater than zero in plane 'B'"):
        refine(first, part_of(check, [0], [0]))
    with pytest.raises(UndeterminedError, match="only check runs have a weight in plane 'B'"):
        refine(one, part_of(check, [0], [0]))


def test_what_does_not_fit():
    trials, W, Y0 = synthetic(np.random.default_rng(11))
    check = check_of(trials, W, Y0, [[GRAM, 0]])
    with pytest.raises(ValueError, match="there is no check run"):
        refine(trials)
    with pytest.raises(ValueError, match="sensor 'x', which the trial runs do not have"):
        refine(trials, replace(check, sensors=("x", *check.sensors[1:])))
    with pytest.raises(ValueError, match=r"there are no trial runs at 9549\.3 rpm"):
        refine(trials, part_of(replace(check, speeds=np.array([1000.0, 200.0, 300.0])), [0], [0]))
    with pytest.raises(ValueError, match="no sensor and speed in common"):
        refine(trials, part_of(check, [0], [0]), part_of(check, [1], [0]))


def test_the_trim_makes_what_is_mounted_the_correction():
    trials, W, Y0 = synthetic(np.random.default_rng(12))
    off = np.array([0.4, 0.2j]) * GRAM
    result = correct(refine(trials, check_of(trials, W, Y0, [off])), method="least-squares")
    run, planes, mounted = result.mounted
    assert (run, planes) == ("check", ("A", "B"))
    np.testing.assert_array_equal(mounted, off)
    best = -np.linalg.lstsq(W.reshape(-1, 2), Y0.ravel(), rcond=None)[0]
    np.testing.assert_allclose(result.to_add, best - off, rtol=1e-8)
    one = correct(refine(trials, check_of(trials, W, Y0, [off])), planes=["B"])
    assert one.to_add[0] == -off[0]  # a plane that is not used is emptied


def test_the_turbo_job_after_its_check():
    """The check follows the prediction: nothing moves, and next to nothing is left to add."""
    read = read_job(SAMPLES / "turbo_job" / "checked.toml")
    refined = refine(read.trials, read.check)
    assert moved(refined) == []
    result = correct(refined)
    run, _, mounted = result.mounted
    assert run == "check"
    assert np.abs(result.to_add).max() < 0.05 * np.abs(mounted).max()
