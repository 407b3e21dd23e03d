"""Splitting one weight: equal to trying everything, and what is said about it."""

import itertools

import numpy as np
import pytest
from cases import each_of
from repetitions import FULL

from balancing.data.conventions import Labels
from balancing.mounting.holes import WIDEST, equal_holes, from_list
from balancing.mounting.split import fewer_pieces, percent, split

GRAMS = Labels(weight_unit="g", weight_scale=1e3)


def everything(target, holes, most):
    """Error and pieces of every choice, by trying it."""
    K = len(holes.pieces)
    one = [c for c in itertools.product(range(holes.per_hole + 1), repeat=K) if sum(c) <= holes.per_hole]
    for combination in itertools.product(*[one if free else [(0,) * K] for free in holes.free]):
        counts = np.array(combination)
        if holes.stock is not None and (counts.sum(axis=0) > holes.stock).any():
            continue
        if most is not None and counts.sum() > most:
            continue
        vector = (counts @ holes.pieces) @ np.exp(1j * holes.angles)
        if not holes.allows(vector):
            continue
        yield round(float(abs(vector - target)), 11), int(counts.sum())


def exhaustive(target, holes, most):
    """The smallest error and, at it, the fewest pieces."""
    return min(everything(target, holes, most))


def fewest_of_all(target, holes, most, times=1.2):
    """Of all choices within 1.2 times of the least error: the fewest pieces, the least error of so many."""
    found = list(everything(target, holes, most))
    enough = times * min(found)[0] + 2e-11
    return min((pieces, error) for error, pieces in found if error <= enough)


def problem(seed):
    """Small enough to try everything: odd and regular holes, stock, taken holes, limits."""
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
        max_weight=float(rng.uniform(0.008, 0.02)) if seed % 4 == 0 else np.inf,
    )
    target = complex(rng.normal(), rng.normal()) * 0.01
    return target, holes, int(rng.integers(1, 5)) if seed % 5 == 0 else None


@each_of("seed", range(80))
def test_equal_to_trying_everything(seed):
    target, holes, most = problem(seed)
    expected = exhaustive(target, holes, most)
    found = split(target, holes, most_pieces=most)
    assert (round(abs(found.error), 11), found.pieces) == expected
    assert found.proven
    few = split(target, holes, most_pieces=most, within=1.2)
    assert (few.pieces, pytest.approx(abs(few.error), abs=2e-11)) == fewest_of_all(target, holes, most)
    assert few.proven
    assert abs((few.best or few).error) == pytest.approx(abs(found.error))
    assert found.mounting.vector - target == pytest.approx(found.error, abs=1e-15)
    assert (found.mounting.counts.sum(axis=1) <= holes.per_hole).all()
    assert not found.mounting.amounts[~holes.free].any()


def test_the_sum_farthest_along_a_row_is_not_lost_to_rounding():
    # it was, and what is worse was called the nearest (proven)
    holes = from_list(equal_holes(5), [0.015, 0.019])
    weight = 0.010743398576858063 * np.exp(1j * np.radians(318))
    found = split(weight, holes)
    assert abs(found.error) == pytest.approx(exhaustive(weight, holes, None)[0], abs=1e-10)


@pytest.mark.parametrize("reach", [0.5, 1.0, 5.0])
def test_a_scarce_stock_out_of_reach_equals_trying_everything(reach):
    angles = np.sort(np.random.default_rng(3).uniform(0, 2 * np.pi, 7))
    holes = from_list(angles, [0.003, 0.005], per_hole=1, stock=[2, 1])
    target = 0.011 * reach * np.exp(0.7j)
    found = split(target, holes)
    assert (round(abs(found.error), 11), found.pieces) == exhaustive(target, holes, None)
    assert found.proven


def test_regular_holes_beat_every_random_choice_and_agree_with_one_hole_more():
    rng = np.random.default_rng(1)
    target = 0.035 * np.exp(2j)
    holes = from_list(equal_holes(24), [0.01, 0.02])
    found = split(target, holes)
    assert found.proven
    ways = np.exp(1j * holes.angles)
    tried = rng.choice([0.0, 0.01, 0.02], (200_000, 24)) @ ways
    assert abs(found.error) <= np.abs(tried - target).min()
    # a hole that can be used in addition never makes it worse
    fewer = split(target, from_list(equal_holes(24), [0.01, 0.02], taken=np.eye(24)[5] * 0.01))
    assert abs(fewer.error) >= abs(found.error)


def test_opposite_pieces_are_not_mounted_for_nothing():
    found = split(0.02, from_list(equal_holes(36), [0.01, 0.02]))
    assert found.lines(GRAMS) == ["1 × 20 g in hole 1 (at 0°)"]
    assert split(0.0, from_list(equal_holes(36), [0.01])).pieces == 0


@pytest.mark.full
def test_more_than_can_be_listed_has_an_honest_bound():
    angles = np.sort(np.random.default_rng(5).uniform(0, 2 * np.pi, 40 if FULL else 28))
    holes = from_list(angles, [0.01, 0.02, 0.03], per_hole=2, stock=[9, 9, 9])
    found = split(0.05j, holes)
    assert not found.proven
    assert found.bound <= abs(found.error) < 2e-3 * 0.05
    assert (found.mounting.counts.sum(axis=0) <= 9).all()
    assert "more combinations than can be tried" in found.answer(GRAMS).brief()
    plenty = split(0.05j, from_list(angles, [0.01, 0.02, 0.03], per_hole=2))
    assert abs(plenty.error) < 1e-4 * 0.05
    # a plane limited to less than the target: nothing better than the limit's circle, nearly reached
    limited = split(0.05j, from_list(angles, [0.01, 0.02, 0.03], per_hole=2, max_weight=0.03))
    assert abs(limited.mounting.vector) <= 0.03 * (1 + 1e-9)
    assert limited.bound == pytest.approx(0.02, rel=1e-9)
    assert abs(limited.error) == pytest.approx(0.02, rel=1e-3)
    # out of reach of all holes: everything on its side is full, which the bound proves
    far = split(9.0, from_list(angles, [0.01, 0.02, 0.03], per_hole=2))
    full = 0.06 * np.exp(1j * angles[np.cos(angles) > 0]).sum()
    assert abs(far.error) == pytest.approx(abs(full - 9.0), rel=1e-3)
    assert far.bound <= abs(far.error)


def test_what_a_few_pieces_make_is_no_better_where_not_every_choice_can_be_tried():
    holes = from_list(equal_holes(36, np.radians(200.0)), [3.0, 24.0])
    target = 6.863 * np.exp(1j * np.radians(286.8)) - 19.56
    found = split(target, holes, most_pieces=6)
    assert not found.proven
    assert found.bound <= abs(found.error) <= min(abs(one.error) for one in fewer_pieces(found))


def test_a_scarce_stock_among_many_holes_out_of_reach_is_answered():
    holes = from_list(equal_holes(36), [1.5, 7.5], stock=[8, 2])
    turned = np.exp(1j * np.radians([20.0, 292.0, 200.0]))
    found = split(complex([42.63, -9.0, -6.0] @ turned), holes)
    assert (found.mounting.counts.sum(axis=0) <= [8, 2]).all()
    assert found.bound <= abs(found.error) < 27.41


def test_fewer_pieces_are_worse_in_order():
    found = split(0.035 * np.exp(2.1j), from_list(equal_holes(24), [0.01, 0.02]))
    ladder = fewer_pieces(found)
    assert [one.pieces for one in ladder] == sorted({one.pieces for one in ladder})
    errors = [*(abs(one.error) for one in ladder), abs(found.error)]
    assert errors == sorted(errors, reverse=True)
    enough = split(found.target, found.holes, good_enough=0.03)
    assert enough.relative_error <= 0.03
    below = [one for one in ladder if one.pieces < enough.pieces]
    assert below
    assert all(one.relative_error > 0.03 for one in below)


@pytest.mark.parametrize("seed", range(20))
def test_free_amounts_in_steps_equal_trying_everything(seed):
    rng = np.random.default_rng(seed)
    step, H = 0.5, int(rng.integers(2, 7))
    angles = np.sort(rng.uniform(0, 2 * np.pi, H))
    limit = float(rng.uniform(2, 5)) if seed % 2 else np.inf
    holes = from_list(angles, step=step, max_weight=limit)
    target = complex(rng.normal(), rng.normal()) * 3
    multiples = np.arange(0, 61) * step
    best = np.inf
    for g, h in [(k, (k + 1) % H) for k in range(H)]:
        if np.mod(angles[h] - angles[g], 2 * np.pi) <= WIDEST:
            vectors = multiples[:, None] * np.exp(1j * angles[g]) + multiples * np.exp(1j * angles[h])
        else:
            vectors = multiples[:, None] * np.exp(1j * angles[[g, h]])
        vectors = vectors[holes.allows(vectors)]
        best = min(best, np.abs(vectors - target).min())
    assert abs(split(target, holes).error) == pytest.approx(best, abs=1e-9)


def test_free_amounts_fill_the_sector_between_neighbours():
    holes = from_list(np.radians([0, 90, 200, 260]))
    found = split(3 + 4j, holes)
    np.testing.assert_allclose(found.mounting.amounts, [3, 4, 0, 0], atol=1e-12)
    assert abs(found.error) < 1e-12
    # 300° lies in the sector from 260° to 360°
    assert abs(split(2 * np.exp(1j * np.radians(300)), holes).error) < 1e-12
    # limited: the nearest vector of that size
    limited = split(3 + 4j, from_list(np.radians([0, 90, 200]), max_weight=2.5))
    assert limited.mounting.vector == pytest.approx(1.5 + 2j)
    # a sector of more than half a turn cannot be filled: the nearest is along the nearer hole
    open_ = split(2 * np.exp(1j * np.radians(120)), from_list(np.radians([0, 75])))
    assert open_.mounting.vector == pytest.approx(2 * np.cos(np.radians(45)) * np.exp(1j * np.radians(75)))


def test_what_is_mounted_counts_for_the_largest_weight():
    # 20 g are there at 0°, the plane may have 15: only something opposite makes it admissible
    holes = from_list(np.radians([0, 120, 180, 240]), [0.005], taken=[0.02, 0, 0, 0], max_weight=0.015)
    found = split(0.01, holes)
    assert found.lines(GRAMS) == ["1 × 5 g in hole 3 (at 180°)"]
    hopeless = from_list(np.radians([0, 10]), [0.005], taken=[0.02, 0], max_weight=0.015)
    with pytest.raises(ValueError, match="no admissible weight at all"):
        split(0.01, hopeless)
    with pytest.raises(ValueError, match="no admissible weight at all"):
        split(0.01, from_list(np.radians([0, 10]), step=0.005, taken=[0.02, 0], max_weight=0.015))


def test_out_of_reach_no_fewer_pieces_do():
    """Too many vectors are within reach to be listed: one number of pieces after the other."""
    holes = from_list(equal_holes(24, 0.1), [0.01, 0.02])
    found = split(0.3, holes, within=1.2)
    assert found.pieces < found.best.pieces
    assert abs(found.error) <= 1.2 * abs(found.best.error)
    assert abs(split(0.3, holes, most_pieces=found.pieces - 1).error) > 1.2 * abs(found.best.error)
    nothing = split(2.0, from_list([0.0], [0.01, 0.02]), within=1.2)
    assert (nothing.pieces, nothing.best.pieces) == (0, 1)
    assert nothing.lines(GRAMS) == ["nothing is mounted"]
    assert "1 piece would leave an error of 99 % (--best)." in nothing.answer(GRAMS).brief()


def test_words_follow_the_angles_of_the_job():
    against = Labels(weight_unit="g", weight_scale=1e3, angles="against rotation")
    holes = from_list(-equal_holes(12), [0.01], per_hole=2)
    found = split(0.02 * np.exp(-1j * np.radians(120)), holes)
    assert found.lines(against) == ["2 × 10 g in hole 5 (at 120°)"]
    document = found.to_dict(against)
    assert document["holes"][0]["hole"] == "5"
    assert document["holes"][0]["pieces"] == [{"count": 2, "mass": 10.0}]
    assert document["mounted"] == {"mass": 20.0, "angle_deg": 120.0}
    assert document["relative_error"] < 1e-12


@pytest.mark.parametrize(
    ("target", "options", "words"),
    [
        (np.nan, {}, "must be finite"),
        (1.0, {"most_pieces": 0}, "1 or more"),
        (1.0, {"good_enough": -0.1}, "must not be negative"),
    ],
)
def test_bad_input_is_refused(target, options, words):
    with pytest.raises(ValueError, match=words):
        split(target, from_list([0.0, 1.0], [0.01]), **options)
    with pytest.raises(ValueError, match="too many combinations"):
        split(1.0, from_list([0.0, 1.0], np.arange(1, 12) * 0.01, per_hole=9))


def test_percent_reads_plainly():
    assert [percent(v) for v in (1.0, 0.101, 0.0123, 2e-6)] == ["100", "10", "1.2", "0.0002"]
