"""Tables of results: one tuple of columns as JSON rows, as a DataFrame and as text."""

import json

import numpy as np
import pandas as pd

from rotorid.base.json import plain
from rotorid.base.tables import Column, frame, records, text

COLUMNS = (
    Column("plane", ("A", "B")),
    Column("mass_g", np.array([1.25, np.nan]), "{:.2f}".format, title="g"),
    Column("covariance", np.array([[1.0, 0.0], [np.inf, 2.0]]), None),
    Column("runs", np.array([3, 4])),
)


def test_rows_are_json_and_nothing_is_null():
    found = records(COLUMNS)
    assert json.loads(json.dumps(found, allow_nan=False)) == found
    assert found == [
        {"plane": "A", "mass_g": 1.25, "covariance": [1.0, 0.0], "runs": 3},
        {"plane": "B", "mass_g": None, "covariance": [None, 2.0], "runs": 4},
    ]


def test_frame_keeps_the_types_of_the_columns():
    found = frame((COLUMNS[0], COLUMNS[1], COLUMNS[3], Column("std", [None, 2.0])))
    assert list(found.columns) == ["plane", "mass_g", "runs", "std"]
    assert found["mass_g"].dtype == float
    assert found["std"].dtype == float
    assert pd.isna(found["std"][0])
    assert found["runs"].tolist() == [3, 4]


def test_text_prints_the_columns_that_say_how():
    assert text(COLUMNS) == "  plane        g  runs\n  A         1.25     3\n  B                  4"


def test_an_empty_table_has_its_heading():
    empty = (Column("plane", []), Column("g", []))
    assert records(empty) == []
    assert list(frame(empty).columns) == ["plane", "g"]
    assert text(empty) == "  plane     g"


def test_plain_reaches_into_everything():
    found = plain({"a": {"b": (np.float64(1.0), np.int64(2), np.bool_(True), None, "x", [np.nan])}})
    assert found == {"a": {"b": [1.0, 2, True, None, "x", [None]]}}
    assert [type(value) for value in found["a"]["b"][:3]] == [float, int, bool]
