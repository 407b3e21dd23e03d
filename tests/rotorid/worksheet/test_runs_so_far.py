"""Readings of a job that is being filled in, beside the library's own numbers for the whole job."""

import shutil

import numpy as np
import pytest

from balancing import reading_of
from rotorid.files import InputError, read_job
from rotorid.samples import sample_data
from rotorid.worksheet.runs_so_far import runs_so_far

TURBO = sample_data() / "turbo_job" / "job.toml"


def copy(tmp_path, sample="turbo_job"):
    shutil.copytree(sample_data() / sample, tmp_path / sample)
    return tmp_path / sample / "job.toml"


@pytest.mark.parametrize("sample", ["turbo_job", "bk_two_plane", "left_in"])
def test_a_finished_job_has_the_readings_and_regions_of_its_trials(sample):
    job = sample_data() / sample / "job.toml"
    found, trials = runs_so_far(job), read_job(job).trials
    covariance = reading_of(trials).covariance(trials)
    assert {found.baseline, *found.trials} == {*trials.runs}
    assert len(found.channels) == trials.mean[0].size
    for one in found.channels:
        s = int(np.argmin(np.abs(trials.speeds - one.trials.speeds[0])))
        c = trials.sensors.index(one.sensor)
        np.testing.assert_allclose(one.trials.mean[:, 0, 0], trials.mean[:, s, c], rtol=1e-12)
        np.testing.assert_allclose(one.covariance[:, 0, 0], covariance[:, s, c], rtol=1e-9)


def test_the_effect_is_the_largest_change_of_the_files_numbers():
    effect = {one["run"]: one for one in runs_so_far(TURBO).to_dict()["runs"]}["trial 1"]
    trials = read_job(TURBO).trials
    change = np.abs(trials.mean[1] - trials.mean[0])
    s, c = np.unravel_index(np.argmax(change), change.shape)
    assert effect["where"] == f"{trials.sensors[c]} at {trials.labels.speed_words(trials.speeds[s])}"
    assert effect["share_percent"] == pytest.approx(100 * change[s, c] / abs(trials.mean[0, s, c]))
    assert effect["level"] == "good"


def changed(job, name, *pairs):
    path = job.parent / name
    text = path.read_text()
    for old, new in pairs:
        assert old in text
        text = text.replace(old, new)
    path.write_text(text)
    return job


def test_rows_that_are_not_finished_are_left_out(tmp_path):
    pairs = [
        ("trial 1,1220,probe 1,9.24,21", "trial 1,1220,probe 1,,21"),
        ("trial 1,1220,probe 2,24.6,22", "trial 1,1220,probe 2,24.6x,"),
    ]
    job = changed(copy(tmp_path), "runs.csv", *pairs)
    with pytest.raises(InputError):
        read_job(job)
    by_place = {(one.speed, one.sensor): one.trials.runs for one in runs_so_far(job).channels}
    assert by_place["1220", "probe 1"] == ("baseline", "trial 2", "trial 3")
    assert by_place["1220", "probe 2"] == ("baseline", "trial 2", "trial 3")
    assert by_place["1220", "probe 3"] == ("baseline", "trial 1", "trial 2", "trial 3")


def test_a_weight_that_does_little_is_said_to(tmp_path):
    rows = "run,speed_rpm,sensor,amplitude,phase_deg\nfirst,3000,A,{},{}\nt,3000,A,{},{}\n"
    folder = tmp_path
    (folder / "job.toml").write_text('runs = "runs.csv"\nweights = "weights.csv"\n')
    (folder / "weights.csv").write_text("run,plane,mass_g,angle_deg\nt,1,5,0\n")

    def level(*numbers):
        (folder / "runs.csv").write_text(rows.format(*numbers))
        (effect,) = runs_so_far(folder / "job.toml").to_dict()["runs"]
        return effect["level"]

    # assumed errors: 2 % and 2°; a change of 3 % is none, of 20 % is seen, of 40 % or of 35° is enough
    assert level("10.00", "90.0", "10.30", "90.0") == "none"
    assert level("10.00", "90.0", "12.00", "90.0") == "weak"
    assert level("10.00", "90.0", "14.00", "90.0") == "good"
    assert level("10.00", "90.0", "10.00", "125.0") == "good"


def test_before_the_first_trial_run_there_is_a_baseline_alone(tmp_path):
    (tmp_path / "job.toml").write_text('runs = "runs.csv"\n')
    (tmp_path / "runs.csv").write_text(
        "run,speed_rpm,sensor,amplitude_um_pp,phase_deg\nbaseline,3000,A,7,20\n"
    )
    found = runs_so_far(tmp_path / "job.toml")
    assert found.to_dict() == {
        "baseline": "baseline",
        "channels": [{"speed": "3000", "sensor": "A"}],
        "runs": [],
    }
    assert len(found.figure("3000", "A").axes) == 1
    with pytest.raises(ValueError, match="nothing is read yet of 'B' at 3000"):
        found.figure("3000", "B")
    (tmp_path / "runs.csv").write_text("run,speed_rpm,sensor,amplitude_um_pp,phase_deg\n")
    with pytest.raises(InputError):
        runs_so_far(tmp_path / "job.toml")
