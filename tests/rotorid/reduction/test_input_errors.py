"""Errors of inputs of formula (50): against finite differences, exact recomputation and draws made here."""

import json

import numpy as np
import pytest
from book_task_9 import COMPLIANCE, FREQUENCIES, SHAPES

from rotorid.reduction import InputErrors, equivalent_masses, natural_frequencies, reduce_measured


def book(modes, **how):
    return reduce_measured(COMPLIANCE, FREQUENCIES, SHAPES, modes, **how)


@pytest.mark.parametrize(("modes", "sigma"), [(1, 1e-4), (2, 1e-3), (3, 1e-3)])
def test_standard_deviations_agree_with_drawn_inputs(modes, sigma):
    """The inputs are drawn here, apart from the code under test."""
    found = book(modes, errors=InputErrors(sigma, sigma, sigma)).errors
    assert found.warnings == ()
    rng, draws = np.random.default_rng(1), []
    for _ in range(2000):
        noise = sigma * rng.normal(size=(3, 3))
        a = COMPLIANCE * (1 + np.tril(noise) + np.tril(noise, -1).T)
        w = FREQUENCIES[:modes] * (1 + sigma * rng.normal(size=modes))
        U = SHAPES[:, :modes] * (1 + sigma * np.vstack((np.zeros(modes), rng.normal(size=(2, modes)))))
        m = equivalent_masses(a, w, U).values
        draws.append(np.concatenate((m, natural_frequencies(a, m)[0])))
    # two sets of 2000 draws know a standard deviation to 2.2 %, a quantile to 3 %
    std = np.concatenate((found.masses, found.frequencies))
    np.testing.assert_allclose(std, np.std(draws, axis=0), rtol=0.1)


def test_with_one_mode_the_first_frequency_has_no_error_but_its_own():
    found = book(1, errors=InputErrors(1e-4, 2e-4, 1e-4)).errors
    assert found.frequencies[0] == pytest.approx(2e-4 * FREQUENCIES[0], rel=0.05)


def test_masses_that_are_not_known_are_said():
    found = book(1, errors=InputErrors(0.03, 0.0, 0.03)).errors
    assert "the stated errors do not determine m" in " ".join(found.warnings)
    alpha = np.array([[4.0, 3.0], [3.0, 4.0]]) * 1e-8
    found = reduce_measured(alpha, [1000.0], [[1.0], [0.5]], errors=InputErrors(0.01))
    document = json.loads(json.dumps(found.to_dict()))
    assert document["uncertainty"]["natural_frequencies_std_rad_s"][1] is None
    assert "do not determine omega2" in " ".join(found.errors.warnings)


def test_no_errors_give_no_uncertainty():
    found = book(2, errors=InputErrors())
    assert not found.errors.masses.any()
    assert "the masses are ± 0, 0, 0 kg" in found.errors.answer.judgement
    assert book(2).errors is None


@pytest.mark.parametrize(
    ("errors", "message"),
    [
        ({"compliance": 1.3}, "such as 0.013 for 1.3 %"),
        ({"shapes": -0.1}, "from 0 to below 1"),
        ({"frequencies": np.nan}, "from 0 to below 1"),
        ({"compliance": [0.1, 0.2]}, "one number or have shape"),
        ({"frequencies": [0.1, 0.1, 0.1]}, "one number or have shape"),
        ({"compliance": np.full((3, 3), 0.1)}, "one number or have shape"),
    ],
)
def test_impossible_errors_are_refused(errors, message):
    with pytest.raises(ValueError, match=message):
        book(2, errors=InputErrors(**errors))
