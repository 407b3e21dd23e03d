"""The best k planes: against trying them one by one."""

import json
from itertools import combinations

import numpy as np
import pytest
from balancing_data import complex_normal

from balancing import Labels, ReadingErrors, UndeterminedError, best_subsets
from balancing.errors import reading_covariance
from rotorid.regression import stretch

NAMES = "ABCDEFGHIJKLMNOPQRSTUVWXYZ"
LABELS = Labels(vibration_unit="um_pp", vibration_scale=2e6, weight_unit="g", weight_scale=1e3)


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
    if not weighted:
        w = np.ones(len(Y))
    expected = []
    for choice in combinations(range(5), k):
        K = W[:, choice]
        D = -np.linalg.lstsq(w[:, None] * K, w * Y, rcond=None)[0]
        r = np.abs(Y + K @ D)
        scaled = w[:, None] * K
        condition = np.linalg.cond(scaled / np.linalg.norm(scaled, axis=0))
        rank = np.sqrt(np.mean((w * r) ** 2))
        expected.append((rank, choice, D, np.sqrt(np.mean(r**2)), r.max(), condition))
    expected.sort(key=lambda e: e[0])
    found = best_subsets(W, Y, NAMES[:5], k, row_weights=w if weighted else None, show=4)
    assert found.choices == len(expected)
    assert len(found.planes) == min(4, len(expected))
    for m, (objective, choice, D, rms, largest, condition) in enumerate(expected[:4]):
        assert found.planes[m] == tuple(NAMES[p] for p in choice)
        np.testing.assert_allclose(found.weights[m], D, rtol=1e-9)
        np.testing.assert_allclose(
            [found.objective[m], found.rms[m], found.largest[m], found.condition_number[m]],
            [objective, rms, largest, condition],
            rtol=1e-9,
        )


def test_the_planes_that_hold_the_unbalance_are_found():
    W, _, _ = case(P=6)
    D = np.array([0.2 - 0.1j, 0.5j])
    found = best_subsets(W, -W[:, [1, 3]] @ D, NAMES[:6], 2)
    assert found.planes[0] == ("B", "D")
    np.testing.assert_allclose(found.weights[0], D, rtol=1e-9)
    assert found.rms[0] < 1e-12 * found.rms_before
    assert found.rms[1] > 0.01 * found.rms_before


def test_more_planes_than_readings_leave_choices_that_fit():
    W, Y, _ = case(N=2, P=4)
    found = best_subsets(W, Y, NAMES[:4], 2)
    assert found.choices == 6
    np.testing.assert_allclose(found.rms, 0, atol=1e-12)


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


def test_tables_speak_the_units_of_the_job():
    W, Y, _ = case()
    found = best_subsets(W, Y * 1e-6, NAMES[:5], 2, labels=LABELS, show=3)
    data = json.loads(json.dumps(found.to_dict()))
    np.testing.assert_allclose(data["rms_before"], found.rms_before * 2e6, rtol=1e-12)
    for key, values in (
        ("max_after", found.largest * 2e6),
        ("largest_weight", np.abs(found.weights).max(1) * 1e3),
    ):
        np.testing.assert_allclose([row[key] for row in data["rows"]], values, rtol=1e-12)
    weight = data["rows"][0]["weights"][1]
    assert (weight["plane"], weight["unit"]) == (found.planes[0][1], "g")
    np.testing.assert_allclose(
        weight["angle_deg"], np.degrees(np.angle(found.weights[0, 1])) % 360, rtol=1e-9
    )
    best, rms = ", ".join(found.planes[0]), found.rms[0] * 2e6
    assert f"by rms after correction (µm pp): {best}: {rms:.2f}; " in found.answer.brief()
    lines = found.answer.tables[0].splitlines()
    assert lines[0] == "The best of 10 choices of 2 planes, by rms after correction (µm pp)"
    assert lines[1].split() == [
        "planes",
        "rms",
        "expected",
        "largest",
        "largest",
        "weight,",
        "g",
        "condition",
    ]
    assert lines[2].startswith("  " + ", ".join(found.planes[0]))
    assert lines[-1].startswith("Before: rms ")
    assert max(map(len, lines)) <= 80


@pytest.mark.parametrize(
    ("N", "P", "k", "more", "words"),
    [
        (30, 18, 9, {}, "there are 48620 choices of 9 out of 18 planes, more than the 20000"),
        (9, 3, 0, {}, "choose between 1 and 3 planes; got 0"),
        (9, 3, 4, {}, "choose between 1 and 3 planes; got 4"),
        (2, 4, 3, {}, "3 planes need at least 3 readings"),
        (9, 3, 2, {"row_weights": [1, 2]}, "row weights must be"),
    ],
)
def test_what_is_refused(N, P, k, more, words):
    with pytest.raises(ValueError, match=words):
        best_subsets(np.ones((N, P)), np.ones(N), NAMES[:P], k, **more)


def test_nan_and_names_are_refused():
    with pytest.raises(ValueError, match="found NaN"):
        best_subsets([[1, 2], [np.nan, 1]], [1, 1], "AB", 1)
    with pytest.raises(ValueError, match="different names"):
        best_subsets([[1, 2], [2, 1]], [1, 1], "AA", 1)


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
    for m, planes in enumerate(found.planes):
        columns = ["ABC".index(p) for p in planes]
        index = [0, 1, *(k for c in columns for k in (2 + 2 * c, 3 + 2 * c))]
        own = covariance[:, index][:, :, index]
        B = stretch([[1.0, *found.weights[m]]])
        errors = np.trace(B @ own @ B.T, axis1=1, axis2=2)
        np.testing.assert_allclose(found.expected[m] ** 2, found.rms[m] ** 2 + errors.mean(), rtol=1e-10)
