"""Regions of corrections without phase hold the truth, and what is mounted is worth it (docs/sure.md)."""

import coverage_without_phase as coverage
import pytest

LEAST = {"four": 0.5, "seven": 0.85}
"""Of jobs: to be mounted at 10 %; 95 % at 2 %."""


@pytest.mark.parametrize("line", coverage.LINES, ids=lambda line: line[0])
def test_regions_hold_and_weights_are_worth_mounting(line):
    name, *of = line
    *holds, mount, worse, _ = coverage.shares(400, *of)
    assert holds == pytest.approx([0.95] * 3, abs=0.02 + 2 * (0.07 * 0.93 / 400) ** 0.5)
    assert worse <= 0.02
    if of[1] == 1 and of[0] > 3 and "estimated" not in name:
        assert mount >= (0.95 if of[3] == 0.02 else LEAST[name.split()[0]]) - 0.03
