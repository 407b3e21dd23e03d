"""The digits in which readings are written."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from cases import each_of
from tables_data import RUNS, WEIGHTS, csv_text, write_book, write_csv

from rotorid.files import read_job, read_trials

STEPS = np.broadcast_to(np.reshape([0.05e-6, np.deg2rad(1)], (2, 1, 1, 1, 1)), (2, 1, 3, 1, 2))


@each_of(
    "cells, steps",
    [
        (["98", "102"], [1, 1]),
        (["12.75", "13"], [0.01, 0.01]),
        (["12.50", "13.00"], [0.01, 0.01]),
        (["1230", "12.3", "1.23", "4"], [1, 0.1, 0.01, 0.01]),
        (["1.2e-3", "1.25E-2", "1e-3"], [1e-4, 1e-4, 1e-4]),
        (["1.2e3"], [100]),
        (["0", "0.25", "0.5"], [0.01, 0.01, 0.01]),
        (["0.30000000000000004", "0.2"], [0.1, 0.1]),
    ],
)
def test_steps_of_a_column(tmp_path, cells, steps):
    rows = [[f"r{k}", 1000, "A", cell, 10] for k, cell in enumerate(cells)]
    trials = read_trials(write_csv(tmp_path / "runs.csv", [RUNS[0], *rows]), None)
    np.testing.assert_allclose(trials.steps[0].ravel() * 2e6, steps, rtol=1e-12)


@each_of("separator", [",", ";"])
def test_of_a_table(tmp_path, separator):
    """Amplitudes in um_pp become peaks in m, degrees radians: so do the steps."""
    (tmp_path / "runs.csv").write_text(csv_text(RUNS, separator, comma=separator == ";"), encoding="utf-8")
    weights = write_csv(tmp_path / "weights.csv", WEIGHTS)
    np.testing.assert_allclose(read_trials(tmp_path / "runs.csv", weights).steps, STEPS, rtol=1e-12)
    book = write_book(tmp_path / "job.xlsx", {"runs": RUNS, "weights": WEIGHTS})
    np.testing.assert_allclose(read_job(book).trials.steps, STEPS, rtol=1e-12)


def test_gaps_and_repeats(tmp_path):
    header, *lines = RUNS
    runs = [[*header, "repeat"], *([*line, 1] for line in lines), [*lines[0][:3], 7.25, 238.5, 2]]
    trials = read_trials(write_csv(tmp_path / "runs.csv", runs), None)
    np.testing.assert_array_equal(np.isnan(trials.steps[0]), np.isnan(trials.readings))
    # 13.5 counts as it is written: three significant digits, as in 7.25
    expected = [[[0.01, 0.1]], [[0.01, 0.01]], [[0.01, 0.1]]]
    np.testing.assert_allclose(trials.steps[0, 0], np.array(expected) * 0.5e-6, rtol=1e-12)
    # 238.5: all phases are read to a tenth
    np.testing.assert_allclose(np.nanmax(trials.steps[1]), np.deg2rad(0.1), rtol=1e-12)


def test_steps_of_arrays(job):
    trials = job().trials
    for wrong in (STEPS[0], -STEPS, np.inf * STEPS):
        with pytest.raises(ValueError, match="steps must be finite, of shape"):
            replace(trials, steps=wrong)


@each_of("amplitude, degrees", [(2.16, -122), (10.8, 58), (7.2, -32)])
def test_slow_roll_turns_the_steps(job, folder, amplitude, degrees):
    """Amplitude and phase are rounded along and across the measured reading, whatever is left of it."""
    write_csv(folder / "slow.csv", [RUNS[0], ["slow", 150, "A", amplitude, degrees]])
    plain, left = (job(lines).trials for lines in ("", 'slow_roll = "slow.csv"\n'))
    sizes = [abs(trials.readings[0, 0, 0, 0]) for trials in (plain, left)]
    (a, p), (b, q) = (trials.steps[:, 0, 0, 0, 0] for trials in (plain, left))
    assert b**2 + (q * sizes[1]) ** 2 == pytest.approx(a**2 + (p * sizes[0]) ** 2, rel=1e-9)
    if amplitude == 2.16:  # the same direction, a smaller amplitude
        assert (b, q) == pytest.approx((a, p / 0.7), rel=1e-9)
