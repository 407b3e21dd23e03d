"""`rotorid.base.tables`: a table told once, the same numbers from each of its writers."""

import io
import subprocess
import sys

import numpy as np
import openpyxl
import pytest

from rotorid.base.tables import Column, Table, csv, excel, frame, html, terminal

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


def test_csv_keeps_all_digits_and_no_cell_is_a_formula():
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
    text = str(html(SPEEDS))
    assert "<caption>critical speeds</caption>" in text
    assert "&lt;mixed&gt;" in text
    assert f'<span data-key="speeds.0" data-scale="{30 / np.pi!r}">2980.1</span>' in text
    assert ">−4.0</span>" in text
    assert ">–</span>" in text
    assert '<p class="note">without damping</p>' in text


def test_a_frame_has_the_values():
    table = frame(SPEEDS.columns)
    assert list(table.columns) == ["mode", "whirl", "rpm"]
    np.testing.assert_array_equal(table["rpm"], [2980.123456789, -4.0, np.nan])


def test_columns_are_one_dimensional_and_of_one_length():
    with pytest.raises(ValueError, match="one-dimensional"):
        Table("shape", (Column("shape", np.eye(2)),))
    with pytest.raises(ValueError, match="one length"):
        Table("shapes", (Column("node", [1, 2]), Column("mode", [1.0])))
    with pytest.raises(ValueError, match="one length"):
        Table("nothing", ())


def test_pandas_and_openpyxl_are_not_imported_with_it():
    program = (
        "import sys, rotorid.base.tables; print({'pandas', 'openpyxl', 'markupsafe'} & set(sys.modules))"
    )
    shown = subprocess.run([sys.executable, "-c", program], check=True, capture_output=True, text=True)
    assert shown.stdout == "set()\n"
