"""Planes that act nearly alike, errors assumed: regions hold, and "mount" promises what is kept.

The errors are as large as they are assumed, of a reading and of each kind between runs.
"""

import coverage_balance as example
import numpy as np
import pytest
from repetitions import FULL, highest_share, lowest_share

from balancing import Trials, correct, estimate_influence

S, C, P = 2, 4, 2


def answer(rng, kind, apart):
    """A correction of planes that differ by a share of their effect; the truth, and what is left (rms)."""
    W = example.normal(rng, S, C, P)
    W[..., 1] = 0.8 * np.exp(1j) * W[..., 0] + apart * W[..., 1]
    D = example.normal(rng, P)
    T = np.vstack((np.zeros(P), np.diag(0.6 * np.abs(D) * np.exp(2j * np.pi * rng.random(P)))))
    Y = np.einsum("scp,rp->rsc", W, T - D)
    effect = W * np.sqrt(np.mean(np.abs(D) ** 2))
    read = Y + example.ASSUMED * example.between_runs(rng, kind, Y, effect)
    read = read * (1 + example.ASSUMED * example.normal(rng, *read.shape))
    names = ("bare", "trial A", "trial B"), np.array([100.0, 200.0]), tuple("1234"), ("A", "B")
    found = correct(estimate_influence(Trials(*names, read[None], T)))
    return found, D, float(np.sqrt(np.mean(np.abs(W @ (found.weights - D)) ** 2)))


@pytest.fixture(scope="module")
def near():
    rng = np.random.default_rng(4)
    kinds = example.KINDS * (60 if FULL else 16)
    return [answer(rng, kind, rng.uniform(0.1, 0.3)) for kind in kinds]


def test_regions_hold_and_no_contradiction_is_named(near):
    holds = [found.region().holds(D) for found, D, _ in near]
    assert np.mean(holds) >= lowest_share(len(near), 0.94)
    assert np.mean([bool(found.warnings) for found, *_ in near]) <= highest_share(len(near), 0.05)


def test_most_answers_are_to_be_mounted_and_leave_what_they_promise(near):
    left = [(rms, found) for found, _, rms in near if found.decision.word == "mount"]
    assert len(left) > len(near) / 2
    assert np.mean([rms <= found.check_rms for rms, found in left]) >= lowest_share(len(left), 0.95)
