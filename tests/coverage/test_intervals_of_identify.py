"""Intervals contain the truth as often as they say: simulated repetitions of tests whose truth is known."""

import coverage_identify as example
import numpy as np
import pytest
from repetitions import FULL, highest_share, lowest_share, of_a_mean, repetitions


@pytest.mark.parametrize("case", ["task_5_1", "two_masses"])
def test_intervals_of_output_error_contain_the_truth_in_95_percent(case):
    n = repetitions(2000)
    found = example.repeat(getattr(example, case)(), "output-error", n)
    assert (found.coverage >= lowest_share(n, 0.95)).all(), found.coverage
    assert (found.coverage <= highest_share(n, 0.95)).all(), found.coverage
    # a nonlinear estimate has a bias of its own, of second order in the errors: 0.01 deviations
    assert (np.abs(found.bias) < of_a_mean(n) + 0.01).all(), found.bias


def test_without_stated_errors_the_residuals_give_honest_intervals():
    found = example.repeat(example.two_masses(), "output-error", 200 if FULL else 150, stated=False)
    assert (found.coverage > 0.91).all(), found.coverage


def test_near_a_resonance_the_linear_estimate_is_biased_and_output_error_is_not():
    case = example.near_resonance()
    plain = example.repeat(case, "equation-error", 150 if FULL else 50, stated=False)
    assert (plain.coverage < 0.4).all(), plain.coverage
    assert (np.abs(plain.bias) > 1.5).all(), plain.bias
    weighted = example.repeat(case, "equation-error", 100 if FULL else 50)
    assert (np.abs(weighted.bias) > 0.5).all(), weighted.bias
    assert (weighted.coverage < 0.9).all(), weighted.coverage
    output = example.repeat(case, "output-error", 200)
    assert (np.abs(output.bias) < 0.3).all(), output.bias
    assert (output.coverage > 0.91).all(), output.coverage
