"""`mount`: as few pieces as leave what a check run would not show, or a fifth of the present vibration."""

import numpy as np
import pytest
from balancing_data import GRAM, complex_normal, job, rms

from balancing import (
    Limits,
    correct,
    equal_holes,
    estimate_influence,
    from_list,
    mount,
    verdict_of_prediction,
)

HOLES = from_list(equal_holes(12), np.array([1, 2, 5]) * GRAM, per_hole=2)
BOTH = {"A": HOLES, "B": HOLES}


def drawn(seed, error=0.01):
    """Two planes and two sensors: as many readings as weights, so that exact weights leave nothing."""
    rng = np.random.default_rng(seed)
    W = np.array([[1, 0.4j], [0.3, 1.1]]) * np.exp(2j * np.pi * rng.random((2, 2)))
    D = np.array([11.2, 6.0]) * np.exp(2j * np.pi * rng.random(2))
    T = np.array([[0, 0], [8, 0], [0, 8]])
    Y = (T - D) @ W.T * (1 + error * complex_normal(rng, (3, 2)))
    return estimate_influence(job(Y, T * GRAM))


@pytest.mark.parametrize("seed", range(4))
def test_few_pieces_where_exact_weights_leave_nothing(seed):
    influence = drawn(seed)
    c = correct(influence)
    few = mount(c, influence, None, BOTH)
    assert few.discrete.pieces <= 6
    assert rms(few.after) < 1.3 * max(0.2 * rms(c.before), c.check_rms)
    assert np.allclose(few.after, c.before + influence.W @ few.weights)
    # more pieces than what fewer would leave
    assert all(
        rms(c.before + influence.W @ each.weights) > rms(few.after) * 0.99 for each in few.discrete.fewer
    )


def test_pieces_beside_what_is_mounted():
    influence = drawn(3)
    taken = np.zeros(12)
    taken[0] = 8 * GRAM
    c = correct(influence)
    with pytest.raises(ValueError, match="the holes in which weights of run 'run 2' stand are not named"):
        mount(c, influence, None, BOTH, on_top=True)
    there = from_list(equal_holes(12), np.array([1, 2, 5]) * GRAM, per_hole=2, taken=taken)
    found = mount(c, influence, None, {"A": HOLES, "B": there}, on_top=True)
    assert found.on_top_of == "run 2"
    total = found.weights + c.mounted.weights
    assert np.allclose(found.after, c.before + influence.W @ total)
    assert rms(found.after) < 0.5 * rms(c.before)


@pytest.mark.parametrize("share", [0.15, 0.6])
def test_a_set_is_enough_where_every_limit_passes_by_the_verdict(share):
    """Limits that even exact weights are not sure to keep ask for what is enough without limits."""
    influence = drawn(4)
    most = share * np.abs(influence.baseline).max()
    limits = Limits(np.full(2, np.inf), np.full((1, 2), most), ((), ()))
    c = correct(influence, limits=limits)
    found = mount(c, influence, None, BOTH)
    verdict = verdict_of_prediction(c, mounted=found.weights, after=found.after)
    exact = verdict_of_prediction(c).overall
    assert exact == ("pass" if share > 0.5 else "not decidable")
    assert found.discrete.enough
    assert verdict.overall == exact
    assert found.check_rms <= max(1.2 * c.check_rms, 0.2 * rms(c.before)) or exact == "pass"
    assert np.abs(found.after).max() <= most
