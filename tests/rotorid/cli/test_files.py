"""Files of the command line: nothing is overwritten that should stay, nothing is half done."""

from __future__ import annotations

import shutil
import subprocess
import sys

import numpy as np
import pytest

from rotorid.commands.option_values import speeds
from rotorid.samples import sample_data

ROTOR = sample_data() / "rotor23.csv"
BK = sample_data() / "bk_two_plane"


@pytest.fixture
def job(tmp_path):
    for name in ("job.toml", "runs.csv", "weights.csv"):
        shutil.copy(BK / name, tmp_path / name)
    shutil.copy(ROTOR, tmp_path / "rotor.csv")
    return tmp_path


@pytest.mark.parametrize("name", ["runs.csv", "weights.csv", "./../{folder}/runs.csv", "link.csv"])
def test_inputs_are_never_overwritten(cli, job, name):
    (job / "link.csv").symlink_to(job / "runs.csv")
    before = {path: path.read_bytes() for path in job.iterdir()}
    target = job / name.format(folder=job.name)
    for files in (("job.toml",), ("runs.csv", "weights.csv")):
        outcome = cli("balance", *(job / f for f in files), "--output", target)
        assert outcome.code == 2
        assert f"{target}: this is an input of the command" in outcome.err
        assert {path: path.read_bytes() for path in job.iterdir()} == before


@pytest.mark.parametrize("option", ["--output", "--report", "--plot"])
def test_all_results_or_none(cli, job, option):
    others = {"--output": job / "o.csv", "--report": job / "i.html", "--plot": job / "p.png"}
    folder = job / f"folder{others[option].suffix}"
    folder.mkdir()
    others[option] = folder
    before = sorted(job.iterdir())
    outcome = cli("balance", job / "job.toml", *(x for pair in others.items() for x in pair))
    assert outcome.code == 2
    assert outcome.err == f"rotorid: {folder}: cannot be written, it is a folder\n"
    assert outcome.out == ""
    assert sorted(job.iterdir()) == before


@pytest.mark.parametrize(
    ("redirection", "words"), [(">&-", "standard output is closed"), ("> /dev/full", "No space left")]
)
def test_a_result_that_nobody_can_read_is_no_success(redirection, words):
    command = f"{sys.executable} -m rotorid critical {ROTOR} --json {redirection}"
    done = subprocess.run(["bash", "-c", command], capture_output=True, text=True, check=False)
    assert done.returncode == 2
    assert done.stderr.startswith("rotorid: ")
    assert words in done.stderr
    assert len(done.stderr.splitlines()) == 1


def test_names_of_files_cannot_steer_the_terminal(cli, tmp_path):
    outcome = cli("critical", "no\x1b[31m.csv")
    assert outcome.code == 2
    assert "\x1b" not in outcome.err
    assert "no\\x1b[31m.csv" in outcome.err
    # also of those that are written; Linux takes any bytes
    output, report = tmp_path / "o\x1b[31m\udcff.csv", tmp_path / "r\udcff.html"
    outcome = cli("critical", ROTOR, "--output", output, "--report", report)
    assert (outcome.code, "\x1b" in outcome.out, "\udcff" in outcome.out) == (0, False, False)
    shutil.copy(ROTOR, tmp_path / "y\udcff.csv")
    assert cli("critical", tmp_path / "y\udcff.csv", "--report", tmp_path / "r.html").code == 0


def test_links_in_a_circle_are_no_files(cli, tmp_path):
    (tmp_path / "a.csv").symlink_to(tmp_path / "b.csv")
    (tmp_path / "b.csv").symlink_to(tmp_path / "a.csv")
    for words in (("critical", ROTOR, "--output"), ("critical",), ("demo",)):
        outcome = cli(*words, tmp_path / "a.csv")
        assert outcome.code == 2
        assert outcome.err.startswith(f"rotorid: {tmp_path / 'a.csv'}: ")
    assert (tmp_path / "a.csv").is_symlink()


def test_speeds_of_balance_are_in_the_unit_of_the_job(cli):
    job = sample_data() / "turbo_job" / "job.toml"
    found = [
        cli("balance", job, "--planes", "left,right", "--speeds", text, "--json").json
        for text in ("1220,1360", "1220rpm,1360rpm", "1220,1360rpm", f"{1220 / 60!r}Hz, {1360 / 60!r} Hz")
    ]
    assert {r["speed_rpm"] for r in found[0]["residuals"]} == {1220, 1360}
    for other in found[1:]:
        assert other["corrections"] == found[0]["corrections"]


@pytest.mark.parametrize(
    ("text", "expected"),
    [
        ("20Hz,60rpm", [40 * np.pi, 2 * np.pi]),
        ("100 rad/s, 60rpm", [100.0, 2 * np.pi]),
        ("60rpm:120rpm:60rpm", [2 * np.pi, 4 * np.pi]),
        ("1:2:1Hz", [2 * np.pi, 4 * np.pi]),
        ("100:140:30", [100.0, 130.0]),
        ("0:0.3:0.1", [0.0, 0.1, 0.2, 0.3]),
    ],
)
def test_a_unit_at_each_speed(text, expected):
    assert speeds(text) == pytest.approx(expected)


@pytest.mark.parametrize(
    ("text", "words"),
    [
        ("20Hz,100,60rpm", "at the end, or at every one"),
        ("20Hz,100", "at every one"),
        ("1rpm:2Hz:1rpm", "at every one"),
        ("1,,2", "not a range"),
        ("rpm", "not a range"),
        ("1:2", "not a range"),
        ("", "not a range"),
    ],
)
def test_speeds_that_are_none(text, words):
    with pytest.raises(ValueError, match=words):
        speeds(text)
