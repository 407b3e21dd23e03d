"""Bow tables."""

import numpy as np
import pytest
from tables_data import complaints, write_csv

from fem import Rotor
from rotorid.files import read_bow

SHAFT = Rotor(length=[0.1] * 4, outer_diameter=0.02, stations={"disc": 3})
TABLE = [["node", "bow_um", "angle_deg"], ["1", 0, 0], ["disc", 50, 90], ["5", 20, -180]]


def test_a_bow_table(tmp_path):
    bow = read_bow(write_csv(tmp_path / "bow.csv", TABLE), SHAFT)
    assert [*bow] == [1, 3, 5]
    np.testing.assert_allclose([*bow.values()], [0.0, 5e-5j, -2e-5], atol=1e-20)


@pytest.mark.parametrize(
    ("rows", "said"),
    [
        (TABLE[:3], "three nodes or more"),
        ([*TABLE, ["3", 1, 0]], "no other row"),
        ([*TABLE[:3], ["9", 1, 0]], "a node from 1 to 5"),
        ([*TABLE[:3], ["5", -1, 0]], "not below 0"),
        ([*TABLE[:3], ["5", 1, 400]], "-360 to 360"),
    ],
)
def test_what_is_no_bow(tmp_path, rows, said):
    (found,) = complaints(lambda: read_bow(write_csv(tmp_path / "bow.csv", rows), SHAFT))
    assert said in str(found)
