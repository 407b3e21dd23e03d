"""The form to fill in, and workbooks and CSV files as a European Excel saves them."""

from __future__ import annotations

import datetime
import io

import numpy as np
import openpyxl
import pytest
from cases import each_of
from tables_data import RUNS, WEIGHTS, complaints, replaced, the_only, write_book
from workbook_jobs import differences, filled, rows, with_stored_values

from rotorid.files import read_job
from rotorid.files.job_excel import NAMED, template_bytes
from rotorid.files.job_keys import Errors, JobSettings, Plane, Sensor

FORM = ("runs", "weights", "planes", "sensors", "settings")
SETTINGS = [["key", "value"], ["phase", "lag"], ["errors.phase_deg", 0.5], ["speed_tolerance_percent", 1]]
PLANES = [
    ["plane", "max_mass_g", "forbidden_deg", "holes_deg", "available_g", "taken", "use"],
    ["1", 20.5, "20.5-60", "0; 7.5; 90", "2.5; 5", "2: 2.5", None],
    ["2", None, None, 7.5, 2.5, None, False],
]
SENSORS = [["sensor", "limit", "weight"], ["A", 6.5, 1], ["B", "1000: 6,5", 0.5]]
BOOK = {"runs": RUNS, "weights": WEIGHTS, "planes": PLANES, "sensors": SENSORS, "settings": SETTINGS}


def european(table):
    """Every number as the text that a European spreadsheet program shows."""
    return [
        [str(cell).replace(".", ",") if type(cell) in (int, float) else cell for cell in row] for row in table
    ]


def test_the_form_has_headers_explanations_and_choices():
    book = openpyxl.load_workbook(io.BytesIO(template_bytes()))
    assert tuple(book.sheetnames) == (*FORM, "notes")
    notes = [(row[0], row[1]) for row in book["notes"].iter_rows(values_only=True)]
    for name in FORM:
        keys = [cell.value for cell in (book[name]["A"][1:] if name == "settings" else book[name][1])]
        assert {(name, key) for key in keys} <= set(notes)
        for cell in () if name == "settings" else book[name][1]:
            assert "Allowed" in cell.comment.text, cell.coordinate
    for (sheet, first), model in zip(NAMED.items(), (Plane, Sensor), strict=True):
        names = {cell.value for cell in book[sheet][1]} - {first, "note"}
        assert names <= {name for key in model.known_keys().values() for name in key.variants}
    known = {*JobSettings.known_keys(), *(f"errors.{name}" for name in Errors.known_keys())}
    assert {cell.value for cell in book["settings"]["A"][1:]} <= known


def test_the_form_with_settings(tmp_path):
    """Excel keeps 2% as 0.02, which must not be read as 0.02 percent."""
    planes = [{"plane": "1", "use": "no"}]
    path = filled(tmp_path / "job.xlsx", runs=rows(RUNS), weights=rows(WEIGHTS), planes=planes)
    book = openpyxl.load_workbook(path)
    keys = [cell.value for cell in book["settings"]["A"]]
    phase, error = (book["settings"].cell(keys.index(key) + 1, 2) for key in ("phase", "errors.phase_deg"))
    phase.value, error.value = "lag", "1,5"
    book.save(path)
    job = read_job(path)
    assert (job.conventions.labels.phase, job.used) == ("lag", ("2",))
    assert job.trials.errors.phase == pytest.approx(np.radians(1.5))
    error.value, error.number_format = 0.02, "0%"
    book.save(path)
    (complaint,) = complaints(read_job, path)
    assert "found '2%'" in str(complaint)


def test_text_numbers_with_decimal_commas_are_numbers(tmp_path):
    plain = read_job(write_book(tmp_path / "plain.xlsx", BOOK))
    tables = {name: european(table) for name, table in BOOK.items()}
    tables["planes"][1][1:6] = ["20,5", "20,5-60", "0; 7,5; 90", "2,5; 5", "2: 2,5"]
    for row in (1, 2):
        tables["planes"][row][0] = str(row)
    path = write_book(tmp_path / "job.xlsx", tables)
    job = read_job(path)
    assert differences(plain, job) == ()


@each_of(
    ("sheet", "row", "column", "value", "shown", "words"),
    [
        ("planes", 2, "taken", datetime.time(3, 10), "03:10:00", "turned the cell into a date or time"),
        ("planes", 3, "plane", "9", "9", "one of the job's planes, 1 and 2"),
        ("planes", 2, "max_mass_g", "1,250", "1,250", "may separate thousands"),
        ("settings", 3, "value", "=1/2", "=1/2", "a formula with its stored value"),
    ],
)
def test_cells_that_cannot_be_used_are_explained(tmp_path, sheet, row, column, value, shown, words):
    changed = {**BOOK, sheet: replaced(BOOK[sheet], row, column, value)}
    found = complaints(read_job, write_book(tmp_path / "job.xlsx", changed))
    problem = the_only(found, "job.xlsx", row, column, shown, words)
    assert f"sheet {sheet!r}" in problem.file


def test_formulas_with_stored_values_count(tmp_path):
    runs = replaced(replaced(RUNS, 4, "amplitude_um_pp", "=9.8/2"), 5, "phase_deg", "=E4+1")
    settings = replaced(SETTINGS, 3, "value", "=1/2")
    path = write_book(tmp_path / "job.xlsx", {**BOOK, "runs": runs, "settings": settings})
    with_stored_values(path, [4.9, 347, 0.5])
    job = read_job(path)
    assert differences(job, read_job(write_book(tmp_path / "plain.xlsx", BOOK))) == ()


def test_a_table_is_a_sheet_or_a_file_not_both(tmp_path):
    check = [RUNS[0], ["check", 1000, "A", 0.3, 17], ["check", 1000, "B", 0.7, 301]]
    settings = [["key", "value"], ["check", "check.csv"]]
    path = write_book(tmp_path / "job.xlsx", {**BOOK, "check": check, "settings": settings})
    words = "the table in the sheet 'check' of this workbook, not a file"
    the_only(complaints(read_job, path), "job.xlsx", 2, "value", "check.csv", words)
    path = write_book(tmp_path / "job.xlsx", {**BOOK, "check_weights": WEIGHTS})
    words = "the check runs too"
    the_only(complaints(read_job, path), "job.xlsx", None, "check_weights", None, words)
