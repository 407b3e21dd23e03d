"""Joint discrete problem: the same as trying everything, never worse than rounding, limits, bad input."""

import time
from itertools import product

import numpy as np
import pytest
from helpers.limited_problems import minmax_cone
from repetitions import FULL

from balancing.data.limits import Limits
from balancing.mounting import fewest_pieces
from balancing.mounting.discrete_weights import solve_discrete
from balancing.mounting.holes import equal_holes, from_list
from balancing.mounting.mountable_vectors import nearest
from balancing.mounting.piece_sums import PieceSums
from balancing.solvers.cone import InfeasibleError

METHODS = ("least-squares", "minmax")


def everything(holes):
    """All vectors that can be mounted, by trying all of it."""
    return np.array(list(least_pieces(holes)))


def least_pieces(holes):
    """The fewest pieces of each vector that can be mounted, by trying all of it."""
    options = [
        c for c in product(range(holes.per_hole + 1), repeat=len(holes.pieces)) if sum(c) <= holes.per_hole
    ]
    found = {}
    for choice in product(*(options if free else options[:1] for free in holes.free)):
        counts = np.array(choice)
        vector = (counts @ holes.pieces) @ np.exp(1j * holes.angles)
        enough = holes.stock is None or (counts.sum(axis=0) <= holes.stock).all()
        if enough and abs(vector + holes.mounted) <= holes.max_weight * (1 + 1e-9):
            key = complex(np.round(vector, 10))
            found[key] = min(found.get(key, counts.sum()), counts.sum())
    return found


def case(seed):
    """Random coefficients, readings, planes and row weights; all sorts of holes, few enough to enumerate."""
    rng = np.random.default_rng(seed)
    P = int(rng.integers(1, 4))
    N = int(rng.integers(P, 9))
    W = rng.standard_normal((N, P)) + 1j * rng.standard_normal((N, P))
    Y = (rng.standard_normal(N) + 1j * rng.standard_normal(N)) * 10 ** rng.uniform(-0.3, 1)
    planes = []
    for _ in range(P):
        H, K = int(rng.integers(2, 6 if P < 3 else 4)), int(rng.integers(1, 3))
        angles = int(rng.choice([-1, 1])) * equal_holes(H, rng.uniform(0, 6))
        if rng.random() < 0.4:
            angles = rng.uniform(0, 2 * np.pi, H)
        taken = np.zeros(H)
        taken[0] = 0.3 if rng.random() < 0.3 else 0.0
        planes.append(
            from_list(
                angles,
                np.cumsum(rng.uniform(0.2, 0.8, K)),
                per_hole=int(rng.integers(1, 3)) if H < 4 else 1,
                taken=taken,
                stock=rng.integers(1, 3, K) if rng.random() < 0.3 else None,
                max_weight=1.2 if rng.random() < 0.3 else np.inf,
            )
        )
    return W, Y, planes, rng.uniform(0.2, 2, N) if rng.random() < 0.5 else np.ones(N)


def objectives(method, W, Y, w, D):
    size = np.abs(Y + D @ W.T) * w
    return size.max(axis=1) if method == "minmax" else np.linalg.norm(size, axis=1)


def grid(planes):
    return np.stack([g.ravel() for g in np.meshgrid(*map(everything, planes), indexing="ij")], axis=1)


@pytest.mark.parametrize("seed", range(60 if FULL else 20))
def test_equals_exhaustive_enumeration(seed):
    W, Y, planes, w = case(seed)
    D = grid(planes)
    for method in METHODS:
        found = solve_discrete(W, Y, planes, method=method, row_weights=w)
        assert found.proven
        assert found.gap == 0
        assert found.objective == pytest.approx(objectives(method, W, Y, w, D).min(), rel=1e-8)
        assert found.objective <= found.rounded_objective
        for holes, mounting, weight in zip(planes, found.mountings, found.weights, strict=True):
            assert mounting.vector == pytest.approx(weight, abs=1e-12)
            assert (mounting.counts.sum(axis=1) <= holes.per_hole).all()
            assert not mounting.amounts[~holes.free].any()
            assert holes.allows(mounting.vector)
            assert holes.stock is None or (mounting.counts.sum(axis=0) <= holes.stock).all()
        assert np.allclose(found.residual, Y + W @ found.weights, rtol=0, atol=1e-12)


def fewest_of_all(planes, size):
    """Of all mountings within 1.2 times of the least: the fewest pieces, the least objective of so many."""
    counts = [np.array(list(least_pieces(holes).values())) for holes in planes]
    number = np.sum(np.stack(np.meshgrid(*counts, indexing="ij"), axis=-1), axis=-1).ravel()
    good = size <= 1.2 * size.min() * (1 + 1e-9)
    fewest = number[good].min()
    return fewest, size[good & (number == fewest)].min()


@pytest.mark.parametrize("seed", range(40 if FULL else 14))
def test_the_fewest_pieces_within_reach_equal_enumeration(seed):
    W, Y, planes, w = case(seed)
    D = grid(planes)
    for method in METHODS:
        size = objectives(method, W, Y, w, D)
        fewest, least = fewest_of_all(planes, size)
        found = solve_discrete(W, Y, planes, method=method, row_weights=w, within=1.2)
        assert found.proven
        assert (found.pieces, found.objective) == (fewest, pytest.approx(least, rel=1e-8))
        assert objectives(method, W, Y, w, found.weights[None])[0] == pytest.approx(found.objective)
        best = solve_discrete(W, Y, planes, method=method, row_weights=w)
        told = found if found.best is None else found.best
        assert (told.objective, told.pieces) == (best.objective, best.pieces)
        assert found.bound <= best.objective


@pytest.mark.parametrize("method", METHODS)
@pytest.mark.parametrize("seed", range(6))
def test_the_fewest_pieces_keep_limits_and_forbidden_arcs(seed, method):
    W, Y, planes, w = case(2000 + seed)
    sizes = np.abs(Y + grid(planes) @ W.T)
    best = solve_discrete(W, Y, planes, method=method, row_weights=w)
    few = solve_discrete(W, Y, planes, method=method, row_weights=w, within=1.2)
    worst = int(np.argmax(np.abs(few.residual) - np.abs(best.residual)))
    residual = np.full((1, len(Y)), np.inf)
    residual[0, worst] = np.abs(best.residual[worst]) * (1 + 1e-6)  # what the fewest without limits may break
    limits = Limits(np.full(W.shape[1], np.inf), residual, ((),) * W.shape[1])
    kept = np.where((sizes <= residual).all(axis=1), objectives(method, W, Y, w, grid(planes)), np.inf)
    found = solve_discrete(W, Y, planes, method=method, row_weights=w, limits=limits, within=1.2)
    fewest, least = fewest_of_all(planes, kept)
    assert (found.pieces, found.objective) == (fewest, pytest.approx(least, rel=1e-8))
    used = [int(np.flatnonzero(holes.free)[0]) for holes in planes]
    arcs = [((holes.angles[h] - 0.01, 0.02),) for holes, h in zip(planes, used, strict=True)]
    free = [holes.free.sum() > 1 for holes in planes]
    arcs = tuple(arc if more else () for arc, more in zip(arcs, free, strict=True))
    without = Limits(np.full(W.shape[1], np.inf), np.full((1, len(Y)), np.inf), arcs)
    found = solve_discrete(W, Y, planes, method=method, row_weights=w, limits=without, within=1.2)
    for mounted, h, more in zip(found.mountings, used, free, strict=True):
        assert not (more and mounted.counts[h].any())


def test_an_error_of_nothing_takes_the_fewest_pieces_that_leave_nothing():
    holes = [from_list(equal_holes(6), [0.2, 0.3], per_hole=2) for _ in range(2)]
    rng = np.random.default_rng(4)
    W = rng.standard_normal((4, 2)) + 1j * rng.standard_normal((4, 2))
    Y = -W @ (np.array([0.5, 0.6]) * np.exp(1j * np.pi / 3 * np.array([1, 4])))
    for method in METHODS:
        found = solve_discrete(W, Y, holes, method=method, within=1.2)
        assert found.objective == pytest.approx(0, abs=1e-12)
        assert found.pieces == 4
        assert found.proven


def test_the_fewest_pieces_beside_a_plane_of_any_weight():
    W, Y, _, _ = case(3)
    W = np.column_stack((W[:, :1], W[::-1, :1] * 1j))
    holes = from_list(equal_holes(5, 0.2), [0.2, 0.3])
    found = solve_discrete(W, Y, [None, holes], within=1.2)
    left = []
    for d, number in least_pieces(holes).items():
        rest = Y + W[:, 1] * d
        own = np.linalg.lstsq(W[:, :1], -rest, rcond=None)[0]
        left.append((np.linalg.norm(rest + W[:, 0] * own), number))
    least = min(left)[0]
    fewest = min(number for size, number in left if size <= 1.2 * least)
    assert found.pieces == fewest
    assert found.objective == pytest.approx(min(s for s, n in left if n == fewest), rel=1e-8)


@pytest.mark.parametrize("time_is_up", [False, True])
def test_without_a_stock_few_pieces_do_what_many_do(monkeypatch, time_is_up):
    """24 holes, two sizes, three planes; without a search, few pieces are found near the optimum."""
    rng = np.random.default_rng(1)
    W = rng.standard_normal((20, 3)) + 1j * rng.standard_normal((20, 3))
    wanted = 0.04 * np.exp(1j * np.array([0.3, 2.0, 4.0]))
    noise = 0.01 * (rng.standard_normal(20) + 1j * rng.standard_normal(20))
    planes = [from_list(equal_holes(24), [0.005, 0.015])] * 3
    if time_is_up:
        monkeypatch.setattr(fewest_pieces, "search", lambda *_: 0.0)
    found = solve_discrete(W, noise - W @ wanted, planes, time_limit=60.0, within=1.2)
    assert found.pieces < 0.7 * found.best.pieces
    assert found.objective <= 1.2 * found.best.objective
    assert found.best.proven
    assert found.proven != time_is_up


@pytest.mark.parametrize("method", METHODS)
@pytest.mark.parametrize("seed", range(8))
def test_limits_of_amplitudes_equal_enumeration(seed, method):
    W, Y, planes, w = case(1000 + seed)
    D = grid(planes)
    sizes = np.abs(Y + D @ W.T)
    residual = np.full((1, len(Y)), np.inf)
    free = solve_discrete(W, Y, planes, method=method, row_weights=w)
    worst = int(np.argmax(np.abs(free.residual) - sizes.min(axis=0)))
    residual[0, worst] = 0.5 * (sizes[:, worst].min() + abs(free.residual[worst])) * (1 + 1e-6)
    limits = Limits(np.full(W.shape[1], np.inf), residual, ((),) * W.shape[1])
    kept = (sizes <= residual[0]).all(axis=1)
    found = solve_discrete(W, Y, planes, method=method, row_weights=w, limits=limits)
    assert found.proven
    assert abs(found.residual[worst]) <= residual[0, worst] * (1 + 1e-8)
    assert found.objective == pytest.approx(objectives(method, W, Y, w, D[kept]).min(), rel=1e-8)
    residual[0, worst] = 0.9 * sizes[:, worst].min() or 1e-9
    tight = Limits(np.full(W.shape[1], np.inf), residual, ((),) * W.shape[1])
    with pytest.raises(InfeasibleError, match="no mounting of these pieces keeps every limit"):
        solve_discrete(W, Y, planes, method=method, row_weights=w, limits=tight)


@pytest.mark.parametrize("seed", range(6))
def test_a_continuous_plane_follows_the_others(seed):
    rng = np.random.default_rng(seed)
    W = rng.standard_normal((6, 2)) + 1j * rng.standard_normal((6, 2))
    Y = rng.standard_normal(6) + 1j * rng.standard_normal(6)
    holes = from_list(equal_holes(5, 0.2), [0.3])
    best = dict.fromkeys(METHODS, np.inf)
    for d in everything(holes):
        left = Y + W[:, 1] * d
        own = np.linalg.lstsq(W[:, :1], -left, rcond=None)[0]
        best["least-squares"] = min(best["least-squares"], np.linalg.norm(left + W[:, 0] * own))
        best["minmax"] = min(best["minmax"], minmax_cone(W[:, :1], left).objective)
    for method in METHODS:
        found = solve_discrete(W, Y, [None, holes], method=method)
        assert found.proven
        assert found.mountings[0] is None
        assert found.objective == pytest.approx(best[method], rel=1e-7)
        # holes all around that take any amount are the same as no holes
        around = from_list(equal_holes(4))
        same = solve_discrete(W, Y, [around, holes], method=method)
        assert same.objective == pytest.approx(best[method], rel=1e-7)
        assert same.mountings[0].vector == pytest.approx(same.weights[0], abs=1e-9)


@pytest.mark.parametrize("method", METHODS)
def test_steps_of_free_amounts_equal_enumeration(method):
    rng = np.random.default_rng(5)
    W = rng.standard_normal((5, 2)) + 1j * rng.standard_normal((5, 2))
    Y = rng.standard_normal(5) + 1j * rng.standard_normal(5)
    planes = [from_list(equal_holes(4, 0.3), step=0.2), from_list([0.1, 1.0], step=0.25, max_weight=1.0)]
    steps = np.arange(0, 30)
    lists = []
    for holes, pairs in zip(planes, ([(0, 1), (1, 2), (2, 3), (3, 0)], [(0, 1)]), strict=True):
        e = np.exp(1j * holes.angles) * holes.step
        all_of = np.concatenate([(steps[:, None] * e[p] + steps * e[q]).ravel() for p, q in pairs])
        lists.append(all_of[holes.allows(all_of)])
    D = np.stack([g.ravel() for g in np.meshgrid(*lists)], axis=1)
    found = solve_discrete(W, Y, planes, method=method)
    assert found.proven
    assert found.objective == pytest.approx(objectives(method, W, Y, np.ones(5), D).min(), rel=1e-8)
    for holes, mounting in zip(planes, found.mountings, strict=True):
        assert np.allclose(mounting.amounts / holes.step, np.rint(mounting.amounts / holes.step))


@pytest.mark.full
@pytest.mark.parametrize("method", METHODS)
def test_three_planes_of_24_holes_and_60_readings(method):
    rng = np.random.default_rng(1)
    W = rng.standard_normal((60, 3)) + 1j * rng.standard_normal((60, 3))
    weights = np.array([0.06 + 0.05j, -0.08 + 0.02j, 0.03 - 0.09j])
    Y = -W @ weights + 0.02 * (rng.standard_normal(60) + 1j * rng.standard_normal(60))
    planes = [from_list(equal_holes(24, 0.1 * p), [0.01, 0.02]) for p in range(3)]
    found = solve_discrete(W, Y, planes, method=method, time_limit=2.0)
    assert found.gap < 0.01
    assert found.bound <= found.objective < found.rounded_objective
    if method == "least-squares":
        assert found.proven
    else:
        assert found.bound >= minmax_cone(W, Y).objective * (1 - 1e-6)


def test_more_vectors_than_can_be_listed_give_a_gap_that_holds():
    rng = np.random.default_rng(3)
    holes = from_list(rng.uniform(0, 2 * np.pi, 11), [0.1, 0.23])
    whole = PieceSums(holes, holes.free, np.inf)
    part = PieceSums(holes, holes.free, np.inf, longest=200)
    for z in (0.3 + 0.4j, 3.0):
        for one in (whole, part):
            one.aim(z)
        assert whole.complete
        assert not part.complete
        (best,), _ = nearest(whole, z)
        some, keys = nearest(part, z)
        assert abs(some[0] - z) >= abs(best - z) - 1e-12
        assert abs(some[0] - z) < abs(best - z) + 0.05
        assert part.bound(z) <= abs(best - z)
        assert part.mount(keys[0]).vector == pytest.approx(some[0], abs=1e-12)
    lots = from_list(rng.uniform(0, 2 * np.pi, 20), [0.013, 0.02, 0.05], per_hole=2)
    W = rng.standard_normal((4, 1)) + 1j * rng.standard_normal((4, 1))
    Y = rng.standard_normal(4) + 1j * rng.standard_normal(4)
    found = solve_discrete(W, Y, [lots], time_limit=2.0)
    assert found.bound <= found.objective
    assert found.gap < 1e-4


def test_forbidden_arcs_and_largest_weights():
    holes = from_list(equal_holes(8), [0.5])
    arcs = (((-0.1, 0.2),),)
    limits = Limits(np.array([np.inf]), np.full((1, 1), np.inf), arcs)
    found = solve_discrete([[1.0]], [-0.5], [holes], limits=limits)
    assert found.mountings[0].counts[0].sum() == 0
    assert solve_discrete([[1.0]], [-0.5], [holes]).objective == pytest.approx(0, abs=1e-12)
    small = Limits(np.array([0.45]), np.full((1, 1), np.inf), ((),))
    vector = solve_discrete([[1.0]], [-0.5], [holes], limits=small).weights[0]
    assert abs(vector) <= 0.45
    every = everything(holes)
    best = np.abs(every[np.abs(every) <= 0.45] - 0.5).min()
    assert abs(vector - 0.5) == pytest.approx(best, rel=1e-9)


@pytest.mark.parametrize("method", METHODS)
def test_a_plane_limited_far_below_what_the_readings_ask_for(method):
    angles = np.random.default_rng(7).uniform(0, 2 * np.pi, 16)
    W, Y = np.array([[1.0], [0.5j]]), np.array([-3.0, 1.0j])
    few = from_list(angles[:9], [0.3, 0.2], max_weight=0.5)
    found = solve_discrete(W, Y, [few], method=method)
    assert found.proven
    best = objectives(method, W, Y, np.ones(2), everything(few)[:, None]).min()
    assert found.objective == pytest.approx(best, rel=1e-9)
    many = from_list(angles, [0.1, 0.2], max_weight=0.3)
    start = time.perf_counter()
    assert abs(solve_discrete(W, Y, [many], method=method).weights[0]) <= 0.3 * (1 + 1e-9)
    assert time.perf_counter() - start < 20


@pytest.mark.parametrize("method", METHODS)
def test_no_pieces_where_nothing_vibrates(method):
    planes = [from_list(equal_holes(12, 0.1), [0.01, 0.02])]
    found = solve_discrete(np.ones((3, 1)), np.zeros(3), planes, method=method)
    assert found.proven
    assert found.objective == 0
    assert not found.mountings[0].counts.any()


def test_bad_input():
    holes = from_list(equal_holes(4), [1.0])
    W, Y = np.ones((2, 1)), np.ones(2)
    with pytest.raises(ValueError, match="for each of the 1 planes"):
        solve_discrete(W, Y, [holes, holes])
    with pytest.raises(ValueError, match="method must be"):
        solve_discrete(W, Y, [holes], method="median")
    with pytest.raises(ValueError, match="within 1 or more times"):
        solve_discrete(W, Y, [holes], within=0.9)
    with pytest.raises(ValueError, match="time limit"):
        solve_discrete(W, Y, [holes], time_limit=0)
    with pytest.raises(ValueError, match="finite"):
        solve_discrete(W, [np.nan, 1], [holes])
    arcs = Limits(np.array([np.inf]), np.full((1, 2), np.inf), (((0.0, 2 * np.pi),),))
    with pytest.raises(ValueError, match="has forbidden angles but no holes"):
        solve_discrete(W, Y, {"DE": None}, limits=arcs)
    most = Limits(np.array([np.inf]), np.full((1, 2), np.inf), (((-0.1, 6.2),),))
    with pytest.raises(ValueError, match="nothing can be mounted in plane DE"):
        solve_discrete(W, Y, {"DE": from_list([0.5], [1.0])}, limits=most)
    twice = np.column_stack((Y, Y))
    with pytest.raises(ValueError, match="do not tell how much plane"):
        solve_discrete(twice, Y, [from_list(equal_holes(4), step=0.1)] * 2)
