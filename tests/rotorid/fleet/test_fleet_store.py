"""The store: nothing twice, nothing half, one writer at a time; commands over it."""

import shutil
import subprocess
import sys

import numpy as np
import pandas as pd
import pytest
from repetitions import FULL

from rotorid.fleet.adding import fleet_add, read_jobs
from rotorid.fleet.showing import FleetShowOptions, fleet_show
from rotorid.samples import sample_data
from rotorid.tables.fleet.fleet_store import FleetStore
from rotorid.tables.fleet.fleet_tables import TABLES

parquet = pytest.importorskip("pyarrow.parquet", reason="without the extra rotorid[fleet]")
FANS = sample_data() / "fleet" / "fan-132"
PROGRAM = """
import os, sys
replace, left = os.replace, [int(sys.argv[1])]
def killed(*names):
    if not left[0]:
        os._exit(9)
    left[0] -= 1
    replace(*names)
os.replace = killed
from rotorid.fleet.adding import fleet_add
fleet_add("F", [sys.argv[2]])
"""


@pytest.fixture
def tree(tmp_path, monkeypatch):
    """Two machines, one without a check run."""
    for name in ("132-01", "132-08"):
        shutil.copytree(FANS / name, tmp_path / "tree" / "fan" / name)
    monkeypatch.chdir(tmp_path)
    return tmp_path / "tree"


def test_the_same_job_twice_changes_nothing_wherever_it_lies(tree, cli, monkeypatch):
    first = cli("fleet", "add", "F", "tree", "--json").json
    assert (first["jobs"], first["vectors"], first["known"], first["damaged"]) == (2, 28, 0, [])
    assert first["tables"]["readings"].endswith("readings")
    before = {path: path.read_bytes() for path in (tree.parent / "F").rglob("*.parquet")}
    shutil.copytree(tree / "fan" / "132-08", tree / "elsewhere")
    read = []
    monkeypatch.setattr(
        sys.modules["rotorid.fleet.adding"], "read_jobs", lambda found, _: read.extend(found) or ()
    )
    again = cli("fleet", "add", "F", "tree", "tree/fan").out
    assert read == []  # what its files hold says it, before they are read as a job
    assert again.startswith("Added 0 jobs with 0 vectors to F; 3 jobs known already.")
    assert {path: path.read_bytes() for path in (tree.parent / "F").rglob("*.parquet")} == before


def test_a_job_that_changed_stands_in_place_of_the_older(tree):
    fleet_add("F", [tree])
    store = FleetStore(tree.parent / "F")
    old = store.table("jobs")
    for name in ("check.csv", "check_weights.csv"):
        shutil.copy(FANS / "132-01" / name, tree / "fan" / "132-08")
    job = tree / "fan" / "132-08" / "job.toml"
    job.write_text(
        'check = "check.csv"\ncheck_weights = "check_weights.csv"\n' + job.read_text("utf-8"), "utf-8"
    )
    added = fleet_add("F", [tree])
    assert (added.result.jobs, added.result.known) == (1, 1)
    new = store.table("jobs")
    assert len(new) == len(old) == 2
    assert new.set_index("machine")["check_runs"].to_dict() == {"132-01": 1, "132-08": 1}
    for name in TABLES:
        assert set(store.table(name)["job"]) == set(new["job"]), name
    assert len(pd.read_parquet("F/readings")) == 28 + 16  # the older ones stay
    assert store.known() == {*old["job"], *new["job"]}


def test_what_another_writer_has_added_meanwhile_is_known(tree, monkeypatch):
    def slow(found, workers):
        rows = list(read_jobs(found, workers))
        FleetStore(tree.parent / "F").append(rows[:1])
        return rows

    monkeypatch.setattr(sys.modules["rotorid.fleet.adding"], "read_jobs", slow)
    added = fleet_add("F", [tree])
    assert (added.result.jobs, added.result.vectors, added.result.known) == (1, 12, 1)


def test_tables_are_plain_parquet(tree):
    fleet_add("F", [tree])
    for name, columns in TABLES.items():
        assert list(pd.read_parquet(f"F/{name}")) == list(columns)
        file = parquet.ParquetFile(f"F/{name}/000001.parquet")
        assert file.schema_arrow.metadata[b"schema_version"] == b"1"
        assert file.metadata.row_group(0).column(0).compression == "ZSTD"
        assert "RLE_DICTIONARY" in file.metadata.row_group(0).column(0).encodings
    store = FleetStore(tree.parent / "F")
    assert list(store.table("readings", columns=["job", "run"])) == ["job", "run"]
    assert store.table("readings", machine_type="other").empty
    assert len(store.table("weights", machine_type="fan")) == 2 * 6 + 2


def test_damaged_files_are_named_and_spoil_nothing(tree, cli):
    broken = tree / "fan" / "broken"
    shutil.copytree(FANS / "132-01", broken)
    runs = broken / "runs.csv"
    runs.write_text(runs.read_text("utf-8").replace("trial DE,1480,A,", "trial DE,1480,A,x"), "utf-8")
    (broken / "typo.toml").write_text("runs = \n", "utf-8")
    (broken / "missing.toml").write_text('runs = "none.csv"\nweights = "weights.csv"\n', "utf-8")
    (broken / "cut.xlsx").write_bytes(b"PK no workbook")
    for name in ("compressor/rotor.toml", "waveforms/waveforms.toml", "motion/small.toml"):  # no jobs
        shutil.copy(sample_data() / name, tree)
    found = cli("fleet", "add", "F", "tree", "--json")
    assert found.code == 0
    assert (found.json["jobs"], found.json["known"]) == (2, 0)
    reasons = {row["file"].rpartition("/")[2]: row["reason"] for row in found.json["damaged"]}
    assert set(reasons) == {"job.toml", "typo.toml", "missing.toml", "cut.xlsx"}
    assert "row 6, column amplitude_um_pp: found 'x" in reasons["job.toml"]
    assert "none.csv" in reasons["missing.toml"]
    assert "intact Excel workbook" in reasons["cut.xlsx"]
    alone = cli("fleet", "add", "G", "tree/fan/broken")
    assert (alone.code, alone.out) == (2, "")
    assert alone.err.startswith("rotorid: nothing could be read:")
    assert not (tree.parent / "G").exists()


def test_other_jobs_at_the_same_place_of_two_trees_are_named(tree):
    other = shutil.copytree(tree, tree.parent / "other")
    assert fleet_add("F", [tree, other]).result.known == 2  # the same jobs
    for k, said in enumerate(("", 'machine = "X"\n')):
        job = other / "fan" / "132-08" / "job.toml"
        job.write_text(said + job.read_text("utf-8"), "utf-8")
        runs = job.with_name("runs.csv")
        runs.write_bytes(runs.read_bytes() + b"\n")
        added = fleet_add("F", [tree, other])
        assert (added.result.jobs, len(added.result.damaged)) == (k, 1 - k)
        assert all("at the same place below its tree" in reason for reason in added.result.damaged.values())
    assert set(FleetStore(tree.parent / "F").table("jobs")["machine"]) == {"132-01", "132-08", "X"}


def test_a_killed_writer_leaves_nothing_and_its_lock_goes_with_it(tree):
    for renamed in (0, 3, 5) if FULL else (3,):
        done = subprocess.run([sys.executable, "-c", PROGRAM, str(renamed), "tree"], check=False)
        assert done.returncode == 9
        assert len(list((tree.parent / "F").rglob("*.parquet"))) == renamed
        assert FleetStore(tree.parent / "F").table("readings").empty
        with pytest.raises(ValueError, match="F: there is no job"):
            fleet_show("F")
    own = tree.parent / "F" / "jobs" / "mine.parquet"  # of somebody else
    own.touch()
    assert fleet_add("F", [tree / "fan" / "132-01"]).result.jobs == 1
    assert own.exists()
    own.unlink()
    assert len(list((tree.parent / "F").rglob("*.parquet"))) == len(TABLES)
    assert list((tree.parent / "F").rglob("*.tmp")) == []


def test_show_tells_types_and_machines(tmp_path, cli):
    fleet_add(tmp_path / "F", [sample_data() / "fleet"])
    fleet_add(tmp_path / "F", [sample_data() / "turbo_job" / "holes.toml"])
    document = fleet_show(tmp_path / "F").document
    own = {row["machine_type"]: row for row in document["rows"]}
    told = {"machines": 9, "jobs": 9, "vectors": 120, "coefficients": 60, "outcomes": 7}
    assert {key: own["fan-132"][key] for key in told} == told
    assert (own["fan-132"]["first_date"], own["fan-132"]["last_date"]) == ("2026-01-14", "2026-06-02")
    assert own[""]["rms_after"] is None
    scale = {"132-03": 1e-6, "132-04": 12.7e-6}
    after = []
    for path in sorted(FANS.glob("*/check.csv")):
        comma = path.parent.name == "132-05"
        read = pd.read_csv(path, sep=";" if comma else ",", decimal="," if comma else ".")
        size = read.filter(like="amplitude").iloc[:, 0] * scale.get(path.parent.name, 0.5e-6)
        after.append(np.sqrt(np.mean(size**2)))
    assert own["fan-132"]["rms_after"] == pytest.approx(np.median(after))
    assert [row["machine"] for row in document["machines"]][:2] == ["turbo_job", "132-01"]
    with pytest.raises(ValueError, match="did you mean 'fan-132'"):
        fleet_show(tmp_path / "F", FleetShowOptions(machine_type="fan-123"))


def test_refusals(tree, cli, monkeypatch):
    def refused(*words):
        found = cli("fleet", *words)
        assert (found.code, found.out) == (2, "")
        return found.err

    assert "there is no such fleet" in refused("show", "F")
    assert "there is no balancing job in it" in refused("add", "F", sample_data() / "motion")
    assert "No such file" in refused("add", "F", "none")
    assert "this is no fleet" in refused("add", "tree", "tree")
    fleet_add("F", [tree])
    jobs = tree.parent / "F" / "jobs" / "000001.parquet"
    table = parquet.read_table(jobs)
    parquet.write_table(table.replace_schema_metadata({"schema_version": "2"}), jobs)
    assert "expected tables of version 1, not '2': update rotorid" in refused("show", "F")
    whole = jobs.read_bytes()
    for damaged in (b"PAR1", whole[:4] + bytes(len(whole) // 2) + whole[4 + len(whole) // 2 :]):
        jobs.write_bytes(damaged)
        assert "000001.parquet: expected a whole Parquet table" in refused("show", "F")
    monkeypatch.setitem(sys.modules, "pyarrow.parquet", None)
    monkeypatch.delattr("pyarrow.parquet", raising=False)
    assert "pip install pyarrow" in refused("add", "G", "tree")
