"""`mount`: as few pieces as leave what a check run would not show, or a fifth of the present vibration."""

import numpy as np
import pytest
from balancing_data import GRAM, complex_normal, job

from balancing import Limits, correct, estimate_influence
from balancing.mounting.discrete_weights import solve_discrete
from balancing.mounting.holes import equal_holes, from_list
from balancing.mounting.mount import mount
from balancing.mounting.split import split_on_holes

HOLES = from_list(equal_holes(12), np.array([1, 2, 5]) * GRAM, per_hole=2)


def drawn(seed, error=0.01):
    """Two planes and two sensors: as many readings as weights, so that exact weights leave nothing."""
    rng = np.random.default_rng(seed)
    W = np.array([[1, 0.4j], [0.3, 1.1]]) * np.exp(2j * np.pi * rng.random((2, 2)))
    D = np.array([11.2, 6.0]) * np.exp(2j * np.pi * rng.random(2))
    T = np.array([[0, 0], [8, 0], [0, 8]])
    Y = (T - D) @ W.T * (1 + error * complex_normal(rng, (3, 2)))
    return estimate_influence(job(Y, T * GRAM))


def rms(z):
    return float(np.sqrt(np.mean(np.abs(z) ** 2)))


@pytest.mark.parametrize("seed", range(6))
def test_few_pieces_where_exact_weights_leave_nothing(seed):
    influence = drawn(seed)
    c = correct(influence)
    planes = {"A": HOLES, "B": HOLES}
    few = mount(c, influence, None, planes)
    all_ = mount(c, influence, None, planes, within=1.0)
    assert few.found.pieces <= 6 < all_.found.pieces
    amounts = sum(float(one.amounts.sum()) for one in few.found.mountings)
    assert amounts < 1.3 * np.abs(c.weights).sum()
    enough = max(0.2, c.check_rms / rms(c.before))
    scale = rms(few.after) / rms(c.before)
    assert scale < 1.1 * enough  # readings count by their errors
    assert "--best" in few.answer.found


def test_the_larger_share_is_enough_for_fewer_pieces():
    influence = drawn(3)
    W, Y = influence.W.reshape(2, 2), influence.baseline.ravel()
    found = [solve_discrete(W, Y, (HOLES, HOLES), within=(1.2, share)) for share in (0.02, 0.2, 0.6, 1.1)]
    pieces = [one.pieces for one in found]
    assert pieces[0] > pieces[1] > pieces[2] > pieces[3] == 0
    for one, share in zip(found, (0.02, 0.2, 0.6, 1.1), strict=True):
        assert one.objective <= share * np.linalg.norm(Y) * (1 + 1e-9)
        assert one.proven


def test_limits_of_readings_come_before_few_pieces():
    influence = drawn(1)
    free = mount(correct(influence), influence, None, {"A": HOLES, "B": HOLES})
    most = 0.5 * np.abs(free.after).max()
    limits = Limits(np.full(2, np.inf), np.full((1, 2), most), ((), ()))
    bound = mount(correct(influence, limits=limits), influence, None, {"A": HOLES, "B": HOLES})
    assert np.abs(bound.after).max() <= most * (1 + 1e-9)
    assert bound.found.pieces > free.found.pieces


def test_one_weight_is_split_by_the_same_rule():
    target = 10.9 * GRAM * np.exp(0.1j)
    few, best = split_on_holes(target, HOLES).nearest, split_on_holes(target, HOLES, within=1.0).nearest
    assert few.pieces == 2 < best.pieces
    assert best.relative_error < few.relative_error <= 0.2
    assert few.proven
