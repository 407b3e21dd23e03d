"""Material taken away, and weights as hands mount them, against closed forms and numerical integrals."""

import numpy as np
import pytest
from cases import each_of
from scipy.integrate import quad

from balancing.mounting.combine_trim_round import combine, round_to, rounded, trim, two_positions
from balancing.mounting.material_removal import Drill, drill_holes, grind, opposite, row_factor

STEEL = 7850.0


@pytest.mark.parametrize("way", ["radial", "axial"])
@pytest.mark.parametrize("tip", [60.0, 118.0, 140.0, 180.0])
@pytest.mark.parametrize("depth", [0.0008, 0.003, 0.012, 0.045])
def test_a_hole_takes_away_what_the_integral_over_its_depth_says(way, tip, depth):
    drill = Drill(0.008, 0.1, STEEL, way, np.radians(tip))
    slope = np.tan(np.radians(tip) / 2) if tip < 180 else np.inf

    def area(z):  # the tip is at `depth`, the radius there grows by the tangent of half its angle
        return np.pi * min(0.004, (depth - z) * slope if np.isfinite(slope) else 0.004) ** 2

    knee = [max(depth - drill.tip_height, 0.0)]
    mass = STEEL * quad(area, 0, depth, points=knee, epsabs=0, epsrel=1e-11)[0]

    def lever(z):
        return 0.1 - z if way == "radial" else 0.1

    moment = STEEL * quad(lambda z: area(z) * lever(z), 0, depth, points=knee, epsabs=0, epsrel=1e-11)[0]
    np.testing.assert_allclose(drill.removed(depth), (mass, moment), rtol=1e-9)
    assert drill.depth_for(moment) == pytest.approx(depth, rel=1e-9)


def test_a_flat_axial_hole_by_hand():
    # 10 g at 50 mm with a 10 mm end mill: V = 10e-3/7850, depth V/(π 25e-6)
    found = drill_holes(0.01 * 0.05, Drill(0.01, 0.05, STEEL, "axial", np.pi))
    assert found.depth == pytest.approx(0.01 / STEEL / (np.pi * 25e-6), rel=1e-12)
    assert found.mass == pytest.approx(0.01, rel=1e-12)
    np.testing.assert_allclose(found.angles, [np.pi])


def test_deep_radial_material_does_less_than_shallow_material():
    drill = Drill(0.008, 0.1, STEEL)
    mass, moment = drill.removed(0.04)
    assert 0.078 < moment / mass / drill.radius * 0.1 < 0.084  # the hole's centre of mass lies near 81 mm


@pytest.mark.parametrize("way", ["radial", "axial"])
def test_a_row_of_holes_sums_exactly_to_the_weight(way):
    weight = 3.5e-3 * np.exp(1j * np.radians(120))
    found = drill_holes(weight, Drill(0.008, 0.1, STEEL, way), max_depth=0.012)
    n = len(found.angles)
    assert n > 2
    assert found.depth <= 0.012
    total = -(found.unbalance * np.exp(1j * found.angles)).sum()
    assert total == pytest.approx(weight, rel=1e-10)
    assert found.weight == pytest.approx(weight, rel=1e-10)
    step = 1.5 * 0.008 / 0.1
    assert found.unbalance * row_factor(n, step) == pytest.approx(abs(weight), rel=1e-10)
    assert np.angle(np.exp(1j * found.angles).sum()) == pytest.approx(np.radians(-60))
    # one hole fewer would be too deep
    fewer = drill_holes(weight, Drill(0.008, 0.1, STEEL, way), count=n - 1)
    assert fewer.depth > 0.012


def test_row_factor_is_the_sum_of_unit_vectors():
    for n, step in ((1, 0.3), (4, 0.2), (7, 0.5), (5, 0.0)):
        direct = abs(np.exp(1j * step * np.arange(n)).sum())
        assert row_factor(n, step) == pytest.approx(direct, rel=1e-12)


def test_grinding_stands_opposite():
    found = grind(3.5e-3j, 0.1)
    assert found.mass == pytest.approx(0.035)
    assert found.angle == pytest.approx(1.5 * np.pi)
    assert opposite(2 + 1j) == -2 - 1j


@each_of(
    ("call", "words"),
    [
        (lambda: Drill(0.008, 0.0, STEEL), "radius must be positive"),
        (lambda: Drill(-0.008, 0.1, STEEL), "diameter of the drill must be positive"),
        (lambda: Drill(0.008, 0.1, np.nan), "density must be positive"),
        (lambda: Drill(0.3, 0.1, STEEL), "does not fit"),
        (lambda: Drill(0.008, 0.1, STEEL, "sideways"), "'radial' or 'axial'"),
        (lambda: Drill(0.008, 0.1, STEEL, "axial", 4.0), "tip angle"),
        (lambda: Drill(0.008, 0.1, STEEL).depth_for(1.0), "even down to the centre"),
        (lambda: Drill(0.008, 0.1, STEEL).depth_for(-1.0), "not negative"),
        (lambda: drill_holes(1.0, Drill(0.008, 0.1, STEEL)), "cannot be taken away"),
        (lambda: drill_holes(3e-3, Drill(0.008, 0.1, STEEL), max_depth=0.001), "larger drill or depth"),
        (lambda: drill_holes(3e-3, Drill(0.008, 0.1, STEEL), max_depth=0.0), "largest depth"),
        (lambda: drill_holes(3e-3, Drill(0.008, 0.1, STEEL), count=4, spacing=0.06), "into each other"),
        (lambda: drill_holes(3e-3, Drill(0.008, 0.1, STEEL), spacing=4.0), "spacing"),
        (lambda: drill_holes(3e-3, Drill(0.008, 0.1, STEEL), count=0), "number of holes"),
        (lambda: drill_holes(np.nan, Drill(0.008, 0.1, STEEL)), "finite"),
        (lambda: grind(1.0, 0.0), "radius must be positive"),
    ],
)
def test_impossible_removals_are_refused(call, words):
    with pytest.raises(ValueError, match=words):
        call()


def test_two_masses_make_the_target_in_two_mirrored_ways():
    rng = np.random.default_rng(7)
    for _ in range(40):
        a, b = rng.uniform(0.01, 0.05, 2)
        size = rng.uniform(abs(a - b), a + b)
        target = size * np.exp(1j * rng.uniform(0, 2 * np.pi))
        found = two_positions(target, a, b)
        np.testing.assert_allclose(found.vectors(), [target, target], rtol=1e-9)
        mirrored = np.exp(1j * (2 * np.angle(target) - found.angles[0]))
        np.testing.assert_allclose(np.exp(1j * found.angles[1]), mirrored, atol=1e-9)
        assert ((found.angles >= 0) & (found.angles < 2 * np.pi)).all()


def test_two_masses_at_the_ends_of_their_range():
    np.testing.assert_allclose(two_positions(0.05j, 0.02, 0.03).angles, np.full((2, 2), np.pi / 2), atol=1e-7)
    cosines = np.cos(two_positions(0.01, 0.02, 0.03).angles)
    np.testing.assert_allclose(cosines, [[-1, 1], [-1, 1]], atol=1e-12)
    np.testing.assert_allclose(two_positions(0.0, 0.02, 0.02).vectors(), [0, 0], atol=1e-15)
    with pytest.raises(ValueError, match=r"reach from 0\.01 to 0\.05"):
        two_positions(0.051, 0.02, 0.03)
    with pytest.raises(ValueError, match=r"reach from 0\.01 to 0\.05"):
        two_positions(0.009, 0.02, 0.03)
    with pytest.raises(ValueError, match="positive"):
        two_positions(0.01, 0.0, 0.03)


def test_combining_and_trimming_are_inverse():
    weights = [3 + 1j, -2j, 0.5]
    assert combine(weights) == 3.5 - 1j
    assert trim(1 + 1j, weights) == pytest.approx(-2.5 + 2j)
    assert combine([*weights, trim(1 + 1j, weights)]) == pytest.approx(1 + 1j)
    thirds = np.exp(2j * np.pi * np.arange(3) / 3)
    assert combine(thirds) == 0
    assert trim(2.0, []) == 2.0
    for bad in ([], [np.nan]):
        with pytest.raises(ValueError, match="weight"):
            combine(bad)


def test_rounding_to_a_scale():
    assert round_to(34.7, 0.5) == 34.5
    assert round_to(0.34, 0.1) == 0.3
    assert round_to(1.23, 0.0) == 1.23
    for bad in (-0.1, np.nan):
        with pytest.raises(ValueError, match="step"):
            round_to(1.0, bad)
    with pytest.raises(ValueError, match="finite"):
        round_to(np.inf, 0.1)
    with pytest.raises(ValueError, match="angle"):
        rounded(1.0, 0.0, 7.0)


def test_the_worst_rounding_error_is_the_largest_that_occurs():
    rng = np.random.default_rng(3)
    found = []
    for phase in rng.uniform(0, 2 * np.pi, 4000):
        # sizes a hair inside the middle between two marks are the worst
        one = rounded((3.0 + 0.4999) * np.exp(1j * phase), 1.0, np.radians(10))
        assert abs(one.error) <= one.worst * (1 + 1e-12)
        assert one.relative_error == pytest.approx(abs(one.error) / 3.4999)
        found.append(abs(one.error) / one.worst)
    exact = rounded(3.5, 1.0, np.radians(10)).worst
    assert exact == pytest.approx(abs(4.0 * np.exp(1j * np.radians(5)) - 3.5), rel=1e-12)
    assert max(found) > 0.95
    assert rounded(2.3 + 1j).error == 0
