"""Intervals contain the truth as often as they say: simulated repetitions of tests whose truth is known."""

import coverage_identify as example
import pytest
from repetitions import highest_share, lowest_share, of_a_mean, repetitions


@pytest.mark.parametrize("case", ["task_5_1", "two_masses"])
def test_intervals_of_output_error_contain_the_truth_in_95_percent(case):
    n = repetitions(2000)
    found = example.repeat(getattr(example, case)(), "output-error", n)
    assert (found.coverage >= lowest_share(n, 0.95)).all(), found.coverage
    assert (found.coverage <= highest_share(n, 0.95)).all(), found.coverage
    # a nonlinear estimate has a bias of its own, of second order in the errors: 0.01 deviations
    assert (abs(found.bias) < of_a_mean(n) + 0.01).all(), found.bias
