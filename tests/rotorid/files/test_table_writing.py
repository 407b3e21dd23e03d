"""Written tables: nothing that a spreadsheet would run, whole or not at all."""

from __future__ import annotations

import math

import openpyxl
import pandas as pd
import pytest
from tables_data import complaints, the_only

from rotorid.files import write_table


def test_nothing_that_a_spreadsheet_would_run(tmp_path):
    frame = pd.DataFrame(
        {"name": ["=1+1", "+X", "-Y", "@z", "plain", "two\nlines"], "=bad": [1, 2, 3, 4, 5, 6]}
    )
    write_table(tmp_path / "a.csv", frame)
    lines = (tmp_path / "a.csv").read_text().splitlines()
    assert lines == ["name, =bad", " =1+1,1", " +X,2", " -Y,3", " @z,4", "plain,5", "two lines,6"]
    write_table(tmp_path / "a.xlsx", frame)
    sheet = openpyxl.load_workbook(tmp_path / "a.xlsx").active
    assert {cell.data_type for row in sheet.iter_rows(max_col=1) for cell in row} == {"s"}
    assert sheet["A2"].value == "=1+1"


def test_blanks_logical_values_and_letters(tmp_path):
    frame = pd.DataFrame({"a": [1.5, math.nan], "b": [True, False], "c": ["Опора", None]})
    write_table(tmp_path / "a.csv", frame)
    text = (tmp_path / "a.csv").read_bytes().decode("utf-8-sig")
    assert (tmp_path / "a.csv").read_bytes().startswith(b"\xef\xbb\xbf")
    assert text == "a,b,c\n1.5,true,Опора\n,false,\n"
    with pytest.raises(ValueError, match="infinite"):
        write_table(tmp_path / "b.csv", pd.DataFrame({"a": [math.inf]}))
    with pytest.raises(ValueError, match="control characters"):
        write_table(tmp_path / "b.xlsx", pd.DataFrame({"a": ["bell\x07"]}))
    assert not (tmp_path / "b.csv").exists()


def test_what_cannot_be_written(tmp_path):
    frame = pd.DataFrame({"a": [1]})
    problems = complaints(write_table, tmp_path / "a.txt", frame)
    the_only(problems, "a.txt", None, None, None, "a name that ends in .csv or .xlsx")
    problems = complaints(write_table, tmp_path / "none" / "a.csv", frame)
    the_only(problems, "a.csv", None, None, None, "a file that can be written")
    (tmp_path / "b.csv").mkdir()
    problems = complaints(write_table, tmp_path / "b.csv", frame)
    the_only(problems, "b.csv", None, None, None, "a file that can be written")
    assert [path.name for path in tmp_path.iterdir()] == ["b.csv"]


def test_nothing_half_written(tmp_path, monkeypatch):
    path = tmp_path / "a.csv"
    path.write_text("before")

    def full(*_):
        raise OSError(28, "No space left on device")

    monkeypatch.setattr("pathlib.Path.replace", full)
    problems = complaints(write_bytes, path, b"after")
    the_only(problems, "a.csv", None, None, None, "No space left on device")
    assert path.read_text() == "before"
    assert list(tmp_path.iterdir()) == [path]
