"""The sample of a real rig: its tables, and the digits in which they are written."""

from __future__ import annotations

import numpy as np
import pytest

from rotorid.files import read_job
from rotorid.samples import sample_data

FOLDER = sample_data() / "rk4"


@pytest.mark.parametrize(
    ("job", "rpm", "amplitude_mil", "phase_deg"),
    [("job.toml", 1206, 0.24863, 70.722), ("job_1004.toml", 1005, 0.13481, 74.639)],
)
def test_what_the_tables_hold(job, rpm, amplitude_mil, phase_deg):
    trials = read_job(FOLDER / job).trials
    assert trials.readings.shape == (3, 11, 1, 4)
    assert not np.isnan(trials.readings).any()
    assert (trials.sensors, trials.planes) == (("p1x", "p1y", "p2x", "p2y"), ("disk 1", "disk 2"))
    assert trials.runs[0] == "BASE"
    assert trials.labels.vibration_unit == "mil"
    np.testing.assert_allclose(trials.speeds, [rpm * np.pi / 30], rtol=1e-12)
    grams = 1e6 * trials.weights.real
    assert dict(zip(trials.runs, map(tuple, grams.round(9)), strict=True)) == {
        "BASE": (0, 0),
        "A001": (3, 0),
        "A002": (6, 0),
        "A007": (48, 0),
        "A008": (60, 0),
        "A009": (0, 3),
        "A015": (0, 48),
        "A017": (3, 3),
        "A018": (6, 6),
        "A019": (12, 12),
        "A020": (24, 24),
    }
    assert trials.readings[0, 0, 0, 0] == pytest.approx(
        amplitude_mil * 25.4e-6 * np.exp(1j * np.deg2rad(phase_deg)), rel=1e-12
    )


@pytest.mark.parametrize("job", ["job.toml", "job_1004.toml"])
def test_digits_are_those_of_the_table(job):
    """Five decimals of a mil and three of a degree, zeros at the end or not."""
    steps = read_job(FOLDER / job).trials.steps
    np.testing.assert_allclose(steps[0], 1e-5 * 25.4e-6, rtol=1e-12)
    np.testing.assert_allclose(steps[1], np.deg2rad(1e-3), rtol=1e-12)
