"""One weight: in holes against trying everything; two masses, drilling, rounding against closed forms."""

import numpy as np
import pytest
from cases import each_of
from mountings import everything
from scipy.integrate import quad

from balancing.conventions import Labels
from balancing.holes import equal_holes, from_list
from balancing.one_weight import STEEL, combine, drill, split, two_positions
from balancing.piece_search import solve_discrete
from balancing.trials import Limits

GRAMS = Labels(weight_unit="g", weight_scale=1e3)


def problem(seed):
    """Small enough to try everything: odd and regular holes, stock, taken holes."""
    rng = np.random.default_rng(seed)
    H, K, per_hole = int(rng.integers(2, 6)), int(rng.integers(1, 3)), int(rng.integers(1, 3))
    taken = np.where(rng.random(H) < 0.2, 0.004, 0.0)
    taken[0] = 0.0
    holes = from_list(
        np.sort(rng.uniform(0, 2 * np.pi, H)) if seed % 2 else equal_holes(H, 0.3),
        rng.choice(np.arange(1, 9), K, replace=False) * 1e-3,
        per_hole=per_hole,
        stock=rng.integers(1, 4, K) if seed % 3 == 0 else None,
        taken=taken,
    )
    target = complex(rng.normal(), rng.normal()) * 0.01
    return target, holes


@each_of("seed", range(40))
def test_equal_to_trying_everything(seed):
    target, holes = problem(seed)
    vectors, number, _ = everything(holes)
    every = [
        (round(float(abs(vector - target)), 11), int(n)) for vector, n in zip(vectors, number, strict=True)
    ]
    found = split(target, holes)
    assert (round(abs(found.error), 11), found.pieces) == min(every)
    assert found.mounting.vector - target == pytest.approx(found.error, abs=1e-15)
    assert (found.mounting.counts.sum(axis=1) <= holes.per_hole).all()
    assert not found.mounting.amounts[~holes.free].any()
    few = split(target, holes, good_enough=0.2)
    errors = [abs(one.error) for one in (*few.fewer, few)]
    assert errors == sorted(errors, reverse=True)
    if few.pieces:
        assert min(error for error, n in every if n < few.pieces) > 0.2 * abs(target) or few.pieces > 2


def test_the_published_split_on_holes():
    # the example of hsbalance, proven by branch and bound
    target = 0.2437 * np.exp(0.937j)
    found = split(target, from_list(equal_holes(20), [0.09]))
    assert (found.relative_error, found.pieces) == (pytest.approx(0.005829541398759976, rel=1e-6), 6)


def test_fewer_pieces_stand_below_what_is_proposed():
    holes = from_list(-equal_holes(12), [0.001, 0.002, 0.005], per_hole=2)
    few = split(0.0109 * np.exp(0.1j), holes, good_enough=0.2)
    assert few.pieces == 2
    assert few.relative_error <= 0.2
    (one,) = few.fewer
    assert (one.pieces, one.relative_error > 0.5) == (1, True)
    against = Labels(weight_unit="g", weight_scale=1e3, angles="against rotation")
    assert few.lines(against)[-2:] == ["With fewer pieces:", "  1: error 55 %: 5 g in hole 1 (0°)"]
    mounted = few.to_dict(against)["mounted"]
    assert mounted["mass"] == pytest.approx(1e3 * abs(few.mounting.vector))
    assert mounted["angle_deg"] == pytest.approx(-np.degrees(np.angle(few.mounting.vector)) % 360)


@pytest.mark.parametrize("seed", range(8))
def test_free_amounts_in_steps_equal_trying_everything(seed):
    rng = np.random.default_rng(seed)
    step, H = 0.5, int(rng.integers(2, 7))
    angles = np.sort(rng.uniform(0, 2 * np.pi, H))
    limit = float(rng.uniform(2, 5)) if seed % 2 else np.inf
    limits = Limits(np.array([limit]), np.full((1, 1), np.inf), ((),))
    target = complex(rng.normal(), rng.normal()) * 3
    multiples, best = np.arange(0, 61) * step, np.inf
    for g, h in [(k, (k + 1) % H) for k in range(H)]:
        if np.mod(angles[h] - angles[g], 2 * np.pi) <= 2 * np.pi / 3 + 1e-6:
            vectors = multiples[:, None] * np.exp(1j * angles[g]) + multiples * np.exp(1j * angles[h])
        else:
            vectors = multiples[:, None] * np.exp(1j * angles[[g, h]])
        best = min(best, np.abs(vectors[np.abs(vectors) <= limit] - target).min())
    nearest = solve_discrete([[1.0]], [-target], [from_list(angles, step=step)], limits=limits)
    assert nearest.objective == pytest.approx(best, abs=1e-9)


@each_of(
    "target, degrees, most, vector",
    [
        (3 + 4j, [0, 90, 180, 270], np.inf, 3 + 4j),
        (3 + 4j, [0, 90], np.inf, 3 + 4j),
        (3 + 4j, [0, 90, 200], 2.5, 1.5 + 2j),
        # nothing beyond the last hole: the projection on it
        (2 * np.exp(2j * np.pi / 3), [0, 75], np.inf, np.sqrt(2) * np.exp(1j * np.radians(75))),
    ],
)
def test_free_amounts_fill_the_sector_between_neighbours(target, degrees, most, vector):
    limits = Limits(np.array([most]), np.full((1, 1), np.inf), ((),))
    nearest = solve_discrete([[1.0]], [-target], [from_list(np.radians(degrees))], limits=limits)
    assert nearest.weights[0] == pytest.approx(vector, abs=0.02)
    assert abs(nearest.weights[0]) <= most


def test_what_is_mounted_counts_for_the_largest_weight():
    # 20 g are there at 0°, the plane may have 15: only something opposite makes it admissible
    limits = Limits(np.array([0.015]), np.full((1, 1), np.inf), ((),))
    holes = from_list(np.radians([0, 120, 180, 240]), [0.005], taken=[0.02, 0, 0, 0])
    [mounting] = solve_discrete([[1.0]], [-0.01], [holes], limits=limits).mountings
    assert mounting.amounts.tolist() == [0.0, 0.0, 0.005, 0.0]
    for options in ({"pieces": [0.005], "taken": [0.02, 0]}, {"step": 0.005, "taken": [0.02, 0]}):
        with pytest.raises(ValueError, match="no admissible weight at all"):
            solve_discrete([[1.0]], [-0.01], [from_list(np.radians([0, 10]), **options)], limits=limits)


@pytest.mark.parametrize("diameter", [0.004, 0.008, 0.012])
@pytest.mark.parametrize("depth", [0.004, 0.012, 0.045])
def test_a_hole_takes_away_what_the_integral_over_its_depth_says(diameter, depth):
    slope = np.tan(np.radians(59))

    def area(z):  # the tip is at `depth`, the radius there grows by the tangent of half its angle
        return np.pi * min(diameter / 2, (depth - z) * slope) ** 2

    def integral(lever):
        knee = depth - diameter / 2 / slope
        return STEEL * quad(lambda z: area(z) * lever(z), 0, depth, points=[knee], epsabs=0, epsrel=1e-11)[0]

    target = integral(lambda z: 0.1 - z) * np.exp(1j)
    found = drill(target, 0.1, diameter)
    assert found.tip_depth == pytest.approx(depth, rel=1e-9)
    assert found.mass == pytest.approx(integral(lambda _: 1.0), rel=1e-9)
    assert found.to_dict(GRAMS)["unbalance_kg_m"] == pytest.approx(abs(target))
    light = drill(target * 2700 / STEEL, 0.1, diameter, 2700.0)
    assert (light.depth, light.mass) == pytest.approx((found.depth, found.mass * 2700 / STEEL), rel=1e-9)


@each_of(
    ("call", "words"),
    [
        (lambda: drill(1e-4, 0.0, 0.008), "positive"),
        (lambda: drill(1.0, 0.1, 0.008), "larger drill"),
        (lambda: drill(2e-6, 0.1, 0.008), "smaller drill"),
        (
            lambda: split(1.0, from_list([0.0, 1.0], np.arange(1, 12) * 0.01, per_hole=9)),
            "too many combinations",
        ),
        (lambda: combine([]), "no weight"),
        (lambda: two_positions(0.051, 0.02, 0.03), r"reach from 0\.01 to 0\.05"),
    ],
)
def test_what_cannot_be_is_refused(call, words):
    with pytest.raises(ValueError, match=words):
        call()


@each_of(
    "target, a, b", [(0.02 + 0.01j, 0.03, 0.02), (-0.04j, 0.01, 0.05), (0.05j, 0.02, 0.03), (0, 0.02, 0.02)]
)
def test_two_masses_make_the_target_in_two_mirrored_ways(target, a, b):
    found = two_positions(target, a, b)
    np.testing.assert_allclose(found.weights().sum(axis=1), [target, target], rtol=1e-9, atol=1e-15)
    assert found.to_dict(GRAMS)["masses"] == pytest.approx([1e3 * a, 1e3 * b])
    if target:
        mirrored = np.exp(1j * (2 * np.angle(target) - found.angles[0]))
        np.testing.assert_allclose(np.exp(1j * found.angles[1]), mirrored, atol=1e-7)
