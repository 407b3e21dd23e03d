"""Check runs beside their prediction, detection, words, and coefficients that they refine."""

from dataclasses import replace

import numpy as np
import pytest
from balancing_data import GRAM, bruel_kjaer, complex_normal, job, noisy, stored, synthetic
from repetitions import highest_share, lowest_share

from balancing import (
    ReadingErrors,
    compare_check,
    correct,
    estimate_influence,
    refine,
)
from balancing.check_run import with_check_runs

ERRORS = ReadingErrors(amplitude=0.02, phase=np.deg2rad(1.0))
P, C, S = 2, 4, 3


def rotor(rng):
    """W, Y0 and trial weights that change the vibration well."""
    W, Y0 = complex_normal(rng, (S, C, P)) * 1e3, complex_normal(rng, (S, C))
    return W, Y0, np.vstack((np.zeros(P), np.eye(P))) * GRAM


def runs_of(readings, weights, **options):
    return job(readings, weights, speeds=100.0 * np.arange(1, S + 1), **options)


def check_of(readings, **options):
    """A check run (or several) without weights: the proposed corrections were mounted."""
    readings = np.asarray(readings)
    readings = readings[None] if readings.ndim == 2 else readings
    return runs_of(readings, np.zeros((readings.shape[-3], 0)), **options)


def balanced(rng, W, Y0, T, *, errors=ERRORS, **options):
    """Influence and correction from noisy trial runs."""
    exact = Y0 + np.einsum("scp,rp->rsc", W, T)
    influence = estimate_influence(runs_of(noisy(rng, exact, errors), T, errors=errors, **options))
    return influence, correct(influence, refuse=False)


def test_linear_jobs_are_called_explained_and_chi_square_has_its_degrees_of_freedom():
    n, explained, sizes, distances = 60, [], [], []
    for seed in range(n):
        rng = np.random.default_rng(seed)
        W, Y0, T = rotor(rng)
        influence, correction = balanced(rng, W, Y0, T)
        check = check_of(noisy(rng, Y0 + W @ correction.weights, ERRORS), errors=ERRORS)
        comparison = compare_check(correction, check, influence)
        explained.append(comparison.explained)
        sizes.append(comparison.chi_square)
        distances.append(comparison.distance)
    assert lowest_share(n, 0.95) <= np.mean(explained) <= highest_share(n, 0.95)
    assert comparison.n == 2 * S * C
    assert np.mean(sizes) == pytest.approx(24, abs=4 * np.sqrt(48 / n))
    assert np.mean(np.array(distances) < 2.4477) == pytest.approx(0.95, abs=0.03)


def test_a_wrongly_mounted_weight_is_named():
    """The weight of plane B at the wrong angle: the change that explains it, within its error, is named."""
    rng, fine = np.random.default_rng(78), ReadingErrors(0.004, 0.004)
    W, Y0, T = rotor(rng)
    influence, correction = balanced(rng, W, Y0, T, errors=fine)
    mounted = correction.weights * np.array([1.0, np.exp(1j * np.deg2rad(60))])
    check = check_of(noisy(rng, Y0 + W @ mounted, fine), errors=fine)
    comparison = compare_check(correction, check, influence)
    assert comparison.explained is False
    delta = mounted - correction.weights
    assert np.allclose(comparison.change, delta, atol=0.06 * np.abs(delta).max())
    assert "plane 'B' had" in comparison.verdict
    assert "plane 'A'" not in comparison.verdict
    # the same check, with what was mounted in its weights table
    same = compare_check(correction, runs_of(check.readings, mounted[None], errors=fine), influence)
    assert (same.explained, same.as_proposed, same.change) == (True, False, None)


def test_the_covariance_is_that_of_a_prediction_and_a_reading():
    """B C Bᵀ of the coefficients, and the errors of a reading at what is predicted."""
    rng = np.random.default_rng(79)
    floor = ReadingErrors(floor=0.02)
    W, Y0, T = rotor(rng)
    influence, correction = balanced(rng, W, Y0, T, errors=floor)
    mounted = np.stack((correction.weights, 0.5 * correction.weights))
    check = runs_of(Y0 + np.einsum("scp,rp->rsc", W, mounted), mounted, errors=floor)
    comparison = compare_check(correction, check, influence)
    total = 0.0
    for s, c in np.ndindex(S, C):
        B = np.vstack(
            [np.hstack([[[z.real, -z.imag], [z.imag, z.real]] for z in (1.0 + 0j, *D)]) for D in mounted]
        )
        V = B @ influence.channels()[s, c] @ B.T + 0.02**2 * np.eye(4)
        z = comparison.difference[:, s, c]
        d = np.array([z[0].real, z[0].imag, z[1].real, z[1].imag])
        total += d @ np.linalg.solve(V, d)
        assert np.allclose(comparison.covariance[1, s, c], V[2:, 2:])
    assert comparison.chi_square == pytest.approx(total, rel=1e-6)
    assert comparison.n == 4 * S * C


def test_some_sensors_and_speeds_are_enough():
    rng = np.random.default_rng(81)
    influence, correction = balanced(rng, *rotor(rng))
    read = check_of(noisy(rng, correction.after, ERRORS), errors=ERRORS)
    whole = compare_check(correction, read, influence)
    readings = whole.achieved[:, [2, 0]][..., [3, 1]][None]
    part = replace(read, readings=readings, speeds=np.array([300.0, 100.0]), sensors=("s3", "s1"))
    comparison = compare_check(correction, part, influence)
    assert np.allclose(comparison.distance[0], whole.distance[0][[2, 0]][:, [3, 1]], rtol=1e-6)
    assert comparison.n == 8
    for check, words in (
        (replace(part, sensors=("s3", "x")), "no coefficients of sensor 'x'"),
        (replace(part, speeds=np.array([300.0, 250.0])), "there are no coefficients at 2387"),
        (runs_of(whole.achieved, [[GRAM]], planes=("Z",)), "in plane 'Z', for which there are no"),
    ):
        with pytest.raises(ValueError, match=words):
            compare_check(correction, check, influence)


def test_without_known_errors_there_is_no_verdict():
    measured = estimate_influence(bruel_kjaer())
    influence = stored(measured.W, measured.baseline, labels=measured.labels)
    comparison = compare_check(correct(influence), job([[0.5, 1.0]], np.zeros((1, 0))), influence)
    assert comparison.explained is comparison.chi_square is None
    assert comparison.verdict.startswith("no verdict: the errors of the readings are not known")
    document = comparison.to_dict()
    assert document["rms_predicted"] < 1e-12  # an exact solution leaves nothing
    ratio = document["rms_before"] / document["rms_achieved"]
    assert ratio == pytest.approx(np.hypot(7.2, 13.5) / np.hypot(0.5, 1.0))


# refined coefficients


def mounted(trials, W, Y0, weights, *, runs=("check",)):
    """Check runs with weights (R, P) of a rotor that is linear."""
    T = np.atleast_2d(np.asarray(weights, dtype=complex))
    readings = Y0 + np.einsum("scp,rp->rsc", W, T)
    return replace(trials, runs=runs, readings=readings[None], weights=T, warnings=())


def test_a_linear_rotor_keeps_its_coefficients():
    trials, W, Y0 = synthetic(np.random.default_rng(3))
    weights = np.array([[0.5, 0.2j], [-0.3, 0.1]]) * GRAM
    refined = refine(trials, mounted(trials, W, Y0, weights, runs=("first", "second")))
    assert np.allclose(refined.W, W, rtol=1e-9)
    assert np.allclose(refined.baseline, Y0, rtol=1e-9)
    assert refined.mounted.run == "second"
    assert np.allclose(correct(refined).to_add, correct(refined).weights - weights[1])
    assert refined.remarks.warnings == ()


def test_names_and_corrections_that_were_mounted():
    trials, W, Y0 = synthetic(np.random.default_rng(9))
    proposed = correct(estimate_influence(trials))
    silent = replace(
        mounted(trials, W, Y0, [proposed.weights], runs=("run 0",)), planes=(), weights=np.zeros((1, 0))
    )
    refined = refine(trials, silent, proposed)
    assert np.allclose(refined.W, W, rtol=1e-9)
    assert refined.mounted.run == "run 0 (check)"
    assert np.array_equal(refined.mounted.weights, proposed.weights)
    with pytest.raises(ValueError, match="what was mounted in the check run 'run 0' is not known"):
        refine(trials, silent)


def test_check_runs_that_do_not_fit():
    trials, W, Y0 = synthetic(np.random.default_rng(10))
    check = mounted(trials, W, Y0, [[0, GRAM]])
    for changed, words in (
        ({"sensors": check.sensors[:2], "readings": check.readings[..., :2]}, "the trial runs of 's0'"),
        ({"sensors": ("s0", "s1", "s2", "new")}, "give those of the same sensors"),
        ({"speeds": check.speeds[:2], "readings": check.readings[:, :, :2]}, "of the check run at 2864"),
    ):
        with pytest.raises(ValueError, match=words):
            refine(trials, replace(check, **changed))
    turned = replace(check, sensors=check.sensors[::-1], readings=check.readings[..., ::-1])
    assert np.array_equal(with_check_runs(trials, turned).readings, with_check_runs(trials, check).readings)


def test_joined_runs_keep_the_errors_that_were_measured():
    trials, W, Y0 = synthetic(np.random.default_rng(11))
    check = mounted(trials, W, Y0, [[GRAM, GRAM]])

    def measured(runs, variance):
        return replace(
            runs, covariance=np.tile(variance * np.eye(2)[..., None, None, None, None], runs.readings.shape)
        )

    joint = with_check_runs(measured(trials, 0.01), measured(check, 0.25))
    assert np.allclose(joint.covariance[0, 0, 0, :, 0, 0], [0.01, 0.01, 0.01, 0.25])
    own, other = (replace(x, steps=np.full((2, *x.readings.shape), k)) for k, x in enumerate((trials, check)))
    assert (
        with_check_runs(own, other).steps[:, 0, :, 0, 0].tolist() == [[0, 0, 0, 1]] * 2
    )  # their digits, too
    # typed ones have the mean of the others, unless errors are stated
    assert np.allclose(with_check_runs(measured(trials, 0.01), check).covariance[0, 0, 0, 3], 0.01)
    both = (replace(each, errors=ERRORS) for each in (measured(trials, 0.01), check))
    assert not with_check_runs(*both).covariance[:, :, 0, 3].any()
