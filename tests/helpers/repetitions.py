"""How often a simulation is repeated, and what so many repetitions can show.

`make test` repeats 300 times where `make test-full` repeats 2,000 times or more: bounds are computed from the
number, so that both ask the same question as sharply as they can. Full tables: docs/sure.md.

Intervals of 95 % that are 1.4 times too large are refused by 300 repetitions in 73 of 100 cases, by 150 in
none; those 1.4 times too small by 300 always, by 150 in 85. So a bound of both sides needs 300.
"""

import os

import numpy as np
from scipy.stats import binom

FEWER = 300
FULL = os.environ.get("ROTORID_FULL_TEST", "") not in ("", "0")
RARE = 1e-4
"""Probability that a bound refuses what is right."""
DEVIATIONS = 3.9
"""The same for both sides of a normal distribution: P(|z| > 3.9) = 1e-4."""


def repetitions(full):
    """`full` in `make test-full`, at most 300 otherwise."""
    return full if FULL else min(full, FEWER)


def lowest_share(n, share):
    """The least share of n repetitions that a true share may show."""
    return binom.ppf(RARE, n, share) / n


def highest_share(n, share):
    """The largest share of n repetitions that a true share may show."""
    return binom.ppf(1 - RARE, n, share) / n


def of_a_mean(n):
    """How far, in standard deviations of one repetition, the mean of n lies from the truth at most."""
    return DEVIATIONS / np.sqrt(n)
