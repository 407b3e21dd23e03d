"""Errors of calibrated numbers beside the scatter of simulated readings."""

import numpy as np
import pytest
from helpers.calibration.jobs import Runs, machine
from scipy.stats import chi2

from balancing import ReadingErrors
from fem.parameters import with_parameters
from rotorid.calibration import Unknown, calibrate

ERRORS = ReadingErrors(0.02, 0.02)


def test_chi_square_and_errors_of_simulated_readings():
    """Noise as stated: χ² has its mean and quantile, and the numbers scatter as their deviations say."""
    values = {"bearing[1].kxx": 4.4e7, "bearing[2].cyy": 2.2e4, "disc[1].mass": 25.0}
    truth = with_parameters(machine(), values)
    runs, rng, draws = Runs(speeds=(180.0, 300.0), free=False), np.random.default_rng(8), 30
    exact = runs.readings(truth)
    unknowns = [Unknown(path, start=value) for path, value in values.items()]
    found = []
    for _ in range(draws):
        noise = 1 + ERRORS.amplitude * rng.standard_normal(exact.shape)
        turned = np.exp(1j * ERRORS.phase * rng.standard_normal(exact.shape))
        found.append(
            calibrate(
                machine(), unknowns, [runs.data(exact * noise * turned, errors=ERRORS)], side_starts=False
            )
        )
    dof = 2 * 2 * 4 * 3 - 2 * 2 - 3
    assert {each.dof for each in found} == {dof}
    chi = np.array([each.chi_square for each in found])
    assert chi.mean() == pytest.approx(dof, abs=4 * np.sqrt(2 * dof / draws))
    assert np.mean(chi > chi2.ppf(0.8, dof)) == pytest.approx(0.2, abs=4 * np.sqrt(0.16 / draws))
    u = np.array([each.unbalance[0] - list(runs.unbalance.values()) for each in found])
    u = u / np.array([each.unbalance_std[0] for each in found])
    assert np.sqrt((abs(u) ** 2).mean(axis=0) / 2) == pytest.approx(1.0, abs=4 / np.sqrt(4 * draws))
    z = np.array([(each.values - list(values.values())) / each.std for each in found])
    assert z.std(axis=0) == pytest.approx(1.0, abs=4 / np.sqrt(2 * draws))
    assert abs(z.mean(axis=0)).max() < 4 / np.sqrt(draws)
