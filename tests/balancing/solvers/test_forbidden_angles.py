"""Forbidden angles: sectors, and weights against a brute-force search over fine angles."""

import minmax_problems
import numpy as np
import pytest
from cases import each_of
from helpers.limited_problems import least_squares_cone, minmax_cone
from hypothesis import given
from hypothesis import strategies as st

from balancing.data.limits import Limits
from balancing.solvers.cone import InfeasibleError, problem
from balancing.solvers.forbidden_angles import allowed_sectors, solve_sectors, stands_in
from balancing.solvers.least_squares_minmax import solve

TURN = 2 * np.pi
seeds = st.integers(0, 2**32 - 1)
arcs = st.lists(st.tuples(st.floats(-10, 10), st.floats(0.01, TURN)), min_size=1, max_size=4)


def forbidden_at(angle, forbidden, margin):
    """Whether an angle lies within an arc, further than the margin from its ends (negative: up to it)."""
    return any(margin < np.mod(angle - start, TURN) < width - margin for start, width in forbidden)


@each_of(
    ("forbidden", "allowed"),
    [
        ([(0.0, 1.0)], [(1 + TURN - 1 - np.pi, np.pi), (1.0, np.pi)]),
        ([(0.0, 4.0)], [(4.0, TURN - 4)]),
        ([(5.0, 4.0)], [(9 - TURN, 5 - 9 + TURN)]),  # passes 0
        ([(0.0, 2.0), (1.0, 3.0), (5.0, 1.0)], [(4.0, 1.0), (6.0, TURN - 6)]),
        ([(0.0, 2.0), (2.0, 2.0)], [(4.0, TURN - 4)]),  # nothing between arcs that touch
        ([(0.0, TURN)], []),
        ([(0.0, 4.0), (3.0, 4.0)], []),
        ([(-1.0, 2.0), (2.0, 1.0)], [(1.0, 1.0), (3.0, TURN - 4)]),
        ([(1.0, 4.0), (2.0, 1.0)], [(5.0, TURN - 4)]),  # one within another
    ],
)
def test_sectors_of_forbidden_arcs(forbidden, allowed):
    found = allowed_sectors(forbidden)
    assert sorted(found) == [pytest.approx(pair) for pair in sorted(allowed)]


def test_nothing_forbidden():
    assert allowed_sectors([]) is None
    assert stands_in(1 + 1j, None)
    assert stands_in(0j, ())
    assert not stands_in(1j, ())


@given(arcs)
def test_the_sectors_are_what_the_arcs_leave(forbidden):
    sectors = allowed_sectors(forbidden)
    for angle in np.linspace(0, TURN, 200):
        weight = np.exp(1j * angle)
        if stands_in(weight, sectors):
            assert not forbidden_at(angle, forbidden, 1e-6)
        else:
            assert forbidden_at(angle, forbidden, -1e-6)
    assert all(0 < width <= np.pi and 0 <= start < TURN for start, width in sectors)


def brute(W, Y, sectors, largest, minmax):
    """Smallest objective with the weight on a grid of allowed angles and sizes."""
    best = np.inf
    for start, width in sectors:
        for angle in start + width * np.linspace(0, 1, 61):
            D = np.linspace(0, largest, 61) * np.exp(1j * angle)
            r = np.abs(Y[:, None] + W[:, None] * D)
            value = r.max(axis=0) if minmax else np.linalg.norm(r, axis=0)
            best = min(best, float(value.min()))
    return best


@pytest.mark.parametrize("minmax", [True, False])
@pytest.mark.parametrize("seed", range(12))
def test_one_plane_against_every_angle(seed, minmax):
    rng = np.random.default_rng(seed)
    W, Y = minmax_problems.normal(rng, 5), minmax_problems.normal(rng, 5)
    forbidden = [(rng.uniform(0, TURN), rng.uniform(0.5, 3)) for _ in range(rng.integers(1, 4))]
    sectors = allowed_sectors(forbidden)
    largest = float(abs(np.vdot(W, Y) / np.vdot(W, W)) * rng.uniform(0.7, 2))
    whole = problem(W[:, None], Y, None, [largest], minmax=minmax)
    found = solve_sectors(whole, [sectors])
    assert stands_in(found.weights[0], sectors)
    assert found.gap < 1e-7
    expected = brute(W, Y, sectors, largest, minmax)
    assert found.bound <= expected  # no weight of the grid is better
    assert found.objective == pytest.approx(expected, rel=1e-2)  # and the grid is fine


@pytest.mark.parametrize("minmax", [True, False])
@pytest.mark.parametrize("seed", range(8))
def test_every_choice_of_sectors(seed, minmax):
    """Three planes of two or three sectors: the best of all combinations, tried one by one."""
    rng = np.random.default_rng(seed)
    W, Y = minmax_problems.normal(rng, (7, 3)), minmax_problems.normal(rng, 7)
    best = np.linalg.lstsq(W, -Y, rcond=None)[0]
    forbidden = [[(np.angle(b) - rng.uniform(0.1, 0.6), 1.0), (np.angle(b) + 2, 0.5)] for b in best]
    sectors = [allowed_sectors(f) for f in forbidden]
    whole = problem(W, Y, minmax=minmax)
    found = solve_sectors(whole, sectors)
    solver = minmax_cone if minmax else least_squares_cone
    one_by_one = min(
        solver(W, Y, sectors=[a, b, c]).objective for a in sectors[0] for b in sectors[1] for c in sectors[2]
    )
    assert found.objective == pytest.approx(one_by_one, rel=1e-8)
    assert found.gap < 1e-7
    assert found.objective > solver(W, Y).objective
    assert all(stands_in(v, s) for v, s in zip(found.weights, sectors, strict=True))


def test_what_is_forbidden_altogether_is_zero():
    W, Y = [[1.0, 2.0], [3.0, 1.0], [1j, 1.0]], [1.0, 2.0, 3.0]
    none = ((0.0, TURN),)
    limits = Limits(np.full(2, np.inf), np.full((1, 3), np.inf), (none, ()))
    for method in ("least-squares", "minmax"):
        found = solve(W, Y, method=method, limits=limits)
        alone = solve(np.array(W)[:, 1:], Y, method=method)
        assert found.weights[0] == 0
        assert not found.active_weights[0]
        assert found.objective == pytest.approx(alone.objective, rel=1e-8)
    nowhere = Limits(np.full(2, np.inf), np.full((1, 3), np.inf), (none, none))
    assert (solve(W, Y, limits=nowhere).weights == 0).all()


def test_weight_zero_is_always_allowed():
    """All that helps is forbidden: from 90° to 270°, and −4 would be best."""
    limits = Limits(np.array([np.inf]), np.full((1, 1), np.inf), (((np.pi / 2, np.pi),),))
    found = solve([[1.0]], [4.0], limits=limits)
    assert abs(found.weights[0]) < 1e-6
    assert found.objective == pytest.approx(4, rel=1e-9)


def test_a_weight_that_stands_where_it_may_is_the_closed_form():
    limits = Limits(np.array([np.inf]), np.full((1, 2), np.inf), (((0.0, 3.0),),))
    found = solve([[1.0], [1.0]], [3.0, 5.0], limits=limits)
    assert found.gap is None
    assert found.weights[0] == pytest.approx(-4, rel=1e-14)


def test_no_allowed_angle_meets_the_limits():
    whole = problem([[1.0]], [4.0], residual=[3.0])
    with pytest.raises(InfeasibleError, match="allowed angles"):
        solve_sectors(whole, [allowed_sectors([(np.pi / 2, np.pi)])])
