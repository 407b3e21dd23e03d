"""The worksheet over HTTP: who may use it, its numbers, edits that survive, long work, files that break."""

import contextlib
import http.client
import itertools
import json
import shutil
import subprocess
import sys
import time

import pytest
from workbook_jobs import as_workbook
from worksheet.served import command

from rotorid.samples import sample_data

CELL = "runs|baseline|1220|probe 1|1|phase_deg"


def copy(tmp_path, sample="turbo_job"):
    return shutil.copytree(sample_data() / sample, tmp_path / sample)


def at(document, key):
    """What stands at a place of a document."""
    for part in key.split("."):
        document = document[int(part) if part.isdigit() else part]
    return document


def agree(numbers, document):
    """All numbers of a page are those of a document, as far as they are shown."""
    for key, text in numbers.items():
        shown = float(text.rstrip("°"))
        assert shown == pytest.approx(at(document, key), rel=5e-4, abs=0.0500001), key


@pytest.mark.parametrize(
    ("name", "options", "path", "count"),
    [
        ("job.toml", (), "corrections", 6),
        pytest.param("holes.toml", ("--split",), "mounting.holes", 8, marks=pytest.mark.full),
        ("checked.toml", ("--refine",), "left_to_do.add", 6),
    ],
)
def test_every_number_is_that_of_the_command(shared, name, options, path, count):
    served = shared(name)
    state = served.settled()
    numbers = state["numbers"]
    agree(numbers, command(served.job, *options))
    if path == "corrections":  # it prints ± 31 g·mm, ± 5.8°
        assert "left add 423.0 168.9° 31 5.8" in state["words"]
    assert len([key for key in numbers if key.startswith(path)]) == count


def test_who_has_no_token_or_comes_from_elsewhere_is_refused(shared):
    served = shared()
    strangers = [
        {"X_Rotorid_Token": None},
        {"X_Rotorid_Token": "another"},
        {"Host": "rebound.example:80"},
        {"Host": "127.0.0.1"},
        {"Origin": "http://other.example"},
        {"Origin": "null"},
    ]
    for path, body in (("/state", None), ("/edit", {"edits": []}), ("/sheet", None)):
        for headers in strangers:
            status, answer = served.ask(path, body, **headers)
            assert (status, set(answer)) == (403, {"error"}), (path, headers)
        assert served.ask(path, body, Origin=f"http://127.0.0.1:{served.port}")[0] == 200
    for path in ("/", "/worksheet.js", "/worksheet.css"):  # which say nothing of the job
        status, text = served.ask(path, X_Rotorid_Token=None)
        assert (status, served.token in text, "turbo_job" in text) == (200, False, False)


@pytest.mark.parametrize(
    ("path", "body"),
    [
        ("/edit", {"edits": [{"cell": "runs|no such|run", "old": "", "new": "x"}]}),
        ("/edit", {"edits": [{"table": "nothing", "cells": {}}]}),
        ("/edit", {}),
        ("/no_such", {}),
        ("/edit", {"edits": [{"create": "no such", "header": ["run"]}]}),
        ("/trial", {"no_such": "1"}),
        ("/edit", "[" * 100_000),
        ("/edit", '{"edits": null}'),
        ("/edit", "{"),
        ("/edit", '{"edits":[{"cell":[],"new":1}]}'),
    ],
)
def test_what_a_page_should_not_ask_for_is_one_sentence(shared, path, body, monkeypatch):
    served = shared()
    if isinstance(body, str):
        monkeypatch.setattr("worksheet.served.json.dumps", lambda sent: sent)
    status, answer = served.ask(path, body)
    assert status in (400, 409)
    assert answer["error"].count("\n") == 0
    assert "Traceback" not in answer["error"]


@pytest.mark.full
def test_kill_loses_no_finished_cell(tmp_path, serve):
    job = copy(tmp_path) / "job.toml"
    served = serve(job)
    cells = [f"runs|baseline|1220|probe {k}|1|phase_deg" for k in (1, 2, 3, 4)]
    for k, name in enumerate(cells):
        assert served.type(name, str(k))[0] == 200
    served.kill()
    lines = (job.parent / "runs.csv").read_text().splitlines()[1:5]
    assert [line.split(",")[-1] for line in lines] == ["0", "1", "2", "3"]
    assert not [path for path in job.parent.iterdir() if path.name.endswith(".tmp")]
    assert serve(job).settled()["numbers"]


@pytest.mark.full
def test_long_work_is_given_up_when_the_input_changes(tmp_path, serve):
    job = copy(tmp_path) / "holes.toml"
    text = job.read_text().replace("available_g_mm = [150]", "available_g_mm = [5, 7, 11, 13, 17, 19, 23]")
    job.write_text(text.replace("stock = [5]\n", "").replace("holes = 12", "holes = 48"))
    served = serve(job)
    time.sleep(3)
    assert served.state()["busy"] == "computing"
    job.write_text((sample_data() / "turbo_job" / "holes.toml").read_text())
    state = served.noticed(0)
    agree(state["numbers"], command(job, "--split"))


def test_a_trial_weight_with_and_without_the_coefficients(shared):
    served = shared()
    # 10 % of the static load: 0.1 · 25.5 kg · 9.81 m/s² / (ω² · 0.1 m), ω = 2π · 50 Hz: 2.534 g
    status, text = served.ask(
        "/trial", {"load kg": "25,5", "speed rpm": "3000", "radius mm": "100", "lag": ""}
    )
    assert (status, "2.534 g" in " ".join(text)) == (200, True)
    status, text = served.ask("/trial", {"with_job": "on"})
    assert (status, len(text) > 1) == (200, True)


def test_a_problem_has_its_cell_and_names_the_file_alone(shared):
    served = shared()
    served.settled()
    assert served.type(CELL, "915")[0] == 200
    state = served.settled()
    [problem], row = state["problems"], state["tables"]["runs"]["rows"][0]
    assert (problem["at"], problem["column"], problem["value"]) == (row["at"], "phase_deg", "915")
    assert (f"{row['id']}|phase_deg", state["numbers"]) == (CELL, {})
    assert served.ask("/picture")[0] == 400
    assert served.type(CELL, "")[0] == 200
    assert [one["value"] for one in served.settled()["problems"]] == [""]


def test_without_the_extra_one_sentence_says_what_to_install(tmp_path):
    code = "import sys; sys.modules['uvicorn'] = None; from rotorid.cli import main; main()"
    words = [sys.executable, "-c", code, "worksheet", str(tmp_path)]
    done = subprocess.run(words, capture_output=True, text=True, timeout=60)
    assert (done.returncode, done.stdout) == (2, "")
    assert done.stderr == "rotorid: the worksheet needs uvicorn: pip install starlette uvicorn tomlkit\n"


@pytest.mark.parametrize("name", ["job.toml", "holes.toml"])
def test_while_a_check_run_is_typed_the_answer_before_it_stays(shared, name):
    served = shared(name)
    before = served.settled()
    header = (served.job.parent / "runs.csv").read_text().splitlines()[0].split(",")
    row = {"run": "check", "speed_rpm": "1220", "sensor": "probe 1"}
    edits = {"create": "check", "header": header}, {"table": "check", "cells": row}
    assert served.edit(*edits)[0] == 200
    now = served.settled()
    assert now["numbers"] == before["numbers"] != {}
    assert "the check run is not finished" in now["words"]
    assert [one["column"] for one in now["problems"]] == header[3:4]
    assert served.ask("/picture")[1].startswith("<svg")
    assert ("2 × 150" in served.ask("/sheet")[1]) == (name == "holes.toml")


def test_the_address_survives_a_restart(tmp_path, serve, monkeypatch):
    monkeypatch.setenv("XDG_STATE_HOME", str(tmp_path / "state"))
    job = copy(tmp_path) / "job.toml"
    first = serve(job)
    first.kill()
    again = serve(job)
    assert again.address == first.address
    assert (tmp_path / "state" / "rotorid" / "worksheet_key").stat().st_mode & 0o077 == 0
    beside = serve(job)
    assert (beside.token, beside.port != again.port) == (again.token, True)
    assert serve(copy(tmp_path, "left_in") / "job.toml").token != first.token


def test_a_workbook_is_answered_and_not_edited(tmp_path, serve):
    served = serve(as_workbook(sample_data() / "turbo_job" / "job.toml", tmp_path / "job.xlsx"))
    state = served.settled()
    assert state["numbers"]
    assert "edit job.xlsx in Excel: what is saved there appears here" in state["words"]
    assert state["read_only"]
    status, answer = served.edit({"cell": "phase", "old": "lead", "new": "lag"})
    assert (status, "edit job.xlsx in Excel" in answer["error"]) == (400, True)


def test_a_body_in_chunks_is_counted_as_it_comes(shared):
    """Who sends more than the page may is refused, though no header says how much it is."""
    served = shared()
    connection = http.client.HTTPConnection("127.0.0.1", served.port, timeout=60)
    with contextlib.closing(connection):
        headers = {"X-Rotorid-Token": served.token, "Host": f"127.0.0.1:{served.port}"}
        blanks = (b" " * 1_000_000 for _ in range(31))  # of JSON: fewer would be read as any other body
        connection.request("POST", "/edit", itertools.chain(blanks, [b'{"edits": []}']), headers)
        answer = connection.getresponse()
        assert (answer.status, json.loads(answer.read())) == (400, {"error": "at most 30 MB"})
    assert served.edit()[0] == 200


@pytest.mark.parametrize("kind", ["loop", "folder", "outside"])
def test_a_table_that_cannot_be_read_any_more_leaves_no_old_answer(tmp_path, shared, kind):
    served = shared()
    runs = served.job.parent / "runs.csv"
    text = runs.read_text()
    (tmp_path / "outside.csv").write_text(text.replace("3.36,89", "3.36,95"))
    state = served.settled()
    runs.unlink()
    if kind == "folder":
        runs.mkdir()
    else:
        runs.symlink_to(runs if kind == "loop" else tmp_path / "outside.csv")
    now = served.noticed(state["version"])
    assert now["numbers"] == {}
    assert "runs.csv" in now["words"]
    (runs.rmdir if kind == "folder" else runs.unlink)()
    runs.write_text(text)
    assert served.noticed(now["version"])["numbers"] == state["numbers"]


@pytest.mark.parametrize("text", ['runs = "a\\u0000b"', "x = " + "[" * 3000 + "]" * 3000, "runs = "])
def test_a_job_broken_by_hand_and_mended(shared, text):
    served = shared()
    good, state = served.job.read_text(), served.settled()
    served.job.write_text(text)
    broken = served.noticed(state["version"])
    assert (broken["numbers"], "expected" in broken["words"]) == ({}, True)
    served.job.write_text(good)
    assert served.noticed(broken["version"])["numbers"] == state["numbers"]


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
    assert (state["numbers"], "outside the folder" in state["words"]) == ({}, True)
    (folder / "rotor.toml").write_text(rotor)
    state = served.noticed(state["version"])
    lines = (folder / "shaft.csv").read_text().splitlines(keepends=True)
    (folder / "shaft.csv").write_text("".join(lines[:-1]))
    now = served.noticed(state["version"])
    assert now["notice"] == "shaft.csv was changed by another program"
    assert now["words"] != state["words"]
