"""Formula (50) with other normalisations, row weights, bounds and seals."""

import numpy as np
import pytest
from book_task_9 import COMPLIANCE, FREQUENCIES, SHAPES
from cases import each_of
from hypothesis import given, settings
from hypothesis import strategies as st

from rotorid.reduction import equivalent_masses, natural_frequencies
from rotorid.reduction.masses import design

NORMALISATIONS = ("first", "largest", "length")


def chain(seed, n):
    """A random n-mass model: compliance, masses, springs, frequencies and shapes."""
    rng = np.random.default_rng(seed)
    A = rng.normal(size=(n, n))
    alpha, masses = (A @ A.T + np.eye(n)) * 1e-8, rng.uniform(20, 200, n)
    springs = rng.uniform(0, 1e7, n)
    omega, shapes = natural_frequencies(alpha, masses, seal_stiffness=springs)
    return alpha, masses, springs, omega, shapes


def test_the_rows_are_those_printed_in_the_book():
    """[S] prints B and D for two modes with a seal c at the middle mass."""
    a, (l1, l2), c = COMPLIANCE, 1 / FREQUENCIES[:2] ** 2, 3e6
    U21, U31, U22, U32 = SHAPES[1, 0], SHAPES[2, 0], SHAPES[1, 1], SHAPES[2, 1]
    B, D = design(a, FREQUENCIES[:2], -3 * SHAPES[:, :2], seal_stiffness=[0, c, 0])
    np.testing.assert_allclose(B[:3], a * [1, U21, U31], rtol=1e-14)
    np.testing.assert_allclose(B[3:], a * [1, U22, U32], rtol=1e-14)
    expected = [
        l1 * (1 + a[0, 1] * c * U21), l1 * U21 * (1 + a[1, 1] * c), l1 * (U31 + a[2, 1] * c * U21),
        l2 * (1 + a[0, 1] * c * U22), l2 * U22 * (1 + a[1, 1] * c), l2 * (U32 + a[2, 1] * c * U22),
    ]  # fmt: skip
    np.testing.assert_allclose(D, expected, rtol=1e-13)


@settings(max_examples=40, deadline=None)
@given(
    seed=st.integers(0, 10**6), n=st.integers(1, 5), k=st.integers(1, 5),
    normalise=st.sampled_from(NORMALISATIONS), rows=st.sampled_from(["equal", "relative"]),
)  # fmt: skip
def test_a_true_model_gets_its_masses_back_whatever_is_chosen(seed, n, k, normalise, rows):
    alpha, masses, springs, omega, shapes = chain(seed, n)
    k = min(k, n)
    sizes = np.random.default_rng(seed).uniform(-3, 3, k) + 0.1
    shapes = shapes[:, :k] * sizes
    if (np.abs(shapes) < 1e-4 * np.abs(shapes).max(axis=0)).any():
        return  # a mass in a node of a mode is hardly seen by it
    found = equivalent_masses(
        alpha, omega[:k], shapes, seal_stiffness=springs, normalise=normalise, rows=rows, nonnegative=True
    )
    np.testing.assert_allclose(found.values, masses, rtol=1e-6)
    assert (found.values > 0).all()


@pytest.mark.parametrize("normalise", NORMALISATIONS)
@pytest.mark.parametrize("rows", ["equal", "relative"])
def test_many_models_at_once_are_the_models_one_by_one(normalise, rows):
    rng = np.random.default_rng(3)
    A = rng.normal(size=(20, 3, 3))
    alpha, U = A @ np.swapaxes(A, 1, 2), rng.normal(size=(20, 3, 2))
    options = {"seal_stiffness": [0.1, 0.2, 0.3], "normalise": normalise, "rows": rows}
    U[7, 0, 1] = 0.0
    B, D = design(alpha, [1.0, 2.0], U, **options)
    assert B.shape == (20, 6, 3)
    assert D.shape == (20, 6)
    for i in range(20):
        if i == 7 and normalise == "first":
            assert np.isnan(B[i, 3:]).all(), "a node at the first mass"
            continue
        b, d = design(alpha[i], [1.0, 2.0], U[i], **options)
        np.testing.assert_array_equal(B[i], b)
        np.testing.assert_array_equal(D[i], d)


@settings(max_examples=60, deadline=None)
@given(seed=st.integers(0, 10**6), n=st.integers(1, 4), k=st.integers(1, 3))
def test_nonnegative_masses_meet_the_conditions_of_a_minimum(seed, n, k):
    rng = np.random.default_rng(seed)
    A = rng.normal(size=(n, n))
    inputs = (A @ A.T + np.eye(n)) * 1e-8, rng.uniform(100, 1000, k), rng.normal(size=(n, k))
    found = equivalent_masses(*inputs, nonnegative=True, normalise="length", rows="relative")
    B, D = design(*inputs, normalise="length", rows="relative")
    assert (found.solution >= 0).all()
    pull = (B / np.linalg.norm(B, axis=0)).T @ (D - B @ found.solution) / np.linalg.norm(D)
    assert (pull <= 1e-9).all()
    np.testing.assert_allclose(pull[found.solution > 0], 0.0, atol=1e-9)
    np.testing.assert_allclose(found.residuals, D - B @ found.solution, atol=1e-12)


@pytest.mark.parametrize("nonnegative", [False, True])
def test_masses_that_are_not_determined_are_named(nonnegative):
    alpha = np.ones((3, 3)) * 1e-8
    alpha[2, 2] = 2e-8
    found = equivalent_masses(alpha, [100.0], [[1.0], [1.0], [0.9]], nonnegative=nonnegative)
    assert found.undetermined == ("m1", "m2")
    assert "only m3 and m1 + m2 are determined" in found.describe_rank()
    assert found.answer.numbers.count("not determined") == 2
    # a mass that no mode moves
    still = equivalent_masses(COMPLIANCE, [100.0], [[1.0], [1.0], [0.0]], nonnegative=nonnegative)
    assert still.undetermined == ("m3",)


@each_of(
    ("change", "message"),
    [
        ({"normalise": "last"}, "normalise must be"),
        ({"rows": "heavy"}, "rows must be"),
        ({"seal_stiffness": [1.0, 2.0]}, "one per mass"),
        ({"seal_stiffness": np.nan}, "seal_stiffness must be finite"),
        ({"compliance": np.full((3, 3), np.nan)}, "compliance must be finite"),
        ({"compliance": COMPLIANCE + np.triu(np.full((3, 3), 1e-9), 1)}, "symmetric"),
        ({"compliance": COMPLIANCE[:2]}, "compliance must be"),
        ({"frequencies": [100.0, np.inf]}, "positive and finite"),
        ({"frequencies": [100.0, -1.0]}, "positive and finite"),
        ({"shapes": np.array([[0.0, 1.0], [1.0, 1.0], [1.0, 2.0]])}, "node at the first mass"),
        ({"shapes": np.zeros((3, 2)), "normalise": "length"}, "no displacement"),
        ({"shapes": np.ones((4, 3, 2))}, "one model at a time"),
    ],
)
def test_impossible_inputs_are_refused(change, message):
    inputs = {"compliance": COMPLIANCE, "frequencies": FREQUENCIES[:2], "shapes": SHAPES[:, :2], **change}
    with pytest.raises(ValueError, match=message):
        equivalent_masses(**inputs)
