"""Critical speeds over tabulated bearings: none is missed, also not two within one interval of the table."""

import dataclasses

import dense_rotor
import numpy as np
import pytest
from repetitions import FULL
from whirl_rotors import on_tables

import fem

DRAWN = 200 if FULL else 25
SCAN = 1500 if FULL else 150


def missed(rotor):
    """Crossings that a dense scan sees and the search does not, or the other way round."""
    first, last = rotor.supports[0].speeds[0], rotor.supports[0].speeds[-1]
    speeds = np.linspace(first, last, SCAN)
    at = zip(speeds, dense_rotor.synchronous(rotor, speeds), strict=True)
    seen = np.array([(np.linalg.eigvalsh(K - v**2 * N) < 0).sum() for v, (K, N) in at])
    try:
        found = fem.critical_speeds(rotor, 100).frequencies
    except ValueError as problem:
        assert "no critical speed lies between" in str(problem)  # noqa: PT017
        found = np.zeros(0)
    there = np.histogram(found, speeds)[0]
    # In each step as many as the number of negative eigenvalues tells, or two more that cancel.
    extra = there - np.abs(np.diff(seen))
    return int((extra < 0).sum() + (extra % 2 != 0).sum())


def test_no_crossing_is_missed_in_drawn_tables():
    rng = np.random.default_rng(16)
    wrong = {number: count for number in range(DRAWN) if (count := missed(on_tables(rng)[0]))}
    assert wrong == {}


@pytest.mark.parametrize("dip", [False, True])
def test_two_crossings_within_one_interval(dip):
    """λ = 2 k / m is linear in speed, Ω² is not: closed form, tables as short as can be."""
    m = 20.0
    slope = 2500.0

    def rotor(low, high):
        return fem.Rotor(
            [0.05, 0.05],
            0.2,
            density=0.0,
            discs=[fem.Disc(2, m)],
            supports=[
                fem.Support(node, [99900.0 + slope * (v - 100.0) for v in (low, high)], speeds=(low, high))
                for node in (1, 3)
            ],
        )

    # 2 (99900 + s (Ω − 100)) / m = Ω², with the shaft's own compliance far below.
    roots = np.roots([1.0, -2 * slope / m, -2 * (99900 - 100 * slope) / m])
    low, high = (100.0, 200.0) if not dip else (110.0, 200.0)
    expected = sorted(v for v in roots if low < v < high)
    found = fem.critical_speeds(rotor(low, high), 3)
    np.testing.assert_allclose(found.frequencies, expected, rtol=1e-3)
    one = fem.critical_speeds(rotor(100.0, 200.0), 1)
    assert "the list is cut: 1 more critical speed in this range; -n 2 lists all" in one.cut


def test_inertias_of_impossible_size_are_refused_at_once():
    table = fem.Support(1, [((1e8, 0.0), (0.0, 2e8)), ((2e8, 0.0), (0.0, 3e8))], speeds=(100.0, 1000.0))
    discs = [fem.Disc(2, 10.0, 1e15, 0.1)]
    rotor = fem.Rotor([0.3, 0.7], 0.05, discs=discs, supports=[table, fem.Support(3, 1e8)])
    with pytest.raises(ValueError, match="differ by too many orders of size"):
        fem.critical_speeds(
            dataclasses.replace(rotor, model=fem.Model(rotary_inertia=True, gyroscopic=True)), 2
        )
