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


def as_balanced(job):
    """Readings and their covariances are those of the whole job."""
    found, trials = runs_so_far(job), read_job(job).trials
    covariance = reading_of(trials).covariance(trials)
    assert {found.baseline, *found.mounted} == {*trials.runs}
    assert len(found.channels) == trials.mean[0].size
    for one in found.channels:
        s = int(np.argmin(np.abs(trials.speeds - one.trials.speeds[0])))
        c = trials.sensors.index(one.sensor)
        np.testing.assert_allclose(one.trials.mean[:, 0, 0], trials.mean[:, s, c], rtol=1e-12)
        np.testing.assert_allclose(one.covariance[:, 0, 0], covariance[:, s, c], rtol=1e-9)


@pytest.mark.parametrize("sample", ["turbo_job", "left_in"])
def test_a_finished_job_has_the_readings_and_regions_of_its_trials(sample):
    as_balanced(sample_data() / sample / "job.toml")


def test_the_effect_is_the_largest_change_of_the_files_numbers():
    (effect,) = (one for one in runs_so_far(TURBO).effects() if one.run == "trial 1")
    trials = read_job(TURBO).trials
    change = np.abs(trials.mean[1] - trials.mean[0])
    s, c = np.unravel_index(np.argmax(change), change.shape)
    where = f"{trials.sensors[c]} at {trials.labels.speed_words(trials.speeds[s])}"
    assert effect.words.startswith(f"changes {where} by")
    assert effect.percent == pytest.approx(100 * change[s, c] / abs(trials.mean[0, s, c]))
    assert effect.level == "good"


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
        (effect,) = runs_so_far(folder / "job.toml").effects()
        return effect.level

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
    assert (found.baseline, found.effects()) == ("baseline", [])
    assert [(one.speed, one.sensor) for one in found.channels] == [("3000", "A")]
    assert len(found.figure("3000", "A").axes) == 1
    (tmp_path / "runs.csv").write_text("run,speed_rpm,sensor,amplitude_um_pp,phase_deg\n")
    with pytest.raises(InputError):
        runs_so_far(tmp_path / "job.toml")


def test_errors_and_slow_roll_of_single_channels_are_those_of_the_balance(tmp_path):
    header = "run,speed_rpm,sensor,repeat,amplitude_um_pp,phase_deg\n"
    rows = [
        f"{run},1000,{sensor},{k},{size + k * scatter},{phase}\n"
        for run, size, phase in (("first", 10, 0), ("trial", 12, 40))
        for sensor, scatter in (("A", 0.1), ("B", 1.0))
        for k in (1, 2, 3)
    ]
    (tmp_path / "runs.csv").write_text(header + "".join(rows))
    (tmp_path / "weights.csv").write_text("run,plane,mass_g,angle_deg\ntrial,left,10,0\n")
    job = tmp_path / "job.toml"
    job.write_text(
        'runs = "runs.csv"\nweights = "weights.csv"\nphase = "lag"\nangles = "with rotation"\n'
        "[slow_roll.A]\namplitude = 8\nphase_deg = 0\n[slow_roll.B]\namplitude = 2\nphase_deg = 9\n"
    )
    as_balanced(job)
