"""Records that a job names: what is to be known of them is said, and run-ups want speeds."""

import shutil
from pathlib import Path

import pytest

from rotorid.files import InputError
from rotorid.files.job import read_job

SAMPLE = Path(__file__).parents[3] / "sample_data" / "waveforms"


@pytest.fixture
def job(tmp_path):
    shutil.copytree(SAMPLE, tmp_path, dirs_exist_ok=True)
    return tmp_path / "job.toml"


def test_a_run_up_in_a_job_wants_speeds(job):
    settings = job.with_name("slow_roll.toml")
    settings.write_text(settings.read_text().replace("speeds_rpm = [620]\n", ""))
    with pytest.raises(InputError) as caught:
        read_job(job)
    (problem,) = caught.value.problems
    assert problem.column == "speeds_rpm"
    assert "speeds at which 'slow' are read, whose speed is not steady" in problem.expected
