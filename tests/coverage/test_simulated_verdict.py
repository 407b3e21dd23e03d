"""Regions of what a correction left: drawn jobs."""

from dataclasses import replace
from math import pi

import numpy as np
from balancing_data import complex_normal, synthetic
from repetitions import lowest_share, repetitions

from balancing import ReadingErrors, estimate_influence, tolerance, verdict_of_check

ERRORS = ReadingErrors(amplitude=0.01, phase=0.01)


def rigid(limit, **options):
    """A tolerance of `limit` kg·m in each of the planes A and B."""
    return tolerance(2 * limit * 100 * pi / 2.5e-3, 100 * pi, 2.5, planes={"A": None, "B": None}, **options)


def check_run(made, W, residual, errors=ERRORS):
    readings = np.einsum("scp,p->sc", W, residual)[None]
    return replace(
        made, runs=("check",), readings=readings, weights=np.zeros((1, 0)), planes=(), errors=errors
    )


def test_sizes_of_the_region_hold_the_true_one_in_95_of_100_jobs():
    rng = np.random.default_rng(11)
    made, W, _ = synthetic(rng, errors=ReadingErrors(floor=1.0), sensors=3, speeds=1)
    residual = np.array([1e-3, -2e-3j])
    inside, jobs = 0, repetitions(400)
    exact = check_run(made, W, residual)
    for _ in range(jobs):
        trials = replace(made, readings=made.readings + 1e-2 * complex_normal(rng, made.readings.shape))
        trials = replace(trials, errors=ReadingErrors(floor=1e-2))
        noisy = replace(
            exact,
            readings=exact.readings + 1e-2 * complex_normal(rng, exact.readings.shape),
            errors=ReadingErrors(floor=1e-2),
        )
        row = verdict_of_check(estimate_influence(trials), noisy, tolerance=rigid(1.0)).rows[0]
        inside += row.low <= abs(residual[0]) <= row.high
    assert lowest_share(jobs, 0.95) <= inside / jobs
