"""The history of a job: runs, weights, vibration, limits."""

import json
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from balancing_data import GRAM, bruel_kjaer, job, synthetic

from balancing import Limits, correct, estimate_influence
from balancing.correction.history import history
from rotorid.tables import read_job

SAMPLES = Path(__file__).parents[3] / "sample_data"
TRIALS = job(
    [[[3, 4j], [6, 0]], [[1, 2], [5, 8j]]],
    [[0], [2 * GRAM * 1j]],
    speeds=(100.0, 200.0),
    runs=("initial", "trial"),
)
CHECK = replace(
    TRIALS,
    runs=("check",),
    speeds=np.array([200.0]),
    sensors=("s1",),
    readings=[[[[2j]]]],
    weights=[[3 * GRAM]],
)
LIMITS = Limits([np.inf], [[5, 2], [np.inf, 4]], ((),))


def test_run_by_run():
    made = history(TRIALS, CHECK, limits=LIMITS)
    assert made.runs == ("initial", "trial", "check")
    assert made.checks == (False, False, True)
    np.testing.assert_array_equal(made.weights, [[0], [2j * GRAM], [3 * GRAM]])
    np.testing.assert_array_equal(made.largest, [[4, 6], [2, 8], [np.nan, 2]])
    expected = np.sqrt([[12.5, 18], [2.5, 44.5], [np.nan, 4]])
    np.testing.assert_allclose(made.rms, expected, rtol=1e-14)
    np.testing.assert_allclose(made.of_limit, [[2, 0], [1, 2], [np.nan, 0.5]], rtol=1e-14)


def test_json_and_frame():
    made = history(TRIALS, CHECK, limits=LIMITS)
    runs = json.loads(json.dumps(made.to_dict(), allow_nan=False))["runs"]
    assert runs[0]["weights"] == []
    assert runs[1]["weights"] == [{"plane": "A", "mass": 2.0, "unit": "g", "angle_deg": 90.0}]
    assert [run["kind"] for run in runs] == ["trial run", "trial run", "check run"]
    (only,) = runs[2]["speeds"]
    assert (only["sensor"], only["largest"], only["rms"], only["of_limit"]) == ("s1", 2.0, 2.0, 0.5)
    assert only["within_limits"] is True
    assert runs[0]["speeds"][0]["within_limits"] is False
    frame = made.to_frame()
    assert len(frame) == 5
    assert frame["A weight"].tolist()[2:] == [2.0, 2.0, 3.0]
    assert frame["A weight"].isna().tolist() == [True, True, False, False, False]
    assert frame["within_limits"].tolist() == [False, True, True, False, True]
    free = history(TRIALS).to_frame()
    assert free["of_limit"].isna().all()
    assert free["within_limits"].tolist() == [None] * 4


def test_the_table():
    made = history(TRIALS, CHECK, limits=LIMITS).answer
    assert made.found == "Largest reading of each run: initial 6.00, trial 8.00, check 2.00."
    lines = made.tables[0].splitlines()
    assert lines[0] == "History of the job"
    assert lines[1].split() == ["run", "mounted", "g", "rpm", "largest", "rms", "of", "limit"]
    assert lines[2].split() == ["initial", "nothing", "954.93", "4.00", "3.54", "200", "%", "!"]
    assert lines[4].split() == ["trial", "2.000", "at", "90°", "A", "954.93", "2.00", "1.58", "100", "%"]
    assert lines[6].split() == ["check", "3.000", "at", "0°", "A", "1909.86", "2.00", "2.00", "50.0", "%"]
    assert "of limit" not in history(bruel_kjaer()).answer.whole()


def test_planes_below_each_other():
    trials, *_ = synthetic(np.random.default_rng(2), planes=3, speeds=1, weights=[[0, 0, 0], [1, 2, 3]])
    lines = history(trials).answer.tables[0].splitlines()
    assert [line.split()[-1] for line in lines[4:6]] == ["B", "C"]


def test_corrections_that_were_mounted():
    trials = bruel_kjaer()
    proposed = correct(estimate_influence(trials))
    silent = replace(
        trials, runs=("run 0",), planes=(), weights=np.zeros((1, 0)), readings=trials.readings[:, :1]
    )
    made = history(trials, silent, corrections=proposed)
    assert made.runs[-1] == "run 0 (check)"
    np.testing.assert_array_equal(made.weights[-1], proposed.weights)
    with pytest.raises(ValueError, match="what was mounted in the check run 'run 0' is not known"):
        history(trials, silent)
    with pytest.raises(
        ValueError, match="sensor 'x', which the trial runs do not have; they have those of 's0', 's1'"
    ):
        history(trials, replace(silent, sensors=("x", "s1")), corrections={})
    assert history(silent, silent, corrections={}).weights.shape == (2, 0)


def test_the_turbo_job_fits_a_page():
    read = read_job(SAMPLES / "turbo_job" / "checked.toml")
    made = history(read.trials, read.check, limits=read.limits)
    assert made.readings.shape[0] == len(read.trials.runs) + 1
    assert max(map(len, made.answer.tables[0].splitlines())) <= 80
    assert made.rms[-1].max() < made.rms[0].max()
