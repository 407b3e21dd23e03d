"""Regions of redrawn coefficients hold the true weights, whatever changes from run to run.

Of 1750 such jobs 93.7 %, by kind 92 to 95 %, by source 92 to 96 %. On the same 240 jobs with spare runs the
median half width is 10 to 11 % of a weight, and 11 to 18 % with the module before, which held 94.6 % (here
94.8 %).
"""

from dataclasses import replace

import coverage_balance as example
import numpy as np
import pytest
from drawn_weights import Fit
from repetitions import FULL, highest_share, lowest_share

from balancing.conditioning import UndeterminedError
from balancing.influence import estimate_influence
from balancing.trials import Placement


def inside(jobs, sources, seed, placement=None, drift=0.0):
    """Whether regions hold the truth, of jobs that are not refused."""
    rng = np.random.default_rng(seed)
    found = []
    for source in sources:
        for kind in example.KINDS:
            for _ in range(jobs):
                job = example.draw(rng, source, kind, example.ordinary(rng))
                trials = job.trials if placement is None else amiss(rng, job.trials, placement, drift)
                try:
                    influence = estimate_influence(trials)
                except UndeterminedError:
                    continue
                found.append(Fit(influence).holds(job.D))
    assert len(found) > 0.9 * jobs * len(sources) * len(example.KINDS)
    return found


def amiss(rng, trials, placement, drift):
    """The same runs with weights that are not where they are said to be, and drift."""
    T = trials.weights
    A = np.column_stack((np.ones(len(T)), T))
    theta = np.linalg.lstsq(A, trials.mean.reshape(len(T), -1), rcond=None)[0]
    error = placement.mass * rng.standard_normal(T.shape) + 1j * placement.angle * rng.standard_normal(
        T.shape
    )
    more = ((T * error) @ theta[1:]).reshape(trials.mean.shape)
    course = 1 + drift * example.normal(rng) * np.linspace(0, 1, len(T))[:, None, None]
    return replace(trials, readings=(trials.readings + more) * course, placement=placement, drift=drift)


@pytest.mark.parametrize("placement", [None, Placement(0.03, np.deg2rad(3))])
def test_regions_hold(placement):
    jobs = 60 if FULL else 8
    found = inside(jobs, example.SOURCES, 5, placement, 0.02)
    assert lowest_share(len(found), 0.93) <= np.mean(found) <= highest_share(len(found), 0.97)


def test_regions_of_assumed_errors_hold():
    jobs = 60 if FULL else 12
    found = inside(jobs, ["repeats"], 6)
    assert np.mean(found) >= lowest_share(len(found), 0.94)
