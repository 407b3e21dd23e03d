"""Whether runs tell lead from lag: what they confirm, contradict, and cannot tell."""

from dataclasses import replace

import numpy as np
import pytest
from balancing_data import GRAM, complex_normal, job, noisy

from balancing import Labels, ReadingErrors, convention_test

ERRORS = ReadingErrors(0.02, 0.02)
SPREAD = np.array([[0, 0], [1, 0], [0, 1j], [1, 1], [1j, -1]]) * GRAM


def drawn(weights, *, seed=1, errors=ERRORS, **options):
    rng = np.random.default_rng(seed)
    W, Y0 = complex_normal(rng, (1, 3, 2)) * 1e3, complex_normal(rng, (1, 3))
    return job(
        noisy(rng, Y0 + np.einsum("scp,rp->rsc", W, weights), ERRORS), weights, errors=errors, **options
    )


@pytest.mark.parametrize("errors", [ERRORS, None])
def test_runs_confirm_what_is_right_and_contradict_what_is_not(errors):
    trials = drawn(SPREAD, errors=errors)
    right, wrong = (
        convention_test(trials),
        convention_test(replace(trials, readings=np.conj(trials.readings))),
    )
    assert (right.verdict, wrong.verdict) == ("confirmed", "contradicted")
    assert (right.chi_square, right.chi_square_other) == pytest.approx(
        (wrong.chi_square_other, wrong.chi_square)
    )
    assert right.degrees_of_freedom == 2 * 2 * 3
    assert right.contradiction(Labels()) == ()
    [words] = wrong.contradiction(Labels())
    assert words.startswith("these runs contradict 'lead'")


def test_runs_that_cannot_tell():
    assert convention_test(drawn(SPREAD[:3])).verdict == "no redundant run"
    line = np.array([[0, 0], [1, 0], [-0.5, 0], [0, 2], [0, 1]]) * GRAM
    assert convention_test(drawn(line)).verdict == "weights in line"
