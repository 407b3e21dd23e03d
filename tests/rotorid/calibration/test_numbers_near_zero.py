"""A search may bring a number to zero: its derivatives stay those of the rotor that it began with."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

import fem
from balancing import Trials
from rotorid.calibration import RunReadings

PATHS = ("bearing.tilting_stiffness", "bearing[1].cxx")


@pytest.fixture
def start():
    bearings = [fem.Support(node, 1e6, 50.0, tilting_stiffness=40.0) for node in (1, 5)]
    bearings = [replace(each, damping=((50.0, 0.0), (0.0, 60.0))) for each in bearings]
    return fem.Rotor([0.1] * 4, 0.01, discs=[fem.Disc(3, 0.8)], supports=bearings)


@pytest.fixture
def runs():
    nothing = np.ones((1, 1, 1), dtype=complex)
    trials = Trials(("bare",), np.array([120.0]), ("p",), ("disc",), nothing, np.zeros((1, 1), dtype=complex))
    return RunReadings(trials, (3,), np.ones(1), (fem.Sensor(2, 30.0),))


@pytest.mark.parametrize("path", PATHS)
def test_a_number_that_has_come_near_zero_has_the_derivatives_of_zero(start, runs, path):
    there, near = (runs.coefficients(start, {path: value}, [path])[1] for value in (0.0, 1e-13))
    assert np.abs(there).max() > 0
    np.testing.assert_allclose(near, there, rtol=1e-6)
