"""`rotorid.base.tables`: a table told once, the same numbers from each of its writers."""

import io
import json

import numpy as np
import openpyxl

from rotorid.base.json import plain
from rotorid.base.tables import Column, Table, csv, excel, frame, html, records, terminal, text

SPEEDS = Table(
    "critical speeds",
    (
        Column("mode", range(1, 4)),
        Column("whirl", ["forward", "=1+1", "<mixed>"]),
        Column("rpm", np.array([2980.123456789, -4.0, np.nan]), "{:.1f}".format, "speeds.*", 30 / np.pi),
    ),
    "without damping",
)


def test_a_terminal_shows_numbers_to_the_right_as_a_reader_sees_them():
    assert terminal(SPEEDS).splitlines() == [
        "  mode  whirl        rpm",
        "  1     forward   2980.1",
        "  2     =1+1        -4.0",
        "  3     <mixed>",
    ]


def test_csv_keeps_the_digits_of_numbers_and_no_cell_is_a_formula():
    assert csv(Table("", (Column("mass", [20.000000000000004]),))) == b"mass\n20.0\n"
    lines = csv(SPEEDS).decode().splitlines()
    assert lines[1:] == [
        "# without damping",
        "mode,whirl,rpm",
        "1,forward,2980.123456789",
        "2, =1+1,-4.0",
        "3,<mixed>,",
    ]


def test_a_workbook_has_a_sheet_for_each_table_and_no_formula():
    book = openpyxl.load_workbook(io.BytesIO(excel(SPEEDS, Table("shapes", (Column("node", [1]),)))))
    assert book.sheetnames == ["critical speeds", "shapes"]
    rows = list(book["critical speeds"].iter_rows(values_only=True))
    assert rows[0][0] == "# without damping"
    assert rows[1:3] == [("mode", "whirl", "rpm"), (1, "forward", 2980.123456789)]
    assert book["critical speeds"]["B4"].data_type == "s"


def test_html_escapes_words_and_tells_where_a_number_comes_from():
    page = str(html(SPEEDS))
    assert "<caption>critical speeds</caption>" in page
    assert "&lt;mixed&gt;" in page
    assert f'<span data-key="speeds.0" data-scale="{30 / np.pi!r}">2980.1</span>' in page
    assert ">−4.0</span>" in page
    assert ">–</span>" in page
    assert '<p class="note">without damping</p>' in page


JOB = (
    Column("plane", ("A", "B")),
    Column("mass_g", np.array([1.25, np.nan]), "{:.2f}".format, title="g"),
    Column("covariance", np.array([[1.0, 0.0], [np.inf, 2.0]]), None),
    Column("runs", np.array([3, 4])),
)


def test_records_are_json_and_nothing_is_null():
    written = records(JOB)
    assert json.loads(json.dumps(written, allow_nan=False)) == written
    assert written == [
        {"plane": "A", "mass_g": 1.25, "covariance": [1.0, 0.0], "runs": 3},
        {"plane": "B", "mass_g": None, "covariance": [None, 2.0], "runs": 4},
    ]


def test_a_frame_has_the_values_and_types_of_the_columns():
    np.testing.assert_array_equal(frame(SPEEDS.columns)["rpm"], [2980.123456789, -4.0, np.nan])
    table = frame((*JOB[:2], JOB[3], Column("std", [None, None])))
    assert [str(kind) for kind in table.dtypes[1:]] == ["float64", "int64", "float64"]
    assert list(table.columns) == ["plane", "mass_g", "runs", "std"]


def test_text_prints_the_columns_that_say_how_and_headings_of_an_empty_table():
    assert text(JOB) == "  plane        g  runs\n  A         1.25     3\n  B                  4"
    assert text((Column("plane", []), Column("g", []))) == "  plane     g"


def test_plain_reaches_into_everything():
    values = plain({"a": {"b": (np.float64(1.0), np.int64(2), np.bool_(True), None, "x", [np.nan])}})
    assert values == {"a": {"b": [1.0, 2, True, None, "x", [None]]}}
    assert [type(value) for value in values["a"]["b"][:3]] == [float, int, bool]
