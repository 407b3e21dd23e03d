"""What is left to do after a check run: done, trim, take off, or nothing yet."""

from dataclasses import replace

import numpy as np
import pytest
from balancing_data import GRAM, noisy, rms, synthetic

from balancing import ReadingErrors, after_check_run, correct, estimate_influence, refine

ERRORS = ReadingErrors(0.01, 0.01)
FLOOR = ReadingErrors(0.005, 0.005, 0.1)
"""Of small readings, too: what is left after weights with errors is within those of a trim."""


def checked(seed, factor, *, errors=ERRORS, wider=1.0, **options):
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
    c = replace(c, draws=c.weights + wider * (c.draws - c.weights))
    return W @ (U + D), W, U, after_check_run(c, check, **options)


@pytest.mark.parametrize("seed", range(4))
def test_what_hardly_reads_anything_is_done(seed):
    *_, left = checked(seed, 1.0, errors=FLOOR, explained=True)
    assert left.word in ("done", "add nothing yet")  # the run itself is better than what a trim promises
    assert not left.trim.any()
    assert " → " in left.why  # what a trim would reach


def test_a_trim_within_its_error_that_may_be_worth_it_is_told():
    *_, left = checked(0, 0.9, wider=30.0, explained=True)
    assert (left.word, left.trim.any()) == ("done", False)
    assert "a trim would be within its own error (rms " in left.why
    added = left.correction.to_add * 1e3
    for name, weight in zip("AB", added, strict=True):
        at = np.degrees(np.angle(weight)) % 360
        assert f"{name} {abs(weight):.4g} g at {at:.1f}°" in left.why


@pytest.mark.parametrize("seed", range(4))
def test_a_trim_makes_it_better(seed):
    now, W, U, left = checked(seed, 0.6, explained=True)
    assert left.word == "trim"
    assert rms(W @ (U + left.there + left.trim)) < 0.2 * rms(now)
    document = left.to_dict()
    assert [row["mass"] for row in document["add"]] == pytest.approx(np.abs(left.trim) * 1e3)
    assert left.answer.judgement.startswith("Trim; rms ")
    assert left.answer.numbers.count(" add ") == 2


@pytest.mark.parametrize(
    ("factor", "options", "word"),
    [
        (0.6, {"judged": "pass"}, "done"),  # limits decide where there are some
        (0.6, {"judged": "fail"}, "trim"),
        (-1.0, {"explained": False}, "take off what is mounted"),
        (0.6, {"stop": "the runs contradict their conventions"}, "add nothing yet"),
        (1.0, {"explained": False, "errors": FLOOR}, "add nothing yet"),
    ],
)
def test_what_decides(factor, options, word):
    left = checked(0, factor, **options)[-1]
    assert left.word == word
    assert left.why == options.get("stop", left.why)
    # what is added and what is there are the total that the correction proposes
    assert word != "trim" or np.allclose(left.there + left.trim, left.correction.weights)
