"""The sample job: corrections from its sheet, mounted on the simulated rotor that made the sheet."""

import importlib.util
from pathlib import Path

import numpy as np
import pytest

from balancing import correct, estimate_influence
from rotorid.files import read_job

JOB = Path(__file__).resolve().parents[2] / "sample_data" / "turbo_job"


@pytest.fixture(scope="module")
def maker():
    spec = importlib.util.spec_from_file_location("make_job", JOB / "make_job.py")
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    return module


@pytest.fixture(scope="module")
def correction():
    return correct(estimate_influence(read_job(JOB / "job.toml").trials), method="least-squares")


def test_the_tables_are_what_the_script_makes(maker, tmp_path):
    maker.main(tmp_path)
    for name in ("runs.csv", "weights.csv", "check.csv", "check_weights.csv"):
        assert (tmp_path / name).read_text() == (JOB / name).read_text()


def test_a_check_run_on_the_true_rotor(maker, correction):
    """At least 50 times smaller than before, and nothing grows."""
    before, after = np.abs(maker.simulate(np.zeros(3))), np.abs(maker.simulate(correction.weights))
    assert before.max() >= 50 * after.max()
    assert (after < before).all()
