"""The worksheet under files, requests and interruptions that nobody means well."""

import shutil

import pytest

from rotorid.samples import sample_data


def copy(tmp_path, sample="turbo_job"):
    return shutil.copytree(sample_data() / sample, tmp_path / sample)


def corrections(state):
    return state["results"]["answer"]["document"]["corrections"]


@pytest.mark.parametrize("kind", ["loop", "folder", "outside"])
def test_a_table_that_cannot_be_read_any_more_leaves_no_old_answer(tmp_path, shared, kind):
    served = shared()
    folder = served.job.parent
    runs, text = folder / "runs.csv", (folder / "runs.csv").read_text()
    (tmp_path / "outside.csv").write_text(text.replace("3.36,89", "3.36,95"))
    state = served.settled()
    runs.unlink()
    if kind == "folder":
        runs.mkdir()
    else:
        runs.symlink_to(runs if kind == "loop" else tmp_path / "outside.csv")
    now = served.noticed(state["version"])
    assert (now["results"]["answer"], now["results"]["runs"]) == (None, None)
    assert len(now["results"]["problems"]) == 1
    assert now["tables"]["runs"]["read_only"]
    (runs.rmdir if kind == "folder" else runs.unlink)()
    runs.write_text(text)
    assert corrections(served.noticed(now["version"])) == corrections(state)


@pytest.mark.parametrize("text", ['runs = "a\\u0000b"', "x = " + "[" * 3000 + "]" * 3000, "runs = "])
def test_a_job_broken_by_hand_and_mended(shared, text):
    served = shared()
    job = served.job
    good = job.read_text()
    state = served.settled()
    job.write_text(text)
    broken = served.noticed(state["version"])
    assert broken["results"]["answer"] is None
    assert broken["results"]["problems"]
    job.write_text(good)
    assert corrections(served.noticed(broken["version"])) == corrections(state)


def test_a_rotor_file_names_nothing_outside_and_its_tables_are_watched(tmp_path, serve):
    samples, folder = sample_data() / "compressor", tmp_path / "job"
    folder.mkdir()
    for name in ("shaft.csv", "bearing.csv", "seal.csv"):
        shutil.copy(samples / name, folder / name)
    shutil.copy(samples / "shaft.csv", tmp_path / "outside.csv")
    rotor = (samples / "rotor.toml").read_text()
    (folder / "rotor.toml").write_text(rotor.replace('"shaft.csv"', '"../outside.csv"'))
    (folder / "runs.csv").write_text("run,speed_rpm,sensor,amplitude_um,phase_deg\nfirst,3000,A,30,50\n")
    (folder / "job.toml").write_text(
        'runs = "runs.csv"\nrotor = "rotor.toml"\nphase = "lag"\nangles = "with rotation"\n'
        "[planes.left]\nnode = 3\n[sensors.A]\nnode = 4\nangle_deg = 0\n"
    )
    served = serve(folder / "job.toml")
    state = served.settled()
    assert state["results"]["answer"] is None
    assert "outside the folder" in str(state["results"]["problems"])
    (folder / "rotor.toml").write_text(rotor)
    state = served.noticed(state["version"])
    shaft = folder / "shaft.csv"
    lines = shaft.read_text().splitlines(keepends=True)
    shaft.write_text("".join(lines[:-1]))
    now = served.noticed(state["version"])
    assert now["notice"] == "shaft.csv was changed by another program"
    assert now["results"] != state["results"]


@pytest.mark.parametrize("body", ["[" * 100_000, '{"edits": null}', "{", '{"edits":[{"key":[],"new":1}]}'])
def test_a_body_of_any_form_is_refused_with_one_sentence(shared, body, monkeypatch):
    served = shared()
    monkeypatch.setattr("worksheet.served.json.dumps", lambda sent: sent)
    status, answer = served.ask("/edit", body)
    assert status == 400
    assert answer["error"].count("\n") == 0


@pytest.mark.full
def test_errors_and_slow_roll_of_single_channels_are_those_of_the_balance(tmp_path):
    import numpy as np

    from balancing import reading_of
    from rotorid.commands.balance import balance
    from rotorid.worksheet.runs_so_far import runs_so_far

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
    trials = balance(job).job.trials
    covariance = reading_of(trials).covariance(trials)
    for channel in runs_so_far(job).channels:
        at = trials.sensors.index(channel.sensor)
        np.testing.assert_allclose(channel.trials.mean[:, 0, 0], trials.mean[:, 0, at], rtol=1e-12)
        np.testing.assert_allclose(channel.covariance[:, 0, 0], covariance[:, 0, at], rtol=1e-9)
