"""The commands as scripts and people meet them."""

import hashlib
import shutil
import subprocess
import sys

import pandas as pd

from rotorid.samples import sample_data

ROTOR = sample_data() / "rotor23.csv"
BK = sample_data() / "bk_two_plane"
TURBO = sample_data() / "turbo_job" / "job.toml"


def test_provenance_names_version_files_hashes_date_and_options(cli):
    record = cli("critical", ROTOR, "-n", 2, "--json").json["provenance"]
    assert record["inputs"] == [
        {"file": str(ROTOR), "sha256": hashlib.sha256(ROTOR.read_bytes()).hexdigest()}
    ]
    assert record["options"] == {"number": 2}
    assert record["version"] == "0.1.0"
    assert record["date"].endswith("+00:00")


def test_pictures_and_tables_are_written_and_named(cli, tmp_path):
    for ending in ("csv", "xlsx"):
        picture, table = tmp_path / f"p-{ending}.png", tmp_path / f"t.{ending}"
        outcome = cli("balance", TURBO, "--plot", picture, "--output", table)
        assert outcome.code == 0, outcome.err
        assert f"written: {picture}" in outcome.out
        assert f"written: {table}" in outcome.out
        assert picture.read_bytes().startswith(b"\x89PNG")
        frame = pd.read_csv(table, comment="#") if ending == "csv" else pd.read_excel(table)
        assert len(frame) > 0
    assert sorted(p.suffix for p in tmp_path.iterdir()) == [".csv", ".png", ".png", ".xlsx"]


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


def test_a_recognised_encoding_is_named_on_standard_error_only(cli, tmp_path, monkeypatch):
    monkeypatch.setattr("warnings.filters", [])
    text = (BK / "runs.csv").read_text(encoding="utf-8").replace("initial", "начало")
    (tmp_path / "runs.csv").write_bytes(text.encode("cp1251"))
    outcome = cli("balance", tmp_path / "runs.csv", BK / "weights.csv", "--json")
    assert outcome.code == 0, outcome.err
    assert outcome.err.startswith("rotorid: Warning: ")
    assert "cp1251" in outcome.err
    assert outcome.json["rank"] == 2
