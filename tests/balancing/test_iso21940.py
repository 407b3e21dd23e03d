"""Permissible residual unbalance and its share per plane, against calculations by hand."""

from math import pi

import numpy as np
import pytest
from cases import each_of

from balancing.iso21940 import tolerance
from balancing.plots import draw_tolerance as plot

RPM3000 = 100 * pi
TOTAL = 1000 * 2.5 * 500 / RPM3000  # g·mm, 3978.87


def shares(found):
    return found.limits * 1e6 / TOTAL


def rotor(**places):
    return tolerance(500, RPM3000, 2.5, **places)


def test_500_kg_at_3000_rpm():
    found = rotor()
    assert round(found.total * 1e6) == 3979
    assert round(found.eccentricity * 1e6, 2) == 7.96
    assert found.to_dict()["permissible_g_mm"] == pytest.approx(3978.8736, rel=1e-7)
    assert found.limits.size == 0
    assert shares(rotor(planes={"disc": None})) == pytest.approx([1.0])
    assert shares(rotor(planes={"left": None, "right": None})) == pytest.approx([0.5, 0.5])


@each_of(
    ("centre", "expected"),
    [
        (0.5, [0.5, 0.5]),  # symmetric
        (0.4, [0.6, 0.4]),  # lever: the nearer plane has more
        (0.1, [0.7, 0.3]),  # 0.9 : 0.1, limited
        (1.0, [0.3, 0.7]),  # over the bearing: still between
        # overhung by 0.2: 0.2 and 1.2, the smaller raised to 0.3
        (1.35, [0.35, 1.3]),  # 0.35 and 1.35, the larger cut to 1.3
        (-0.25, [1.25, 0.3]),
    ],
)
def test_tolerance_planes_by_the_lever_rule(centre, expected):
    found = rotor(planes={"A": 0.0, "B": 1.0}, centre=centre)
    assert shares(found) == pytest.approx(expected)
    # in which order and from which origin positions are counted does not matter
    turned = rotor(planes={"B": 7 - 1.0, "A": 7 - 0.0}, centre=7 - centre)
    assert shares(turned) == pytest.approx(expected[::-1])
    cut = abs(expected[0] - abs(1 - centre)) + abs(expected[1] - abs(centre)) > 1e-9
    assert bool(found.warnings) == cut


@each_of(
    ("planes", "centre", "expected"),
    [
        ({"A": 0.0, "B": 1.0}, 0.4, [0.6, 0.4]),
        # 0.75 u₁ + 0.25 u₂ = 0.6, 0.25 u₁ + 0.75 u₂ = 0.4
        ({"A": 0.25, "B": 0.75}, 0.4, [0.7, 0.3]),
        # at the left bearing, 0.9 u₁ + 0.8 u₂ ≤ 0.5, binds alone: each half of it
        ({"A": 0.1, "B": 0.2}, 0.5, [0.25 / 0.9, 0.25 / 0.8]),
        # overhung, U_A = 0.3, U_B = 1.3; T = |−0.2 −0.4; 1.2 1.4|: B binds alone, 0.29405 ≤ 0.3 at A
        ({"A": 1.2, "B": 1.4}, 1.3, [0.65 / 1.2, 0.65 / 1.4]),
        # T = |1.2 −0.2; −0.2 1.2|, both tolerances 0.5
        ({"A": -0.2, "B": 1.2}, 0.5, [0.5 / 1.4, 0.5 / 1.4]),
    ],
)
def test_correction_planes_of_a_rotor_on_bearings(planes, centre, expected):
    assert shares(rotor(planes=planes, bearings=(0.0, 1.0), centre=centre)) == pytest.approx(expected)


def test_planes_are_safe_at_the_bearings_and_no_pair_has_a_larger_product():
    rng = np.random.default_rng(7)
    for _ in range(50):
        planes = dict(zip("AB", rng.uniform(-0.5, 1.5, 2), strict=True))
        found = rotor(planes=planes, bearings=(0.0, 1.0), centre=rng.uniform(-0.5, 1.5))
        limits, T = found.bearing_limits, np.abs(found.transfer)
        assert (T @ found.limits <= limits * (1 + 1e-9)).all()
        # the best of a grid of safe pairs
        first = np.linspace(0, (limits / T[:, 0]).min(), 400)
        second = ((limits[:, None] - T[:, :1] * first) / T[:, 1:]).min(axis=0)
        best = (first * second).max()
        assert best * (1 - 1e-9) <= np.prod(found.limits) <= best / 0.99


def test_residuals_at_the_bearings():
    found = rotor(planes={"A": 0.25, "B": 1.5}, bearings=(0.0, 1.0), centre=0.5)
    assert found.transfer @ [1.0, 0.0] == pytest.approx([0.75, 0.25])
    assert found.transfer @ [0.0, 2j] == pytest.approx([-1j, 3j])
    assert rotor(planes={"A": None}).transfer is None


@each_of(
    ("arguments", "words"),
    [
        ({"grade": 3}, "no balance quality grade 3"),
        ({"speed": float("nan")}, "service speed"),
        ({"planes": {"A": 0.0, "B": 0.0}, "centre": 1.0}, "both planes are at the same place"),
        ({"planes": {"A": 0.0, "B": 1.0}}, "needs the position of the centre of mass"),
        ({"planes": {"A": None, "B": None}, "bearings": (0, 1), "centre": 0.5}, "give those of the planes"),
        ({"planes": dict.fromkeys("ABC")}, "not 3: choose two"),
    ],
)
def test_what_cannot_be_is_refused(arguments, words):
    usual = {"mass": 500, "speed": RPM3000, "grade": 2.5}
    with pytest.raises(ValueError, match=words):
        tolerance(**{**usual, **arguments})


def test_table_and_picture():
    found = rotor(planes={"left": 0.1, "right": 0.7}, bearings=(0.0, 1.0), centre=0.4)
    assert found.to_frame().limit_g_mm.to_numpy()[3:] == pytest.approx(found.limits * 1e6)
    heights = [bar.get_height() for bar in plot(found).patches]  # as along the shaft
    limits = found.bearing_limits, found.limits
    assert heights == pytest.approx([1e6 * limits[k][i] for k, i in ((0, 0), (1, 0), (1, 1), (0, 1))])
