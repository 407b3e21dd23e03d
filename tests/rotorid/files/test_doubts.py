"""What must not be passed over in silence, and messages that stay readable whatever the file."""

from __future__ import annotations

import numpy as np
import pytest
from tables_data import RUNS, WEIGHTS, complaints, the_only, write_csv

from balancing import correct, estimate_influence
from rotorid.files import (
    job_from_files,
    read_job,
    read_trials,
    write_influence,
)


@pytest.fixture
def files(tmp_path):
    return write_csv(tmp_path / "runs.csv", RUNS), write_csv(tmp_path / "weights.csv", WEIGHTS)


def test_control_characters_in_the_name_of_a_file(tmp_path, files):
    job = tmp_path / "job.toml"
    job.write_text('runs = ".\\runs.csv"\nweights = "weights.csv"\n', encoding="utf-8")
    problem = the_only(complaints(read_job, job), "job.toml", None, "runs", ".\runs.csv", "single quotes")
    assert "write / in its place" in problem.expected
    assert "'.\\runs.csv'" in str(problem)
    assert "\r" not in str(problem)
    [problem] = complaints(read_trials, "no\x1b[31m.csv", files[1])
    assert str(problem).startswith("no\\x1b[31m.csv: expected a file that exists")


@pytest.fixture
def lag(tmp_path, files):
    """A job with lag and against rotation, its stored coefficients, and a baseline run."""
    trials = read_trials(*files, phase="lag", angles="against rotation")
    influence = estimate_influence(trials)
    write_influence(tmp_path / "influence.json", influence)
    write_csv(tmp_path / "now.csv", RUNS[:3])
    return correct(influence)


def test_stored_conventions_hold_for_the_readings_if_nothing_else_is_said(tmp_path, lag):
    read = job_from_files([tmp_path / "now.csv"], influence=tmp_path / "influence.json")
    assert (read.trials.labels.phase, read.trials.labels.angles) == ("lag", "against rotation")
    c = correct(read.influence, read.trials)
    np.testing.assert_allclose(c.weights, lag.weights, rtol=1e-9)
    assert c.to_dict()["conventions"]["angles"] == "against rotation"
    assert "nothing states the conventions of the readings" in c.warnings[0]
    assert c.warnings[0].endswith("phase = lag and angles = against rotation")


def test_stated_conventions_hold_for_the_readings_alone(tmp_path, lag):
    same = job_from_files([tmp_path / "now.csv"], influence=tmp_path / "influence.json", phase="lag")
    np.testing.assert_allclose(correct(same.influence, same.trials).weights, lag.weights, rtol=1e-9)
    turned = [RUNS[0], *([*row[:4], 360 - row[4]] for row in RUNS[1:3])]
    write_csv(tmp_path / "now.csv", turned)
    lead = job_from_files([tmp_path / "now.csv"], influence=tmp_path / "influence.json", phase="lead")
    np.testing.assert_allclose(correct(lead.influence, lead.trials).weights, lag.weights, rtol=1e-9)
    [words] = [w for w in lead.trials.warnings if "phase =" in w]
    assert "the readings are taken with phase = lead, as stated" in words
    assert "the coefficients with phase = lag, as" in words
