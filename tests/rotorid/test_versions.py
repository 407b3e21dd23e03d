"""Every document and file that is written states its schema version; a reader refuses a later one."""

import json
import logging
import re
import tomllib

import numpy as np
import openpyxl
import pytest
from openpyxl.packaging.custom import IntProperty
from scipy.io import loadmat
from workbook_jobs import as_workbook

import balancing
import rotorid
from rotorid.base.json import SCHEMA_VERSION, now
from rotorid.base.tables import csv_bytes
from rotorid.samples import sample_data

ROTOR = sample_data() / "rotor23.csv"
JOB = sample_data() / "turbo_job" / "job.toml"
MOVING = sample_data() / "motion" / "rotor.toml"
NODES = ("--nodes", "7,12,18", "--modes", "2")
LATER = r"schema_version: found '2', expected 1: a file of a later version needs a newer rotorid"


def test_a_document_and_the_sheet_of_it(cli, tmp_path):
    found = cli("critical", ROTOR, "-n", 1, "--report", tmp_path / "r.html", "--json").json
    assert list(found)[-2:] == ["schema_version", "provenance"]
    assert found["schema_version"] == SCHEMA_VERSION
    page = (tmp_path / "r.html").read_text(encoding="utf-8")
    assert f'<meta name="schema_version" content="{SCHEMA_VERSION}">' in page
    assert f'<meta name="generator" content="rotorid {rotorid.__version__}">' in page
    inside = json.loads(re.search(r'id="result">(.*?)</script>', page, re.DOTALL)[1])
    assert inside["schema_version"] == SCHEMA_VERSION


def test_models_and_rotors_in_files(cli, tmp_path):
    model, moving, rotor = (tmp_path / f"{name}.toml" for name in ("model", "moving", "rotor"))
    assert cli("reduce", ROTOR, *NODES, "--output", model).code == 0
    damping = ("--damping", "0.5,0.5,0.5", "--keep-supports")
    assert cli("reduce", MOVING, *NODES[:2], *damping, "--output", moving).code == 0
    rotorid.write_rotor(rotor, rotorid.read_rotor(MOVING))
    for path in (model, moving, rotor):
        text = path.read_text(encoding="utf-8")
        assert tomllib.loads(text)["schema_version"] == SCHEMA_VERSION
        path.write_text(text.replace("schema_version = 1", "schema_version = 2"), encoding="utf-8")
    record = sample_data() / "fit" / "run_down" / "record.csv"
    for path, words in ((model, ("fit", model, record)), (rotor, ("critical", rotor))):
        ran = cli(*words)
        assert (ran.code, ran.out) == (2, "")
        assert re.search(f"{path.name}, key {LATER}", ran.err), ran.err
    assert re.search(LATER, cli("motion", moving, "--speed", "3000rpm", "--time", "0.1s").err)


@pytest.mark.parametrize("said", ["0", "true", '"1"', "1.5", "[1]"])
def test_what_is_no_version_is_refused(tmp_path, said):
    path = tmp_path / "rotor.toml"
    rotorid.write_rotor(path, rotorid.read_rotor(MOVING))
    text = path.read_text(encoding="utf-8")
    path.write_text(text.replace("schema_version = 1", f"schema_version = {said}"), encoding="utf-8")
    with pytest.raises(rotorid.InputError, match="schema_version: found"):
        rotorid.read_rotor(path)


@pytest.mark.parametrize("ending", [".json", ".npz", ".mat"])
def test_state_spaces(cli, tmp_path, ending):
    path = tmp_path / f"small{ending}"
    assert cli("reduce", ROTOR, *NODES, "--output", path).code == 0
    read = {".json": lambda: json.loads(path.read_text()), ".npz": lambda: np.load(path)}
    assert read.get(ending, lambda: loadmat(path))()["schema_version"] == SCHEMA_VERSION


def test_workbooks(cli, tmp_path):
    path = tmp_path / "job.xlsx"
    assert cli("balance", JOB, "--output", path).code == 0
    made = openpyxl.load_workbook(path).custom_doc_props
    assert made["schema_version"].value == SCHEMA_VERSION
    book = openpyxl.load_workbook(as_workbook(JOB, path))
    book.custom_doc_props.append(IntProperty(name="schema_version", value=SCHEMA_VERSION))
    book.save(path)
    assert cli("balance", path).code == 0
    book.custom_doc_props["schema_version"].value = 2
    book.save(path)
    ran = cli("balance", path)
    assert (ran.code, ran.out) == (2, "")
    assert re.search(LATER, ran.err)


def test_a_table_of_a_later_version(tmp_path):
    job, path = rotorid.read_job(JOB), tmp_path / "w.csv"
    rotorid.write_influence(path, balancing.estimate_influence(job.trials))
    text = path.read_text(encoding="utf-8-sig")
    assert rotorid.read_influence(path).planes == tuple(job.planes)
    path.write_text(f"# schema_version = {SCHEMA_VERSION + 1}\n{text}", encoding="utf-8")
    with pytest.raises(rotorid.InputError, match=LATER):
        rotorid.read_influence(path)
    assert csv_bytes(("a",), [(1,)]) == b"a\n1\n"


@pytest.mark.parametrize("kind", ["job", "rotor", "small", "waveforms"])
def test_schemas_state_it(cli, kind):
    assert cli("schema", kind).json["properties"]["schema_version"]["const"] == SCHEMA_VERSION


def test_the_date_is_that_of_source_date_epoch(monkeypatch):
    monkeypatch.setenv("SOURCE_DATE_EPOCH", "951782400")
    assert now().isoformat() == "2000-02-29T00:00:00+00:00"
    monkeypatch.setenv("SOURCE_DATE_EPOCH", "")
    assert now().year > 2000


def test_what_is_read_and_written_is_logged(tmp_path, caplog):
    """Nothing reaches a program that does not listen: there is a handler that drops it."""
    assert any(isinstance(each, logging.NullHandler) for each in logging.getLogger("rotorid").handlers)
    caplog.set_level(logging.DEBUG, "rotorid.files")
    path = tmp_path / "copy.toml"
    rotorid.write_rotor(path, rotorid.read_rotor(ROTOR))
    shaft = tmp_path / "copy_shaft.csv"
    assert caplog.messages == [
        f"read {ROTOR}, {ROTOR.stat().st_size} bytes",
        *(f"written {one}, {one.stat().st_size} bytes" for one in (shaft, path)),
    ]
