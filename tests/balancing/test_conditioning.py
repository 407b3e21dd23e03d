"""Conditioning: singular values, refusals, and resolution against errors."""

import numpy as np
import pytest
from balancing_data import complex_normal

from balancing.conditioning import (
    UndeterminedError,
    check_runs,
    conditioning,
)


@pytest.mark.parametrize("near", [0.0, 0.02, 0.3, 5.0])
def test_singular_values_of_scaled_columns(near):
    rng = np.random.default_rng(1)
    W = complex_normal(rng, (6, 3))
    W[:, 2] = 2j * W[:, 0] - W[:, 1] + near * W[:, 2]
    numbers = conditioning(W * [1e-3, 1.0, 1e3], "ABC")
    s = np.linalg.svd(W / np.linalg.norm(W, axis=0), compute_uv=False)
    assert np.allclose(numbers.singular_values, s, atol=1e-12)
    assert numbers.rank == (3 if near else 2)
    assert near == 0 or numbers.condition_number == pytest.approx(s[0] / s[-1])
    assert ("leave one out" in numbers.sentence()) == (near < 1)


@pytest.mark.parametrize(
    ("weights", "words"),
    [
        ([[0, 0], [1, 0]], "no run has a weight greater than zero in plane 'B'"),
        ([[0, 0], [1, 2], [2, 4]], "no run separates plane 'A' from plane 'B'"),
        ([[1, 0], [0, 1]], "add a baseline run"),
    ],
)
def test_runs_that_do_not_determine(weights, words):
    with pytest.raises(UndeterminedError, match=words):
        check_runs([str(k) for k in range(len(weights))], "AB", np.array(weights, dtype=complex))
