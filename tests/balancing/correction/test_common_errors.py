"""Errors that readings have in common, from runs drawn with them through checks, unbalances and `combine`."""

from dataclasses import replace

import numpy as np
import pytest
from repetitions import FULL

from balancing import (
    ReadingErrors,
    Trials,
    combine,
    compare_check,
    correct,
    estimate_influence,
    refine,
    verdict_of_check,
)
from balancing.coefficients.influence import Influence, estimate_like
from balancing.coefficients.run_errors import RunErrors, runs_of
from balancing.iso21940 import tolerance
from balancing.unbalance import unbalance_of_run

ERRORS = ReadingErrors(0.004, 0.004, 0.002)
RUN = RunErrors(np.array([[0.004, 0.006, 0.01], [0.01, 0.0, 0.02], [0.002, 0.004, 0.01]]), "stated")
S, C, P = 2, 3, 2
SPEEDS = np.array([100.0, 200.0])
SENSORS, PLANES = ("a", "b", "c"), ("A", "B")
DRAWS = 400 if FULL else 250
TRUTH = np.random.default_rng(4)
W = TRUTH.standard_normal((S, C, P)) + 1j * TRUTH.standard_normal((S, C, P))
UNBALANCE = np.array([1.5, 1 - 2j])
Y0 = W @ UNBALANCE
TRIALS = np.vstack((np.zeros(P), 0.7 * np.eye(P)))
CHECKS = np.array([[-0.8 + 0.3j, 0.4], [0.5j, -1.2]])
KNOWN = Influence(
    SPEEDS,
    SENSORS,
    PLANES,
    W,
    Y0,
    None,
    errors=ERRORS,
    error_source="stated",
    run_errors=RUN,
)


def complex_normal(rng, *shape):
    return rng.standard_normal(shape) + 1j * rng.standard_normal(shape)


def drawn(rng, T, names="trial"):
    """Runs with the weights T (R, P), their readings with all kinds of errors."""
    R = len(T)
    exact = Y0 + np.einsum("scp,rp->rsc", W, T)
    found = runs_of(exact, T, W)
    Y = exact * (1 + 0.004 * complex_normal(rng, R, S, C)) + 0.002 * complex_normal(rng, R, S, C)
    for k, shape in enumerate(((R, S, C), (R, S, 1), (R, 1, 1))):
        further = np.ones((1, S, C)) if k == 0 else found.unbalance
        p, w, f = RUN.sizes[:, k]
        for size, way in ((p, found.Y), (w, found.effect), *((f, part) for part in further)):
            Y = Y + size * way * complex_normal(rng, *shape)
    runs = tuple(f"{names} {r}" for r in range(R))
    return Trials(runs, SPEEDS, SENSORS, PLANES, Y, T.astype(complex), errors=ERRORS)


def jobs(seed):
    rng = np.random.default_rng(seed)
    return [(estimate_like(drawn(rng, TRIALS), KNOWN), drawn(rng, CHECKS, "check")) for _ in range(DRAWS)]


def exact():
    """Coefficients of trial runs as they would be read without any error."""
    made = drawn(np.random.default_rng(0), TRIALS)
    return estimate_like(replace(made, readings=Y0 + np.einsum("scp,rp->rsc", W, TRIALS)), KNOWN)


def agree(found, expected):
    """Whether a covariance of DRAWS drawn vectors is the expected one: in units of the expected one."""
    values, vectors = np.linalg.eigh(expected)
    kept = values > 1e-9 * values[-1]
    root = vectors[:, kept] / np.sqrt(values[kept])
    difference = root.T @ found @ root - np.eye(kept.sum())
    # an entry has a standard deviation of 1/√DRAWS, on the diagonal √2 times that: 5 and 7 % of 400
    assert np.abs(difference).max() < 5 / np.sqrt(DRAWS)
    assert np.sqrt(np.mean(difference**2)) < 1.15 * np.sqrt((1 + 1 / len(root.T)) / DRAWS)


def real(z):
    return np.ascontiguousarray(z, dtype=complex).view(float)


def test_chi_square_of_check_runs_is_that_of_their_errors():
    nothing = correct(KNOWN, Y0, method="least-squares")
    found = [compare_check(nothing, check, influence) for influence, check in jobs(1)]
    n = found[0].n
    chi_square = np.array([f.chi_square for f in found])
    assert n == 2 * 2 * S * C
    assert chi_square.mean() / n == pytest.approx(1, abs=4 * np.sqrt(2 / n / DRAWS))
    # as independent, their variance would be several times as large
    assert chi_square.var() / (2 * n) == pytest.approx(1, abs=0.35)
    assert np.mean([f.explained for f in found]) == pytest.approx(0.95, abs=0.033)
    each = np.mean([np.abs(f.difference) ** 2 for f in found], axis=0)
    stated = np.trace(found[0].covariance, axis1=-2, axis2=-1)
    np.testing.assert_allclose(each / stated, 1, atol=0.25)


@pytest.mark.full
def test_the_region_of_a_verdict_holds_the_truth():
    whole = tolerance(100, 1, "G2.5", planes={"A": None, "B": None})
    inside, warned = [], 0
    for influence, check in jobs(6):
        found = verdict_of_check(influence, check, run=1, tolerance=whole)
        warned += bool(found.warnings)
        for row, truth in zip(found.rows, UNBALANCE + CHECKS[1], strict=True):
            away, edge = truth - row.value, row.region - row.value
            inside.append(abs(edge[np.argmin(np.abs(np.angle(edge / away)))]) >= abs(away))
    # two planes of 400 jobs, correlated: 0.95 ± 0.01
    assert np.mean(inside) == pytest.approx(0.95, abs=0.03)
    assert warned < 0.1 * DRAWS


def test_unbalance_of_a_run_has_the_stated_covariance():
    found = np.array([real(unbalance_of_run(influence).unbalance) for influence, _ in jobs(2)])
    agree(np.cov(found.T), unbalance_of_run(exact()).covariance)


def test_combined_coefficients_keep_what_they_have_in_common():
    rng = np.random.default_rng(3)
    model = replace(
        KNOWN,
        baseline=None,
        covariance=np.tile(np.diag([0, 0, 1, 1, 1, 1]) * 2.5e-3, (S, C, 1, 1)),
        errors=None,
        run_errors=RunErrors(),
    )
    found = []
    for influence, _ in jobs(4):
        computed = replace(model, W=W + 0.05 * complex_normal(rng, S, C, P))
        one = combine(influence, computed)
        found.append(np.concatenate((one.baseline[..., None] - Y0[..., None], one.W - W), axis=-1))
    both = combine(exact(), model)
    assert (both.covariance[..., 2, 2] < exact().covariance[..., 2, 2]).all()
    errors = np.array(found)
    for s, c in ((0, 0), (1, 2)):
        agree(np.cov(real(errors[:, s, c]).T), both.covariance[s, c])
    # of two channels: errors of the run, and at one speed those of the speed, too
    for (s, c), (t, d) in (((0, 0), (1, 2)), ((0, 0), (0, 1))):
        kinds = both.common if s == t else both.common[:1]
        expected = 2 * np.einsum("kmp,kmq->pq", kinds[:, :, s, c], kinds[:, :, t, d].conj())
        drawn_ones = np.einsum("np,nq->pq", errors[:, s, c], errors[:, t, d].conj()) / DRAWS
        size = np.sqrt(
            np.einsum(
                "p,q->pq", *(np.mean(np.abs(errors[:, i, j]) ** 2, axis=0) for i, j in ((s, c), (t, d)))
            )
        )
        assert (np.abs(drawn_ones - expected) / size).max() < 5 / np.sqrt(DRAWS)


def test_check_runs_of_some_sensors_share_the_errors_of_the_trial_runs():
    rng = np.random.default_rng(5)
    trials, check = drawn(rng, TRIALS), drawn(rng, CHECKS, "check")
    part = replace(check, sensors=SENSORS[:2], readings=check.readings[..., :2])
    found = refine(trials, part)
    whole, alone = refine(trials, check), estimate_influence(trials)
    assert found.common.shape[1] == whole.common.shape[1]
    np.testing.assert_allclose(found.W[..., 2, :], alone.W[..., 2, :], rtol=1e-9)
    # the unread sensor has columns of the trial runs only
    own = alone.common.shape[1]
    assert found.common[:, :own, :, 2].any()
    assert not found.common[:, own:, :, 2].any()
    correction = correct(found)
    assert np.isfinite(correction.covariance).all()
