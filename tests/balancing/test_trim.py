"""What is left to do after a check run: done, trim, take off, or nothing yet."""

from dataclasses import replace

import numpy as np
import pytest
from balancing_data import GRAM, noisy, rms, synthetic

from balancing import ReadingErrors, after_check_run, correct, estimate_influence, refine

ERRORS = ReadingErrors(0.01, 0.01)
FLOOR = ReadingErrors(0.005, 0.005, 0.1)
"""Of small readings, too: what is left after weights with errors is within those of a trim."""


def checked(seed, factor, *, errors=ERRORS, **options):
    """A job whose check run has `factor` times the proposed weights; truth, and what is left to do."""
    rng = np.random.default_rng(seed)
    exact, W, _ = synthetic(rng)
    U = GRAM * np.exp(1j * rng.uniform(0, 6, 2)) * 2
    T = exact.weights
    read = np.einsum("scp,rp->rsc", W, T + U)
    trials = replace(exact, readings=noisy(rng, read, errors)[None], errors=errors)
    D = correct(estimate_influence(trials)).weights * factor
    check = replace(
        trials, runs=("check",), readings=noisy(rng, W @ (U + D), errors)[None, None], weights=D[None]
    )
    c = correct(refine(trials, check), refuse=False)
    return W @ (U + D), W, U, after_check_run(c, check, **options)


@pytest.mark.parametrize("seed", range(4))
def test_what_hardly_reads_anything_is_done(seed):
    *_, left = checked(seed, 1.0, errors=FLOOR, explained=True)
    assert left.word in ("done", "add nothing yet")  # the run itself is better than what a trim promises
    assert not left.trim.any()


@pytest.mark.parametrize("seed", range(4))
def test_a_trim_makes_it_better(seed):
    now, W, U, left = checked(seed, 0.6, explained=True)
    assert left.word == "trim"
    assert rms(W @ (U + left.there + left.trim)) < 0.2 * rms(now)
    document = left.to_dict()
    assert [row["mass"] for row in document["add"]] == pytest.approx(np.abs(left.trim) * 1e3)
    assert left.answer.judgement.startswith("Trim; rms ")
    assert left.answer.numbers.count(" add ") == 2


def test_limits_decide_where_there_are_some():
    assert checked(0, 0.6, judged="pass")[-1].word == "done"
    assert checked(0, 0.6, judged="fail")[-1].word == "trim"


def test_weights_that_made_it_worse_come_off():
    left = checked(0, -1.0, explained=False)[-1]
    assert left.word == "take off what is mounted"
    assert "check what was mounted" in left.why


def test_what_speaks_against_it_stops_a_trim():
    left = checked(0, 0.6, stop="the runs contradict their conventions")[-1]
    assert (left.word, left.why) == ("add nothing yet", "the runs contradict their conventions")


def test_a_difference_that_is_not_explained_is_not_done():
    left = checked(1, 1.0, errors=FLOOR, explained=False)[-1]
    assert left.word == "add nothing yet"


def test_the_comparison_of_a_trim_is_that_of_its_total():
    """What is added and what is there are the total that the correction proposes."""
    *_, left = checked(2, 0.6)
    assert np.allclose(left.there + left.trim, left.correction.weights)
