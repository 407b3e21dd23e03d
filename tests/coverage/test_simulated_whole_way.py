"""Jobs that are played to their end: the tables of `whole_way.py` with fewer machines."""

import numpy as np
import pytest
import whole_way
from repetitions import FULL, highest_share, lowest_share


@pytest.fixture(scope="module")
def ways():
    return list(whole_way.ways(60 if FULL else 12))


def test_the_check_run_of_exactly_the_proposed_pieces_is_as_predicted(ways):
    for one in (0, 1):
        strange = [way.explained[one] is False for way in ways]
        assert np.mean(strange) <= highest_share(len(ways), 0.05)


def test_readings_within_their_limits_are_the_end(ways):
    last = [way.words[1] for way in ways if way.kept]
    assert len(last) > len(ways) // 6
    assert set(last) == {"done"}


def test_nothing_is_mounted_twice_and_a_trim_makes_it_better(ways):
    assert not any(way.twice for way in ways)
    trims = [way.left for way in ways if way.words[0] == "trim"]
    assert len(trims) > len(ways) // 6
    assert np.mean([after < before for before, after in trims]) > 0.9
    assert np.median([after / before for before, after in trims]) < 0.5


def test_refined_regions_hold_the_truth(ways):
    covered = [way.covered for way in ways if way.covered is not None]
    assert len(covered) > 0.9 * len(ways)
    assert np.mean(covered) >= lowest_share(len(covered), 0.93)


def test_mistakes_that_matter_are_named_with_their_plane():
    found = [one for one in whole_way.mistakes(60 if FULL else 12) if one.matters]
    assert len(found) > 6
    assert np.mean([one.named for one in found]) >= lowest_share(len(found), 0.9)
