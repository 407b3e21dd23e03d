"""The digits in which readings are written."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from cases import each_of
from tables_data import RUNS, WEIGHTS, csv_text, write_book, write_csv

from balancing import ReadingErrors, estimate_influence, refine
from rotorid.files import read_job, read_trials
from rotorid.files.cells import Shown
from rotorid.files.columns import written_steps
from rotorid.files.further_runs import subtract_slow_roll


@each_of(
    "cells, steps",
    [
        (["98", "102"], [1, 1]),
        (["12.75", "13", "12.5"], [0.01, 0.01, 0.01]),
        ([12.75, 13, 12.5], [0.01, 0.01, 0.01]),
        (["12,75", "13", "12,5"], [0.01, 0.01, 0.01]),
        (["12.50", "13.00"], [0.01, 0.01]),
        ([Shown(12.5, "12.50"), Shown(13, "13.00")], [0.01, 0.01]),
        (["1230", "12.3", "1.23", "4"], [1, 0.1, 0.01, 0.01]),
        (["1.2e-3", "1.25E-2", "1e-3"], [1e-4, 1e-4, 1e-4]),
        (["1.2e3"], [100]),
        (["0", "0.00", "1e-999"], [0.01, 0.01, 0.01]),
        (["0", "0.25", "0.5"], [0.01, 0.01, 0.01]),
        ([0.30000000000000004, 0.2], [0.1, 0.1]),
        (["0.30000000000000004", "0.2"], [0.1, 0.1]),
        ([1 / 3], [1e-12]),
        ([".5", "1.", "+2.5"], [0.1, 0.1, 0.1]),
        ([], []),
    ],
)
def test_steps(cells, steps):
    np.testing.assert_allclose(written_steps(cells), steps, rtol=1e-12)


STEPS = np.broadcast_to(np.reshape([0.05e-6, np.deg2rad(1)], (2, 1, 1, 1, 1)), (2, 1, 3, 1, 2))


@pytest.mark.parametrize("separator", [",", ";"])
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
    trials = read_trials(write_csv(tmp_path / "runs.csv", runs), write_csv(tmp_path / "weights.csv", WEIGHTS))
    assert trials.steps.shape == (2, 2, 3, 1, 2)
    np.testing.assert_array_equal(np.isnan(trials.steps[0]), np.isnan(trials.readings))
    # 13.5 counts as it is written: three significant digits, as in 7.25
    expected = [[[0.01, 0.1]], [[0.01, 0.01]], [[0.01, 0.1]]]
    np.testing.assert_allclose(trials.steps[0, 0], np.array(expected) * 0.5e-6, rtol=1e-12)
    # 238.5: all phases are read to a tenth
    np.testing.assert_allclose(np.nanmax(trials.steps[1]), np.deg2rad(0.1), rtol=1e-12)


@pytest.fixture
def trials(tmp_path):
    tables = write_csv(tmp_path / "runs.csv", RUNS), write_csv(tmp_path / "weights.csv", WEIGHTS)
    return read_trials(*tables, errors=ReadingErrors(0.02, 0.02))


def test_steps_of_arrays(trials):
    assert replace(trials, steps=None).steps is None
    for wrong in (STEPS[0], STEPS[..., :1], -STEPS, np.nan * STEPS, np.inf * STEPS):
        with pytest.raises(ValueError, match="steps must be finite, of shape"):
            replace(trials, steps=wrong)


def test_check_runs_keep_theirs(trials, monkeypatch):
    """The joint fit gets the steps of all runs; runs of a program have none."""
    seen = []

    def fit(trials):
        seen.append(trials)
        return estimate_influence(replace(trials, steps=None))  # these hide every effect

    monkeypatch.setattr("balancing.check_run.estimate_influence", fit)
    check = replace(
        trials,
        runs=("check",),
        readings=np.concatenate([trials.readings[:, :1], 1.01 * trials.readings[:, :1]]),
        weights=np.zeros((1, 2)),
        steps=np.full((2, 2, 1, 1, 2), 7e-12),
    )
    for first, expected in (
        (replace(trials, steps=1e-6 * STEPS), 1e-6 * STEPS[:, 0]),
        (replace(trials, steps=None), 0 * STEPS[:, 0]),
    ):
        refine(first, check)
        joint = next(t for t in reversed(seen) if "check" in t.runs)
        np.testing.assert_allclose(joint.steps[:, 0, :3], expected, rtol=1e-12)
        np.testing.assert_array_equal(joint.steps[:, :, 3], 7e-12)
        assert np.isnan(joint.steps[:, 1, :3]).all()
    refine(replace(trials, steps=None), replace(check, steps=None))
    assert seen[-1].steps is None


@pytest.mark.parametrize("ratio", [0.0, 0.3, 1.0, -1.5, 1j])
def test_slow_roll_turns_the_steps(trials, ratio):
    """Amplitude and phase are rounded along and across the measured reading, whatever is left of it."""
    S = ratio * trials.readings[0, 0, 0]
    left = subtract_slow_roll(trials, S)
    assert np.isfinite(left.steps).all()
    for c in range(2):
        whole, now = trials.readings[0, 0, 0, c], left.readings[0, 0, 0, c]
        a, p = trials.steps[:, 0, 0, 0, c]
        b, q = left.steps[:, 0, 0, 0, c]
        if abs(now) > 1e-9 * abs(whole):
            assert b**2 + (q * abs(now)) ** 2 == pytest.approx(a**2 + (p * abs(whole)) ** 2, rel=1e-9)
        if ratio == 0.0:
            assert (b, q) == pytest.approx((a, p), rel=1e-12)
        if ratio == 0.3:  # the same direction, a smaller amplitude
            assert (b, q) == pytest.approx((a, p / 0.7), rel=1e-9)
