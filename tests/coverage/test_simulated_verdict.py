"""Regions of what a correction left: drawn jobs."""

from dataclasses import replace

import numpy as np
from balancing_data import check_run, complex_normal, rigid, synthetic
from repetitions import lowest_share, repetitions

from balancing import ReadingErrors, estimate_influence, verdict_of_check


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
