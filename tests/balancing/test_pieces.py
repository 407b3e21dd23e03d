"""Pieces of all planes chosen together: brute force, certified optima, limits, and what is enough."""

import numpy as np
import pytest
from balancing_data import complex_normal
from mountings import everything

from balancing.holes import equal_holes, from_list, lightest
from balancing.piece_search import HEAVIER, solve_discrete
from balancing.trials import Limits

METHODS = ("least-squares", "minmax")


def case(seed):
    """Random coefficients, readings, planes and row weights; all sorts of holes, few enough to enumerate."""
    rng = np.random.default_rng(seed)
    P = int(rng.integers(1, 4))
    N = int(rng.integers(P, 9))
    W = complex_normal(rng, (N, P))
    Y = complex_normal(rng, N) * 10 ** rng.uniform(-0.3, 1)
    planes, most = [], np.full(P, np.inf)
    for p in range(P):
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
            )
        )
        most[p] = 1.2 if rng.random() < 0.3 else np.inf
    limits = Limits(most, np.full((1, N), np.inf), ((),) * P)
    return W, Y, planes, rng.uniform(0.2, 2, N) if rng.random() < 0.5 else np.ones(N), limits


def objectives(method, W, Y, w, D):
    size = np.abs(Y + D @ W.T) * w
    return size.max(axis=1) if method == "minmax" else np.linalg.norm(size, axis=1)


def grid(parts):
    return np.stack([g.ravel() for g in np.meshgrid(*parts, indexing="ij")], axis=1)


def every(planes, limits):
    """Vectors of all planes together."""
    return grid([everything(*part)[0] for part in zip(planes, limits.max_weight, strict=True)])


def kept(planes, limits, found):
    """What is mounted is possible, and adds up to the weights."""
    each = zip(planes, limits.max_weight, found.mountings, found.weights, strict=True)
    for holes, most, mounting, weight in each:
        assert mounting.vector == pytest.approx(weight, abs=1e-12)
        assert (mounting.counts.sum(axis=1) <= holes.per_hole).all()
        assert not mounting.amounts[~holes.free].any()
        assert abs(holes.mounted + mounting.vector) <= most * (1 + 1e-9)
        assert holes.stock is None or (mounting.counts.sum(axis=0) <= holes.stock).all()


@pytest.mark.parametrize("method", METHODS)
@pytest.mark.parametrize("seed", range(10))
def test_equals_exhaustive_enumeration(seed, method):
    W, Y, planes, w, limits = case(seed)
    D = every(planes, limits)
    found = solve_discrete(W, Y, planes, method=method, row_weights=w, limits=limits)
    least = objectives(method, W, Y, w, D).min()
    if (seed, method) == (4, "minmax"):  # the one that is not the least of all
        assert least * (1 + 1e-6) < found.objective <= 1.02 * least
    else:
        assert found.objective == pytest.approx(least, rel=1e-8)
    kept(planes, limits, found)
    assert np.allclose(found.residual, Y + W @ found.weights, rtol=0, atol=1e-12)


@pytest.mark.parametrize("method", METHODS)
@pytest.mark.parametrize("seed", range(10))
def test_the_fewest_pieces_that_are_enough_equal_enumeration(seed, method):
    W, Y, planes, w, limits = case(3000 + seed)
    wanted = -np.linalg.lstsq(W, Y, rcond=None)[0]
    parts = []
    for holes, most, z in zip(planes, limits.max_weight, wanted, strict=True):
        d, number, weight = everything(holes, most)
        least = lightest(holes, holes.free, complex(z), holes.per_hole * holes.pieces.max()).sum()
        fits = (weight <= HEAVIER * least * (1 + 1e-9)) | (number <= 2)
        parts.append((d[fits], number[fits]))
    D, number = grid([d for d, _ in parts]), grid([n for _, n in parts]).sum(axis=1)
    size = objectives(method, W, Y, w, D)
    level = 1.3 * size.min()

    def enough(weights):
        return objectives(method, W, Y, w, weights[None])[0] <= level

    options = {"wanted": wanted, "method": method, "row_weights": w, "limits": limits}
    found = solve_discrete(W, Y, planes, enough, **options)
    pieces = number[size <= level].min()
    assert found.enough
    assert (found.pieces, found.objective) == (pieces, pytest.approx(size[number <= pieces].min(), rel=1e-8))
    kept(planes, limits, found)
    ladder = [one.pieces for one in found.fewer]
    assert ladder == sorted(set(ladder))
    for one in found.fewer:  # the best of so many, each better than the one before
        assert one.objective == pytest.approx(size[number <= one.pieces].min(), rel=1e-8)
        assert not enough(one.weights)
    never = solve_discrete(W, Y, planes, lambda _: False, **options)
    assert not never.enough
    assert never.objective <= 1.2 * size.min() * (1 + 1e-9)


@pytest.mark.parametrize("method", METHODS)
@pytest.mark.parametrize("seed", range(5))
def test_limits_of_amplitudes_equal_enumeration(seed, method):
    W, Y, planes, w, limits = case(1000 + seed)
    D = every(planes, limits)
    sizes = np.abs(Y + D @ W.T)
    residual = np.full((1, len(Y)), np.inf)
    free = solve_discrete(W, Y, planes, method=method, row_weights=w, limits=limits)
    worst = int(np.argmax(np.abs(free.residual) - sizes.min(axis=0)))
    residual[0, worst] = 0.5 * (sizes[:, worst].min() + abs(free.residual[worst])) * (1 + 1e-6)
    limits = Limits(limits.max_weight, residual, limits.forbidden)
    good = (sizes <= residual[0]).all(axis=1)
    found = solve_discrete(W, Y, planes, method=method, row_weights=w, limits=limits)
    assert abs(found.residual[worst]) <= residual[0, worst] * (1 + 1e-8)
    assert found.objective == pytest.approx(objectives(method, W, Y, w, D[good]).min(), rel=1e-8)


@pytest.mark.parametrize("seed", range(2))
def test_a_plane_of_any_weight_follows_the_others(seed):
    rng = np.random.default_rng(seed)
    W, Y = complex_normal(rng, (6, 2)), complex_normal(rng, 6)
    holes = from_list(equal_holes(5, 0.2), [0.3])
    left = [Y + W[:, 1] * d for d in everything(holes)[0]]
    rests = [y - W[:, 0] * np.vdot(W[:, 0], y) / np.vdot(W[:, 0], W[:, 0]) for y in left]
    # holes all around that take any amount are the same as no holes
    for first in (None, from_list(equal_holes(4))):
        found = solve_discrete(W, Y, [first, holes])
        assert found.objective == pytest.approx(min(map(np.linalg.norm, rests)), rel=1e-7)
    assert found.mountings[0].vector == pytest.approx(found.weights[0], abs=1e-7)
    assert np.count_nonzero(found.mountings[0].amounts > 1e-6) <= 2


BEST = {"least-squares": 4.6265944, "minmax": 1.2215956}
"""At most 7 pieces: what branch and bound knew after 40 s, before it went."""


def three_planes():
    """24 holes, two sizes, 60 readings, coefficients of condition 10."""
    rng = np.random.default_rng(7)
    U, _ = np.linalg.qr(complex_normal(rng, (60, 3)))
    V, _ = np.linalg.qr(complex_normal(rng, (3, 3)))
    W = U * [10.0, 3.0, 1.0] @ V.conj().T
    noise = 0.3 * complex_normal(rng, 60) / np.sqrt(60)
    wanted = np.array([23.0, 17.0, 14.0]) * np.exp(1j * np.array([0.3, 2.0, 4.0]))
    return W, noise - W @ wanted, [from_list(equal_holes(24, 0.1 * p), [5.0, 10.0]) for p in range(3)]


@pytest.mark.parametrize("method", METHODS)
def test_three_planes_of_24_holes(method):
    W, Y, planes = three_planes()
    found = solve_discrete(W, Y, planes, lambda _: False, method=method)
    seven = [one for one in (*found.fewer, found) if one.pieces <= 7][-1]
    assert seven.objective == pytest.approx(BEST[method], rel=0.02)
    for one in (*found.fewer, found):
        for mounting, holes, z in zip(one.mountings, planes, np.linalg.lstsq(W, -Y, None)[0], strict=True):
            least = lightest(holes, holes.free, z, 10.0).sum()
            assert mounting.counts.sum() <= 2 or mounting.amounts.sum() <= HEAVIER * least * 1.05


@pytest.mark.parametrize(("most", "arc"), [(np.inf, ((-0.1, 0.2),)), (0.45, ()), (np.inf, ())])
def test_forbidden_arcs_and_largest_weights(most, arc):
    holes = from_list(equal_holes(8), [0.5])
    limits = Limits(np.array([most]), np.full((1, 1), np.inf), (arc,))
    found = solve_discrete([[1.0]], [-0.5], [holes], limits=limits)
    every = everything(from_list(equal_holes(8), [0.5], taken=[1.0 if arc else 0.0, *[0.0] * 7]))[0]
    assert found.objective == pytest.approx(np.abs(every[np.abs(every) <= most] - 0.5).min(), abs=1e-9)
    if not arc:
        plain = solve_discrete([[1.0]], [-0.5], [None], limits=limits)
        assert plain.weights[0] == pytest.approx(min(most, 0.5), abs=1e-3)


ALMOST_ALL = Limits(np.array([np.inf]), np.full((1, 2), np.inf), (((-0.1, 6.2),),))
FOUR = from_list(equal_holes(4), [1.0])


@pytest.mark.parametrize(
    ("Y", "planes", "limits", "words"),
    [
        (
            [9, 9],
            [FOUR],
            Limits(np.array([np.inf]), np.full((1, 2), 1e-3), ((),)),
            "keeps every limit was found",
        ),
        ([1, 1], {"DE": from_list([0.5], [1.0])}, ALMOST_ALL, "plane DE: every hole is taken"),
        (
            [1, 1],
            [from_list([0.0, 0.2], [0.005], taken=[0.02, 0])],
            Limits(np.array([0.015]), np.full((1, 2), np.inf), ((),)),
            "no admissible weight at all",
        ),
    ],
)
def test_bad_input(Y, planes, limits, words):
    with pytest.raises(ValueError, match=words):
        solve_discrete(np.ones((2, 1)), Y, planes, limits=limits)
