"""Weights within limits: optima of another modelling layer, angles tried one by one, conflicts in words."""

import json
from itertools import product
from pathlib import Path

import minmax_problems
import numpy as np
import pytest
from cases import each_of
from hypothesis import given, settings
from hypothesis import strategies as st

from balancing.cones import (
    Bounds,
    InfeasibleError,
    allowed_sectors,
    explain,
    nearest,
    project,
    smallest_maximum,
    stands_in,
    within,
)
from rotorid.regression import stretch

TURN = 2 * np.pi
FILE = Path(__file__).resolve().parents[1] / "data" / "minmax_reference.json"
ANSWERS = [a for a in json.loads(FILE.read_text(encoding="utf-8"))["answers"] if a["kind"] != "budget"]
seeds = st.integers(0, 2**32 - 1)


def bounds(W, Y, most=None, residual=None, forbidden=None):
    N, P = np.shape(W)
    arcs = forbidden or [()] * P
    return Bounds(
        np.asarray(W, dtype=complex),
        np.asarray(Y, dtype=complex),
        np.broadcast_to(np.inf if residual is None else residual, N).astype(float),
        np.broadcast_to(np.inf if most is None else most, P).astype(float),
        tuple(allowed_sectors(a) for a in arcs),
    )


def solved(whole, *, minmax, row_weights=None, **more):
    """By min–max, or by least squares as the nearest weights to those without limits."""
    w = np.ones(len(whole.Y)) if row_weights is None else row_weights
    if minmax:
        return smallest_maximum(whole, w, **more)
    A = w[:, None] * whole.W
    best = np.linalg.lstsq(A, -w * whole.Y, rcond=None)[0]
    left = np.linalg.norm(w * (whole.Y + whole.W @ best))
    return nearest(whole, best, stretch(np.linalg.qr(A, mode="r")), left, **more)


@each_of("answer", ANSWERS, ids=lambda a: f"{a['method']}-{a['seed']}-{a['kind']}")
def test_equal_to_what_cvxpy_finds_and_within_every_limit(answer):
    case, minmax = minmax_problems.case(answer["seed"]), answer["method"] == "minmax"
    assert minmax_problems.fingerprint(case) == pytest.approx(answer["fingerprint"], rel=1e-12)
    whole = bounds(case.W, case.Y, case.max_weight, case.residual)
    optimum = solved(whole, minmax=minmax, row_weights=case.row_weights)
    assert optimum.objective == pytest.approx(answer["objective"], rel=1e-7)
    assert 0 <= optimum.gap < 1e-8
    assert within(whole, optimum.weights)
    left = case.row_weights * np.abs(case.Y + case.W @ optimum.weights)
    assert optimum.objective == pytest.approx(left.max() if minmax else np.linalg.norm(left), rel=1e-12)


@pytest.mark.parametrize(("N", "P"), [(24, 4), (120, 8), (600, 12)])
def test_the_gap_holds_for_readings_that_were_never_looked_at(monkeypatch, N, P):
    rng = np.random.default_rng(N)
    W, Y = minmax_problems.normal(rng, (N, P)), minmax_problems.normal(rng, N)
    few = solved(bounds(W, Y), minmax=True)
    assert few.gap < 1e-8
    monkeypatch.setattr("balancing.cones.FIRST", N)
    every = solved(bounds(W, Y), minmax=True)
    assert few.objective == pytest.approx(every.objective, rel=2e-8)
    assert (few.prices[:N] > 1e-6).sum() > P  # as many at least share the maximum


def test_by_hand():
    """Readings 3 and 5: |D| ≤ 1 leaves 2 and 4; the second at most 0.5 leaves 1.5 and 0.5."""
    for minmax, left in ((True, 4), (False, np.sqrt(20))):
        optimum = solved(bounds([[1.0], [1.0]], [3.0, 5.0], 1.0), minmax=minmax)
        assert optimum.weights[0] == pytest.approx(-1, abs=1e-7)
        assert optimum.objective == pytest.approx(left, rel=1e-8)
        limited = solved(bounds([[1.0], [1.0]], [3.0, 5.0], residual=[np.inf, 0.5]), minmax=minmax)
        assert limited.weights[0] == pytest.approx(-4.5, abs=1e-6)
        assert abs(5 + limited.weights[0]) <= 0.5
        assert limited.prices[1] > 0


@settings(max_examples=30)
@given(seeds, st.booleans(), st.floats(1e-8, 1e8), st.floats(1e-8, 1e8))
def test_units_do_not_matter(seed, minmax, amplitude, weight):
    rng = np.random.default_rng(seed)
    W, Y = minmax_problems.normal(rng, (10, 3)), minmax_problems.normal(rng, 10)
    most = 0.7 * np.abs(np.linalg.lstsq(W, -Y, rcond=None)[0])
    one = solved(bounds(W, Y, most), minmax=minmax)
    other = solved(bounds(W * (amplitude / weight), Y * amplitude, most * weight), minmax=minmax)
    assert other.objective == pytest.approx(one.objective * amplitude, rel=1e-7)


@each_of(
    ("forbidden", "allowed"),
    [
        ([(0.0, 1.0)], [(np.pi, np.pi), (1.0, np.pi)]),
        ([(5.0, 4.0)], [(9 - TURN, TURN - 4)]),  # passes 0
        ([(0.0, 2.0), (1.0, 3.0), (5.0, 1.0)], [(4.0, 1.0), (6.0, TURN - 6)]),
        ([(0.0, 2.0), (2.0, 2.0)], [(4.0, TURN - 4)]),  # nothing between arcs that touch
        ([(0.0, TURN)], []),
        ([(0.0, 4.0), (3.0, 4.0)], []),
        ([(1.0, 4.0), (2.0, 1.0)], [(5.0, TURN - 4)]),  # one within another
    ],
)
def test_sectors_of_forbidden_arcs(forbidden, allowed):
    assert sorted(allowed_sectors(forbidden)) == [pytest.approx(pair) for pair in sorted(allowed)]


@given(st.lists(st.tuples(st.floats(-10, 10), st.floats(0.01, TURN)), min_size=1, max_size=4))
def test_the_sectors_are_what_the_arcs_leave(forbidden):
    sectors = allowed_sectors(forbidden)
    for angle in np.linspace(0, TURN, 200):
        margin = -1e-6 if not stands_in(np.exp(1j * angle), sectors) else 1e-6
        inside = any(margin < (angle - start) % TURN < width - margin for start, width in forbidden)
        assert inside == (margin < 0)
    assert all(0 < width <= np.pi and 0 <= start < TURN for start, width in sectors)


@given(st.complex_numbers(max_magnitude=1e3), st.floats(-7, 7), st.floats(1e-3, np.pi))
def test_the_projection_on_a_sector_is_its_nearest_point(v, start, width):
    p = project(v, (start, width))
    rays = np.exp(1j * (start + np.linspace(0, width, 50)))
    along = np.maximum((np.conj(rays) * v).real, 0)
    assert abs(v - p) <= np.abs(v - along * rays).min() + 1e-9 * abs(v)


@pytest.mark.parametrize("minmax", [True, False])
@pytest.mark.parametrize("seed", range(8))
def test_every_choice_of_sectors(seed, minmax):
    rng = np.random.default_rng(seed)
    W, Y = minmax_problems.normal(rng, (7, 3)), minmax_problems.normal(rng, 7)
    best = np.angle(np.linalg.lstsq(W, -Y, rcond=None)[0])
    whole = bounds(
        W, Y, forbidden=[((a - w / 3, w),) for a, w in zip(best, rng.uniform(0.3, 3, 3), strict=True)]
    )
    optimum = solved(whole, minmax=minmax)
    each = [
        solved(whole._replace(sectors=tuple((s,) for s in chosen)), minmax=minmax).objective
        for chosen in product(*whole.sectors)
    ]
    assert optimum.objective == pytest.approx(min(each), rel=1e-8)
    assert optimum.gap < 1e-7
    assert within(whole, optimum.weights)
    assert optimum.objective > solved(bounds(W, Y), minmax=minmax).objective * (1 + 1e-6)


def words(*given, **limits):
    names = [f"sensor {name!r}" for name in "ABCDEF"]
    micrometres, grams = (lambda a: f"{a * 1e6:.3g} um"), (lambda m: f"{m * 1e3:.3g} g")
    return explain(bounds(*given, **limits), ["left", "right"], names, micrometres, grams)


@pytest.mark.parametrize(
    ("W", "Y", "limits", "text"),
    [
        (  # 5 g at 2 um per gram leave 30 um of 40 um
            [[2e-3, 0], [0, 1e-3], [0, 1e-3]],
            [40e-6, 3e-6, 3e-6],
            {"most": [5e-3, 5e-3], "residual": [20e-6, 20e-6, np.inf]},
            "with at most 5 g in plane 'left', sensor 'A' (limit 20 um) stays at 30 um at best; relaxing all "
            "amplitude limits 1.51 times works",
        ),
        (
            [[1, 0], [1, 0], [0, 1]],
            [30e-6, 50e-6, 1e-6],
            {"residual": [5e-6, 8e-6, np.inf]},
            "whatever the weights, sensor 'B' (limit 8 um) stays at 12.3 um and sensor 'A' (limit 5 um) "
            "stays at 7.69 um at best; relaxing all amplitude limits 1.54 times works",
        ),
        (
            np.eye(2),
            [40e-6, 1e-6],
            {"residual": 20e-6, "forbidden": [((np.pi / 2, np.pi),), ()]},
            "with the forbidden angles of plane 'left', sensor 'A' (limit 20 um) stays at 40 um at best; "
            "relaxing all amplitude limits 2.01 times works",
        ),
        (
            np.eye(2),
            [40e-6, 1e-6],
            {"residual": 20e-6, "most": [0, np.inf]},
            "with plane 'left' left empty, sensor 'A' (limit 20 um) stays at 40 um at best; relaxing all "
            "amplitude limits 2.01 times works",
        ),
        (
            np.eye(2),
            [40e-6, 1e-6],
            {"residual": 20e-6, "most": 0},
            "with plane 'left' left empty and plane 'right' left empty, sensor 'A' (limit 20 um) stays at "
            "40 um at best; relaxing all amplitude limits 2.01 times works",
        ),
    ],
)
def test_limits_that_conflict_are_named_with_the_least_relaxation(W, Y, limits, text):
    assert words(W, Y, **limits) == f"the limits cannot be met: {text}"


@pytest.mark.parametrize("largest", [0.0, 1e-17])
def test_limits_that_only_exact_numbers_reach(largest):
    rng = np.random.default_rng(11)
    W, Y = minmax_problems.normal(rng, (2, 2)), minmax_problems.normal(rng, 2)
    assert ("only to within rounding" if largest == 0 else "at best") in words(W, Y, residual=largest)
    with pytest.raises(InfeasibleError):
        solved(bounds(W, Y, residual=largest), minmax=False)
    assert np.abs(Y + W @ solved(bounds(W, Y, residual=1e-12), minmax=False).weights).max() <= 1e-12


@settings(max_examples=30)
@given(seeds, st.booleans(), st.booleans())
def test_the_least_relaxation_works_and_less_does_not(seed, forbid, heavy):
    rng = np.random.default_rng(seed)
    W, Y = minmax_problems.normal(rng, (7, 2)), minmax_problems.normal(rng, 7)
    best = solved(bounds(W, Y), minmax=True)
    arcs = [((float(np.angle(best.weights[0])) - 0.5, 1.0),), ()] if forbid else None
    most = 0.8 * np.abs(best.weights) if heavy else None
    L = best.objective * rng.uniform(0.5, 0.8, 7)
    text = explain(bounds(W, Y, most, L, arcs), ["1", "2"], [str(n) for n in range(7)])
    factor = float(text.split("relaxing all amplitude limits ")[1].split(" times")[0])
    for minmax in (True, False):
        wide = bounds(W, Y, most, factor * L, arcs)
        assert within(wide, solved(wide, minmax=minmax).weights)
        with pytest.raises(InfeasibleError):
            solved(bounds(W, Y, most, 0.988 * factor * L, arcs), minmax=minmax)
