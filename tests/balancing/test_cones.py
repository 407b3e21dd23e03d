"""Weights within limits: optima of another modelling layer, angles tried one by one, conflicts in words."""

import json
from itertools import product
from pathlib import Path

import minmax_problems
import numpy as np
import pytest
from cases import each_of
from hypothesis import given
from hypothesis import strategies as st

from balancing.limits_and_minmax import (
    Bounds,
    allowed_sectors,
    explain,
    nearest,
    smallest_maximum,
    stands_in,
    within,
)
from rotorid.regression import stretch

TURN = 2 * np.pi
FILE = Path(__file__).resolve().parents[1] / "data" / "minmax_reference.json"
ANSWERS = [a for a in json.loads(FILE.read_text(encoding="utf-8"))["answers"] if a["kind"] != "budget"]


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


@given(st.lists(st.tuples(st.floats(-10, 10), st.floats(0.01, TURN)), min_size=1, max_size=4))
def test_the_sectors_are_what_the_arcs_leave(forbidden):
    sectors = allowed_sectors(forbidden)
    for angle in np.linspace(0, TURN, 200):
        margin = -1e-6 if not stands_in(np.exp(1j * angle), sectors) else 1e-6
        inside = any(margin < (angle - start) % TURN < width - margin for start, width in forbidden)
        assert inside == (margin < 0)
    assert all(0 < width <= np.pi and 0 <= start < TURN for start, width in sectors)


@pytest.mark.parametrize("minmax", [True, False])
@pytest.mark.parametrize("seed", range(4))
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
    ],
)
def test_limits_that_conflict_are_named_with_the_least_relaxation(W, Y, limits, text):
    assert words(W, Y, **limits) == f"the limits cannot be met: {text}"
