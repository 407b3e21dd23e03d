"""What spreadsheets write: every dialect gives the same data, and everything else a message."""

from __future__ import annotations

import dataclasses

import numpy as np
import pytest
from tables_data import DATE, RUNS, WEIGHTS, complaints, csv_text, replaced, the_only, write_book, write_csv

from rotorid.files import InputError, TableWarning, read_trials


@pytest.fixture
def weights(tmp_path):
    return write_csv(tmp_path / "weights.csv", WEIGHTS)


@pytest.fixture
def plain(tmp_path, weights):
    return read_trials(write_csv(tmp_path / "plain.csv", RUNS), weights)


def assert_same(a, b):
    assert (a.runs, a.sensors, a.planes, a.labels) == (b.runs, b.sensors, b.planes, b.labels)
    for name in ("speeds", "readings", "weights"):
        np.testing.assert_array_equal(getattr(a, name), getattr(b, name))


COMMA = csv_text(RUNS)
EUROPE = csv_text(RUNS, ";", comma=True)
SPACED = EUROPE.replace(";7,2;", ";\u00a07,2\u00a0;").replace("speed_rpm", "speed_rpm\u00a0")
DIALECTS = {
    "utf-8 with BOM": COMMA.encode("utf-8-sig"),
    "CR": COMMA.replace("\n", "\r").encode(),
    "semicolons, decimal comma": EUROPE.encode(),
    "sep=;": ("sep=;\r\n" + EUROPE).encode("utf-8-sig"),
    "Unicode text": csv_text(RUNS, "\t").replace("\n", "\r\n").encode("utf-16"),
    "NBSP": SPACED.encode(),
    "comments": ("# made by hand; 5,5\n" + COMMA.replace("\n", "\n # and here\n")).encode(),
    "blanks around": COMMA.replace(",", " , ").encode(),
    "a remark": "".join(
        f"{line},{'note' if n == 0 else 'x'}\n" for n, line in enumerate(COMMA.splitlines())
    ).encode(),
}


@pytest.mark.parametrize("name", DIALECTS)
def test_every_dialect_gives_the_same_data(tmp_path, weights, plain, name):
    path = tmp_path / "runs.csv"
    path.write_bytes(DIALECTS[name])
    assert_same(read_trials(path, weights), plain)


@pytest.mark.parametrize(
    ("encoding", "sensors"),
    [
        ("cp1251", ("Опора 1", "Опора 2")),
        ("cp1252", ("Lager süd", "Lager Nord für °")),
    ],
)
def test_an_8_bit_encoding_is_recognised_and_named(tmp_path, weights, plain, encoding, sensors):
    text = EUROPE.replace(";A;", f";{sensors[0]};").replace(";B;", f";{sensors[1]};")
    path = tmp_path / "runs.csv"
    path.write_bytes(text.encode(encoding))
    with pytest.warns(TableWarning, match=rf"runs\.csv: not UTF-8, read as {encoding}"):
        trials = read_trials(path, weights)
    assert trials.sensors == sensors
    assert_same(trials, dataclasses.replace(plain, sensors=sensors))


BAD_FILES = {
    "empty.csv": (b"", "the file is empty"),
    "binary.csv": (bytes(range(256)), "this one is neither"),
    "renamed.csv": (b"PK\x03\x04 and so on", "name it .xlsx"),
    "xls.csv": (b"\xd0\xcf\x11\xe0\xa1\xb1\x1a\xe1", "old workbook"),
    "broken.xlsx": (b"PK\x03\x04 broken", "an intact Excel workbook"),
}


@pytest.mark.parametrize("name", BAD_FILES)
def test_files_that_are_no_tables(tmp_path, weights, name):
    data, words = BAD_FILES[name]
    (tmp_path / name).write_bytes(data)
    the_only(complaints(read_trials, tmp_path / name, weights), name, None, None, None, words)


def test_missing_files_and_sheets(tmp_path, weights):
    write_csv(tmp_path / "runs.csv", RUNS)
    write_book(tmp_path / "two.xlsx", {"one": RUNS, "two": RUNS})
    for name, words in (
        ("rusn.csv", "a file that exists (did you mean 'runs.csv'?)"),
        ("none/runs.xlsx", "a file that exists"),
        ("two.xlsx", "a sheet 'runs'; the sheets are one, two"),
    ):
        found = complaints(read_trials, tmp_path / name, weights)
        the_only(found, name.rpartition("/")[2], None, None, None, words)
    assert complaints(read_trials, "a\0b.csv", weights)


@pytest.mark.parametrize(
    ("text", "row", "value", "words"),
    [
        ("sep=|\n" + COMMA, 1, "sep=|", "sep=; or sep=,"),
        (COMMA.replace("initial,1000,A", '"initial,1000,A'), 2, None, "quotes that are closed"),
    ],
)
def test_tables_that_cannot_be_split(tmp_path, weights, text, row, value, words):
    (tmp_path / "runs.csv").write_text(text)
    first, *_ = complaints(read_trials, tmp_path / "runs.csv", weights)
    assert (first.row, first.column, first.value) == (row, None, value)
    assert words in first.expected


@pytest.mark.parametrize(
    ("value", "shown", "words"),
    [
        (DATE, "2024-05-01 00:00:00", "turned the cell into a date"),
        ("#DIV/0!", "#DIV/0!", "not an error of the spreadsheet"),
        ("=1+1", "=1+1", "open and save the file in Excel"),
    ],
)
def test_cells_of_a_workbook_that_are_no_numbers(tmp_path, weights, value, shown, words):
    path = write_book(tmp_path / "runs.xlsx", {"runs": replaced(RUNS, 4, "amplitude_um_pp", value)})
    found = the_only(complaints(read_trials, path, weights), "runs.xlsx", 4, "amplitude_um_pp", shown, words)
    assert "sheet 'runs'" in found.file


@pytest.mark.parametrize("written", ["1.234,5", "1\u00a0234,5", "1.234"])
def test_thousands_separators_are_not_guessed(tmp_path, weights, written):
    path = tmp_path / "runs.csv"
    path.write_text(EUROPE.replace("13,5", written), encoding="utf-8")
    problems = complaints(read_trials, path, weights)
    assert [(p.row, p.column) for p in problems] == [(3, "amplitude_um_pp")]
    assert "thousands" in problems[0].expected


def test_rows_are_counted_as_a_spreadsheet_shows_them(tmp_path, weights):
    bad = csv_text(replaced(RUNS, 3, "amplitude_um_pp", "x"))
    path = tmp_path / "runs.csv"
    for text, row in ((bad, 3), ("# a\n\n" + bad, 5), ("sep=,\n" + bad, 3), (bad.replace("\n", "\r\n"), 3)):
        path.write_bytes(text.encode())
        the_only(complaints(read_trials, path, weights), "runs.csv", row, "amplitude_um_pp", "x", "a number")


@pytest.mark.parametrize("column", RUNS[0])
@pytest.mark.parametrize("new", ["", "xyz"])
def test_one_wrong_heading_is_one_message(tmp_path, weights, column, new):
    """Of a runs table: nameless, also the last one, or unknown."""
    path = write_csv(tmp_path / "runs.csv", replaced(RUNS, 1, column, new))
    with pytest.raises(InputError) as caught:
        read_trials(path, weights)
    assert str(caught.value).count("\n") == 0
