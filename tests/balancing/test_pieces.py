"""Pieces of all planes chosen together: brute force, certified optima, limits, and what is enough."""

from itertools import product

import numpy as np
import pytest

from balancing.holes import equal_holes, from_list, lightest
from balancing.pieces import HEAVIER, PlaneVectors, solve_discrete
from balancing.trials import Limits

METHODS = ("least-squares", "minmax")


def everything(holes):
    """Vector, number and weight of all that can be mounted, by trying all of it."""
    options = [
        c for c in product(range(holes.per_hole + 1), repeat=len(holes.pieces)) if sum(c) <= holes.per_hole
    ]
    found = []
    for choice in product(*(options if free else options[:1] for free in holes.free)):
        counts = np.array(choice)
        vector = (counts @ holes.pieces) @ np.exp(1j * holes.angles)
        enough = holes.stock is None or (counts.sum(axis=0) <= holes.stock).all()
        if enough and holes.allows(vector):
            found.append((vector, counts.sum(), (counts @ holes.pieces).sum()))
    d, number, weight = (np.array(part) for part in zip(*found, strict=True))
    return d, number, weight


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


def grid(parts):
    return np.stack([g.ravel() for g in np.meshgrid(*parts, indexing="ij")], axis=1)


def kept(planes, found):
    """What is mounted is possible, and adds up to the weights."""
    for holes, mounting, weight in zip(planes, found.mountings, found.weights, strict=True):
        assert mounting.vector == pytest.approx(weight, abs=1e-12)
        assert (mounting.counts.sum(axis=1) <= holes.per_hole).all()
        assert not mounting.amounts[~holes.free].any()
        assert holes.allows(mounting.vector)
        assert holes.stock is None or (mounting.counts.sum(axis=0) <= holes.stock).all()


@pytest.mark.parametrize("method", METHODS)
@pytest.mark.parametrize("seed", range(20))
def test_equals_exhaustive_enumeration(seed, method):
    W, Y, planes, w = case(seed)
    D = grid([everything(holes)[0] for holes in planes])
    found = solve_discrete(W, Y, planes, method=method, row_weights=w)
    least = objectives(method, W, Y, w, D).min()
    if (seed, method) == (4, "minmax"):  # the one that is not the least of all
        assert least * (1 + 1e-6) < found.objective <= 1.02 * least
    else:
        assert found.objective == pytest.approx(least, rel=1e-8)
    kept(planes, found)
    assert np.allclose(found.residual, Y + W @ found.weights, rtol=0, atol=1e-12)


@pytest.mark.parametrize("method", METHODS)
@pytest.mark.parametrize("seed", range(20))
def test_the_fewest_pieces_that_are_enough_equal_enumeration(seed, method):
    W, Y, planes, w = case(3000 + seed)
    wanted = -np.linalg.lstsq(W, Y, rcond=None)[0]
    parts = []
    for holes, z in zip(planes, wanted, strict=True):
        d, number, weight = everything(holes)
        least = lightest(holes, holes.free, complex(z), holes.per_hole * holes.pieces.max()).sum()
        fits = (weight <= HEAVIER * least * (1 + 1e-9)) | (number <= 2)
        parts.append((d[fits], number[fits]))
    D, number = grid([d for d, _ in parts]), grid([n for _, n in parts]).sum(axis=1)
    size = objectives(method, W, Y, w, D)
    level = 1.3 * size.min()

    def enough(weights):
        return objectives(method, W, Y, w, weights[None])[0] <= level

    found = solve_discrete(W, Y, planes, enough, wanted=wanted, method=method, row_weights=w)
    pieces = number[size <= level].min()
    assert found.enough
    assert (found.pieces, found.objective) == (pieces, pytest.approx(size[number <= pieces].min(), rel=1e-8))
    kept(planes, found)
    ladder = [one.pieces for one in found.fewer]
    assert ladder == sorted(set(ladder))
    for one in found.fewer:  # the best of so many, each better than the one before
        assert one.objective == pytest.approx(size[number <= one.pieces].min(), rel=1e-8)
        assert not enough(one.weights)
    never = solve_discrete(W, Y, planes, lambda _: False, wanted=wanted, method=method, row_weights=w)
    assert not never.enough
    assert never.objective <= 1.2 * size.min() * (1 + 1e-9)


@pytest.mark.parametrize("method", METHODS)
@pytest.mark.parametrize("seed", range(8))
def test_limits_of_amplitudes_equal_enumeration(seed, method):
    W, Y, planes, w = case(1000 + seed)
    D = grid([everything(holes)[0] for holes in planes])
    sizes = np.abs(Y + D @ W.T)
    residual = np.full((1, len(Y)), np.inf)
    free = solve_discrete(W, Y, planes, method=method, row_weights=w)
    worst = int(np.argmax(np.abs(free.residual) - sizes.min(axis=0)))
    residual[0, worst] = 0.5 * (sizes[:, worst].min() + abs(free.residual[worst])) * (1 + 1e-6)
    limits = Limits(np.full(W.shape[1], np.inf), residual, ((),) * W.shape[1])
    good = (sizes <= residual[0]).all(axis=1)
    found = solve_discrete(W, Y, planes, method=method, row_weights=w, limits=limits)
    assert abs(found.residual[worst]) <= residual[0, worst] * (1 + 1e-8)
    assert found.objective == pytest.approx(objectives(method, W, Y, w, D[good]).min(), rel=1e-8)
    residual[0, worst] = 0.9 * sizes[:, worst].min() or 1e-9
    tight = Limits(np.full(W.shape[1], np.inf), residual, ((),) * W.shape[1])
    with pytest.raises(ValueError, match="no mounting that keeps every limit was found"):
        solve_discrete(W, Y, planes, method=method, row_weights=w, limits=tight)


@pytest.mark.parametrize("seed", range(6))
def test_a_plane_of_any_weight_follows_the_others(seed):
    rng = np.random.default_rng(seed)
    W = rng.standard_normal((6, 2)) + 1j * rng.standard_normal((6, 2))
    Y = rng.standard_normal(6) + 1j * rng.standard_normal(6)
    holes = from_list(equal_holes(5, 0.2), [0.3])
    left = [Y + W[:, 1] * d for d in everything(holes)[0]]
    rests = [y + W[:, 0] * np.linalg.lstsq(W[:, :1], -y, rcond=None)[0] for y in left]
    found = solve_discrete(W, Y, [None, holes])
    assert found.objective == pytest.approx(min(map(np.linalg.norm, rests)), rel=1e-7)
    assert found.mountings[0] is None
    # holes all around that take any amount are the same as no holes
    same = solve_discrete(W, Y, [from_list(equal_holes(4)), holes])
    assert same.objective == pytest.approx(found.objective, rel=1e-9)
    assert same.mountings[0].vector == pytest.approx(same.weights[0], abs=1e-7)
    assert np.count_nonzero(same.mountings[0].amounts > 1e-6) <= 2


@pytest.mark.parametrize("method", METHODS)
def test_steps_of_free_amounts_equal_enumeration(method):
    rng = np.random.default_rng(5)
    W = rng.standard_normal((5, 2)) + 1j * rng.standard_normal((5, 2))
    Y = rng.standard_normal(5) + 1j * rng.standard_normal(5)
    planes = [from_list(equal_holes(4, 0.3), step=0.2), from_list([0.1, 1.0], step=0.25, max_weight=1.0)]
    steps, lists = np.arange(30), []
    for holes, pairs in zip(planes, ([(0, 1), (1, 2), (2, 3), (3, 0)], [(0, 1)]), strict=True):
        e = np.exp(1j * holes.angles) * holes.step
        all_of = np.concatenate([(steps[:, None] * e[p] + steps * e[q]).ravel() for p, q in pairs])
        lists.append(all_of[holes.allows(all_of)])
    found = solve_discrete(W, Y, planes, method=method)
    best = objectives(method, W, Y, np.ones(5), grid(lists)).min()
    assert found.objective == pytest.approx(best, rel=1e-8)
    for holes, mounting in zip(planes, found.mountings, strict=True):
        assert np.allclose(mounting.amounts / holes.step, np.rint(mounting.amounts / holes.step))


BEST = {"least-squares": 4.6265944, "minmax": 1.2215956}
"""At most 7 pieces: what branch and bound knew after 40 s, before it went."""


def three_planes():
    """24 holes, two sizes, 60 readings, coefficients of condition 10."""
    rng = np.random.default_rng(7)
    U, _ = np.linalg.qr(rng.standard_normal((60, 3)) + 1j * rng.standard_normal((60, 3)))
    V, _ = np.linalg.qr(rng.standard_normal((3, 3)) + 1j * rng.standard_normal((3, 3)))
    W = U * [10.0, 3.0, 1.0] @ V.conj().T
    noise = 0.3 * (rng.standard_normal(60) + 1j * rng.standard_normal(60)) / np.sqrt(60)
    wanted = np.array([23.0, 17.0, 14.0]) * np.exp(1j * np.array([0.3, 2.0, 4.0]))
    return W, noise - W @ wanted, [from_list(equal_holes(24, 0.1 * p), [5.0, 10.0]) for p in range(3)]


@pytest.mark.parametrize("method", METHODS)
def test_three_planes_of_24_holes(method):
    W, Y, planes = three_planes()
    found = solve_discrete(W, Y, planes, lambda _: False, method=method)
    seven = [one for one in (*found.fewer, found) if one.pieces <= 7][-1]
    assert seven.objective == pytest.approx(BEST[method], rel=0.02)
    for one in (*found.fewer, found):
        for mounting, holes, z in zip(one.mountings, planes, np.linalg.lstsq(W, -Y)[0], strict=True):
            least = lightest(holes, holes.free, z, 10.0).sum()
            assert mounting.counts.sum() <= 2 or mounting.amounts.sum() <= HEAVIER * least * 1.05


def test_the_least_sum_that_makes_a_weight():
    holes, size = from_list(equal_holes(12), [10.0]), 10.0
    assert lightest(holes, holes.free, 8.0 + 0j, size).sum() == pytest.approx(8, rel=1e-6)
    between = 8.0 * np.exp(1j * np.radians(15))
    assert lightest(holes, holes.free, between, size).sum() == pytest.approx(
        8 / np.cos(np.radians(15)), rel=1e-6
    )
    # three holes at ±30° full, the rest in the next ones
    full = 10 * (1 + 2 * np.cos(np.radians(30)))
    assert lightest(holes, holes.free, full + 0j, size).sum() == pytest.approx(30, rel=1e-6)
    more = lightest(holes, holes.free, full + 5 + 0j, size)
    assert more @ np.exp(1j * holes.angles) == pytest.approx(full + 5, rel=1e-6)
    assert more.sum() == pytest.approx(40, rel=1e-6)


def test_two_pieces_may_always_weigh_more():
    """A weight below the lightest piece: two that act against each other, but not three."""
    W, Y = np.eye(1), np.array([-0.3 + 0j])
    holes = from_list(equal_holes(24), [1.0])
    found = solve_discrete(W, Y, [holes], lambda d: abs(d[0] - 0.3) < 0.06)
    assert (found.pieces, found.enough) == (2, True)
    finer = solve_discrete(W, Y, [holes], lambda d: abs(d[0] - 0.3) < 1e-3)
    assert finer.pieces <= 2
    assert not finer.enough


def test_forbidden_arcs_and_largest_weights():
    holes = from_list(equal_holes(8), [0.5])
    arcs = Limits(np.array([np.inf]), np.full((1, 1), np.inf), (((-0.1, 0.2),),))
    found = solve_discrete([[1.0]], [-0.5], [holes], limits=arcs)
    assert found.mountings[0].counts[0].sum() == 0
    assert solve_discrete([[1.0]], [-0.5], [holes]).objective == pytest.approx(0, abs=1e-12)
    small = Limits(np.array([0.45]), np.full((1, 1), np.inf), ((),))
    vector = solve_discrete([[1.0]], [-0.5], [holes], limits=small).weights[0]
    every = everything(holes)[0]
    best = np.abs(every[np.abs(every) <= 0.45] - 0.5).min()
    assert abs(vector - 0.5) == pytest.approx(best, rel=1e-9)
    limited = solve_discrete([[1.0]], [-0.5], [None], limits=small)
    assert limited.weights[0] == pytest.approx(0.45, abs=1e-3)


def test_many_holes_at_odd_angles_are_answered_within_seconds():
    angles = np.sort(np.random.default_rng(5).uniform(0, 2 * np.pi, 40))
    holes = from_list(angles[:28], [0.01, 0.02, 0.03], stock=[9, 9, 9])
    plane = PlaneVectors(holes, 0.05j, most=np.inf)
    near = plane.near(0.05j, 1)
    assert abs(near.d[0] - 0.05j) < 2e-3 * 0.05
    scarce = from_list(equal_holes(36), [1.5, 7.5], stock=[8, 2])
    z = complex([42.63, -9.0, -6.0] @ np.exp(1j * np.radians([20.0, 292.0, 200.0])))
    far = PlaneVectors(scarce, z, most=np.inf).near(z, 1)
    assert abs(far.d[0] - z) < 24.3  # all ten pieces, side by side


@pytest.mark.parametrize("method", METHODS)
def test_no_pieces_where_nothing_vibrates(method):
    planes = [from_list(equal_holes(12, 0.1), [0.01, 0.02])]
    found = solve_discrete(np.ones((3, 1)), np.zeros(3), planes, method=method)
    assert found.objective == 0
    assert not found.mountings[0].counts.any()


def test_planes_that_act_alike_are_answered():
    W, Y = np.array([[1.0, 1.0], [2.0, 2.0]]), np.array([-1.0, -2.0])
    found = solve_discrete(W, Y, [from_list(equal_holes(6), [0.5, 1.0])] * 2, lambda _: False)
    assert found.objective == pytest.approx(0, abs=1e-9)


def test_bad_input():
    holes = from_list(equal_holes(4), [1.0])
    W, Y = np.ones((2, 1)), np.ones(2)
    with pytest.raises(ValueError, match="for each of the 1 planes"):
        solve_discrete(W, Y, [holes, holes])
    with pytest.raises(ValueError, match="finite"):
        solve_discrete(W, [np.nan, 1], [holes])
    arcs = Limits(np.array([np.inf]), np.full((1, 2), np.inf), (((0.0, 2 * np.pi),),))
    with pytest.raises(ValueError, match="has forbidden angles but no holes"):
        solve_discrete(W, Y, {"DE": None}, limits=arcs)
    most = Limits(np.array([np.inf]), np.full((1, 2), np.inf), (((-0.1, 6.2),),))
    with pytest.raises(ValueError, match="plane DE: every hole is taken"):
        solve_discrete(W, Y, {"DE": from_list([0.5], [1.0])}, limits=most)
    heavy = from_list([0.0, 0.2], [0.005], taken=[0.02, 0], max_weight=0.015)
    with pytest.raises(ValueError, match="no admissible weight at all"):
        solve_discrete(W, Y, [heavy])
