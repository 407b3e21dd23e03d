"""Drawn machines, calibrated, balanced in one shot: how well, how honest the intervals, what is recognised.

The example with few machines; bounds are those of what it prints for many (docs/sure.md), by
the binomial distribution of so few.
"""

import coverage_calibrate as example
import numpy as np
import pytest
import sure
from repetitions import FULL, highest_share, lowest_share

EACH = 60 if FULL else 3
"""Machines of each kind."""
SEED = 2


def simulated(case, each=EACH, names=None):
    return [one for name in names or example.MACHINES for one in example.simulate(each, SEED, name, case)]


@pytest.fixture(scope="module")
def four():
    return simulated("four speeds")


@pytest.fixture(scope="module")
def single():
    return simulated("one speed", EACH if FULL else 2)


@pytest.fixture(scope="module")
def exact():
    return simulated("exact, four speeds", max(EACH // 2, 2))


def test_one_shot_at_four_speeds(four):
    good = [one.good for one in four]
    assert np.mean(good) >= lowest_share(len(good), 0.95)
    believed = [one.left_believed <= max(example.GOOD, example.NEAR * one.left_exact) for one in four]
    assert np.mean(believed) < lowest_share(len(good), 0.95)  # the bound refuses a rotor not calibrated


def test_one_shot_at_one_speed(single):
    good = [one.good for one in single]
    assert np.mean(good) >= lowest_share(len(good), 0.85)


def test_regions_of_weights_and_check_runs(four, single):
    found = [one for one in (*four, *single) if not one.told]
    for inside in ([one.inside for one in found], [one.check for one in found]):
        assert np.mean(inside) >= lowest_share(len(inside), 0.93)


def test_good_models_are_seldom_said_to_lack_something(four, single):
    told = [one.told for one in (*four, *single)]
    assert np.mean(told) <= highest_share(len(told), 0.01)


def test_numbers_wrongly_taken_as_exact(exact):
    for holds in ([one.told or one.inside for one in exact], [one.told or one.check for one in exact]):
        assert np.mean(holds) >= lowest_share(len(exact), 0.95)


def test_a_third_bearing_is_recognised():
    found = simulated("third bearing", max(EACH // 3, 1))
    assert np.mean([one.told for one in found]) >= max(lowest_share(len(found), 0.95), 0.6)  # two of three


def test_the_tables_are_those_of_the_page(four, capsys):
    example.report(lambda name, case: four)
    assert sure.titles(capsys.readouterr().out) == sure.titles("".join(sure.blocks("calibrate")))
