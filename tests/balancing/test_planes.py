"""The best k planes: against trying them one by one."""

from itertools import combinations

import numpy as np
import pytest
from balancing_data import complex_normal

from balancing import ReadingErrors, UndeterminedError, best_subsets
from balancing.errors import reading_covariance

NAMES = "ABCDEFGHIJKLMNOPQRSTUVWXYZ"


def case(N=14, P=5, seed=0):
    rng = np.random.default_rng(seed)
    return (
        complex_normal(rng, (N, P)) * np.geomspace(0.1, 10, P),
        complex_normal(rng, N),
        rng.uniform(0.3, 2, N),
    )


@pytest.mark.parametrize("k", [1, 2, 3, 5])
@pytest.mark.parametrize("weighted", [False, True])
def test_by_rms_against_one_by_one(k, weighted):
    W, Y, w = case()
    w = w if weighted else np.ones(len(Y))
    expected = []
    for choice in combinations(range(5), k):
        K = w[:, None] * W[:, choice]
        D = -np.linalg.lstsq(K, w * Y, rcond=None)[0]
        r = np.abs(Y + W[:, choice] @ D)
        condition = np.linalg.cond(K / np.linalg.norm(K, axis=0))
        numbers = np.sqrt(np.mean((w * r) ** 2)), np.sqrt(np.mean(r**2)), r.max(), condition
        expected.append((numbers, tuple(NAMES[p] for p in choice), D))
    expected.sort(key=lambda each: each[0])
    found = best_subsets(W, Y, NAMES[:5], k, row_weights=w if weighted else None, show=4)
    assert found.choices == len(expected)
    assert len(found.planes) == min(4, len(expected))
    columns = found.objective, found.rms, found.largest, found.condition_number
    for m, (numbers, planes, D) in enumerate(expected[:4]):
        assert found.planes[m] == planes
        np.testing.assert_allclose(found.weights[m], D, rtol=1e-9)
        np.testing.assert_allclose([column[m] for column in columns], numbers, rtol=1e-9)


def test_choices_with_planes_that_act_alike_are_left_out_and_counted():
    W, Y, _ = case(P=4)
    W[:, 2] = 3j * W[:, 0]
    W[:, 3] = 0
    found = best_subsets(W, Y, NAMES[:4], 2)
    assert set(found.planes) == {("A", "B"), ("B", "C")}
    assert (found.choices, found.dependent) == (2, 4)
    assert "4 more choices have planes that act alike" in found.answer.whole()
    with pytest.raises(UndeterminedError, match="planes of every choice of 2 act alike"):
        best_subsets(W[:, [0, 2]], Y, "AC", 2)


@pytest.mark.parametrize(
    ("N", "P", "k", "more", "words"),
    [
        (30, 18, 9, {}, "there are 48620 choices of 9 out of 18 planes, more than the 20000"),
        (9, 3, 0, {}, "choose between 1 and 3 planes; got 0"),
        (2, 4, 3, {}, "3 planes need at least 3 readings"),
    ],
)
def test_what_is_refused(N, P, k, more, words):
    with pytest.raises(ValueError, match=words):
        best_subsets(np.ones((N, P)), np.ones(N), **{"planes": NAMES[:P], "k": k, **more})


def fighting(rng, N=10):
    """A and B act alike and explain a little more, fighting each other, than A and C, which do not."""
    W = complex_normal(rng, (N, 3))
    W[:, 1] = W[:, 0] + 0.02 * complex_normal(rng, N)
    extra = 0.2 * complex_normal(rng, N)
    Y = -W[:, 0] + (W[:, 1] - W[:, 0]) * 10 + extra - 0.9 * np.vdot(W[:, 2], extra) / N * W[:, 2]
    covariance = np.zeros((N, 4, 2, 4, 2))
    for p, z in enumerate((Y, *W.T)):
        covariance[:, p, :, p] = reading_covariance(z, ReadingErrors(0.02, 0.02))
    return W, Y, covariance.reshape(N, 8, 8)


def test_a_fighting_pair_counts_by_the_errors_it_brings():
    W, Y, covariance = fighting(np.random.default_rng(3))
    plain = best_subsets(W, Y, "ABC", 2)
    found = best_subsets(W, Y, "ABC", 2, covariance=covariance)
    assert plain.planes[0] == ("A", "B")
    assert found.planes[0] != ("A", "B")
    np.testing.assert_array_equal(plain.expected, plain.rms)
    last = found.planes.index(("A", "B"))
    assert found.expected[last] > 1.2 * found.expected[0]
    assert np.abs(found.weights[last]).max() > 5 * np.abs(found.weights[0]).max()
    assert (np.diff(found.objective) >= 0).all()
