"""Which planes act alike, and what the readings can tell."""

import json

import numpy as np
import pytest
from balancing_data import complex_normal, polar
from cases import each_of

from balancing.solvers.conditioning import ALIKE, conditioning


def orthonormal(rng, N, P):
    return np.linalg.qr(complex_normal(rng, (N, P)))[0]


def alike_pair(share, ratio, size=3.0):
    """A third plane that nothing has to do with, and two of which one does ratio times the other's."""
    e = orthonormal(np.random.default_rng(4), 12, 3)
    a = size * e[:, 0]
    b = ratio * size * (np.sqrt(1 - share**2) * e[:, 0] + share * e[:, 1])
    return np.column_stack((a, b, 0.2 * e[:, 2]))


def test_two_planes_that_act_alike_are_named_with_ratio_turn_and_share():
    found = conditioning(alike_pair(0.03, polar(2.1, 35)), ["A", "B", "C"])
    assert [a.words for a in found.alike] == [
        "planes 'A' and 'B' act alike: 2.1 times a weight in 'A', turned by 35° with the rotation, does what "
        "a weight does in 'B', but for 3 % of the effect"
    ]
    np.testing.assert_allclose(found.alike[0].share, 0.03, rtol=1e-10)
    np.testing.assert_allclose(found.alike[0].ratios, [polar(2.1, 35) * np.sqrt(1 - 0.03**2)], rtol=1e-12)
    # the two singular values of a pair with the cosine c are sqrt(1 ± c), the third plane has 1
    c = np.sqrt(1 - 0.03**2)
    np.testing.assert_allclose(found.singular_values, np.sqrt([1 + c, 1, 1 - c]), rtol=1e-9)
    np.testing.assert_allclose(found.condition_number, np.sqrt((1 + c) / (1 - c)), rtol=1e-9)


@pytest.mark.parametrize(
    ("ratio", "words"),
    [
        (polar(0.5, -120), "0.5 times a weight in 'A', turned by 120° against the rotation, does"),
        (polar(2.0, 180), "2 times a weight in 'A', turned by 180°, does"),
        (1.0, "a weight in 'A' does"),
    ],
)
def test_turns_in_words(ratio, words):
    found = conditioning(alike_pair(0.0, ratio), ["A", "B", "C"])
    assert found.alike[0].words == (f"planes 'A' and 'B' act alike: {words} what a weight does in 'B'")
    assert found.rank == 2
    assert found.condition_number == np.inf
    assert found.to_dict()["condition_number"] is None


def test_the_threshold_is_the_share_that_differs():
    for share, expected in ((ALIKE * 0.99, 1), (ALIKE * 1.01, 0)):
        assert len(conditioning(alike_pair(share, 1.0), ["A", "B", "C"]).alike) == expected


def test_units_of_the_planes_do_not_matter():
    W = alike_pair(0.05, 1.0)
    a, b = conditioning(W, ["A", "B", "C"]), conditioning(W * [1e-6, 1.0, 1e6], ["A", "B", "C"])
    np.testing.assert_allclose(a.singular_values, b.singular_values, rtol=1e-10)
    np.testing.assert_allclose(b.alike[0].ratios, a.alike[0].ratios * 1e6, rtol=1e-10)


def test_a_plane_that_two_others_together_stand_in_for():
    e = orthonormal(np.random.default_rng(2), 10, 5)
    W = e[:, :4] @ np.diag([1.0, 4.0, 1.0, 1.0])
    W[:, 3] = 2 * W[:, 0] - 0.5j * W[:, 1] + 0.05 * e[:, 4]
    found = conditioning(W, ["A", "B", "C", "D"])
    (group,) = found.alike
    assert {group.plane, *group.others} == {"A", "B", "D"}
    assert group.share < 0.03
    i = ["A", "B", "C", "D"].index
    stand_in = W[:, [i(p) for p in group.others]] @ group.ratios
    left = np.linalg.norm(W[:, i(group.plane)] - stand_in) / np.linalg.norm(W[:, i(group.plane)])
    np.testing.assert_allclose(group.share, left, rtol=1e-9)
    assert "together do what a weight does in" in group.words
    assert "'C'" not in group.words


def test_three_planes_alike_are_two_pairs():
    e = orthonormal(np.random.default_rng(7), 9, 4)
    W = np.column_stack([e[:, 0] + 0.01 * k * e[:, k] for k in (1, 2, 3)])
    found = conditioning(W, ["A", "B", "C"])
    assert [(a.others, a.plane) for a in found.alike] == [(("A",), "B"), (("A",), "C")]


def test_the_most_alike_pair_comes_first_whatever_the_turn():
    e = orthonormal(np.random.default_rng(7), 9, 3)
    W = np.column_stack((e[:, 0], e[:, 0] + 0.05 * e[:, 1], 1j * e[:, 0] + 0.01 * e[:, 2]))
    found = conditioning(W, ["A", "B", "C"])
    assert [(a.others, a.plane) for a in found.alike] == [(("A",), "C"), (("A",), "B")]
    assert "turned by 90° with the rotation" in found.alike[0].words


def test_more_planes_than_readings_and_a_plane_without_effect():
    rng = np.random.default_rng(1)
    W = complex_normal(rng, (2, 4))
    W[:, 1] = 0
    found = conditioning(W, ["A", "B", "C", "D"])
    assert (found.rank, found.without_effect, found.condition_number) == (2, ("B",), np.inf)
    assert len(found.alike) == 1
    assert found.alike[0].share < 1e-12
    text = found.summary()
    assert text.startswith("4 planes, 2 readings: rank 2 of 4, no condition number.\n")
    assert "Plane 'B' has no effect on any reading." in text
    assert max(map(len, text.splitlines())) <= 80


def test_planes_that_differ_say_so_and_give_the_usual_condition_number():
    W = orthonormal(np.random.default_rng(3), 8, 3) * [1.0, 20.0, 0.3]
    W[:, 1] += 0.2 * W[:, 0] * 20
    found = conditioning(W, ["A", "B", "C"])
    np.testing.assert_allclose(
        found.condition_number, np.linalg.cond(W / np.linalg.norm(W, axis=0)), rtol=1e-10
    )
    assert found.alike == ()
    assert (
        "No planes act alike: each does more than 10 % that the others cannot do."
        in found.summary().replace("\n  ", " ")
    )


def test_row_weights_leave_readings_out():
    W = complex_normal(np.random.default_rng(5), (6, 2))
    w = np.array([1, 2, 0, 1, 0, 3.0])
    found, expected = conditioning(W, ["A", "B"], w), conditioning((W * w[:, None])[w > 0], ["A", "B"])
    np.testing.assert_allclose(found.singular_values, expected.singular_values, rtol=1e-12)
    assert found.readings == 4


def test_to_dict_is_json_and_names_the_groups():
    found = json.loads(json.dumps(conditioning(alike_pair(0.03, polar(2.1, 35)), "ABC").to_dict()))
    (group,) = found["alike"]
    assert (group["plane"], group["others"]) == ("B", ["A"])
    np.testing.assert_allclose([group["ratios"][0], group["turned_deg"][0]], [2.1, 35], rtol=1e-3)
    assert found["readings"] == 12


@each_of(
    ("W", "planes", "weights", "words"),
    [
        ([[1, np.nan]], "AB", None, "found NaN"),
        ([1, 2], "A", None, "readings, planes"),
        (np.zeros((0, 2)), "AB", None, "not empty"),
        ([[1, 2]], "AA", None, "different names"),
        ([[1, 2]], "A", None, "2 different names"),
        ([[1, 2], [2, 1]], "AB", [1, -1], "row weights must be"),
        ([[1, 2], [2, 1]], "AB", [1], "row weights must be"),
        ([[1, 2], [2, 1]], "AB", [0, 0], "not all zero"),
    ],
)
def test_what_is_refused(W, planes, weights, words):
    with pytest.raises(ValueError, match=words):
        conditioning(W, planes, weights)
