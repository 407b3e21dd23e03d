"""First shots by the coefficients of a type: drawn types."""

import coverage_fleet as example
import numpy as np
import pytest

from rotorid.fleet.machine_type import fit_type


def lower(share, n, deviations=3.0):
    return share - deviations * np.sqrt(share * (1 - share) / n)


@pytest.mark.parametrize("stated", [True, False])
def test_first_shots_hold_as_often_as_promised(stated):
    """Assumed errors of jobs count as none: regions are too wide rather than too narrow."""
    shots = []
    for seed in range(8):
        rng = np.random.default_rng([7, seed])
        drawn = example.draw(rng, "each coefficient")
        records = [record if stated else record._replace(std=0 * record.std) for record in drawn.records]
        kind = fit_type(records, *drawn[2:])
        assert bool(kind.notes) != stated
        shots += [example.shots(rng, drawn, kind, m)[0] for m in range(50, 62)]
    shots = [shot for shot in shots if shot is not None]
    assert len(shots) > 60  # of 96; two types have planes that act alike
    left, weights, readings, *_ = np.array(shots, dtype=float).T
    assert np.median(left) < 0.32
    assert weights.mean() > lower(0.95, len(shots))
    assert 0.90 < readings.mean() < (0.99 if stated else 1.0)


def test_odd_machines_are_found_with_their_reason_and_few_others():
    told, others = [], []
    for seed in range(6):
        rng = np.random.default_rng([8, seed])
        own, rest = example.odd_machines(rng, example.draw(rng, "each coefficient"))
        told += own
        others += rest
    assert np.mean([found and why for _, found, why in told]) >= 0.88  # 16 of 18
    assert np.mean(others) < 0.02
