"""What a script gives to a workflow: numbers of NumPy, texts and values mixed; refusals in words."""

import dataclasses
import json
import threading
from pathlib import Path

import numpy as np
import pytest

from rotorid.cli import _JOBS, _work_of
from rotorid.commands.balance import BalanceOptions, balance
from rotorid.commands.critical import critical
from rotorid.files.disk import each_file_once
from rotorid.report.options import changed, checked, plain
from rotorid.report.outcome import options_of
from rotorid.samples import sample_data

SAMPLES = sample_data()
ROTOR = SAMPLES / "rotor23.csv"
JOB = SAMPLES / "bk_two_plane" / "job.toml"
KINDS = [options_of(_work_of(name)) for names in _JOBS.values() for name in names.split()]
NEEDED = {"speeds": (100.0,), "mass": 1.0, "speed": 1.0, "grade": 1.0, "stations": (6,), "planes": (7,)}


def made(kind, **given):
    needed = {
        field.name: NEEDED.get(field.name, (2,))
        for field in dataclasses.fields(kind)
        if field.default is dataclasses.MISSING
    }
    return kind(**needed | given)


@pytest.mark.parametrize("kind", KINDS)
def test_a_switch_is_true_or_false_and_nothing_else_is(kind):
    for field in dataclasses.fields(kind):
        wrong = "no" if field.type == "bool" else True
        with pytest.raises(ValueError, match=rf"{kind.__name__}\({field.name}=.*(needed|switch)"):
            checked(made(kind, **{field.name: wrong}), kind)


@pytest.mark.parametrize("kind", KINDS)
@pytest.mark.parametrize("value", [float("nan"), float("inf"), np.float64("-inf")])
def test_no_option_is_a_number_that_json_has_not(kind, value):
    for field in dataclasses.fields(kind):
        for given in (value, [value], {"1": value}):
            with pytest.raises(ValueError, match=r"is needed|no switch|no finite number"):
                checked(made(kind, **{field.name: given}), kind)


@pytest.mark.parametrize("kind", KINDS)
def test_each_default_passes_and_is_not_recorded(kind):
    options = checked(made(kind), kind)
    required = {field.name for field in dataclasses.fields(kind) if field.default is dataclasses.MISSING}
    assert changed(options).keys() == required


def test_falsy_values_are_recorded_and_nested_ones_are_plain():
    given = BalanceOptions(
        limit=[], grade="", ridge=0, speeds=np.array([1.0]), errors=(np.int64(2), 1.0), refine=True
    )
    document = {name: plain(value) for name, value in changed(given).items()}
    assert document == {
        "grade": "",
        "ridge": 0,
        "speeds": [1.0],
        "errors": [2, 1.0],
        "refine": True,
    }
    assert type(document["errors"][0]) is int
    assert plain({1: (np.float32(2), Path("a"), np.bool_(True), 1j)}) == {"1": [2.0, "a", True, "1j"]}


def same(one, other):
    documents = [json.loads(json.dumps(found.document, allow_nan=False)) for found in (one, other)]
    for document in documents:
        assert all(type(value) is not str or "np." not in value for value in document["provenance"])
        document.pop("provenance")
    assert documents[0] == documents[1]


def test_a_file_is_read_anew_by_the_next_call_and_once_inside_another_one(tmp_path):
    file = tmp_path / "rotor.csv"
    text = ROTOR.read_text()
    file.write_text(text)
    first = critical(file)
    with each_file_once():
        critical(file)
        file.write_text(text.replace(",0.11,", ",0.12,"))
        same(critical(file), first)
    changed_since = critical(file)
    assert changed_since.provenance["inputs"] != first.provenance["inputs"]
    assert changed_since.result.frequencies[0] != first.result.frequencies[0]


def test_threads_do_not_meet():
    alone = {"rotor": critical(ROTOR), "job": balance(JOB)}
    found = {}
    works = {"rotor": lambda: critical(ROTOR), "job": lambda: balance(JOB)}
    threads = [
        threading.Thread(target=lambda i=i, name=name: found.update({(name, i): works[name]()}))
        for i in range(2)
        for name in works
    ]
    for thread in threads:
        thread.start()
    for thread in threads:
        thread.join()
    assert len(found) == 4
    for (name, _), outcome in found.items():
        same(outcome, alone[name])
