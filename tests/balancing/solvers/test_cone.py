"""Cone programs: certified optima, and the same as an independent modelling layer and solver find."""

import json
from pathlib import Path

import minmax_problems
import numpy as np
import pytest
from cases import each_of
from helpers.limited_problems import least_squares_cone, minmax_cone, weight_budget_cone
from hypothesis import given
from hypothesis import strategies as st

from balancing.solvers.certificate import lower_bound, project
from balancing.solvers.cone import InfeasibleError, problem

FILE = Path(__file__).resolve().parents[2] / "data" / "minmax_reference.json"
ANSWERS = json.loads(FILE.read_text(encoding="utf-8"))["answers"]
seeds = st.integers(0, 2**32 - 1)


def label(answer):
    return f"{answer['method']}-{answer['seed']}-{answer['kind']}"


def numbers(rng, N, P):
    W, Y = minmax_problems.normal(rng, (N, P)), minmax_problems.normal(rng, N)
    return W * 10.0 ** rng.uniform(-3, 3, P), Y * 10.0 ** rng.uniform(-6, 3)


def test_the_stored_problems_are_what_the_comparison_needs():
    minmax = [a for a in ANSWERS if a["method"] == "minmax"]
    assert len(minmax) >= 60
    assert {a["kind"] for a in minmax} == set(minmax_problems.KINDS)
    assert sum(a["method"] == "least-squares" for a in ANSWERS) >= 30


@each_of("answer", ANSWERS, ids=label)
def test_certified_and_equal_to_what_cvxpy_finds(answer):
    case = minmax_problems.case(answer["seed"])
    assert minmax_problems.fingerprint(case) == pytest.approx(answer["fingerprint"], rel=1e-12)
    minmax = answer["method"] == "minmax"
    limits = {
        "row_weights": case.row_weights,
        "max_weight": case.max_weight,
        "residual": case.residual,
    }
    if case.kind == "budget":
        found = weight_budget_cone(case.W, case.Y, case.budget, minmax=minmax, **limits)
    else:
        found = (minmax_cone if minmax else least_squares_cone)(case.W, case.Y, **limits)
    assert 0 <= found.gap < 1e-7
    assert found.objective == pytest.approx(answer["objective"], rel=1e-7)
    # every limit is kept, not only to within a tolerance
    residual = np.abs(case.Y + case.W @ found.weights)
    assert (residual <= case.residual).all()
    assert (np.abs(found.weights) <= case.max_weight).all()
    assert np.abs(found.weights).sum() <= case.budget
    values = case.row_weights * residual
    objective = values.max() if minmax else np.linalg.norm(values)
    assert found.objective == pytest.approx(objective, rel=1e-13)
    top = np.minimum(case.residual, objective / case.row_weights) if minmax else case.residual
    check_active(found.active_weights, np.abs(found.weights), case.max_weight)
    check_active(found.active_residuals, residual, top)


def check_active(active, size, limit):
    assert active[size >= limit * (1 - 1e-6)].all()
    assert not active[size < limit * (1 - 1e-3)].any()


@given(seeds, st.integers(1, 3), st.booleans())
def test_no_dual_vector_gives_a_bound_above_the_optimum(seed, P, minmax):
    """The certificate itself: whatever vectors it gets, no weights within the limits are below its bound."""
    rng = np.random.default_rng(seed)
    W, Y = numbers(rng, 6, P)
    inside = minmax_problems.normal(rng, P) / np.linalg.norm(W, axis=0)
    start = np.angle(inside) - rng.uniform(0, 1, P)
    sectors = [(s, 1.5) if rng.random() < 0.4 else None for s in start]
    M = np.where(rng.random(P) < 0.4, 1.2 * np.abs(inside), np.inf)
    r = Y + W @ inside
    L = np.where(rng.random(6) < 0.5, 1.1 * np.abs(r), np.inf)
    budget = 1.1 * np.abs(inside).sum() if rng.random() < 0.3 else np.inf
    w = rng.uniform(0.5, 2, 6)
    whole = problem(W, Y, w, M, L, sectors, minmax=minmax, budget=budget)
    objective = whole.objective(inside)
    # close to the best vectors, and far from them
    near = w * r * (np.abs(w * r) >= 0.7 * np.abs(w * r).max()) if minmax else w**2 * r
    for a in (near, near + 0.1 * minmax_problems.normal(rng, 6) * np.abs(near).max()):
        u = np.where(np.isfinite(L), 0.3 * r * rng.random(6), 0)
        assert lower_bound(whole, a.astype(complex), u).value <= objective * (1 + 1e-12)


def test_the_bound_is_the_optimum_where_the_dual_vector_is_the_best_one():
    """One plane, two readings 3 and 5: −4 leaves 1 and 1; the best dual vector is (−1/2, 1/2)."""
    whole = problem([[1.0], [1.0]], [3.0, 5.0], minmax=True)
    bound = lower_bound(whole, np.array([-0.5, 0.5 + 0j]), np.zeros(2, dtype=complex))
    assert bound.value == pytest.approx(1.0, rel=1e-14)
    # whatever its size: each reading has half of the maximum
    larger = lower_bound(whole, 3 * np.array([-0.5, 0.5 + 0j]), np.zeros(2, dtype=complex))
    assert larger.value == pytest.approx(1.0, rel=1e-14)
    assert larger.residual_prices.tolist() == pytest.approx([0.5, 0.5])
    # a dual vector that is not feasible is corrected, not believed
    wrong = lower_bound(whole, np.array([-0.4, 0.6 + 0j]), np.zeros(2, dtype=complex))
    assert wrong.value == pytest.approx(1.0, rel=1e-3)
    assert wrong.value <= 1.0 + 1e-15


def test_a_largest_weight_by_hand():
    """Readings 3 and 5, |D| ≤ 1: D = −1 leaves 2 and 4; the amplitude 4 falls by 1 per unit of the limit."""
    found = minmax_cone([[1.0], [1.0]], [3.0, 5.0], max_weight=[1.0])
    assert found.weights[0] == pytest.approx(-1, abs=1e-7)
    assert found.objective == pytest.approx(4, rel=1e-8)
    assert found.active_weights.all()
    np.testing.assert_array_equal(found.active_residuals, [False, True])
    assert found.weight_prices[0] == pytest.approx(1, rel=1e-6)
    squares = least_squares_cone([[1.0], [1.0]], [3.0, 5.0], max_weight=[1.0])
    assert squares.weights[0] == pytest.approx(-1, abs=1e-7)
    assert squares.objective == pytest.approx(np.sqrt(20), rel=1e-8)


def test_a_limit_of_one_reading_by_hand():
    """Readings 3 and 5, the second at most 0.5: D = −4.5 leaves 1.5 and 0.5."""
    for solver in (minmax_cone, least_squares_cone):
        found = solver([[1.0], [1.0]], [3.0, 5.0], residual=[np.inf, 0.5])
        assert found.weights[0] == pytest.approx(-4.5, abs=1e-6)
        assert abs(5 + found.weights[0]) <= 0.5
        assert found.gap < 1e-6
        assert found.active_residuals[1]
        assert found.residual_prices[1] > 0


def test_a_budget_goes_where_it_helps_most():
    """Two planes, one effect each: of 3 and 5 with total weight 4, min–max leaves 2 and 2."""
    found = weight_budget_cone(np.eye(2), [3.0, 5.0], 4.0, minmax=True)
    np.testing.assert_allclose(found.weights, [-1, -3], atol=1e-6)
    assert found.objective == pytest.approx(2, rel=1e-7)
    none = weight_budget_cone(np.eye(2), [3.0, 5.0], 0.0)
    np.testing.assert_array_equal(none.weights, 0)
    assert none.objective == none.bound == pytest.approx(np.sqrt(34))


def test_a_sector_by_hand():
    """−4 is best; within 90° … 170° the projection of −4 onto the ray at 170° is."""
    found = least_squares_cone([[1.0]], [4.0], sectors=[(np.pi / 2, np.radians(80))])
    expected = 4 * np.cos(np.radians(10)) * np.exp(1j * np.radians(170))
    # the objective is flat across the ray's end: weights are known to the root of the gap
    assert found.weights[0] == pytest.approx(expected, abs=1e-5)
    assert np.angle(found.weights[0]) == pytest.approx(np.radians(170), abs=1e-12)
    opposite = minmax_cone([[1.0]], [4.0], sectors=[(-0.5, 1.0)])
    assert opposite.weights[0] == pytest.approx(0, abs=1e-6)
    assert opposite.objective == pytest.approx(4, rel=1e-7)
    half = minmax_cone([[1.0]], [4j], sectors=[(0.0, np.pi)])
    assert half.objective == pytest.approx(4, rel=1e-7)


@given(st.complex_numbers(max_magnitude=1e3), st.floats(-7, 7), st.floats(1e-3, np.pi))
def test_the_projection_on_a_sector_is_its_nearest_point(v, start, width):
    p = project(v, (start, width))
    rays = np.exp(1j * (start + np.linspace(0, width, 50)))
    along = np.maximum((np.conj(rays) * v).real, 0)
    assert abs(v - p) <= np.abs(v - along * rays).min() + 1e-9 * abs(v)
    if p:
        assert np.mod(np.angle(p) - start + 1e-9, 2 * np.pi) <= width + 2e-9


@given(seeds, st.booleans())
def test_readings_of_weight_zero_count_only_for_their_limits(seed, minmax):
    rng = np.random.default_rng(seed)
    W, Y = numbers(rng, 9, 2)
    w = np.where(np.arange(9) < 3, 0.0, 1.0)
    solver = minmax_cone if minmax else least_squares_cone
    part, whole = solver(W[3:], Y[3:]), solver(W, Y, row_weights=w)
    assert whole.objective == pytest.approx(part.objective, rel=1e-7)
    top = np.abs(Y + W @ part.weights)[:3]
    limit = np.where(np.arange(9) < 3, np.concatenate((1.001 * top, np.ones(6))), np.inf)
    limited = solver(W, Y, row_weights=w, residual=limit)
    assert limited.objective == pytest.approx(part.objective, rel=1e-7)
    assert limited.gap < 1e-6


def test_nothing_to_correct():
    for solver in (minmax_cone, least_squares_cone):
        found = solver([[1.0, 2.0], [3.0, 1.0], [1j, 1.0]], [0.0, 0.0, 0.0], max_weight=[1.0, 1.0])
        assert found.objective <= 1e-8
        assert (np.abs(found.weights) <= 1e-8).all()


def test_planes_left_empty():
    W, Y = [[1.0, 2.0], [3.0, 1.0], [1j, 1.0]], [1.0, 2.0, 3.0]
    found = minmax_cone(W, Y, max_weight=[0.0, np.inf])
    assert found.weights[0] == 0
    assert found.active_weights[0]
    alone = minmax_cone(np.array(W)[:, 1:], Y)
    assert found.weights[1] == pytest.approx(alone.weights[0], rel=1e-12)
    none = least_squares_cone(W, Y, max_weight=[0.0, 0.0])
    assert none.objective == pytest.approx(np.sqrt(14))
    assert none.gap == 0


def test_infeasible_limits_are_refused():
    with pytest.raises(InfeasibleError, match="no weights are within the limits"):
        minmax_cone([[1.0], [1.0]], [3.0, 5.0], residual=[0.9, 0.9])
    with pytest.raises(InfeasibleError, match="exceeds its limit already"):
        minmax_cone([[1.0], [1.0]], [3.0, 5.0], residual=[9.0, 4.0], max_weight=[0.0])


@each_of(
    ("arguments", "message"),
    [
        (([[1.0], [np.nan]], [1.0, 2.0]), "must be finite"),
        (([[1.0], [1.0]], [1.0, np.inf]), "must be finite"),
        (([[1.0], [1.0]], [1.0]), "vibration must have shape"),
        ((np.zeros((0, 2)), []), "not empty"),
        (([[1.0], [1.0]], [1.0, 2.0], [1.0]), "the row weights must be 2 finite numbers"),
        (([[1.0], [1.0]], [1.0, 2.0], [0.0, 0.0]), "not all zero"),
        (([[1.0], [1.0]], [1.0, 2.0], [-1.0, 1.0]), "the row weights must be 2 finite numbers ≥ 0"),
        (([[1.0], [1.0]], [1.0, 2.0], None, [-1.0]), "the largest weights must be 1 numbers ≥ 0"),
        (([[1.0], [1.0]], [1.0, 2.0], None, [np.nan]), "the largest weights"),
        (([[1.0], [1.0]], [1.0, 2.0], None, None, [1.0]), "the limits of amplitudes must be 2"),
        (([[1.0], [1.0]], [1.0, 2.0], None, None, None, [(0.0, 4.0)]), "a width up to π"),
        (([[1.0], [1.0]], [1.0, 2.0], None, None, None, []), "for every plane"),
    ],
)
def test_bad_numbers_are_refused(arguments, message):
    with pytest.raises(ValueError, match=message):
        problem(*arguments)


def test_a_bad_budget_is_refused():
    with pytest.raises(ValueError, match="the total weight must be a number ≥ 0"):
        weight_budget_cone([[1.0]], [1.0], -1.0)
