"""Holes of a plane: angles, what is taken, and messages for what cannot be."""

import numpy as np
import pytest
from cases import each_of

from balancing.holes import equal_holes, from_list


def test_equal_holes_stand_within_one_turn():
    assert np.degrees(equal_holes(4, np.radians(10))) == pytest.approx([10, 100, 190, 280])
    angles = equal_holes(36, -1e-18)
    assert (angles >= 0).all()
    assert (angles < 2 * np.pi).all()


def test_defaults_and_order():
    holes = from_list(np.radians([90, 0, 200]), [0.02, 0.01], taken=[0, 0.03, 0])
    assert holes.names == ("1", "2", "3")
    assert np.degrees(holes.angles) == pytest.approx([90, 0, 200])  # as listed, sorted or not
    assert holes.free.tolist() == [True, False, True]
    assert holes.mounted == pytest.approx(0.03)
    assert not holes.free_amounts
    assert from_list([0.0]).free_amounts
    assert from_list([0.0, 1.0]).taken.tolist() == [0, 0]


@each_of(
    ("angles", "options", "message"),
    [
        ([], {}, "0 holes: there must be some"),
        ([0.0, 1.0, 0.0], {}, "holes 1 and 3 stand at the same angle"),
        ([0.3, 0.3 + np.radians(0.0005) - 2 * np.pi], {}, "holes 1 and 2 stand at the same angle"),
        ([0.0, 2 * np.pi], {"names": ["A", "B"]}, "holes A and B stand at the same angle"),
        ([0.0, 13.0], {}, "from −360° to 720°"),
        ([-7.0], {}, "from −360° to 720°"),
        ([0.0, np.nan], {}, "angles, pieces and weights must be finite"),
        ([0.0], {"pieces": [1.0, 0.0]}, "more than 0"),
        ([0.0], {"pieces": [1.0, 1.0]}, "listed twice"),
        ([0.0], {"pieces": [1.0], "per_hole": 0}, "one or more in a hole"),
        ([0.0], {"step": -0.1}, "smallest step"),
        ([0.0], {"pieces": [1.0], "step": 0.1}, "either pieces or a smallest step"),
        ([0.0, 1.0], {"taken": [0.0]}, "2 holes: there must be"),
        ([0.0, 1.0], {"taken": [0.0, -1.0]}, "must not be negative"),
        ([0.0], {"taken": [1.0]}, "mounted in every hole"),
        ([0.0], {"pieces": [1.0, 2.0], "stock": [1]}, "for each of the 2 pieces"),
        ([0.0], {"pieces": [1.0], "stock": [-1]}, "numbers be whole"),
        ([0.0], {"pieces": [1.0], "stock": [0]}, "the stock is empty"),
        ([0.0, 1.0], {"names": ["A", "A"]}, "with a name of its own"),
    ],
)
def test_messages(angles, options, message):
    with pytest.raises(ValueError, match=message):
        from_list(angles, **options)


def test_holes_outside_arcs_with_their_ends():
    holes = from_list(np.radians([0, 30, 60, 90, 300]), taken=[0, 0, 0, 1, 0])
    arcs = [tuple(np.radians([30.0, 60.0])), tuple(np.radians([290, 80]))]
    assert holes.outside(arcs[:1]).tolist() == [True, True, False, False, True]
    assert holes.outside(arcs).tolist() == [False, True, False, False, False]
