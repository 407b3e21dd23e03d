"""Groups of planes: against the planes themselves, another optimiser, and what others have printed."""

from dataclasses import replace

import numpy as np
import pytest
from cases import each_of
from coverage_balance import GROUPS, draw
from scipy.optimize import minimize

from balancing import (
    Limits,
    Trials,
    correct,
    equal_holes,
    estimate_influence,
    from_list,
    mapped,
    mount,
    unknowns,
)
from balancing.one_weight import TwoPlanes


def job(seed, planes):
    """A job of so many planes."""
    shares = np.eye(planes, dtype=complex)
    return draw(np.random.default_rng(seed), "stated", "independent", (0.01, 0.0), shares=shares)


PAIRS = {"static": {"A": 1.0, "B": 1.0}, "couple": {"A": 1.0, "B": -1.0}}


@each_of("seed", range(2))
@pytest.mark.parametrize("method", ["weighted", "minmax"])
def test_groups_that_span_the_planes_are_the_planes(seed, method):
    influence = estimate_influence(job(seed, 2).trials)
    free = np.full(influence.baseline.shape, np.inf)
    by = {"method": method, "limits": Limits(np.array([0.9, np.inf]), free, (((0.0, 1.0),), ()))}
    planes = correct(influence, **by)
    pairs = correct(influence, planes=["static", "couple"], groups=PAIRS, **by)
    np.testing.assert_array_equal(pairs.weights, planes.weights)
    np.testing.assert_array_equal(pairs.draws, planes.draws)
    q, parts = pairs.parts, planes.parts  # parts: the sum, and half of the difference
    np.testing.assert_allclose([[1, 1], [1, -1]] @ q.weights, planes.weights, rtol=1e-12)
    np.testing.assert_allclose(parts.weights, [planes.weights.sum(), np.subtract(*planes.weights) / 2])
    np.testing.assert_allclose(parts.mass_std, q.mass_std * [2, 1], rtol=1e-6)


@each_of("seed", range(3))
def test_weights_that_are_held_together_against_another_optimiser(seed):
    influence = estimate_influence(job(seed, 3).trials)
    G, Y = unknowns(GROUPS, [*GROUPS], "ABC").shares, np.full(influence.baseline.shape, np.inf)
    by = {"planes": [*GROUPS], "groups": GROUPS, "method": "minmax"}
    most = [0.5, 0.6, np.inf] * np.abs(correct(influence, **by).weights)
    made = correct(influence, limits=Limits(most, Y, ((),) * 3), **by)
    assert (np.abs(made.weights) <= most).all()

    def room(x):  # below the largest amplitude, x[4], and the limits
        D = G @ x[:4].view(complex)
        return np.append(x[4] - np.abs(influence.baseline + influence.W @ D), (most - np.abs(D))[:2])

    start = np.append(np.full(4, 0.01), np.abs(influence.baseline).max())
    kept = {"type": "ineq", "fun": room}
    best = minimize(lambda x: x[4], start, method="SLSQP", constraints=kept, options={"maxiter": 500})
    np.testing.assert_allclose(made.fitted.objective, best.fun, rtol=1e-4)


def test_a_couple_from_one_trial_run():
    """What it does is known although neither plane is; pieces are near it, and others are refused."""
    of, trials = unknowns(PAIRS, ["couple"]), replace(job(1, 1).trials, planes=("couple",))
    V = estimate_influence(trials)
    known = mapped(V, of.planes, of.inverse)
    one, both = correct(V), correct(known, planes=["couple"], groups=PAIRS)
    np.testing.assert_allclose(both.weights, one.weights * [1, -1], rtol=1e-9)
    np.testing.assert_allclose(both.after, one.after, rtol=1e-9)
    np.testing.assert_allclose(both.parts.mass_std, one.mass_std, rtol=1e-6)
    put = mount(both, known, None, {p: from_list(equal_holes(9), [0.1, 0.3], per_hole=4) for p in "AB"})
    assert 0 < np.linalg.norm(put.weights - both.weights) <= 0.2 * np.linalg.norm(both.weights)
    check = Trials(("c",), V.speeds, V.sensors, of.planes, V.baseline[None], put.weights[None])
    np.testing.assert_allclose(of.of_runs(check).weights, [[np.subtract(*put.weights) / 2]])
    with pytest.raises(ValueError, match="71 % of what is mounted is beside 'couple'"):
        of.of_runs(replace(check, weights=[[1.0, 0.0]]))


def test_a_limit_of_a_plane_in_two_groups_is_refused():
    groups = {"static": dict.fromkeys("ABC", 1.0), "couple": {"A": 1.0, "C": -1.0}}
    limits = Limits(np.array([1.0, np.inf, np.inf]), np.zeros((0, 0)), ((),) * 3)
    with pytest.raises(ValueError, match="plane 'A' is in 'static' and 'couple'"):
        unknowns(groups, [*groups]).limits(limits)


def polar(size, degrees):
    return size * np.exp(1j * np.deg2rad(degrees))


NORTON = -polar(1.362, 113.4), -polar(1.4796, 48.8), -polar(2.496, 251.4)
KHURMI = polar(16, 180), polar(21, 135), polar(24, 65), polar(16, -55)
PRINTED = {
    "Cemb Hofmann: a couple of 6000 g cm cm": ([600, -600], [0, 10], [0, 15], 400, 0, 1e-9),
    "Micropoise: a couple of 56 oz in in": ([56, -56], [0, 1], [0, 7], 8, 0, 1e-9),
    "Norton, 12-2": (NORTON, [2.243, 1.396, 0.701], [0, 3.097], 0.904, 75.27, 5e-4),
    "Khurmi and Gupta, 21.2, drawn": (KHURMI, [-1, 2, 3, 6], [0, 4], 35.5, 145, 0.03),
}
"""Weights, where they are, two planes; what is printed of the first: size, angle, and to what share."""


@pytest.mark.parametrize("source", PRINTED)
def test_printed_weights_in_two_planes(source):
    given, at, planes, size, angle, share = PRINTED[source]
    made = TwoPlanes(tuple(given), tuple(at), ("1", "2"), tuple(planes)).weights()
    np.testing.assert_allclose([made.sum(), planes @ made], [sum(given), np.dot(at, given)], atol=1e-9)
    assert abs(made[0] - polar(size, angle)) <= share * size
