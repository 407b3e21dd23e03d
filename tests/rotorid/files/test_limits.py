"""Files that are too large, or no files: refused in a sentence before they cost time or memory."""

import io
import os
import time
import zipfile

import openpyxl
import pytest
from tables_data import RUNS, WEIGHTS, complaints, write_book

from rotorid.files import (
    excel_workbook,
    read_harmonic_model,
    read_ode_model,
    read_rotor,
)
from rotorid.files.excel_workbook import read_workbook
from rotorid.files.problems import Problems


@pytest.fixture
def book(tmp_path):
    return write_book(tmp_path / "job.xlsx", {"runs": RUNS, "weights": WEIGHTS})


def words(path):
    problems = Problems()
    assert read_workbook(path, problems) is None
    (problem,) = problems
    return problem.expected


@pytest.mark.parametrize(
    ("limit", "value", "expected"),
    [
        ("MOST_CELLS", 30, "at most 30 cells"),
        ("MOST_UNPACKED", 1000, "unpacked"),
    ],
)
def test_a_workbook_beyond_a_limit(book, monkeypatch, limit, value, expected):
    monkeypatch.setattr(excel_workbook, limit, value)
    assert expected in words(book)


def test_a_bomb_is_not_unpacked(book, monkeypatch):
    stream = io.BytesIO(book.read_bytes())
    with zipfile.ZipFile(stream, "a", zipfile.ZIP_DEFLATED) as archive:
        archive.writestr("xl/media/x.bin", b"\0" * 1_000_000)
    book.write_bytes(stream.getvalue())
    monkeypatch.setattr(excel_workbook, "MOST_UNPACKED", 500_000)
    monkeypatch.setattr(openpyxl, "load_workbook", lambda *_, **__: pytest.fail("read"))
    assert "this one has 1 MB" in words(book)


@pytest.mark.skipif(not hasattr(os, "mkfifo"), reason="no pipes with names")
def test_pipes_and_devices_are_refused_at_once(tmp_path):
    os.mkfifo(tmp_path / "pipe.csv")
    (tmp_path / "zero.csv").symlink_to("/dev/zero")
    for name in ("pipe.csv", "zero.csv"):
        (problem,) = complaints(read_rotor, tmp_path / name)
        assert "no regular file" in problem.expected


NAMES = [f"k{i}" for i in range(5000)]
VALUES = "".join(f"{name} = 1.0\n" for name in NAMES)
MODELS = {
    "estimate": (read_harmonic_model, f'equations = ["k0*X = F"]\nestimate = {NAMES}\n'.replace("'", '"')),
    "known": (read_harmonic_model, f'equations = ["k0*X = F"]\nestimate = ["k0"]\n[known]\n{VALUES}'),

}  # fmt: skip


@pytest.mark.parametrize("key", MODELS)
def test_a_model_of_5000_names_is_refused(tmp_path, key):
    read, text = MODELS[key]
    path = tmp_path / "model.toml"
    path.write_text(text, encoding="utf-8")
    (problem,) = complaints(read, path)
    assert problem.column == key
    assert "at most 1,000 names; these are 5,000" in problem.expected


@pytest.mark.parametrize(
    ("text", "expected"),
    [
        ("a" + ".a" * 200_000 + " = 1\n", "a key of more than 20 parts"),
        ("k = 1\n" * 400_000, "at most 2 MB"),
    ],
)
def test_settings_that_would_take_long_are_refused_soon(tmp_path, text, expected):
    path = tmp_path / "model.toml"
    path.write_text(text, encoding="utf-8")
    begun = time.process_time()
    (problem,) = complaints(read_ode_model, path)
    assert expected in problem.expected
    assert time.process_time() - begun < 5
