"""First shots by the coefficients of a type: drawn types."""

import coverage_fleet as example
import numpy as np

from rotorid.fleet import fit_type


def lower(share, n, deviations=3.0):
    return share - deviations * np.sqrt(share * (1 - share) / n)


def test_first_shots_hold_what_they_say():
    found = []
    for seed in range(8):
        rng = np.random.default_rng([7, seed])
        drawn = example.draw(rng, "each coefficient")
        known = fit_type(drawn.records, *drawn[2:])
        found += [example.shots(rng, drawn, known, m)[0] for m in range(50, 62)]
    found = [shot for shot in found if shot is not None]
    assert len(found) > 60  # of 96; two types have planes that act alike
    left, weights, readings, *_ = np.array(found, dtype=float).T
    assert np.median(left) < 0.32
    assert weights.mean() > lower(0.95, len(found))
    assert 0.90 < readings.mean() < 0.99


def test_odd_machines_are_found_with_their_reason_and_few_others():
    told, others = [], []
    for seed in range(6):
        rng = np.random.default_rng([8, seed])
        own, rest = example.odd_machines(rng, example.draw(rng, "each coefficient"))
        told += own
        others += rest
    assert np.mean([found and why for _, found, why in told]) >= 0.88  # 16 of 18
    assert np.mean(others) < 0.02
