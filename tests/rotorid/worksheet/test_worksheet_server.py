"""The worksheet over HTTP: who may use it, its numbers, two windows, edits that survive, long work."""

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


def copy(tmp_path, sample="turbo_job"):
    folder = tmp_path / sample
    shutil.copytree(sample_data() / sample, folder)
    return folder


def plain(document):
    """Without what each run has of its own."""
    document["provenance"].pop("date")
    return document


@pytest.mark.parametrize(
    ("name", "options"),
    [
        ("job.toml", ()),
        pytest.param("holes.toml", ("--split",), marks=pytest.mark.full),
        ("checked.toml", ("--refine",)),
    ],
)
def test_every_number_is_that_of_the_command(shared, name, options):
    served = shared(name)
    document, expected = (
        plain(served.settled()["results"]["answer"]["document"]),
        command(served.job, *options),
    )
    for one in (document, plain(expected)):
        one["provenance"].pop("options")
        one.get("mounting", {}).pop("seconds", None)
    assert document == expected


def test_ninety_five_percent_is_that_of_the_sheet(shared):
    answer = shared().settled()["results"]["answer"]
    first = answer["within"][0]
    # as the command prints it: ± 32 g·mm, ± 5.8°
    assert (round(first["mass"]), round(first["angle_deg"], 1)) == (32, 5.8)


def test_an_edit_changes_one_line_and_every_number_follows(shared):
    served = shared()
    job = served.job
    before = (job.parent / "runs.csv").read_text()
    state = served.settled()
    row = state["tables"]["runs"]["rows"][0]
    edit = {"table": "runs", "row": row["id"], "column": "phase_deg", "old": "89", "new": "95"}
    status, answer = served.edit(edit)
    assert status == 200, answer
    after = (job.parent / "runs.csv").read_text()
    changed = [
        k for k, (a, b) in enumerate(zip(before.splitlines(), after.splitlines(), strict=True)) if a != b
    ]
    assert changed == [1]
    found = served.settled()["results"]["answer"]["document"]
    assert found["corrections"] == command(job)["corrections"]
    assert found["corrections"] != state["results"]["answer"]["document"]["corrections"]


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


def test_the_page_alone_needs_no_token_and_says_nothing_of_the_job(shared):
    served = shared()
    for path in ("/", "/worksheet.js", "/worksheet.css"):
        status, text = served.ask(path, X_Rotorid_Token=None)
        assert status == 200
        assert served.token not in text
        assert "turbo_job" not in text


def test_what_a_page_should_not_ask_for_is_one_sentence(shared):
    served = shared()
    served.settled()
    asked = [
        ("/edit", {"edits": [{"table": "runs", "row": "no such", "column": "run", "old": "", "new": "x"}]}),
        ("/edit", {"edits": [{"table": "nothing", "after": None, "cells": {}}]}),
        ("/edit", {}),
        ("/picture/runs?speed=1&sensor=2", None),
        ("/convention/up-down", None),
        ("/trial", {"options": {"no_such": 1}}),
    ]
    for path, body in asked:
        status, answer = served.ask(path, body)
        assert status in (400, 409), (path, answer)
        assert answer["error"], path
        assert "Traceback" not in answer["error"]
    assert served.state()["results"]["answer"] is not None


@pytest.mark.full
def test_kill_loses_no_finished_cell(tmp_path, serve):
    job = copy(tmp_path) / "job.toml"
    served = serve(job)
    rows = served.state()["tables"]["runs"]["rows"]
    for k, row in enumerate(rows[:12]):
        edit = {
            "table": "runs",
            "row": row["id"],
            "column": "phase_deg",
            "old": row["cells"][-1],
            "new": str(k),
        }
        assert served.edit(edit)[0] == 200
    served.kill()
    lines = (job.parent / "runs.csv").read_text().splitlines()[1:13]
    assert [line.split(",")[-1] for line in lines] == [str(k) for k in range(12)]
    assert not [path for path in job.parent.iterdir() if path.name.endswith(".tmp")]
    again = serve(job).settled()
    assert again["results"]["answer"] is not None


@pytest.mark.full
def test_long_work_runs_aside_and_is_given_up_when_the_input_changes(tmp_path, serve):
    folder = copy(tmp_path)
    job = folder / "holes.toml"
    text = job.read_text().replace("available_g_mm = [150]", "available_g_mm = [5, 7, 11, 13, 17, 19, 23]")
    job.write_text(text.replace("stock = [5]\n", "").replace("holes = 12", "holes = 24"))
    served = serve(job)
    state = served.state()
    while "pieces" not in state["results"]["busy"]:
        state = served.state(state["version"])
    assert "mounting" not in state["results"]["answer"]["document"]
    row = state["tables"]["runs"]["rows"][0]
    edit = {"table": "runs", "row": row["id"], "column": "phase_deg", "old": row["cells"][-1], "new": "97"}
    begun = time.perf_counter()
    assert served.edit(edit)[0] == 200
    state = served.state()
    while "pieces" not in state["results"]["busy"]:
        state = served.state(state["version"])
    assert time.perf_counter() - begun < 3
    assert state["results"]["answer"]["document"]["corrections"] == command(job)["corrections"]


def test_what_there_is_to_look_at_and_to_print(shared):
    served = shared("holes.toml")
    served.settled()
    for path in ("/picture/answer", "/picture/runs?speed=1220&sensor=probe%201"):
        status, text = served.ask(path)
        assert (status, text[:4]) == (200, "<svg"), path
    for name in ("lead-with", "lead-against", "lag-with", "lag-against"):
        status, text = served.ask(f"/convention/{name}")
        assert (status, text.count("<svg")) == (200, 2)
    assert "2 × 150" in served.ask("/sheet")[1]


def test_a_trial_weight_with_and_without_the_coefficients(shared):
    served = shared()
    load = {"load": "25kg", "speed": "3000rpm", "radius": "100mm"}
    status, answer = served.ask("/trial", {"options": load})
    assert status == 200, answer
    # 10 % of the static load: 0.1 · 25 kg · 9.81 m/s² / (ω² · 0.1 m)
    omega = 3000 * 3.141592653589793 / 30
    assert answer["document"]["trial_weights"][0]["mass"] == pytest.approx(
        0.1 * 25 * 9.80665 / (omega**2 * 0.1) * 1e3, rel=1e-3
    )
    status, answer = served.ask("/trial", {"options": {"with_job": True, "plane": "left"}})
    assert (status, answer["picture"][:4]) == (200, "<svg")


def test_a_problem_has_its_cell_and_names_the_file_alone(shared):
    served = shared()
    row = served.settled()["tables"]["runs"]["rows"][2]
    edit = {"table": "runs", "row": row["id"], "column": "phase_deg", "old": row["cells"][-1], "new": "915"}
    assert served.edit(edit)[0] == 200
    results = served.settled()["results"]
    (problem,) = results["problems"]
    assert (problem["table"], problem["row"], problem["column"]) == ("runs", row["id"], "phase_deg")
    assert problem["text"].startswith("'915' stands here; expected")
    assert not problem["missing"]
    assert results["answer"] is None
    assert served.ask("/picture/answer")[0] == 400
    assert served.edit({**edit, "old": "915", "new": ""})[0] == 200
    assert [one["missing"] for one in served.settled()["results"]["problems"]] == [True]


def test_without_the_extra_one_sentence_says_what_to_install(tmp_path):
    code = "import sys; sys.modules['uvicorn'] = None; from rotorid.cli import main; main()"
    words = [sys.executable, "-c", code, "worksheet", str(tmp_path)]
    done = subprocess.run(words, capture_output=True, text=True, timeout=60)
    assert (done.returncode, done.stdout) == (2, "")
    assert done.stderr == "rotorid: the worksheet needs uvicorn: pip install starlette uvicorn tomlkit\n"


@pytest.mark.parametrize("name", ["job.toml", "holes.toml"])
def test_while_a_check_run_is_typed_the_answer_before_it_stays(shared, name):
    served = shared(name)
    before = served.settled()["results"]["answer"]
    header = served.state()["tables"]["runs"]["header"]
    row = {"run": "check", "speed_rpm": "1220", "sensor": "probe 1"}
    edits = {"create": "check", "header": header}, {"table": "check", "after": None, "cells": row}
    assert served.edit(*edits)[0] == 200
    results = served.settled()["results"]
    documents = [one["document"] for one in (results["answer"], before)]
    assert documents[0]["corrections"] == documents[1]["corrections"]
    assert ("mounting" in documents[0]) == (name == "holes.toml")
    assert results["answer"]["warnings"][0].startswith("the check run is not finished")
    assert {one["table"] for one in results["problems"]} == {"check"}
    assert served.ask("/picture/answer")[0] == 200
    assert served.ask("/sheet")[0] == 200


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
    other = serve(copy(tmp_path, "left_in") / "job.toml")
    assert other.token != first.token


def test_a_workbook_is_answered_and_not_edited(tmp_path, serve):
    served = serve(as_workbook(sample_data() / "turbo_job" / "job.toml", tmp_path / "job.xlsx"))
    state = served.settled()
    assert state["results"]["answer"]["document"]["corrections"][0]["plane"] == "left"
    status, answer = served.edit({"key": ["phase"], "old": "lead", "new": "lag"})
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
