"""The same input gives the same bytes: another process, folder, time, order of hashes; the date is stated."""

import json
import os
import shutil
import subprocess
import sys
import zipfile

import pytest

from rotorid.samples import sample_data

EPOCH = "951782400"
DATE = "2000-02-29T00:00:00+00:00"
ROTOR, TURBO = "sample_data/rotor23.csv", "sample_data/turbo_job"
SMALL = f"reduce {ROTOR} --nodes 7,12,18 --modes 2"
COMMANDS = (
    f"balance {TURBO}/holes.toml --split --output job.xlsx --plot balance.svg --report balance.html --json",
    "balance --template form.xlsx",
    f"critical {ROTOR} -n 3 --output modes.xlsx --plot modes.pdf --report rotor.html",
    f"influence {ROTOR} --planes 7,12,18 --sensors 2 --speeds 100,150 --output w.csv --plot w.png --json",
    *(f"{SMALL} --output small.{name}" for name in ("toml", "json", "npz", "mat")),
    "identify sample_data/identify/task_5_1/model.toml sample_data/identify/task_5_1/data.csv "
    "--errors 2,1 --json",
    "fit sample_data/fit/run_down/model.toml sample_data/fit/run_down/record.csv --plot fit.png --json",
)
PROGRAM = """
import contextlib, io, pathlib, sys
import rotorid.cli

for number, command in enumerate(sys.stdin.read().splitlines()):
    sys.argv = ["rotorid", *command.split()]
    with contextlib.redirect_stdout(io.StringIO()) as said, contextlib.suppress(SystemExit):
        rotorid.cli.main()
    pathlib.Path(f"said_{number}.txt").write_text(said.getvalue(), encoding="utf-8")
"""


@pytest.fixture(scope="module")
def twice(tmp_path_factory):
    """Files by name, of two processes one after the other."""
    return [_files(tmp_path_factory.mktemp(name), seed) for name, seed in (("one", "1"), ("another", "2"))]


def _files(folder, seed):
    shutil.copytree(sample_data(), folder / "sample_data")
    known = {*folder.rglob("*")}
    env = os.environ | {"SOURCE_DATE_EPOCH": EPOCH, "PYTHONHASHSEED": seed, "MPLBACKEND": "Agg"}
    program = [sys.executable, "-P", "-c", PROGRAM]
    subprocess.run(program, input="\n".join(COMMANDS), text=True, check=True, cwd=folder, env=env)
    return {path.name: path for path in sorted({*folder.rglob("*")} - known)}


@pytest.mark.full
def test_every_kind_of_file_has_the_same_bytes(twice):
    one, other = twice
    assert {path.suffix for path in one.values()} == {
        *(".txt", ".json", ".toml", ".csv", ".xlsx", ".html", ".png", ".svg", ".pdf", ".npz", ".mat")
    }
    assert list(one) == list(other)
    unlike = [name for name in one if one[name].read_bytes() != other[name].read_bytes()]
    assert not unlike
    assert not [name for name in one if one[name].stat().st_size == 0]


@pytest.mark.full
def test_their_date_is_the_one_stated(twice):
    files = twice[0]
    document = json.loads(files["said_0.txt"].read_text(encoding="utf-8"))
    assert document["provenance"]["date"] == DATE
    assert DATE in files["balance.html"].read_text(encoding="utf-8")
    assert DATE[:10] in files["balance.svg"].read_text(encoding="utf-8")
    assert b"D:20000229000000" in files["modes.pdf"].read_bytes()
    assert b"2000-02-29 00:00:00 UTC" in files["small.mat"].read_bytes()[:116]
    for name in ("job.xlsx", "modes.xlsx"):
        with zipfile.ZipFile(files[name]) as archive:
            assert {part.date_time for part in archive.infolist()} == {(1980, 1, 1, 0, 0, 0)}
            assert archive.read("docProps/core.xml").count(b"2000-02-29T00:00:00Z") == 2
