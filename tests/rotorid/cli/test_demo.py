"""`rotorid demo`: the main job runs, says what to type, and writes what it promises."""

import pytest

from rotorid.samples import sample_data

PICTURES = ("modes.png", "balance.png", "reduction.png")


def test_the_main_job_runs_and_writes_its_pictures(cli, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    outcome = cli("demo", "d")
    assert outcome.code == 0
    for word in ("1291.45", "Mount these weights", "134.203"):
        assert word in outcome.out, word
    lines = outcome.out.splitlines()
    assert len(lines) <= 24
    assert "Pictures: d/modes.png, d/balance.png, d/reduction.png" in lines
    for picture in PICTURES:
        assert (tmp_path / "d" / picture).read_bytes().startswith(b"\x89PNG")
    assert (tmp_path / "d" / "turbo_job" / "job.toml").is_file()
    assert not [path for path in (tmp_path / "d").rglob("*") if "make_" in path.name]
    assert cli("demo", "d").code == 0  # once more in the same folder


@pytest.mark.parametrize("name", ["rotor23.csv", "turbo_job/job.toml", "modes.png"])
def test_what_people_have_there_is_kept(cli, tmp_path, name):
    mine = tmp_path / "d" / name
    mine.parent.mkdir(parents=True)
    mine.write_text("mine", encoding="utf-8")
    outcome = cli("demo", tmp_path / "d")
    assert outcome.code == 2
    assert f"{mine}: differs from the sample" in outcome.err
    assert [path for path in (tmp_path / "d").rglob("*") if path.is_file()] == [mine]


def test_files_and_the_samples_themselves_are_no_folder_for_it(cli, tmp_path):
    (tmp_path / "file").touch()
    assert "this is a file" in cli("demo", tmp_path / "file").err
    outcome = cli("demo", sample_data())
    assert (outcome.code, "the sample data themselves" in outcome.err) == (2, True)
