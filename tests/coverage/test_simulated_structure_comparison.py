"""Comparison with a structure: false alarms and power in drawn readings."""

from dataclasses import replace

import numpy as np
from scipy.stats import f, ncf

from rotorid.harmonic import AmplitudeErrors, harmonic_model
from rotorid.harmonic.simulated_measurements import as_read, forced_vibration
from rotorid.harmonic.structure_comparison import Structure, compare_structures

ERRORS = AmplitudeErrors(0.05, np.deg2rad(3))


W = [7.0, 8.0, 9.0, 9.5, 10.0, 10.5, 11.0, 12.0, 13.0]


DAMPED = "(m*p**2 + b*p + c)*X = F"


def model(equation, estimate, **known):
    return harmonic_model([equation], known=known, estimate=[*estimate])


MASS = model(DAMPED, ["c", "b", "m"])


FIXED = model(DAMPED, ["c", "b"], m=10.0)


def readings(mass=10.0, seed=0, stated=True):
    exact = forced_vibration(MASS, np.array([1000.0, 10.0, mass]), W, {"F": 10.0})
    data = as_read(exact, ["X"], ERRORS, seed=seed)
    return data if stated else replace(data, errors=None)


def compared(small, large, data):
    pair = Structure("small", small, data, {}, {}), Structure("large", large, data, {}, {})
    return compare_structures(pair)


def test_false_alarms_are_as_many_as_said():
    """So many probabilities are below 5, 20 and 50 %, within 3 standard deviations of 100 tables."""
    found = [compared(FIXED, MASS, readings(seed=seed, stated=False)) for seed in range(100)]
    assert {one.special for one in found} == {0}
    chance = np.array([one.f_test[1] for one in found])
    for level in (0.05, 0.2, 0.5):
        share = np.mean(chance < level)
        assert abs(share - level) < 0.3 * np.sqrt(level * (1 - level)), (level, share)


def test_a_wrong_mass_is_found_as_often_as_it_can_be():
    """The power is that of the noncentral F whose parameter is (error of the mass / its std)²."""
    found = [compared(FIXED, MASS, readings(10.4, seed)) for seed in range(50)]
    std = np.mean([one.fits[1].std[2] for one in found])
    power = ncf.sf(f.isf(0.05, 1, 15), 1, 15, (0.4 / std) ** 2)
    assert 0.3 < power < 0.95
    assert abs(np.mean([one.f_test[1] < 0.05 for one in found]) - power) < 3 * np.sqrt(
        power * (1 - power) / 50
    )
