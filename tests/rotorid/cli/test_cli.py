"""The commands as scripts and people meet them."""

import hashlib
import shutil
import subprocess
import sys

import numpy as np
import pandas as pd
import pytest

import fem
from balancing import correct, estimate_influence
from rotorid.files import read_job, read_rotor
from rotorid.samples import sample_data

ROTOR = sample_data() / "rotor23.csv"
BK = sample_data() / "bk_two_plane"
TURBO = sample_data() / "turbo_job" / "job.toml"


def test_critical_gives_the_speeds_of_the_function(cli):
    document = cli("critical", ROTOR, "-n", 3, "--json").json
    modes = fem.critical_speeds(read_rotor(ROTOR), 3)
    np.testing.assert_allclose(document["critical_speeds_rad_s"], modes.frequencies, rtol=1e-12)
    np.testing.assert_allclose(
        document["critical_speeds_rpm"], np.array(document["critical_speeds_rad_s"]) * 30 / np.pi, rtol=1e-12
    )
    assert len(document["mode_shapes"]) == 3
    assert {len(shape) for shape in document["mode_shapes"]} == {24} == {len(document["positions_m"])}
    assert [shape[0] for shape in document["mode_shapes"]] == pytest.approx([1.0, 1.0, 1.0])


def test_provenance_names_version_files_hashes_date_and_options(cli):
    record = cli("critical", ROTOR, "-n", 2, "--json").json["provenance"]
    assert record["inputs"] == [
        {"file": str(ROTOR), "sha256": hashlib.sha256(ROTOR.read_bytes()).hexdigest()}
    ]
    assert record["options"] == {"number": 2}
    assert record["version"] == "0.1.0"
    assert record["date"].endswith("+00:00")


def test_balance_gives_the_weights_of_the_function(cli):
    document = cli("balance", BK / "job.toml", "--json").json
    expected = correct(estimate_influence(read_job(BK / "job.toml").trials)).to_dict()["corrections"]
    for row, right in zip(document["corrections"], expected, strict=True):
        assert (row["mass"], row["angle_deg"]) == pytest.approx((right["mass"], right["angle_deg"]))
    assert document["rms_after"] < 1e-12
    by_tables = cli("balance", BK / "runs.csv", BK / "weights.csv", "--json").json
    assert by_tables["corrections"] == document["corrections"]


def test_stated_errors_on_the_command_line_give_intervals(cli):
    without = cli("balance", BK / "runs.csv", BK / "weights.csv", "--json").json
    assert without["errors"]["source"] == "assumed"
    with_errors = cli("balance", BK / "runs.csv", BK / "weights.csv", "--errors", "2,1", "--json").json
    assert with_errors["errors"]["source"] == "stated"
    assert 0.01 < with_errors["corrections"][0]["mass_std"] < without["corrections"][0]["mass_std"] < 0.5
    assert with_errors["corrections"][0]["mass"] == pytest.approx(without["corrections"][0]["mass"])


def test_saved_coefficients_balance_from_a_single_run(cli, tmp_path):
    saved = tmp_path / "influence.json"
    full = cli("balance", BK / "job.toml", "--output", saved, "--json").json
    rows = (BK / "runs.csv").read_text(encoding="utf-8").splitlines()
    header = next(r for r in rows if r.startswith("run,"))
    baseline = tmp_path / "baseline.csv"
    initial = [r for r in rows if r.startswith("initial")]
    assert len(initial) == 2
    baseline.write_text("\n".join([header, *initial]) + "\n", encoding="utf-8")
    again = cli("balance", baseline, "--influence", saved, "--json").json
    for a, b in zip(full["corrections"], again["corrections"], strict=True):
        assert a["mass"] == pytest.approx(b["mass"], rel=1e-9)
        assert a["angle_deg"] == pytest.approx(b["angle_deg"], abs=1e-7)


@pytest.mark.parametrize(
    "command",
    [
        ("balance", TURBO),
    ],
)
def test_pictures_and_tables_are_written_and_named(cli, tmp_path, command):
    for ending in ("csv", "xlsx"):
        picture, table = tmp_path / f"p-{ending}.png", tmp_path / f"t.{ending}"
        outcome = cli(*command, "--plot", picture, "--output", table)
        assert outcome.code == 0, outcome.err
        assert f"written: {picture}" in outcome.out
        assert f"written: {table}" in outcome.out
        assert picture.read_bytes().startswith(b"\x89PNG")
        frame = pd.read_csv(table, comment="#") if ending == "csv" else pd.read_excel(table)
        assert len(frame) > 0
    assert sorted(p.suffix for p in tmp_path.iterdir()) == [".csv", ".png", ".png", ".xlsx"]


@pytest.mark.parametrize(
    ("args", "message"),
    [
        (("critical", "nowhere.csv"), "nowhere.csv"),
        (("critical", ROTOR, "--plot", "modes.gif"), ".png, .svg, .pdf"),
        (("critical", ROTOR, "--output", "modes.txt"), ".csv, .xlsx"),
        (("critical", ROTOR, "--plot", "no/such/folder/modes.png"), "does not exist"),
        (("critical", ROTOR, "-n", "0"), "-n"),
        (("critical", ROTOR, "-n", "1000"), "1000"),
        (("reduce", ROTOR, "--nodes", "7,x"), "no station is called 'x'"),
        (("reduce", ROTOR, "--nodes", "7,12,99"), "node 99 does not exist"),
        (("influence", ROTOR, "--planes", "99", "--sensors", "1", "--speeds", "100"), "99"),
        (("influence", ROTOR, "--planes", "7", "--sensors", "1", "--speeds", "a:b"), "not a range"),
        (
            ("influence", ROTOR, "--planes", "7", "--sensors", "1", "--speeds", "5:1:1"),
            "step must be positive",
        ),
        (("influence", ROTOR, "--planes", "7", "--sensors", "1", "--speeds", "nan"), "is not a range"),
        (("balance", TURBO, "--planes", "Z9"), "Z9"),
        (("balance", TURBO, "--speeds", "17rpm"), "17"),
        (("balance", TURBO, "--phase", "leading"), "leading"),
        (("balance", "a.csv", "b.csv", "c.csv"), "a runs table and a weights table"),
        (("balance", ROTOR, ROTOR), "rotor23.csv"),
        (("nonsense",), "nonsense"),
        (("critical",), "ROTOR"),
    ],
)
def test_bad_input_ends_with_status_2_and_one_message(cli, args, message, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    outcome = cli(*args)
    assert outcome.code == 2
    assert message in outcome.err
    assert "Traceback" not in outcome.err
    assert outcome.out == ""
    assert list(tmp_path.iterdir()) == []


def test_a_failing_command_leaves_an_old_picture_alone(cli, tmp_path):
    picture = tmp_path / "p.png"
    picture.write_bytes(b"old")
    assert cli("critical", "nowhere.csv", "--plot", picture).code == 2
    assert picture.read_bytes() == b"old"


def test_module_and_script_are_the_same_program():
    module = subprocess.run(
        [sys.executable, "-m", "rotorid", "--version"], capture_output=True, text=True, check=True
    )
    script = shutil.which("rotorid", path=str(sys.executable.rpartition("/")[0]))
    assert script
    assert (
        subprocess.run([script, "--version"], capture_output=True, text=True, check=True).stdout
        == module.stdout
    )


def test_a_closed_pipe_is_no_error():
    command = f"{sys.executable} -m rotorid critical {ROTOR} --json | true"
    done = subprocess.run(
        ["bash", "-o", "pipefail", "-c", command], capture_output=True, text=True, check=False
    )
    assert "Traceback" not in done.stderr


def test_a_recognised_encoding_is_named_on_standard_error_only(cli, tmp_path, monkeypatch):
    monkeypatch.setattr("warnings.filters", [])
    text = (BK / "runs.csv").read_text(encoding="utf-8").replace("initial", "начало")
    (tmp_path / "runs.csv").write_bytes(text.encode("cp1251"))
    outcome = cli("balance", tmp_path / "runs.csv", BK / "weights.csv", "--json")
    assert outcome.code == 0, outcome.err
    assert outcome.err.startswith("rotorid: Warning: ")
    assert "cp1251" in outcome.err
    assert outcome.json["rank"] == 2
